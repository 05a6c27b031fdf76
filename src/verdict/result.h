// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"
#include "verdict/presentation.h"

namespace truetriad {

// The last steps of every calibration, whether from rests, a motion or a sweep.

// A sensor whose units are set, and nothing else.
TriadCalibration InUnits(Triad triad, const PoseSet& poses);

// States gravity, field, dip and fixture rotation as they were used or estimated.
void StateReference(const CalibrateOptions& options,
                    const PoseGraph& graph,
                    ReferenceValues* stated);

// Body axes along which the sensing axes point: the stated mounting, or if none is stated, the axis
// map that is nearest to the sensitivity.
Eigen::Matrix3d MountingOf(const CalibrateOptions& options,
                           Triad triad,
                           const Eigen::Matrix3d& sensitivity);

// Writes the wanted sensors with their σ, and the covariance, into `calibration`.
void StateSolution(const CalibrateOptions& options,
                   const PoseSet& poses,
                   const PresentedSolution& solution,
                   const PerTriad<TriadNoise>& noise,
                   Calibration* calibration);

// Derives the outcome from the findings. A refused solution loses its numbers, so that nobody uses
// them; a usable one is judged by the limits. Error (usage): a limit that cannot be judged.
Status Conclude(const CalibrateOptions& options, const PoseSet& poses, Calibration* calibration);

}  // namespace truetriad
