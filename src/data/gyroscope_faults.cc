// SPDX-License-Identifier: Apache-2.0
#include "data/gyroscope_faults.h"

namespace truetriad {

std::vector<EqualReadings> RunsOfEquals(const std::vector<Eigen::Vector3d>& readings,
                                        std::optional<Eigen::Index> axis,
                                        std::size_t fewest) {
  std::vector<EqualReadings> runs;
  const auto are_equal = [&](std::size_t i, std::size_t k) {
    return axis ? readings[i][*axis] == readings[k][*axis] : readings[i] == readings[k];
  };
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= readings.size(); ++i) {
    if (i < readings.size() && are_equal(i, begin)) continue;
    if (i - begin >= fewest) runs.push_back({begin, i});
    begin = i;
  }
  return runs;
}

}  // namespace truetriad
