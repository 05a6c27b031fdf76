// SPDX-License-Identifier: Apache-2.0
#include "sim/timeline.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "sim/seeds.h"

namespace truetriad {
namespace {

Eigen::Quaterniond Exp(const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  if (angle == 0.0) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation_rad / angle));
}

/// Builds the timeline step by step.
class TimelineBuilder {
 public:
  TimelineBuilder(const Scenario& scenario, int unit)
      : scenario_(scenario),
        order_(UnitRandom(scenario.seed, unit, Purpose::kPoseOrder)),
        tilt_(UnitRandom(scenario.seed, unit, Purpose::kPoseTilt)),
        rest_length_(UnitRandom(scenario.seed, unit, Purpose::kRestLength)),
        travel_(UnitRandom(scenario.seed, unit, Purpose::kTravel)),
        tumble_(UnitRandom(scenario.seed, unit, Purpose::kTumble)),
        chamber_(scenario.temperature.start_degc) {}

  Timeline Build() {
    for (const TemperatureSegment& segment : scenario_.temperature.profile) {
      std::visit([this](const auto& stretch) { Add(stretch); }, segment);
    }
    if (!std::holds_alternative<PosesStep>(scenario_.motion.front())) {
      placed_ = true;
      Rest(scenario_.first_rest_s, {});
    }
    FollowMotion(scenario_.temperature.soak_degc.empty() ? std::vector<double>{chamber_.end_degc()}
                                                         : scenario_.temperature.soak_degc);
    ElementTemperature element(chamber_, scenario_.temperature);
    for (TrueRest& rest : rests_) {
      const double start_degc = element.At(rest.start_s).degc;
      rest.element_degc = 0.5 * (start_degc + element.At(rest.end_s).degc);
    }
    return {Motion(std::move(phases_)),
            std::move(chamber_),
            std::move(rests_),
            std::move(turns_),
            std::move(rates_)};
  }

 private:
  void FollowMotion(const std::vector<double>& temperatures_degc) {
    for (const double degc : temperatures_degc) {
      // The unit takes its first pose before the chamber leaves its start temperature.
      if (placed_) WaitFor(degc);
      for (const MotionStep& step : scenario_.motion) {
        std::visit([this, degc](const auto& motion) { Add(motion, degc); }, step);
      }
    }
  }

  void Add(const TemperatureHold& hold) { chamber_.Hold(hold.duration_s); }
  void Add(const TemperatureRamp& ramp) { chamber_.Ramp(ramp); }
  void Add(const TemperatureSine& sine) { chamber_.Sine(sine); }

  void Add(const PosesStep& step, double chamber_degc) {
    std::vector<ProgramPose> poses = step.poses;
    if (step.shuffle) {
      for (std::size_t k = poses.size(); k > 1; --k) {
        std::swap(poses[k - 1], poses[static_cast<std::size_t>(order_.Below(static_cast<int>(k)))]);
      }
    }
    for (const ProgramPose& pose : poses) {
      const double degc = pose.temperature_degc.value_or(chamber_degc);
      const bool waits = pose.temperature_degc.has_value() || !placed_;
      const Eigen::Quaterniond target = Taken(pose.world_from_body, step.tilt_sigma_rad);
      if (placed_) {
        if (waits) WaitFor(degc);
        MoveTo(target, step);
      } else {
        placed_ = true;
        attitude_ = target;
        WaitFor(degc);
      }
      intended_ = pose.world_from_body.normalized();
      const double share = 1.0 + step.rest_spread * (2.0 * rest_length_.Uniform() - 1.0);
      Rest(step.rest_s * share, pose.label);
    }
  }

  void Add(const TurnStep& step, double /*chamber_degc*/) {
    const double angle_rad = 2.0 * std::numbers::pi * step.turns;
    const Eigen::Vector3d axis = step.axis_in_body.normalized();
    StatedTurn turn;
    turn.axis = axis;
    turn.angle_rad = angle_rad;
    turns_.push_back({end_s_, end_s_ + step.duration_s, turn});
    Append(step.duration_s, axis, MotionPhase::Turn{angle_rad, Eigen::Vector3d::Zero()});
    intended_ = attitude_;
    Rest(step.rest_s, {});
  }

