// SPDX-License-Identifier: Apache-2.0
#include "sim/surroundings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "model/world.h"

namespace truetriad {
namespace {

constexpr double kForever = std::numeric_limits<double>::infinity();

/// The rotation vector of `rotation`, of length up to pi; accurate even for the smallest angles.
Eigen::Vector3d Log(const Eigen::Quaterniond& rotation) {
  const double half_sine = rotation.vec().norm();
  if (half_sine == 0.0) return Eigen::Vector3d::Zero();
  const double angle = 2.0 * std::atan2(half_sine, std::abs(rotation.w()));
  return std::copysign(angle / half_sine, rotation.w()) * rotation.vec();
}

}  // namespace

TimeSpan SpanOf(const DisturbanceTime& when,
                double duration_s,
                const std::vector<TrueRest>& rests) {
  // Validate() has checked that the rest exists.
  double begin_s = when.offset_s;
  if (when.rest) begin_s += rests[static_cast<std::size_t>(*when.rest) - 1].start_s;
  return {begin_s, begin_s + duration_s};
}

Surroundings::Surroundings(const Scenario& scenario,
                           const Motion& motion,
                           const std::vector<TrueRest>& rests)
    : motion_(motion),
      force_in_world_mps2_(ForceInWorld(scenario.world.gravity_mps2)),
      field_in_world_ut_(FieldInWorld(scenario.world.field_ut, scenario.world.dip_rad)) {
  if (scenario.world.earth_rate) {
    earth_rate_in_world_radps_ = EarthRateInWorld(scenario.world.earth_rate->latitude_rad,
                                                  scenario.world.earth_rate->declination_rad);
  }
  if (scenario.sensors[Triad::kAccelerometer]) {
    lever_arm_m_ = scenario.sensors[Triad::kAccelerometer]->lever_arm_m;
  }
  for (const Disturbance& disturbance : scenario.disturbances) {
    if (const auto* const knock = std::get_if<Knock>(&disturbance)) {
      knocks_.push_back({SpanOf(knock->when, knock->duration_s, rests), *knock});
    } else if (const auto* const magnet = std::get_if<MagnetPassing>(&disturbance)) {
      magnets_.push_back({SpanOf(magnet->when, magnet->duration_s, rests), *magnet});
    } else if (const auto* const iron = std::get_if<HardIronStep>(&disturbance)) {
      hard_iron_steps_.push_back({SpanOf(iron->when, kForever, rests), *iron});
    } else if (const auto* const step = std::get_if<FieldStep>(&disturbance)) {
      field_steps_.push_back({SpanOf(step->when, kForever, rests), *step});
    }
  }
}

void Surroundings::MoveTo(double time_s) {
  const std::size_t phase = motion_.PhaseAt(time_s, phase_);
  time_s_ = time_s;
  if (in_still_phase_ && phase == phase_) return;
  phase_ = phase;
  in_still_phase_ = motion_.phase(phase).is_still();
  state_ = motion_.phase(phase).At(time_s);
  body_from_world_ = state_.world_from_body.toRotationMatrix().transpose();
  const Eigen::Vector3d& rate = state_.rate_radps;
  force_mps2_ = body_from_world_ * (state_.acceleration_mps2 + force_in_world_mps2_) +
                state_.angular_acceleration_radps2.cross(lever_arm_m_) +
                rate.cross(rate.cross(lever_arm_m_));
}

Eigen::Vector3d Surroundings::ForceMps2() const {
  Eigen::Vector3d force = force_mps2_;
  for (const Timed<Knock>& knock : knocks_) {
    if (!knock.span.Contains(time_s_)) continue;
    const double share = (time_s_ - knock.span.begin_s) / knock.what.duration_s;
    force += std::sin(std::numbers::pi * share) * knock.what.peak_mps2;
  }
  return force;
}

Eigen::Vector3d Surroundings::FieldUt() const {
  Eigen::Vector3d field = field_in_world_ut_;
  for (const Timed<MagnetPassing>& magnet : magnets_) {
    if (!magnet.span.Contains(time_s_)) continue;
    const double share = (time_s_ - magnet.span.begin_s) / magnet.what.duration_s;
    const double sine = std::sin(std::numbers::pi * share);
    field += sine * sine * magnet.what.peak_ut;
  }
  for (const Timed<FieldStep>& step : field_steps_) {
    if (step.span.Contains(time_s_)) field += step.what.change_ut;
  }
  Eigen::Vector3d field_in_body = body_from_world_ * field;
  for (const Timed<HardIronStep>& step : hard_iron_steps_) {
    if (step.span.Contains(time_s_)) field_in_body += step.what.change_ut;
  }
  return field_in_body;
}

Eigen::Vector3d Surroundings::RateRadps() const {
  return state_.rate_radps + body_from_world_ * earth_rate_in_world_radps_;
}

Eigen::Vector3d Surroundings::MeanRateRadps(std::int64_t since_ns,
                                            const Eigen::Quaterniond& since_world_from_body,
                                            std::int64_t now_ns) const {
  if (since_world_from_body.coeffs() == state_.world_from_body.coeffs()) {
    return body_from_world_ * earth_rate_in_world_radps_;
  }
  const double interval_s = static_cast<double>(now_ns - since_ns) * 1e-9;
  const Eigen::Vector3d earth_turn = interval_s * earth_rate_in_world_radps_;
  const double earth_angle = earth_turn.norm();
  Eigen::Quaterniond turned = state_.world_from_body;
  if (earth_angle > 0.0) {
    turned = Eigen::AngleAxisd(earth_angle, earth_turn / earth_angle) * turned;
  }
  return Log(since_world_from_body.conjugate() * turned) / interval_s;
}

}  // namespace truetriad
