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

// A float literal of C.
inline std::string FloatLiteral(float value) {
  std::string text = NumberText(value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text + "f";
}

// Reads the numbers of a C constant: `declaration` is the beginning of its declaration in `text`,
// and `;` its end. Empty if `text` has no such declaration.
std::vector<float> ReadConstant(const std::string& text, const std::string& declaration);

/// A line of a hand-written file. Blanks, tabs and commas separate its words; a `#` ends them.
struct WordLine {
  FilePlace place;
  std::string text;  ///< The whole line.
  std::vector<std::string> words;
};
std::vector<WordLine> WordLines(const ExportedFile& file);

/// Parses `word` as a number; unset unless the whole word is one number.
template <typename Number>
std::optional<Number> ParseNumber(std::string_view word) {
  Number value{};
  const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool is_all = failure == std::errc() && end == word.data() + word.size();
  return is_all ? std::optional(value) : std::nullopt;
}

std::string CommentText(std::string_view prefix, const std::vector<std::string>& lines);

/// Words about the unit that every exported calibration contains; IsExport searches for them. The
/// program's version stands between the two constants below.
std::string UnitPhrase(const std::string& serial);
/// The serial number, or, without a serial number, words that say so.
std::string UnitName(const std::string& serial);
inline constexpr std::string_view kExportedBy = "Exported by truetriad ";
inline constexpr std::string_view kWasCalibrated = "; calibrated ";

// The first words of the comment in a file exported for a unit that may not be delivered.
inline constexpr std::string_view kMustNotLeave = "THIS UNIT MUST NOT LEAVE";

// The line in the comment of a file that states the units of a sensor's numbers.
std::string UnitComment(Triad triad, std::string_view reading_unit, std::string_view result_unit);

// The unit of the readings in a UnitComment within `text`; empty if there is none.
std::string UnitFromComment(const std::string& text, Triad triad);

// Lists of numbers in the syntax of YAML.

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

// A list of the three rows of a matrix, one after another.
inline std::string RowsText(const Eigen::VectorXd& matrix) {
  const std::span<const double> numbers(matrix.data(), 9);
  return "[" + ListText(numbers.first(3)) + ", " + ListText(numbers.subspan(3, 3)) + ", " +
         ListText(numbers.last(3)) + "]";
}

// Reads the quantities of `fields` from a map. A matrix is a list of rows if `in_rows`, otherwise
// one list. Adjacent fields of the same name share a list. The reader keeps the errors.
Stated ReadFields(YamlReader map, std::span<const Field> fields, bool in_rows = false);

// Continuous-time noise of a triad in true units, as visual-inertial programs need it.
struct NoiseDensities {
  Eigen::Vector3d white = Eigen::Vector3d::Zero();  // unit / sqrt(Hz)
  // unit / s / sqrt(Hz); unset unless it was estimated for all three axes.
  std::optional<Eigen::Vector3d> random_walk;
  double rate_hz = 0.0;
};

// The RMS of the three axes, as one number.
double RmsOfAxes(const Eigen::Vector3d& density);

// The noise from --allan; unset if no file is given, or if the file lacks the triad or the white
// noise of some axis. Error (bad input): the file is in counts of unknown size.
Result<std::optional<NoiseDensities>> NoiseOf(const ExportOptions& options, Triad triad);

}  // namespace truetriad
