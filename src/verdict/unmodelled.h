// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "faults/search.h"
#include "verdict/checks/soak.h"
#include "verdict/recording_faults.h"

namespace truetriad {

// What a recording shows that the model does not have: all of it makes the solution less certain.
struct Unmodelled {
  FaultFindings faults;
  std::vector<Triad> stated_bends;  // whose widening the faults begin with
  DriftCovariance drift;
  RecordingFaults of_recording;      // what no residual shows
  std::vector<ClockOffset> clocks;   // beyond what was taken off
  std::vector<double> clock_sigmas;  // by which each of them moves some parameter
  Eigen::MatrixXd by_clocks;

  // Of the free shared coordinates.
  Eigen::MatrixXd Covariance() const;
};

// Takes faults in: graph and noise are what they are with them. `covariance`: of the graph.
FaultFindings TakeFaultsIn(const CalibrateOptions& options,
                           const Eigen::MatrixXd& covariance,
                           std::vector<Triad>* stated_bends,
                           PoseGraph* graph,
                           NoiseState* noise);

// The rest, of a graph without faults. `sigma_raw`: of one reading; `settings`: of the graph.
void FindBeyondFaults(const PoseSet& poses,
                      const PerTriad<Eigen::Vector3d>& sigma_raw,
                      const PoseGraph& graph,
                      const ReducedSystem& system,
                      const std::vector<TemperatureSetting>& settings,
                      Unmodelled* found);

}  // namespace truetriad
