// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "accuracy/shared_recordings.h"
#include "support/finding_matchers.h"

namespace truetriad {
namespace thermal_test {

using ::testing::Contains;
using ::testing::HasSubstr;

class ThermalRecordings : public SharedRecordings {};

const SweepAxis& AxisOf(const Calibration& calibration, Triad triad, int axis) {
  for (const SweepAxis& found : calibration.quality.sweep.axes) {
    if (found.triad == triad && found.axis == axis) return found;
  }
  static const SweepAxis kNone;
  ADD_FAILURE() << "axis " << axis << " is missing";
  return kNone;
}

// Errors of single rows in 14 held-out blocks of time. What a plain cubic leaves is known from an
// independent cross-validation with equal weights (0.0076, 0.0215, 0.055 m/s^2, 0.0012 deg/s); ours
// weighs temperatures alike, which moves it by some per cent.
TEST_F(ThermalRecordings, AChamberSweepIsPredictedFarBetterThanByACubic) {
  const Outcomes run =
      Run("thermal-chamber", Manifest("thermal-chamber"), "poses.sweep.window_samples=1");
  ASSERT_EQ(run.exit_code, 0) << run.text;
  const auto expect = [&](Triad triad, int axis, double cubic, double most) {
    const SweepAxis& found = AxisOf(run.calibration, triad, axis);
    EXPECT_EQ(found.folds, 14);
    EXPECT_NEAR(found.held_out_cubic, cubic, 0.05 * cubic);
    EXPECT_LE(found.held_out, most);
  };
  expect(Triad::kAccelerometer, 0, 0.0076, 0.0043);
  expect(Triad::kAccelerometer, 1, 0.0215, 0.0063);
  expect(Triad::kAccelerometer, 2, 0.055, 0.018);
  expect(Triad::kGyroscope, 1, 0.0012, 0.0009);
  EXPECT_THAT(run.calibration.findings, Contains(HasCode(FindingCode::kReadingsLeftOut)));
}

// Windows by thermal time say the same with a twentieth of the rows.
TEST_F(ThermalRecordings, WindowsByThermalTimeLoseNothing) {
  const Outcomes run = Run("thermal-chamber", Manifest("thermal-chamber"));
  ASSERT_EQ(run.exit_code, 0) << run.text;
  EXPECT_LT(run.calibration.quality.poses, 600);
  EXPECT_LE(AxisOf(run.calibration, Triad::kAccelerometer, 0).held_out, 0.0043);
  EXPECT_LE(AxisOf(run.calibration, Triad::kAccelerometer, 1).held_out, 0.0063);
  EXPECT_LE(AxisOf(run.calibration, Triad::kAccelerometer, 2).held_out, 0.018);
  EXPECT_LE(AxisOf(run.calibration, Triad::kGyroscope, 1).held_out, 0.0009);
}

}  // namespace thermal_test
}  // namespace truetriad
