// SPDX-License-Identifier: Apache-2.0
#include "formats/list_text.h"

namespace truetriad {

std::vector<double> ReadList(YamlReader reader, std::size_t count) {
  std::vector<double> numbers;
  if (!reader.Read(&numbers)) return {};
  if (numbers.size() != count) {
    reader.Fail("has " + std::to_string(numbers.size()) + " numbers; expected " +
                std::to_string(count));
    return {};
  }
  return numbers;
}

Eigen::Matrix3d ReadRows(YamlReader reader) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  if (!reader) return matrix;
  std::vector<YamlReader> rows = reader.Items();
  if (rows.size() != 3) {
    reader.Fail("expected three rows of three numbers");
    return matrix;
  }
  for (Eigen::Index i = 0; i < 3; ++i) {
    const std::vector<double> row = ReadList(rows[static_cast<std::size_t>(i)], 3);
    if (row.size() == 3) matrix.row(i) << row[0], row[1], row[2];
  }
  return matrix;
}

}  // namespace truetriad
