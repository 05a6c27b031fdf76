// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "truetriad/model/calibration.h"
#include "verdict/presentation.h"

namespace truetriad {

// Values of one calibration that are compared with the values of the same names in another one.
struct ComparedValues {
  std::vector<std::string> names;
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;
};

// All values that the solution's covariance lists, except the reference (gravity and field).
ComparedValues ValuesInFrame(const PresentedSolution& solution);

// The values that no rotation of the body frame changes: biases with their temperature terms,
// higher terms, and for each sensitivity, as "accelerometer.gram.xy" and so on, the entries of
//
//   G = C^T C      dG = -(G dS C + (G dS C)^T)      C = S^-1
//
// A reading r, after its bias is subtracted, has the squared length r^T G r in true units. Groups
// of values that a rotation does change are not compared; they are named in `left_out`.
ComparedValues ValuesWithoutFrame(const PresentedSolution& solution,
                                  std::vector<std::string>* left_out);

}  // namespace truetriad
