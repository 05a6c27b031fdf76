// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "verdict/result.h"

namespace truetriad {
namespace conclude_test {

Outcome ConcludedWith(Treatment treatment) {
  Calibration calibration;
  calibration.findings = {Finding(FindingCode::kClockOffset, "late").Shifting(11.0, treatment)};
  EXPECT_TRUE(Conclude(CalibrateOptions(), PoseSet(), &calibration));
  return calibration.outcome;
}

// Whatever its code says: numbers that are off by more than their σ are not presented as good.
TEST(Conclusion, RefusesWhatNobodyDealtWith) {
  EXPECT_EQ(ConcludedWith(Treatment::kNone), Outcome::kNotConverged);
  EXPECT_EQ(ConcludedWith(Treatment::kWidened), Outcome::kConverged);
  EXPECT_EQ(ConcludedWith(Treatment::kCorrected), Outcome::kConverged);
}

}  // namespace conclude_test
}  // namespace truetriad
