// SPDX-License-Identifier: Apache-2.0
#include "report/table.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/utf8.h"

namespace truetriad {
namespace {

constexpr std::size_t kGap = 3;        // Blanks between columns.
constexpr std::size_t kMinWords = 24;  // A column of words is never squeezed below this.

/// A cell, in one line as a terminal may show it.
std::string Shown(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
  return PrintableLine(text);
}

std::string Padded(const std::string& text, std::size_t width, bool right) {
  const std::string blanks(width - std::min(width, DisplayWidth(text)), ' ');
  return right ? blanks + text : text + blanks;
}

/// Lines of at most `width`; a word that is longer stands alone.
std::vector<std::string> WrappedLines(std::string_view text, std::size_t width) {
  const std::string words = Shown(std::string(text));
  std::vector<std::string> lines(1);
  for (std::size_t begin = 0; begin < words.size();) {
    const std::size_t end = std::min(words.find(' ', begin), words.size());
    const std::string word = words.substr(begin, end - begin);
    begin = end + 1;
    if (word.empty()) continue;
    if (lines.back().empty()) {
      lines.back() = word;
    } else if (DisplayWidth(lines.back()) + 1 + DisplayWidth(word) <= width) {
      lines.back() += ' ' + word;
    } else {
      lines.push_back(word);
    }
  }
  return lines;
}

std::string WithoutTrailingBlanks(std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

}  // namespace

Table Headed(std::string_view header, std::string alignment) {
  Table table{{}, std::move(alignment), {}};
  for (std::size_t begin = 0; begin <= header.size();) {
    const std::size_t end = std::min(header.find("; ", begin), header.size());
    table.header.emplace_back(header.substr(begin, end - begin));
    begin = end + 2;
  }
  return table;
}

std::size_t DisplayWidth(std::string_view utf8) {
  // Code points; the reports hold no wide or combining characters of their own.
  return static_cast<std::size_t>(std::count_if(utf8.begin(), utf8.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  }));
}

std::string TextOf(const Table& table, std::size_t indent) {
  if (table.rows.empty()) return "";
  std::vector<std::vector<std::string>> rows = table.rows;
  if (!table.header.empty()) rows.insert(rows.begin(), table.header);
  std::vector<std::size_t> widths(table.alignment.size(), 0);
  for (auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      row[c] = Shown(row[c]);
      widths[c] = std::max(widths[c], DisplayWidth(row[c]));
    }
  }
  const std::size_t last = widths.size() - 1;
  const std::size_t before_last =
      std::accumulate(widths.begin(), widths.end() - 1, indent) + kGap * last;
  const std::size_t last_width =
      std::max(kMinWords, kTextWidth - std::min(kTextWidth, before_last));

  std::string text;
  for (const auto& row : rows) {
    std::string line(indent, ' ');
    for (std::size_t c = 0; c < last; ++c) {
      line += Padded(row[c], widths[c], table.alignment[c] == 'r') + std::string(kGap, ' ');
    }
    if (table.alignment[last] == 'r') {
      text += WithoutTrailingBlanks(line + Padded(row[last], widths[last], true)) + '\n';
      continue;
    }
    for (const std::string& words : WrappedLines(row[last], last_width)) {
      text += WithoutTrailingBlanks(line + words) + '\n';
      line.assign(before_last, ' ');
    }
  }
  return text;
}

std::string Wrapped(std::string_view text, std::size_t indent, std::string_view lead) {
  std::string result;
  std::string start = std::string(indent, ' ') + std::string(lead);
  const std::size_t margin = DisplayWidth(start);
  for (const std::string& line : WrappedLines(text, kTextWidth - margin)) {
    result += start + line + '\n';
    start.assign(margin, ' ');
  }
  return result;
}

}  // namespace truetriad
