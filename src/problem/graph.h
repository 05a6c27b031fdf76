// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "problem/increment_edge.h"
#include "problem/parameters.h"
#include "problem/pose_node.h"

namespace truetriad {

// A prior of one entry of the shared vector.
struct ScalarPrior {
  int index = 0;
  double mean = 0.0;
  double sigma = 1.0;
};

// The factor graph (docs/method.md, "Factors"): shared parameters, one node per pose, the turns
// between nodes, priors.
struct PoseGraph {
  SharedLayout layout;
  Eigen::VectorXd shared;
  std::vector<PoseNode> nodes;
  std::vector<IncrementEdge> increments;  // sorted by their first node
  Eigen::VectorXd integrated_at;  // the shared parameters at which the increments were integrated
  std::vector<ScalarPrior> priors;
  Solver solver = Solver::kEliminated;
  // The rotation by which the given attitudes were transformed from the fixture's frame into a
  // level frame.
  Eigen::Quaterniond level_from_fixture = Eigen::Quaterniond::Identity();

  // Sensitivity (raw per true unit) and bias (raw unit) of a triad at the reference temperature.
  Eigen::Map<const Eigen::Matrix3d> sensitivity(Triad triad) const {
    return Eigen::Map<const Eigen::Matrix3d>(&shared[layout.sensitivity[triad]]);
  }
  Eigen::Map<const Eigen::Vector3d> bias(Triad triad) const {
    return Eigen::Map<const Eigen::Vector3d>(&shared[layout.bias[triad]]);
  }
  // The model of a triad at the temperature and in the session of a pose.
  TriadModel<double> ModelAt(Triad triad, const PoseNode& node) const {
    return node.ModelOfTriad(layout, shared.data(), triad);
  }
  ReferenceVector reference() const { return shared.segment<kReferenceSize>(layout.reference); }
};

}  // namespace truetriad
