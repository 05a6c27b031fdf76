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

#include "io/merged_rows.h"
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

/// One CSV with some of the triads.
class CsvFile {
 public:
  CsvFile(const std::string& directory, std::string name, const RecordingFormat& format)
      : name_(std::move(name)), file_(directory + "/" + name_), format_(format) {}

  void AddStream(const StreamInfo& stream) {
    streams_.push_back(stream);
    rows_.AddStream(stream.triad);
    has_temperature_ = has_temperature_ || stream.has_temperature;
    has_ambient_ = has_ambient_ || stream.has_ambient;
  }

  void WriteHeader() {
    if (!format_.comment.empty()) text_.append("# ").append(format_.comment).append("\n");
    text_ += "time[s]";
    for (const StreamInfo& stream : streams_) {
      for (const char axis : {'x', 'y', 'z'}) text_.append(",").append(Column(stream, axis));
    }
    if (has_temperature_) text_.append(",").append(kTemperatureColumn);
    if (has_ambient_) text_.append(",").append(kAmbientColumn);
    text_ += "\n";
  }

  void Add(const SampleBlock& block) { rows_.Add(block); }

  /// Writes the rows whose samples are all there; at the end, all that wait.
  Status WriteRows(bool at_end) {
    const std::size_t longest_row = kLongestNumber * (3 * streams_.size() + 3);
    constexpr std::size_t kBytesAtOnce = 1U << 18U;
    std::size_t filled = text_.size();
    while (rows_.Next(at_end)) {
      if (text_.size() < filled + longest_row) text_.resize(filled + kBytesAtOnce);
      filled = static_cast<std::size_t>(WriteRow(text_.data() + filled) - text_.data());
      if (filled > kBytesAtOnce) {
        file_.Write({text_.data(), filled});
        filled = 0;
      }
    }
    file_.Write({text_.data(), filled});
    text_.clear();
    TRUETRIAD_RETURN_IF_ERROR(rows_.status());
    return file_.status();
  }

  Status Commit() { return file_.Commit(); }
  Status status() const { return file_.status(); }

  /// The streams of a manifest that stand in this file.
  void DescribeStreams(YamlText* manifest) const {
    for (const StreamInfo& stream : streams_) {
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

  /// The row that has come up; returns its end.
  char* WriteRow(char* text) const {
    text = WriteFixed(rows_.time_ns() / time_unit_ns_, format_.time_decimals, text);
    double temperature_degc = kNoTemperature, ambient_degc = kNoTemperature;
    for (const auto& [triad, samples, i, is_in_row] : rows_.streams()) {
      if (!is_in_row) {
        text = std::fill_n(text, 3, ',');
        continue;
      }
      for (const std::vector<double>* axis : {&samples.x, &samples.y, &samples.z}) {
        *text++ = ',';
        text = WriteNumber((*axis)[i], format_.decimals[triad], text);
      }
      if (!samples.temperature_degc.empty()) temperature_degc = samples.temperature_degc[i];
      if (!samples.ambient_degc.empty()) ambient_degc = samples.ambient_degc[i];
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
  std::vector<StreamInfo> streams_;
  MergedRows rows_;
  bool has_temperature_ = false, has_ambient_ = false;
  std::int64_t time_unit_ns_ =
      std::llround(kPowersOfTen[static_cast<std::size_t>(9 - format_.time_decimals)]);
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
