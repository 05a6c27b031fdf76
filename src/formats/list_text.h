// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "formats/number_text.h"
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

inline std::string ListText(const Eigen::Vector3d& vector) {
  return ListText(std::span<const double>(vector.data(), 3));
}

// Rows one after another in one list.
template <typename Number>
std::string RowMajorText(const Eigen::Matrix<Number, 3, 3>& matrix) {
  const Eigen::Matrix<Number, 3, 3, Eigen::RowMajor> rows = matrix;
  return ListText(std::span<const Number>(rows.data(), 9));
}

// A list of rows.
template <typename Derived>
std::string RowsText(const Eigen::MatrixBase<Derived>& matrix) {
  std::string text = "[";
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    const Eigen::VectorXd values = matrix.row(row).transpose();
    text += (row > 0 ? ", " : "") + ListText(std::span<const double>(
                                        values.data(), static_cast<std::size_t>(values.size())));
  }
  return text + "]";
}

// A flat list of exactly `count` numbers; empty, with an error in the reader, when it is not.
std::vector<double> ReadList(YamlReader reader, std::size_t count);
// A list of three rows; identity, with an error in the reader, when it is not.
Eigen::Matrix3d ReadRows(YamlReader reader);

}  // namespace truetriad
