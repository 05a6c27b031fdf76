// SPDX-License-Identifier: Apache-2.0
#include "truetriad/data/pose_collection.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/memory_source.h"
#include "data/synthetic_recording.h"
#include "support/finding_matchers.h"

namespace truetriad {
namespace pose_collection_test {

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

// What test listings show; the bytes of the struct would change from run to run.
void PrintTo(const RealRecording& recording, std::ostream* out) {
  *out << recording.name << ", " << recording.columns.size() << " triads";
}

class RealRecordings : public testing::TestWithParam<RealRecording> {};

TEST_P(RealRecordings, HaveTheirKnownNumberOfRests) {
  const RealRecording& known = GetParam();
  std::vector<MemoryStream> streams = ReadRecording(known.name, known.skip_lines, known.columns);
  if (streams.empty()) GTEST_SKIP() << known.name << " is not in " TRUETRIAD_SHARED_DATASETS;
  MemorySource source(std::move(streams));
  const Result<PoseSet> set = CollectPoses(source, {});
  if (known.rests == 0) {
    ASSERT_FALSE(set);
    EXPECT_EQ(set.error().kind(), ErrorKind::kNotEnough);
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

// The reference intervals come from a rolling deviation of 1 s, with a threshold set by hand.
TEST(RealRecording, OfXsensRestsWhereTheReferenceSays) {
  const std::string folder = "a-xsens-imu-tk-38pose/";
  std::vector<MemoryStream> streams = ReadRecording(folder + "xsens_acc.mat", 0, {{kAccel, 1}});
  if (streams.empty()) GTEST_SKIP() << folder << " is not in " TRUETRIAD_SHARED_DATASETS;
  MemorySource source(std::move(streams));
  const Result<PoseSet> set = CollectPoses(source, {});
  ASSERT_TRUE(set) << set.error().message;

  std::ifstream file(TRUETRIAD_SHARED_DATASETS "/" + folder + "reference.json");
  std::stringstream text;
  text << file.rdbuf();
  std::string list = text.str().substr(text.str().find("static_intervals_first_last_sample"));
  list = list.substr(list.find('['), list.find('"', list.find('[')) - list.find('['));
  std::replace_if(
      list.begin(), list.end(), [](char c) { return std::isdigit(c) == 0; }, ' ');
  std::istringstream numbers(list);
  std::size_t i = 0;
  for (std::int64_t first = 0, last = 0; numbers >> first >> last && last > first; ++i) {
    ASSERT_LT(i, set->poses.size());
    const StaticPose& pose = set->poses[i];
    const std::int64_t common = std::min(pose.last_row, last) - std::max(pose.first_row, first);
    // Ours cut less at the ends by design, and more where the unit settles.
    EXPECT_GT(static_cast<double>(common), 0.7 * static_cast<double>(last - first))
        << "pose " << pose.number << ", rows " << pose.first_row << " to " << pose.last_row;
  }
  EXPECT_EQ(i, set->poses.size());
}

Result<PoseSet> Collect(std::vector<MemoryStream> streams,
                        const PoseSelection& selection = {},
                        const StaticDetectorOptions& options = {}) {
  MemorySource source(std::move(streams));
  return CollectPoses(source, selection, options);
}

constexpr double kDegree = std::numbers::pi / 180.0;

// Sensors with a large offset, a tiny scale and coarse steps are found as well as any.
TEST(StaticDetection, FindsRestsInSiUnitsAndInRawCountsAlike) {
  for (const double counts : {1.0, 417.0, 1e-7}) {
    SyntheticRecording recording;
    recording.counts_per_mps2 = counts;
    if (counts > 1.0) recording.offset_raw.setConstant(33000.0), recording.step_raw = 1.0;
    std::vector<Eigen::Vector3d> truth;
    for (int i = 0; i < 12; ++i) {
      recording.Rest(4.0);
      truth.push_back(recording.RawOf(recording.gravity));
      recording.Handle();
    }
    for (const bool with_gyro : {false, true}) {
      std::vector<MemoryStream> streams = {recording.accel};
      if (with_gyro) streams.push_back(recording.gyro);
      const Result<PoseSet> set = Collect(streams);
      ASSERT_TRUE(set) << set.error().message;
      ASSERT_EQ(set->poses.size(), truth.size()) << counts << " counts per m/s^2";
      for (std::size_t i = 0; i < truth.size(); ++i) {
        const TriadPose& pose = *set->poses[i].triads[kAccel];
        // At least 3.2 s of 4 s are used; 5 sigma of a mean of 320 samples of 0.02 m/s^2.
        EXPECT_GE(pose.samples, 320);
        EXPECT_LT((pose.mean_raw - truth[i]).cwiseAbs().maxCoeff(), 5.0 * 0.02 / 17.9 * counts);
      }
    }
  }
}

TEST(StaticDetection, IsNotFooledByAQuietStartBeforeHandHeldRests) {
  SyntheticRecording recording;
  recording.Rest(40.0, 0.1);
  for (int i = 0; i < 9; ++i) recording.Handle(), recording.Rest(3.0, 2.0);
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->poses.size(), 10u);
}

TEST(StaticDetection, JoinsARestThatAKnockInterrupts) {
  SyntheticRecording recording;
  for (int i = 0; i < 6; ++i) {
    recording.Rest(3.0);
    if (i == 2) recording.Knock(0.3), recording.Rest(3.0);
    recording.Handle();
  }
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->poses.size(), 6u);
  const StaticPose& knocked = set->poses[2];
  EXPECT_GT(knocked.duration_s(), 5.5);
  // The knock of 0.3 s is left out of the statistics.
  EXPECT_LT(knocked.triads[kAccel]->samples, knocked.last_row - knocked.first_row + 1 - 30);
  EXPECT_LT(knocked.triads[kAccel]->sample_covariance_raw(0, 0), 2.0 * 0.02 * 0.02);
}

// What the accelerometer cannot tell from a knock.
TEST(StaticDetection, KeepsRestsApartThatDifferByATurnAboutTheVertical) {
  for (const bool by_machine : {false, true}) {
    SyntheticRecording recording;
    for (int i = 0; i < 12; ++i) {
      recording.Rest(3.0);
      if (i % 3 == 2) {
        recording.Handle();
      } else if (by_machine) {
        recording.Slew(90.0 * kDegree, 1.2);
      } else {
        recording.Turn(recording.gravity, 90.0 * kDegree, 1.0);
      }
    }
    std::vector<std::vector<MemoryStream>> recordings = {
        {recording.accel, recording.gyro}, {recording.accel, recording.gyro, recording.magnet}};
    // A machine's turn is a rest to an accelerometer by itself.
    if (!by_machine) recordings.push_back({recording.accel, recording.magnet});
    for (const std::vector<MemoryStream>& streams : recordings) {
      const Result<PoseSet> set = Collect(streams);
      ASSERT_TRUE(set) << set.error().message;
      EXPECT_EQ(set->poses.size(), 12u) << streams.size() << (by_machine ? " by machine" : "");
    }
  }
}

TEST(StaticDetection, KeepsTwoRestsInOneAttitudeApartWhenTheUnitWasHandledInBetween) {
  SyntheticRecording recording;
  for (int i = 0; i < 6; ++i) recording.Rest(3.0), recording.Handle();
  recording.Rest(3.0);
  recording.Turn({1, 0, 0}, 1.0, 0.6), recording.Turn({1, 0, 0}, -1.0, 0.6);
  recording.Rest(3.0);
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->poses.size(), 8u);
}

TEST(StaticDetection, TakesSlowDriftForRestButNotSlowRotation) {
  SyntheticRecording recording;
  recording.drift_mps3 = {1e-3, 0, -5e-4};  // 0.1 mg/s: a unit that warms up.
  for (int i = 0; i < 5; ++i) recording.Rest(10.0), recording.Handle();
  const std::int64_t from_ns = recording.now_ns();
  recording.Turn({1, 1, 0}, 20.0 * kDegree, 10.0);  // Up to 3 deg/s.
  const std::int64_t to_ns = recording.now_ns();
  recording.Handle(), recording.Rest(10.0);
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->poses.size(), 6u);
  for (const StaticPose& pose : set->poses) {
    EXPECT_FALSE(pose.start_ns > from_ns && pose.end_ns < to_ns) << "pose " << pose.number;
  }
}

