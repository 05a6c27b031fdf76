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
  // The stated faults of faults.widening, in its order: the nonlinearities that are stated for
  // these sensors, and then, if has_rounding, the rounding of a gyroscope at rest.
  std::vector<Triad> stated_bends;
  bool has_rounding = false;
  DriftCovariance drift;
  RecordingFaults of_recording;      // faults that no residual shows
  std::vector<ClockOffset> clocks;   // clock offsets that remain after corrections
  std::vector<double> clock_sigmas;  // for each clock: its largest shift of a parameter, in σ
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
// graph's readings are already corrected for faults. `sigma_raw`: σ of one reading; `settings`: the
// temperature settings of `graph`.
void FindBeyondFaults(const PoseSet& poses,
                      const PerTriad<Eigen::Vector3d>& sigma_raw,
                      const PoseGraph& graph,
                      const ReducedSystem& system,
                      const std::vector<TemperatureSetting>& settings,
                      Unmodelled* found);

}  // namespace truetriad
