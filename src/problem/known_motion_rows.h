// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "problem/graph.h"
#include "problem/start_values.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Appends the nodes of the stated motions:
//
//   a rate    a node at the known rate w: S w + b + G f - y, y the mean reading; an unknown axis of
//             w is the node's direction
//   a turn    two held nodes, Identity and Exp(angle * axis), which an increment will join, so that
//             the residual wraps at whole turns; and a node at the mean rate angle / T * axis,
//             which determines the axis alone
//
// A whole turn ends where it began, whatever its axis, so that only the mean rate shows the axis.
// The increment of a partial turn gives weight only to the angle, so that the axis is not used
// twice. Turns that are held out, or whose readings have a fault, get no node. Error (bad input): a
// known rate without gyroscope reading; a motion without temperature, if temperature terms are
// wanted.
Status AddKnownMotions(const PoseSet& poses,
                       const CalibrateOptions& options,
                       const PerTriad<NoiseSource>& sources,
                       std::vector<PoseNode>* nodes);

// Adds the increments of the known turns. In the nodes of known turns and rates, sets the values
// that depend on the start values: the specific force and, for turns, the noise of the mean rate.
void JoinKnownTurns(const PoseSet& poses, const StartValues& start, PoseGraph* graph);

// The increment of a single known turn, integrated at the parameters of `graph`.
IncrementEdge EdgeOfTurn(const KnownTurn& turn,
                         const PoseSet& poses,
                         const TriadModel<double>* accelerometer,
                         const PoseGraph& graph);

// Sensitivity and bias of a gyroscope by linear least squares on the mean readings of known motions
// and rests. Error (not enough): the readings do not determine both.
Result<TriadModel<double>> GyroscopeFromKnownMotions(const PoseSet& poses);

// Error (bad input): according to the gyroscope's start values, the angle of a turn differs from
// the stated angle by half a turn or more.
Status CheckTurnCounts(const PoseSet& poses, const StartValues& start);

// Compares each known turn with the solution.
std::vector<TurnCheck> CheckTurns(const PoseSet& poses,
                                  const PoseGraph& graph,
                                  const Eigen::MatrixXd& free_covariance,
                                  double excess_variance);

}  // namespace truetriad
