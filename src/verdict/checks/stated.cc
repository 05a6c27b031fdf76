// SPDX-License-Identifier: Apache-2.0
//
// Checks stated values against the readings.
#include <cmath>
#include <limits>
#include <string>

#include "base/messages.h"
#include "base/sensor_line.h"
#include "math/distributions.h"
#include "problem/parameters.h"
#include "solve/field_side.h"
#include "verdict/checks/check.h"

namespace truetriad {

Findings CheckStatedNoise(const SettledRun&, const SolvedRun& solved) {
  // Probability that a correctly stated noise is doubted.
  constexpr double kByChance = 1e-4;
  // Noise above the stated one by a smaller factor hardly matters, however significant it is.
  constexpr double kMuchMore = 1.2;
  const Quality& quality = solved.stated.quality;
  if (!(quality.dof >= 1.0) || !(quality.reduced_chi2 > kMuchMore * kMuchMore)) return {};
  const double chi2 = quality.reduced_chi2 * quality.dof;
  if (!(1.0 - ChiSquareCdf(chi2, quality.dof) < kByChance)) return {};
  const double times = std::sqrt(quality.reduced_chi2);
  return {Finding(FindingCode::kNoiseUnderstated,
                  Format("the readings scatter by %.2g times the stated noise, and σ do not allow "
                         "for it",
                         times),
                  "have the excess estimated, as by " +
                      SensorLine(Triad::kAccelerometer, "noise: { excess: estimate }") +
                      ", or state the actual noise")
              .With("times", times)};
}

Findings CheckStatedValues(const SettledRun& run, const SolvedRun& solved) {
  // If readings reduce a prior's variance by less than this share, they cannot contradict it.
  constexpr double kLeastTold = 1e-6;
  const PoseGraph& graph = run.graph;
  const double dof = solved.stated.quality.effective_dof;
  double furthest = FarInChi2(dof > 0.0 ? dof : std::numeric_limits<double>::infinity());
  const ScalarPrior* worst = nullptr;
  double told_share = 0.0;  // share of the prior's variance that readings remove
  for (const ScalarPrior& prior : graph.priors) {
    const Eigen::RowVectorXd row = graph.layout.basis.row(prior.index);
    const double left = row * solved.system.covariance() * row.transpose();
    const double told = 1.0 - left / (prior.sigma * prior.sigma);
    if (!(told > kLeastTold)) continue;
    const double off = (graph.shared[prior.index] - prior.mean) / prior.sigma;
    if (!(off * off / told > furthest)) continue;
    furthest = off * off / told;
    told_share = told;
    worst = &prior;
  }
  if (worst == nullptr) return {};
  // The estimate by the readings alone.
  const double value = worst->mean + (graph.shared[worst->index] - worst->mean) / told_share;
  const double sigma = worst->sigma * std::sqrt((1.0 - told_share) / told_share);
  const std::string name = ParameterNames(graph.layout)[static_cast<std::size_t>(worst->index)];
  return {Finding(FindingCode::kStatedOtherwise,
                  name + Format(" was stated as %.6g", worst->mean) +
                      Format(" ± %.2g, but the readings give ", worst->sigma) +
                      Format("%.6g", value) + Format(" ± %.2g", sigma) +
                      Format(", %.3g σ away; the result is a weighted mean of both",
                             std::sqrt(furthest)),
                  "correct the stated value, or state a larger σ")
              .With("sigmas", std::sqrt(furthest))};
}

}  // namespace truetriad
