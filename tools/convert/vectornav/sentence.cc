// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/vectornav/sentence.h"

#include <charconv>
#include <cstdint>
#include <optional>
#include <system_error>

namespace truetriad::convert {
namespace {

/// Stands for a checksum that nobody counted.
constexpr std::string_view kNotCounted = "XX";

std::uint8_t XorOf(std::string_view text) {
  std::uint8_t sum = 0;
  for (const char c : text) sum ^= static_cast<std::uint8_t>(c);
  return sum;
}

std::uint16_t CrcOf(std::string_view text) {
  constexpr unsigned kPolynomial = 0x1021;
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

/// What is before the next comma; `rest` is unset where there is none.
std::string_view TakeField(std::optional<std::string_view>* rest) {
  const std::string_view text = **rest;
  const std::size_t comma = text.find(',');
  if (comma == std::string_view::npos) {
    rest->reset();
  } else {
    *rest = text.substr(comma + 1);
  }
  return text.substr(0, comma);
}

bool IsStatus(std::string_view field) {
  return field.size() == 5 && field[0] == 'S' &&
         field.find_first_not_of("0123456789ABCDEFabcdef", 1) == std::string_view::npos;
}

bool IsCounter(std::string_view field) {
  return field.size() > 1 && field[0] == 'T' &&
         field.find_first_not_of("0123456789", 1) == std::string_view::npos;
}

}  // namespace

const std::vector<SentenceKind>& SentenceKinds() {
  using enum Triad;
  static const std::vector<SentenceKind> kinds = {
      // Behind yaw, pitch and roll.
      {"VNYMR", 12, 3, {kMagnetometer, kAccelerometer, kGyroscope}, true, std::nullopt},
      // Behind a quaternion.
      {"VNQMR", 13, 4, {kMagnetometer, kAccelerometer, kGyroscope}, true, std::nullopt},
      {"VNMAR", 9, 0, {kMagnetometer, kAccelerometer, kGyroscope}, true, std::nullopt},
      {"VNMAG", 3, 0, {kMagnetometer}, true, std::nullopt},
      {"VNACC", 3, 0, {kAccelerometer}, true, std::nullopt},
      {"VNGYR", 3, 0, {kGyroscope}, true, std::nullopt},
      // Before temperature and pressure.
      {"VNIMU", 11, 0, {kMagnetometer, kAccelerometer, kGyroscope}, false, 9},
  };
  return kinds;
}

const SentenceKind* FindSentenceKind(std::string_view name) {
  for (const SentenceKind& kind : SentenceKinds()) {
    if (kind.name == name) return &kind;
  }
  return nullptr;
}

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

std::vector<double> NumbersOf(std::string_view body, std::size_t count) {
  std::vector<double> numbers;
  std::optional<std::string_view> rest = body;
  while (numbers.size() < count) {
    if (!rest) return {};
    std::string_view field = TakeField(&rest);
    if (field.starts_with('+')) field.remove_prefix(1);
    double number = 0.0;
    const char* const end = field.data() + field.size();
    const auto [stop, failure] = std::from_chars(field.data(), end, number);
    if (field.empty() || failure != std::errc() || stop != end) return {};
    numbers.push_back(number);
  }
  std::optional<std::string_view> behind = rest;
  if (behind && IsStatus(TakeField(&behind))) rest = behind;
  behind = rest;
  if (behind && IsCounter(TakeField(&behind))) rest = behind;
  return rest ? std::vector<double>() : numbers;
}

bool HasAppended(std::string_view body) {
  const std::size_t comma = body.rfind(',');
  if (comma == std::string_view::npos) return false;
  const std::string_view last = body.substr(comma + 1);
  return IsStatus(last) || IsCounter(last);
}

}  // namespace truetriad::convert