// Means of spans move then by more than a rest may: by as much as their noise makes them.
TEST(StaticDetection, TakesNoiseAndSpikesForNoMotion) {
  for (const bool has_spikes : {false, true}) {
    SyntheticRecording recording;
    for (int i = 0; i < 12; ++i) recording.Rest(4.0, has_spikes ? 1.0 : 15.0), recording.Handle();
    if (has_spikes) {
      for (std::size_t i = 20; i < recording.accel.x.size(); i += 97) recording.accel.x[i] += 15.0;
    }
    const Result<PoseSet> set = Collect({recording.accel});
    ASSERT_TRUE(set) << set.error().message;
    EXPECT_EQ(set->poses.size(), 12u);
  }
}

TEST(StaticDetection, CutsSettlingTime) {
  SyntheticRecording recording;
  for (int i = 0; i < 6; ++i) {
    recording.Settle(0.02, 0.3);
    recording.Rest(5.0);
    recording.Handle();
  }
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->poses.size(), 6u);
  // The mean of half a second of the creep, 0.02 rad * 9.81 m/s^2 * exp(-t / 0.3 s), falls below
  // 4 sigma of the noise's mean, 0.011 m/s^2, after 0.64 s, and below 1.5 times that after 0.52 s.
  std::int64_t start_ns = 0;
  for (const StaticPose& pose : set->poses) {
    EXPECT_GT(pose.start_ns - start_ns, 500'000'000) << "pose " << pose.number;
    start_ns += static_cast<std::int64_t>((8.0 * 0.3 + 5.0 + 1.5) * 1e9);
  }
}

