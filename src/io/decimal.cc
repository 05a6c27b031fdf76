// SPDX-License-Identifier: Apache-2.0
#include "io/decimal.h"

namespace truetriad {
namespace {

constexpr int kUint64Digits = 19;  ///< Every number of 19 digits fits a uint64.

constexpr std::array<std::uint64_t, kUint64Digits + 1> kPowers = [] {
  std::array<std::uint64_t, kUint64Digits + 1> powers{};
  std::uint64_t power = 1;
  for (std::uint64_t& entry : powers) {
    entry = power;
    power *= 10;
  }
  return powers;
}();

/// Reads the digits again and keeps the first 19 significant ones; a time needs no more.
Decimal Shortened(const Decimal& decimal) {
  Decimal kept = decimal;
  kept.mantissa = 0;
  kept.digit_count = 0;
  for (const char* p = decimal.digits_begin; p != decimal.end && *p != 'e' && *p != 'E'; ++p) {
    if (*p == '.') continue;
    if (kept.digit_count == kUint64Digits) {
      ++kept.exponent;
    } else if (kept.digit_count > 0 || *p != '0') {
      kept.mantissa = kept.mantissa * 10 + static_cast<std::uint64_t>(*p - '0');
      ++kept.digit_count;
    }
  }
  return kept;
}

}  // namespace

std::optional<std::int64_t> ToInteger(const Decimal& decimal, int power) {
  const Decimal exact = decimal.digit_count <= kUint64Digits ? decimal : Shortened(decimal);
  if (exact.mantissa == 0) return 0;
  const int shift = exact.exponent + power;
  std::uint64_t magnitude = 0;
  if (shift > kUint64Digits) return std::nullopt;
  if (shift >= 0) {
    if (__builtin_mul_overflow(
            exact.mantissa, kPowers[static_cast<std::size_t>(shift)], &magnitude)) {
      return std::nullopt;
    }
  } else if (shift >= -kUint64Digits) {
    const std::uint64_t divisor = kPowers[static_cast<std::size_t>(-shift)];
    const std::uint64_t remainder = exact.mantissa % divisor;
    magnitude = exact.mantissa / divisor + (remainder >= divisor - remainder ? 1 : 0);
  }
  if (magnitude > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
    return std::nullopt;
  }
  const auto value = static_cast<std::int64_t>(magnitude);
  return exact.negative ? -value : value;
}

}  // namespace truetriad
