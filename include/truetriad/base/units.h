// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>
#include <optional>
#include <string>
#include <string_view>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"

namespace truetriad {

/// Standard gravity, by which the unit g is defined. CGPM 1901.
inline constexpr double kStandardGravityMps2 = 9.80665;

/// Angles are in rad; files and reports state degrees. A half turn is pi rad or 180 degrees.
inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;
inline constexpr double kDegPerRad = 180.0 / std::numbers::pi;  ///< 1 / kRadPerDeg.

inline constexpr double kAbsoluteZeroDegc = -273.15;  ///< Definition of the degree Celsius.

/// The unit of a triad's raw readings; true values are in m/s^2, rad/s or uT.
struct Unit {
  std::string name;            ///< As in files: "m/s^2", "g", "deg/s", "uT", "mG", "counts", …
  double truth_per_raw = 1.0;  ///< Size of a raw unit in true units; 1 for counts (size unknown).
  bool is_counts = false;      ///< ADC counts (or any arbitrary unit): the scale is not known.
};

/// Parses the name of a unit of `triad`; other spellings (dps, µT, LSB) are accepted. Error (bad
/// input): `name` is unknown; the message lists the units of `triad`.
Result<Unit> ParseTriadUnit(Triad triad, std::string_view name);

/// The true unit of `triad`: "m/s^2", "rad/s" or "uT".
std::string_view TruthUnitName(Triad triad);

/// Number of nanoseconds in the time unit `name` (s, ms, us or ns); nullopt for another name.
std::optional<double> NanosecondsPer(std::string_view name);

/// A unit of temperature, in which degC = scale * raw + offset. ParseTemperatureUnit returns
/// nullopt unless `name` is degC, C, °C or K.
struct TemperatureUnit {
  double scale = 1.0;
  double offset = 0.0;
};
std::optional<TemperatureUnit> ParseTemperatureUnit(std::string_view name);

}  // namespace truetriad
