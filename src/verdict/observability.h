// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/shared_information.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// What the poses leave open, in words.
struct Observability {
  bool determined = true;                      // every direction below the limit
  std::vector<WeakDirection> weak_directions;  // worst first; may hold warnings though determined
};

// Looks at every eigen-direction of the reduced information in typical units (a bias as large as
// the signal, a gain of 100 %). A direction whose σ exceeds `limit` is not determined; one that
// stands out (a quarter of the limit, or 10 times the median and 1 % of the signal) is named as
// weak. The advice names the pose, of a grid of attitudes, whose single addition shrinks the
// direction's variance most.
//
// `how_to_add`: how more readings in an attitude come about; advice begins with it.
Observability AnalyseObservability(const PoseGraph& graph,
                                   const SharedInformation& system,
                                   double limit,
                                   const char* how_to_add = "add poses");

// The parameter, but no tilt of a block, whose σ is the largest share of its typical size.
struct LeastKnown {
  std::string name;  // as people say it
  double share = 0.0;
};
LeastKnown LeastKnownOf(const PoseGraph& graph, const Eigen::MatrixXd& covariance);

}  // namespace truetriad
