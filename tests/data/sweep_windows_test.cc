// SPDX-License-Identifier: Apache-2.0
//
// Cutting a temperature sweep into windows, and its temperature.

#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/memory_source.h"
#include "math/random.h"
#include "support/finding_matchers.h"
#include "thermometer/temperature_smoothing.h"
#include "thermometer/thermometer.h"
#include "truetriad/data/pose_collection.h"

namespace truetriad {
namespace sweep_windows_test {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr double kRate = 0.05;  // degC/s

/// An accelerometer at rest while the temperature goes up, then down.
MemoryStream Sweep(int samples, double spacing_s, Random* random) {
  MemoryStream stream(Triad::kAccelerometer, "m/s^2");
  stream.info.unit = {"m/s^2", 1.0, false};
  for (int i = 0; i < samples; ++i) {
    const int from_end = std::min(i, samples - i);
    stream.Add(std::llround(i * spacing_s * 1e9),
               Eigen::Vector3d(0.0, 0.0, 9.8) + 0.003 * random->Normal3());
    stream.temperature_degc.push_back(20.0 + kRate * spacing_s * from_end +
                                      0.01 * random->Normal());
  }
  return stream;
}

PoseSelection Windows(SweepWindows windows = {}) {
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kSweep;
  selection.sweep = windows;
  return selection;
}

Result<PoseSet> Cut(MemoryStream stream, const PoseSelection& selection) {
  MemorySource source({std::move(stream)});
  return CollectPoses(source, selection);
}

std::string ErrorOf(const Result<PoseSet>& result) { return result ? "" : result.error().message; }

TEST(SweepWindows, HoldMeansTemperatureAndItsRate) {
  Random random(1);
  const auto set = Cut(Sweep(4000, 0.5, &random), Windows());
  ASSERT_TRUE(set) << set.error().message;
  for (const StaticPose& pose : set->poses) {
    const TriadPose& reading = *pose.triads[Triad::kAccelerometer];
    ASSERT_TRUE(reading.has_covariance);
    const double sigma = std::sqrt(reading.mean_covariance_raw(2, 2));
    // Some hundred windows: five of their σ.
    EXPECT_NEAR(reading.mean_raw.z(), 9.8, 5.0 * sigma);
    // The turning point is sharp: within a smoothing width of it the rate is anything between.
    const double middle_s = 0.5e-9 * static_cast<double>(pose.start_ns + pose.end_ns);
    if (std::abs(middle_s - 1000.0) < 2.0 * set->sweep.temperature.smoothing_s) continue;
    EXPECT_NEAR(std::abs(pose.temperature_rate_degcps), kRate, 0.1 * kRate) << middle_s;
  }
  // A sample's noise is known to its hundreds of degrees of freedom.
  EXPECT_NEAR(set->Find(Triad::kAccelerometer)->noise_sigma_raw.x(), 0.003, 3e-4);
}

TEST(SweepWindows, CountSecondsOrSamplesWhereTheyAreStated) {
  Random random(2);
  const auto by_time = Cut(Sweep(4000, 0.5, &random), Windows({.window_s = 20.0}));
  ASSERT_TRUE(by_time) << by_time.error().message;
  EXPECT_THAT(by_time->poses, SizeIs(100));
  const auto by_samples = Cut(Sweep(4000, 0.5, &random), Windows({.window_samples = 50}));
  ASSERT_TRUE(by_samples) << by_samples.error().message;
  EXPECT_THAT(by_samples->poses, SizeIs(80));
  EXPECT_EQ(by_samples->poses[1].first_row, 50);
  EXPECT_EQ(by_samples->poses[1].last_row, 99);
}

TEST(SweepWindows, LeaveOutAndNameARowFarFromItsNeighbours) {
  Random random(3);
  MemoryStream stream = Sweep(4000, 0.5, &random);
  stream.y[0] += 0.1;
  stream.z[1234] -= 0.2;
  const auto set = Cut(std::move(stream), Windows());
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_THAT(set->sweep.left_out,
              ElementsAre(AllOf(HasSubstr("row 0 "), HasSubstr("accelerometer y")),
                          AllOf(HasSubstr("row 1234 "), HasSubstr("accelerometer z"))));
  EXPECT_EQ(set->poses[0].first_row, 1);
}

TEST(SweepWindows, KeepTheirAttitude) {
  Random random(4);
  MemoryStream stream = Sweep(4000, 0.5, &random);
  for (std::size_t i = 1500; i < 2500; ++i) std::swap(stream.x[i], stream.z[i]);
  PoseSelection selection = Windows();
  selection.ranges = {{0, 1499, "up", ""}, {1510, 2490, "side", ""}, {2500, 3999, "up", ""}};
  const auto set = Cut(stream, selection);
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_THAT(set->sweep.attitude_names, ElementsAre("up", "side"));
  for (std::size_t k = 0; k < set->poses.size(); ++k) {
    const Eigen::Vector3d mean = set->poses[k].triads[Triad::kAccelerometer]->mean_raw;
    EXPECT_GT(set->sweep.attitude[k] == 0 ? mean.z() : mean.x(), 9.7);
  }
  // Nobody said so.
  EXPECT_THAT(ErrorOf(Cut(stream, Windows())),
              AllOf(HasSubstr("as if the unit was turned"), HasSubstr("attitudes: poses.yaml")));
}

TEST(SweepWindows, NameAnAttitudeWithoutReadings) {
  Random random(7);
  PoseSelection selection = Windows();
  selection.ranges = {{0, 999, "", ""}, {5000, 6000, "", ""}};
  EXPECT_THAT(ErrorOf(Cut(Sweep(1000, 0.5, &random), selection)),
              HasSubstr("range 2 (rows 5000 to 6000) has no reading"));
}

// Whatever somebody states: a window of the whole recording, or of less than a sample.
TEST(SweepWindows, SurviveAbsurdLengths) {
  Random random(8);
  const MemoryStream stream = Sweep(1000, 0.5, &random);
  EXPECT_THAT(ErrorOf(Cut(stream, Windows({.window_s = 1e300}))), HasSubstr("at least 40"));
  const auto set = Cut(stream, Windows({.window_s = 1e-300}));
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_LE(set->poses.size(), 1000U);
}

TEST(SweepWindows, NeedTimeTemperatureAndAChangeOfIt) {
  Random random(5);
  MemoryStream without = Sweep(1000, 0.5, &random);
  without.temperature_degc.clear();
  EXPECT_THAT(ErrorOf(Cut(without, Windows())), HasSubstr("has no temperature"));
  MemoryStream constant = Sweep(1000, 0.5, &random);
  for (double& degc : constant.temperature_degc) degc = 25.0;
  EXPECT_THAT(ErrorOf(Cut(constant, Windows())), HasSubstr("throughout"));
  MemorySource source({Sweep(1000, 0.5, &random)});
  source.mutable_info().has_time = false;
  EXPECT_THAT(ErrorOf(CollectPoses(source, Windows())), HasSubstr("has no time"));
}

// 28 hours at 4 Hz are 400 000 cells of a sample, were there no end to them.
TEST(SweepWindows, TakeNoMoreMemoryForALongRecording) {
  Random random(6);
  const auto set = Cut(Sweep(400000, 0.25, &random), Windows());
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_LE(set->sweep.temperature.time_s.size(), 32768U);
  EXPECT_LE(set->poses.size(), 1000U);
}

// A slow sine in whole degrees: the error is a small part of a step, and of the rate.
TEST(SmoothTemperature, FollowsAThermometerOfWholeDegrees) {
  std::vector<double> time_s, degc;
  const auto truth = [](double time) { return 20.0 + 30.0 * std::sin(time / 600.0); };
  for (int i = 0; i < 8000; ++i) {
    time_s.push_back(0.5 * i);
    degc.push_back(std::round(truth(0.5 * i)));
  }
  const auto track = SmoothTemperature(time_s, degc, 1.0);
  ASSERT_TRUE(track) << track.error().message;
  EXPECT_EQ(track->step_degc, 1.0);
  double value_error = 0.0, rate_error = 0.0;
  for (std::size_t i = 400; i + 400 < time_s.size(); ++i) {
    value_error = std::max(value_error, std::abs(track->degc[i] - truth(time_s[i])));
    rate_error =
        std::max(rate_error, std::abs(track->rate_degcps[i] - 0.05 * std::cos(time_s[i] / 600.0)));
  }
  EXPECT_LT(value_error, 0.25);
  EXPECT_LT(rate_error, 0.005);
}

// Up and down behind a lag of 30 s: at the turn there is no step for over a minute, and only the
// lag says how it turns. Straight lines through steps that are known to a row, 0.5 s of 0.05 degC/s
// or 0.007 degC (1 sigma), leave far less than a hundredth of the rate.
TEST(SmoothTemperature, FollowsATurnBetweenTwoSteps) {
  constexpr double kLagS = 30.0, kTurnS = 1000.0;
  const auto behind = [](double since_s) { return kLagS * (1.0 - std::exp(-since_s / kLagS)); };
  const auto truth = [&](double time_s) {
    const double down_s = std::max(0.0, time_s - kTurnS);
    return 20.3 + kRate * (time_s - behind(time_s)) - 2.0 * kRate * (down_s - behind(down_s));
  };
  std::vector<double> time_s, degc;
  for (int i = 0; i < 4000; ++i) {
    time_s.push_back(0.5 * i);
    degc.push_back(std::round(truth(0.5 * i)));
  }
  const auto track = SmoothTemperature(time_s, degc, 1.0);
  ASSERT_TRUE(track) << track.error().message;
  for (std::size_t i = 400; i + 400 < time_s.size(); ++i) {
    const double rate = (truth(time_s[i] + 0.1) - truth(time_s[i] - 0.1)) / 0.2;
    const bool is_turn = std::abs(time_s[i] - kTurnS) < 100.0;
    const double node_s = 20.0 / 8.0;
    EXPECT_NEAR(track->degc[i], truth(time_s[i]), is_turn ? node_s * kRate : 0.02) << time_s[i];
    const double share = is_turn ? 2.0 * node_s / kLagS : 0.01;
    EXPECT_NEAR(track->rate_degcps[i], rate, share * kRate) << time_s[i];
  }
}

// Noise of half a step: the mean of the readings is the temperature.
TEST(SmoothTemperature, TakesTheMeanOfReadingsThatNoiseSpreadsOverSteps) {
  Random random(11);
  const auto truth = [](double time) { return 20.0 + 30.0 * std::sin(time / 600.0); };
  std::vector<double> time_s, degc;
  for (int i = 0; i < 8000; ++i) {
    time_s.push_back(0.5 * i);
    degc.push_back(std::round(truth(0.5 * i) + 0.5 * random.Normal()));
  }
  const auto track = SmoothTemperature(time_s, degc, 1.0);
  ASSERT_TRUE(track) << track.error().message;
  EXPECT_EQ(track->step_degc, 0.0);
  // sqrt(0.5^2 + 1/12) of a reading, and three quarters of those in the width of a tricube count
  // as if they were one parabola: 2.3 / width in readings is its variance, 5 sigma.
  const double sigma =
      std::sqrt(0.5 * 0.5 + 1.0 / 12.0) * std::sqrt(2.3 * 0.5 / track->smoothing_s);
  for (std::size_t i = 400; i + 400 < time_s.size(); ++i) {
    EXPECT_NEAR(track->degc[i], truth(time_s[i]), 5.0 * sigma) << time_s[i];
  }
}

// Read every 10 s and repeated: on average the temperature is 5 s behind, which is 0.25 degC on a
// ramp, up and down.
TEST(SmoothTemperature, TakesARepeatedReadingAtTheTimeItWasTaken) {
  Random random(5);
  MemoryStream stream = Sweep(8000, 0.25, &random);
  constexpr std::size_t kEvery = 40;
  for (std::size_t i = 0; i < stream.temperature_degc.size(); ++i) {
    stream.temperature_degc[i] = stream.temperature_degc[i - i % kEvery];
  }
  const auto set = Cut(std::move(stream), Windows());
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_THAT(set->sweep.left_out, SizeIs(0));
  const TemperatureTrack& track = set->sweep.temperature;
  double heating = 0.0, cooling = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < track.time_s.size(); ++i) {
    const double time_s = track.time_s[i];
    const double from_end_s = std::min(time_s, 2000.0 - time_s);
    if (from_end_s < 100.0 || std::abs(time_s - 1000.0) < 100.0) continue;
    const double off = track.degc[i] - (20.0 + kRate * from_end_s);
    (time_s < 1000.0 ? heating : cooling) += off;
    ++count;
    EXPECT_NEAR(std::abs(track.rate_degcps[i]), kRate, 0.1 * kRate) << time_s;
  }
  // Readings of 0.01, eighty of them on each side, and the first one of a cell: 0.05 s of 0.05.
  EXPECT_NEAR(heating / (0.5 * count), 0.0, 0.01);
  EXPECT_NEAR(cooling / (0.5 * count), 0.0, 0.01);
}

TEST(ThermometerWatch, TellsARepeatedReadingFromOneThatChangesWithEveryRow) {
  Random random(8);
  const MemoryStream stream = Sweep(4000, 0.25, &random);
  ThermometerWatch each_row, every_ten_seconds;
  each_row.Note(stream.time_ns, stream.temperature_degc);
  EXPECT_EQ(each_row.hold_s(), 0.0);
  std::vector<double> repeated = stream.temperature_degc;
  for (std::size_t i = 0; i < repeated.size(); ++i) repeated[i] = repeated[i - i % 40];
  every_ten_seconds.Note(stream.time_ns, repeated);
  EXPECT_NEAR(every_ten_seconds.hold_s(), 10.0, 1e-9);
}

// Eleven readings in all: they are a thermometer's, and too few.
TEST(SweepWindows, SayThatTheThermometerIsReadTooSeldom) {
  Random random(9);
  MemoryStream stream = Sweep(33000, 0.2, &random);
  for (std::size_t i = 0; i < stream.temperature_degc.size(); ++i) {
    stream.temperature_degc[i] = stream.temperature_degc[i - i % 3000];
  }
  ThermometerWatch watch;
  watch.Note(stream.time_ns, stream.temperature_degc);
  EXPECT_NEAR(watch.hold_s(), 600.0, 1e-6);
  const auto set = Cut(std::move(stream), Windows());
  ASSERT_TRUE(set) << set.error().message;
  const Finding* slow = Find(set->findings, FindingCode::kSlowThermometer);
  ASSERT_NE(slow, nullptr);
  EXPECT_NEAR(*slow->Value("interval"), 600.0, 0.1);
  EXPECT_EQ(Find(set->findings, FindingCode::kUnitTurned), nullptr);
}

TEST(SweepWindows, StayAsTheyAreWhenTheTemperatureLeapsByHundredsOfDegrees) {
  Random random(6);
  const MemoryStream stream = Sweep(4000, 0.5, &random);
  MemoryStream disturbed = stream;
  disturbed.temperature_degc[1000] = 600.0;
  // Two in a row, as of a register that was read half.
  disturbed.temperature_degc[3000] = disturbed.temperature_degc[3001] = -273.0;
  const auto plain = Cut(stream, Windows());
  const auto set = Cut(std::move(disturbed), Windows());
  ASSERT_TRUE(set) << set.error().message;
  for (const char* row : {"row 1000", "3000"}) {
    EXPECT_THAT(set->findings,
                Contains(AllOf(HasCode(FindingCode::kReadingsLeftOut),
                               Says(AllOf(HasSubstr(row), HasSubstr("temperature"))))));
  }
  EXPECT_NEAR(
      static_cast<double>(set->poses.size()), static_cast<double>(plain->poses.size()), 3.0);
  for (std::size_t i = 0; i < set->sweep.temperature.degc.size(); ++i) {
    const double time_s = set->sweep.temperature.time_s[i];
    const double degc = 20.0 + kRate * std::min(time_s, 2000.0 - time_s);
    // The turning point is rounded.
    EXPECT_NEAR(set->sweep.temperature.degc[i], degc, 0.3) << time_s;
  }
}

// The bias goes 0.05 m/s^2 up and down with the temperature beside it, and there is noise.
TEST(SweepWindows, NameASmallTurnAsOne) {
  Random random(7);
  MemoryStream still = Sweep(4000, 0.5, &random);
  for (std::size_t i = 0; i < still.x.size(); ++i) {
    still.x[i] += 1e-3 * (still.temperature_degc[i] - 20.0);
    still.z[i] += 1e-3 * (still.temperature_degc[i] - 20.0);
  }
  MemoryStream turned = still;
  constexpr double kTurnRad = 0.0175;  // 1.0 degree
  for (std::size_t i = 1400; i < turned.x.size(); ++i) turned.x[i] += 9.8 * kTurnRad;
  const auto quiet = Cut(std::move(still), Windows());
  ASSERT_TRUE(quiet);
  EXPECT_THAT(quiet->findings, SizeIs(0));
  const auto set = Cut(std::move(turned), Windows());
  ASSERT_TRUE(set) << set.error().message;
  const Finding* turn = Find(set->findings, FindingCode::kUnitTurned);
  ASSERT_NE(turn, nullptr);
  EXPECT_NEAR(*turn->Value("turned"), 1.0, 0.05);
  EXPECT_THAT(turn->text, HasSubstr("near row 1"));
}

}  // namespace sweep_windows_test
}  // namespace truetriad
