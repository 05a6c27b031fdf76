// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "problem/start_values.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The triad that defines the body frame: the gyroscope if no other triad is enabled, else the
// accelerometer if it is enabled, else the magnetometer. docs/method.md, "Gauge".
Triad LeadingTriad(const CalibrateOptions& options);

// Sign of the leading triad's own axes in the body frame: -1 for a chip that reports gravity.
double LeadingAxisSign(const CalibrateOptions& options);

// Directions of the leading triad's sensing axes in the body frame that this triad defines: its
// stated mounting. If no mounting is stated, or the frame is defined from outside: the identity.
Eigen::Matrix3d LeadingAxisMap(const CalibrateOptions& options);

// GaugeRotation of the leading triad: computed in the frame of its sensing axes (LeadingAxisMap)
// and returned in the body frame.
Eigen::Matrix3d LeadingGaugeRotation(const CalibrateOptions& options,
                                     Gauge gauge,
                                     const Eigen::Matrix3d& sensitivity);

// From the nodes and the start values, sets the place of each shared block, its free entries and
// its start values. Also sets the attitudes that are not given.
void LayOutParameters(const CalibrateOptions& options, const StartValues& start, PoseGraph* graph);

// Replaces the priors of the graph by those that `options` state for free entries.
void AddPriors(const CalibrateOptions& options, PoseGraph* graph);

}  // namespace truetriad
