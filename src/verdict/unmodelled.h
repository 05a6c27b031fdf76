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
  // In the order of faults.widening: the sensors of stated nonlinearities, then the rounding of a
  // gyroscope at rest.
  std::vector<Triad> stated_bends;
  bool has_rounding = false;
  DriftCovariance drift;
  RecordingFaults of_recording;      // faults that no residual shows
  std::vector<ClockOffset> clocks;   // that remain after corrections
  std::vector<double> clock_sigmas;  // largest shift by each, in the parameter's σ
  Eigen::MatrixXd by_clocks;

  // Covariance of the free shared coordinates.
  Eigen::MatrixXd Covariance() const;
};

// Finds faults and includes them in the graph, its noise and its system.
void TakeFaultsIn(const CalibrateOptions& options,
                  const PoseSet& poses,
                  PoseGraph* graph,
                  NoiseState* noise,
                  ReducedSystem* system,
                  Unmodelled* found);

// Finds the effects beyond TakeFaultsIn: drift, faults of single readings, clock offsets. The
// graph's readings are already corrected for faults. `sigma_raw`: of one reading; `settings`: of
// the graph.
void FindBeyondFaults(const PoseSet& poses,
                      const PerTriad<Eigen::Vector3d>& sigma_raw,
                      const PoseGraph& graph,
                      const ReducedSystem& system,
                      const std::vector<TemperatureSetting>& settings,
                      Unmodelled* found);

}  // namespace truetriad
