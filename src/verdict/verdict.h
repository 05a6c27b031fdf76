// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "noise/noise_settling.h"
#include "problem/graph.h"
#include "problem/start_values.h"
#include "start/start.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"
#include "verdict/presentation.h"

namespace truetriad {

inline constexpr const char* kLeftHandedGyroscope =
    "the gyroscope's axes came out left-handed (determinant < 0): its log, the accelerometer's, or "
    "what was stated of its turns exchanges two axes or reverses one";

inline constexpr const char* kLeftHandedMagnetometer =
    "the magnetometer's axes came out left-handed (determinant < 0); a wrong accelerometer `sign` "
    "or `hemisphere` would explain the data as well";

// A run whose weights, noise and solution have settled.
struct SettledRun {
  const PoseSet& poses;
  const CalibrateOptions& options;
  const PoseGraph& graph;
  const NoiseState& noise;
  bool converged = false;
};

// Everything that is reported, from the settled graph: quality, the verdict, and where it can be
// used the sensors with their covariance. Error (usage): a limit that cannot be judged.
Status StateVerdict(const SettledRun& run, Calibration* calibration);

// Parts of it that hold however the solution was found.
//
// A sensor's parameters with their σ; its noise is not filled in.
TriadCalibration SensorOf(Triad triad, const PoseSet& poses, const PresentedSolution& solution);
// Gravity and field as used or estimated.
void StateReference(const CalibrateOptions& options,
                    const PoseGraph& graph,
                    ReferenceValues* stated);
// Judges a usable calibration by the limits. Error (usage): a limit that cannot be judged.
Status StateLimits(const CalibrateOptions& options, const PoseSet& poses, Calibration* calibration);

// The start values as a calibration without uncertainty; `graph` is laid out at them.
void StateStart(const PoseSet& poses,
                const CalibrateOptions& options,
                const NoiseState& noise,
                const StartValues& start,
                const PoseGraph& graph,
                Calibration* calibration);

}  // namespace truetriad
