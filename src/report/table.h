// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace truetriad {

/// Columns of a terminal line that reports keep to.
inline constexpr std::size_t kTextWidth = 98;

/// A table of ready-made words and numbers, for the terminal and for HTML alike.
struct Table {
  std::vector<std::string> header;  ///< Empty: none.
  std::string alignment;            ///< 'l' or 'r' for each column.
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> ids = {};  ///< Of the rows in a page; empty: none.
  std::string copy = {};              ///< What the table is copied as from a page; empty: nothing.
};

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
