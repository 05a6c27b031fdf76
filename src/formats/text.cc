// SPDX-License-Identifier: Apache-2.0
#include "formats/text.h"

#include <algorithm>

namespace truetriad {
namespace {

constexpr std::string_view kReadings = ": readings in ";
constexpr std::string_view kResult = ", result in ";

}  // namespace

std::vector<float> ReadConstant(const std::string& text, const std::string& declaration) {
  std::vector<float> numbers;
  const std::size_t declared = text.find(declaration);
  if (declared == std::string::npos) return numbers;
  const std::size_t end = std::min(text.find(';', declared), text.size());
  for (std::size_t at = text.find('{', declared); at < end;) {
    at = text.find_first_of("-.0123456789", at);
    if (at >= end) break;
    float value = 0.0F;
    const auto result = std::from_chars(text.data() + at, text.data() + end, value);
    numbers.push_back(value);
    at = static_cast<std::size_t>(result.ptr - text.data()) + 1;  // Past the f.
  }
  return numbers;
}

std::string UnitPhrase(const std::string& serial) { return "Calibration of " + UnitName(serial); }

std::string UnitName(const std::string& serial) {
  return serial.empty() ? "a unit without serial number" : serial;
}

std::string CommentText(std::string_view prefix, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text.append(prefix).append(line).append("\n");
  return text;
}

std::string UnitComment(Triad triad, std::string_view reading_unit, std::string_view result_unit) {
  std::string text(TriadName(triad));
  return text.append(kReadings)
      .append(reading_unit)
      .append(kResult)
      .append(result_unit)
      .append(".");
}

std::string UnitFromComment(const std::string& text, Triad triad) {
  const std::string begin = std::string(TriadName(triad)).append(kReadings);
  const std::size_t at = text.find(begin);
  if (at == std::string::npos) return "";
  const std::size_t unit = at + begin.size();
  const std::size_t end = text.find(kResult, unit);
  return end == std::string::npos ? "" : text.substr(unit, end - unit);
}

}  // namespace truetriad
