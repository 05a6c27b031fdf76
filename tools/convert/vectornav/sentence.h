// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "truetriad/base/triad.h"

namespace truetriad::convert {

/// A kind of VectorNav ASCII sentence that holds readings: magnetometer in gauss, accelerometer in
/// m/s^2, gyroscope in rad/s, all axes of the unit. VN-100, VN-200 and VN-300 user manuals.
struct SentenceKind {
  std::string_view name;      ///< "VNYMR".
  std::size_t fields = 0;     ///< Numbers behind the name.
  std::size_t first = 0;      ///< Of them, the first that is a reading.
  std::vector<Triad> triads;  ///< Three numbers each, in this order.
  bool compensated = false;   ///< By the user's registers 23, 25 and 84, and what was learned.
  std::optional<std::size_t> temperature;  ///< The field in degC.
};

const std::vector<SentenceKind>& SentenceKinds();
/// Null where `name` is no kind with readings.
const SentenceKind* FindSentenceKind(std::string_view name);

/// What a sentence says of its own bytes.
enum class Checksum {
  kNone,   ///< Nothing: it ends without `*`, or with `*XX`.
  kWrong,  ///< What stands behind `*` is not that of the sentence.
  kRight,
};

/// What stands between `$` and the next `$` or end of line.
struct Sentence {
  std::string_view name;  ///< Up to the first comma; empty: none.
  std::string_view body;  ///< Behind that comma, up to `*`.
  Checksum checksum = Checksum::kNone;
};

/// Splits a sentence and checks it: two digits are the XOR of what is between `$` and `*`, four its
/// CRC-16 (x^16 + x^12 + x^5 + 1, from 0).
Sentence ParseSentence(std::string_view text);

/// The numbers of `body`; empty unless there are `count`, and all of them are numbers. Behind them
/// may stand what register 30 appends: the status, `S` and four hexadecimal digits, and a counter
/// or time, `T` and digits.
std::vector<double> NumbersOf(std::string_view body, std::size_t count);

/// True where `body` ends with a status or counter of register 30.
bool HasAppended(std::string_view body);

}  // namespace truetriad::convert
