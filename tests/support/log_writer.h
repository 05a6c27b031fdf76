// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "math/random.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

/// The accelerometer of a log by default: gains within 5 % of one, axes within 3 degrees.
inline TriadModel<double> LoggedAccelerometer() {
  TriadModel<double> model;
  model.sensitivity << 1.02, 0.0, 0.0, 0.01, 0.98, 0.0, -0.005, 0.02, 1.01;
  model.bias << 0.1, -0.2, 0.3;
  return model;
}
inline TriadModel<double> LoggedMagnetometer() {
  TriadModel<double> model;
  model.sensitivity << 1.05, 0.02, -0.01, 0.03, 0.95, 0.02, 0.0, -0.02, 1.04;
  model.bias << 5.0, -8.0, 12.0;
  return model;
}

/// A self-describing log of a unit that rests in many attitudes and is turned by hand in between.
/// The same options give the same text.
struct LogOptions {
  int rests = 24;
  double rest_s = 2.5;
  double move_s = 1.0;
  double rate_hz = 50.0;
  bool in_one_plane = false;  ///< All rests are turns about the body's z axis, which stays level.
  bool magnetometer = true;
  TriadModel<double> accelerometer = LoggedAccelerometer();
  double accel_raw_per_mps2 = 1.0;  ///< For readings in another unit than m/s^2.
  double noise_mps2 = 0.02;         ///< σ of white noise in one sample.
  double noise_ut = 0.3;
  std::uint64_t seed = 1;
};

/// One row of the log: time, then the accelerometer, then the magnetometer if there is one.
using LogRow = std::vector<double>;

inline std::vector<LogRow> LogRows(const LogOptions& options = {}) {
  constexpr double kDipRad = 62.0 / 180.0 * std::numbers::pi;
  constexpr double kHandTremorMps2 = 1.0;
  const Eigen::Vector3d gravity(0.0, 0.0, 9.80665);
  const Eigen::Vector3d field = 48.0 * Eigen::Vector3d(0.0, std::cos(kDipRad), -std::sin(kDipRad));
  Random random(options.seed);
  std::vector<LogRow> rows;
  const auto add = [&](const Eigen::Quaterniond& body_from_world, double tremor_mps2) {
    const Eigen::Vector3d accel =
        options.accel_raw_per_mps2 *
        options.accelerometer.RawFromTruth(body_from_world * gravity +
                                           options.noise_mps2 * random.Normal3() +
                                           tremor_mps2 * random.Normal3());
    const Eigen::Vector3d mag = LoggedMagnetometer().RawFromTruth(
        body_from_world * field + options.noise_ut * random.Normal3());
    LogRow row = {static_cast<double>(rows.size()) / options.rate_hz};
    for (const double reading : accel) row.push_back(reading);
    for (const double reading : mag) row.push_back(reading);
    if (!options.magnetometer) row.resize(4);
    rows.push_back(row);
  };
  const auto samples = [&](double duration_s) {
    return static_cast<int>(std::lround(duration_s * options.rate_hz));
  };

  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
  if (options.in_one_plane) {
    attitude = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX());
  }
  for (int rest = 0; rest < options.rests; ++rest) {
    for (int i = 0; i < samples(options.rest_s); ++i) add(attitude, 0.0);
    const Eigen::Vector3d axis = options.in_one_plane
                                     ? Eigen::Vector3d::UnitZ()
                                     : Eigen::Vector3d(random.Normal3().normalized());
    const double angle_rad = random.Uniform(1.0, 2.5);
    const int steps = samples(options.move_s);
    for (int i = 1; i <= steps; ++i) {
      add(Eigen::AngleAxisd(angle_rad * i / steps, axis) * attitude, kHandTremorMps2);
    }
    attitude = Eigen::AngleAxisd(angle_rad, axis) * attitude;
  }
  return rows;
}

inline std::string LogHeader(const LogOptions& options = {}) {
  return std::string("time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]") +
         (options.magnetometer ? ",mag_x[uT],mag_y[uT],mag_z[uT]\n" : "\n");
}

inline std::string LogText(const std::string& header, const std::vector<LogRow>& rows) {
  std::string text = header;
  for (const LogRow& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      char number[32];
      std::snprintf(number, sizeof number, i == 0 ? "%.4f" : ",%.5f", row[i]);
      text += number;
    }
    text += '\n';
  }
  return text;
}

inline std::string LogText(const LogOptions& options = {}) {
  return LogText(LogHeader(options), LogRows(options));
}

}  // namespace truetriad
