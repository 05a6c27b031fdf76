// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/messages.h"
#include "math/distributions.h"
#include "verdict/checks/check.h"

namespace truetriad {
namespace {

// Fewer rows do not determine a correlation: its σ would exceed 1 / sqrt(30) = 0.18.
constexpr std::size_t kFewestRows = 30;
// If the median step between adjacent rows is below this share of the median step between any two
// rows, either attitudes are sorted, or the unit turned during the log.
constexpr double kSmoothShare = 0.35;
// Errors of consecutive rests are independent. If their correlation exceeds this and also
// kCorrelatedSigmas times its σ by chance, 1 / sqrt(rows), it is due to accelerations by hand,
// lever arms and turns.
constexpr double kCorrelated = 0.3;
// Normal noise exceeds this many σ in one of 3.5 million tables.
constexpr double kCorrelatedSigmas = 5.0;
// Errors are clamped to this many σ, so that outliers do not dominate.
constexpr double kMostSigmas = 3.0;

// The accelerometer's corrected readings in the order of rows, m/s^2, and their length errors.
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
    // The second row of a pair is half the table away, plus an offset that fits no regular order.
    any.push_back((force[i] - force[(i + half + 37 * (i % 11)) % force.size()]).norm());
  }
  return Median(std::move(next)) < kSmoothShare * Median(std::move(any));
}

// Correlation of the errors of adjacent rows, each clamped to kMostSigmas.
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
                  "the table has no times, so each row is taken for a rest; but the errors of "
                  "successive rows are correlated" +
                      Format(" (correlation %.2f", correlation) +
                      Format("; for independent rows 0 ± %.2f)", sigma) +
                      ", as in a log of a moving unit",
                  "add `time[s]`, or state the rate in a manifest; if each row is indeed "
                  "a rest, state `poses: every_row`")
              .About(Triad::kAccelerometer)
              .With("correlation", correlation)
              .With("rows", static_cast<double>(rows.off.size()))};
}

}  // namespace truetriad
