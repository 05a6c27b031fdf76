// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/shared_information.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The directions of parameter space that the poses do not determine, in words.
struct Observability {
  bool determined = true;                      // every direction has a σ below the limit
  std::vector<WeakDirection> weak_directions;  // worst first; some may be weak though determined
};

// Examines every eigen-direction of the reduced information in typical units (a bias as large as
// the signal, a gain of 100 %). A direction whose σ exceeds `limit` is undetermined; one with an
// outstanding σ (a quarter of the limit, or 10 times the median and 1 % of the signal) is reported
// as weak. The advice is the pose, of a grid of attitudes, whose addition reduces the direction's
// variance most.
//
// `how_to_add`: how to record more attitudes; advice begins with it.
Observability AnalyseObservability(const PoseGraph& graph,
                                   const SharedInformation& system,
                                   double limit,
                                   const char* how_to_add = "add poses");

// The parameter, other than a block's tilt, whose σ is the largest share of its typical size.
struct LeastKnown {
  std::string name;  // in spoken form
  double share = 0.0;
};
LeastKnown LeastKnownOf(const PoseGraph& graph, const Eigen::MatrixXd& covariance);

}  // namespace truetriad
