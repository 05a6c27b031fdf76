// SPDX-License-Identifier: Apache-2.0
#include "motion/chain.h"

#include <cmath>
#include <memory>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "problem/graph_rows.h"
#include "problem/rows/accelerometer_row.h"
#include "problem/rows/attitude_row.h"
#include "problem/rows/integrated_turn_row.h"
#include "problem/rows/magnetometer_row.h"
#include "solve/solve_graph.h"

namespace truetriad {
namespace {

constexpr Triad kVectorTriads[] = {Triad::kAccelerometer, Triad::kMagnetometer};
constexpr int kMaxIterations = 50;

std::shared_ptr<const Row> RowOf(Triad triad,
                                 const SharedLayout& layout,
                                 const GatheredReadings& seen) {
  const FieldRow::Reading reading{seen.mean_raw, seen.turn, ThermalFactors(), seen.turning};
  if (triad == Triad::kAccelerometer) {
    return std::make_shared<AccelerometerRow>(layout, PoseKind::kRotation, reading);
  }
  return std::make_shared<MagnetometerRow>(layout, PoseKind::kRotation, reading);
}

double DurationOf(const GyroReadings& readings) {
  return readings.time_s.back() - readings.time_s.front();
}

}  // namespace

TriadModel<double> ModelOf(const SharedLayout& layout, Triad triad, const double* shared) {
  return {Eigen::Map<const Eigen::Matrix3d>(shared + layout.sensitivity[triad]),
          Eigen::Map<const Eigen::Vector3d>(shared + layout.bias[triad])};
}

GyroModel GyroscopeOf(const SharedLayout& layout, const double* shared) {
  GyroModel model{ModelOf(layout, Triad::kGyroscope, shared)};
  if (layout.g_sensitivity >= 0) {
    model.g_sensitivity = Eigen::Map<const Eigen::Matrix3d>(shared + layout.g_sensitivity);
  }
  return model;
}

MotionChain::MotionChain(const SharedLayout& layout,
                         const std::vector<ScalarPrior>& priors,
                         const MotionTrack& track,
                         std::vector<MotionNode> nodes,
                         std::vector<Eigen::Quaterniond> attitudes)
    : layout_(layout),
      priors_(priors),
      track_(track),
      nodes_(std::move(nodes)),
      attitudes_(std::move(attitudes)),
      rows_(nodes_.size()) {
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    for (const Triad triad : kVectorTriads) {
      const GatheredReadings& seen = nodes_[k].seen(triad);
      if (seen.count == 0 || !layout_.Has(triad)) continue;
      rows_[k][triad] = RowOf(triad, layout_, seen);
    }
    if (!nodes_[k].is_linked || k + 1 == nodes_.size()) continue;
    rows_[k][Triad::kGyroscope] =
        std::make_shared<IntegratedTurnRow>(layout_, track_.Between(nodes_[k], nodes_[k + 1]));
  }
}

void MotionChain::SetNoise(const MotionNoise& noise, const double* shared) {
  for (const Triad triad : kVectorTriads) {
    if (!layout_.Has(triad)) continue;
    inverse_sigma_[triad] =
        (noise.density[triad] / track_.spacing_s(triad)).cwiseSqrt().cwiseInverse();
  }
  const Eigen::Matrix3d correction = GyroscopeOf(layout_, shared).triad.Correction();
  const Eigen::Matrix3d variance =
      correction * noise.density[Triad::kGyroscope].asDiagonal() * correction.transpose();
  turn_root_ = RootOf(variance, 1.0);
}

Eigen::Vector3d MotionChain::VectorRoot(Triad triad, const GatheredReadings& seen) const {
  return std::sqrt(seen.weight * static_cast<double>(seen.count)) * inverse_sigma_[triad];
}

// Where one vector sensor is all that a chain, or a piece of it, has, its heading about what that
// sees is not observable: that of its first attitude is held.
bool MotionChain::HoldsHeading(std::size_t k, std::size_t begin, std::size_t end) const {
  if (k > begin && nodes_[k - 1].is_linked) return false;
  const auto is_seen = [&](Triad triad) {
    std::size_t at = k;
    while (rows_[at][triad] == nullptr && nodes_[at].is_linked && at + 1 < end) ++at;
    return rows_[at][triad] != nullptr;
  };
  return !is_seen(Triad::kMagnetometer) || !is_seen(Triad::kAccelerometer);
}

