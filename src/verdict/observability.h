// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/shared_information.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The directions of parameter space that the poses determine badly or not at all, in words.
struct Observability {
  bool determined = true;                      // every direction has a σ below the limit
  std::vector<WeakDirection> weak_directions;  // worst first; some may be weak though determined
};

// Examines the eigen-directions of the wanted parameters' covariance in typical units (a bias as
// large as the signal, a gain of 100 %). If σ along a direction exceeds `limit`, the direction is
// undetermined. If σ exceeds a quarter of the limit, or both 1 % and 10 times the median σ, the
// direction is reported as weak. The usual advice is to add a pose: of a grid of attitudes, the one
// that most reduces the variance along the direction.
//
// `how_to_add`: how to record more attitudes; such advice begins with these words.
Observability AnalyseObservability(const PoseGraph& graph,
                                   const SharedInformation& system,
                                   double limit,
                                   const char* how_to_add = "add poses");

// The parameter, other than a block's tilt, whose σ is the largest share of its typical size.
struct LeastKnown {
  std::string name;  // in words: "accelerometer scale x"
  double share = 0.0;
};
LeastKnown LeastKnownOf(const PoseGraph& graph, const Eigen::MatrixXd& covariance);

}  // namespace truetriad
