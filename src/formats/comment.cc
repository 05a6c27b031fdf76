// SPDX-License-Identifier: Apache-2.0
#include "formats/comment.h"

namespace truetriad {
namespace {

constexpr std::string_view kReadings = ": readings in ";
constexpr std::string_view kResult = ", result in ";

}  // namespace

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
