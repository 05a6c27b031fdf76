// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/messages.h"
#include "math/distributions.h"
#include "verdict/checks/check.h"

namespace truetriad {
namespace {

// Of fewer rows nothing is told.
constexpr std::size_t kFewestRows = 30;
// Steps from row to row that are shorter than this share of those between any two: attitudes that
// somebody sorted, or a unit that turns.
constexpr double kSmoothShare = 0.35;
// Rests one after the other are off by themselves. A correlation that is so high, and so many σ
// from what chance makes of it (1 / sqrt(rows)), is that of hands, lever arms and turns.
constexpr double kCorrelated = 0.3;
// Chance makes as much once in two million tables.
constexpr double kCorrelatedSigmas = 5.0;
// What is further off than so many σ counts as so far.
constexpr double kMostSigmas = 3.0;

// The accelerometer's readings as rows follow each other, corrected, m/s^2, and what their lengths
// are off.
struct Rows {
  std::vector<Eigen::Vector3d> force;
  std::vector<double> off;
};

Rows RowsOf(const PoseGraph& graph) {
  const double gravity = WorldVector(Triad::kAccelerometer, graph.reference()).norm();
  Rows rows;
  for (const PoseNode& node : graph.nodes) {
    for (const Observation& seen : node.observations) {
      if (seen.triad != Triad::kAccelerometer || node.role != PoseRole::kRest) continue;
      const TriadModel<double> model = graph.ModelAt(Triad::kAccelerometer, node);
      rows.force.push_back(model.TruthFromRaw(seen.mean_raw));
      rows.off.push_back(rows.force.back().norm() - gravity);
    }
  }
  return rows;
}

bool AreSmooth(const std::vector<Eigen::Vector3d>& force) {
  std::vector<double> next, any;
  const std::size_t half = force.size() / 2;
  for (std::size_t i = 1; i < force.size(); ++i) {
    next.push_back((force[i] - force[i - 1]).norm());
    // Half of all rows apart, and a step that no pattern of the order is likely to have.
    any.push_back((force[i] - force[(i + half + 37 * (i % 11)) % force.size()]).norm());
  }
  return Median(std::move(next)) < kSmoothShare * Median(std::move(any));
}

// Of what rows are off with what the next is, both within their usual scatter.
double CorrelationOf(std::vector<double> off) {
  const double middle = Median(off);
  for (double& value : off) value -= middle;
  const double most = kMostSigmas * MadSigma(off);
  double squares = 0.0, products = 0.0;
  for (std::size_t i = 0; i < off.size(); ++i) {
    off[i] = std::clamp(off[i], -most, most);
    squares += off[i] * off[i];
    if (i > 0) products += off[i] * off[i - 1];
  }
  return squares > 0.0 ? products / squares : 0.0;
}

}  // namespace

Findings CheckRowsAreRests(const SettledRun& run, const SolvedRun&) {
  if (!run.poses.rows_may_be_a_log) return {};
  const Rows rows = RowsOf(run.graph);
  if (rows.off.size() < kFewestRows || !AreSmooth(rows.force)) return {};
  const double correlation = CorrelationOf(rows.off);
  const double sigma = 1.0 / std::sqrt(static_cast<double>(rows.off.size()));
  if (!(correlation > std::max(kCorrelated, kCorrelatedSigmas * sigma))) return {};
  return {Finding(FindingCode::kRowsFollowEachOther,
                  "the table has no times, so each row would be a rest; but what rows are off goes "
                  "on from row to row" +
                      Format(" (correlation %.2f", correlation) +
                      Format(", %.2f by chance)", sigma) + ", as in a log of a unit that moves",
                  "add `time[s]`, or state the rate in a manifest; if each row is a rest all the "
                  "same, state `poses: every_row`")
              .About(Triad::kAccelerometer)
              .With("correlation", correlation)
              .With("rows", static_cast<double>(rows.off.size()))};
}

}  // namespace truetriad
