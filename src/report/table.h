// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace truetriad {

/// Columns of a terminal line that reports keep to.
inline constexpr std::size_t kTextWidth = 98;

/// So many rows of what is one a pose are listed: a few screens, or one printed page.
inline constexpr std::size_t kMostListed = 60;

/// The cells of a row, from left to right: words, whole numbers, or several of them.
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

/// A table of ready-made words and numbers, for the terminal and for HTML alike.
struct Table {
  std::vector<std::string> header;  ///< Empty: none.
  std::string alignment;            ///< 'l' or 'r' for each column.
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> ids = {};  ///< Of the rows in a page; empty: none.
  std::string copy = {};              ///< What the table is copied as from a page; empty: nothing.
  std::string style = {};             ///< Its class in a page.

  /// A new row: `table.Add() << "bias" << Significant(bias, 4)`.
  TableRow Add() { return TableRow(rows.emplace_back()); }
};

/// An empty table: "limit; result; P outside".
Table Headed(std::string_view header, std::string alignment);

/// Columns that `utf8` takes in a terminal.
std::size_t DisplayWidth(std::string_view utf8);

/// The table with columns aligned, every line indented by `indent` blanks. A last column of words
/// is wrapped at kTextWidth. Empty when there are no rows.
std::string TextOf(const Table& table, std::size_t indent = 2);

/// `text` on lines of at most kTextWidth, indented by `indent` blanks; the first line starts with
/// `lead` ("- ") and the others are indented under what follows it. Control characters, which
/// could drive a terminal, become '?'.
std::string Wrapped(std::string_view text, std::size_t indent = 2, std::string_view lead = "");

}  // namespace truetriad
