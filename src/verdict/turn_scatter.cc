// SPDX-License-Identifier: Apache-2.0
#include "verdict/turn_scatter.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

#include "math/dense/eigenvalues.h"
#include "math/distributions.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// Of turns: fewer tell no scatter along their axes from that across.
constexpr double kFewestTurns = 8.0;
// Share of a turn's own information about a direction below which the attitudes take over all.
constexpr double kToldOfTurn = 1e-3;

}  // namespace

Eigen::Matrix3d SquaredSteps(const GyroReadings& readings, const TriadModel<double>& gyroscope) {
  const Eigen::Matrix3d correction = gyroscope.Correction();
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Quaterniond since = Eigen::Quaterniond::Identity();  // the end in the frame of a step
  for (std::size_t i = readings.time_s.size(); i-- > 1;) {
    const double step_s = readings.time_s[i] - readings.time_s[i - 1];
    const Eigen::Vector3d mean_raw = 0.5 * (readings.reading_raw[i] + readings.reading_raw[i - 1]);
    const Eigen::Vector3d step = step_s * (correction * (mean_raw - gyroscope.bias));
    const Eigen::Vector3d at_end = since.conjugate() * step;
    sum += at_end * at_end.transpose();
    since = RotationExp(step) * since;
  }
  return sum;
}

ShareOfRows ShareOfTurnScatter(const std::vector<TurnMiss>& misses) {
  struct Along {
    double projected2, told, steps;
  };
  std::vector<Along> turns;
  double along = 0.0, across = 0.0, across_count = 0.0;
  for (const TurnMiss& miss : misses) {
    const SymmetricEigen3 steps = EigenOfSymmetric3(miss.steps);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d e = steps.vectors.col(axis);
      const double told = e.dot(miss.projector * e);
      if (told < kToldOfTurn * e.dot(miss.information * e)) continue;
      const double squared = std::pow(e.dot(miss.projected), 2);
      if (axis < 2) {
        across += squared / told;
        across_count += 1.0;
      } else {
        along += squared / told;
        turns.push_back({squared, told, steps.values[2]});
      }
    }
  }
  const auto count = static_cast<double>(turns.size());
  if (count < kFewestTurns || across_count < kFewestTurns || !(across > 0.0)) return {};
  const double scatter = across / across_count;
  double beyond = 0.0, expected = 0.0;
  for (const Along& turn : turns) {
    beyond += turn.projected2 - scatter * turn.told;
    expected += turn.told * turn.told * turn.steps;
  }
  return {std::clamp(beyond / expected, 0.0, 0.5),
          1.0 - FisherCdf(along / count / scatter, count, across_count)};
}

}  // namespace truetriad
