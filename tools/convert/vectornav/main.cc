// SPDX-License-Identifier: Apache-2.0
//
// ASCII sentences of VectorNav units ($VNYMR, …) to a recording. docs/converting.md.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tools/convert/common/byte_stream.h"
#include "tools/convert/common/converter.h"
#include "tools/convert/common/recording_folder.h"
#include "tools/convert/vectornav/sentence.h"
#include "tools/truetriad/progress.h"

namespace truetriad::convert {
namespace {

constexpr std::size_t kLongestLine = 4096;  // A sentence has some 130 characters.
constexpr std::string_view kEndOfLine = "\r\n";

/// How many sentences of one kind there are.
struct Tally {
  std::uint64_t intact = 0;
  std::uint64_t bad = 0;  ///< Of a wrong checksum, or not as many numbers as the kind has.
};

struct Contents {
  std::map<std::string, Tally, std::less<>> kinds;   ///< With readings, by name.
  std::map<std::string, Tally, std::less<>> others;  ///< Without: VNYPR, VNRRG, ….
  std::uint64_t unreadable = 0;                      ///< Lines without the name of a sentence.

  std::uint64_t bad() const {
    std::uint64_t sum = unreadable;
    for (const auto& [name, tally] : kinds) sum += tally.bad;
    for (const auto& [name, tally] : others) sum += tally.bad;
    return sum;
  }
};

/// Calls `take(text)` with what is between each `$` and the next one or the end of its line, and
/// with an empty text for a line without any. Error: the file cannot be read.
template <typename Take>
Status EachSentence(const std::string& path, const Take& take) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<ByteStream> bytes, ByteStream::Open(path));
  ProgressLine line("Reading");
  const ProgressCallback progress = line.callback();
  std::uint64_t count = 0;
  while (!bytes->at_end()) {
    const std::string_view ahead = bytes->Peek(kLongestLine);
    if (ahead.empty()) break;
    const std::string_view whole = ahead.substr(0, ahead.find_first_of(kEndOfLine));
    const std::size_t begin = whole.find('$');
    if (begin == std::string_view::npos) {
      if (whole.find_first_not_of(" \t") != std::string_view::npos) take(std::string_view());
    } else {
      for (std::size_t at = begin; at != std::string_view::npos;) {
        const std::size_t next = whole.find('$', at + 1);
        take(whole.substr(at + 1, next == std::string_view::npos ? next : next - at - 1));
        at = next;
      }
    }
    bytes->Skip(std::max<std::size_t>(whole.size(), 1));
    if (progress && ++count % 10000 == 0) progress(bytes->progress());
  }
  if (bytes->read_failed())
    return Error(ErrorCode::kDamagedFile, {path}, "could not be read to its end");
  return {};
}

bool IsName(std::string_view name) {
  return name.size() == 5 && name.starts_with("VN") &&
         name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ_") == std::string_view::npos;
}

Result<Contents> Survey(const std::string& path) {
  Contents contents;
  TRUETRIAD_RETURN_IF_ERROR(EachSentence(path, [&](std::string_view text) {
    const Sentence sentence = ParseSentence(text);
    if (const SentenceKind* const kind = FindSentenceKind(sentence.name)) {
      Tally& tally = contents.kinds[std::string(kind->name)];
      const bool is_whole = sentence.is_intact && !NumbersOf(sentence.body, kind->fields).empty();
      ++(is_whole ? tally.intact : tally.bad);
    } else if (IsName(sentence.name) && sentence.is_intact) {
      ++contents.others[std::string(sentence.name)].intact;
    } else {
      ++contents.unreadable;
    }
  }));
  return contents;
}

