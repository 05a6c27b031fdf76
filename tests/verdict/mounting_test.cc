// SPDX-License-Identifier: Apache-2.0
//
// Sensors whose axes are not where they are said to be.

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/finding_matchers.h"
#include "support/synthetic_poses.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace mounting_test {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr Triad kAccel = Triad::kAccelerometer, kGyro = Triad::kGyroscope,
                kMag = Triad::kMagnetometer;

// Maps of the sensors, "+x+y+z" where none is given.
using Maps = std::vector<std::pair<Triad, std::string>>;

Eigen::Matrix3d Map(const std::string& name) { return *AxisMapFromName(name); }

// A unit whose sensors are mounted like this: gains within 5 %, axes within 30 mrad.
SyntheticUnit UnitOf(const std::vector<Triad>& sensors, const Maps& maps) {
  SyntheticUnit unit;
  Eigen::Matrix3d S;
  S << 1.02, 0.0, 0.0, 0.01, 0.98, 0.0, -0.02, 0.03, 1.01;
  for (const Triad triad : sensors) {
    unit.models[triad] = TriadModel<double>{S, Eigen::Vector3d(0.1, -0.2, 0.05)};
    unit.units[triad] = {std::string(TruthUnitName(triad)), 1.0, false};
    if (triad == kGyro) unit.models[triad]->bias *= 0.1;
  }
  for (const auto& [triad, name] : maps) {
    unit.models[triad]->sensitivity = S * Map(name);
  }
  return unit;
}

// What an experiment says unless told otherwise.
CalibrateOptions OptionsFor(const SyntheticUnit& unit, const Maps& stated = {}) {
  CalibrateOptions options;
  options.reference.gravity_mps2 = {unit.gravity_mps2, 0.0};
  options.reference.field_ut = {unit.field_ut, 0.0};
  options.cross_validation_folds = 0;
  for (const Triad triad : kTriads) {
    TriadOptions& sensor = options.triads[triad];
    sensor.enabled = unit.models[triad].has_value();
    if (triad != kMag) sensor.mounting = Eigen::Matrix3d::Identity();
  }
  for (const auto& [triad, name] : stated) options.triads[triad].mounting = AxisMapFromName(name);
  return options;
}

Calibration CalibrationOf(const SyntheticUnit& unit, const CalibrateOptions& options) {
  Random random(7);
  const std::vector<Eigen::Quaterniond> attitudes = RandomAttitudes(30, &random);
  SyntheticNoise noise;
  noise.rest_sigma[kAccel] = 1e-3;
  noise.rest_sigma[kMag] = 0.02;
  noise.rest_sigma[kGyro] = 1e-5;
  PoseSet poses = SimulatePoses(unit, attitudes, noise, &random);
  if (unit.models[kGyro]) AddTurns(unit, attitudes, {}, nullptr, &poses);
  const auto summary = Calibrate(poses, options);
  EXPECT_TRUE(summary) << summary.error().message;
  return summary ? summary->calibration : Calibration();
}

Calibration CalibrationOf(const std::vector<Triad>& sensors,
                          const Maps& maps,
                          const Maps& stated = {}) {
  const SyntheticUnit unit = UnitOf(sensors, maps);
  return CalibrationOf(unit, OptionsFor(unit, stated));
}

const std::vector<Triad> kAll = {kAccel, kGyro, kMag};

// Scale and misalignment of the unit: the same however it is mounted.
void ExpectUnitAsBuilt(const TriadCalibration& sensor) {
  const Eigen::Vector3d gains(1.02, 0.98, 1.01);
  EXPECT_LT((sensor.Scale() - gains).cwiseAbs().maxCoeff(), 0.01) << sensor.Scale();
  // Up to 30 mrad of its own and as much between the frames of two gauges; 5 mrad for noise.
  EXPECT_LT(sensor.MisalignmentRad().cwiseAbs().maxCoeff(), 0.065);
}

