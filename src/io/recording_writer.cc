// SPDX-License-Identifier: Apache-2.0
#include "truetriad/io/recording_writer.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "io/whole_file.h"
#include "io/yaml_text.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace {

constexpr std::string_view kTemperatureColumn = "temperature[degC]";
constexpr std::string_view kAmbientColumn = "ambient_temperature[degC]";
constexpr double kNoTemperature = std::numeric_limits<double>::quiet_NaN();

constexpr std::array<double, 16> kPowersOfTen = {
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};

/// From here on a double has no halves, and an integer of that size no exact double.
constexpr double kNoFraction = 0x1p52;

/// value * 10^decimals, halves away from zero; nullopt when it must be written as it is.
std::optional<std::int64_t> Scaled(double value, int decimals) {
  if (decimals < 0) return std::nullopt;
  const double scaled = value * kPowersOfTen[static_cast<std::size_t>(decimals)];
  if (!(std::abs(scaled) < kNoFraction)) return std::nullopt;
  return static_cast<std::int64_t>(scaled + std::copysign(0.5, scaled));
}

constexpr std::array<char, 200> kDigitPairs = [] {
  std::array<char, 200> pairs{};
  for (std::size_t i = 0; i < 100; ++i) {
    pairs[2 * i] = static_cast<char>('0' + i / 10);
    pairs[2 * i + 1] = static_cast<char>('0' + i % 10);
  }
  return pairs;
}();

/// Room that one number can need.
constexpr std::size_t kLongestNumber = 32;

/// `number` / 10^decimals in full, at `text`; returns the end. In place of
/// std::to_chars with fixed decimals, with which `simulate` takes 70 % more processor time.
char* WriteFixed(std::int64_t number, int decimals, char* text) {
  const auto bits = static_cast<std::uint64_t>(number);
  std::uint64_t rest = number < 0 ? 0 - bits : bits;
  *text = '-';
  text += number < 0 ? 1 : 0;
  // Digits from the last on, two at a time, with a zero before the point if there is nothing else.
  std::array<char, 24> digits;
  char* const end = digits.data() + digits.size();
  char* begin = end;
  for (; rest >= 100; rest /= 100) {
    begin -= 2;
    std::memcpy(begin, kDigitPairs.data() + 2 * (rest % 100), 2);
  }
  begin -= 2;
  std::memcpy(begin, kDigitPairs.data() + 2 * rest, 2);
  begin += rest < 10 ? 1 : 0;
  while (end - begin <= decimals) *--begin = '0';
  const std::size_t whole = static_cast<std::size_t>(end - begin - decimals);
  std::memcpy(text, begin, whole);
  text += whole;
  if (decimals == 0) return text;
  *text++ = '.';
  std::memcpy(text, begin + whole, static_cast<std::size_t>(decimals));
  return text + decimals;
}

/// Nothing for NaN: an empty field.
char* WriteNumber(double value, int decimals, char* text) {
  if (std::isnan(value)) return text;
  if (const std::optional<std::int64_t> scaled = Scaled(value, decimals)) {
    return WriteFixed(*scaled, decimals, text);
  }
  return std::to_chars(text, text + kLongestNumber, value).ptr;
}

/// Samples of one triad that wait for those of the others.
struct Waiting {
  StreamInfo stream;
  int decimals = RecordingFormat::kShortest;
  std::vector<std::int64_t> time_ns = {};
  std::vector<double> x = {}, y = {}, z = {}, temperature_degc = {}, ambient_degc = {};
  std::size_t next = 0;

  bool empty() const { return next == time_ns.size(); }

  void Add(const SampleBlock& block) {
    const auto drop = static_cast<std::ptrdiff_t>(next);
    const auto move = [drop](auto* values, const auto& fresh) {
      values->erase(values->begin(), values->begin() + drop);
      values->insert(values->end(), fresh.begin(), fresh.end());
    };
    move(&time_ns, block.time_ns);
    move(&x, block.x);
    move(&y, block.y);
    move(&z, block.z);
    if (stream.has_temperature) move(&temperature_degc, block.temperature_degc);
    if (stream.has_ambient) move(&ambient_degc, block.ambient_degc);
    next = 0;
  }
};