TEST(StaticDetection, FindsNoRestInATumble) {
  SyntheticRecording recording;
  for (int i = 0; i < 60; ++i) recording.Turn(recording.Normal(), 2.0, 2.0);
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().kind(), ErrorKind::kNotEnough);
  EXPECT_THAT(set.error().message, testing::HasSubstr("no rest found"));
}

// Times as far apart as a recording may have them: windows end before times do.
TEST(StaticDetection, PlacesRestsOfRowsThatAreMonthsOrYearsApartWithinThem) {
  constexpr std::int64_t kFarthestNs = 4'600'000'000'000'000'000;
  for (const std::int64_t spacing_ns : {kFarthestNs / 500, kFarthestNs / 3, kFarthestNs}) {
    MemoryStream accel(Triad::kAccelerometer);
    for (std::int64_t at_ns = -kFarthestNs; at_ns <= kFarthestNs; at_ns += spacing_ns)
      accel.Add(at_ns, {0.0, 0.0, 100.0 + static_cast<double>(accel.x.size() % 2)});
    const std::int64_t last_ns = accel.time_ns.back();
    const Result<PoseSet> set = Collect({std::move(accel)});
    if (!set) {
      EXPECT_THAT(set.error().message, testing::HasSubstr("no rest found")) << spacing_ns;
      continue;
    }
    for (const StaticPose& pose : set->poses) {
      EXPECT_GE(pose.start_ns, -kFarthestNs) << spacing_ns;
      EXPECT_LE(pose.start_ns, pose.end_ns) << spacing_ns;
      EXPECT_LE(pose.end_ns, last_ns) << spacing_ns;
    }
  }
}

TEST(StaticDetection, TakesARecordingWithoutMotionForOneRest) {
  SyntheticRecording recording;
  recording.Rest(60.0);
  const Result<PoseSet> set = Collect({recording.accel, recording.gyro});
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->poses.size(), 1u);
  EXPECT_GT(set->static_share, 0.95);
}

TEST(StaticDetection, NeedsNoNoise) {
  SyntheticRecording recording;
  recording.noise_mps2 = 0.0, recording.gyro_noise_radps = 0.0;
  for (int i = 0; i < 8; ++i) recording.Rest(3.0), recording.Handle();
  const Result<PoseSet> set = Collect({recording.accel, recording.gyro});
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->poses.size(), 8u);
  EXPECT_THAT(set->findings, testing::IsEmpty());
}

