// SPDX-License-Identifier: Apache-2.0
#include "report/format.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <utility>

namespace truetriad {
namespace {

constexpr int kMaxDecimals = 8;  // More zeros than that nobody counts.

std::string Characters(double value, std::chars_format format, int precision) {
  if (std::isnan(value)) return "n/a";
  if (std::isinf(value)) return value > 0 ? "∞" : "-∞";
  // The longest: 309 digits, a point, 17 decimals and a sign.
  std::array<char, 400> buffer;
  const auto end =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format, precision).ptr;
  std::string text(buffer.data(), end);
  if (text.front() == '-' && text.find_first_of("123456789") == std::string::npos) text.erase(0, 1);
  return text;
}

/// Fixed for everyday numbers by whole arithmetic, at a tenth of the cost; false where the scaled
/// number is so large or so near to a tie that its rounding might decide.
bool AppendQuickly(double value, int decimals, std::string* text) {
  constexpr std::array<std::int64_t, 5> kScales = {1, 10, 100, 1000, 10000};
  // Below 1e8 a double has 1e-8 of a unit: a millionth is far from rounding either way.
  constexpr double kMost = 1e8, kTie = 1e-6;
  if (decimals < 0 || decimals >= static_cast<int>(kScales.size())) return false;
  const std::int64_t scale = kScales[static_cast<std::size_t>(decimals)];
  const double scaled = value * static_cast<double>(scale);
  if (!(std::abs(scaled) < kMost)) return false;
  const double rounded = std::nearbyint(scaled);
  if (std::abs(std::abs(scaled - rounded) - 0.5) < kTie) return false;
  auto whole = static_cast<std::int64_t>(rounded);
  if (whole < 0) *text += '-';
  whole = std::abs(whole);
  std::array<char, 24> digits;
  text->append(digits.data(),
               std::to_chars(digits.data(), digits.data() + digits.size(), whole / scale).ptr);
  if (decimals == 0) return true;
  *text += '.';
  for (std::int64_t place = scale / 10; place > 0; place /= 10) {
    *text += static_cast<char>('0' + whole / place % 10);
  }
  return true;
}

int DecimalExponent(double value) { return static_cast<int>(std::floor(std::log10(value))); }

}  // namespace

std::string Fixed(double value, int decimals) {
  std::string text;
  if (AppendQuickly(value, decimals, &text)) return text;
  return Characters(value, std::chars_format::fixed, decimals);
}

std::string Significant(double value, int digits) {
  return Characters(value, std::chars_format::general, digits);
}

std::string WithSigma(double value, double sigma) {
  if (!std::isfinite(value) || std::isnan(sigma) || sigma <= 0.0) return Significant(value, 6);
  if (std::isinf(sigma)) return Significant(value, 3) + " ± ∞";
  int decimals = 1 - DecimalExponent(sigma);
  // 0.0996 has become 0.100: one digit too many.
  if (std::round(sigma * std::pow(10.0, decimals)) >= 100.0) --decimals;
  if (decimals > kMaxDecimals) {
    const int exponent = DecimalExponent(std::max(std::abs(value), sigma));
    const double unit = std::pow(10.0, exponent);
    const int digits = std::min(decimals + exponent, 15);
    std::string text(1, '(');
    text.append(Fixed(value / unit, digits)).append(" ± ").append(Fixed(sigma / unit, digits));
    return text.append(")e").append(std::to_string(exponent));
  }
  // With σ in the hundreds or more the last digits of the value mean nothing: show zeros.
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

}  // namespace truetriad
