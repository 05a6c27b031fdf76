// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>

#include <Eigen/LU>

#include "base/companion.h"
#include "formats/format.h"
#include "formats/matlab_values.h"
#include "formats/text.h"
#include "truetriad/base/triad.h"

// MATLAB, in double, as a script (.m) or .mat: structs accel, gyro and mag with
//
//   truth = C (raw - b - G force),  columns; C = S^-1
//
// and the covariance of (b, S by rows). For the magnetometer also A, b and expmfs, as MATLAB's
// magcal returns them for row vectors: truth_row = (raw_row - b) A, so A = C^T.

namespace truetriad {
namespace {

std::string MatrixText(const Eigen::MatrixXd& matrix) {
  if (matrix.size() == 1) return NumberText(matrix(0, 0));
  std::string text = "[";
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index col = 0; col < matrix.cols(); ++col) {
      text += (col > 0 ? " " : row > 0 ? ";\n    " : "") + NumberText(matrix(row, col));
    }
  }
  return text + "]";
}

bool IsNameCharacter(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
}

/// The text without comments; a `%` inside a string is kept.
std::string WithoutComments(const std::string& text) {
  std::string kept;
  bool in_comment = false;
  bool in_text = false;
  for (const char c : text) {
    if (c == '\n') in_comment = in_text = false;
    if (c == '\'' && !in_comment) in_text = !in_text;
    if (c == '%' && !in_text) in_comment = true;
    if (!in_comment) kept += c;
  }
  return kept;
}

/// Parses the rows of "1 2 3; 4 5 6". Returns false if the text is not a matrix.
bool ParseMatrix(std::string_view text, Eigen::MatrixXd* matrix) {
  std::vector<std::vector<double>> rows(1);
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at != end) {
    if (*at == ';' || *at == '\n') {
      rows.emplace_back();
      ++at;
    } else if (std::isspace(static_cast<unsigned char>(*at)) != 0 || *at == ',') {
      ++at;
    } else {
      double value = 0.0;
      const auto [next, failure] = std::from_chars(at, end, value);
      if (failure != std::errc()) return false;
      rows.back().push_back(value);
      at = next;
    }
  }
  std::erase_if(rows, [](const std::vector<double>& row) { return row.empty(); });
  if (rows.empty()) return false;
  matrix->resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(rows[0].size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].size() != rows[0].size()) return false;
    for (std::size_t j = 0; j < rows[i].size(); ++j) {
      (*matrix)(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = rows[i][j];
    }
  }
  return true;
}

}  // namespace

const MatlabVariable* FindVariable(const MatlabVariables& variables, const std::string& name) {
  const auto found = std::find_if(variables.begin(), variables.end(), [&](const auto& variable) {
    return variable.name == name;
  });
  return found == variables.end() ? nullptr : &*found;
}

std::string ScriptText(const MatlabVariables& variables, const std::vector<std::string>& comment) {
  std::string text = CommentText("% ", comment);
  for (const MatlabVariable& variable : variables) {
    std::string value = MatrixText(variable.numbers);
    if (variable.numbers.size() == 0) value = "'" + variable.text + "'";
    text += variable.name + " = " + value + ";\n";
  }
  return text;
}

MatlabVariables ParseScript(const std::string& script) {
  const std::string text = WithoutComments(script);
  MatlabVariables variables;
  for (std::size_t equals = text.find('='); equals != std::string::npos;
       equals = text.find('=', equals + 1)) {
    std::size_t end = equals;
    while (end > 0 && text[end - 1] == ' ') --end;
    std::size_t begin = end;
    while (begin > 0 && IsNameCharacter(text[begin - 1])) --begin;
    const std::size_t value = text.find_first_not_of(' ', equals + 1);
    if (begin == end || value == std::string::npos) continue;
    MatlabVariable variable{text.substr(begin, end - begin), {}, {}};
    const char opening = text[value];
    const std::size_t close = opening == '['    ? text.find(']', value)
                              : opening == '\'' ? text.find('\'', value + 1)
                                                : text.find_first_of(";\n", value);
    const bool enclosed = opening == '[' || opening == '\'';
    const std::size_t first = value + (enclosed ? 1 : 0);
    const std::string content = text.substr(first, std::min(close, text.size()) - first);
    if (opening == '\'') {
      variable.text = content;
    } else if (!ParseMatrix(content, &variable.numbers)) {
      continue;
    }
    variables.push_back(std::move(variable));
  }
  return variables;
}

