// SPDX-License-Identifier: Apache-2.0
#include "init/fixture_fit.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <glog/logging.h>

#include "math/dense/cholesky.h"
#include "math/dense/products.h"
#include "math/dense/qr.h"
#include "truetriad/model/finding.h"

namespace truetriad {
namespace {

// Fourteen unknowns, three numbers a pose.
constexpr std::size_t kFewestPoses = 5;
constexpr int kGridPoints = 100;  // About 14 degrees apart on half of the sphere.
// A guard: Gauss-Newton converges in a few steps from 14 degrees away.
constexpr int kMostSteps = 50;
// Of the field's directions in the body, against the largest: thinner is a turn about one axis.
constexpr double kThin = 1e-3;

// The linear part at one direction.
struct LinearFit {
  Eigen::MatrixXd solution;  // 4 x 3: S^T over b^T
  Eigen::MatrixXd residual;
  bool is_determined = false;
};

LinearFit FitAt(const Eigen::Vector3d& direction,
                const Eigen::MatrixXd& values,
                const std::vector<Eigen::Quaterniond>& fixture_from_body,
                double strength) {
  Eigen::MatrixXd design(values.rows(), 4);
  for (Eigen::Index k = 0; k < design.rows(); ++k) {
    const Eigen::Vector3d field =
        fixture_from_body[static_cast<std::size_t>(k)].conjugate() * direction;
    design.row(k) << field.transpose(), 1.0;
  }
  const LeastSquares qr(design, kThin);
  LinearFit fit;
  fit.is_determined = qr.rank() == 4;
  fit.solution = qr.Solve(values);
  fit.residual = values - Times(design, fit.solution);
  fit.solution.topRows<3>() /= strength;
  return fit;
}

Eigen::Matrix<double, 3, 2> Tangents(const Eigen::Vector3d& direction) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = direction.unitOrthogonal();
  basis.col(1) = direction.cross(basis.col(0));
  return basis;
}

}  // namespace

Result<FixtureFit> FitInFixture(const std::vector<Eigen::Vector3d>& readings,
                                const std::vector<Eigen::Quaterniond>& fixture_from_body,
                                double strength) {
  CHECK_EQ(readings.size(), fixture_from_body.size());
  const Error not_enough = NotEnoughError(
      Finding(FindingCode::kFixtureUndetermined,
              "the fixture's orientation is unobservable from these attitudes",
              "give at least five, about several axes, with every axis up and down"));
  if (readings.size() < kFewestPoses) return not_enough;
  Eigen::MatrixXd values(static_cast<Eigen::Index>(readings.size()), 3);
  for (Eigen::Index k = 0; k < values.rows(); ++k) {
    values.row(k) = readings[static_cast<std::size_t>(k)].transpose();
  }
  const auto fit_at = [&](const Eigen::Vector3d& direction) {
    return FitAt(direction, values, fixture_from_body, strength);
  };
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  LinearFit fit;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kGridPoints; ++i) {
    // A spiral over the upper half.
    const double z = (i + 0.5) / kGridPoints;
    const double angle = 2.0 * std::numbers::pi * std::numbers::phi * i;
    const double radius = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d direction(radius * std::cos(angle), radius * std::sin(angle), z);
    LinearFit trial = fit_at(direction);
    if (!trial.is_determined || trial.residual.norm() >= least) continue;
    least = trial.residual.norm();
    best = direction;
    fit = std::move(trial);
  }
  if (!std::isfinite(least)) return not_enough;
  for (int step = 0; step < kMostSteps; ++step) {
    // About the cube root of the rounding of a direction, as central differences want it.
    constexpr double kDifference = 1e-5;
    const Eigen::Matrix<double, 3, 2> tangents = Tangents(best);
    Eigen::MatrixXd jacobian(values.size(), 2);
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector3d move = kDifference * tangents.col(axis);
      jacobian.col(axis) = (fit_at((best + move).normalized()).residual -
                            fit_at((best - move).normalized()).residual)
                               .reshaped() /
                           (2.0 * kDifference);
    }
    const Eigen::VectorXd residual = fit.residual.reshaped();
    const Eigen::Vector2d change = -PivotedCholesky(TransposeTimes(jacobian, jacobian))
                                        .SolveVector(TransposeTimesVector(jacobian, residual));
    if (!change.allFinite()) break;
    // Shortened until it is a step down.
    bool moved = false;
    for (double share = 1.0; share > 1e-3 && !moved; share *= 0.5) {
      const Eigen::Vector3d direction = (best + tangents * (share * change)).normalized();
      LinearFit trial = fit_at(direction);
      moved = trial.is_determined && trial.residual.norm() < fit.residual.norm();
      if (!moved) continue;
      best = direction;
      fit = std::move(trial);
    }
    if (!moved || change.norm() < 1e-12) break;
  }
  FixtureFit result;
  result.model = {fit.solution.topRows<3>().transpose(), fit.solution.row(3).transpose()};
  result.direction = best;
  if (result.model.sensitivity.determinant() < 0.0) {
    result.model.sensitivity *= -1.0;
    result.direction *= -1.0;
  }
  return result;
}

}  // namespace truetriad
