// SPDX-License-Identifier: Apache-2.0
#include "verdict/checks/units.h"

#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/finding_matchers.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace units_test {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// Thirteen rests and the turns between them, seen by a good unit whose gyroscope counts in units
// of `radps_per_raw`, though its log says rad/s.
PoseSet TurnedUnit(double radps_per_raw) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Vector3d(normal(random), normal(random), normal(random)); };
  PoseSet set;
  set.streams = {{.triad = Triad::kAccelerometer, .unit = {"m/s^2"}, .samples = 1000},
                 {.triad = Triad::kMagnetometer, .unit = {"uT"}, .samples = 1000},
                 {.triad = Triad::kGyroscope, .unit = {"rad/s"}, .samples = 1000, .rate_hz = 100}};
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
  const Vector3d bias = 0.01 / radps_per_raw * draw();
  for (std::size_t k = 0; k < 13; ++k) {
    StaticPose& pose = set.poses.emplace_back();
    pose.triads[Triad::kAccelerometer].emplace().mean_raw =
        attitude.conjugate() * Vector3d(0.0, 0.0, 9.8) + 0.1 * draw();
    pose.triads[Triad::kMagnetometer].emplace().mean_raw =
        attitude.conjugate() * Vector3d(20.0, 0.0, 40.0) + 0.1 * draw();
    pose.triads[Triad::kGyroscope].emplace().mean_raw = bias;
    pose.temperature_degc = 25.0;
    const Vector3d axis = draw().normalized();
    const double angle = 0.6 + 0.2 * static_cast<double>(k);
    attitude = attitude * Eigen::AngleAxisd(angle, axis);
    if (k == 12) break;
    RecordedMove& move = set.moves.emplace_back();
    move.from = k;
    for (int i = 0; i <= 100; ++i) {
      move.time_ns.push_back(10'000'000LL * i);
      const double rate = angle * 0.5 * std::numbers::pi * std::sin(std::numbers::pi * 0.01 * i);
      move.gyroscope_raw.emplace_back(1.02 * rate / radps_per_raw * axis + bias);
    }
  }
  return set;
}

CalibrateOptions NineAxis() {
  CalibrateOptions options;
  for (TriadOptions& triad : options.triads) triad.enabled = true;
  options.reference.field_ut.value = 48.0;
  return options;
}

TEST(Units, HaveNothingToSayOfAGoodUnit) {
  EXPECT_FALSE(WhyNotAsStated(TurnedUnit(1.0), NineAxis()));
}

TEST(Units, OfAGyroscopeAreToldByItsTurns) {
  const struct {
    double radps_per_raw;
    const char* name;
  } kUnits[] = {{kRadPerDeg, "like deg/s labelled rad/s"},
                {1e-3, "like mrad/s labelled"},
                {1e-3 * kRadPerDeg, "like mdeg/s"},
                {kRadPerDeg / 131.0, "250 deg/s"},
                {kRadPerDeg / 16.4, "2000 deg/s"},
                {1.0 / kRadPerDeg, "counts"}};
  for (const auto& unit : kUnits) {
    const auto finding = WhyNotAsStated(TurnedUnit(unit.radps_per_raw), NineAxis());
    ASSERT_TRUE(finding) << unit.radps_per_raw;
    EXPECT_THAT(*finding, HasCode(FindingCode::kWrongUnit));
    EXPECT_EQ(finding->sensor, Triad::kGyroscope);
    EXPECT_NEAR(*finding->Value("factor") / unit.radps_per_raw, 1.0, 0.1);
    EXPECT_THAT(finding->Message(), HasSubstr(unit.name));
    CalibrateOptions trusting = NineAxis();
    trusting.check_units = false;
    EXPECT_FALSE(WhyNotAsStated(TurnedUnit(unit.radps_per_raw), trusting));
  }
  PoseSet in_counts = TurnedUnit(1e-3);
  in_counts.streams[2].unit = {"counts", 1.0, true};
  EXPECT_FALSE(WhyNotAsStated(in_counts, NineAxis()));
}

