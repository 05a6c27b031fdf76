// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// Which of two calibrations has the smaller errors.
enum class Better { kNeither, kA, kB, kMixed };
/// "neither", "a", "b", "mixed".
std::string_view BetterName(Better better);

/// One kind of error of two calibrations on the same poses; `a` and `b` are the RMS of each.
struct ErrorOfTwo {
  /// "accelerometer": length of the reading minus gravity; "accelerometer-spread": that length
  /// minus its mean; "magnetometer" and "magnetometer-spread" likewise with the field; "angle":
  /// angle between field and gravity minus its mean; "gyroscope": rate at rest; "turn": direction
  /// after each turn.
  std::string_view name;
  std::string_view unit;  ///< "mm/s^2", "uT", "deg", "deg/s".
  double a = 0.0, b = 0.0;
  int count = 0;  ///< Poses, or turns.
  /// kNeither unless the errors differ by over 10 % and by more than chance; "accelerometer" must
  /// also differ by more than 2 σ of gravity. "magnetometer" never decides, since fields differ
  /// from place to place.
  Better better = Better::kNeither;

  /// The larger error as a multiple of the smaller.
  double times() const { return a < b ? b / a : a / b; }
};

/// Errors of two calibrations of one unit on the same recording. They are compared with each other,
/// not with predicted errors, since imported calibrations have no σ.
struct SideBySide {
  EvaluationSummary a, b;
  std::vector<ErrorOfTwo> errors;
  /// References of the lengths. An import only assumes them, so that a calibration of this program
  /// takes precedence. If no field is set, each calibration's mean length is used.
  double gravity_mps2 = kStandardGravityMps2;
  std::optional<double> field_ut;
};
Better BetterOf(const SideBySide& both);

/// `is_own`: whether a and b were made from `poses`; poses that either of them left out are left
/// out for both. Errors: as Evaluate.
Result<SideBySide> EvaluateSideBySide(const Calibration& a,
                                      const Calibration& b,
                                      const PoseSet& poses,
                                      const std::array<bool, 2>& is_own = {},
                                      const CountSizes& si_per_count = {});

}  // namespace truetriad