TEST(Mounting, OfTheBodyItselfNeedsNoWord) {
  const Calibration found = CalibrationOf(kAll, {});
  EXPECT_TRUE(found.IsUsable());
  for (const FindingCode code : {FindingCode::kMountingFound, FindingCode::kLeftHanded}) {
    EXPECT_THAT(found.findings, Not(Contains(HasCode(code))));
  }
}

TEST(Mounting, AMirroredAccelerometerIsNamedAndNotTheOthers) {
  for (const std::string name : {"-x+y+z", "+x+y-z", "+y+x+z", "+x+z+y"}) {
    for (const std::vector<Triad>& sensors : {kAll, std::vector<Triad>{kAccel, kGyro}}) {
      const Calibration found = CalibrationOf(sensors, {{kAccel, name}});
      EXPECT_FALSE(found.IsUsable()) << name;
      EXPECT_THAT(found.findings,
                  Contains(AllOf(HasCode(FindingCode::kMountingContradicted),
                                 IsAbout(kAccel),
                                 Says(HasSubstr("`mounting: { accelerometer: " + name + " }`")))));
    }
  }
}

TEST(Mounting, AMirroredGyroscopeIsNamed) {
  for (const std::string name : {"-x+y+z", "+y+x+z", "-x-y-z"}) {
    EXPECT_THAT(CalibrationOf(kAll, {{kGyro, name}}).findings,
                Contains(AllOf(HasCode(FindingCode::kMountingContradicted),
                               IsAbout(kGyro),
                               Says(HasSubstr("`mounting: { gyroscope: " + name + " }`")))));
  }
}

TEST(Mounting, OfTwoSensorsOneOfWhichIsTurnedEitherMayBe) {
  const Calibration found = CalibrationOf(kAll, {{kAccel, "+y+z+x"}});
  const Finding* finding = Find(found.findings, FindingCode::kMountingContradicted);
  ASSERT_NE(finding, nullptr);
  EXPECT_FALSE(finding->sensor);
  EXPECT_THAT(finding->remedy,
              AllOf(HasSubstr("{ accelerometer: +y+z+x }"), HasSubstr("{ gyroscope: +z+x+y }")));
}

TEST(Mounting, AsStatedGivesTheUnitAsBuilt) {
  for (const AccelerometerSign sign :
       {AccelerometerSign::kSpecificForce, AccelerometerSign::kGravity}) {
    for (const std::string name : {"-x+y+z", "+y+z+x", "-z-x+y"}) {
      for (const Gauge gauge : {Gauge::kAccelX, Gauge::kAccelZ, Gauge::kSymmetric}) {
        const Maps maps = {{kAccel, name}, {kGyro, "+y+z+x"}, {kMag, "+y+x-z"}};
        SyntheticUnit unit = UnitOf(kAll, maps);
        CalibrateOptions options = OptionsFor(unit, maps);
        options.triads[kAccel].sign = sign;
        options.gauge = gauge;
        const bool is_gravity = sign == AccelerometerSign::kGravity;
        if (is_gravity) unit.models[kAccel]->sensitivity *= -1.0;
        const Calibration found = CalibrationOf(unit, options);
        ASSERT_TRUE(found.IsUsable()) << name << " " << GaugeName(gauge);
        EXPECT_EQ(found.sensors[kMag]->mounting, Map("+y+x-z"));
        TriadCalibration accelerometer = *found.sensors[kAccel];
        if (is_gravity) accelerometer.model.sensitivity *= -1.0;
        ExpectUnitAsBuilt(accelerometer);
        ExpectUnitAsBuilt(*found.sensors[kGyro]);
        ExpectUnitAsBuilt(*found.sensors[kMag]);
      }
    }
  }
}

TEST(Mounting, OfAMagnetometerIsFound) {
  const Calibration found = CalibrationOf(kAll, {{kMag, "+y+x-z"}});
  ASSERT_TRUE(found.IsUsable());
  EXPECT_THAT(found.findings,
              Contains(AllOf(HasCode(FindingCode::kMountingFound),
                             IsAbout(kMag),
                             Says(HasSubstr("`mounting: { magnetometer: +y+x-z }`")))));
  ExpectUnitAsBuilt(*found.sensors[kMag]);
}

