// SPDX-License-Identifier: Apache-2.0
#include "io/row_writer.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

namespace truetriad {
namespace {

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

constexpr std::array<double, 16> kPowersOfTen = {
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};

/// From 2^52 on, a double has no fraction, so adding 0.5 could not round.
constexpr double kNoFraction = 0x1p52;

/// value * 10^decimals, rounded (halves away from zero); nullopt for kShortest or if too large.
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

/// Room for one number: the longest double, -2.2250738585072014e-308, has 24 characters.
constexpr std::size_t kLongestNumber = 32;

/// Writes `number` / 10^decimals with all its decimals at `text`; returns the end. Replaces
/// std::to_chars with fixed decimals, since `simulate` would take 70 % more processor time with it.
char* WriteFixed(std::int64_t number, int decimals, char* text) {
  const auto bits = static_cast<std::uint64_t>(number);
  std::uint64_t rest = number < 0 ? 0 - bits : bits;
  *text = '-';
  text += number < 0 ? 1 : 0;
  // Digits are written from right to left, two at a time; at least one is before the point.
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

/// Writes a number; an empty field for NaN.
char* WriteNumber(double value, int decimals, char* text) {
  if (std::isnan(value)) return text;
  if (const std::optional<std::int64_t> scaled = Scaled(value, decimals)) {
    return WriteFixed(*scaled, decimals, text);
  }
  return std::to_chars(text, text + kLongestNumber, value).ptr;
}

}  // namespace

double WrittenNumber(double value, int decimals) {
  const std::optional<std::int64_t> scaled = Scaled(value, decimals);
  return scaled ? static_cast<double>(*scaled) / kPowersOfTen[static_cast<std::size_t>(decimals)]
                : value;
}

std::string ColumnOf(const StreamInfo& stream, char axis) {
  return std::string(TriadPrefix(stream.triad)) + "_" + axis + "[" + stream.unit.name + "]";
}

void WaitingSamples::Add(const SampleBlock& block) {
  const auto move = [drop = static_cast<std::ptrdiff_t>(next)](auto* values, const auto& fresh) {
    values->erase(values->begin(), values->begin() + drop);
    values->insert(values->end(), fresh.begin(), fresh.end());
  };
  move(&time_ns, block.time_ns);
  move(&x, block.x);
  move(&y, block.y);
  move(&z, block.z);
  if (stream.has_temperature) move(&temperature_degc, block.temperature_degc);
  if (stream.has_ambient) move(&ambient_degc, block.ambient_degc);
  if (stream.has_pose_column) move(&pose, block.pose);
  next = 0;
}

RowWriter::RowWriter(const std::string& path, const RecordingFormat& format, bool has_time)
    : file_(path), format_(format), has_time_(has_time) {
  constexpr int kNanoseconds = 9;  // Decimals of a second.
  time_decimals_ =
      format.time_decimals == RecordingFormat::kShortest ? kNanoseconds : format.time_decimals;
  time_unit_ns_ =
      std::llround(kPowersOfTen[static_cast<std::size_t>(kNanoseconds - time_decimals_)]);
}

void RowWriter::AddStream(const StreamInfo& stream) {
  waiting_.push_back({.stream = stream, .decimals = format_.decimals[stream.triad]});
  has_temperature_ |= stream.has_temperature;
  has_ambient_ |= stream.has_ambient;
  has_pose_ |= stream.has_pose_column;
}

void RowWriter::WriteHeader() {
  if (!format_.comment.empty()) text_.append("# ").append(format_.comment).append("\n");
  if (has_time_) text_ += "time[s],";
  for (const WaitingSamples& waiting : waiting_) {
    for (const char axis : kAxisLetters) text_.append(ColumnOf(waiting.stream, axis)) += ',';
  }
  if (has_temperature_) text_.append(kTemperatureColumn) += ',';
  if (has_ambient_) text_.append(kAmbientColumn) += ',';
  if (has_pose_) text_ += "pose,";
  text_.back() = '\n';
}

void RowWriter::Add(const SampleBlock& block) {
  for (WaitingSamples& waiting : waiting_) {
    if (waiting.stream.triad == block.triad) waiting.Add(block);
  }
}

Status RowWriter::WriteRows(bool at_end, ReadingChange* change) {
  const std::size_t longest_row = kLongestNumber * (3 * waiting_.size() + 4);
  constexpr std::size_t kBytesAtOnce = 1U << 18U;  // 256 kB, as TextFile reads.
  std::size_t filled = text_.size();
  while (at_end || NothingMissing()) {
    if (text_.size() < filled + longest_row) text_.resize(filled + kBytesAtOnce);
    char* const begin = text_.data() + filled;
    char* const end = WriteRow(begin, change);
    if (end == begin) break;
    filled += static_cast<std::size_t>(end - begin);
    if (filled > kBytesAtOnce) {
      file_.Write({text_.data(), filled});
      filled = 0;
    }
  }
  file_.Write({text_.data(), filled});
  text_.clear();
  if (came_too_late_) {
    return Error(ErrorCode::kTimeGoesBack,
                 "the " + std::string(TriadName(*came_too_late_)) +
                     " appears too late in the log to sort its rows by time; sort the log, or put "
                     "each sensor into its own file");
  }
  return file_.status();
}

/// Whether a row can be written: samples of all triads are waiting, or too many samples of one
/// triad are.
bool RowWriter::NothingMissing() const {
  // Number of samples of a triad: 8 s at 32 kHz, which take 12 MB.
  constexpr std::size_t kMostWaiting = 1U << 18U;
  bool any_empty = false;
  for (const WaitingSamples& waiting : waiting_) {
    if (waiting.size() > kMostWaiting) return true;
    any_empty = any_empty || waiting.size() == 0;
  }
  return !any_empty;
}

char* RowWriter::WriteTime(std::int64_t time_ns, char* text) const {
  text = WriteFixed(time_ns / time_unit_ns_, time_decimals_, text);
  if (format_.time_decimals != RecordingFormat::kShortest) return text;
  while (text[-1] == '0') --text;
  return text[-1] == '.' ? text - 1 : text;
}

/// Writes the row of the earliest time of the waiting samples; nothing if no sample waits.
char* RowWriter::WriteRow(char* text, ReadingChange* change) {
  const WaitingSamples* first = nullptr;
  for (const WaitingSamples& waiting : waiting_) {
    if (waiting.size() == 0) continue;
    if (first == nullptr || waiting.time_ns[waiting.next] < first->time_ns[first->next]) {
      first = &waiting;
    }
  }
  if (first == nullptr) return text;
  const std::int64_t time_ns = first->time_ns[first->next];
  if (time_ns < last_time_ns_ && !came_too_late_) came_too_late_ = first->stream.triad;
  last_time_ns_ = time_ns;
  const auto write = [&text](double value, int decimals) {
    text = WriteNumber(value, decimals, text);
    *text++ = ',';
  };
  if (has_time_) {
    text = WriteTime(time_ns, text);
    *text++ = ',';
  }
  double temperature_degc = kNotKnown, ambient_degc = kNotKnown;
  std::optional<std::int32_t> pose;
  for (WaitingSamples& waiting : waiting_) {
    if (waiting.size() == 0 || waiting.time_ns[waiting.next] != time_ns) {
      text = std::fill_n(text, 3, ',');
      continue;
    }
    const std::size_t i = waiting.next++;
    const StreamInfo& stream = waiting.stream;
    const double degc = stream.has_temperature ? waiting.temperature_degc[i] : kNotKnown;
    Eigen::Vector3d reading(waiting.x[i], waiting.y[i], waiting.z[i]);
    if (change != nullptr) reading = change->Changed(stream.triad, time_ns, reading, degc);
    for (const double value : reading) write(value, waiting.decimals);
    if (std::isnan(temperature_degc)) temperature_degc = degc;
    if (stream.has_ambient) ambient_degc = waiting.ambient_degc[i];
    if (stream.has_pose_column && !pose) pose = waiting.pose[i];
  }
  if (has_temperature_) write(temperature_degc, format_.temperature_decimals);
  if (has_ambient_) write(ambient_degc, format_.temperature_decimals);
  if (has_pose_) write(pose.value_or(0), 0);
  text[-1] = '\n';
  if (change != nullptr) change->EndRow();
  return text;
}

}  // namespace truetriad
