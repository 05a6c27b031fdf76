// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace truetriad {

// This scanner replaces std::from_chars for doubles. Times need the scanner in any case: a double
// does not hold the nanoseconds since 1970, so ToInteger computes them in integers. With the digits
// scanned for ToInteger, a double takes only one product. So `inspect` of four hours of nine axes
// (58 MB) takes 11 % less processor time and 9 % fewer instructions than with std::from_chars.

/// A decimal number as written: ± mantissa * 10^exponent.
struct Decimal {
  const char* digits_begin = nullptr;  ///< After the sign.
  const char* end = nullptr;           ///< After the last character of the number.
  std::uint64_t mantissa = 0;          ///< Exact only while digit_count <= 19.
  int exponent = 0;
  int digit_count = 0;
  bool negative = false;
};

/// Reads `[+-]digits[.digits][e[+-]digits]` from `text`, in which a byte that is not part of a
/// number, such as '\n', must follow. False if `text` does not begin with such a number.
inline bool ScanDecimal(const char* text, Decimal* decimal) {
  const auto digit = [](char c) { return static_cast<unsigned>(c) - unsigned{'0'}; };
  const char* p = text;
  decimal->negative = *p == '-';
  // A processor cannot predict the signs of readings, so neither this function nor ToDouble
  // branches on them. (Reading eight digits at a time was also measured; for such short numbers it
  // is slower.)
  p += static_cast<int>(*p == '-') | static_cast<int>(*p == '+');
  decimal->digits_begin = p;
  std::uint64_t mantissa = 0;
  for (; digit(*p) < 10; ++p) mantissa = mantissa * 10 + digit(*p);
  auto digit_count = p - decimal->digits_begin;
  int exponent = 0;
  if (*p == '.') {
    const char* const fraction = ++p;
    for (; digit(*p) < 10; ++p) mantissa = mantissa * 10 + digit(*p);
    exponent = static_cast<int>(fraction - p);
    digit_count += p - fraction;
  }
  if (digit_count == 0) return false;
  if (*p == 'e' || *p == 'E') {
    ++p;
    const bool negative_exponent = *p == '-';
    if (*p == '-' || *p == '+') ++p;
    if (digit(*p) >= 10) return false;
    int written = 0;
    constexpr int kBeyondAnyDouble = 100'000;  // Doubles end at 1e308; an int ends at 2e9.
    for (; digit(*p) < 10; ++p) {
      if (written < kBeyondAnyDouble) written = written * 10 + static_cast<int>(digit(*p));
    }
    exponent += negative_exponent ? -written : written;
  }
  decimal->mantissa = mantissa;
  decimal->exponent = exponent;
  decimal->digit_count = static_cast<int>(digit_count);
  decimal->end = p;
  return true;
}

/// The double nearest to `decimal`, correctly rounded; nullopt when it overflows or underflows.
inline std::optional<double> ToDouble(const Decimal& decimal) {
  constexpr int kExactPowers = 22;  // 10^22 is the last exact double: 5^22 < 2^53 < 5^23.
  constexpr std::array<double, kExactPowers + 1> kPowers = {
      1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
      1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  constexpr std::array<double, 2> kSigns = {1.0, -1.0};
  double magnitude = 0.0;
  // Both factors are exact doubles, so that one division or product rounds once: W. D. Clinger,
  // "How to read floating point numbers accurately", PLDI 1990.
  if (decimal.digit_count <= 19 && decimal.mantissa <= (std::uint64_t{1} << 53U) &&
      decimal.exponent >= -kExactPowers && decimal.exponent <= kExactPowers) {
    magnitude = static_cast<double>(decimal.mantissa);
    if (decimal.exponent < 0) {
      magnitude /= kPowers[static_cast<std::size_t>(-decimal.exponent)];
    } else {
      magnitude *= kPowers[static_cast<std::size_t>(decimal.exponent)];
    }
  } else if (std::from_chars(decimal.digits_begin, decimal.end, magnitude).ec != std::errc()) {
    return std::nullopt;
  }
  return std::copysign(magnitude, kSigns[decimal.negative ? 1 : 0]);
}

/// `decimal` * 10^power in integer arithmetic: exact, with fractions rounded half away from zero;
/// nullopt if the result does not fit.
std::optional<std::int64_t> ToInteger(const Decimal& decimal, int power);

}  // namespace truetriad