const MatlabModule* MatlabModuleOf() {
  static const MatlabModule* const module = []() -> const MatlabModule* {
    const Result<void*> function = CompanionFunction(kMatlabModuleFile, kMatlabModuleFunction);
    return function ? reinterpret_cast<const MatlabModule* (*)()>(*function)() : nullptr;
  }();
  return module;
}

bool IsMatFile(const std::string& bytes) {
  return bytes.starts_with("MATLAB ") || bytes.starts_with("\x89HDF");
}

namespace {

constexpr std::array<std::string_view, 3> kStructs = {"accel", "gyro", "mag"};

std::string StructName(Triad triad) {
  return std::string(kStructs[static_cast<std::size_t>(triad)]);
}

/// The covariance of the bias (x, y, z) and the sensitivity (by rows); empty if the covariance
/// lacks one of these parameters.
Eigen::MatrixXd CovarianceOf(const NamedCovariance& covariance, Triad triad) {
  std::vector<Eigen::Index> places;
  const auto list = [&](const std::string& name) {
    const auto found = std::find(covariance.parameters.begin(), covariance.parameters.end(), name);
    if (found != covariance.parameters.end()) {
      places.push_back(found - covariance.parameters.begin());
    }
  };
  const std::string name(TriadName(triad));
  for (const char axis : kAxisLetters) list(name + ".bias." + axis);
  for (const char row : kAxisLetters) {
    for (const char col : kAxisLetters) list(name + ".sensitivity." + row + col);
  }
  constexpr std::size_t kEntries = 12;  // A bias and a matrix.
  if (places.size() != kEntries) return {};
  return covariance.matrix(places, places);
}

Error NoModule(const std::string& doing, const std::string& instead) {
  return Error(ErrorCode::kMissingProgram,
               doing + " a .mat needs " + kMatlabModuleFile +
                   "; build it with `tools/build.sh programs`" + instead);
}

Result<Files> WriteMatlab(const WriteRequest& request) {
  MatlabVariables variables;
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    const std::string name = StructName(triad) + ".";
    variables.push_back({name + "input_unit", {}, sensor->input_unit});
    variables.push_back({name + "output_unit", {}, sensor->output_unit});
    variables.push_back({name + "C", sensor->model.Correction(), {}});
    variables.push_back({name + "b", sensor->model.bias, {}});
    variables.push_back({name + "S", sensor->model.sensitivity, {}});
    if (sensor->g_sensitivity) variables.push_back({name + "G", *sensor->g_sensitivity, {}});
    const Eigen::MatrixXd covariance = CovarianceOf(request.calibration.covariance, triad);
    if (covariance.size() > 0) variables.push_back({name + "covariance", covariance, {}});
  }
  if (const auto& mag = request.calibration.sensors[Triad::kMagnetometer]) {
    variables.push_back({"A", mag->model.Correction().transpose(), {}});
    variables.push_back({"b", mag->model.bias.transpose(), {}});
    if (const auto field_ut = request.calibration.reference.field_ut) {
      variables.push_back({"expmfs", Eigen::MatrixXd::Constant(1, 1, *field_ut), {}});
    }
  }
  if (request.options.file_name.ends_with(".m")) {
    return Files{{"", ScriptText(variables, request.comment)}};
  }
  std::string comment;
  for (const std::string& line : request.comment) comment += line + "\n";
  variables.push_back({"comment", {}, comment});
  if (MatlabModuleOf() == nullptr) {
    return NoModule("writing",
                    ". Or write a script, which does not need it: give --output a name ending in "
                    ".m");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(std::string bytes,
                             MatlabModuleOf()->write(variables, request.comment));
  return Files{{"", std::move(bytes)}};
}

/// A 3x3 matrix of the file; unset if the variable is missing. Error: it has another size or a
/// number that is not finite.
Result<std::optional<Eigen::Matrix3d>> MatrixOf(const MatlabVariables& variables,
                                                const std::string& name,
                                                const std::string& file) {
  using Found = std::optional<Eigen::Matrix3d>;
  const MatlabVariable* const variable = FindVariable(variables, name);
  if (variable == nullptr) return Found();
  if (variable->numbers.rows() != 3 || variable->numbers.cols() != 3 ||
      !variable->numbers.allFinite()) {
    return Error(
        ErrorCode::kInvalidValue, {file}, "`" + name + "` is not a 3x3 matrix of finite numbers");
  }
  return Found(variable->numbers);
}

Result<Carried> ReadMatlab(const ReadRequest& request) {
  const ExportedFile& file = request.files[0];
  Result<MatlabVariables> variables = MatlabVariables();
  if (IsMatFile(file.text)) {
    if (MatlabModuleOf() == nullptr) return NoModule(file.suffix + ": reading", "");
    variables = MatlabModuleOf()->parse(file.text, file.suffix);
  } else {
    variables = ParseScript(file.text);
  }
  TRUETRIAD_RETURN_IF_ERROR(variables);
  Carried carried;
  for (const Triad triad : kTriads) {
    std::string prefix = StructName(triad) + ".";
    auto C = MatrixOf(*variables, prefix + "C", file.suffix);
    TRUETRIAD_RETURN_IF_ERROR(C);
    if (!*C && triad == Triad::kMagnetometer) {
      // The file holds a result of magcal, and none of our structs.
      prefix = "";
      C = MatrixOf(*variables, "A", file.suffix);
      TRUETRIAD_RETURN_IF_ERROR(C);
      if (*C) (*C)->transposeInPlace();
    }
    if (!*C) continue;
    const MatlabVariable* const bias = FindVariable(*variables, prefix + "b");
    if (bias == nullptr || bias->numbers.size() != 3 || !bias->numbers.allFinite()) {
      return Error(
          ErrorCode::kInvalidValue, {file.suffix}, "`" + prefix + "b` is not three finite numbers");
    }
    CorrectionParts& parts = carried.parts[triad].emplace();
    parts.matrix = **C;
    parts.before = bias->numbers.reshaped();
    if (parts.matrix.determinant() == 0.0) {
      return Error(ErrorCode::kSingularMatrix,
                   {file.suffix},
                   "the matrix of the " + std::string(TriadName(triad)) + " is singular");
    }
    TRUETRIAD_ASSIGN_OR_RETURN(parts.g_sensitivity,
                               MatrixOf(*variables, prefix + "G", file.suffix));
    const MatlabVariable* const unit = FindVariable(*variables, prefix + "input_unit");
    if (unit != nullptr) parts.reading_unit = unit->text;
    // A stated sensitivity is kept, since its zeros are exact.
    const auto S = MatrixOf(*variables, prefix + "S", file.suffix);
    TRUETRIAD_RETURN_IF_ERROR(S);
    // Product of S and its inverse, both written with all digits, differs from I by less than this.
    constexpr double kInverseRounding = 1e-9;
    if (*S && (parts.matrix * **S - Eigen::Matrix3d::Identity()).norm() < kInverseRounding) {
      parts.sensitivity = **S;
    }
  }
  if (const MatlabVariable* const field = FindVariable(*variables, "expmfs");
      field != nullptr && field->numbers.size() == 1) {
    carried.field_ut = field->numbers(0, 0);
  }
  return carried;
}

}  // namespace

Format MatlabFormat() {
  constexpr TriadCapacity kHeld = {.held = true, .g_sensitivity = true, .free_unit = true};
  return {.info = {"matlab",
                   "MATLAB, .mat or script (.m), with magcal's A, b, expmfs",
                   "calibration.m",
                   Arithmetic::kFloat64,
                   true},
          .capacity = {{kHeld, kHeld, kHeld}},
          .write = WriteMatlab,
          .read = ReadMatlab};
}

}  // namespace truetriad
