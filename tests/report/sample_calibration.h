// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "truetriad/model/calibration.h"

namespace truetriad {

/// Directions on a Fibonacci spiral: even, and the same every time.
inline Eigen::Vector3d SpiralDirection(int i, int count) {
  const double z = 1.0 - (2.0 * i + 1.0) / count;
  const double r = std::sqrt(1.0 - z * z);
  const double longitude = 2.0 * std::numbers::pi * i / std::numbers::phi;
  return {r * std::cos(longitude), r * std::sin(longitude), z};
}

inline void AddPoses(int count, Triad triad, double scale, Quality* quality) {
  for (int i = 0; i < count; ++i) {
    PoseResidual pose;
    pose.pose = i + 1;
    pose.triad = triad;
    pose.direction = SpiralDirection(i, count);
    pose.norm_error = scale * std::sin(1.7 * i);
    pose.norm_error_before = scale * (40.0 * pose.direction.x() - 15.0);
    pose.residual = pose.norm_error * pose.direction;
    pose.normalized = std::abs(std::sin(1.7 * i)) * 1.5;
    quality->rests.pose_residuals.push_back(pose);
  }
}

/// A usable accelerometer and magnetometer calibration with something in every field.
inline Calibration SampleCalibration(int poses = 24) {
  Calibration c;
  c.serial = "A0001";
  c.model = "demo-9dof";
  c.software_version = "0.1.0";
  c.created = "2026-01-31T12:00:00Z";
  c.inputs = {{"recording.csv", "0123456789abcdef0123456789abcdef", 120000}};
  c.outcome = Outcome::kConverged;
  c.within_limits = true;
  c.findings = {{FindingCode::kMessage, "det S_mag is positive; sign and hemisphere agree."}};
  c.reference.field_ut = 48.0;
  c.reference.dip_rad = 1.1345;
  c.reference.field_estimated = true;

  TriadCalibration accel;
  accel.input_unit = "m/s^2";
  accel.output_unit = "m/s^2";
  accel.model.bias = {0.051234, -0.120456, 0.204567};
  accel.model.sensitivity << 1.00231, 0, 0, 0.00312, 0.99871, 0, -0.00153, 0.00087, 1.00512;
  accel.bias_sigma = {0.00045, 0.00046, 0.00051};
  accel.sensitivity_sigma << 4.1e-5, 0, 0, 6.2e-5, 4.3e-5, 0, 6.0e-5, 6.1e-5, 4.9e-5;
  accel.noise.sigma = {0.00021, 0.00019, 0.00034};
  accel.noise.excess_sigma = 0.0013;
  accel.noise.excess_dof = 13.4;
  c.sensors[Triad::kAccelerometer] = accel;

  TriadCalibration mag;
  mag.input_unit = "counts";
  mag.output_unit = "uT";
  mag.model.bias = {132.4, -411.2, 87.9};
  mag.model.sensitivity << 10.12, 0.21, -0.11, 0.18, 9.87, 0.34, -0.09, 0.31, 10.44;
  mag.bias_sigma = {0.9, 1.1, 1.3};
  mag.sensitivity_sigma.setConstant(0.021);
  mag.noise.sigma = {0.4, 0.4, 0.5};
  mag.noise.source = NoiseSource::kConfig;
  c.sensors[Triad::kMagnetometer] = mag;

  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const std::string name(TriadName(triad));
    for (const char axis : {'x', 'y', 'z'}) {
      c.covariance.parameters.push_back(name + ".bias." + axis);
    }
    for (const char row : {'x', 'y', 'z'}) {
      for (const char column : {'x', 'y', 'z'}) {
        c.covariance.parameters.push_back(name + ".sensitivity." + row + column);
      }
    }
  }
  c.covariance.parameters.push_back("reference.dip_rad");
  const auto size = static_cast<Eigen::Index>(c.covariance.parameters.size());
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(size, 0.0007);
  Eigen::Index at = 0;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const TriadCalibration& sensor = *c.sensors[triad];
    sigma.segment<3>(at) = sensor.bias_sigma;
    for (int i = 0; i < 3; ++i) {
      sigma.segment<3>(at + 3 + 3 * i) = sensor.sensitivity_sigma.row(i).transpose();
    }
    at += 12;
  }
  c.covariance.matrix.resize(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < size; ++j) {
      const double rho = i == j ? 1.0
                                : std::sin(3.0 * static_cast<double>(i + j)) * 0.6 /
                                      static_cast<double>(std::abs(i - j));
      c.covariance.matrix(i, j) = rho * sigma(i) * sigma(j);
    }
  }

  Quality& q = c.quality;
  q.poses = poses;
  q.residual_rms[Triad::kAccelerometer] = 0.00132;
  q.residual_rms_before[Triad::kAccelerometer] = 0.1421;
  q.residual_rms[Triad::kMagnetometer] = 0.0872;
  q.reduced_chi2 = 1.02;
  q.reduced_chi2_before = 35.2;
  q.dof = 50;
  q.effective_dof = 27.4;
  q.weak_directions = {{"magnetometer bias z and scale z cannot be told apart",
                        "add poses with z up and down",
                        0.012}};
  q.rests.model_choice = {
      {"accelerometer full; magnetometer full", true, 22, 51.2, std::nullopt, 160.4, 1.021},
      {"accelerometer with quadratic term", false, 25, 48.9, 0.51, 172.7, 1.043},
      {"magnetometer symmetric", false, 19, 4711.0, 1e-14, 4805.2, 9.3}};
  q.rests.held_out = HeldOut{5, {}, {}, {}};
  q.rests.held_out->rms[Triad::kAccelerometer] = 0.00171;
  q.rests.held_out->in_sample_rms[Triad::kAccelerometer] = 0.00130;
  q.rests.rejected_poses = {{7, Triad::kMagnetometer, "steel tool near the fixture: 9.3 σ away"}};
  q.coverage = {{Triad::kAccelerometer, {0.29, 0.33, 0.38}, 31.0},
                {Triad::kMagnetometer, {0.11, 0.40, 0.49}, 42.0}};
  AddPoses(poses, Triad::kAccelerometer, 0.0018, &q);
  AddPoses(poses, Triad::kMagnetometer, 0.12, &q);
  for (PoseResidual& pose : q.rests.pose_residuals) {
    if (pose.triad != Triad::kMagnetometer) continue;
    pose.norm_error_before = std::numeric_limits<double>::quiet_NaN();
    if (pose.pose == 7) {
      pose.weight = 0.0;
      pose.norm_error = 3.1;
    }
  }
  q.limits = {
      {"accelerometer.bias", "x", Limit::Within(0.5), 0.2046, 0.00051, 0.0, true},
      {"accelerometer.scale_error", "z", Limit::Within(0.01), 0.00512, 0.000049, 0.0, true},
      {"magnetometer.misalignment_rad", "xy", Limit::Within(0.05), 0.0345, 0.0021, 1e-13, true}};
  c.config_yaml =
      "experiment: 1\ninput: recording.csv\nsensors:\n  accelerometer: { model: full }\n";
  return c;
}

/// The same unit, seen by too few poses; numbers that nobody must read are still there.
inline Calibration UnusableCalibration() {
  Calibration c = SampleCalibration(8);
  c.outcome = Outcome::kNotObservable;
  c.within_limits.reset();
  c.findings = {{FindingCode::kNotDetermined, "8 poses lie within 4 deg of one plane."}};
  return c;
}

}  // namespace truetriad