TEST(StaticDetection, JoinsStreamsOfDifferentRates) {
  SyntheticRecording recording;
  MemoryStream mag(Triad::kMagnetometer);
  mag.info.file = "mag.csv";
  for (int i = 0; i < 8; ++i) recording.Rest(4.0), recording.Handle();
  for (std::int64_t t = 3'000'000; t < recording.now_ns(); t += 130'000'000) {
    mag.Add(t, 0.1 * recording.Normal());
  }
  const Result<PoseSet> set = Collect({recording.accel, recording.gyro, mag});
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->poses.size(), 8u);
  EXPECT_NEAR(set->Find(Triad::kMagnetometer)->rate_hz, 1.0 / 0.13, 1e-9);
  for (const StaticPose& pose : set->poses) {
    ASSERT_TRUE(pose.triads[Triad::kMagnetometer]);
    EXPECT_GE(pose.triads[Triad::kMagnetometer]->samples, 20);
    EXPECT_TRUE(pose.triads[Triad::kMagnetometer]->has_covariance);
  }
}

TEST(StaticDetection, RefusesARecordingWithoutTimeAndSaysHowToStateARate) {
  SyntheticRecording recording;
  recording.Rest(10.0);
  MemorySource source({recording.accel});
  source.mutable_info().has_time = false;
  const Result<PoseSet> set = CollectPoses(source, {});
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(set.error().message, testing::HasSubstr("rate_hz: 100"));
}

TEST(DataChecks, CallAConstantStreamStuck) {
  SyntheticRecording recording;
  recording.noise_mps2 = 0.0;
  recording.Rest(10.0);
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(set.error().message, testing::HasSubstr("the sensor is stuck"));
}

TEST(DataChecks, LeaveOutAStuckSensorAndNameThePose) {
  SyntheticRecording recording;
  for (int i = 0; i < 8; ++i) {
    if (i == 4) recording.noise_mps2 = 0.0;
    recording.Rest(4.0);
    recording.noise_mps2 = 0.02;
    recording.Handle();
  }
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->poses.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(set->poses[i].triads[kAccel].has_value(), i != 4) << i;
  }
  ASSERT_EQ(set->findings.size(), 1u);
  EXPECT_THAT(set->findings[0], HasCode(FindingCode::kStuckReadings));
  EXPECT_THAT(set->findings[0], Says(testing::HasSubstr("in pose 5")));
}

TEST(DataChecks, DoNotCallAQuietCoarseSensorStuck) {
  SyntheticRecording recording;
  recording.noise_mps2 = 0.01, recording.step_raw = 0.05;
  for (int i = 0; i < 10; ++i) recording.Rest(4.0), recording.Handle();
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->poses.size(), 10u);
  EXPECT_THAT(set->findings, testing::IsEmpty());
}

TEST(DataChecks, LeaveOutPosesAtTheLimitOfTheRange) {
  SyntheticRecording recording;
  recording.counts_per_mps2 = 1000.0, recording.step_raw = 1.0;
  recording.Rest(3.0);  // z reads 9810 counts.
  for (int i = 0; i < 9; ++i) recording.Handle(), recording.Rest(3.0);
  for (double& z : recording.accel.z) z = std::min(z, 9790.0);  // One sigma below the first rest.
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_TRUE(set) << set.error().message;
  // The pose keeps its number, and what other sensors read in it.
  ASSERT_EQ(set->poses.size(), 10u);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(set->poses[i].triads[Triad::kAccelerometer].has_value(), i > 0) << i;
  }
  ASSERT_EQ(set->findings.size(), 1u);
  EXPECT_THAT(set->findings[0], HasCode(FindingCode::kClippedPoses));
  EXPECT_THAT(set->findings[0],
              Says(testing::AllOf(testing::HasSubstr("accelerometer z axis"),
                                  testing::HasSubstr("9790 counts in pose 1"))));
}

// Half of the rests, in which one axis repeats itself while the others do not.
TEST(DataChecks, LeaveOutReadingsWithAStuckAxis) {
  SyntheticRecording recording;
  recording.counts_per_mps2 = 1000.0, recording.step_raw = 1.0;
  for (int i = 0; i < 10; ++i) recording.Rest(3.0), recording.Handle();
  std::vector<double>& x = recording.accel.x;
  const std::size_t from = x.size() / 2;
  std::fill(x.begin() + static_cast<std::ptrdiff_t>(from), x.end(), x[from]);
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->poses.size(), 10u);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(set->poses[i].triads[Triad::kAccelerometer].has_value(), i < 5) << i;
  }
  ASSERT_EQ(set->findings.size(), 1u);
  EXPECT_THAT(set->findings[0], HasCode(FindingCode::kStuckReadings));
  EXPECT_THAT(set->findings[0], Says(testing::HasSubstr("accelerometer x axis stuck at")));
}

