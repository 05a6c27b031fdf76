// SPDX-License-Identifier: Apache-2.0
#include "data/clock_lags.h"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace truetriad {
namespace clock_lags_test {

constexpr double kRateHz = 50.0;

// Rests of the given lengths with turns of 1.2 s in between: the readings of a triad that turns
// from one random direction to the next, or by a quarter turn each time, `late_s` late.
class TurnedTriad {
 public:
  TurnedTriad(
      Triad triad, const std::vector<double>& rests_s, bool quarters, double late_s, double noise)
      : triad_(triad) {
    std::mt19937 random(static_cast<std::uint32_t>(triad));
    std::normal_distribution<double> normal;
    std::mt19937 turns(1);
    int turn = 0;
    const auto direction = [&]() -> Eigen::Vector3d {
      const double angle = 0.5 * std::numbers::pi * turn++;
      if (quarters) return {std::cos(angle), std::sin(angle), 0.0};
      return Eigen::Vector3d(normal(turns), normal(turns), normal(turns)).normalized();
    };
    Eigen::Vector3d from = direction();
    double time_s = 0.0;
    for (const double rest_s : rests_s) {
      const Eigen::Vector3d to = direction();
      const double end_s = time_s + rest_s + 1.2;
      for (; time_s < end_s; time_s += 1.0 / kRateHz) {
        const double share = std::max(0.0, 1.0 - (end_s - time_s) / 1.2);
        const double turned = share * share * (3.0 - 2.0 * share);
        const Eigen::Vector3d reading =
            (1.0 - turned) * from + turned * to +
            noise * Eigen::Vector3d(normal(random), normal(random), normal(random));
        time_ns_.push_back(std::llround(1e9 * (time_s + late_s)));
        x_.push_back(reading[0]), y_.push_back(reading[1]), z_.push_back(reading[2]);
      }
      from = to;
    }
  }
  SampleBlock Block() const { return {triad_, time_ns_, x_, y_, z_, {}, {}, {}}; }

 private:
  Triad triad_;
  std::vector<std::int64_t> time_ns_;
  std::vector<double> x_, y_, z_;
};

std::optional<double> LagFound(const std::vector<double>& rests_s,
                               double late_s,
                               bool quarters = false) {
  ClockLagFinder finder;
  finder.Add(TurnedTriad(Triad::kAccelerometer, rests_s, quarters, 0.0, 0.001).Block());
  finder.Add(TurnedTriad(Triad::kMagnetometer, rests_s, quarters, late_s, 0.01).Block());
  return finder.LagOf(Triad::kMagnetometer, Triad::kAccelerometer);
}

std::vector<double> UnevenRests() {
  std::vector<double> rests_s;
  for (int k = 0; k < 20; ++k) rests_s.push_back(3.0 + 0.13 * ((7 * k) % 20));
  return rests_s;
}

TEST(ClockLagFinder, FindsByHowMuchATriadIsLateOrEarly) {
  for (const double late_s : {-5.0, -1.0, -0.4, 0.0, 0.6, 2.0, 5.9}) {
    const std::optional<double> found = LagFound(UnevenRests(), late_s);
    ASSERT_TRUE(found) << late_s;
    EXPECT_NEAR(*found, late_s, 0.05) << late_s;  // half a slot
  }
}

// A rate is largest midway, where it changes least: it is not its change that goes with the
// field's.
TEST(ClockLagFinder, TakesARateForWhatTheFieldChangesBy) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<std::int64_t> time_ns;
  std::vector<double> rate, field_x, field_y, zero;
  double angle = 0.0, time_s = 0.0;
  for (const double rest_s : UnevenRests()) {
    for (const double end_s = time_s + rest_s + 3.0; time_s < end_s; time_s += 0.125) {
      const double share = std::max(0.0, 1.0 - (end_s - time_s) / 3.0);
      rate.push_back(3.0 * share * (1.0 - share) + 0.1 + 0.002 * normal(random));
      angle += 3.0 * share * (1.0 - share) * 0.125;
      time_ns.push_back(std::llround(1e9 * time_s));
      field_x.push_back(50.0 * std::cos(angle) + 0.3 * normal(random));
      field_y.push_back(50.0 * std::sin(angle) + 0.3 * normal(random));
      zero.push_back(0.0);
    }
  }
  ClockLagFinder finder;
  finder.Add({Triad::kGyroscope, time_ns, zero, zero, rate, {}, {}, {}});
  finder.Add({Triad::kMagnetometer, time_ns, field_x, field_y, zero, {}, {}, {}});
  const std::optional<double> found = finder.LagOf(Triad::kMagnetometer, Triad::kGyroscope);
  ASSERT_TRUE(found);
  EXPECT_NEAR(*found, 0.0, 0.125);
}

TEST(ClockLagFinder, SaysNothingWhereEvenTurnsFitAtSeveralLags) {
  // A turn every 4.2 s: the lag and the lag less 4.2 s look the same.
  EXPECT_FALSE(LagFound(std::vector<double>(40, 3.0), 1.0, true));
}

// A turn every 4 s, of which one triad was read in the first three of four, the other in the last
// three: 4 s later they meet more often, and fit no better. With few turns they hardly meet at all.
TEST(ClockLagFinder, MeetingMoreOftenIsNoReasonForALag) {
  for (const int turns : {12, 13, 14, 45, 50, 55, 60, 65, 70}) {
    ClockLagFinder finder;
    for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
      const TurnedTriad turned(triad, std::vector<double>(turns, 2.8), true, 0.0, 0.01);
      const SampleBlock all = turned.Block();
      const std::int64_t first = triad == Triad::kMagnetometer ? 1 : 0;
      for (std::size_t i = 0; i < all.x.size(); ++i) {
        const std::int64_t of_four = all.time_ns[i] / 4'000'000'000 % 4 - first;
        if (of_four < 0 || of_four > 2) continue;
        const auto one = [i](auto values) { return values.subspan(i, 1); };
        finder.Add({triad, one(all.time_ns), one(all.x), one(all.y), one(all.z), {}, {}, {}});
      }
    }
    EXPECT_FALSE(finder.LagOf(Triad::kMagnetometer, Triad::kAccelerometer)) << turns;
  }
}

TEST(ClockLagFinder, SaysNothingWhereNothingMoves) { EXPECT_FALSE(LagFound({100.0}, 0.0)); }

}  // namespace clock_lags_test
}  // namespace truetriad
