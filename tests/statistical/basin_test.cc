// SPDX-License-Identifier: Apache-2.0
//
// Global convergence from our own start, none being given: axes permuted and mirrored, offsets to
// five times the signal, gains 0.2 to 5, cross-axis to 15 % of the row's gain.

#include <algorithm>
#include <cstdio>

#include <gtest/gtest.h>

#include "noise/variance_components.h"
#include "problem/graph_builder.h"
#include "problem/start_values.h"
#include "solve/solve_graph.h"
#include "support/accel_mag_trials.h"
#include "support/nightly.h"

namespace truetriad {
namespace basin_test {

// The lowest cost near the truth: the same problem, started there.
double CostFromTruth(const SyntheticUnit& unit,
                     const PoseSet& poses,
                     const CalibrateOptions& options) {
  StartValues truth;
  truth.models = unit.models;
  truth.reference << unit.gravity_mps2, unit.field_ut, unit.dip_rad, 0.0;
  PerTriad<NoiseSource> sources;
  sources.items.fill(NoiseSource::kStatic);
  PoseGraph graph;
  graph.nodes = *BuildNodes(poses, options, sources);
  LayOutParameters(options, truth, &graph);
  ApplyExcess(ExcessVariance{}, &graph);
  return SolveGraph(&graph).final_cost;
}

struct Basin {
  int reached = 0;
  int elsewhere = 0;  // a cost above that from the truth
  int refused = 0;    // the poses do not determine every parameter well enough
};

Basin SearchBasin(int poses_each, int runs, std::uint64_t seed) {
  trials::UnitSpread spread;
  spread.gain_low = 0.2;
  spread.gain_high = 5.0;
  spread.cross_axis = 0.15;
  spread.offset = 5.0;
  spread.permute_magnetometer = true;
  Basin basin;
  for (int run = 0; run < runs; ++run) {
    Random random(seed + static_cast<std::uint64_t>(run));
    const SyntheticUnit unit = trials::RandomUnit(spread, &random);
    const PoseSet poses =
        SimulatePoses(unit, RandomAttitudes(poses_each, &random), trials::ModelNoise(), &random);
    CalibrateOptions options = trials::JointOptions(unit);
    for (TriadOptions& triad : options.triads) triad.excess = ExcessNoise::kNone;
    options.robust.enabled = false;
    const auto summary = Calibrate(poses, options);
    if (!summary || !summary->calibration.IsUsable()) {
      ++basin.refused;
      continue;
    }
    // Two minima found to 1e-13 of their cost agree much better than to 1e-6.
    if (summary->final_cost <= CostFromTruth(unit, poses, options) * (1.0 + 1e-6)) {
      ++basin.reached;
    } else {
      ++basin.elsewhere;
      std::printf("%d poses, seed %llu: cost %g\n",
                  poses_each,
                  static_cast<unsigned long long>(seed) + static_cast<unsigned>(run),
                  summary->final_cost);
    }
  }
  std::printf("@basin | %d | %d | %d | %d | %d |\n",
              poses_each,
              runs,
              basin.reached,
              basin.elsewhere,
              basin.refused);
  return basin;
}

TEST(Basin, HoldsEveryProblemOfTwentyFourPoses) {
  const int runs = IsNightly() ? 10'000 : 500;
  EXPECT_EQ(SearchBasin(24, runs, 100'000).reached, runs);
}

// Reported, not promised: random attitudes so few may leave a second minimum, or a parameter that
// they do not determine.
TEST(Basin, IsReportedForFewPoses) {
  const int runs = IsNightly() ? 10'000 : 200;
  for (const int poses : {12, 10}) {
    const Basin basin = SearchBasin(poses, runs, 200'000);
    EXPECT_EQ(basin.reached + basin.elsewhere + basin.refused, runs);
  }
}

}  // namespace basin_test
}  // namespace truetriad
