// SPDX-License-Identifier: Apache-2.0
//
// Converts ASCII sentences of VectorNav units ($VNYMR, …) to a recording. docs/converting.md.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "tools/convert/common/byte_stream.h"
#include "tools/convert/common/converter.h"
#include "tools/convert/common/recording_folder.h"
#include "tools/truetriad/progress.h"
#include "truetriad/base/triad.h"

namespace truetriad::convert {
namespace {

/// A VectorNav ASCII sentence with readings: magnetometer in gauss, accelerometer in m/s^2,
/// gyroscope in rad/s, all in the unit's axes. VN-100, VN-200 and VN-300 user manuals.
struct SentenceKind {
  std::string_view name;      ///< "VNYMR".
  std::size_t fields = 0;     ///< Number of numeric fields after the name.
  std::size_t first = 0;      ///< Index of the first reading among the fields.
  std::vector<Triad> triads;  ///< The sensors in order, three numbers each.
  bool compensated = false;   ///< By the unit's registers 23, 25, 84 or learned values.
  std::optional<std::size_t> temperature;  ///< Index of the field with it, degC.
};

/// What the checksum of a sentence shows.
enum class Checksum {
  kNone,   ///< The sentence ends without `*`, or with `*XX`.
  kWrong,  ///< The text after `*` is not the sentence's checksum.
  kRight,
};

/// The text between `$` and the next `$` or end of line.
struct Sentence {
  std::string_view name;  ///< The text up to the first comma; empty: no name.
  std::string_view body;  ///< The text after this comma, up to `*`.
  Checksum checksum = Checksum::kNone;
  const SentenceKind* kind = nullptr;  ///< Null: a kind without readings.
  bool is_named = false;               ///< The name is reliable: it has a place in the order.
  std::vector<double> numbers;         ///< Empty unless all numbers are valid.
  bool has_appended = false;           ///< A status or counter follows the numbers.
};

/// Stands for a checksum that the unit did not compute.
constexpr std::string_view kNotCounted = "XX";

std::uint8_t XorOf(std::string_view text) {
  std::uint8_t sum = 0;
  for (const char c : text) sum ^= static_cast<std::uint8_t>(c);
  return sum;
}

std::uint16_t CrcOf(std::string_view text) {
  constexpr unsigned kPolynomial = 0x1021;  // x^16 + x^12 + x^5 + 1
  unsigned crc = 0;
  for (const char c : text) {
    crc ^= static_cast<unsigned>(static_cast<std::uint8_t>(c)) << 8U;
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 0x8000U) != 0 ? (crc << 1U) ^ kPolynomial : crc << 1U;
    }
  }
  return static_cast<std::uint16_t>(crc);
}

bool ChecksumIsRight(std::string_view text, std::string_view digits) {
  unsigned stated = 0;
  const auto [end, failure] =
      std::from_chars(digits.data(), digits.data() + digits.size(), stated, 16);
  if (failure != std::errc() || end != digits.data() + digits.size()) return false;
  if (digits.size() == 2) return stated == XorOf(text);
  return digits.size() == 4 && stated == CrcOf(text);
}

bool IsStatus(std::string_view field) {
  return field.size() == 5 && field[0] == 'S' &&
         field.find_first_not_of("0123456789ABCDEFabcdef", 1) == std::string_view::npos;
}

bool IsCounter(std::string_view field) {
  return field.size() > 1 && field[0] == 'T' &&
         field.find_first_not_of("0123456789", 1) == std::string_view::npos;
}

