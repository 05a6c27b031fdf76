// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include "base/messages.h"
#include "math/dense/cholesky.h"
#include "math/distributions.h"
#include "problem/graph_builder.h"
#include "problem/start_values.h"
#include "verdict/checks/check.h"

namespace truetriad {
namespace {

// With fewer degrees of freedom the σ of the noise has a relative σ of over 1 / sqrt(20) = 22 %.
constexpr double kFewDof = 10.0;
// A cap of this radius is half of the sphere: if it has no pose, poses are one-sided.
constexpr double kOneSidedGapDeg = 90.0;
// A log is not raw if its biases are nearer to zero than a raw log's would be with this
// probability.
constexpr double kByChance = 1e-9;

}  // namespace

Findings CheckDegreesOfFreedom(double dof, const char* remedy) {
  if (!(dof > 0.0) || dof >= kFewDof) return {};
  return {
      Finding(FindingCode::kFewDegreesOfFreedom,
              Format("only %.1f degrees of freedom support σ, ", dof) +
                  Format("so they are known only to about %.0f %%; confidence intervals allow for "
                         "it",
                         100.0 / std::sqrt(2.0 * dof)),
              remedy)
          .With("degrees_of_freedom", dof)};
}

Findings CheckDegreesOfFreedom(const SettledRun& run, const SolvedRun& solved) {
  if (run.noise.estimated.empty()) return {};
  return CheckDegreesOfFreedom(solved.stated.quality.effective_dof, "add poses");
}

// If a log was corrected by a calibration made from it, its biases b are zero. Σ bᵀ C⁻¹ b is then
// far below the χ² that noise alone causes in a sensor without bias.
Findings CheckNotCorrected(const SettledRun& run, const SolvedRun& solved) {
  const SharedLayout& layout = run.graph.layout;
  if (!run.options.check_units || solved.system.rank() < solved.system.size()) return {};
  const Eigen::MatrixXd& covariance = solved.system.covariance();
  double square = 0.0, dof = 0.0;
  for (const Triad triad : kTriads) {
    const StreamSummary* const stream = run.poses.Find(triad);
    // Computed poses, as of a plan, have no readings.
    if (!layout.Has(triad) || stream == nullptr || stream->minimum_raw == stream->maximum_raw) {
      continue;
    }
    const Eigen::MatrixXd rows = layout.basis.middleRows<3>(layout.bias[triad]);
    const Eigen::Matrix3d of_bias = rows * covariance * rows.transpose();
    if (!(of_bias.diagonal().minCoeff() > 0.0)) continue;
    const Eigen::Vector3d bias = run.graph.bias(triad);
    square += bias.dot(PivotedCholesky(of_bias).SolveVector(bias));
    dof += 3.0;
  }
  if (dof == 0.0 || ChiSquareCdf(square, dof) >= kByChance) return {};
  return {Finding(FindingCode::kNotRaw,
                  Format("all biases are zero to %.0e of their σ: ", std::sqrt(square / dof)) +
                      "the log was corrected by a calibration made from it",
                  "give the raw log; `units: trust` takes this one")
              .As(Severity::kRefusal)
              .With("sigmas", std::sqrt(square / dof))};
}

Findings CheckNoiseFree(const SettledRun& run, const SolvedRun& solved) {
  // Noise up to this factor times the assumed minimum (kLeastNoiseShare) counts as that minimum.
  constexpr double kHardlyMore = 2.0;
  Findings findings;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const auto& sensor = solved.stated.sensors[triad];
    const NoiseSource source = run.noise.source[triad];
    if (!sensor || (source != NoiseSource::kStatic && source != NoiseSource::kResidual)) continue;
    const double field = WorldVector(triad, run.graph.reference()).norm();
    const Eigen::Vector3d sigma = sensor->model.Correction().cwiseAbs() * sensor->noise.sigma;
    if (sigma.maxCoeff() + sensor->noise.excess_sigma > kHardlyMore * kLeastNoiseShare * field) {
      continue;
    }
    findings.push_back(
        Finding(FindingCode::kNoiseFree,
                std::string(TriadName(triad)) +
                    Format(": its readings show no noise; σ assume a nominal noise of %.0e times "
                           "the field",
                           kLeastNoiseShare))
            .About(triad)
            .With("nominal_noise", kLeastNoiseShare * field, std::string(TruthUnitName(triad))));
  }
  return findings;
}

Findings CheckCoverage(const SettledRun&, const SolvedRun& solved) {
  Findings findings;
  for (const Coverage& coverage : solved.stated.quality.coverage) {
    if (coverage.largest_gap_deg < kOneSidedGapDeg) continue;
    findings.push_back(
        Finding(FindingCode::kOneSidedPoses,
                std::string(TriadName(coverage.triad)) +
                    Format(": there is a direction without a pose within %.0f deg; nothing checks "
                           "the model on that side",
                           coverage.largest_gap_deg),
                "add poses there")
            .About(coverage.triad)
            .With("gap", coverage.largest_gap_deg, "deg"));
  }
  return findings;
}

Findings CheckMagnetometerScale(const SettledRun&, const SolvedRun& solved) {
  const ReferenceValues& reference = solved.stated.reference;
  Findings findings;
  if (reference.field_nominal) {
    findings.push_back(
        Finding(FindingCode::kNominalField,
                Format("field strength unknown: the magnetometer's common scale is not observable, "
                       "strength fixed to %.6g uT",
                       *reference.field_ut))
            .About(Triad::kMagnetometer)
            .With("strength", *reference.field_ut, "uT"));
  }
  return findings;
}

}  // namespace truetriad
