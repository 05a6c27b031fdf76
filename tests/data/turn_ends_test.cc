// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/known_motions.h"
#include "math/random.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace turn_ends_test {

using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr double kSpacingS = 0.01;
constexpr double kRampS = 0.5, kHeldS = 8.0, kRestS = 0.5;
constexpr double kSigmaDeg = 0.3;

// Of a table that turns at `rate`, after so long from the beginning of the turn.
double RateAt(double rate, double time_s) {
  const double from_end_s = std::min(time_s, 2.0 * kRampS + kHeldS - time_s);
  if (from_end_s <= 0.0) return 0.0;
  if (from_end_s >= kRampS) return rate;
  return 0.5 * rate * (1.0 - std::cos(std::numbers::pi * from_end_s / kRampS));
}

// Turns to and fro about each axis, in deg/s, whose rows begin and end `early_s` and `late_s`
// within the motion (below zero: at rest), with a bias that drifts by `drift` from turn to turn.
PoseSet Turns(double early_s, double late_s, double drift = 0.0, double noise = 0.05) {
  Random random(3);
  PoseSet set;
  for (int i = 0; i < 18; ++i) {
    const double rate = (i % 2 == 0 ? 1.0 : -1.0) * (i % 6 < 2 ? 30.0 : i % 6 < 4 ? 90.0 : 180.0);
    KnownTurn& turn = set.turns.emplace_back();
    turn.stated.at.rows = {1000 * i, 1000 * i + 900};
    turn.stated.angle_rad = rate * (kHeldS + kRampS) * kRadPerDeg;
    turn.stated.sigma_rad = kSigmaDeg * kRadPerDeg;
    for (double time_s = early_s; time_s < 2.0 * kRampS + kHeldS - late_s; time_s += kSpacingS) {
      turn.move.time_ns.push_back(static_cast<std::int64_t>(1e9 * (20.0 * i + time_s)));
      Eigen::Vector3d reading = Eigen::Vector3d::Constant(2.0 + drift * i);
      reading[i / 6] += RateAt(rate, time_s);
      reading += noise * random.Normal3();
      turn.move.gyroscope_raw.push_back(reading);
    }
  }
  return set;
}

int CutOf(PoseSet set) {
  RejectCutTurns(&set);
  int cut = 0;
  for (const KnownTurn& turn : set.turns) cut += turn.move.fault ? 1 : 0;
  EXPECT_THAT(set.findings, SizeIs(cut > 0 ? 1 : 0));
  return cut;
}

TEST(CutTurns, AreThoseThatLackHalfASigma) {
  EXPECT_EQ(CutOf(Turns(-kRestS, -kRestS)), 0);
  EXPECT_EQ(CutOf(Turns(0.0, 0.0)), 0);
  // Lacks 0.0065 of the ramp's angle: 0.02, 0.06 and 0.12 of 0.3 degrees.
  EXPECT_EQ(CutOf(Turns(0.06, 0.06)), 0);
  for (const double cut_s : {0.2, 0.3, 0.5, 1.0}) {
    EXPECT_EQ(CutOf(Turns(cut_s, cut_s)), 18) << cut_s;
    EXPECT_EQ(CutOf(Turns(cut_s, -kRestS)), 18) << cut_s;
    EXPECT_EQ(CutOf(Turns(-kRestS, cut_s)), 18) << cut_s;
  }
}

TEST(CutTurns, AreNoneWhereTheBiasDriftsOrNoiseIsLarge) {
  EXPECT_EQ(CutOf(Turns(-kRestS, -kRestS, 0.05)), 0);
  EXPECT_EQ(CutOf(Turns(-kRestS, -kRestS, 0.0, 1.0)), 0);
}

TEST(CutTurns, SayHowMuchIsOutsideAndOnWhichSide) {
  PoseSet set = Turns(-kRestS, 0.5);
  RejectCutTurns(&set);
  ASSERT_TRUE(set.turns[4].move.fault);
  EXPECT_THAT(set.turns[4].move.fault->text, HasSubstr("it ends while the unit still turns"));
  // 180 deg/s on a ramp of half a second: a quarter of it would be 45 degrees, of which this is
  // all.
  EXPECT_NEAR(*set.turns[4].move.fault->Value("missing"), 45.0, 3.0);
}

}  // namespace turn_ends_test
}  // namespace truetriad