const std::vector<SentenceKind>& SentenceKinds() {
  using enum Triad;
  static const std::vector<SentenceKind> kinds = {
      // Yaw, pitch and roll precede the readings.
      {"VNYMR", 12, 3, {kMagnetometer, kAccelerometer, kGyroscope}, true, std::nullopt},
      // A quaternion precedes the readings.
      {"VNQMR", 13, 4, {kMagnetometer, kAccelerometer, kGyroscope}, true, std::nullopt},
      {"VNMAR", 9, 0, {kMagnetometer, kAccelerometer, kGyroscope}, true, std::nullopt},
      {"VNMAG", 3, 0, {kMagnetometer}, true, std::nullopt},
      {"VNACC", 3, 0, {kAccelerometer}, true, std::nullopt},
      {"VNGYR", 3, 0, {kGyroscope}, true, std::nullopt},
      // Temperature and pressure follow the readings.
      {"VNIMU", 11, 0, {kMagnetometer, kAccelerometer, kGyroscope}, false, 9},
  };
  return kinds;
}

/// Null if `name` is no kind with readings.
const SentenceKind* FindSentenceKind(std::string_view name) {
  for (const SentenceKind& kind : SentenceKinds()) {
    if (kind.name == name) return &kind;
  }
  return nullptr;
}

/// Parses a sentence and verifies its checksum: two digits are the XOR of the bytes between `$` and
/// `*`, four digits their CRC-16 (x^16 + x^12 + x^5 + 1, from 0).
Sentence ParseSentence(std::string_view text) {
  Sentence sentence;
  sentence.name = text.substr(0, text.find_first_of(",*"));
  const std::size_t star = text.rfind('*');
  const std::string_view checked = text.substr(0, star);
  if (sentence.name.size() < checked.size())
    sentence.body = checked.substr(sentence.name.size() + 1);
  if (star == std::string_view::npos) return sentence;
  std::string_view digits = text.substr(star + 1);
  const std::size_t last = digits.find_last_not_of(" \t");
  digits = digits.substr(0, last == std::string_view::npos ? 0 : last + 1);
  if (digits == kNotCounted) return sentence;
  sentence.checksum = ChecksumIsRight(checked, digits) ? Checksum::kRight : Checksum::kWrong;
  return sentence;
}

/// The numbers in `body`; empty unless there are exactly `count`, all valid. Register 30 may append
/// a status (`S` and four hexadecimal digits) and a counter or time (`T` and digits).
std::vector<double> NumbersOf(std::string_view body, std::size_t count, bool* has_appended) {
  // The added comma keeps an empty last field.
  std::vector<std::string> fields = Split(std::string(body) + ",", ',');
  *has_appended = fields.size() > count;
  if (fields.size() > count && IsCounter(fields.back())) fields.pop_back();
  if (fields.size() > count && IsStatus(fields.back())) fields.pop_back();
  if (fields.size() != count) return {};
  std::vector<double> numbers;
  for (const std::string_view field : fields) {
    const auto number = ParseWhole<double>(field.substr(field.starts_with('+') ? 1 : 0));
    if (!number) return {};
    numbers.push_back(*number);
  }
  return numbers;
}

constexpr std::size_t kLongestLine = 4096;  // A sentence has some 130 characters.
constexpr std::string_view kEndOfLine = "\r\n";

/// Numbers of sentences of one kind.
struct Tally {
  std::uint64_t intact = 0;
  std::uint64_t bad = 0;  ///< With a wrong checksum or number of fields.
};

/// The order of kinds: a unit that writes several kinds of sentences repeats them in this order.
class Turns {
 public:
  /// Adds the next sentence. `name`: its kind; empty if it is unknown.
  void Learn(const std::string& name) {
    if (!previous_.empty() && !name.empty()) ++followers_[previous_][name];
    previous_ = name;
  }

  /// The kind that follows the kind `name`; null if this is ambiguous.
  const std::string* After(std::string_view name) const {
    // One follower in a hundred may be of another kind, since sentences may be lost.
    constexpr std::uint64_t kAgainstOther = 99;
    const auto found = followers_.find(name);
    if (found == followers_.end()) return nullptr;
    std::uint64_t sum = 0;
    const std::string* most = nullptr;
    std::uint64_t most_often = 0;
    for (const auto& [follower, times] : found->second) {
      sum += times;
      if (times <= most_often) continue;
      most_often = times;
      most = &follower;
    }
    return most_often >= kAgainstOther * (sum - most_often) ? most : nullptr;
  }

