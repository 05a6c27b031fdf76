// SPDX-License-Identifier: Apache-2.0
#include "model/heading_error.h"

#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "model/corrected_error.h"

namespace truetriad {
namespace {

using RowVector6d = Eigen::Matrix<double, 1, 6>;

/// Heading of body x, clockwise from magnetic north, of a unit at rest with these readings.
double HeadingOf(const Eigen::Vector3d& specific_force, const Eigen::Vector3d& field) {
  const Eigen::Vector3d up = specific_force.normalized();
  const Eigen::Vector3d north = (field - field.dot(up) * up).normalized();
  const Eigen::Vector3d west = up.cross(north);
  return std::atan2(-west.x(), north.x());
}

/// Derivative of the heading with respect to specific force and field: central differences with a
/// relative step of 1e-6.
RowVector6d Slope(const Eigen::Vector3d& specific_force, const Eigen::Vector3d& field) {
  // Relative errors of the slope: 1e-10 (1e-16 / 1e-6) by rounding, 1e-12 by curvature.
  constexpr double kStep = 1e-6;
  RowVector6d slope;
  for (int i = 0; i < 6; ++i) {
    const auto at = [&](double sign) {
      Eigen::Vector3d f = specific_force, m = field;
      Eigen::Vector3d& moved = i < 3 ? f : m;
      moved[i % 3] += sign * kStep * moved.norm();
      return HeadingOf(f, m);
    };
    const double step = 2.0 * kStep * (i < 3 ? specific_force : field).norm();
    slope[i] = std::remainder(at(1.0) - at(-1.0), 2.0 * std::numbers::pi) / step;
  }
  return slope;
}

}  // namespace

std::vector<HeadingError> HeadingErrors(const Calibration& calibration, int count) {
  std::vector<HeadingError> errors;
  const ReferenceValues& reference = calibration.reference;
  const auto& accelerometer = calibration.sensors[Triad::kAccelerometer];
  const auto& magnetometer = calibration.sensors[Triad::kMagnetometer];
  if (!accelerometer || !magnetometer || calibration.covariance.parameters.empty() ||
      !reference.field_ut || !reference.dip_rad) {
    return errors;
  }
  const std::array<const TriadCalibration*, 2> sensors = {&*accelerometer, &*magnetometer};
  const std::array<Triad, 2> triads = {Triad::kAccelerometer, Triad::kMagnetometer};
  const Eigen::MatrixXd covariance =
      BiasAndSensitivityCovariance(calibration.covariance, {triads[0], triads[1]});
  for (int k = 0; k < count; ++k) {
    HeadingError error;
    error.heading_rad = 2.0 * std::numbers::pi * k / count;
    const double horizontal = *reference.field_ut * std::cos(*reference.dip_rad);
    const std::array<Eigen::Vector3d, 2> truth = {
        Eigen::Vector3d(0.0, 0.0, reference.gravity_mps2),
        Eigen::Vector3d(horizontal * std::cos(error.heading_rad),
                        horizontal * std::sin(error.heading_rad),
                        -*reference.field_ut * std::sin(*reference.dip_rad))};
    const RowVector6d slope = Slope(truth[0], truth[1]);
    Eigen::RowVectorXd by_parameters(24);
    std::array<std::optional<Eigen::Vector3d>, 2> raw;
    for (std::size_t s = 0; s < 2; ++s) {
      const TriadModel<double>& model = sensors[s]->model;
      const Eigen::RowVector3d of_raw =
          slope.segment<3>(3 * static_cast<Eigen::Index>(s)) * model.Correction();
      const Eigen::Index first = 12 * static_cast<Eigen::Index>(s);
      by_parameters.segment<3>(first) = of_raw;
      for (int j = 0; j < 3; ++j) {
        by_parameters.segment<3>(first + 3 * (j + 1)) = truth[s][j] * of_raw;
      }
      if (const auto nominal = NominalCorrection(*sensors[s], triads[s])) {
        raw[s] = *nominal * model.RawFromTruth(truth[s]);
      }
    }
    error.sigma_rad =
        std::sqrt(std::max((by_parameters * covariance * by_parameters.transpose()).value(), 0.0));
    if (raw[0] && raw[1]) {
      error.raw_rad =
          std::remainder(HeadingOf(*raw[0], *raw[1]) - error.heading_rad, 2.0 * std::numbers::pi);
    }
    errors.push_back(error);
  }
  return errors;
}

}  // namespace truetriad
