// SPDX-License-Identifier: Apache-2.0
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "formats/sample_units.h"
#include "truetriad/formats/export.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace imu_tk_test {

using formats_test::RandomUnitCalibration;
using formats_test::WorstDisagreement;

// A dozen operations in double on numbers of the signal's size.
constexpr double kDouble = 1e-12;

/// x = T K (y - B), read as imu_tk's own `load` does: 21 numbers from a stream.
struct Triads {
  Eigen::Matrix3d T, K;
  Eigen::Vector3d B;

  explicit Triads(const std::string& text) {
    std::istringstream file(text);
    for (Eigen::Matrix3d* const matrix : {&T, &K}) {
      for (int i = 0; i < 9; ++i) file >> (*matrix)(i / 3, i % 3);
    }
    for (int i = 0; i < 3; ++i) file >> B[i];
    EXPECT_TRUE(file.good());
  }
};

TEST(ImuTk, AppliesTheCalibrationExactlyInItsOwnFrame) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const bool counts : {false, true}) {
      const Calibration unit = RandomUnitCalibration({.counts = counts}, seed);
      const Result<Export> result = ExportCalibration(unit, "imu_tk");
      ASSERT_TRUE(result) << result.error().message;
      ASSERT_EQ(result->files.size(), 2U);
      EXPECT_EQ(result->files[0].suffix, "_acc.calib");
      EXPECT_EQ(result->files[1].suffix, "_gyro.calib");
      const Eigen::Matrix3d frame =
          GaugeRotation(Gauge::kAccelZ, unit.sensors[Triad::kAccelerometer]->model.sensitivity);
      for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
        const Triads file(result->files[triad == Triad::kAccelerometer ? 0 : 1].text);
        EXPECT_TRUE(file.T.diagonal().isOnes(0.0));
        EXPECT_TRUE(file.K.isDiagonal(0.0));
        EXPECT_TRUE(triad == Triad::kGyroscope || file.T.isUpperTriangular(0.0)) << file.T;
        const auto equation =
            [&file](const Eigen::Vector3d& raw, const Eigen::Vector3d&, double) -> Eigen::Vector3d {
          return file.T * file.K * (raw - file.B);
        };
        EXPECT_LT(WorstDisagreement(unit, triad, equation, frame), kDouble) << seed;
      }
    }
  }
}

}  // namespace imu_tk_test
}  // namespace truetriad
