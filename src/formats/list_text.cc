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

Stated ReadFields(YamlReader map, std::span<const Field> fields, bool in_rows) {
  Stated stated;
  while (!fields.empty()) {
    std::size_t count = 0;
    Eigen::Index size = 0;
    for (; count < fields.size() && fields[count].name == fields[0].name; ++count)
      size += SizeOf(fields[count].quantity);
    const std::span<const Field> together = fields.first(count);
    fields = fields.subspan(count);
    const Field& first = together[0];
    YamlReader child = first.is_optional ? map.Child(first.name) : map.RequireChild(first.name);
    if (!child) continue;
    if (in_rows && size == 9) {
      stated[first.quantity] = ReadRows(child).transpose().reshaped();
      continue;
    }
    const std::vector<double> numbers = ReadList(child, static_cast<std::size_t>(size));
    if (!numbers.empty()) stated.merge(StatedTogether(together, numbers.data()));
  }
  return stated;
}

}  // namespace truetriad
