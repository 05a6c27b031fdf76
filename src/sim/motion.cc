// SPDX-License-Identifier: Apache-2.0
#include "sim/motion.h"

#include <algorithm>
#include <cmath>

namespace truetriad {
namespace {

Eigen::Quaterniond Rotation(double angle_rad, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis));
}

/// A warped time that starts at 0. Its rate rises from 0 to 1 within `ramp_s` as 6 u^5 - 15 u^4 +
/// 10 u^3, and falls to 0 in the same way at the end of `duration_s`.
Motion1d RampedTime(double time_s, double duration_s, double ramp_s) {
  const double to_end_s = duration_s - time_s;
  if (time_s >= ramp_s && to_end_s >= ramp_s) return {time_s - 0.5 * ramp_s, 1.0, 0.0};
  const bool rising = time_s < ramp_s;
  const double u = std::max(rising ? time_s : to_end_s, 0.0) / ramp_s;
  const double covered_s = ramp_s * u * u * u * u * (2.5 + u * (-3.0 + u));
  const double rate = u * u * u * (10.0 + u * (-15.0 + 6.0 * u));
  const double acceleration = 30.0 * u * u * (1.0 - u) * (1.0 - u) / ramp_s;
  if (rising) return {covered_s, rate, acceleration};
  return {duration_s - ramp_s - covered_s, rate, -acceleration};
}

/// The angle about a fixed axis.
Motion1d Angle(const MotionPhase::Turn& turn, double time_s, double duration_s) {
  const Motion1d share = MinimumJerk(time_s, duration_s);
  const double angle = turn.angle_rad;
  return {angle * share.value, angle * share.rate, angle * share.acceleration};
}

Motion1d Angle(const MotionPhase::Spin& spin, double time_s, double duration_s) {
  const Motion1d time = RampedTime(time_s, duration_s, spin.ramp_s);
  const double rate = spin.rate_radps;
  return {rate * time.value, rate * time.rate, rate * time.acceleration};
}

Motion1d Angle(const MotionPhase::Settling& settling, double time_s, double /*duration_s*/) {
  const double s = time_s / settling.decay_s;
  const double decay = settling.tilt_rad * std::exp(-s);
  const double rate = 1.0 / settling.decay_s;
  return {
      decay * (1.0 + s) - settling.tilt_rad, -decay * s * rate, decay * (s - 1.0) * rate * rate};
}

/// R = Rz(a) Ry(b) Rx(c): rate = c' ex + Rx^T (b' ey + Ry^T a' ez), and its derivative.
Kinematics Tumble(const MotionPhase::Tumbling& tumbling, double time_s, double duration_s) {
  const Motion1d warped = RampedTime(time_s, duration_s, tumbling.ramp_s);
  Eigen::Vector3d angle;
  Eigen::Vector3d rate;
  Eigen::Vector3d acceleration;
  for (int k = 0; k < 3; ++k) {
    const double omega = tumbling.omega_radps[k];
    const double argument = omega * warped.value + tumbling.phase_rad[k];
    const double sine = std::sin(argument);
    const double slope = omega * std::cos(argument);
    angle[k] = tumbling.amplitude_rad[k] * (sine - std::sin(tumbling.phase_rad[k]));
    rate[k] = tumbling.amplitude_rad[k] * slope * warped.rate;
    acceleration[k] =
        tumbling.amplitude_rad[k] *
        (slope * warped.acceleration - omega * omega * sine * warped.rate * warped.rate);
  }
  const Eigen::Vector3d ex = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d ey = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d ez = Eigen::Vector3d::UnitZ();
  const Eigen::Quaterniond rotation_b = Rotation(angle[1], ey);
  const Eigen::Quaterniond rotation_c = Rotation(angle[2], ex);
  const Eigen::Vector3d middle = rate[1] * ey + rotation_b.conjugate() * (rate[0] * ez);
  const Eigen::Vector3d middle_derivative =
      acceleration[1] * ey + rotation_b.conjugate() * (acceleration[0] * ez) -
      (rate[1] * ey).cross(rotation_b.conjugate() * (rate[0] * ez));
  const Eigen::Vector3d inner = rotation_c.conjugate() * middle;
  Kinematics state;
  state.world_from_body = Rotation(angle[0], ez) * rotation_b * rotation_c;
  state.rate_radps = rate[2] * ex + inner;
  state.angular_acceleration_radps2 = acceleration[2] * ex +
                                      rotation_c.conjugate() * middle_derivative -
                                      (rate[2] * ex).cross(inner);
  return state;
}

Eigen::Vector3d HandAcceleration(const MotionPhase::Tumbling& tumbling,
                                 double time_s,
                                 double duration_s) {
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
  if (!(tumbling.hand_amplitude_mps2 > 0.0)) return acceleration;
  for (std::size_t i = 0; i < tumbling.kHandTerms; ++i) {
    const Eigen::Vector3d argument =
        tumbling.hand_omega_radps[i] * time_s + tumbling.hand_phase_rad[i];
    acceleration += tumbling.hand_amplitude_mps2 * argument.array().sin().matrix();
  }
  return RampedTime(time_s, duration_s, tumbling.ramp_s).rate * acceleration;
}

/// Evaluates the form of a phase, relative to the attitude at the phase's beginning.
struct Evaluate {
  const MotionPhase& phase;
  double time_s;

  Kinematics operator()(const MotionPhase::Still& /*still*/) const { return {}; }
  Kinematics operator()(const MotionPhase::Tumbling& tumbling) const {
    return Tumble(tumbling, time_s, phase.duration_s);
  }
  Kinematics operator()(const auto& turn) const {
    const Motion1d angle = Angle(turn, time_s, phase.duration_s);
    Kinematics state;
    state.world_from_body = Rotation(angle.value, phase.axis);
    state.rate_radps = angle.rate * phase.axis;
    state.angular_acceleration_radps2 = angle.acceleration * phase.axis;
    return state;
  }
};

}  // namespace

Motion1d MinimumJerk(double time_s, double duration_s) {
  const double u = std::clamp(time_s / duration_s, 0.0, 1.0);
  return {u * u * u * (10.0 + u * (-15.0 + 6.0 * u)),
          30.0 * u * u * (1.0 - u) * (1.0 - u) / duration_s,
          60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (duration_s * duration_s)};
}

Kinematics MotionPhase::At(double time_s) const {
  const double t = std::clamp(time_s - begin_s, 0.0, duration_s);
  Kinematics state = std::visit(Evaluate{*this, t}, form);
  state.world_from_body = (world_from_body * state.world_from_body).normalized();
  if (const Turn* const turn = std::get_if<Turn>(&form)) {
    state.acceleration_mps2 = MinimumJerk(t, duration_s).acceleration * turn->travel_m;
  }
  if (const Tumbling* const tumbling = std::get_if<Tumbling>(&form)) {
    state.acceleration_mps2 = HandAcceleration(*tumbling, t, duration_s);
  }
  return state;
}

std::size_t Motion::PhaseAt(double time_s, std::size_t from) const {
  std::size_t index = from;
  while (index + 1 < phases_.size() && phases_[index + 1].begin_s <= time_s) ++index;
  return index;
}

}  // namespace truetriad
