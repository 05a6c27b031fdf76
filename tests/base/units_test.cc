// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "truetriad/base/triad.h"

namespace truetriad {
namespace units_test {

using ::testing::HasSubstr;

double TruthPerRaw(Triad triad, std::string_view name) {
  const Result<Unit> unit = ParseTriadUnit(triad, name);
  EXPECT_TRUE(unit) << name;
  return unit ? unit->truth_per_raw : 0.0;
}

TEST(Units, KnowTheSizeOfEachUnitInTruth) {
  EXPECT_EQ(TruthPerRaw(Triad::kAccelerometer, "m/s^2"), 1.0);
  EXPECT_EQ(TruthPerRaw(Triad::kAccelerometer, "g"), 9.80665);
  EXPECT_EQ(TruthPerRaw(Triad::kAccelerometer, "mg"), 9.80665e-3);
  EXPECT_EQ(TruthPerRaw(Triad::kGyroscope, "rad/s"), 1.0);
  EXPECT_EQ(TruthPerRaw(Triad::kGyroscope, "deg/s"), std::numbers::pi / 180.0);
  EXPECT_EQ(TruthPerRaw(Triad::kMagnetometer, "uT"), 1.0);
  EXPECT_EQ(TruthPerRaw(Triad::kMagnetometer, "nT"), 1e-3);
  EXPECT_EQ(TruthPerRaw(Triad::kMagnetometer, "mT"), 1e3);
  EXPECT_EQ(TruthPerRaw(Triad::kMagnetometer, "T"), 1e6);
  EXPECT_EQ(TruthPerRaw(Triad::kMagnetometer, "G"), 100.0);
  EXPECT_EQ(TruthPerRaw(Triad::kMagnetometer, "mG"), 0.1);
}

TEST(Units, TakeCountsForEveryTriad) {
  for (const Triad triad : kTriads) {
    const Result<Unit> unit = ParseTriadUnit(triad, "counts");
    ASSERT_TRUE(unit);
    EXPECT_TRUE(unit->is_counts);
  }
}

TEST(Units, RefuseTheUnitOfAnotherQuantityAndListTheirOwn) {
  const Result<Unit> unit = ParseTriadUnit(Triad::kGyroscope, "m/s^2");
  ASSERT_FALSE(unit);
  EXPECT_EQ(unit.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(unit.error().message, HasSubstr("`m/s^2` is not a unit of the gyroscope"));
  EXPECT_THAT(unit.error().message, HasSubstr("rad/s, deg/s, counts"));
}

TEST(Units, DoNotGuess) {
  EXPECT_FALSE(ParseTriadUnit(Triad::kMagnetometer, "UT"));
  EXPECT_FALSE(ParseTriadUnit(Triad::kAccelerometer, "m/s"));
  EXPECT_FALSE(ParseTriadUnit(Triad::kAccelerometer, "dps"));
  EXPECT_FALSE(ParseTriadUnit(Triad::kAccelerometer, ""));
}

TEST(Units, KnowTimeAndTemperature) {
  EXPECT_EQ(NanosecondsPer("s"), 1e9);
  EXPECT_EQ(NanosecondsPer("ms"), 1e6);
  EXPECT_EQ(NanosecondsPer("us"), 1e3);
  EXPECT_EQ(NanosecondsPer("ns"), 1.0);
  EXPECT_FALSE(NanosecondsPer("min"));
  EXPECT_EQ(ParseTemperatureUnit("K")->offset, -273.15);
  EXPECT_EQ(ParseTemperatureUnit("degC")->offset, 0.0);
  EXPECT_FALSE(ParseTemperatureUnit("degF"));
}

TEST(Result, PassesErrorsOn) {
  const auto fails = []() -> Result<int> { return Error(ErrorCode::kInvalidValue, "broken"); };
  const auto caller = [&]() -> Status {
    TRUETRIAD_RETURN_IF_ERROR(fails());
    return {};
  };
  EXPECT_EQ(caller().error().message, "broken");
}

}  // namespace units_test
}  // namespace truetriad