TEST(Units, OfOneAxisOfAGyroscopeAreToldByItsTurns) {
  for (int axis = 0; axis < 3; ++axis) {
    // An axis that reads too little leaves half of the turns explained; its gain tells then.
    for (const double factor : {kRadPerDeg, 1e-3}) {
      PoseSet set = TurnedUnit(1.0);
      for (StaticPose& pose : set.poses) {
        pose.triads[Triad::kGyroscope]->mean_raw[axis] /= factor;
      }
      for (RecordedMove& move : set.moves) {
        for (Vector3d& raw : move.gyroscope_raw) raw[axis] /= factor;
      }
      const auto finding = WhyNotAsStated(set, NineAxis());
      ASSERT_TRUE(finding) << axis << " " << factor;
      EXPECT_THAT(*finding, HasCode(FindingCode::kWrongUnit));
      EXPECT_NEAR(*finding->Value("factor") / factor, 1.0, 1e-9);
      EXPECT_THAT(finding->Message(), HasSubstr(std::string("its ") + "xyz"[axis] + " axis"));
    }
  }
}

TEST(Units, OfTimesAreToldByTheRate) {
  PoseSet set = TurnedUnit(1.0);
  for (const auto& [rate_hz, guess] : {std::pair(0.1, "ms labelled s?"),
                                       std::pair(1e-4, "us labelled s?"),
                                       std::pair(1e-7, "ns labelled s?"),
                                       std::pair(1e5, "s labelled ms?"),
                                       std::pair(1e8, "s labelled us?")}) {
    set.streams[2].rate_hz = rate_hz;
    set.duration_s = 6000.0 / rate_hz;  // A minute at 100 Hz.
    EXPECT_THAT(WhyNotAsStated(set, NineAxis())->Message(), HasSubstr(guess));
  }
  set.streams[2].rate_hz = 0.1;
  CalibrateOptions slow = NineAxis();
  slow.triads[Triad::kGyroscope].enabled = false;  // Rests are rests at any rate.
  EXPECT_FALSE(WhyNotAsStated(set, slow));
}

TEST(Units, OfTimesAreNotDoubtedWhereTheLogIsReallySlow) {
  PoseSet set = TurnedUnit(1.0);
  set.streams[2].rate_hz = 1.0;
  set.duration_s = 170.0;  // Of ms it would be 0.17 s, in which nobody turns thirteen times.
  const auto finding = WhyNotAsStated(set, NineAxis());
  ASSERT_TRUE(finding);
  EXPECT_THAT(*finding, HasCode(FindingCode::kTooSlow));
  EXPECT_THAT(finding->Message(),
              AllOf(HasSubstr("1 Hz over 170 s, which is too slow for turns and rests"),
                    HasSubstr("10 Hz or more"),
                    Not(HasSubstr("ms labelled s"))));
}

TEST(Units, OfTemperatureAreToldByItsRange) {
  PoseSet set = TurnedUnit(1.0);
  set.temperature_range_degc = {20.0, 9999.0};  // One reading that is none.
  EXPECT_FALSE(WhyNotAsStated(set, NineAxis()));
  set.temperature_range_degc = {296.0, 299.0};
  EXPECT_THAT(WhyNotAsStated(set, NineAxis())->Message(), HasSubstr("K labelled degC"));
  set.temperature_range_degc = {63000.0, 63200.0};
  EXPECT_THAT(*WhyNotAsStated(set, NineAxis()), HasCode(FindingCode::kWrongUnit));
}

TEST(Units, OfTheStatedFieldAreToldByItsStrength) {
  CalibrateOptions options = NineAxis();
  options.reference.field_ut.value = 480.0;
  EXPECT_THAT(WhyNotAsStated(TurnedUnit(1.0), options)->Message(), HasSubstr("mG labelled uT"));
  options.reference.field_ut.value = 1.0;
  EXPECT_THAT(*WhyNotAsStated(TurnedUnit(1.0), options), HasCode(FindingCode::kWrongUnit));
  options.triads[Triad::kMagnetometer].enabled = false;
  EXPECT_FALSE(WhyNotAsStated(TurnedUnit(1.0), options));
}

TEST(Units, OfTheAccelerometerAreToldByGravity) {
  for (const double factor : {1.0 / kStandardGravityMps2, 1e3 / kStandardGravityMps2, 1e-3}) {
    PoseSet set = TurnedUnit(1.0);
    for (StaticPose& pose : set.poses) pose.triads[Triad::kAccelerometer]->mean_raw *= factor;
    const auto finding = WhyNotAsStated(set, NineAxis());
    ASSERT_TRUE(finding) << factor;
    EXPECT_EQ(finding->sensor, Triad::kAccelerometer);
    EXPECT_NEAR(*finding->Value("gain") / factor, 1.0, 0.02);
  }
}