 private:
  std::map<std::string, std::map<std::string, std::uint64_t>, std::less<>> followers_;
  std::string previous_;
};

struct Contents {
  std::map<std::string, Tally, std::less<>> kinds;   ///< Kinds with readings, by name.
  std::map<std::string, Tally, std::less<>> others;  ///< Kinds without: VNYPR, VNRRG, ….
  std::uint64_t unreadable = 0;                      ///< Lines without a sentence's name.
  std::uint64_t with_appended = 0;                   ///< Sentences with a status or counter.
  bool has_checksums = false;
  Turns turns;

  std::uint64_t bad() const {
    std::uint64_t sum = unreadable;
    for (const auto& [name, tally] : kinds) sum += tally.bad;
    for (const auto& [name, tally] : others) sum += tally.bad;
    return sum;
  }
};

/// Calls `take(text)` for each text until `take` returns false. A text begins after a `$` and ends
/// before the next `$` or at the end of its line; a line without `$` gives an empty text. Error:
/// the file cannot be read.
template <typename Take>
Status EachSentence(const std::string& path, const Take& take) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<ByteStream> bytes, ByteStream::Open(path));
  ProgressLine line("Reading");
  const ProgressCallback progress = line.callback();
  while (!bytes->at_end()) {
    const std::string_view ahead = bytes->Peek(kLongestLine);
    if (ahead.empty()) break;
    const std::string_view whole = ahead.substr(0, ahead.find_first_of(kEndOfLine));
    const std::size_t begin = whole.find('$');
    if (begin == std::string_view::npos) {
      const bool is_empty = whole.find_first_not_of(" \t") == std::string_view::npos;
      if (!is_empty && !take(std::string_view())) return {};
    } else {
      for (std::size_t at = begin; at != std::string_view::npos;) {
        const std::size_t next = whole.find('$', at + 1);
        const std::size_t size = next == std::string_view::npos ? next : next - at - 1;
        if (!take(whole.substr(at + 1, size))) return {};
        at = next;
      }
    }
    bytes->Skip(std::max<std::size_t>(whole.size(), 1));
    if (progress) progress(bytes->progress());
  }
  if (bytes->read_failed())
    return Error(ErrorCode::kDamagedFile, {path}, "could not be read to its end");
  return {};
}

bool IsName(std::string_view name) {
  return name.size() == 5 && name.starts_with("VN") &&
         name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ_") == std::string_view::npos;
}

/// Parses a sentence. `has_checksums`: the unit that wrote the log writes checksums.
Sentence Understand(std::string_view text, bool has_checksums) {
  Sentence sentence = ParseSentence(text);
  const bool is_intact = sentence.checksum == (has_checksums ? Checksum::kRight : Checksum::kNone);
  sentence.kind = FindSentenceKind(sentence.name);
  // The name of a kind without readings is reliable only in an intact sentence.
  sentence.is_named = sentence.kind != nullptr || (IsName(sentence.name) && is_intact);
  if (sentence.kind != nullptr && is_intact)
    sentence.numbers = NumbersOf(sentence.body, sentence.kind->fields, &sentence.has_appended);
  return sentence;
}

/// Whether the unit writes checksums: one valid checksum shows this. A sentence without a checksum
/// is then truncated.
Result<bool> HasChecksums(const std::string& path) {
  bool found = false;
  TRUETRIAD_RETURN_IF_ERROR(EachSentence(path, [&](std::string_view text) {
    // Damage can turn the digits of a checksum into XX, but not XX into a valid checksum.
    found = found || ParseSentence(text).checksum == Checksum::kRight;
    return !found;
  }));
  return found;
}

