// SPDX-License-Identifier: Apache-2.0
#include "truetriad/model/coverage.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "math/dense/eigenvalues.h"
#include "model/directions.h"

namespace truetriad {

Coverage DirectionCoverage(Triad triad, const std::vector<Eigen::Vector3d>& directions) {
  Coverage coverage;
  coverage.triad = triad;
  if (directions.empty()) return coverage;
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& direction : directions) moment += direction * direction.transpose();
  moment /= static_cast<double>(directions.size());
  coverage.eigenvalues = EigenOfSymmetric3(moment).values;
  constexpr int kGrid = 2000;
  double smallest_cosine = 1.0;
  for (int i = 0; i < kGrid; ++i) {
    const Eigen::Vector3d point = EvenDirection(i, kGrid);
    double nearest = -1.0;
    for (const Eigen::Vector3d& direction : directions) {
      nearest = std::max(nearest, point.dot(direction));
    }
    smallest_cosine = std::min(smallest_cosine, nearest);
  }
  coverage.largest_gap_deg =
      std::acos(std::clamp(smallest_cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
  return coverage;
}

}  // namespace truetriad
