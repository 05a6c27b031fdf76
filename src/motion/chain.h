// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "motion/track.h"
#include "problem/graph.h"
#include "problem/rows/probed_row.h"
#include "solve/chain_elimination.h"
#include "solve/chain_problem.h"
#include "solve/outcome.h"
#include "verdict/left_out_terms.h"
#include "verdict/turn_scatter.h"

namespace truetriad {

// Noise of a tumbling unit's readings, white at the frequencies that matter: raw unit squared times
// seconds, per axis. A mean over T seconds has the variance density / T.
struct MotionNoise {
  PerTriad<Eigen::Vector3d> density;
};

// Of all sensors in a layout, to which they are added:
//
//   low-pass   half the second derivative of the field in the body (of the gyroscope: of its rate)
//              times t^2, what a first-order low-pass of time constant t leaves beyond its delay
//   lever arm  r from the point about which the unit is turned to the accelerometer, body frame:
//              f = ... + alpha x r + omega x (omega x r)
//   drift      bias times time, from -1 to 1 over the run
std::vector<ProbedTerm> AppendProbes(SharedLayout* layout);

// The factor graph of a tumbling unit: a chain of attitudes, seen by the vector sensors (FieldRow,
// mean readings about each attitude) and tied to each other by the gyroscope (IntegratedTurnRow).
class MotionChain {
 public:
  // All must outlive the chain. `layout` and `priors` are those of the shared parameters.
  MotionChain(const SharedLayout& layout,
              const std::vector<ScalarPrior>& priors,
              const MotionTrack& track,
              std::vector<MotionNode> nodes,
              std::vector<Eigen::Quaterniond> attitudes);

  // What rows are weighted with, beside the nodes' own weights; the turns' noise goes through the
  // correction at `shared`.
  void SetNoise(const MotionNoise& noise, const double* shared);

  // Minimises over `shared` and the attitudes. `tolerance`: of the cost, relative.
  SolveOutcome Solve(Solver solver, double tolerance, Eigen::VectorXd* shared);

  ChainProblem WholeProblem() const;

  // Linearised once, at `shared` and the attitudes as they are: all of it; or the nodes from
  // `begin` to before `end` alone, as a chain without priors.
  ChainElimination LinearisedAt(const Eigen::VectorXd& shared) const;
  ChainElimination LinearisedAt(const Eigen::VectorXd& shared,
                                std::size_t begin,
                                std::size_t end) const;

  const std::vector<Eigen::Quaterniond>& attitudes() const { return attitudes_; }
  const std::vector<MotionNode>& nodes() const { return nodes_; }
  std::vector<MotionNode>& nodes() { return nodes_; }

  // Residuals of one sensor (the gyroscope: of the turns), per axis over its noise, and how much
  // of each the attitudes leave: 1 - leverage. Rows of what is not seen are zero and leave nothing.
  struct Residuals {
    Eigen::Matrix3Xd value;  // a node a column
    Eigen::Matrix3Xd left;
  };
  // `solved`: the whole chain, linearised.
  PerTriad<Residuals> AllResiduals(const ChainElimination& solved) const;

  // Of all turns, as if none were weighted down.
  std::vector<TurnMiss> TurnMisses(const ChainElimination& solved) const;

  // By how much more than corrected a vector sensor's clock is ahead of the gyroscope's, with its
  // σ: the residuals against how fast the field turns, dx/dt = x x omega.
  struct ClockError {
    double ahead_s = 0.0;
    double sigma_s = 0.0;
  };
  ClockError ClockErrorOf(Triad triad, const double* shared) const;

  // From now on rows are tested for these, too; `shared` is where the models are taken from.
  void SetProbes(const std::vector<ProbedTerm>& probes, const double* shared);

 private:
  // Rate and angular acceleration at a node, body frame; unset where the chain is broken.
  struct Turning {
    Eigen::Vector3d rate_radps, acceleration_radps2;
  };
  std::optional<Turning> TurningAt(std::size_t k) const;

  // How a probe enters the reading, or the turn, of a sensor at a node; unset where it does not.
  std::optional<ProbedRow::Probe> ProbeAt(const ProbedTerm& probe,
                                          std::size_t k,
                                          const std::optional<Turning>& turning) const;
  // All of a sensor that do.
  std::vector<ProbedRow::Probe> ProbesAt(const std::vector<ProbedTerm>& probes,
                                         Triad triad,
                                         std::size_t k,
                                         const std::optional<Turning>& turning) const;

  // Of nodes from `begin` to before `end`, without priors.
  ChainProblem Problem(std::size_t begin, std::size_t end) const;
  Eigen::Vector3d VectorRoot(Triad triad, const GatheredReadings& seen) const;
  // In a problem of nodes from `begin` to before `end`.
  bool HoldsHeading(std::size_t k, std::size_t begin, std::size_t end) const;

  const SharedLayout& layout_;
  const std::vector<ScalarPrior>& priors_;
  const MotionTrack& track_;
  std::vector<MotionNode> nodes_;
  std::vector<Eigen::Quaterniond> attitudes_;
  // Of each node: its readings and the turn to the next, null where it has none.
  std::vector<PerTriad<std::shared_ptr<const Row>>> rows_;

  PerTriad<TriadModel<double>> models_;  // where there are probes
  ReferenceVector reference_ = ReferenceVector::Zero();

  PerTriad<Eigen::Vector3d> inverse_sigma_;                  // of one reading of a vector sensor
  Eigen::Matrix3d turn_root_ = Eigen::Matrix3d::Identity();  // of a turn that takes one second
};

// The model of a triad at `shared`, without temperature terms; the gyroscope with its
// g-sensitivity.
TriadModel<double> ModelOf(const SharedLayout& layout, Triad triad, const double* shared);
GyroModel GyroscopeOf(const SharedLayout& layout, const double* shared);

}  // namespace truetriad
