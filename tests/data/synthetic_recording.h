// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include <Eigen/Geometry>

#include "data/memory_source.h"

namespace truetriad {

/// Writes a recording of a unit that rests and is turned by hand.
class SyntheticRecording {
 public:
  explicit SyntheticRecording(double rate_hz = 100.0, std::uint32_t seed = 1)
      : spacing_ns_(static_cast<std::int64_t>(std::llround(1e9 / rate_hz))), random_(seed) {}

  double noise_mps2 = 0.02;
  double gyro_noise_radps = 0.002;
  double counts_per_mps2 = 1.0;
  Eigen::Vector3d offset_raw = Eigen::Vector3d::Zero();
  double step_raw = 0.0;                                  // Rounding of the readings.
  Eigen::Vector3d drift_mps3 = Eigen::Vector3d::Zero();   // Of the accelerometer's bias.
  Eigen::Vector3d gravity = Eigen::Vector3d(0, 0, 9.81);  // In the body now.
  Eigen::Vector3d field_ut = Eigen::Vector3d(20, 0, -43);

  /// Still for a time; `noise` in units of the sensor's own.
  void Rest(double duration_s, double noise = 1.0) {
    for (const std::int64_t end = time_ns_ + Ns(duration_s); time_ns_ < end;) {
      Write(gravity, Eigen::Vector3d::Zero(), noise);
    }
  }
  /// Turns by `angle_rad` about a body axis at a smooth rate, with hand tremor.
  void Turn(const Eigen::Vector3d& axis, double angle_rad, double duration_s) {
    const Eigen::Vector3d from = gravity, field_from_ut = field_ut;
    const std::int64_t start = time_ns_, length = Ns(duration_s);
    while (time_ns_ < start + length) {
      const double share = static_cast<double>(time_ns_ - start) / static_cast<double>(length);
      const double angle = angle_rad * 0.5 * (1.0 - std::cos(std::numbers::pi * share));
      const double rate =
          angle_rad * 0.5 * std::numbers::pi / duration_s * std::sin(std::numbers::pi * share);
      gravity = Eigen::AngleAxisd(-angle, axis.normalized()) * from;
      field_ut = Eigen::AngleAxisd(-angle, axis.normalized()) * field_from_ut;
      Write(gravity, rate * axis.normalized(), tremor_);
    }
    gravity = Eigen::AngleAxisd(-angle_rad, axis.normalized()) * from;
    field_ut = Eigen::AngleAxisd(-angle_rad, axis.normalized()) * field_from_ut;
  }
  /// Turns about the vertical by a machine: nothing trembles.
  void Slew(double angle_rad, double duration_s) {
    tremor_ = 1.0;
    Turn(gravity, angle_rad, duration_s);
    tremor_ = 20.0;
  }
  /// A short shock without a change of attitude.
  void Knock(double duration_s) {
    for (const std::int64_t end = time_ns_ + Ns(duration_s); time_ns_ < end;) {
      Write(gravity, Eigen::Vector3d::Zero(), 60.0);
    }
  }
  /// A creep of the attitude that dies out, as foam does under a unit.
  void Settle(double angle_rad, double time_constant_s) {
    const Eigen::Vector3d final = gravity;
    const Eigen::Vector3d axis = gravity.unitOrthogonal();
    const std::int64_t start = time_ns_;
    while (time_ns_ < start + Ns(8.0 * time_constant_s)) {
      const double age_s = static_cast<double>(time_ns_ - start) * 1e-9;
      const double angle = angle_rad * std::exp(-age_s / time_constant_s);
      Write(Eigen::AngleAxisd(angle, axis) * final, Eigen::Vector3d::Zero(), 1.0);
    }
  }
  /// Random other attitude by hand in 1.5 s.
  void Handle() {
    std::uniform_real_distribution<double> angle(1.0, 2.5);
    Turn(Normal(), angle(random_), 1.5);
  }

  std::int64_t now_ns() const { return time_ns_; }
  Eigen::Vector3d RawOf(const Eigen::Vector3d& force) const {
    return counts_per_mps2 * force + offset_raw;
  }
  Eigen::Vector3d Normal() {
    std::normal_distribution<double> normal;
    const double x = normal(random_), y = normal(random_), z = normal(random_);
    return {x, y, z};
  }

  MemoryStream accel{Triad::kAccelerometer};
  MemoryStream gyro{Triad::kGyroscope};
  MemoryStream magnet{Triad::kMagnetometer};

 private:
  static std::int64_t Ns(double seconds) { return std::llround(seconds * 1e9); }

  void Write(const Eigen::Vector3d& force, const Eigen::Vector3d& rate, double noise) {
    const double time_s = static_cast<double>(time_ns_) * 1e-9;
    Eigen::Vector3d raw = RawOf(force + drift_mps3 * time_s + noise * noise_mps2 * Normal());
    if (step_raw > 0.0) raw = (raw / step_raw).array().round() * step_raw;
    accel.Add(time_ns_, raw);
    gyro.Add(time_ns_, rate + noise * gyro_noise_radps * Normal());
    magnet.Add(time_ns_, field_ut + 0.3 * NormalOfMagnet());
    time_ns_ += spacing_ns_;
  }

  std::int64_t spacing_ns_;
  std::int64_t time_ns_ = 0;
  // The others' draws stay what they are without a magnetometer.
  Eigen::Vector3d NormalOfMagnet() {
    std::normal_distribution<double> normal;
    const double x = normal(magnet_random_), y = normal(magnet_random_), z = normal(magnet_random_);
    return {x, y, z};
  }

  double tremor_ = 20.0;  // While turning, in units of the sensors' own noise.
  std::mt19937 random_;
  std::mt19937 magnet_random_{7};
};

}  // namespace truetriad