TEST(Units, OfGainsAreThoseOfTheUnit) {
  const PoseSet set = TurnedUnit(1.0);
  const auto check = [&](double gain, const CalibrateOptions& options, bool nominal = false) {
    PerTriad<Eigen::Matrix3d> sensitivity;
    sensitivity.items.fill(Eigen::Matrix3d::Identity());
    sensitivity[Triad::kMagnetometer] *= gain;
    ReferenceValues reference;
    reference.field_ut = nominal ? 48.0 * gain : 48.0;
    reference.field_nominal = nominal;
    return CheckGains(set, options, sensitivity, reference);
  };
  EXPECT_TRUE(check(1.25, NineAxis()).empty());
  EXPECT_THAT(check(1.4, NineAxis()), ElementsAre(HasCode(FindingCode::kOddGain)));
  EXPECT_EQ(OutcomeOf(check(1.4, NineAxis())), Outcome::kNotConverged);
  EXPECT_THAT(check(10.0, NineAxis()), ElementsAre(HasCode(FindingCode::kWrongUnit)));
  EXPECT_THAT(check(0.01, NineAxis(), true), ElementsAre(HasCode(FindingCode::kWrongUnit)));
  CalibrateOptions trusting = NineAxis();
  trusting.check_units = false;
  EXPECT_TRUE(check(1.4, trusting).empty());
  EXPECT_EQ(OutcomeOf(check(10.0, trusting)), Outcome::kConverged);
  EXPECT_THAT(check(10.0, trusting), ElementsAre(HasCode(FindingCode::kOddGain)));
}

TEST(Units, OfOneAxisAreThoseOfTheOthers) {
  const auto check = [](Triad triad, double gain, bool nominal = false) {
    PerTriad<Eigen::Matrix3d> sensitivity;
    sensitivity.items.fill(Eigen::Matrix3d::Identity());
    sensitivity[triad].row(2) *= gain;
    ReferenceValues reference;
    reference.field_ut = 48.0;
    reference.field_nominal = nominal;
    return CheckGains(TurnedUnit(1.0), NineAxis(), sensitivity, reference);
  };
  for (const Triad triad : kTriads) EXPECT_TRUE(check(triad, 1.4).empty());
  for (const double gain : {0.01, 0.1, 0.5, 2.0, 10.0}) {
    for (const bool nominal : {false, true}) {
      EXPECT_THAT(check(Triad::kMagnetometer, gain, nominal),
                  ElementsAre(HasCode(FindingCode::kOddGain)));
    }
    const Findings found = check(Triad::kAccelerometer, gain);
    ASSERT_THAT(found, ElementsAre(HasCode(FindingCode::kOddGain)));
    EXPECT_TRUE(found.front().IsRefusal());
    EXPECT_NE(found.front().text.find("z axis"), std::string::npos);
  }
  // Iron may do so.
  EXPECT_FALSE(check(Triad::kMagnetometer, 2.0).front().IsRefusal());
  EXPECT_TRUE(check(Triad::kMagnetometer, 10.0).front().IsRefusal());
}

TEST(NotRaw, IsASensorWhoseReadingsTurnAtOneLength) {
  PoseSet set = TurnedUnit(1.0);
  StreamSummary& stream = set.streams[1];
  stream.length_raw = 1.0;
  stream.length_extent.setConstant(1.8);
  stream.minimum_raw.setConstant(-0.9), stream.maximum_raw.setConstant(0.9);
  stream.length_scatter = 3e-7;
  EXPECT_THAT(*WhyNotAsStated(set, NineAxis()), HasCode(FindingCode::kNotRaw));
  stream.length_scatter = 5e-4;  // As three digits leave it.
  EXPECT_FALSE(WhyNotAsStated(set, NineAxis()));
  stream.resolution_raw.setConstant(1e-3);
  EXPECT_THAT(*WhyNotAsStated(set, NineAxis()), HasCode(FindingCode::kNotRaw));
  stream.length_extent.z() = 0.1;  // It never turned.
  EXPECT_FALSE(WhyNotAsStated(set, NineAxis()));
}

}  // namespace units_test
}  // namespace truetriad
