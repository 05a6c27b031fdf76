// SPDX-License-Identifier: Apache-2.0
#include "start/triad_fits.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <Eigen/LU>

#include "init/ellipsoid_consensus.h"
#include "init/ellipsoid_fit.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/qr.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "problem/start_values.h"

namespace truetriad {
namespace {

// Most readings are good: what this share of them agrees with is no work of bad ones.
constexpr double kMostShare = 0.72;
// Of the field. A fit that most readings are closer to has not been drawn away by others.
constexpr double kGoodMisfit = 0.01;
// A fit to some of the readings replaces that to all where most are so much closer to it.
constexpr double kBetterShare = 0.5;

Result<TriadModel<double>> FitModel(const std::vector<Eigen::Vector3d>& readings,
                                    MatrixModel model,
                                    double radius) {
  TriadModel<double> result;
  const auto ellipsoid =
      model == MatrixModel::kDiagonal ? FitAxisAlignedEllipsoid(readings) : FitEllipsoid(readings);
  if (!ellipsoid) return ellipsoid.error();
  result.bias = ellipsoid->centre;
  if (model == MatrixModel::kDiagonal) {
    result.sensitivity = (ellipsoid->AxisRadii() / radius).asDiagonal();
  } else {
    result.sensitivity = SymmetricSensitivity(*ellipsoid, radius);
  }
  return result;
}

// Refitted without readings whose norm error stands out from the others'.
Result<TriadModel<double>> FitTrimmed(std::vector<Eigen::Vector3d> readings,
                                      MatrixModel model,
                                      double radius) {
  auto fitted = FitModel(readings, model, radius);
  const std::size_t parameters = model == MatrixModel::kDiagonal ? 6 : 9;
  for (int round = 0; round < 3 && fitted && readings.size() >= parameters + 5; ++round) {
    std::vector<double> errors;
    errors.reserve(readings.size());
    for (const auto& reading : readings)
      errors.push_back(std::abs(NormError(*fitted, reading, radius)) / radius);
    // The fit absorbs part of the noise, hence the wide 6 σ.
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

double RmsOf(const TriadModel<double>& model,
             const std::vector<Eigen::Vector3d>& readings,
             double radius) {
  double sum = 0.0;
  for (const Eigen::Vector3d& reading : readings) {
    sum += std::pow(NormError(model, reading, radius), 2);
  }
  return std::sqrt(sum / static_cast<double>(readings.size()));
}

// Without those few that alone keep the others from fitting: each goes that makes the greatest
// difference, as long as that is no chance. Of few readings a consensus of most finds any.
std::vector<Eigen::Vector3d> WithoutSpoilers(std::vector<Eigen::Vector3d> readings,
                                             MatrixModel model,
                                             double radius) {
  constexpr std::size_t kMost = 100;  // of which a fit each is cheap
  constexpr int kMostSpoilers = 3;
  constexpr std::size_t kFewestDof = 4;
  // With four degrees of freedom one of 20 readings does so in 1 of 1e4 tables.
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

// Raw units of one true unit.
double ScaleOf(const TriadModel<double>& model) {
  return std::cbrt(std::abs(model.sensitivity.determinant()));
}

// How far most readings are from the model, raw unit: relative to its field an ellipsoid that runs
// to infinity would be the best.
double MisfitOf(const TriadModel<double>& model,
                const std::vector<Eigen::Vector3d>& readings,
                double radius) {
  std::vector<double> errors;
  errors.reserve(readings.size());
  for (const auto& reading : readings) {
    errors.push_back(std::abs(NormError(model, reading, radius)) * ScaleOf(model));
  }
  return LowerQuantile(std::move(errors), kMostShare);
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

Result<TriadModel<double>> FitModelTrimmed(const std::vector<Eigen::Vector3d>& all,
                                           MatrixModel model,
                                           double radius) {
  const std::vector<Eigen::Vector3d> readings = WithoutSpoilers(all, model, radius);
  auto fitted = FitTrimmed(readings, model, radius);
  if (fitted && MisfitOf(*fitted, readings, radius) < kGoodMisfit * ScaleOf(*fitted) * radius) {
    return fitted;
  }
  // Bad readings that are few but far off, or many, may make any fit.
  auto agreeing = ReadingsOfOneEllipsoid(readings, model == MatrixModel::kDiagonal);
  if (agreeing.size() == readings.size()) return fitted;
  auto robust = FitTrimmed(std::move(agreeing), model, radius);
  const bool is_better =
      robust && (!fitted || MisfitOf(*robust, readings, radius) <
                                kBetterShare * MisfitOf(*fitted, readings, radius));
  return is_better && Acts(Mechanism::kConsensus) ? robust : fitted;
}

Result<TriadModel<double>> FitKnownField(const std::vector<Eigen::Vector3d>& readings,
                                         const std::vector<Eigen::Vector3d>& fields) {
  Eigen::MatrixXd design(static_cast<Eigen::Index>(readings.size()), 4);
  Eigen::MatrixXd values(design.rows(), 3);
  for (Eigen::Index k = 0; k < design.rows(); ++k) {
    design.row(k) << fields[static_cast<std::size_t>(k)].transpose(), 1.0;
    values.row(k) = readings[static_cast<std::size_t>(k)].transpose();
  }
  const LeastSquares qr(design);
  if (qr.rank() < 4) {
    return NotEnoughError(
        Finding(FindingCode::kTooFewDirections,
                "the known attitudes lie in one plane, so gains and biases are unobservable",
                "add poses with every axis up and down"));
  }
  const Eigen::MatrixXd solution = qr.Solve(values);
  return TriadModel<double>{solution.topRows<3>().transpose(), solution.row(3).transpose()};
}

}  // namespace truetriad
