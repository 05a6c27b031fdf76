// SPDX-License-Identifier: Apache-2.0
#include "fleet/json_lines.h"

#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "fleet/shard.h"
#include "json/json.h"

namespace truetriad::fleet {
namespace {

constexpr std::string_view kFormat = "truetriad/runs/";
constexpr std::size_t kLongestHeader = 4096;  // Bytes; that of today has some 50.

Error NoHeader(const std::string& path) {
  return Error(
      ErrorCode::kWrongFormat,
      {path, 1},
      "is no file of runs: expected the header that `fleet run --store=NAME.jsonl` writes, "
      "{\"format\":\"" +
          std::string(kFormat) + std::to_string(kJsonLinesVersion) + "\",…}");
}

Error Unreadable(const std::string& path) {
  return Error(
      ErrorCode::kStoreFailure, {path}, std::string("cannot be read: ") + std::strerror(errno));
}

Result<std::ifstream> Opened(const std::string& path) {
  std::error_code failure;
  std::ifstream file(path, std::ios::binary);
  if (!file) return Unreadable(path);
  if (!std::filesystem::is_regular_file(path, failure)) {
    return Error(ErrorCode::kStoreFailure, {path}, "is no file; name another");
  }
  return file;
}

/// The number behind kFormat.
std::optional<int> VersionOf(const Json& header) {
  if (!header.is_object() || !header.contains("format") || !header["format"].is_string()) {
    return std::nullopt;
  }
  const std::string format = header["format"];
  int version = 0;
  if (!format.starts_with(kFormat)) return std::nullopt;
  const char* const end = format.data() + format.size();
  const auto [stop, failure] = std::from_chars(format.data() + kFormat.size(), end, version);
  return failure == std::errc() && stop == end ? std::optional(version) : std::nullopt;
}

/// Where there is a run, of `shards`.
Result<UnitRun> RunIn(std::string_view line, const StatedShards& shards, const FilePlace& place) {
  Result<UnitRun> run = ReadLine(line);
  if (!run) return Error(run.error().code, place, run.error().message);
  const std::optional<Shard> shard =
      run->shard.empty() ? std::optional(Shard()) : ShardFromText(run->shard);
  if (!shard || shard->count != shards.count ||
      shard->index != shards.only.value_or(shard->index)) {
    return Error(ErrorCode::kDoesNotMatch,
                 place,
                 "is a run of shard `" + run->shard + "`, and the first line says " +
                     (shards.only ? "shard " + std::to_string(*shards.only) + " of " : "") +
                     std::to_string(shards.count));
  }
  return run;
}

}  // namespace

std::string HeaderLine(const StatedShards& shards) {
  Json header = {{"format", std::string(kFormat) + std::to_string(kJsonLinesVersion)},
                 {"shards", shards.count}};
  if (shards.only) header["shard"] = *shards.only;
  return header.dump() + '\n';
}

Result<StatedShards> ReadHeaderLine(const std::string& path, std::string_view line) {
  const Json header = Json::parse(line, nullptr, /*allow_exceptions=*/false);
  const std::optional<int> version = VersionOf(header);
  if (!version || *version < 1) return NoHeader(path);
  if (*version > kJsonLinesVersion) {
    return Error(ErrorCode::kWrongFormat,
                 {path, 1},
                 "has version " + std::to_string(*version) +
                     " of such files, and this program knows " + std::to_string(kJsonLinesVersion) +
                     "; use the newer truetriad that wrote it");
  }
  StatedShards shards;
  const auto number = [&](const char* name) {
    const Json value = header.value(name, Json());
    return value.is_number_integer() ? value.get<std::int64_t>() : -1;
  };
  const std::int64_t count = number("shards");
  if (count < 1 || count > kMostShards) return NoHeader(path);
  shards.count = static_cast<int>(count);
  if (header.contains("shard")) {
    const std::int64_t only = number("shard");
    if (only < 0 || only >= count) return NoHeader(path);
    shards.only = static_cast<int>(only);
  }
  return shards;
}

bool IsCutHeader(std::string_view text) {
  const std::string start = "{\"format\":\"" + std::string(kFormat);
  return text.starts_with(start) || start.starts_with(text);
}

Result<StatedShards> ReadJsonLinesHeader(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::ifstream file, Opened(path));
  std::string text(kLongestHeader, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  const std::size_t end = text.find('\n');
  if (end == std::string::npos && IsCutHeader(text)) return StatedShards();
  return ReadHeaderLine(path, std::string_view(text).substr(0, end));
}

Status ForEachLine(const std::string& path, const std::function<Status(UnitRun)>& take) {
  TRUETRIAD_ASSIGN_OR_RETURN(const StatedShards shards, ReadJsonLinesHeader(path));
  TRUETRIAD_ASSIGN_OR_RETURN(std::ifstream file, Opened(path));
  std::string line;
  std::getline(file, line);
  // At the end of the file, a line has no end of its own.
  for (std::int64_t number = 2; std::getline(file, line) && !file.eof(); ++number) {
    TRUETRIAD_ASSIGN_OR_RETURN(UnitRun run, RunIn(line, shards, {path, number}));
    TRUETRIAD_RETURN_IF_ERROR(take(std::move(run)));
  }
  return file.bad() ? Status(Unreadable(path)) : Status();
}

}  // namespace truetriad::fleet
