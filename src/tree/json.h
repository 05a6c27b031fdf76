// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

namespace truetriad {

/// JSON whose members stay in the order in which they were added. Numbers that are not finite (NaN,
/// infinity) become null.
using Json = nlohmann::ordered_json;

inline Json ListJson(const Eigen::Ref<const Eigen::VectorXd>& vector) {
  Json list = Json::array();
  for (const double value : vector) list.push_back(value);
  return list;
}

/// A list of rows.
inline Json RowsJson(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  Json rows = Json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    rows.push_back(ListJson(matrix.row(row).transpose()));
  }
  return rows;
}

/// `json` as it is printed and written: UTF-8, with invalid bytes (of a file name, say) replaced.
inline std::string TextOf(const Json& json) {
  return json.dump(1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace) + '\n';
}

}  // namespace truetriad