ChainProblem MotionChain::Problem(std::size_t begin, std::size_t end) const {
  ChainProblem problem;
  problem.layout = &layout_;
  problem.states.reserve(end - begin);
  problem.rows.reserve(3 * (end - begin) + priors_.size());
  for (std::size_t k = begin; k < end; ++k) {
    problem.states.push_back({PoseKind::kRotation, ValuesOf(attitudes_[k])});
    const auto add = [&](std::shared_ptr<const Row> row, const RowRoot& root) {
      problem.rows.push_back({std::move(row), root, k - begin});
    };
    for (const Triad triad : kVectorTriads) {
      if (rows_[k][triad] == nullptr) continue;
      add(rows_[k][triad], VectorRoot(triad, nodes_[k].seen(triad)).asDiagonal());
    }
    if (HoldsHeading(k, begin, end)) {
      // Nothing else pulls about the vertical.
      add(std::make_shared<HeldHeadingRow>(attitudes_[k]), RowRoot::Ones(1, 1));
    }
    if (rows_[k][Triad::kGyroscope] == nullptr || k + 1 == end) continue;
    const double root =
        std::sqrt(nodes_[k].weight / DurationOf(track_.Between(nodes_[k], nodes_[k + 1])));
    add(rows_[k][Triad::kGyroscope], root * turn_root_);
  }
  return problem;
}

ChainProblem MotionChain::WholeProblem() const {
  ChainProblem problem = Problem(0, nodes_.size());
  for (const ScalarPrior& prior : priors_) {
    problem.rows.push_back({truetriad::RowOf(prior, layout_),
                            RowRoot::Constant(1, 1, 1.0 / prior.sigma),
                            nodes_.size()});
  }
  return problem;
}

SolveOutcome MotionChain::Solve(Solver solver, double tolerance, Eigen::VectorXd* shared) {
  ChainProblem problem = WholeProblem();
  const SolveOutcome outcome = SolveChain(solver, tolerance, kMaxIterations, &problem, shared);
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    attitudes_[k] = Eigen::Quaterniond(problem.states[k].values.data());
  }
  return outcome;
}

ChainElimination MotionChain::LinearisedAt(const Eigen::VectorXd& shared) const {
  ChainElimination elimination(WholeProblem());
  elimination.LineariseOnce(shared);
  return elimination;
}

ChainElimination MotionChain::LinearisedAt(const Eigen::VectorXd& shared,
                                           std::size_t begin,
                                           std::size_t end) const {
  ChainElimination elimination(Problem(begin, end));
  elimination.LineariseOnce(shared);
  return elimination;
}

PerTriad<MotionChain::Residuals> MotionChain::AllResiduals(const ChainElimination& solved) const {
  const std::vector<ChainElimination::Residual> residuals = solved.Residuals();
  const auto count = static_cast<Eigen::Index>(nodes_.size());
  PerTriad<Residuals> all;
  for (const Triad triad : kTriads) {
    all[triad].value.setZero(3, count);
    all[triad].left.setZero(3, count);
  }
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const ChainRow& row = solved.rows()[i];
    if (row.state == nodes_.size()) continue;  // a prior
    for (const Triad triad : kTriads) {
      if (rows_[row.state][triad] != row.row) continue;
      all[triad].value.col(static_cast<Eigen::Index>(row.state)) = residuals[i].value;
      all[triad].left.col(static_cast<Eigen::Index>(row.state)) = residuals[i].left.diagonal();
    }
  }
  return all;
}

std::vector<TurnMiss> MotionChain::TurnMisses(const ChainElimination& solved) const {
  const std::vector<ChainElimination::Residual> residuals = solved.Residuals();
  const TriadModel<double> gyroscope = GyroscopeOf(layout_, solved.shared().data()).triad;
  std::vector<TurnMiss> misses;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const ChainRow& row = solved.rows()[i];
    if (row.row->state_count() < 2) continue;
    const MotionNode& node = nodes_[row.state];
    const GyroReadings readings = track_.Between(node, nodes_[row.state + 1]);
    const Eigen::Matrix3d root = turn_root_ / std::sqrt(DurationOf(readings));
    misses.push_back({root.transpose() * root,
                      root.transpose() * residuals[i].left * root,
                      root.transpose() * residuals[i].value / std::sqrt(node.weight),
                      SquaredSteps(readings, gyroscope)});
  }
  return misses;
}

MotionChain::ClockError MotionChain::ClockErrorOf(Triad triad, const double* shared) const {
  const Eigen::Map<const ReferenceVector> reference(shared + layout_.reference);
  const TriadModel<double> model = ModelOf(layout_, triad, shared);
  const TriadModel<double> gyroscope = GyroscopeOf(layout_, shared).triad;
  const Eigen::Matrix3d correction = gyroscope.Correction();
  const Eigen::Vector3d world = WorldVector(triad, reference);
  double along = 0.0, squared = 0.0;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const GatheredReadings& seen = nodes_[k].seen(triad);
    if (seen.count == 0) continue;
    const Eigen::Vector3d field = seen.turn * (attitudes_[k].conjugate() * world);
    const Eigen::Vector3d rate = correction * (track_.RateAt(nodes_[k]) - gyroscope.bias);
    const Eigen::Vector3d root = VectorRoot(triad, seen);
    const Eigen::Vector3d change = root.cwiseProduct(model.sensitivity * field.cross(rate));
    along += change.dot(root.cwiseProduct(model.RawFromTruth(field) - seen.mean_raw));
    squared += change.squaredNorm();
  }
  // A reading that is stamped too late by t shows the field of t earlier: the residual is t times
  // the change.
  if (!(squared > 0.0)) return {};
  return {along / squared, 1.0 / std::sqrt(squared)};
}