/// The kinds to convert. Error: there is none, or several have readings of one sensor.
Result<std::vector<const SentenceKind*>> Choose(const Contents& contents,
                                                const Arguments& arguments) {
  for (const std::string& topic : arguments.topics) {
    if (FindSentenceKind(topic) != nullptr) continue;
    std::vector<std::string> names;
    for (const SentenceKind& kind : SentenceKinds()) names.emplace_back(kind.name);
    return Error(ErrorCode::kUnknownName,
                 "--topic=" + Printable(topic) + ": is not among " + ListOf(names));
  }
  std::vector<const SentenceKind*> chosen;
  std::map<Triad, std::string_view> origin;
  std::vector<std::string> held;
  for (const auto& [name, tally] : contents.kinds) {
    if (tally.intact == 0) continue;
    held.push_back(name);
    if (!arguments.topics.empty() &&
        std::find(arguments.topics.begin(), arguments.topics.end(), name) ==
            arguments.topics.end()) {
      continue;
    }
    const SentenceKind* const kind = FindSentenceKind(name);
    chosen.push_back(kind);
    for (const Triad triad : kind->triads) {
      const auto [there, fresh] = origin.emplace(triad, kind->name);
      if (!fresh)
        return Error(ErrorCode::kConflictingArguments,
                     "the " + std::string(TriadName(triad)) + " is in " +
                         std::string(there->second) + " and in " + name +
                         "; name the sentence to convert: --topic=" + name);
    }
  }
  if (!chosen.empty()) return chosen;
  for (const auto& [name, tally] : contents.others) held.push_back(name);
  return Error(ErrorCode::kNoReadings,
               {arguments.input},
               "contains no intact VectorNav sentence with readings (VNYMR, VNQMR, VNMAR, VNIMU, "
               "VNMAG, VNACC, VNGYR)" +
                   (arguments.topics.empty() ? std::string() : " that --topic asks for") +
                   "; intact are: " + ListOf(held) + "; " +
                   Count(contents.bad(), "line is bad", "lines are bad"));
}

/// Samples a second, of --columns=time=100Hz.
Result<double> RateOf(const Arguments& arguments) {
  constexpr std::string_view kPrefix = "time=";
  constexpr std::string_view kUnit = "Hz";
  constexpr double kHighest = 1e6;
  const auto found = arguments.others.find("columns");
  if (found == arguments.others.end()) {
    return Error(ErrorCode::kMissingArgument,
                 "the sentences have no time; state how many of a kind come a second, as in "
                 "--columns=time=40Hz (register 7 of the unit)");
  }
  std::string_view text = found->second;
  double rate_hz = 0.0;
  if (text.starts_with(kPrefix) && text.ends_with(kUnit)) {
    text.remove_prefix(kPrefix.size());
    text.remove_suffix(std::min(kUnit.size(), text.size()));
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), rate_hz);
    if (failure == std::errc() && end == text.data() + text.size() && rate_hz > 0.0 &&
        rate_hz <= kHighest) {
      return rate_hz;
    }
  }
  return Error(ErrorCode::kInvalidArgument,
               "--columns=" + Printable(found->second) + ": expected a rate, as in time=40Hz");
}

std::string_view UnitOf(Triad triad) {
  switch (triad) {
    case Triad::kAccelerometer:
      return "m/s^2";
    case Triad::kGyroscope:
      return "rad/s";
    case Triad::kMagnetometer:
      return "G";
  }
  return "";
}

/// Rows of one kind. A bad sentence takes the time that it had.
struct Route {
  const SentenceKind* kind = nullptr;
  Table* table = nullptr;
  std::uint64_t sentences = 0;
};

std::map<std::string_view, Route> OpenTables(const std::vector<const SentenceKind*>& kinds,
                                             RecordingFolder* folder) {
  std::map<std::string_view, Route> routes;
  for (const SentenceKind* const kind : kinds) {
    std::vector<TriadColumns> columns;
    for (const Triad triad : kind->triads) {
      TriadColumns& added = columns.emplace_back();
      added.triad = triad;
      added.unit = UnitOf(triad);
      if (kind->compensated) added.applied = " unknown\n";
    }
    std::string file(kind->name);
    std::transform(file.begin(), file.end(), file.begin(), [](char c) {
      return static_cast<char>(c - 'A' + 'a');
    });
    Table* const table = folder->AddTable(
        file + ".csv", columns, {.has_temperature = kind->temperature.has_value()});
    routes[kind->name] = {kind, table, 0};
  }
  return routes;
}

