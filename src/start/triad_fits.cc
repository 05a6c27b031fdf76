// SPDX-License-Identifier: Apache-2.0
#include "start/triad_fits.h"

#include <cmath>
#include <cstddef>
#include <utility>

#include <Eigen/LU>

#include "init/ellipsoid_fit.h"
#include "init/fixture_fit.h"
#include "math/dense/qr.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "problem/start_values.h"

namespace truetriad {
namespace {

// Chosen, as a share of the field: if the residuals of a fit are smaller, outliers have not
// distorted it.
constexpr double kGoodMisfit = 0.01;

Result<TriadModel<double>> FitModel(const std::vector<Eigen::Vector3d>& readings,
                                    MatrixModel model,
                                    double radius) {
  TriadModel<double> result;
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Ellipsoid ellipsoid,
      model == MatrixModel::kDiagonal ? FitAxisAlignedEllipsoid(readings) : FitEllipsoid(readings));
  result.bias = ellipsoid.centre;
  if (model == MatrixModel::kDiagonal) {
    result.sensitivity = (ellipsoid.AxisRadii() / radius).asDiagonal();
  } else {
    result.sensitivity = SymmetricSensitivity(ellipsoid, radius);
  }
  return result;
}

double RmsOf(const TriadModel<double>& model,
             const std::vector<Eigen::Vector3d>& readings,
             double radius) {
  double sum = 0.0;
  for (const Eigen::Vector3d& reading : readings) {
    sum += std::pow(NormError(model, reading, radius), 2);
  }
  return std::sqrt(sum / static_cast<double>(readings.size()));
}

// Removes up to three outliers that keep the other readings from fitting. Each round removes the
// reading without which the RMS is least, if the RMS falls by more than chance explains.
std::vector<Eigen::Vector3d> WithoutSpoilers(std::vector<Eigen::Vector3d> readings,
                                             MatrixModel model,
                                             double radius) {
  constexpr std::size_t kMost = 100;  // Up to so many readings, a fit without each is fast.
  // Chosen: more outliers than three are left to the robust fit.
  constexpr int kMostSpoilers = 3;
  // At least this many degrees of freedom remain after a removal; the chance stated below is
  // computed for this number.
  constexpr std::size_t kFewestDof = 4;
  // A reading is an outlier if it raises the RMS at least by this factor. With four degrees of
  // freedom and normal noise, one of 20 readings does so by chance in 1 of 1e4 data sets.
  constexpr double kSpoils = 6.0;
  const std::size_t parameters = model == MatrixModel::kDiagonal ? 6 : 9;
  for (int round = 0; round < kMostSpoilers; ++round) {
    if (readings.size() > kMost || readings.size() < parameters + kFewestDof + 1) break;
    const auto all = FitModel(readings, model, radius);
    const double rms = all ? RmsOf(*all, readings, radius) : radius;
    if (rms < kGoodMisfit * radius) break;
    double least = rms / kSpoils;
    std::size_t worst = readings.size();
    for (std::size_t k = 0; k < readings.size(); ++k) {
      std::vector<Eigen::Vector3d> others = readings;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
      const auto without = FitModel(others, model, radius);
      if (!without) continue;
      const double left = RmsOf(*without, others, radius);
      if (!(left < least)) continue;
      least = left;
      worst = k;
    }
    if (worst == readings.size() || !Acts(Mechanism::kSpoilers)) break;
    readings.erase(readings.begin() + static_cast<std::ptrdiff_t>(worst));
  }
  return readings;
}

}  // namespace

TriadModel<double> FitBias(const std::vector<Eigen::Vector3d>& readings,
                           const Eigen::Matrix3d& sensitivity) {
  const Eigen::Matrix3d correction = sensitivity.inverse();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& reading : readings) centre += correction * reading;
  centre /= static_cast<double>(readings.size());
  Eigen::MatrixXd design(static_cast<Eigen::Index>(readings.size()), 4);
  Eigen::VectorXd squares(design.rows());
  for (Eigen::Index k = 0; k < design.rows(); ++k) {
    const Eigen::Vector3d point = correction * readings[static_cast<std::size_t>(k)] - centre;
    design.row(k) << 2.0 * point.transpose(), 1.0;
    squares[k] = point.squaredNorm();
  }
  const Eigen::Vector4d solution = LeastSquares(design).SolveVector(squares);
  return {sensitivity, sensitivity * (centre + solution.head<3>())};
}

Result<TriadModel<double>> FitModelTrimmed(std::vector<Eigen::Vector3d> readings,
                                           MatrixModel model,
                                           double radius) {
  readings = WithoutSpoilers(std::move(readings), model, radius);
  auto fitted = FitModel(readings, model, radius);
  const std::size_t parameters = model == MatrixModel::kDiagonal ? 6 : 9;
  for (int round = 0; round < 3 && fitted && readings.size() >= parameters + 5; ++round) {
    std::vector<double> errors;
    errors.reserve(readings.size());
    for (const auto& reading : readings)
      errors.push_back(std::abs(NormError(*fitted, reading, radius)) / radius);
    // The fit absorbs part of the noise, so the residuals are too small; the limit is therefore as
    // wide as 6 σ.
    const double limit = 6.0 * kMadToSigma * Median(errors);
    std::vector<Eigen::Vector3d> kept;
    for (std::size_t k = 0; k < readings.size(); ++k) {
      if (errors[k] <= limit) kept.push_back(readings[k]);
    }
    if (kept.size() == readings.size() || kept.size() < parameters + 3) break;
    if (!Acts(Mechanism::kTrimming)) break;
    auto refitted = FitModel(kept, model, radius);
    if (!refitted) break;
    fitted = std::move(refitted);
    readings = std::move(kept);
  }
  return fitted;
}

Result<TriadModel<double>> FitInKnownField(const std::vector<Eigen::Vector3d>& readings,
                                           const std::vector<Eigen::Vector3d>& fields) {
  const KnownFieldFit fit = FitKnownField(readings, fields);
  if (fit.is_determined) return fit.model;
  return NotEnoughError(
      Finding(FindingCode::kTooFewDirections,
              "the known directions of gravity in the body lie in one plane, so that gains and "
              "biases are unobservable",
              "add poses with every axis up and down"));
}

}  // namespace truetriad
