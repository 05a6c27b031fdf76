// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "problem/start_values.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The triad that fixes the body frame: the accelerometer if it is enabled, else the magnetometer,
// or a gyroscope that is alone. docs/method.md, "Gauge".
Triad LeadingTriad(const CalibrateOptions& options);

// Sign of the leading triad's own axes in the body frame: -1 for a chip that reports gravity.
double LeadingAxisSign(const CalibrateOptions& options);

// Directions of the leading triad's sensing axes in a body frame that this triad defines: as its
// stated mounting, or along the frame's axes. Identity if the frame is defined from outside.
Eigen::Matrix3d LeadingAxisMap(const CalibrateOptions& options);

// GaugeRotation of the leading triad in terms of its sensing axes, wherever they lie in the body.
Eigen::Matrix3d LeadingGaugeRotation(const CalibrateOptions& options,
                                     Gauge gauge,
                                     const Eigen::Matrix3d& sensitivity);

// Sets, from the nodes and the start values, the place of each shared block, its free entries,
// their start values, and the attitudes that are not given.
void LayOutParameters(const CalibrateOptions& options, const StartValues& start, PoseGraph* graph);

// Sets the priors of the free entries, and removes all others.
void AddPriors(const CalibrateOptions& options, PoseGraph* graph);

}  // namespace truetriad