TEST(DataChecks, RefuseARecordingThatIsClippedInMostPoses) {
  SyntheticRecording recording;
  for (int i = 0; i < 6; ++i) {
    recording.Rest(3.0), recording.Turn({0, 0, 1}, 3.0, 1.5), recording.Turn({1, 0, 0}, 6.283, 1.5);
  }
  recording.Turn({1, 0, 0}, 2.0, 1.5), recording.Rest(3.0);
  for (double& z : recording.accel.z) z = std::min(z, 9.7);
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(set.error().message, testing::HasSubstr("6 of 7 poses are clipped"));
}

TEST(DataChecks, CountGapsAndEqualTimes) {
  SyntheticRecording recording;
  for (int i = 0; i < 5; ++i) recording.Rest(3.0), recording.Handle();
  for (std::size_t i = 1000; i < recording.accel.time_ns.size(); ++i) {
    recording.accel.time_ns[i] += 2'000'000'000;
  }
  recording.accel.time_ns[50] = recording.accel.time_ns[49];
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->streams[0].gaps, 1);
  EXPECT_NEAR(set->streams[0].longest_gap_s, 2.01, 1e-9);
  EXPECT_EQ(set->streams[0].duplicate_times, 1);
  ASSERT_EQ(set->findings.size(), 2u);
  EXPECT_THAT(set->findings[0], HasCode(FindingCode::kTimeGaps));
  EXPECT_THAT(set->findings[1], HasCode(FindingCode::kEqualTimes));
}

TEST(DataChecks, RefuseTimeThatGoesBackAndSayWhere) {
  SyntheticRecording recording;
  recording.Rest(5.0);
  recording.accel.time_ns[200] = 0;
  const Result<PoseSet> set = Collect({recording.accel});
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(set.error().message, testing::HasSubstr("memory.csv"));
  EXPECT_THAT(set.error().message, testing::HasSubstr("data row 200"));
}

MemoryStream Counting(std::size_t rows) {
  MemoryStream stream(kAccel);
  for (std::size_t i = 0; i < rows; ++i) {
    const auto value = static_cast<double>(i);
    stream.Add(static_cast<std::int64_t>(i) * 10'000'000, {value, -value, 0.5 * value});
  }
  return stream;
}

TEST(GivenPoses, MakeAPoseOfEveryRow) {
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kEveryRow;
  MemoryStream mag = Counting(12000);
  mag.info.triad = Triad::kMagnetometer;
  const Result<PoseSet> set = Collect({Counting(12000), mag}, selection);
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->poses.size(), 12000u);
  for (const std::size_t i : {0u, 5000u, 11999u}) {
    const auto value = static_cast<double>(i);
    for (const Triad triad : {kAccel, Triad::kMagnetometer}) {
      ASSERT_TRUE(set->poses[i].triads[triad]);
      EXPECT_EQ(set->poses[i].triads[triad]->mean_raw, Eigen::Vector3d(value, -value, 0.5 * value));
      EXPECT_EQ(set->poses[i].triads[triad]->samples, 1);
      EXPECT_FALSE(set->poses[i].triads[triad]->has_covariance);
    }
  }
}

TEST(GivenPoses, MakeAPoseOfEveryNRows) {
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kEveryN;
  selection.every = 100;
  SyntheticRecording recording;
  for (int i = 0; i < 5; ++i) recording.Rest(1.0), recording.gravity = -recording.gravity;
  recording.Rest(0.1);
  const Result<PoseSet> set = Collect({recording.accel}, selection);
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->poses.size(), 5u);
  ASSERT_EQ(set->findings.size(), 1u);
  EXPECT_THAT(set->findings[0], HasCode(FindingCode::kRowsLeftOver));
  EXPECT_EQ(set->findings[0].Value("rows"), 10.0);
  EXPECT_EQ(set->poses[4].first_row, 400);
  EXPECT_EQ(set->poses[4].last_row, 499);
  EXPECT_TRUE(set->poses[4].triads[kAccel]->has_covariance);
}

