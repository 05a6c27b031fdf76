// SPDX-License-Identifier: Apache-2.0
#include "verdict/unmodelled.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "data/clock_lags.h"
#include "data/pose_statistics.h"
#include "faults/face_curvatures.h"
#include "faults/scan.h"
#include "faults/scene.h"
#include "model/mechanisms.h"
#include "solve/shared_information.h"
#include "verdict/checks/clock_offsets.h"
#include "verdict/recording_faults.h"

namespace truetriad {
namespace {

// Rounding is included if it may shift a bias by at least this many σ of the bias: it then widens
// this σ by at least 12 %.
constexpr double kRoundingSigmas = 0.5;

// Clock lags that are too long to be determined by moves.
std::vector<ClockOffset> LagsOf(const PoseSet& poses, const PoseGraph& graph) {
  std::vector<ClockOffset> lags;
  for (const Triad triad : kTriads) {
    if (!graph.layout.Has(triad) || !poses.clock_lag_s[triad]) continue;
    lags.push_back({triad, *poses.clock_lag_s[triad], kClockLagSigmaS});
  }
  return lags;
}

// The nonlinearities that the sensor's data sheet allows, as a fault with prior σ.
StatedFault BendsOf(Triad triad, const Nonlinearity& nonlinearity, const PoseGraph& graph) {
  StatedFault bends;
  const FaultScene scene(graph);
  const Eigen::Vector3d gains = graph.sensitivity(triad).rowwise().norm();
  const double largest = scene.largest(triad);
  std::vector<Eigen::Vector3d> sigmas;
  std::vector<FaultColumn> columns;
  for (const FaultKind& kind : FaultKinds()) {
    const bool has =
        std::find(kind.sensors.begin(), kind.sensors.end(), triad) != kind.sensors.end();
    if (!has || !kind.parameter || !IsBend(kind)) continue;
    std::vector<FaultColumn> stretches = scene.ColumnsOf(triad, kind.form);
    if (stretches.empty()) continue;
    columns.push_back(ScannedForm(std::move(stretches), /*is_whole=*/true).Column({}));
    const AxisTermInfo& info = InfoOf(*InfoOf(*kind.parameter).axis_term);
    Eigen::Vector3d& sigma = sigmas.emplace_back();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      sigma[axis] = nonlinearity.SigmaOf(info, gains[axis]) * largest * info.PowerOf(largest);
    }
  }
  const auto all = static_cast<Eigen::Index>(3 * columns.size());
  bends.sigma.resize(all);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(3 * i);
    for (const FaultColumn::Block& block : columns[i].blocks) {
      Eigen::MatrixXd wide = Eigen::MatrixXd::Zero(3, all);
      wide.middleCols<3>(at) = block.value;
      bends.column.Add(block.row, wide);
    }
    bends.sigma.segment<3>(at) = sigmas[i];
  }
  return bends;
}

// The rounding error of a gyroscope as a fault. If noise at rest is below a converter step, all
// readings at rest, and as a turn begins and ends, are equal: they share one rounding error of up
// to half a step.
std::optional<StatedFault> RoundingOf(const PoseSet& poses,
                                      const PoseGraph& graph,
                                      const ReducedSystem& system) {
  const StreamSummary* stream = poses.Find(Triad::kGyroscope);
  if (stream == nullptr || !graph.layout.Has(Triad::kGyroscope)) return std::nullopt;
  const Eigen::Vector3d bias = graph.bias(Triad::kGyroscope);
  const Eigen::Vector3d variance = stream->noise_sigma_raw.cwiseAbs2();
  Eigen::Vector3d sigma;
  for (int axis = 0; axis < 3; ++axis) {
    sigma[axis] =
        std::sqrt(RoundingVarianceAt(bias[axis], variance[axis], stream->rest_step_raw[axis]));
  }
  const Eigen::VectorXd moved =
      graph.layout.basis.middleRows<3>(graph.layout.bias[Triad::kGyroscope]).transpose() * sigma;
  if (LargestInSigmas(graph.layout, system.covariance(), moved) < kRoundingSigmas) {
    return std::nullopt;
  }
  std::vector<FaultColumn> stretches =
      FaultScene(graph).ColumnsOf(Triad::kGyroscope, FaultForm::kStill);
  if (stretches.empty() || !Acts(Mechanism::kRounding)) return std::nullopt;
  return StatedFault{ScannedForm(std::move(stretches), /*is_whole=*/true).Column({}),
                     sigma.cwiseMax(1e-3 * sigma.maxCoeff())};
}

}  // namespace

Eigen::MatrixXd Unmodelled::Covariance() const {
  return faults.beyond + drift.covariance + of_recording.covariance + by_clocks;
}

void TakeFaultsIn(const CalibrateOptions& options,
                  const PoseSet& poses,
                  PoseGraph* graph,
                  NoiseState* noise,
                  ReducedSystem* system,
                  Unmodelled* found) {
  std::vector<StatedFault> stated;
  for (const Triad triad : kTriads) {
    const auto& nonlinearity = options.triads[triad].nonlinearity;
    if (!graph->layout.Has(triad) || !nonlinearity || !Acts(Mechanism::kStatedBends)) continue;
    StatedFault bends = BendsOf(triad, *nonlinearity, *graph);
    if (bends.column.blocks.empty()) continue;
    stated.push_back(std::move(bends));
    found->stated_bends.push_back(triad);
  }
  if (std::optional<StatedFault> rounding = RoundingOf(poses, *graph, *system)) {
    stated.push_back(std::move(*rounding));
    found->has_rounding = true;
  }
  std::optional<StatedFault> curvatures = FaceCurvatures(*graph, system->covariance());
  if (curvatures && Acts(Mechanism::kTiltCurvature)) stated.push_back(std::move(*curvatures));
  found->faults = FindFaults(stated, graph, noise, system);
}

void FindBeyondFaults(const PoseSet& poses,
                      const PerTriad<Eigen::Vector3d>& sigma_raw,
                      const PoseGraph& graph,
                      const ReducedSystem& system,
                      const std::vector<TemperatureSetting>& settings,
                      Unmodelled* found) {
  found->drift = FindDriftCovariance(graph, system, settings);
  found->of_recording = FindRecordingFaults(poses, sigma_raw, graph, system);
  found->by_clocks = Eigen::MatrixXd::Zero(system.size(), system.size());
  const auto widen = [&](const ClockOffset& clock, Mechanism mechanism) {
    const Eigen::VectorXd moved = MovedByClock(clock, graph, system);
    if (Acts(mechanism)) found->by_clocks += moved * moved.transpose();
    return LargestInSigmas(graph.layout, system.covariance(), moved);
  };
  found->clocks = FindClockOffsets(poses, graph);
  for (const ClockOffset& clock : found->clocks) {
    found->clock_sigmas.push_back(widen(clock, Mechanism::kClockSigma));
  }
  for (const ClockOffset& lag : LagsOf(poses, graph)) widen(lag, Mechanism::kLagSigma);
}

}  // namespace truetriad
