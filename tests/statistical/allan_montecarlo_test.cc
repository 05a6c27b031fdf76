// SPDX-License-Identifier: Apache-2.0
//
// The 95 % intervals of an Allan analysis hold the truth in 95 % of many logs.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <ostream>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "data/memory_source.h"
#include "truetriad/data/allan.h"
#include "truetriad/math/random.h"

namespace truetriad {
namespace {

struct Regime {
  const char* name;
  int samples;
  double white_density;  // raw unit / sqrt(Hz)
  double random_walk;    // raw unit / s / sqrt(Hz)
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
      for (int i = 0; i < regime.samples; ++i) {
        stream.Add(i * std::int64_t{10'000'000},
                   bias + regime.white_density * std::sqrt(kRateHz) * random.Normal3());
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
    if (regime.white_density > 0.0) {
      EXPECT_EQ(white_.shown, axes_);
      ExpectHeld(white_, "N");
    }
    if (regime.random_walk > 0.0) {
      // A walk that hides in the white noise of a short log need not be seen each time.
      EXPECT_GE(walk_.shown, 9 * axes_ / 10);
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
                                           Regime{"WalkAlone", 20000, 0.0, 1.0}),
                         [](const auto& regime) { return std::string(regime.param.name); });

}  // namespace
}  // namespace truetriad
