// SPDX-License-Identifier: Apache-2.0
#include "math/dense/eigenvalues.h"
#include "model/directions.h"
#include "truetriad/model/quality.h"

namespace truetriad {

Coverage DirectionCoverage(Triad triad, const std::vector<Eigen::Vector3d>& directions) {
  Coverage coverage;
  coverage.triad = triad;
  if (directions.empty()) return coverage;
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& direction : directions) moment += direction * direction.transpose();
  moment /= static_cast<double>(directions.size());
  coverage.eigenvalues = EigenOfSymmetric3(moment).values;
  coverage.largest_gap_deg = LargestGap(directions).radius_deg;
  return coverage;
}

}  // namespace truetriad
