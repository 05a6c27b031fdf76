// SPDX-License-Identifier: Apache-2.0
#include "calibrate/stated_dip.h"

#include <cmath>
#include <string>

#include "base/messages.h"
#include "noise/joint_test.h"
#include "problem/graph_builder.h"
#include "solve/chain_elimination.h"
#include "solve/field_side.h"
#include "solve/shared_information.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

// With the noise that a contradiction has made: less than this of what is known cannot hide one.
constexpr double kSuspectSigmas = 1.5;

// What a stated dip may pull the result by, σ of what the readings say.
constexpr double kPulledSigmas = 3.0;

double VarianceAt(int index, const PoseGraph& graph, const SharedInformation& known) {
  const Eigen::RowVectorXd row = graph.layout.basis.row(index);
  return row * known.covariance() * row.transpose();
}

SharedInformation KnownOf(const PoseGraph& graph) {
  const ChainElimination linearised = Linearised(graph);
  return {graph.layout, graph.shared, linearised.information(), linearised.gradient()};
}

// Where a σ lets the dip give way, it does before anything else.
bool IsSuspect(const Knowledge& dip, int dip_at, const PoseGraph& solved) {
  if (!(dip.sigma > 0.0)) return true;
  const double left = VarianceAt(dip_at, solved, KnownOf(solved)) / (dip.sigma * dip.sigma);
  const double off = (solved.shared[dip_at] - *dip.value) / dip.sigma;
  return off * off > kSuspectSigmas * kSuspectSigmas * (1.0 - left);
}

}  // namespace

std::optional<Finding> FindContradictedDip(const CalibrateOptions& options,
                                           const NoiseState& noise,
                                           const PoseGraph& solved) {
  const Knowledge& dip = options.reference.dip_rad;
  const int dip_at = solved.layout.reference + kDip;
  if (!dip.known() || !solved.layout.Has(Triad::kAccelerometer) ||
      !solved.layout.Has(Triad::kMagnetometer) || !IsSuspect(dip, dip_at, solved)) {
    return std::nullopt;
  }
  CalibrateOptions unknown = options;
  unknown.reference.dip_rad = {};
  PoseGraph freed = WithTermsOf(unknown, solved);
  const int freed_at = freed.layout.reference + kDip;
  if (!freed.layout.IsFree(freed_at)) return std::nullopt;
  NoiseState found = noise;
  SolveLog log;
  Findings of_noise;
  SettleNoise(options.robust, &found, &freed, &log, &of_noise);
  const SharedInformation known = KnownOf(freed);
  if (!log.converged || known.rank() < known.size()) return std::nullopt;
  const double variance = VarianceAt(freed_at, freed, known);
  const double off_rad = freed.shared[freed_at] - *dip.value;
  const double chi2 = off_rad * off_rad / (variance + dip.sigma * dip.sigma);
  if (!(chi2 > FarInChi2(NoiseDof(found.estimate, freed)))) return std::nullopt;
  // A σ that readings outweigh has spoilt nothing; that it is contradicted is said (stated.cc).
  const double pulled_rad = freed.shared[freed_at] - solved.shared[dip_at];
  if (pulled_rad * pulled_rad < kPulledSigmas * kPulledSigmas * variance) return std::nullopt;
  return Finding(
             FindingCode::kStatedOtherwise,
             Format("the dip was stated as %.6g", *dip.value / kRadPerDeg) +
                 (dip.sigma > 0.0 ? Format(" ± %.2g", dip.sigma / kRadPerDeg) : "") +
                 Format(" deg, but the readings say %.6g", freed.shared[freed_at] / kRadPerDeg) +
                 Format(" ± %.2g deg", std::sqrt(variance) / kRadPerDeg),
             "leave `dip_deg` out, or state how well it is known (`{ value, sigma }`): iron "
             "nearby changes what a map says")
      .As(Severity::kRefusal)
      .About(Triad::kMagnetometer)
      .With("dip", freed.shared[freed_at] / kRadPerDeg, "deg")
      .With("sigmas", std::sqrt(chi2));
}

}  // namespace truetriad
