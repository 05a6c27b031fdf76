// SPDX-License-Identifier: Apache-2.0
#include "data/pose_statistics.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/detected_poses.h"
#include "data/memory_source.h"
#include "data/synthetic_recording.h"
#include "data/window_statistics.h"
#include "math/random.h"

namespace truetriad {
namespace pose_statistics_test {

constexpr Triad kAccel = Triad::kAccelerometer;

// Poses of first-order autoregressive noise with variance 1: white when phi is 0.
Result<PoseSet> NoisePoses(double phi, int poses, int samples, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const double innovation = std::sqrt(1.0 - phi * phi);
  MemoryStream stream(kAccel);
  Eigen::Vector3d state = Eigen::Vector3d::Zero();
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(poses) * samples; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      state[axis] = phi * state[axis] + innovation * normal(random);
    }
    stream.Add(i * 10'000'000, state + Eigen::Vector3d::Constant(33000.0));
  }
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kEveryN;
  selection.every = samples;
  MemorySource source({stream});
  return CollectPoses(source, selection);
}

// Mean over poses of (mean / predicted sigma)^2: 1 when the covariance of the mean is right.
double MeanSquareOfPulls(const PoseSet& set) {
  double sum = 0.0;
  for (const StaticPose& pose : set.poses) {
    const TriadPose& reading = *pose.triads[kAccel];
    const Eigen::Vector3d error = reading.mean_raw - Eigen::Vector3d::Constant(33000.0);
    sum += error.dot(reading.mean_covariance_raw.inverse() * error) / 3.0;
  }
  return sum / static_cast<double>(set.poses.size());
}

TEST(PoseStatistics, GiveWhiteNoiseNoInflationAndTheRightCovariance) {
  const Result<PoseSet> set = NoisePoses(0.0, 400, 500, 7);
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->streams[0].correlation_inflation, Eigen::Vector3d::Ones());
  // sigma from 180,000 degrees of freedom: 0.17 % one sigma, 5 sigma allowed.
  EXPECT_LT((set->streams[0].noise_sigma_raw - Eigen::Vector3d::Ones()).cwiseAbs().maxCoeff(),
            0.0085);
  // Mean of 1200 chi-squares with one degree of freedom: sigma sqrt(2/1200) = 0.041, 5 allowed.
  EXPECT_NEAR(MeanSquareOfPulls(*set), 1.0, 0.2);
}

TEST(PoseStatistics, CatchCorrelatedNoise) {
  for (const double phi : {0.5, 0.9}) {
    const Result<PoseSet> set = NoisePoses(phi, 400, 1000, 11);
    ASSERT_TRUE(set) << set.error().message;
    // Sampling: 0.041 one sigma as above. Batches stop growing once white noise could explain
    // the rest, so that up to a tenth of the long-run variance can be missed.
    EXPECT_NEAR(MeanSquareOfPulls(*set), 1.05, 0.25) << phi;
  }
}

TEST(PoseStatistics, LetANoisierPoseKeepItsOwnVariance) {
  SyntheticRecording recording;
  for (int i = 0; i < 8; ++i) recording.Rest(5.0, i == 3 ? 3.0 : 1.0);
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kEveryN;
  selection.every = 500;
  MemorySource source({recording.accel});
  const Result<PoseSet> set = CollectPoses(source, selection);
  ASSERT_TRUE(set) << set.error().message;
  for (std::size_t i = 0; i < 8; ++i) {
    const Eigen::Vector3d variance =
        set->poses[i].triads[kAccel]->mean_covariance_raw.diagonal() * 500.0 / (0.02 * 0.02);
    // 450 degrees of freedom: 6.7 % one sigma, 5 sigma allowed; the pool is sharper.
    EXPECT_LT((variance - Eigen::Vector3d::Constant(i == 3 ? 9.0 : 1.0)).cwiseAbs().maxCoeff(),
              0.34 * (i == 3 ? 9.0 : 1.0))
        << "pose " << i;
  }
}

TEST(PoseStatistics, DoNotAverageAwayTheStepOfACoarseSensor) {
  SyntheticRecording recording;
  recording.noise_mps2 = 0.002, recording.step_raw = 0.05;
  for (int i = 0; i < 8; ++i) recording.Rest(4.0), recording.Handle();
  MemorySource source({recording.accel});
  const Result<PoseSet> set = CollectPoses(source, {});
  ASSERT_TRUE(set) << set.error().message;
  for (const StaticPose& pose : set->poses) {
    const Eigen::Vector3d sigma = pose.triads[kAccel]->mean_covariance_raw.diagonal().cwiseSqrt();
    EXPECT_GT(sigma.minCoeff(), 0.5 * 0.05 / std::sqrt(12.0)) << "pose " << pose.number;
  }
}

