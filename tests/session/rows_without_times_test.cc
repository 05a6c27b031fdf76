// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/temporary_folder.h"
#include "math/random.h"
#include "truetriad/session/session.h"

namespace truetriad {
namespace rows_without_times_test {

// A spiral over the sphere, 600 rows 8 degrees apart, with errors of 0.1 m/s^2 RMS of which each
// goes on with `stays` of the one before.
std::string Spiral(double stays) {
  Random random(3);
  std::string text = "accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]\n";
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  constexpr int kRows = 600;
  for (int i = 0; i < kRows; ++i) {
    const double z = 1.0 - 2.0 * (i + 0.5) / kRows, across = std::sqrt(1.0 - z * z);
    const double angle = 2.0 * std::numbers::pi * i / 45.0;
    error = stays * error + 0.1 * std::sqrt(1.0 - stays * stays) * random.Normal3();
    const Eigen::Vector3d reading =
        9.80665 * Eigen::Vector3d(across * std::cos(angle), across * std::sin(angle), z) + error;
    text += std::to_string(reading.x()) + "," + std::to_string(reading.y()) + "," +
            std::to_string(reading.z()) + "\n";
  }
  return text;
}

bool IsRefusedAsALog(const std::string& text, const PosesConfig& config = {}) {
  const TemporaryFolder folder;
  const std::string table = folder.Write("table.csv", text);
  const Result<LoadedPoses> loaded = LoadPoses(table, config);
  EXPECT_TRUE(loaded) << loaded.error().message;
  const Result<Calibration> calibration = TryCalibration(table, *loaded, config);
  EXPECT_TRUE(calibration) << calibration.error().message;
  const bool is_refused = Find(calibration->findings, FindingCode::kRowsFollowEachOther) != nullptr;
  EXPECT_NE(calibration->IsUsable(), is_refused);
  return is_refused;
}

// What hands and lever arms add to gravity goes on from row to row; of rests each is off by itself,
// however they are sorted.
TEST(RowsWithoutTimes, OfAUnitThatMovesAreNoRests) {
  EXPECT_TRUE(IsRefusedAsALog(Spiral(0.9)));
  EXPECT_FALSE(IsRefusedAsALog(Spiral(0.0)));
}

// A converter writes `poses: every_row` for whatever has no times.
TEST(RowsWithoutTimes, OfALogAreNoneInAManifestEither) {
  const TemporaryFolder folder;
  std::string text = "accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]\n";
  for (int i = 0; i < 2000; ++i) {
    const double angle = 1e-3 * i;
    text += std::to_string(9.8 * std::cos(angle)) + "," + std::to_string(9.8 * std::sin(angle)) +
            ",0.1\n";
  }
  folder.Write("log.csv", text);
  const std::string manifest = folder.Write("recording.yaml", R"(recording: 1
streams:
  accelerometer: {file: log.csv, x: "accel_x[m/s^2]", y: "accel_y[m/s^2]", z: "accel_z[m/s^2]", unit: "m/s^2"}
poses: every_row
)");
  const Result<LoadedPoses> loaded = LoadPoses(manifest, {});
  ASSERT_FALSE(loaded);
  EXPECT_THAT(loaded.error().message, ::testing::HasSubstr("the attitude of the row before"));
  PosesConfig config;
  config.given = true;
  config.kind = PoseSelectionKind::kEveryRow;
  EXPECT_TRUE(LoadPoses(manifest, config));
}

TEST(RowsWithoutTimes, AreRestsWhereSomebodySaysSo) {
  PosesConfig config;
  config.given = true;
  config.kind = PoseSelectionKind::kEveryRow;
  EXPECT_FALSE(IsRefusedAsALog(Spiral(0.9), config));
}

}  // namespace rows_without_times_test
}  // namespace truetriad