TEST(Mounting, OfAMagnetometerMustBeStatedWhereItIsJudged) {
  const SyntheticUnit unit = UnitOf(kAll, {{kMag, "+y+x-z"}});
  CalibrateOptions options = OptionsFor(unit);
  options.limits.limits["magnetometer.misalignment_rad"] = Limit::Within(0.1);
  const Calibration found = CalibrationOf(unit, options);
  EXPECT_FALSE(found.IsUsable());
  EXPECT_THAT(found.findings,
              Contains(AllOf(HasCode(FindingCode::kMountingNotStated),
                             Says(HasSubstr("`mounting: { magnetometer: +y+x-z }`")))));
  options.triads[kMag].mounting = Map("+y+x-z");
  EXPECT_EQ(CalibrationOf(unit, options).within_limits, true);
  options.triads[kMag].mounting = Map("+x+y+z");
  EXPECT_THAT(CalibrationOf(unit, options).findings,
              Contains(AllOf(HasCode(FindingCode::kMountingContradicted), IsAbout(kMag))));
}

TEST(Mounting, OfOneSensorIsMirroredAndNobodyKnowsOfWhich) {
  // Without a gyroscope an accelerometer and a magnetometer only contradict each other.
  for (const Triad triad : {kAccel, kMag}) {
    const Calibration found = CalibrationOf({kAccel, kMag}, {{triad, "-x+y+z"}});
    EXPECT_TRUE(found.IsUsable());
    const Finding* finding = Find(found.findings, FindingCode::kLeftHanded);
    ASSERT_NE(finding, nullptr);
    EXPECT_FALSE(finding->sensor);
  }
  const Calibration found = CalibrationOf(kAll, {{kMag, "-x+y+z"}});
  EXPECT_THAT(found.findings, Contains(AllOf(HasCode(FindingCode::kLeftHanded), IsAbout(kMag))));
}

// Up is down in every attitude then, which a gyroscope does not see.
TEST(Mounting, OfAnAccelerometerWithTheWrongSignIsNotTakenForTheMagnetometers) {
  const SyntheticUnit unit = UnitOf(kAll, {{kAccel, "-x-y-z"}});
  CalibrateOptions options = OptionsFor(unit);
  // As likely the unit was south of the magnetic equator, where nobody says that it was not.
  const Calibration refused = CalibrationOf(unit, options);
  EXPECT_FALSE(refused.IsUsable());
  const Finding* guessed = Find(refused.findings, FindingCode::kLeftHanded);
  ASSERT_NE(guessed, nullptr);
  EXPECT_THAT(guessed->Message(), HasSubstr("hemisphere: south"));

  options.reference.is_hemisphere_stated = true;
  const Calibration found = CalibrationOf(unit, options);
  EXPECT_TRUE(found.IsUsable());
  const Finding* finding = Find(found.findings, FindingCode::kLeftHanded);
  ASSERT_NE(finding, nullptr);
  EXPECT_FALSE(finding->sensor);
  EXPECT_THAT(finding->Message(), HasSubstr("the accelerometer's `sign`"));

  options.limits.limits["accelerometer.bias"] = Limit::Within(1.0);
  const Calibration judged = CalibrationOf(unit, options);
  const Finding* refusal = Find(judged.findings, FindingCode::kMountingNotStated);
  ASSERT_NE(refusal, nullptr);
  EXPECT_FALSE(refusal->sensor);
}

TEST(Mounting, CommonToAllIsNotSeen) {
  EXPECT_TRUE(CalibrationOf({kAccel, kGyro}, {{kAccel, "+y+z+x"}, {kGyro, "+y+z+x"}}).IsUsable());
  EXPECT_TRUE(CalibrationOf({kAccel}, {{kAccel, "-x+y+z"}}).IsUsable());
}

}  // namespace mounting_test
}  // namespace truetriad