// A calibration whose mean is above its highest temperature is refused when it is read.
// Whatever the noise is, and wherever between two steps a gyroscope rests.
TEST(PoseStatistics, AllowForRoundingAtOnePlace) {
  constexpr int kCount = 20000;
  Random random(3);
  for (const double sigma : {0.02, 0.1, 0.2, 0.3, 0.4, 0.6, 0.9}) {
    for (double place = -0.5; place < 0.5; place += 0.05) {
      double sum = 0.0, square = 0.0;
      for (int i = 0; i < kCount; ++i) {
        const double reading = std::round(place + sigma * random.Normal());
        sum += reading;
        square += reading * reading;
      }
      const double mean = sum / kCount, variance = square / kCount - mean * mean;
      const double rounding = RoundingVarianceAt(mean, variance, 1.0);
      EXPECT_LT(std::abs(mean - place), 5.0 * std::sqrt(rounding + sigma * sigma / kCount))
          << sigma << " at " << place;
      // Noise of a step hides it; the place is no matter then.
      EXPECT_LT(sigma > 0.5 ? rounding : 0.0, 1e-4) << sigma << " at " << place;
    }
  }
}

TEST(RecordedTemperature, HasItsMeanBetweenItsEnds) {
  PoseSet poses;
  for (int i = 0; i < 24; ++i) {
    poses.poses.emplace_back().temperature_degc = 38.400001500000009;
    const auto recorded = RecordedDegc(poses);
    ASSERT_TRUE(recorded);
    EXPECT_LE((*recorded)[0], (*recorded)[1]);
    EXPECT_LE((*recorded)[1], (*recorded)[2]);
  }
}

TEST(WindowStatistics, DoNotCancelUnderALargeOffset) {
  const std::vector<double> values = {1e9, 1e9 + 1e-3, 1e9 + 2e-3, 1e9 + 3e-3};
  const std::vector<std::int64_t> count = {0, 1, 2, 3};
  const SampleBlock block{kAccel, count, values, values, values, {}, {}, count};
  TriadWindow window = Summarize(block, 0, 2);
  window.Merge(Summarize(block, 2, 4));
  // The readings themselves are rounded to 1.2e-7.
  EXPECT_NEAR(window.scatter_raw(0, 1), 5e-6, 4.0 * 3e-3 * 1.2e-7);
}

TEST(DetectedPoses, HoldABoundedNumberOfWindowsOfALongRecording) {
  // 2 h at 10 Hz: 18,000 windows of 0.4 s, a rest of an hour that spans chunks in the middle.
  SyntheticRecording recording(10.0);
  int rests = 0;
  const auto pose = [&](double duration_s) {
    recording.Rest(duration_s), recording.Handle(), ++rests;
  };
  for (int i = 0; i < 100; ++i) pose(20.0);
  pose(20000.0);
  for (int i = 0; i < 100; ++i) pose(20.0);
  MemorySource source({recording.accel}, 1024);
  StreamMonitor monitor(source.info().streams[0], true);
  PerTriad<StreamMonitor*> monitors;
  monitors[kAccel] = &monitor;
  DetectedPoses poses({}, source.info(), monitors, kAccel);
  std::vector<SampleBlock> blocks;
  for (Result<bool> more = source.Next(&blocks); more && *more; more = source.Next(&blocks)) {
    for (const SampleBlock& block : blocks) ASSERT_TRUE(monitor.Add(block));
    ASSERT_TRUE(poses.Add(blocks));
  }
  Findings findings;
  const Result<std::vector<CollectedPose>> found = poses.Finish(&findings);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->size(), static_cast<std::size_t>(rests));
  double longest_s = 0.0;
  for (const CollectedPose& each : *found) longest_s = std::max(longest_s, each.pose.duration_s());
  EXPECT_NEAR(longest_s, 20000.0, 10.0);
  EXPECT_LT(poses.peak_windows(), 18000u);
}

// Noise at rest, then a turn, ten times; what is beyond the limit reads as that, what is below the
// band as zero.
TEST(StreamMonitor, TellsADeadBandFromALimit) {
  const auto rest_step = [](double limit, double band) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal(0.0, 1e-3);
    MemoryStream stream(Triad::kGyroscope);
    for (std::int64_t i = 0; i < 2000; ++i) {
      const double turn = i % 200 < 100 ? 0.0 : std::sin(0.01 * M_PI * static_cast<double>(i));
      Eigen::Vector3d rate;
      for (double& axis : rate) {
        axis = std::clamp(2.0 * turn + normal(random), -limit, limit);
        if (std::abs(axis) < band) axis = 0.0;
      }
      stream.Add(i * 10'000'000, rate);
    }
    MemorySource source({stream});
    StreamMonitor monitor(source.info().streams[0], true);
    std::vector<SampleBlock> blocks;
    for (Result<bool> more = source.Next(&blocks); more && *more; more = source.Next(&blocks)) {
      for (const SampleBlock& block : blocks) EXPECT_TRUE(monitor.Add(block));
    }
    return monitor.rest_step_raw().maxCoeff();
  };
  EXPECT_LT(rest_step(1.2, 0.0), 1e-3);
  EXPECT_GT(rest_step(10.0, 0.01), 0.02);
  EXPECT_GT(rest_step(1.2, 0.01), 0.02);
}

}  // namespace pose_statistics_test
}  // namespace truetriad