Result<Contents> Survey(const std::string& path) {
  Contents contents;
  TRUETRIAD_ASSIGN_OR_RETURN(contents.has_checksums, HasChecksums(path));
  TRUETRIAD_RETURN_IF_ERROR(EachSentence(path, [&](std::string_view text) {
    const Sentence sentence = Understand(text, contents.has_checksums);
    const std::string name(sentence.name);
    if (sentence.kind != nullptr) {
      const bool is_whole = !sentence.numbers.empty();
      ++(is_whole ? contents.kinds[name].intact : contents.kinds[name].bad);
      if (is_whole && sentence.has_appended) ++contents.with_appended;
    } else {
      ++(sentence.is_named ? contents.others[name].intact : contents.unreadable);
    }
    contents.turns.Learn(sentence.is_named ? name : "");
    return true;
  }));
  return contents;
}

/// Selects the kinds to convert. Error: there is none, or several have readings of one sensor.
Result<std::vector<const SentenceKind*>> Choose(const Contents& contents,
                                                const Arguments& arguments) {
  for (const std::string& topic : arguments.topics) {
    if (FindSentenceKind(topic) != nullptr) continue;
    std::vector<std::string> names;
    for (const SentenceKind& kind : SentenceKinds()) names.emplace_back(kind.name);
    return Error(ErrorCode::kUnknownName,
                 "--topic=" + PrintableLine(topic) + ": is not among " + ListOf(names));
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
               {arguments.inputs[0]},
               "contains no intact VectorNav sentence with readings (VNYMR, VNQMR, VNMAR, VNIMU, "
               "VNMAG, VNACC, VNGYR)" +
                   (arguments.topics.empty() ? std::string() : " that --topic asks for") +
                   "; intact sentences: " + ListOf(held) + "; " +
                   Counted(contents.bad(), "bad line"));
}

/// The sample rate in Hz that --columns=time=100Hz states.
Result<double> RateOf(const Arguments& arguments) {
  constexpr std::string_view kPrefix = "time=";
  const auto found = arguments.others.find("columns");
  if (found == arguments.others.end()) {
    return Error(ErrorCode::kMissingArgument,
                 "the sentences have no time; state the rate of each kind (register 7 of the "
                 "unit), as in --columns=time=40Hz");
  }
  const std::string& text = found->second;
  const std::optional<double> rate_hz =
      text.starts_with(kPrefix) ? ParseRate(text.substr(kPrefix.size())) : std::nullopt;
  if (rate_hz) return *rate_hz;
  return Error(ErrorCode::kInvalidArgument,
               "--columns=" + PrintableLine(text) + ": expected a rate, as in time=40Hz");
}

/// The table for sentences of one kind. An invalid sentence gives no row, but later rows get the
/// same times as if it had.
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
      constexpr PerTriad<std::string_view> kUnits = {{"m/s^2", "rad/s", "G"}};
      columns.push_back({.triad = triad,
                         .unit = std::string(kUnits[triad]),
                         .applied = kind->compensated ? " unknown\n" : ""});
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

/// The second pass: writes the sentences to tables.
class Conversion {
 public:
  Conversion(const Contents& contents, double rate_hz, std::map<std::string_view, Route> routes)
      : contents_(contents), rate_hz_(rate_hz), routes_(std::move(routes)) {
    is_alone_ = contents.kinds.size() == 1 && routes_.size() == 1;
  }

  void Take(std::string_view text) {
    const Sentence sentence = Understand(text, contents_.has_checksums);
    if (!sentence.is_named) {
      TakeUnreadable();
      return;
    }
    previous_ = sentence.name;
    const auto found = routes_.find(sentence.name);
    if (found == routes_.end()) return;
    Route& route = found->second;
    const std::int64_t time_ns = NextTime(&route);
    const std::vector<double>& numbers = sentence.numbers;
    if (numbers.empty()) return;
    if (route.kind->temperature) route.table->SetTemperature(numbers[*route.kind->temperature]);
    route.table->Add(time_ns, numbers.data() + route.kind->first);
  }

