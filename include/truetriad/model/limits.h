// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"

namespace truetriad {

/// The range allowed for a value, in the unit of its quantity; an infinite side is open.
struct Limit {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  std::optional<double> target;  ///< The intended value; not judged.
  bool if_present = false;       ///< Calibrations without the quantity are not judged by it.

  /// A symmetric range: -most to `most`.
  static Limit Within(double most) { return {-most, most, std::nullopt, false}; }
  bool IsAboutZero() const { return lower == -upper && !target && !if_present; }
};

/// Which components a quantity has.
enum class LimitShape {
  kScalar,   ///< one
  kAxes,     ///< x, y, z
  kEntries,  ///< xy, xz, yx, yz, zx, zy
  kPairs,    ///< xy, xz, yz
};

/// A quantity for which limits can be set.
struct LimitQuantity {
  std::string_view name;  ///< "bias" (of a sensor) or "reference.dip_deg".
  LimitShape shape;
  std::string_view unit;  ///< "{true}": the sensor's true unit.
};

/// The parts of a limit's name: `accelerometer.bias`, `accelerometer.bias.x`, `reference.dip_deg`.
struct LimitName {
  std::optional<Triad> triad;  ///< Unset: a quantity of the reference.
  LimitQuantity quantity;
  std::string component;  ///< "x", "xy"; empty: every component.

  /// Whether the quantity is an RMS or a σ.
  bool IsNeverNegative() const;
  /// Whether the quantity is a slope over temperature.
  bool IsSlope() const;
  /// Whether the quantity depends on the magnetometer's common gain, which is a mere convention if
  /// the field strength is unknown.
  bool GoesWithField() const;
  /// "m/s^2", "rad", "1"; with the sensor's true unit inserted.
  std::string Unit() const;
};
/// Parses a name. Error (usage): the name is unknown; the message lists the known ones.
Result<LimitName> ParseLimitName(const std::string& name);

}  // namespace truetriad
