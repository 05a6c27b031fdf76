// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Eigenvalues>

#include "model/corrected_error.h"
#include "report/sphere.h"

namespace truetriad {
namespace {

/// What there is to read, true unit; 0: nothing that makes a sphere.
double StrengthOf(const ReferenceValues& reference, Triad triad) {
  if (triad == Triad::kAccelerometer) return reference.gravity_mps2;
  return triad == Triad::kMagnetometer ? reference.field_ut.value_or(0.0) : 0.0;
}

}  // namespace

std::vector<SpherePoint> SpherePoints(const Calibration& calibration, Triad triad) {
  std::vector<SpherePoint> points;
  const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
  const double strength = StrengthOf(calibration.reference, triad);
  if (!sensor || !(strength > 0.0) || !calibration.IsUsable()) return points;
  const Eigen::Matrix3d nominal = NominalCorrection(*sensor, triad)
                                      .value_or(sensor->mounting.transpose() /
                                                std::cbrt(sensor->BySensingAxes().determinant()));
  for (const PoseResidual& pose : calibration.quality.rests.pose_residuals) {
    if (pose.triad != triad || !(pose.direction.norm() > 0.5)) continue;
    SpherePoint point;
    point.pose = pose.pose;
    point.is_rejected = !(pose.weight > 0.0);
    point.truth = pose.direction.normalized();
    const Eigen::Vector3d corrected = strength * point.truth + pose.residual;
    point.corrected = corrected / strength;
    point.raw = nominal * sensor->model.RawFromTruth(corrected) / strength;
    if (point.raw.allFinite() && point.corrected.allFinite()) points.push_back(point);
  }
  return points;
}

std::optional<WeakAxis> WeakAxisOf(const Calibration& calibration, Triad triad) {
  constexpr double kClearly = 2.0;  // Less is no direction to remark on.
  const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
  if (!sensor || !calibration.IsUsable()) return std::nullopt;
  const Eigen::Matrix3d correction = sensor->model.Correction();
  const Eigen::Matrix3d covariance =
      correction *
      BiasAndSensitivityCovariance(calibration.covariance, {triad}).topLeftCorner<3, 3>() *
      correction.transpose();
  if (!covariance.allFinite()) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance);
  const double sigma = std::sqrt(std::max(axes.eigenvalues()[2], 0.0));
  const double across = std::sqrt(std::max(axes.eigenvalues()[1], 0.0));
  if (!(across > 0.0) || sigma < kClearly * across) return std::nullopt;
  Eigen::Vector3d direction = axes.eigenvectors().col(2);
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  if (direction[largest] < 0.0) direction = -direction;
  return WeakAxis{direction, sigma, across};
}

double SphereMagnification(const std::vector<SpherePoint>& points) {
  // Errors of 0.4 radii keep all readings apart; what is a millionth of it nobody looks for.
  constexpr double kMost = 0.4, kLargest = 1e6;
  double greatest = 0.0;
  for (const SpherePoint& point : points) {
    if (!point.is_rejected) greatest = std::max(greatest, (point.raw - point.truth).norm());
  }
  double factor = 1.0;
  for (double decade = 1.0; decade < kLargest; decade *= 10.0) {
    for (const double digit : {1.0, 2.0, 5.0}) {
      if (digit * decade * greatest <= kMost) factor = digit * decade;
    }
  }
  return factor;
}

double SphereReach(const std::vector<SpherePoint>& points, double factor) {
  double reach = 1.0;
  for (const SpherePoint& point : points) {
    if (point.is_rejected) continue;
    reach = std::max(reach, Magnified(point.raw, point.truth, factor).norm());
  }
  return reach;
}

std::vector<SpherePoint> GreatestOfRuns(const std::vector<SpherePoint>& points, std::size_t most) {
  if (points.size() <= most) return points;
  std::vector<SpherePoint> kept;
  const auto error = [](const SpherePoint& point) {
    return (point.corrected - point.truth).norm();
  };
  for (std::size_t run = 0; run < most; ++run) {
    const std::size_t begin = run * points.size() / most, end = (run + 1) * points.size() / most;
    std::optional<std::size_t> greatest;
    for (std::size_t i = begin; i < end; ++i) {
      if (points[i].is_rejected) {
        kept.push_back(points[i]);
      } else if (!greatest || error(points[i]) > error(points[*greatest])) {
        greatest = i;
      }
    }
    if (greatest) kept.push_back(points[*greatest]);
  }
  return kept;
}

}  // namespace truetriad