/// One CSV with some of the triads.
class CsvFile {
 public:
  CsvFile(const std::string& directory, std::string name, const RecordingFormat& format)
      : name_(std::move(name)), file_(directory + "/" + name_), format_(format) {}

  void AddStream(const StreamInfo& stream) {
    waiting_.push_back({.stream = stream, .decimals = format_.decimals[stream.triad]});
    has_temperature_ = has_temperature_ || stream.has_temperature;
    has_ambient_ = has_ambient_ || stream.has_ambient;
  }

  void WriteHeader() {
    if (!format_.comment.empty()) text_.append("# ").append(format_.comment).append("\n");
    text_ += "time[s]";
    for (const Waiting& waiting : waiting_) {
      for (const char axis : {'x', 'y', 'z'})
        text_.append(",").append(Column(waiting.stream, axis));
    }
    if (has_temperature_) text_.append(",").append(kTemperatureColumn);
    if (has_ambient_) text_.append(",").append(kAmbientColumn);
    text_ += "\n";
  }

  void Add(const SampleBlock& block) {
    for (Waiting& waiting : waiting_) {
      if (waiting.stream.triad == block.triad) waiting.Add(block);
    }
  }

  /// Writes the rows whose samples are all there; at the end, all that wait. A triad that has ended
  /// or is silent for long does not make the others wait: the memory is bounded.
  Status WriteRows(bool at_end) {
    const std::size_t longest_row = kLongestNumber * (3 * waiting_.size() + 3);
    constexpr std::size_t kBytesAtOnce = 1U << 18U;
    std::size_t filled = text_.size();
    while (at_end || NothingMissing()) {
      if (text_.size() < filled + longest_row) text_.resize(filled + kBytesAtOnce);
      char* const begin = text_.data() + filled;
      char* const end = WriteRow(begin);
      if (end == begin) break;
      filled += static_cast<std::size_t>(end - begin);
      if (filled > kBytesAtOnce) {
        file_.Write({text_.data(), filled});
        filled = 0;
      }
    }
    file_.Write({text_.data(), filled});
    text_.clear();
    if (went_back_) {
      return Error(ErrorCode::kTimeGoesBack,
                   {name_},
                   "samples of the recording are too far out of order to sort its rows by time");
    }
    return file_.status();
  }

  Status Commit() { return file_.Commit(); }
  Status status() const { return file_.status(); }

  /// The streams of a manifest that stand in this file.
  void DescribeStreams(YamlText* manifest) const {
    for (const Waiting& waiting : waiting_) {
      const StreamInfo& stream = waiting.stream;
      *manifest << "  " << TriadName(stream.triad) << ":\n    file: " << name_
                << "\n    time: {column: \"time[s]\", unit: s}\n";
      for (const char axis : {'x', 'y', 'z'}) {
        *manifest << "    " << std::string_view(&axis, 1) << ": " << Quoted{Column(stream, axis)}
                  << "\n";
      }
      *manifest << "    unit: " << stream.unit.name << "\n";
      if (stream.si_per_count) *manifest << "    si_per_count: " << *stream.si_per_count << "\n";
      if (stream.has_temperature) {
        *manifest << "    temperature: {column: \"" << kTemperatureColumn << "\", unit: degC}\n";
      }
      if (stream.has_ambient) {
        *manifest << "    ambient_temperature: {column: \"" << kAmbientColumn
                  << "\", unit: degC}\n";
      }
    }
  }

 private:
  static std::string Column(const StreamInfo& stream, char axis) {
    return std::string(TriadPrefix(stream.triad)) + "_" + axis + "[" + stream.unit.name + "]";
  }

  bool NothingMissing() const {
    // Samples: some seconds of the fastest loggers, 12 MB.
    constexpr std::size_t kMostWaiting = 1U << 18U;
    bool any_empty = false;
    for (const Waiting& waiting : waiting_) {
      if (waiting.time_ns.size() - waiting.next > kMostWaiting) return true;
      any_empty = any_empty || waiting.empty();
    }
    return !any_empty;
  }

