// SPDX-License-Identifier: Apache-2.0
//
// Converts a folder with one recording for each face of a block to a recording of six named rests.
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "tools/convert/common/converter.h"
#include "tools/convert/common/recording_folder.h"
#include "truetriad/io/recording.h"

namespace truetriad::convert {
namespace {

namespace fs = std::filesystem;

/// A face, named by the axis that points up. Its file is called `name` or `word`.
struct Face {
  std::string_view name;
  std::string_view word;
};
constexpr std::array<Face, 6> kFaces = {{{"+x", "x_up"},
                                         {"-x", "x_down"},
                                         {"+y", "y_up"},
                                         {"-y", "y_down"},
                                         {"+z", "z_up"},
                                         {"-z", "z_down"}}};

/// The file of a face; nullopt if there is none. Error: there are several.
Result<std::optional<fs::path>> FileOf(const Face& face, const fs::path& folder) {
  std::optional<fs::path> found;
  for (const std::string_view name : {face.name, face.word}) {
    for (const std::string_view extension : {".csv", ".csv.gz", ".yaml"}) {
      const fs::path path = folder / (std::string(name) + std::string(extension));
      std::error_code missing;
      if (!fs::is_regular_file(path, missing)) continue;
      if (found) {
        return Error(ErrorCode::kDoesNotMatch,
                     {path.string()},
                     found->filename().string() + " is the same face; keep one of them");
      }
      found = path;
    }
  }
  return found;
}

/// The contents of one file. Readings are kept by time, so that triads of different rates can share
/// rows.
struct Rest {
  struct Row {
    std::array<double, 9> readings{};
    double temperature_degc = 0.0;
    unsigned present = 0;
  };
  std::vector<StreamInfo> streams;
  std::map<std::int64_t, Row> rows;
};

Result<Rest> ReadRest(const fs::path& path) {
  // Rests are short, but a wrong file may be long.
  constexpr std::size_t kMostRows = 20'000'000;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<SampleSource> source,
                             OpenRecording(path.string()));
  Rest rest;
  rest.streams = source->info().streams;
  if (!source->info().has_time) {
    return Error(ErrorCode::kMissingTime,
                 {path.string()},
                 "has no time column; use a pose table directly, it needs no conversion");
  }
  std::vector<SampleBlock> blocks;
  for (;;) {
    TRUETRIAD_ASSIGN_OR_RETURN(const bool more, source->Next(&blocks));
    if (!more) break;
    for (const SampleBlock& block : blocks) {
      const auto stream = std::find_if(rest.streams.begin(),
                                       rest.streams.end(),
                                       [&](const auto& s) { return s.triad == block.triad; });
      const auto index = static_cast<std::size_t>(stream - rest.streams.begin());
      for (std::size_t i = 0; i < block.x.size(); ++i) {
        Rest::Row& row = rest.rows[block.time_ns[i]];
        row.readings[3 * index] = block.x[i];
        row.readings[3 * index + 1] = block.y[i];
        row.readings[3 * index + 2] = block.z[i];
        row.present |= 1U << index;
        if (!block.temperature_degc.empty()) row.temperature_degc = block.temperature_degc[i];
      }
    }
    if (rest.rows.size() > kMostRows)
      return Error(ErrorCode::kTooMany, {path.string()}, "is too long for one rest");
  }
  if (rest.rows.empty())
    return Error(ErrorCode::kNoReadings, {path.string()}, "contains no readings");
  return rest;
}

bool HasTemperature(const std::vector<StreamInfo>& streams) {
  return std::any_of(streams.begin(), streams.end(), [](const StreamInfo& stream) {
    return stream.has_temperature;
  });
}

Status CheckSameStreams(const Rest& first, const Rest& rest, const fs::path& path) {
  bool same = first.streams.size() == rest.streams.size() &&
              HasTemperature(first.streams) == HasTemperature(rest.streams);
  for (std::size_t i = 0; same && i < rest.streams.size(); ++i) {
    same = first.streams[i].triad == rest.streams[i].triad &&
           first.streams[i].unit.name == rest.streams[i].unit.name;
  }
  if (same) return {};
  return Error(ErrorCode::kDoesNotMatch,
               {path.string()},
               "has different sensors or units than the other faces");
}

Status Run(const Arguments& arguments) {
  std::error_code missing;
  if (!fs::is_directory(arguments.inputs[0], missing)) {
    return Error(ErrorCode::kWrongFormat,
                 {arguments.inputs[0]},
                 "is not a folder; expected one with +x.csv, -x.csv, …");
  }
  std::vector<std::pair<std::string, fs::path>> files;
  for (const Face& face : kFaces) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<fs::path> file,
                               FileOf(face, arguments.inputs[0]));
    if (file) files.emplace_back(face.name, *file);
  }
  if (files.empty()) {
    return Error(ErrorCode::kNoReadings,
                 {arguments.inputs[0]},
                 "contains no face file; expected +x.csv, -x.csv, +y.csv, … (or "
                 "x_up.csv, x_down.csv, …), named after the axis that points up");
  }
  if (arguments.list) {
    for (const auto& [face, path] : files) {
      std::printf("%s %s\n", face.c_str(), path.filename().c_str());
    }
    return {};
  }
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<RecordingFolder> folder,
                             RecordingFolder::Create(arguments.output));
  folder->SetOrigin("six-face");
  Rest first;
  Table* table = nullptr;
  std::vector<PoseRange> poses;
  std::int64_t row = 0;
  std::int64_t next_start_ns = 0;
  for (const auto& [face, path] : files) {
    TRUETRIAD_ASSIGN_OR_RETURN(Rest rest, ReadRest(path));
    if (table == nullptr) {
      std::vector<TriadColumns> triads;
      for (const StreamInfo& stream : rest.streams) {
        triads.push_back({.triad = stream.triad, .unit = stream.unit.name, .applied = {}});
      }
      table = folder->AddTable("recording.csv", triads, {HasTemperature(rest.streams)});
      first.streams = rest.streams;
    }
    TRUETRIAD_RETURN_IF_ERROR(CheckSameStreams(first, rest, path));
    // Between rests there is a pause, in which the block is turned.
    constexpr std::int64_t kPauseNs = 1'000'000'000;
    const std::int64_t shift_ns = next_start_ns - rest.rows.begin()->first;
    for (const auto& [time_ns, reading] : rest.rows) {
      table->SetTemperature(reading.temperature_degc);
      table->Add(time_ns + shift_ns, reading.readings.data(), reading.present);
    }
    const auto count = static_cast<std::int64_t>(rest.rows.size());
    poses.push_back(
        {.first = row, .last = row + count - 1, .id = path.stem().string(), .face_up = face});
    row += count;
    next_start_ns = rest.rows.rbegin()->first + shift_ns + kPauseNs;
  }
  if (files.size() < kFaces.size()) {
    Note("the folder has files for " + Counted(files.size(), "face") + " of six");
  }
  folder->SetPoses(PoseRangesToYaml(poses));
  return folder->Commit();
}

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  return truetriad::convert::RunConverter(
      {.format = "six-face", .flags = {}, .run = truetriad::convert::Run}, argc, argv);
}
