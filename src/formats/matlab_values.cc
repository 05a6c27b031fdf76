// SPDX-License-Identifier: Apache-2.0
#include "formats/matlab_values.h"

#include <algorithm>
#include <cctype>
#include <charconv>

#include "base/companion.h"
#include "formats/text.h"

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

/// The text without comments; `%` inside of a text counts as that.
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

/// The rows of "1 2 3; 4 5 6". False when it is something else.
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

}  // namespace truetriad