  std::uint64_t unplaced() const { return unplaced_; }

 private:
  std::int64_t NextTime(Route* route) const {
    return std::llround(static_cast<double>(route->sentences++) * (1e9 / rate_hz_));
  }

  /// Counts a line without a name as a sample of the only kind, or of the kind that comes next.
  void TakeUnreadable() {
    const std::string* const due =
        is_alone_ && contents_.others.empty() ? nullptr : contents_.turns.After(previous_);
    if (due != nullptr) previous_ = *due;
    const auto route = due == nullptr ? routes_.end() : routes_.find(*due);
    if (route != routes_.end()) {
      NextTime(&route->second);
    } else if (due == nullptr && is_alone_) {
      NextTime(&routes_.begin()->second);
    } else if (due == nullptr) {
      ++unplaced_;
    }
  }

  const Contents& contents_;
  double rate_hz_ = 0.0;
  std::map<std::string_view, Route> routes_;
  bool is_alone_ = false;  ///< The log has only one kind with readings.
  std::string previous_;   ///< Kind of the previous line.
  std::uint64_t unplaced_ = 0;
};

void List(const Contents& contents) {
  std::printf("%-8s %10s %10s\n", "topic", "intact", "bad");
  const auto print = [](const std::string& name, const Tally& tally, std::string_view what) {
    std::printf("%-8s %10llu %10llu%s\n",
                PrintableLine(name).c_str(),
                static_cast<unsigned long long>(tally.intact),
                static_cast<unsigned long long>(tally.bad),
                std::string(what).c_str());
  };
  for (const auto& [name, tally] : contents.kinds) print(name, tally, "  readings");
  for (const auto& [name, tally] : contents.others) print(name, tally, "");
  if (contents.unreadable > 0) print("?", {0, contents.unreadable}, "");
}

Status Run(const Arguments& arguments) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Contents contents, Survey(arguments.inputs[0]));
  if (contents.bad() > 0) {
    Note(arguments.inputs[0] + ": " + Counted(contents.bad(), "bad sentence") +
         " left out (wrong checksum, or cut)");
  }
  if (!contents.has_checksums && !contents.kinds.empty()) {
    Note(arguments.inputs[0] +
         ": its sentences have no checksums; damage goes unnoticed unless it "
         "leaves something other than numbers");
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
  folder->SetOrigin("vectornav-ascii", {arguments.inputs[0]});
  folder->SetSource("rate", arguments.others.at("columns"));
  if (contents.bad() > 0) folder->SetSource("bad sentences", std::to_string(contents.bad()));
  if (!contents.has_checksums) folder->SetSource("checksums", "none");
  if (contents.with_appended > 0) {
    Note(Counted(contents.with_appended, "sentence") +
         (contents.with_appended == 1 ? " ends" : " end") +
         " with a status or counter (register 30), which is not used");
  }
  folder->SetFrame("unit, after its reference frame rotation (register 26)");
  Conversion conversion(contents, rate_hz, OpenTables(kinds, folder.get()));
  TRUETRIAD_RETURN_IF_ERROR(EachSentence(arguments.inputs[0], [&](std::string_view text) {
    conversion.Take(text);
    return true;
  }));
  if (conversion.unplaced() > 0) {
    Note(Counted(conversion.unplaced(), "unreadable line") +
         " may have held samples of any kind: later times may be too early by as many samples");
  }
  for (const SentenceKind* const kind : kinds) {
    if (!kind->compensated) continue;
    Note(std::string(kind->name) +
         " has readings corrected by the unit's registers 23, 25 and 84: the recording states "
         "`applied: unknown` and is refused until you complete it by hand; `applied: none` "
         "calibrates the remaining errors. VNIMU has readings before this correction");
  }
  return folder->Commit();
}

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  return truetriad::convert::RunConverter(
      {.format = "vectornav", .flags = {"topic", "columns"}, .run = truetriad::convert::Run},
      argc,
      argv);
}
