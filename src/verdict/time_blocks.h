// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/model/finding.h"

namespace truetriad {

// What a stretch of a recording, or another group of its poses, says of the free shared
// coordinates: information and gradient at the solution, its attitudes eliminated.
struct TimeBlock {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
};

// So many stretches of one length a recording is cut into.
inline constexpr int kTimeBlocks = 16;

// What groups of the nodes say, 0 … count − 1: `group_of` a node.
std::vector<TimeBlock> BlocksOf(const ReducedSystem& system,
                                std::size_t count,
                                const std::function<std::size_t(std::size_t)>& group_of);

// The stretches of a graph whose nodes are in the order of time, each by itself; none where there
// are too few.
std::vector<TimeBlock> TimeBlocksOf(const PoseGraph& graph, const ReducedSystem& system);

// Whether the stretches say the same.
struct BlockScatter {
  double ratio = 1.0;  // χ² of what they differ by over what noise makes of it
  double p_value = 1.0;
  // What the free coordinates are less certain by: the jackknife's covariance (Quenouille 1956,
  // Tukey 1958) of leaving out one stretch at a time,
  //
  //   (K - 1) / K sum_k d_k d_k^T      d_k = (M - M_k)^-1 g_k
  //
  // which holds whatever it is that the readings of one stretch have in common; and, where one step
  // between two stretches shows, the squares of how the solution would move without those before or
  // after it. Zero where chance may make the difference.
  Eigen::MatrixXd covariance;
};
// `information`: of the whole, with what is known beforehand. The stretches are compared in all
// coordinates at once, and in the biases of each triad, in its common gain and in the reference by
// themselves, where a change of one thing shows best; there also for one step.
BlockScatter ScatterOf(const std::vector<TimeBlock>& blocks,
                       const Eigen::MatrixXd& information,
                       const PoseGraph& graph);
// Says so.
Findings FindingsOf(const BlockScatter& blocks);

}  // namespace truetriad