  void Add(const RateStep& step, double /*chamber_degc*/) {
    const Eigen::Vector3d axis = step.axis_in_body.normalized();
    for (const double rate_radps : step.rates_radps) {
      StatedRate rate;
      rate.rate_radps = rate_radps * axis;
      const double hold_s = end_s_ + step.ramp_s;
      rates_.push_back({hold_s, hold_s + step.hold_s, rate});
      Append(step.hold_s + 2.0 * step.ramp_s, axis, MotionPhase::Spin{rate_radps, step.ramp_s});
      intended_ = attitude_;
      Rest(step.rest_s, {});
    }
  }

  void Add(const TumbleStep& step, double /*chamber_degc*/) {
    // The frequencies of the three angles are in no simple ratio, so that no attitude recurs. Each
    // angle has a third of the mean square rate, and the slowest one swings by half a turn each
    // way.
    const Eigen::Vector3d ratios(1.0, std::numbers::sqrt2, std::numbers::phi);
    const double amplitude_of_slowest_rad = std::numbers::pi;
    const double peak_radps = step.rms_rate_radps * std::sqrt(2.0 / 3.0);
    MotionPhase::Tumbling tumbling;
    tumbling.omega_radps = ratios * (peak_radps / amplitude_of_slowest_rad);
    tumbling.amplitude_rad = peak_radps * tumbling.omega_radps.cwiseInverse();
    for (double& phase_rad : tumbling.phase_rad) {
      phase_rad = 2.0 * std::numbers::pi * tumble_.Uniform();
    }
    // A hand reaches its full speed within a second.
    constexpr double kLongestRampS = 1.0;
    tumbling.ramp_s = std::min(kLongestRampS, step.duration_s / 4.0);
    if (step.hand_acceleration_mps2 > 0.0) {
      // 0.3 to 1.9 Hz, the frequencies of a hand, with equally many terms in each octave. The mean
      // square of a sine is half its squared amplitude.
      constexpr double kSlowestRadps = 2.0, kFastestRadps = 12.0;
      constexpr auto kTerms = static_cast<double>(MotionPhase::Tumbling::kHandTerms);
      tumbling.hand_amplitude_mps2 = step.hand_acceleration_mps2 * std::sqrt(2.0 / kTerms);
      for (std::size_t i = 0; i < tumbling.kHandTerms; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
          const double share = (static_cast<double>(i) + tumble_.Uniform()) / kTerms;
          tumbling.hand_omega_radps[i][axis] =
              kSlowestRadps * std::pow(kFastestRadps / kSlowestRadps, share);
          tumbling.hand_phase_rad[i][axis] = 2.0 * std::numbers::pi * tumble_.Uniform();
        }
      }
    }
    Append(step.duration_s, Eigen::Vector3d::UnitZ(), tumbling);
    intended_ = attitude_;
  }

  /// The attitude of the unit in a pose: the intended one with a random tilt, plus the tilt of a
  /// rest that still settles.
  Eigen::Quaterniond Taken(const Eigen::Quaterniond& intended, double tilt_sigma_rad) {
    Eigen::Quaterniond taken = intended.normalized() * Exp(tilt_sigma_rad * tilt_.Normal3());
    if (const UnsettledPose* unsettled = ComingUnsettled())
      taken = taken * Exp(unsettled->tilt_rad);
    return taken.normalized();
  }

  const UnsettledPose* ComingUnsettled() const {
    const int number = static_cast<int>(rests_.size()) + 1;
    for (const Disturbance& disturbance : scenario_.disturbances) {
      const auto* const unsettled = std::get_if<UnsettledPose>(&disturbance);
      if (unsettled != nullptr && unsettled->rest == number) return unsettled;
    }
    return nullptr;
  }

  void MoveTo(const Eigen::Quaterniond& target, const PosesStep& step) {
    const Eigen::AngleAxisd turn(attitude_.conjugate() * target);
    Eigen::Vector3d direction = travel_.Normal3();
    direction.normalize();
    Append(step.move_s, turn.axis(), MotionPhase::Turn{turn.angle(), step.travel_m * direction});
  }

  /// Adds a rest, unless it has no length.
  void Rest(double duration_s, const std::string& label) {
    if (duration_s <= 0.0) return;
    TrueRest rest;
    rest.start_s = end_s_;
    rest.end_s = end_s_ + duration_s;
    rest.intended_world_from_body = intended_;
    rest.label = label;
    const UnsettledPose* const unsettled = ComingUnsettled();
    if (unsettled != nullptr && unsettled->tilt_rad.norm() > 0.0) {
      Append(duration_s,
             unsettled->tilt_rad.normalized(),
             MotionPhase::Settling{unsettled->tilt_rad.norm(), unsettled->decay_s});
    } else {
      Append(duration_s, Eigen::Vector3d::UnitZ(), MotionPhase::Still{});
    }
    rest.number = static_cast<int>(rests_.size()) + 1;
    rest.world_from_body = attitude_;
    rests_.push_back(rest);
  }

  /// Leaves the unit where it is until the chamber has arrived at the temperature and settled.
  void WaitFor(double degc) {
    if (degc == chamber_.end_degc() || !scenario_.temperature.profile.empty()) return;
    chamber_.Hold(end_s_ - chamber_.end_s());
    chamber_.Ramp({degc, scenario_.temperature.chamber_rate_degcps});
    chamber_.Hold(scenario_.temperature.settle_s);
    Append(chamber_.end_s() - end_s_, Eigen::Vector3d::UnitZ(), MotionPhase::Still{});
  }

  void Append(double duration_s, const Eigen::Vector3d& axis, decltype(MotionPhase::form) form) {
    const MotionPhase phase{end_s_, duration_s, attitude_, axis, std::move(form)};
    end_s_ = phase.end_s();
    attitude_ = phase.At(end_s_).world_from_body;
    phases_.push_back(phase);
  }

  const Scenario& scenario_;
  FastRandom order_, tilt_, rest_length_, travel_, tumble_;
  Chamber chamber_;
  std::vector<MotionPhase> phases_;
  std::vector<TrueRest> rests_;
  std::vector<TimelineMotion<StatedTurn>> turns_;
  std::vector<TimelineMotion<StatedRate>> rates_;
  bool placed_ = false;  ///< The unit is already in a pose.
  Eigen::Quaterniond attitude_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond intended_ = Eigen::Quaterniond::Identity();
  double end_s_ = 0.0;
};

}  // namespace

Timeline MakeTimeline(const Scenario& scenario, int unit) {
  return TimelineBuilder(scenario, unit).Build();
}

Eigen::Vector2d ElementRange(const Scenario& scenario, const Timeline& timeline) {
  // Chosen: temperatures are sampled at 256 steps of the recording, and at the beginning of each of
  // the chamber's stretches.
  constexpr int kRangeSteps = 256;
  const double duration_s = timeline.motion.duration_s();
  std::vector<double> times_s;
  for (int i = 0; i <= kRangeSteps; ++i) times_s.push_back(duration_s * i / kRangeSteps);
  for (const Chamber::Stretch& stretch : timeline.chamber.stretches()) {
    if (stretch.begin_s < duration_s) times_s.push_back(stretch.begin_s);
  }
  std::sort(times_s.begin(), times_s.end());
  ElementTemperature element(timeline.chamber, scenario.temperature);
  Eigen::Vector2d range = Eigen::Vector2d::Constant(scenario.temperature.start_degc);
  for (const double time_s : times_s) {
    const double degc = element.At(time_s).degc;
    range = {std::min(range[0], degc), std::max(range[1], degc)};
  }
  return range;
}

}  // namespace truetriad
