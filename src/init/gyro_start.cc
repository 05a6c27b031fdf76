// SPDX-License-Identifier: Apache-2.0
#include "truetriad/init/gyro_start.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

using Matrix39 = Eigen::Matrix<double, 3, 9>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

constexpr int kRefinements = 8;
// Turns whose smallest singular value is below this share of the largest turn about too few axes.
constexpr double kThinTurns = 1e-4;

// A vector that stands still in the world turns in the body as du/dt = u x omega. With omega = C y
// the change over a move is linear in C: the sum of y_j [u]_x dt, column by column.
Matrix39 DirectionChange(const DirectionMove& move, const Eigen::Vector3d& bias_raw) {
  Matrix39 change = Matrix39::Zero();
  const GyroMove& gyro = move.move;
  for (std::size_t i = 1; i < gyro.time_s.size(); ++i) {
    const double half_s = 0.5 * (gyro.time_s[i] - gyro.time_s[i - 1]);
    for (const std::size_t at : {i - 1, i}) {
      const Eigen::Matrix3d weighted = half_s * Skew(move.direction[at].normalized());
      const Eigen::Vector3d raw = gyro.reading_raw[at] - bias_raw;
      for (Eigen::Index j = 0; j < 3; ++j) change.middleCols<3>(3 * j) += raw[j] * weighted;
    }
  }
  return change;
}

}  // namespace

Result<Eigen::Matrix3d> FindGyroSensitivity(const std::vector<DirectionMove>& moves,
                                            const Eigen::Vector3d& bias_raw) {
  Matrix9 information = Matrix9::Zero();
  Vector9 gradient = Vector9::Zero();
  for (const DirectionMove& move : moves) {
    const Matrix39 change = DirectionChange(move, bias_raw);
    information += change.transpose() * change;
    gradient += change.transpose() * (move.after - move.before);
  }
  const Eigen::JacobiSVD<Matrix9> svd(information, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vector9& values = svd.singularValues();
  if (!(std::sqrt(values[8]) > kThinTurns * std::sqrt(values[0]))) {
    return NotEnoughError(
        "gyroscope: the turns between the poses do not show all of its axes; turn the unit about "
        "three different axes, each both ways");
  }
  const Vector9 solution = svd.solve(gradient);
  const Eigen::Matrix3d correction = solution.reshaped(3, 3);
  GyroModel model{{correction.inverse(), bias_raw}};
  // What the accelerometer read while the unit was pushed about has spoilt this a little: now from
  // the directions at rest alone, Gauss-Newton.
  for (int round = 0; round < kRefinements; ++round) {
    information.setZero();
    gradient.setZero();
    for (const DirectionMove& move : moves) {
      const GyroIncrement increment =
          IntegrateMove(move.move, model, Eigen::Vector3d::Ones(), RateSampling::kInstantaneous);
      const Eigen::Vector3d predicted = increment.rotation.conjugate() * move.before;
      // Exp(-J d) u = u + [u]_x J d.
      const Matrix39 by_sensitivity = Skew(predicted) * increment.by_sensitivity;
      information += by_sensitivity.transpose() * by_sensitivity;
      gradient += by_sensitivity.transpose() * (move.after - predicted);
    }
    const Vector9 step = information.ldlt().solve(gradient);
    if (!step.allFinite()) break;
    model.triad.sensitivity += step.reshaped(3, 3);
    if (step.norm() < 1e-9 * model.triad.sensitivity.norm()) break;
  }
  if (!model.triad.sensitivity.allFinite()) {
    return NotEnoughError(
        "gyroscope: its readings do not explain how gravity turned between the poses");
  }
  return model.triad.sensitivity;
}

}  // namespace truetriad
