// SPDX-License-Identifier: Apache-2.0
#include "truetriad/data/pose_collection.h"

#include <fstream>
#include <random>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/memory_source.h"

namespace truetriad {
namespace {

// Reads rows of numbers; separators are blanks or commas.
std::vector<std::vector<double>> ReadNumbers(const std::string& name, int skip_lines) {
  std::ifstream file(std::string(TRUETRIAD_SHARED_DATASETS) + "/" + name);
  std::vector<std::vector<double>> rows;
  std::string line;
  for (int number = 0; std::getline(file, line); ++number) {
    if (number < skip_lines) continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    rows.emplace_back();
    for (double value = 0.0; fields >> value;) rows.back().push_back(value);
  }
  return rows;
}

struct Columns {
  Triad triad;
  std::size_t first;
};

// The recording at 100 Hz; empty when the file is not there.
std::vector<MemoryStream> ReadRecording(const std::string& name,
                                        int skip_lines,
                                        const std::vector<Columns>& columns) {
  std::vector<MemoryStream> streams;
  const std::vector<std::vector<double>> rows = ReadNumbers(name, skip_lines);
  if (rows.empty()) return streams;
  for (const Columns& column : columns) {
    MemoryStream& stream = streams.emplace_back(column.triad);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double* values = rows[i].data() + column.first;
      stream.Add(static_cast<std::int64_t>(i) * 10'000'000, {values[0], values[1], values[2]});
    }
  }
  return streams;
}

struct RealRecording {
  std::string name;
  int skip_lines;
  std::vector<Columns> columns;
  std::size_t rests;
};

class RealRecordings : public testing::TestWithParam<RealRecording> {};

TEST_P(RealRecordings, HaveTheirKnownNumberOfRests) {
  const RealRecording& known = GetParam();
  std::vector<MemoryStream> streams = ReadRecording(known.name, known.skip_lines, known.columns);
  if (streams.empty()) GTEST_SKIP() << known.name << " is not in " TRUETRIAD_SHARED_DATASETS;
  MemorySource source(std::move(streams));
  const Result<PoseSet> set = CollectPoses(source, {});
  if (known.rests == 0) {
    ASSERT_FALSE(set);
    EXPECT_EQ(set.error().code, ErrorCode::kNotEnough);
    return;
  }
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->poses.size(), known.rests);
}

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kGyro = Triad::kGyroscope;

INSTANTIATE_TEST_SUITE_P(
    Shared,
    RealRecordings,
    testing::Values(
        RealRecording{"a-xsens-imu-tk-38pose/xsens_acc.mat", 0, {{kAccel, 1}}, 38},
        RealRecording{"a-mpu9150-22pose/imu0.log", 0, {{kAccel, 0}, {kGyro, 3}}, 22},
        RealRecording{"a-mpu9150-22pose/imu1.log", 0, {{kAccel, 0}, {kGyro, 3}}, 22},
        RealRecording{"a-mpu9150-22pose/imu2.log", 0, {{kAccel, 0}, {kGyro, 3}}, 22},
        RealRecording{"a-mpu9150-22pose/imu0.log", 0, {{kAccel, 0}}, 22},
        RealRecording{"a-mpu6050-10pose-minimal/example_data_calibration.csv",
                      5,
                      {{kAccel, 0}, {kGyro, 3}},
                      10},
        RealRecording{
            "a-mpu6050-10pose-minimal/example_data_calibration.csv", 5, {{kAccel, 0}}, 10},
        RealRecording{"a-mpu6050-10pose-minimal/example_data_tinit_calc.csv",
                      5,
                      {{kAccel, 0}, {kGyro, 3}},
                      1},
        RealRecording{"a-mpu6050-10pose-minimal/imu_90_x_rot.csv", 5, {{kAccel, 0}, {kGyro, 3}}, 2},
        RealRecording{"d-adis16405-static-2p8h/adis_16405_imu4_counts_first10min.csv",
                      1,
                      {{kAccel, 3}, {kGyro, 0}},
                      1},
        RealRecording{"a-ck-160pose-and-accmag-tumble/acc_mag_log.csv", 1, {{kAccel, 0}}, 0},
        RealRecording{"b-mag-poor-coverage/data_acc.txt", 1, {{kAccel, 0}}, 0}));

}  // namespace
}  // namespace truetriad
