// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include "base/messages.h"
#include "base/sensor_line.h"
#include "verdict/checks/check.h"
#include "verdict/observability.h"

namespace truetriad {
namespace {

// Largest χ² per degree of freedom. Above it the stated noise is over 30 times too small (the
// square root), and no σ from it can be trusted.
constexpr double kMostReducedChi2 = 1e3;
// The optimiser stopped short if Newton's step at the solution exceeds two limits: this limit of
// the step's χ², and kShortShare. If data have hardly any noise, χ² alone is too strict.
constexpr double kShortChi2 = 0.01;
// The limit of the change of any parameter in this step, relative to the parameter's typical size.
constexpr double kShortShare = 1e-6;
// If a σ with all effects exceeds the limit of `determined`, there is a warning; if it exceeds this
// many times the limit, the parameter is worthless, and the run is refused.
constexpr double kWorthless = 10.0;

// The first few parameters with a negative variance; empty if there are none.
std::string WithoutVariance(const NamedCovariance& covariance) {
  // Chosen for a readable message.
  constexpr int kNamed = 3;
  std::string names;
  int count = 0;
  for (std::size_t i = 0; i < covariance.parameters.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    if (!(covariance.matrix(at, at) < 0.0) || ++count > kNamed) continue;
    names += (names.empty() ? "" : ", ") + covariance.parameters[i];
  }
  return names + (count > kNamed ? ", …" : "");
}

// Whether Newton's step at the solution is not negligible. An optimiser may stop too early where χ²
// is a flat and curved valley, since its steps become very short there.
bool IsShort(const ReducedSystem& system) {
  const double chi2 = system.step().dot(system.information() * system.step());
  const double share = system.step().cwiseQuotient(system.scale()).cwiseAbs().maxCoeff();
  return chi2 > kShortChi2 && share > kShortShare;
}

bool IsDetermined(const SolvedRun& solved) {
  return solved.determined && solved.system.rank() == solved.system.size();
}

Finding NotDetermined(const SettledRun& run) {
  return {FindingCode::kNotDetermined,
          std::string(run.of_motion != nullptr ? "the motion does" : "the poses do") +
              " not determine every parameter that was asked for",
          "see the weak directions"};
}

}  // namespace

Findings CheckFinite(const TriadOptions& gyroscope,
                     bool is_finite,
                     const NamedCovariance& covariance) {
  const bool has_numbers = is_finite && covariance.matrix.allFinite();
  if (has_numbers && covariance.matrix.diagonal().minCoeff() >= 0.0) return {};
  if (const std::string lost = WithoutVariance(covariance); is_finite && !lost.empty()) {
    return {{FindingCode::kNoUncertainty,
             "the data hardly determine " + lost + ": no σ can be computed for it",
             "leave the term out, or add poses and turns that show it"}};
  }
  std::string remedy = "look for absurd readings, stated σ or held values";
  for (const AxisTermInfo& info : kAxisTerms) {
    if (gyroscope.axis_terms[info.term] != Wanted::kYes) continue;
    remedy = WithArticle(info.words) +
             " that the turns hardly determine causes this: leave it out, or set `" +
             std::string(info.name) + ": auto`";
  }
  return {{FindingCode::kNonFinite, "the solution became non-finite", remedy}};
}

Findings CheckFinite(const SettledRun& run, const SolvedRun& solved) {
  // The squared norm also refuses finite values whose squares overflow a double.
  const bool is_finite =
      std::isfinite(solved.system.cost()) && std::isfinite(run.graph.shared.squaredNorm());
  Findings findings =
      CheckFinite(run.options.triads[Triad::kGyroscope], is_finite, solved.solution.covariance);
  // Values that are not finite usually come from too little data.
  if (!findings.empty() && is_finite && !solved.stated.quality.weak_directions.empty()) {
    return {NotDetermined(run)};
  }
  return findings;
}

Findings CheckNoiseKnown(const SettledRun& run, const SolvedRun&) {
  if (!run.noise.unknown) return {};
  return {{FindingCode::kNoiseUnknown,
           "the parameters can explain every residual, so the noise cannot be estimated",
           "add poses, or state the noise, as by " +
               SensorLine(Triad::kAccelerometer, "noise: { sigma: [x, y, z] }")}};
}

Findings CheckExplained(const SettledRun&, const SolvedRun& solved) {
  const double reduced_chi2 = solved.stated.quality.reduced_chi2;
  if (!(reduced_chi2 > kMostReducedChi2)) return {};
  const double times = std::sqrt(reduced_chi2);
  return {
      Finding(FindingCode::kUnexplainedReadings,
              Format("after the fit the readings scatter by %.0f times the stated noise", times),
              "state the actual noise, have the excess estimated, as by " +
                  SensorLine(Triad::kAccelerometer, "noise: { excess: estimate }") +
                  ", or look for an effect that the experiment does not model")
          .With("times", times)};
}

Findings CheckTemperatureModelled(const SettledRun& run, const SolvedRun& solved) {
  const std::optional<Eigen::Vector2d>& range = run.poses.temperature_range_degc;
  const std::size_t rejected = solved.stated.quality.rests.rejected_poses.size();
  if (IsDetermined(solved) || !range || run.options.HasThermal() ||
      !((*range)[1] - (*range)[0] > kMuchTemperatureDegc) ||
      2 * rejected <= run.graph.nodes.size()) {
    return {};
  }
  return {Finding(FindingCode::kTemperatureIgnored,
                  Format("most poses do not fit a single model; the temperature went from %.0f ",
                         (*range)[0]) +
                      Format("to %.0f degC", (*range)[1]),
                  "estimate temperature terms (`thermal:`), or record at one temperature")
              .With("lowest", (*range)[0], "degC")
              .With("highest", (*range)[1], "degC")
              .With("outliers", static_cast<double>(rejected))};
}

Findings CheckDetermined(const SettledRun& run, const SolvedRun& solved) {
  if (IsDetermined(solved)) return {};
  return {NotDetermined(run)};
}

Findings CheckStillDetermined(const PoseGraph& graph,
                              const Eigen::MatrixXd& covariance,
                              double limit) {
  const LeastKnown least = LeastKnownOf(graph, covariance);
  if (!(least.share > limit)) return {};
  Finding finding(FindingCode::kPoorlyKnown,
                  "with the errors that other findings name, " + least.name +
                      Format(" is uncertain by %.0f %%", 100.0 * least.share),
                  "resolve those findings first");
  finding.With("share", least.share);
  if (least.share > kWorthless * limit) finding.As(Severity::kRefusal);
  return {finding};
}

Findings CheckConverged(const SettledRun& run, const SolvedRun& solved) {
  if (!run.converged || IsShort(solved.system)) {
    return {{FindingCode::kDidNotConverge,
             "the optimiser did not converge; the readings may not fit the model"}};
  }
  const OffOptimum& off = solved.off;
  if (off.IsSettled()) return {};
  Finding finding(
      FindingCode::kDidNotConverge,
      "the estimate of the pose-to-pose noise of the " + NoiseComponentName(*off.component) +
          Format(" did not converge (its REML score is %.2g σ, not 0): no σ can be stated",
                 off.score_sigmas),
      "state " +
          SensorLine(TriadOf(*off.component).value_or(Triad::kGyroscope),
                     "noise: { excess: { sigma: … } }") +
          ", or add poses");
  finding.sensor = TriadOf(*off.component).value_or(Triad::kGyroscope);
  return {finding.With("score", off.score_sigmas, "sigma")};
}

}  // namespace truetriad
