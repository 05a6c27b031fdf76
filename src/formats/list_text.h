// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "formats/convention.h"
#include "formats/text.h"
#include "io/yaml_reader.h"
#include "truetriad/base/result.h"

namespace truetriad {

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

// A flat list of exactly `count` numbers; empty, with an error in the reader, when it is not.
std::vector<double> ReadList(YamlReader reader, std::size_t count);
// A list of three rows; identity, with an error in the reader, when it is not.
Eigen::Matrix3d ReadRows(YamlReader reader);

// What the fields of a map state, matrices as lists of rows or as one list; fields of one name
// share a list. Errors in the reader.
Stated ReadFields(YamlReader map, std::span<const Field> fields, bool in_rows = false);

}  // namespace truetriad
