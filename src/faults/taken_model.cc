// SPDX-License-Identifier: Apache-2.0
#include "faults/taken_model.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "noise/bounded_step.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// Variances are settled if they change by less than this share: 0.3 % changes σ by 0.15 %.
constexpr double kSettled = 3e-3;
// Noise that is wholly estimated from residuals stays above this share of its first value, so that
// faults cannot explain all of it.
constexpr double kLeastShare = 1e-3;

}  // namespace

TakenModel::TakenModel(const ReducedSystem& system, PoseGraph* graph, NoiseState* noise)
    : graph_(graph), noise_(noise), system_(system, *graph, noise->estimated) {
  const auto count = static_cast<Eigen::Index>(noise->estimated.size());
  excess_.v.resize(count);
  excess_.rest.resize(count);
  excess_.least = Eigen::VectorXd::Zero(count);
  for (Eigen::Index c = 0; c < count; ++c) {
    const NoiseComponent component = noise->estimated[static_cast<std::size_t>(c)];
    excess_.v[c] = noise->excess[component];
    excess_.rest[c] = MeanKnownVariance(*graph, component);
    if (noise->IsFromResiduals(component)) excess_.least[c] = kLeastShare * excess_.v[c];
  }
  excess_.dof = ResidualDof(*graph, system_);
  corrected_by_ = Eigen::VectorXd::Zero(system_.residual().size());
  for (const PoseNode& node : graph->nodes) {
    for (const Observation& seen : node.observations) readings_.push_back(seen.mean_raw);
  }
  for (const IncrementEdge& edge : graph->increments) {
    rotations_.push_back(edge.increment.rotation);
    stated_covariance_.push_back(edge.stated_covariance);
  }
}

void TakenModel::SetColumns(AddedColumns added) {
  added_ = std::move(added);
  const Eigen::VectorXd off = Correction();
  if (is_linearised_ && off == corrected_by_) {
    system_.TakeIn(*graph_, added_);
    return;
  }
  CorrectReadings(off);
  system_.Linearise(*graph_, added_);
  is_linearised_ = true;
}

void TakenModel::SetTurnVariances(TurnVariances unit) {
  const bool is_new = !unit.empty() && turn_unit_.empty();
  turn_unit_ = std::move(unit);
  const auto count =
      static_cast<Eigen::Index>(noise_->estimated.size() + (turn_unit_.empty() ? 0 : 1));
  for (Eigen::VectorXd* of : {&excess_.v, &excess_.rest, &excess_.least}) {
    of->conservativeResize(count);
    if (is_new) of->tail<1>().setZero();
  }
  system_.SetTurnVariances(turn_unit_);
  SetExcess(excess_.v);
}

void TakenModel::Apply(const Eigen::VectorXd& v) {
  for (std::size_t c = 0; c < noise_->estimated.size(); ++c) {
    noise_->excess[noise_->estimated[c]] = v[static_cast<Eigen::Index>(c)];
  }
  for (std::size_t i = 0; i < graph_->increments.size(); ++i) {
    Eigen::Matrix3d& stated = graph_->increments[i].stated_covariance;
    stated = stated_covariance_[i];
    if (!turn_unit_.empty()) stated += v.tail<1>()[0] * turn_unit_[i];
  }
  ApplyExcess(noise_->excess, graph_);
}

void TakenModel::SetExcess(const Eigen::VectorXd& v) {
  excess_.v = v;
  Apply(v);
  system_.Eliminate(*graph_, added_);
}

void TakenModel::SettleExcess(int steps) {
  if (system_.components() == 0) return;
  for (int i = 0; i < steps; ++i) {
    const Eigen::VectorXd limit = (excess_.least - excess_.v).cwiseMin(0.0);
    const Eigen::VectorXd step = StepAbove(limit, system_.fisher(), system_.score());
    const Eigen::VectorXd v = (excess_.v + step).cwiseMax(excess_.least);
    is_settled_ = v.allFinite();
    if (!is_settled_) return;
    const Eigen::ArrayXd scale = (excess_.v + excess_.rest).array() + 1e-300;
    is_settled_ = ((v - excess_.v).array().abs() < kSettled * scale).all();
    if (is_settled_) return;
    SetExcess(v);
  }
}

// Z h. Columns with h = 0 are skipped, so that the sum is bit for bit the same as without them.
Eigen::VectorXd TakenModel::Correction() const {
  Eigen::VectorXd off = Eigen::VectorXd::Zero(system_.residual().size());
  for (Eigen::Index j = 0; j < added_.size(); ++j) {
    if (added_.at[j] != 0.0) off += added_.at[j] * added_.Z.col(j);
  }
  return off;
}

// A row is the model minus the reading. Z h is added to a row by reducing the reading by Z h, or by
// replacing a turn dR by dR Exp(-Z h).
void TakenModel::CorrectReadings(const Eigen::VectorXd& off) {
  Eigen::Index row = 0;
  std::size_t reading = 0;
  for (PoseNode& node : graph_->nodes) {
    Eigen::Index at = row;
    for (Observation& seen : node.observations) {
      seen.mean_raw = readings_[reading++] - off.segment<3>(at);
      at += 3;
    }
    row += node.row_count();
  }
  for (std::size_t i = 0; i < graph_->increments.size(); ++i) {
    const Eigen::Vector3d turn = off.segment<3>(row);
    graph_->increments[i].increment.rotation = rotations_[i] * RotationExp(-turn);
    row += 3;
  }
  corrected_by_ = off;
}

void TakenModel::Relinearise() {
  added_.at = system_.h();
  CorrectReadings(Correction());
  system_.ReducedSystem::Linearise(*graph_);
  system_.TakeStep(system_.step(), graph_);
  for (std::size_t i = 0; i < graph_->increments.size(); ++i) {
    IncrementEdge& edge = graph_->increments[i];
    edge.Integrate(graph_->layout, graph_->shared.data());
    rotations_[i] = edge.increment.rotation;
  }
  graph_->integrated_at = graph_->shared;
  ApplyExcess(noise_->excess, graph_);
  // Turns were integrated anew, so that they have to be corrected again.
  CorrectReadings(Correction());
  is_linearised_ = false;
}

void TakenModel::StateEstimate() {
  noise_->estimate.variance = noise_->excess;
  StateCurvatures(*graph_, system_, &noise_->estimate);
}

double TakenModel::ChiSquareAtRest() {
  Apply(Eigen::VectorXd::Zero(excess_.v.size()));
  const double chi2 = system_.ChiSquareOf(*graph_);
  Apply(excess_.v);
  return chi2;
}

}  // namespace truetriad