TEST(GivenPoses, FollowAColumnAndTakeAReturningNumberForANewPose) {
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kColumn;
  MemoryStream stream = Counting(60);
  for (int i = 0; i < 60; ++i) stream.pose.push_back(std::array{0, 7, 0, 7, 8, 0}[i / 10]);
  const Result<PoseSet> set = Collect({stream}, selection);
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->poses.size(), 3u);
  EXPECT_EQ(set->poses[0].id, "7");
  EXPECT_EQ(set->poses[1].id, "7");
  EXPECT_EQ(set->poses[1].first_row, 30);
  EXPECT_EQ(set->poses[2].id, "8");
  EXPECT_EQ(set->poses[2].last_row, 49);
}

TEST(GivenPoses, FollowRowRangesAndTakeOtherFilesByTime) {
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kRanges;
  selection.ranges = {{10, 29, "first", "+z"}, {40, 59, "", ""}};
  MemoryStream gyro(kGyro);
  gyro.info.file = "gyro.csv";
  for (std::int64_t i = 0; i < 200; ++i) {  // Twice the rate, rows of its own.
    gyro.Add(i * 5'000'000, Eigen::Vector3d::Constant(static_cast<double>(i)));
  }
  const Result<PoseSet> set = Collect({Counting(100), gyro}, selection);
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->poses.size(), 2u);
  EXPECT_EQ(set->poses[0].id, "first");
  EXPECT_EQ(set->poses[0].face_up, "+z");
  EXPECT_DOUBLE_EQ(set->poses[0].triads[kAccel]->mean_raw.x(), 19.5);
  // 100 to 290 ms and half a spacing on each side: gyroscope rows 19 to 59.
  EXPECT_EQ(set->poses[0].triads[kGyro]->samples, 41);
  EXPECT_DOUBLE_EQ(set->poses[0].triads[kGyro]->mean_raw.x(), 39.0);
}

TEST(GivenPoses, RefuseRangesOutOfOrderOrBehindTheEnd) {
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kRanges;
  selection.ranges = {{40, 59, "", ""}, {10, 29, "", ""}};
  const Result<PoseSet> unordered = Collect({Counting(100)}, selection);
  ASSERT_FALSE(unordered);
  EXPECT_THAT(unordered.error().message,
              testing::HasSubstr("range 2 (rows 10 to 29) is not a range"));
  selection.ranges = {{40, 59, "", ""}, {200, 300, "", ""}};
  const Result<PoseSet> outside = Collect({Counting(100)}, selection);
  ASSERT_FALSE(outside);
  EXPECT_EQ(outside.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(outside.error().message, testing::HasSubstr("data rows 0 to 99"));
  selection.ranges = {{40, 59, "", ""}, {80, 300, "", ""}};
  const Result<PoseSet> beyond = Collect({Counting(100)}, selection);
  ASSERT_FALSE(beyond);
  EXPECT_THAT(beyond.error().message,
              testing::HasSubstr("range 2 (rows 80 to 300) lies mostly beyond"));
}

TEST(PoseStatistics, GiveTemperatureAndItsRate) {
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kEveryN;
  selection.every = 1000;
  MemoryStream stream = Counting(1000);
  for (int i = 0; i < 1000; ++i) {
    stream.temperature_degc.push_back(i % 3 == 0 ? std::nan("") : 25.0 + 0.02 * i * 0.01);
  }
  const Result<PoseSet> set = Collect({stream}, selection);
  ASSERT_TRUE(set) << set.error().message;
  // A line of 0.02 degC/s over 10 s, sampled at irregular places inside windows of 0.1 s: the
  // windows' middles stand for them to within 5 ms.
  EXPECT_NEAR(*set->poses[0].temperature_degc, 25.1, 2e-4);
  EXPECT_NEAR(set->poses[0].temperature_rate_degcps, 0.02, 1e-5);
  EXPECT_DOUBLE_EQ((*set->temperature_range_degc)[1], 25.0 + 0.02 * 9.98);
}

}  // namespace pose_collection_test
}  // namespace truetriad