  /// The row of the earliest time that waits; nothing when none does.
  char* WriteRow(char* text) {
    std::int64_t time_ns = std::numeric_limits<std::int64_t>::max();
    bool any = false;
    for (const Waiting& waiting : waiting_) {
      if (waiting.empty()) continue;
      any = true;
      time_ns = std::min(time_ns, waiting.time_ns[waiting.next]);
    }
    if (!any) return text;
    went_back_ = went_back_ || time_ns < last_time_ns_;
    last_time_ns_ = time_ns;
    text = WriteFixed(time_ns / time_unit_ns_, format_.time_decimals, text);
    double temperature_degc = kNoTemperature, ambient_degc = kNoTemperature;
    for (Waiting& waiting : waiting_) {
      if (waiting.empty() || waiting.time_ns[waiting.next] != time_ns) {
        text = std::fill_n(text, 3, ',');
        continue;
      }
      const std::size_t i = waiting.next++;
      for (const std::vector<double>* axis : {&waiting.x, &waiting.y, &waiting.z}) {
        *text++ = ',';
        text = WriteNumber((*axis)[i], waiting.decimals, text);
      }
      if (waiting.stream.has_temperature) temperature_degc = waiting.temperature_degc[i];
      if (waiting.stream.has_ambient) ambient_degc = waiting.ambient_degc[i];
    }
    if (has_temperature_) {
      *text++ = ',';
      text = WriteNumber(temperature_degc, format_.temperature_decimals, text);
    }
    if (has_ambient_) {
      *text++ = ',';
      text = WriteNumber(ambient_degc, format_.temperature_decimals, text);
    }
    *text++ = '\n';
    return text;
  }

  std::string name_;
  WholeFile file_;
  RecordingFormat format_;
  std::vector<Waiting> waiting_;
  bool has_temperature_ = false, has_ambient_ = false;
  std::int64_t time_unit_ns_ =
      std::llround(kPowersOfTen[static_cast<std::size_t>(9 - format_.time_decimals)]);
  std::int64_t last_time_ns_ = std::numeric_limits<std::int64_t>::min();
  bool went_back_ = false;
  std::string text_;
};

}  // namespace

double WrittenNumber(double value, int decimals) {
  const std::optional<std::int64_t> scaled = Scaled(value, decimals);
  return scaled ? static_cast<double>(*scaled) / kPowersOfTen[static_cast<std::size_t>(decimals)]
                : value;
}

Result<std::string> WriteRecording(SampleSource& source,
                                   const RecordingFormat& format,
                                   const std::string& directory,
                                   const ProgressCallback& progress) {
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(directory));
  std::vector<std::unique_ptr<CsvFile>> files;
  for (const StreamInfo& stream : source.info().streams) {
    if (files.empty() || !format.one_file) {
      const std::string name = format.one_file ? "recording" : std::string(TriadName(stream.triad));
      files.push_back(std::make_unique<CsvFile>(directory, name + ".csv", format));
    }
    files.back()->AddStream(stream);
  }
  for (const auto& file : files) file->WriteHeader();
  std::vector<SampleBlock> blocks;
  for (bool at_end = false; !at_end;) {
    TRUETRIAD_ASSIGN_OR_RETURN(const bool more, source.Next(&blocks));
    at_end = !more;
    for (const auto& file : files) {
      for (const SampleBlock& block : blocks) file->Add(block);
      TRUETRIAD_RETURN_IF_ERROR(file->WriteRows(at_end));
    }
    if (progress) progress(source.progress());
  }
  YamlText manifest;
  manifest << "recording: 1\n";
  if (!source.info().serial.empty()) manifest << "serial: " << Quoted{source.info().serial} << "\n";
  manifest << "applied: none\nstreams:\n";
  for (const auto& file : files) file->DescribeStreams(&manifest);
  for (const auto& file : files) TRUETRIAD_RETURN_IF_ERROR(file->Commit());
  std::string path = directory + "/recording.yaml";
  TRUETRIAD_RETURN_IF_ERROR(WriteFileAtomically(path, manifest.str()));
  return path;
}

std::string PoseRangesToYaml(const std::vector<PoseRange>& ranges) {
  YamlText yaml;
  yaml << (ranges.empty() ? "poses: []\n" : "poses:\n");
  for (const PoseRange& range : ranges) {
    yaml << "  - { first: " << range.first << ", last: " << range.last;
    if (!range.face_up.empty()) yaml << ", face: " << Quoted{range.face_up};
    if (!range.id.empty()) yaml << ", id: " << Quoted{range.id};
    yaml << " }\n";
  }
  return yaml.str();
}

}  // namespace truetriad
