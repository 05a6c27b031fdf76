// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"

namespace truetriad {

/// What a value may be, in the unit of its quantity; a side that is infinite is open.
struct Limit {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  std::optional<double> target;  ///< What it is meant to be; not judged.
  bool if_present = false;       ///< Not judged where a calibration has no such value.

  /// `most` either way.
  static Limit Within(double most) { return {-most, most, std::nullopt, false}; }
  bool IsAboutZero() const { return lower == -upper && !target && !if_present; }
};

/// Which numbers a quantity has.
enum class LimitShape {
  kScalar,   ///< one
  kAxes,     ///< x, y, z
  kEntries,  ///< xy, xz, yx, yz, zx, zy
  kPairs,    ///< xy, xz, yz
};

/// What limits can be set on.
struct LimitQuantity {
  std::string_view name;  ///< "bias", of a sensor; "reference.dip_deg".
  LimitShape shape;
  std::string_view unit;  ///< "{true}": the sensor's true unit.
};

/// The parts of `accelerometer.bias`, `accelerometer.bias.x`, `reference.dip_deg`.
struct LimitName {
  std::optional<Triad> triad;  ///< Unset: of the reference.
  LimitQuantity quantity;
  std::string component;  ///< "x", "xy"; empty: each.

  /// An RMS or a σ.
  bool IsNeverNegative() const;
  /// A change with temperature.
  bool IsSlope() const;
  /// Of the magnetometer's common gain, which without a known field strength is a convention.
  bool GoesWithField() const;
  /// "m/s^2", "rad", "1"; of the true unit where the quantity has it.
  std::string Unit() const;
};
/// Error (usage): what is known instead.
Result<LimitName> ParseLimitName(const std::string& name);

}  // namespace truetriad
