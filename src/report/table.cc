// SPDX-License-Identifier: Apache-2.0
#include "report/table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/utf8.h"

namespace truetriad {
namespace {

constexpr int kMaxDecimals = 8;  // A number with more decimals is illegible.

std::string Characters(double value, std::chars_format format, int precision) {
  if (std::isnan(value)) return "n/a";
  if (std::isinf(value)) return value > 0 ? "∞" : "-∞";
  // The longest number has 309 digits, a point, 17 decimals and a sign.
  std::array<char, 400> buffer;
  const auto end =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format, precision).ptr;
  std::string text(buffer.data(), end);
  if (text.front() == '-' && text.find_first_of("123456789") == std::string::npos) text.erase(0, 1);
  return text;
}

int DecimalExponent(double value) { return static_cast<int>(std::floor(std::log10(value))); }

}  // namespace

std::string Fixed(double value, int decimals) {
  return Characters(value, std::chars_format::fixed, decimals);
}

std::string Significant(double value, int digits) {
  return Characters(value, std::chars_format::general, digits);
}

std::string WithSigma(double value, double sigma) {
  if (!std::isfinite(value) || std::isnan(sigma) || sigma <= 0.0) return Significant(value, 6);
  if (std::isinf(sigma)) return Significant(value, 3) + " ± ∞";
  int decimals = 1 - DecimalExponent(sigma);
  // σ = 0.0996 rounds to 0.100, which has one digit too many.
  if (std::round(sigma * std::pow(10.0, decimals)) >= 100.0) --decimals;
  if (decimals > kMaxDecimals) {
    const int exponent = DecimalExponent(std::max(std::abs(value), sigma));
    const double unit = std::pow(10.0, exponent);
    const int digits = std::min(decimals + exponent, 15);
    std::string text(1, '(');
    text.append(Fixed(value / unit, digits)).append(" ± ").append(Fixed(sigma / unit, digits));
    return text.append(")e").append(std::to_string(exponent));
  }
  // With σ ≥ 100 the last digits of the value have no meaning and are rounded to zeros.
  const double step = decimals < 0 ? std::pow(10.0, -decimals) : 1.0;
  decimals = std::max(decimals, 0);
  return Fixed(decimals == 0 ? std::round(value / step) * step : value, decimals) + " ± " +
         Fixed(decimals == 0 ? std::round(sigma / step) * step : sigma, decimals);
}

ThreeCells Fixed(const Eigen::Vector3d& values, int decimals) {
  return {Fixed(values[0], decimals), Fixed(values[1], decimals), Fixed(values[2], decimals)};
}

ThreeCells Significant(const Eigen::Vector3d& values, int digits) {
  return {Significant(values[0], digits),
          Significant(values[1], digits),
          Significant(values[2], digits)};
}

ThreeCells WithSigma(const Eigen::Vector3d& values, const Eigen::Vector3d& sigmas) {
  return {WithSigma(values[0], sigmas[0]),
          WithSigma(values[1], sigmas[1]),
          WithSigma(values[2], sigmas[2])};
}

std::string Significant(const std::optional<double>& value, int digits) {
  return value ? Significant(*value, digits) : "–";
}

std::string Joined(const ThreeCells& cells, std::string_view between) {
  return cells[0] + std::string(between) + cells[1] + std::string(between) + cells[2];
}

std::string Percent(double share) { return Significant(100.0 * share, 3) + " %"; }

std::string Probability(double p) { return p < 1e-6 ? "< 1e-6" : Significant(p, 2); }

std::string DisplayUnit(std::string_view unit) {
  std::string text(unit);
  for (const auto& [ascii, sign] : {std::pair<std::string_view, std::string_view>("uT", "µT"),
                                    {"degC", "°C"},
                                    {"tau", "τ"},
                                    {"^1", "¹"},
                                    {"^2", "²"},
                                    {"^3", "³"}}) {
    for (std::size_t at = 0; (at = text.find(ascii, at)) != std::string::npos; at += sign.size()) {
      text.replace(at, ascii.size(), sign);
    }
  }
  return text;
}

namespace {

constexpr std::size_t kGap = 3;        // Blanks between columns.
constexpr std::size_t kMinWords = 24;  // A last column of words is never narrower.

/// A cell as a single line that is safe for a terminal.
std::string Shown(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
  return PrintableLine(text);
}

std::string Padded(const std::string& text, std::size_t width, bool right) {
  const std::string blanks(width - std::min(width, DisplayWidth(text)), ' ');
  return right ? blanks + text : text + blanks;
}

/// Breaks a text into lines of at most `width`. A word that is longer gets its own line.
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
  // Counts code points: the texts of the reports contain no wide or combining characters.
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
