// SPDX-License-Identifier: Apache-2.0
#include "verdict/unmodelled.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "data/clock_lags.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "verdict/checks/clock_offsets.h"
#include "verdict/face_tilts.h"
#include "verdict/recording_faults.h"

namespace truetriad {
namespace {

// Where the temperature went on to the next, and σ count that the bias drifts between the two.
bool IsDrift(const PoseGraph& graph,
             const MagnetometerChange& change,
             const DriftCovariance& drift) {
  return !change.last && drift.sigma_raw[Triad::kMagnetometer] > 0.0 &&
         IsBetweenSettings(graph, change.node);
}

// A matrix that its `model:` cut short looks like any change of what it reads.
bool IsByMatrix(const MagnetometerChange& change, const LeftOutTerms& terms) {
  return std::any_of(terms.found.begin(), terms.found.end(), [&](const LeftOutTerm& term) {
    return term.kind == LeftOutKind::kMatrix && term.triad == Triad::kMagnetometer &&
           term.p_value <= change.p_value;
  });
}

// Clocks that are off by more than moves can tell.
std::vector<ClockOffset> LagsOf(const PoseSet& poses, const PoseGraph& graph) {
  std::vector<ClockOffset> lags;
  for (const Triad triad : kTriads) {
    if (!graph.layout.Has(triad) || !poses.clock_lag_s[triad]) continue;
    lags.push_back({triad, *poses.clock_lag_s[triad], kClockLagSigmaS});
  }
  return lags;
}

// By this many times the noise of their readings.
constexpr double kMuchScatter = 5.0;

bool TurnsScatter(const PoseGraph& graph, const NoiseState& noise) {
  const double excess = noise.excess[NoiseComponent::kTurn];
  std::vector<double> own;
  for (const IncrementEdge& edge : graph.increments) {
    own.push_back(edge.variance.trace() / 3.0 - excess);
  }
  return !own.empty() && excess > kMuchScatter * kMuchScatter * Median(std::move(own));
}

}  // namespace

Eigen::MatrixXd Unmodelled::Covariance() const {
  Eigen::MatrixXd sum = drift.covariance + left_out.covariance + blocks.covariance +
                        by_clocks.covariance + tilt_curvature;
  if (change && !change_is_drift) sum += change->covariance;
  return sum;
}

Unmodelled FindUnmodelled(const PoseSet& poses,
                          const PoseGraph& graph,
                          const ReducedSystem& system,
                          const NoiseState& noise,
                          const CalibrateOptions& options,
                          const std::vector<TemperatureSetting>& settings) {
  Unmodelled found;
  found.drift = FindDriftCovariance(graph, system, settings);
  found.change = FindMagnetometerChange(graph, system, noise);
  if (found.change && !Acts(Mechanism::kMagnetometerChange)) found.change.reset();
  found.change_is_drift = found.change && IsDrift(graph, *found.change, found.drift);
  found.left_out = FindLeftOutTerms(graph, system, noise, options, found.change.has_value());
  if (found.change && IsByMatrix(*found.change, found.left_out) &&
      Acts(Mechanism::kMatrixForChange)) {
    found.change.reset();
  }
  PerTriad<Eigen::Vector3d> sigma_raw{};
  for (const StreamSummary& stream : poses.streams) {
    sigma_raw[stream.triad] = stream.noise_sigma_raw;
  }
  AddFaultsOfRecording(poses,
                       sigma_raw,
                       TurnMissesOf(graph, system),
                       TurnsScatter(graph, noise),
                       graph,
                       system.covariance(),
                       &found.left_out);
  found.left_out.has_temperature = poses.temperature_range_degc.has_value();
  AddSettling(poses, graph, system, noise, &found.left_out);
  found.blocks = ScatterOf(TimeBlocksOf(system), system.information(), graph);
  found.clocks = FindClockOffsets(poses, graph);
  found.tilt_curvature = TiltCurvature(graph, system);
  if (!found.tilt_curvature.isZero(0.0) && !Acts(Mechanism::kTiltCurvature)) {
    found.tilt_curvature.setZero();
  }
  found.by_clocks = EffectsOf(found.clocks, graph, system);
  if (!found.clocks.empty() && !Acts(Mechanism::kClockSigma)) found.by_clocks.covariance.setZero();
  const std::vector<ClockOffset> lags = LagsOf(poses, graph);
  if (!lags.empty() && Acts(Mechanism::kLagSigma)) {
    found.by_clocks.covariance += EffectsOf(lags, graph, system).covariance;
  }
  return found;
}

}  // namespace truetriad
