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

// Fourteen unknowns (nine of the matrix, three of the bias, two angles); each pose gives three
// equations.
constexpr std::size_t kFewestPoses = 5;
constexpr int kGridPoints = 100;  // About 14 degrees apart on half of the sphere.
// Only a bound: if it starts up to 14 degrees away, Gauss-Newton converges in a few steps.
constexpr int kMostSteps = 50;
// Chosen: pivots of the field's directions in the body below this share of the largest count as
// zero; if one is zero, the attitudes are turns about a single axis.
constexpr double kThin = 1e-3;

// The fit of matrix and bias for one direction of the field.
KnownFieldFit FitAt(const Eigen::Vector3d& direction,
                    const std::vector<Eigen::Vector3d>& readings,
                    const std::vector<Eigen::Quaterniond>& fixture_from_body,
                    double strength) {
  std::vector<Eigen::Vector3d> fields;
  fields.reserve(readings.size());
  for (const Eigen::Quaterniond& attitude : fixture_from_body) {
    fields.push_back(attitude.conjugate() * direction);
  }
  KnownFieldFit fit = FitKnownField(readings, fields, kThin);
  fit.model.sensitivity /= strength;
  return fit;
}

Eigen::Matrix<double, 3, 2> Tangents(const Eigen::Vector3d& direction) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = direction.unitOrthogonal();
  basis.col(1) = direction.cross(basis.col(0));
  return basis;
}

}  // namespace

KnownFieldFit FitKnownField(const std::vector<Eigen::Vector3d>& readings,
                            const std::vector<Eigen::Vector3d>& fields,
                            double thin) {
  Eigen::MatrixXd design(static_cast<Eigen::Index>(readings.size()), 4);
  Eigen::MatrixXd values(design.rows(), 3);
  for (Eigen::Index k = 0; k < design.rows(); ++k) {
    design.row(k) << fields[static_cast<std::size_t>(k)].transpose(), 1.0;
    values.row(k) = readings[static_cast<std::size_t>(k)].transpose();
  }
  const LeastSquares qr(design, thin);
  const Eigen::MatrixXd solution = qr.Solve(values);
  return {{solution.topRows<3>().transpose(), solution.row(3).transpose()},
          values - Times(design, solution),
          qr.rank() == 4};
}

Result<FixtureFit> FitInFixture(const std::vector<Eigen::Vector3d>& readings,
                                const std::vector<Eigen::Quaterniond>& fixture_from_body,
                                double strength) {
  CHECK_EQ(readings.size(), fixture_from_body.size());
  const Error not_enough = NotEnoughError(Finding(
      FindingCode::kFixtureUndetermined,
      "the fixture's orientation is unobservable from these attitudes",
      "give at least five attitudes, turned about several axes, with every axis up and down"));
  if (readings.size() < kFewestPoses) return not_enough;
  const auto fit_at = [&](const Eigen::Vector3d& direction) {
    return FitAt(direction, readings, fixture_from_body, strength);
  };
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  KnownFieldFit fit;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kGridPoints; ++i) {
    // The directions are on a golden spiral over the upper half of the sphere.
    const double z = (i + 0.5) / kGridPoints;
    const double angle = 2.0 * std::numbers::pi * std::numbers::phi * i;
    const double radius = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d direction(radius * std::cos(angle), radius * std::sin(angle), z);
    KnownFieldFit trial = fit_at(direction);
    if (!trial.is_determined || trial.residual.norm() >= least) continue;
    least = trial.residual.norm();
    best = direction;
    fit = std::move(trial);
  }
  if (!std::isfinite(least)) return not_enough;
  for (int step = 0; step < kMostSteps; ++step) {
    // Near the cube root of rounding (6e-6), the best step of central differences.
    constexpr double kDifference = 1e-5;
    const Eigen::Matrix<double, 3, 2> tangents = Tangents(best);
    Eigen::MatrixXd jacobian(fit.residual.size(), 2);
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
    // The step is halved until the residual falls.
    bool moved = false;
    for (double share = 1.0; share > 1e-3 && !moved; share *= 0.5) {
      const Eigen::Vector3d direction = (best + tangents * (share * change)).normalized();
      KnownFieldFit trial = fit_at(direction);
      moved = trial.is_determined && trial.residual.norm() < fit.residual.norm();
      if (!moved) continue;
      best = direction;
      fit = std::move(trial);
    }
    if (!moved || change.norm() < 1e-12) break;
  }
  FixtureFit result;
  result.model = fit.model;
  result.direction = best;
  if (result.model.sensitivity.determinant() < 0.0) {
    result.model.sensitivity *= -1.0;
    result.direction *= -1.0;
  }
  return result;
}

}  // namespace truetriad