std::vector<ProbedTerm> AppendProbes(SharedLayout* layout) {
  std::vector<ProbedTerm> probes;
  const auto add = [&](Triad triad, LeftOutKind kind, int size) {
    probes.push_back({{triad, kind}, layout->AppendProbe(size)});
  };
  for (const Triad triad : kTriads) {
    if (!layout->Has(triad)) continue;
    add(triad, LeftOutKind::kDrift, 3);
    add(triad, LeftOutKind::kLowPass, 1);
    if (triad == Triad::kAccelerometer) add(triad, LeftOutKind::kLeverArm, 3);
  }
  return probes;
}

std::optional<MotionChain::Turning> MotionChain::TurningAt(std::size_t k) const {
  if (k == 0 || k + 1 >= nodes_.size() || !nodes_[k - 1].is_linked || !nodes_[k].is_linked) {
    return std::nullopt;
  }
  const double time_s = track_.TimeOf(nodes_[k + 1]) - track_.TimeOf(nodes_[k - 1]);
  const TriadModel<double>& gyroscope = models_[Triad::kGyroscope];
  const Eigen::Matrix3d correction = gyroscope.Correction();
  return Turning{
      correction * (track_.RateAt(nodes_[k]) - gyroscope.bias),
      correction * (track_.RateAt(nodes_[k + 1]) - track_.RateAt(nodes_[k - 1])) / time_s};
}

std::optional<ProbedRow::Probe> MotionChain::ProbeAt(const ProbedTerm& probe,
                                                     std::size_t k,
                                                     const std::optional<Turning>& turning) const {
  ProbedRow::Probe at;
  at.block = probe.block;
  const Triad triad = probe.term.triad;
  if (probe.term.kind == LeftOutKind::kDrift) {
    at.like = layout_.bias[triad];
    const double begin_s = track_.TimeOf(nodes_.front()), end_s = track_.TimeOf(nodes_.back());
    at.factor = 2.0 * (track_.TimeOf(nodes_[k]) - begin_s) / (end_s - begin_s) - 1.0;
    return at;
  }
  if (!turning) return std::nullopt;
  const auto& [rate, acceleration] = *turning;
  if (triad == Triad::kGyroscope) {
    const std::optional<Turning> next = TurningAt(k + 1);
    if (!next) return std::nullopt;
    at.by = 0.5 * (acceleration - next->acceleration_radps2);
  } else if (probe.term.kind == LeftOutKind::kLeverArm) {
    const Eigen::Matrix3d W = Skew(rate);
    at.by = models_[triad].sensitivity * (Skew(acceleration) + W * W);
  } else {
    const Eigen::Vector3d field =
        nodes_[k].seen(triad).turn * (attitudes_[k].conjugate() * WorldVector(triad, reference_));
    at.by = models_[triad].sensitivity *
            (0.5 * (field.cross(rate).cross(rate) + field.cross(acceleration)));
  }
  return at;
}

std::vector<ProbedRow::Probe> MotionChain::ProbesAt(const std::vector<ProbedTerm>& probes,
                                                    Triad triad,
                                                    std::size_t k,
                                                    const std::optional<Turning>& turning) const {
  std::vector<ProbedRow::Probe> all;
  for (const ProbedTerm& probe : probes) {
    if (probe.term.triad != triad) continue;
    if (auto at = ProbeAt(probe, k, turning)) all.push_back(*std::move(at));
  }
  return all;
}

void MotionChain::SetProbes(const std::vector<ProbedTerm>& probes, const double* shared) {
  reference_ = Eigen::Map<const ReferenceVector>(shared + layout_.reference);
  for (const Triad triad : kTriads) {
    if (layout_.Has(triad)) models_[triad] = ModelOf(layout_, triad, shared);
  }
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const std::optional<Turning> turning = TurningAt(k);
    for (const Triad triad : kTriads) {
      std::shared_ptr<const Row>& row = rows_[k][triad];
      if (row == nullptr) continue;
      row = std::make_shared<ProbedRow>(std::move(row), ProbesAt(probes, triad, k, turning));
    }
  }
}

}  // namespace truetriad
