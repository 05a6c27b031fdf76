// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "faults/search.h"
#include "verdict/checks/soak.h"
#include "verdict/recording_faults.h"

namespace truetriad {

// Effects in a recording that the model lacks; each adds to the solution's covariance.
struct Unmodelled {
  FaultFindings faults;
  std::vector<Triad> stated_bends;  // sensors whose widening `faults` begins with
  DriftCovariance drift;
  RecordingFaults of_recording;      // faults that no residual shows
  std::vector<ClockOffset> clocks;   // beyond the corrected ones
  std::vector<double> clock_sigmas;  // the largest shift by each, in σ of a parameter
  Eigen::MatrixXd by_clocks;

  // Covariance of the free shared coordinates.
  Eigen::MatrixXd Covariance() const;
};

// Finds faults and includes them in the graph, its noise and its system; lists stated bends.
FaultFindings TakeFaultsIn(const CalibrateOptions& options,
                           std::vector<Triad>* stated_bends,
                           PoseGraph* graph,
                           NoiseState* noise,
                           ReducedSystem* system);

// Finds all effects but faults, whose readings are corrected. `sigma_raw`: of one reading;
// `settings`: of the graph.
void FindBeyondFaults(const PoseSet& poses,
                      const PerTriad<Eigen::Vector3d>& sigma_raw,
                      const PoseGraph& graph,
                      const ReducedSystem& system,
                      const std::vector<TemperatureSetting>& settings,
                      Unmodelled* found);

}  // namespace truetriad
