// SPDX-License-Identifier: Apache-2.0
//
// The 95 % intervals of an Allan analysis hold the truth in 95 % of many logs.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <ostream>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "data/memory_source.h"
#include "math/random.h"
#include "truetriad/allan/allan.h"

namespace truetriad {
namespace allan_montecarlo_test {

struct Regime {
  const char* name;
  int samples;
  double white_density;  // raw unit / sqrt(Hz)
  double random_walk;    // raw unit / s / sqrt(Hz)
  // What is no noise but there.
  double ramp_per_s = 0.0;  // raw unit
  double sine = 0.0;        // Amplitude of a cycle of 60 s, raw unit.
  double corner_hz = 0.0;   // Of a first-order filter of the white noise; 0: none.
  int held = 1;             // Samples that each reading lasts.

  /// Then the white noise is what is asked for; the others may look like a walk.
  bool is_noise_alone() const {
    return ramp_per_s == 0.0 && sine == 0.0 && corner_hz == 0.0 && held == 1;
  }
};

std::ostream& operator<<(std::ostream& out, const Regime& regime) { return out << regime.name; }

constexpr double kRateHz = 100.0;

/// How often a coefficient was shown, and its interval held the truth.
struct Coverage {
  int shown = 0, held = 0;
  void Count(const std::optional<Interval>& interval, double truth) {
    if (!interval) return;
    ++shown;
    held += interval->low <= truth && truth <= interval->high ? 1 : 0;
  }
};

class AllanIntervals : public ::testing::TestWithParam<Regime> {
 protected:
  /// Logs of three axes with noise drawn as a simulator draws it: white noise of N sqrt(rate) a
  /// sample, and a bias that steps by K / sqrt(rate).
  void Run(int logs) {
    const Regime& regime = GetParam();
    for (int log = 0; log < logs; ++log) {
      Random random(5000 + static_cast<std::uint64_t>(log));
      MemoryStream stream(Triad::kGyroscope);
      Eigen::Vector3d bias(30000.0, 0.0, -5.0);
      Eigen::Vector3d white = Eigen::Vector3d::Zero();
      const double sigma = regime.white_density * std::sqrt(kRateHz / regime.held);
      const double gain = regime.corner_hz > 0.0
                              ? 1.0 - std::exp(-2.0 * std::numbers::pi * regime.corner_hz / kRateHz)
                              : 1.0;
      constexpr int kSettling = 1000;
      for (int i = -kSettling; i < regime.samples; ++i) {
        if (i % regime.held == 0) white += gain * (sigma * random.Normal3() - white);
        if (i < 0) continue;
        const double time_s = i / kRateHz;
        const double other = regime.ramp_per_s * time_s +
                             regime.sine * std::sin(2.0 * std::numbers::pi * time_s / 60.0);
        stream.Add(i * std::int64_t{10'000'000}, bias + white + Eigen::Vector3d::Constant(other));
        bias += regime.random_walk / std::sqrt(kRateHz) * random.Normal3();
      }
      MemorySource source({std::move(stream)});
      const auto result = AnalyseAllan(source);
      ASSERT_TRUE(result) << result.error().message;
      for (const AllanAxis& axis : result->triads[0].axes) {
        white_.Count(axis.white_density, regime.white_density);
        walk_.Count(axis.random_walk, regime.random_walk);
        quantisation_ += axis.quantisation ? 1 : 0;
      }
    }
    axes_ = 3 * logs;
    RecordProperty("white_held", white_.held);
    RecordProperty("walk_shown", walk_.shown);
    RecordProperty("walk_held", walk_.held);
  }

  /// Whether a share of 95 % is within 3.3 binomial sigmas, or 93…97 % when that is wider.
  static void ExpectHeld(const Coverage& coverage, const char* what) {
    const double share = static_cast<double>(coverage.held) / coverage.shown;
    const double sigma = std::sqrt(0.95 * 0.05 / coverage.shown);
    const double allowed = std::max(0.02, 3.3 * sigma);
    EXPECT_NEAR(share, 0.95, allowed) << what << ": " << coverage.held << " of " << coverage.shown;
  }

  void Judge() {
    const Regime& regime = GetParam();
    if (!regime.is_noise_alone()) {
      EXPECT_EQ(white_.shown, axes_);
      EXPECT_GE(white_.held, 9 * white_.shown / 10);
      return;
    }
    if (regime.white_density > 0.0) {
      EXPECT_EQ(white_.shown, axes_);
      ExpectHeld(white_, "N");
    }
    if (regime.random_walk > 0.0) {
      // A walk that hides in the white noise of a short log need not be seen each time, or may be
      // taken for a drift.
      EXPECT_GE(walk_.shown, 8 * axes_ / 10);
      ExpectHeld(walk_, "K");
    } else {
      EXPECT_LE(walk_.shown, axes_ / 100);
    }
    EXPECT_LE(quantisation_, axes_ / 100);
  }

  Coverage white_, walk_;
  int quantisation_ = 0, axes_ = 0;
};

TEST_P(AllanIntervals, HoldTheTruthAsOftenAsTheySay) {
  Run(100);
  Judge();
}

TEST_P(AllanIntervals, NightlyHoldTheTruthAsOftenAsTheySay) {
  if (std::getenv("TRUETRIAD_NIGHTLY") == nullptr) GTEST_SKIP() << "runs at night";
  Run(1000);
  Judge();
}

INSTANTIATE_TEST_SUITE_P(Each,
                         AllanIntervals,
                         ::testing::Values(Regime{"White", 20000, 1.0, 0.0},
                                           Regime{"WhiteAndWalk", 20000, 1.0, 0.3},
                                           Regime{"WhiteAndStrongWalk", 20000, 1.0, 10.0},
                                           Regime{"WalkAlone", 20000, 0.0, 1.0},
                                           Regime{"Ramp", 20000, 1.0, 0.0, 1.0},
                                           Regime{"SlightRamp", 20000, 1.0, 0.0, 0.2},
                                           Regime{"SlowSine", 20000, 1.0, 0.0, 0.0, 10.0},
                                           Regime{"Filter10Hz", 20000, 1.0, 0.0, 0.0, 0.0, 10.0},
                                           Regime{"Filter2Hz", 20000, 1.0, 0.0, 0.0, 0.0, 2.0},
                                           Regime{"Held", 20000, 1.0, 0.0, 0.0, 0.0, 0.0, 4}),
                         [](const auto& regime) { return std::string(regime.param.name); });

}  // namespace allan_montecarlo_test
}  // namespace truetriad
