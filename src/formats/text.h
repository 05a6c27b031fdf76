// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <string>
#include <string_view>
#include <vector>

#include "base/rounded_text.h"
#include "truetriad/base/triad.h"

namespace truetriad {

// Numbers for files of other programs: independent of the locale, as few digits as read back to the
// same bits.
template <typename Number>
std::string NumberText(Number value) {
  char text[64];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// The same without an exponent.
template <typename Number>
std::string PlainNumberText(Number value) {
  char text[512];  // 1e-308 has that many digits
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::fixed).ptr};
}

// A float constant of C.
inline std::string FloatLiteral(float value) {
  std::string text = NumberText(value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text + "f";
}

// The numbers of the constant of C that `text` declares in these words, up to its semicolon; empty
// where there is none.
std::vector<float> ReadConstant(const std::string& text, const std::string& declaration);

std::string CommentText(std::string_view prefix, const std::vector<std::string>& lines);

/// What every exported file of a calibration says of its unit, and of itself with the version in
/// between.
std::string UnitPhrase(const std::string& serial);
/// The serial number, or in words that there is none.
std::string UnitName(const std::string& serial);
inline constexpr std::string_view kExportedBy = "Exported by truetriad ";
inline constexpr std::string_view kWasCalibrated = "; calibrated ";

// How the comment of a file begins that was exported of a unit which may not leave.
inline constexpr std::string_view kMustNotLeave = "THIS UNIT MUST NOT LEAVE";

// The line of an exported file that says which units a sensor's numbers are for.
std::string UnitComment(Triad triad, std::string_view reading_unit, std::string_view result_unit);

// The unit of the readings that such a line of `text` states; empty when there is none.
std::string UnitFromComment(const std::string& text, Triad triad);

}  // namespace truetriad
