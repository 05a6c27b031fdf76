// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

namespace truetriad {

// Numbers for people. They do not depend on the locale, so that the same input gives the same
// bytes. NaN is "n/a", and infinities are "∞" and "-∞"; a rounded zero has no minus sign.

/// `decimals` digits after the point. Range: 0…17.
std::string Fixed(double value, int decimals);

/// `digits` significant digits, in scientific notation if very large or small. Range: 1…17.
std::string Significant(double value, int digits);

/// "1.2345 ± 0.0012": σ has two digits, and the value ends at the same place. If there were more
/// than eight decimals: "(1.2345 ± 0.0012)e-9". Without a σ (zero or NaN): the value alone, to six
/// significant digits.
std::string WithSigma(double value, double sigma);

/// The cells of three axes; and the cell of a value that may be missing ("–").
using ThreeCells = std::array<std::string, 3>;
ThreeCells Fixed(const Eigen::Vector3d& values, int decimals);
ThreeCells Significant(const Eigen::Vector3d& values, int digits);
ThreeCells WithSigma(const Eigen::Vector3d& values, const Eigen::Vector3d& sigmas);
std::string Significant(const std::optional<double>& value, int digits);

/// The cells joined by `between`: "0.12, 0.34, 0.56".
std::string Joined(const ThreeCells& cells, std::string_view between = ", ");

/// A share as "12.3 %", three significant digits.
std::string Percent(double share);

/// A p-value as "0.25"; below one in a million it is "< 1e-6".
std::string Probability(double p);

/// "m/s^2" -> "m/s²", "uT/degC" -> "µT/°C", "tau^1" -> "τ¹"; any other unit as it is.
std::string DisplayUnit(std::string_view unit);

/// Reports keep to this width, so that they fit a terminal of 100 columns.
inline constexpr std::size_t kTextWidth = 98;

/// A table with one row for each pose lists at most this many: a few screens or a printed page.
inline constexpr std::size_t kMostListed = 60;

/// Fills the cells of a row from left to right with words or whole numbers.
class TableRow {
 public:
  explicit TableRow(std::vector<std::string>& cells) : cells_(cells) {}
  template <typename Cell>
  TableRow& operator<<(const Cell& cell) {
    if constexpr (std::is_integral_v<Cell>) {
      cells_.push_back(std::to_string(cell));
    } else if constexpr (std::is_constructible_v<std::string, const Cell&>) {
      cells_.emplace_back(cell);
    } else {
      for (const auto& each : cell) *this << each;
    }
    return *this;
  }

 private:
  std::vector<std::string>& cells_;
};

/// A table of finished text, for the terminal and for HTML alike.
struct Table {
  std::vector<std::string> header;  ///< Empty: none.
  std::string alignment;            ///< 'l' or 'r' for each column.
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> ids = {};  ///< HTML ids of the rows; empty: none.
  std::string copy = {};              ///< The text that a page's copy button copies; empty: none.
  std::string style = {};             ///< The class of the table in a page.

  /// A new row: `table.Add() << "bias" << Significant(bias, 4)`.
  TableRow Add() { return TableRow(rows.emplace_back()); }
};

/// An empty table whose header is given as "limit; result; P outside".
Table Headed(std::string_view header, std::string alignment);

/// The number of terminal columns that `utf8` occupies.
std::size_t DisplayWidth(std::string_view utf8);

/// The table with columns aligned, every line indented by `indent` blanks. A last column of words
/// is wrapped at kTextWidth. Empty when there are no rows.
std::string TextOf(const Table& table, std::size_t indent = 2);

/// `text` on lines of at most kTextWidth, indented by `indent` blanks. The first line starts with
/// `lead` ("- "), and the other lines are indented by its width as well. Control characters, which
/// could drive a terminal, become '?'.
std::string Wrapped(std::string_view text, std::size_t indent = 2, std::string_view lead = "");

}  // namespace truetriad
