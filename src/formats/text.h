// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/rounded_text.h"
#include "formats/format.h"
#include "formats/number_text.h"
#include "io/yaml_reader.h"
#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/formats/export.h"

namespace truetriad {

// A float constant of C.
inline std::string FloatLiteral(float value) {
  std::string text = NumberText(value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text + "f";
}

// The numbers of the constant of C that `text` declares in these words, up to its semicolon; empty
// where there is none.
std::vector<float> ReadConstant(const std::string& text, const std::string& declaration);

/// A line of a file that people write: its words, which blanks, tabs and commas part, up to a `#`.
struct WordLine {
  FilePlace place;
  std::string text;  ///< All of it.
  std::vector<std::string> words;
};
std::vector<WordLine> WordLines(const ExportedFile& file);

/// The number that all of `word` is; unset: it is none.
template <typename Number>
std::optional<Number> ParseNumber(std::string_view word) {
  Number value{};
  const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool is_all = failure == std::errc() && end == word.data() + word.size();
  return is_all ? std::optional(value) : std::nullopt;
}

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

// Lists of numbers as YAML reads them.

template <typename Number>
std::string ListText(std::span<const Number> values) {
  std::string text = "[";
  for (std::size_t i = 0; i < values.size(); ++i) {
    text += (i > 0 ? ", " : "") + (std::isfinite(values[i]) ? NumberText(values[i]) : "null");
  }
  return text + "]";
}

inline std::string ListText(const Eigen::VectorXd& vector) {
  return ListText(std::span<const double>(vector.data(), static_cast<std::size_t>(vector.size())));
}

// A list of the three rows of a matrix, which come one after another.
inline std::string RowsText(const Eigen::VectorXd& matrix) {
  const std::span<const double> numbers(matrix.data(), 9);
  return "[" + ListText(numbers.first(3)) + ", " + ListText(numbers.subspan(3, 3)) + ", " +
         ListText(numbers.last(3)) + "]";
}

// What the fields of a map state, matrices as lists of rows or as one list; fields of one name
// share a list. Errors in the reader.
Stated ReadFields(YamlReader map, std::span<const Field> fields, bool in_rows = false);

// Continuous-time noise of a triad, true units: what visual-inertial programs ask for.
struct NoiseDensities {
  Eigen::Vector3d white = Eigen::Vector3d::Zero();  // unit / sqrt(Hz)
  // unit / s / sqrt(Hz); unset where a rest was too short to tell it of every axis.
  std::optional<Eigen::Vector3d> random_walk;
  double rate_hz = 0.0;
};

// One number for three axes: their RMS.
double RmsOfAxes(const Eigen::Vector3d& density);

// From --allan; unset when there is none, it does not hold the triad, or does not tell white noise
// of every axis. Error (bad input): it is in counts of unknown size.
Result<std::optional<NoiseDensities>> NoiseOf(const ExportOptions& options, Triad triad);

}  // namespace truetriad
