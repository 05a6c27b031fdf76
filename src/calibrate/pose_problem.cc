// SPDX-License-Identifier: Apache-2.0
#include <utility>
#include <vector>

#include <ceres/problem.h>

#include "calibrate/calibrate_settled.h"
#include "solve/ceres_problem.h"
#include "solve/chain_problem.h"
#include "truetriad/calibrate/calibrate.h"

namespace truetriad {

struct PoseProblem::State {
  PoseGraph graph;
  ChainProblem chain;
  std::vector<int> node_of_pose;  // -1: none
  std::unique_ptr<ceres::Problem> problem;
};

PoseProblem::PoseProblem(std::unique_ptr<State> state) : state_(std::move(state)) {}
PoseProblem::PoseProblem(PoseProblem&&) noexcept = default;
PoseProblem& PoseProblem::operator=(PoseProblem&&) noexcept = default;
PoseProblem::~PoseProblem() = default;

Result<PoseProblem> PoseProblem::Create(const PoseSet& poses, const CalibrateOptions& options) {
  TRUETRIAD_RETURN_IF_ERROR(options.Validate());
  if (options.motion || options.sweep || options.HasChoice() || options.initialise.only) {
    return Error(
        ErrorCode::kNotEnoughData,
        "a PoseProblem needs rests, a stated model without `auto`, and more than start values");
  }
  SettledModel settled;
  const auto summary = CalibrateSettled(poses, options, &settled);
  TRUETRIAD_RETURN_IF_ERROR(summary);
  if (!summary->calibration.IsUsable()) {
    return Error(
        ErrorCode::kNotEnoughData, {poses.source}, "these poses do not give a usable calibration");
  }
  auto state = std::make_unique<State>();
  state->graph = std::move(settled.graph);
  state->chain = ChainOf(state->graph);
  for (const StaticPose& pose : poses.poses) {
    int& node = state->node_of_pose.emplace_back(-1);
    for (std::size_t k = 0; k < state->graph.nodes.size(); ++k) {
      const bool is_it = state->graph.nodes[k].number == pose.number &&
                         state->graph.nodes[k].role == PoseRole::kRest;
      if (is_it) node = static_cast<int>(k);
    }
  }
  state->problem = CeresProblemOf(&state->chain, &state->graph.shared);
  return PoseProblem(std::move(state));
}

ceres::Problem& PoseProblem::ceres_problem() { return *state_->problem; }

double* PoseProblem::Bias(Triad triad) {
  const SharedLayout& layout = state_->graph.layout;
  return layout.Has(triad) ? state_->graph.shared.data() + layout.bias[triad] : nullptr;
}

double* PoseProblem::Sensitivity(Triad triad) {
  const SharedLayout& layout = state_->graph.layout;
  return layout.Has(triad) ? state_->graph.shared.data() + layout.sensitivity[triad] : nullptr;
}

double* PoseProblem::Attitude(std::size_t pose) {
  const int node = pose < state_->node_of_pose.size() ? state_->node_of_pose[pose] : -1;
  if (node < 0) return nullptr;
  ChainState& state = state_->chain.states[static_cast<std::size_t>(node)];
  return state.kind == PoseKind::kDirection ? nullptr : state.values.data();
}

TriadModel<double> PoseProblem::Model(Triad triad) const {
  return state_->graph.layout.ModelOf(triad, state_->graph.shared.data(), ThermalFactors());
}

}  // namespace truetriad