void TakeSentence(std::string_view text,
                  double rate_hz,
                  std::map<std::string_view, Route>* routes) {
  constexpr double kNsPerS = 1e9;
  const Sentence sentence = ParseSentence(text);
  auto found = routes->find(sentence.name);
  if (found == routes->end()) {
    // What cannot be read is of the only kind that there is.
    const bool is_other = IsName(sentence.name) && sentence.is_intact;
    if (!is_other && FindSentenceKind(sentence.name) == nullptr && routes->size() == 1)
      ++routes->begin()->second.sentences;
    return;
  }
  Route& route = found->second;
  const auto time_ns = std::llround(static_cast<double>(route.sentences++) * (kNsPerS / rate_hz));
  if (!sentence.is_intact) return;
  const std::vector<double> numbers = NumbersOf(sentence.body, route.kind->fields);
  if (numbers.empty()) return;
  if (route.kind->temperature) route.table->SetTemperature(numbers[*route.kind->temperature]);
  route.table->Add(time_ns, numbers.data() + route.kind->first);
}

void List(const Contents& contents) {
  std::printf("%-8s %10s %10s\n", "topic", "intact", "bad");
  const auto print = [](const std::string& name, const Tally& tally, std::string_view what) {
    std::printf("%-8s %10llu %10llu%s\n",
                Printable(name).c_str(),
                static_cast<unsigned long long>(tally.intact),
                static_cast<unsigned long long>(tally.bad),
                std::string(what).c_str());
  };
  for (const auto& [name, tally] : contents.kinds) print(name, tally, "  readings");
  for (const auto& [name, tally] : contents.others) print(name, tally, "");
  if (contents.unreadable > 0) print("?", {0, contents.unreadable}, "");
}

Status Run(const Arguments& arguments) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Contents contents, Survey(arguments.input));
  if (contents.bad() > 0) {
    Note(arguments.input + ": " + Count(contents.bad(), "bad sentence", "bad sentences") +
         " left out (wrong checksum, or cut)");
  }
  if (arguments.list) {
    List(contents);
    return {};
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<const SentenceKind*> kinds,
                             Choose(contents, arguments));
  TRUETRIAD_ASSIGN_OR_RETURN(const double rate_hz, RateOf(arguments));
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<RecordingFolder> folder,
                             RecordingFolder::Create(arguments.output));
  folder->SetSource("format", "vectornav-ascii");
  folder->SetSource("file", std::filesystem::path(arguments.input).filename().string());
  folder->SetSource("converter", "truetriad-convert-vectornav " TRUETRIAD_VERSION);
  folder->SetSource("rate", arguments.others.at("columns"));
  if (contents.bad() > 0) folder->SetSource("bad sentences", std::to_string(contents.bad()));
  folder->SetFrame("unit, after its reference frame rotation (register 26)");
  std::map<std::string_view, Route> routes = OpenTables(kinds, folder.get());
  TRUETRIAD_RETURN_IF_ERROR(EachSentence(
      arguments.input, [&](std::string_view text) { TakeSentence(text, rate_hz, &routes); }));
  for (const SentenceKind* const kind : kinds) {
    if (!kind->compensated) continue;
    Note(std::string(kind->name) +
         " holds what the unit's registers 23, 25 and 84 have corrected: the recording states "
         "`applied: unknown` and is refused until you complete it by hand; `applied: none` "
         "calibrates what they left. VNIMU is from before them");
  }
  return folder->Commit();
}

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  const truetriad::convert::Converter converter = {
      .format = "vectornav",
      .input = "a log of VectorNav ASCII sentences",
      .details =
          "\nTopics are VNYMR, VNQMR, VNMAR, VNIMU, VNMAG, VNACC and VNGYR. The sentences have "
          "no time:\n--columns=time=40Hz states how many of a kind come a second. Bad "
          "sentences are counted\nand keep their place in time.\n",
      .takes_topics = true,
      .others = {"columns"},
      .run = truetriad::convert::Run};
  return truetriad::convert::RunConverter(converter, argc, argv);
}
