// SPDX-License-Identifier: Apache-2.0
#include "truetriad/sim/scenario.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>

#include "base/rounded_text.h"
#include "sim/surroundings.h"
#include "sim/timeline.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

std::string Number(double value) { return RoundedText(value, 6); }

std::string RangeText(const Eigen::Vector2d& range) {
  return Number(range[0]) + " to " + Number(range[1]);
}

/// Collects the mistakes in a scenario. All checks fail for NaN.
class Problems {
 public:
  /// Sets the key of the scenario to which the next mistakes belong.
  void About(const std::string& key) { key_ = key; }
  void Require(bool right, const std::string& what) {
    if (!right) errors_.push_back(Error(ErrorCode::kInvalidValue, what).About(key_));
  }
  void Positive(double value, const std::string& name) {
    Require(value > 0.0 && std::isfinite(value),
            name + " is " + Number(value) + "; it must be above zero");
  }
  void NotNegative(double value, const std::string& name) {
    Require(value >= 0.0 && std::isfinite(value),
            name + " is " + Number(value) + "; it must not be negative");
  }
  void NotNegative(const Eigen::Vector3d& values, const std::string& name) {
    NotNegative(values.minCoeff(), name);
    Require(values.allFinite(), name + " must be finite");
  }
  void Finite(bool finite, const std::string& name) { Require(finite, name + " must be finite"); }

  bool empty() const { return errors_.empty(); }
  const std::vector<Error>& errors() const { return errors_; }

 private:
  std::string key_;
  std::vector<Error> errors_;
};

/// The key of an item of a list, counted from 0: "motion[1]".
std::string ItemKey(std::string_view list, std::size_t item) {
  return std::string(list) + "[" + std::to_string(item) + "]";
}

std::string SensorKey(Triad triad) { return "sensors." + std::string(TriadName(triad)); }

void CheckSpread(const UnitSpread& spread, const std::string& name, Problems* problems) {
  problems->NotNegative(spread.bias, name + " spread of the bias");
  problems->NotNegative(spread.scale, name + " spread of the scale");
  problems->NotNegative(spread.misalignment_rad, name + " spread of the misalignment");
  problems->NotNegative(spread.g_sensitivity, name + " spread of the g-sensitivity");
  problems->NotNegative(spread.thermal_bias, name + " spread of the thermal bias");
  problems->NotNegative(spread.turn_on_bias, name + " spread of the bias at turn-on");
  problems->NotNegative(spread.thermal_scale, name + " spread of the thermal scale");
  for (const AxisTermInfo& info : kAxisTerms) {
    problems->NotNegative(spread.axis_terms[info.term],
                          name + " spread of the " + std::string(info.words));
  }
}

void CheckNoise(const SensorNoise& noise, const std::string& name, Problems* problems) {
  problems->NotNegative(noise.density, name + " noise density");
  problems->NotNegative(noise.instability_sigma, name + " bias instability");
  problems->NotNegative(noise.random_walk, name + " random walk");
  problems->Positive(noise.correlation_time_s, name + " correlation time");
}

void CheckSampling(const SensorSampling& sampling, const std::string& name, Problems* problems) {
  // Stamps are whole nanoseconds: with at least a thousand of them between samples, rounding
  // changes an interval by at most 0.1 %.
  constexpr double kFastestHz = 1e6;
  problems->Require(
      sampling.rate_hz > 0.0 && sampling.rate_hz <= kFastestHz,
      name + " rate is " + Number(sampling.rate_hz) + " Hz; it must be above zero and at most 1e6");
  const double longest_jitter_s = 0.2 / sampling.rate_hz;
  problems->Require(sampling.jitter_s >= 0.0 && sampling.jitter_s <= longest_jitter_s,
                    name + " jitter is " + Number(sampling.jitter_s) +
                        " s; it must be between zero and a fifth of the sampling interval, " +
                        Number(longest_jitter_s) + " s, so that times stay in order");
  problems->Require(sampling.dropout >= 0.0 && sampling.dropout < 1.0,
                    name + " dropout is " + Number(sampling.dropout) +
                        "; it must be a probability, at least 0 and below 1");
  constexpr double kFurthestClockS =
      1e6;  // Twelve days. A larger offset is a mistake: a clock that was never set starts at zero.
  problems->Require(std::abs(sampling.clock_offset_s) <= kFurthestClockS,
                    name + " clock offset is " + Number(sampling.clock_offset_s) +
                        " s; expected at most 1e6 s in either direction");
}

/// Nonlinearity terms must be small beside the linear one.
void CheckAxisTerms(Triad triad,
                    const SimulatedTriad& sensor,
                    const std::string& name,
                    Problems* problems) {
  // Chosen: the most that a nonlinear term may add at 1 g, as a share of the signal. With far more,
  // the output would not be monotonic.
  constexpr double kMostOfSignal = 0.1;
  const Eigen::Vector3d felt_at_1g =
      kStandardGravityMps2 * sensor.nominal.sensitivity.rowwise().norm();
  for (const AxisTermInfo& info : kAxisTerms) {
    const Eigen::Vector3d& term = sensor.nominal.axis_terms[info.term];
    const std::string of_triad(TriadName(info.triad));
    problems->Require(
        triad == info.triad || (term.isZero(0.0) && sensor.spread.axis_terms[info.term] == 0.0),
        name + ": only " + WithArticle(of_triad) + " has " + WithArticle(info.words));
    const double share =
        term.cwiseProduct(felt_at_1g.unaryExpr([&](double raw) { return info.PowerOf(raw); }))
            .cwiseAbs()
            .maxCoeff();
    problems->Require(share < kMostOfSignal,
                      name + " " + std::string(info.words) + " is " + Number(share) +
                          (info.power > 0 ? " of the signal at 1 g" : " of the gain") +
                          "; it must be below a tenth");
  }
}

void CheckTriad(Triad triad, const SimulatedTriad& sensor, Problems* problems) {
  const std::string name(TriadName(triad));
  problems->Require(sensor.nominal.sensitivity.allFinite() && sensor.nominal.bias.allFinite(),
                    name + ": bias and sensitivity must be finite");
  problems->Require((sensor.nominal.sensitivity.diagonal().array() != 0.0).all() &&
                        std::abs(sensor.nominal.sensitivity.determinant()) > 0.0,
                    name + ": the sensitivity is singular, or has a zero gain on its diagonal");
  problems->Require(!sensor.si_per_count || sensor.unit.is_counts,
                    name + ": si_per_count needs readings in counts");
  problems->Require(!sensor.si_per_count || *sensor.si_per_count > 0.0,
                    name + ": si_per_count must be above zero");
  const bool is_gyroscope = triad == Triad::kGyroscope;
  problems->Require(is_gyroscope || (!sensor.g_sensitivity && sensor.spread.g_sensitivity == 0.0),
                    name + ": only a gyroscope has a g-sensitivity");
  CheckAxisTerms(triad, sensor, name, problems);
  problems->Require(triad == Triad::kAccelerometer || sensor.lever_arm_m.isZero(0.0),
                    name + ": only an accelerometer has a lever arm");
  problems->Finite(sensor.lever_arm_m.allFinite(), name + " lever arm");
  problems->NotNegative(sensor.resolution_raw, name + " resolution");
  problems->Require(!sensor.range_raw || (*sensor.range_raw)[0] < (*sensor.range_raw)[1],
                    name + ": the low end of the range must be below the high end");
  CheckSpread(sensor.spread, name, problems);
  CheckNoise(sensor.noise, name, problems);
  CheckSampling(sensor.sampling, name, problems);
}

/// A sensor that saturates at rest, or whose resolution is coarser than gravity (or the field),
/// measures nothing: most likely a unit of measure is wrong. Moves and noise may exceed the range.
void CheckSeesWorld(Triad triad,
                    const SimulatedTriad& sensor,
                    const SimulatedWorld& world,
                    Problems* problems) {
  const PerTriad<double> strengths = {{world.gravity_mps2, 0.0, world.field_ut}};
  const std::string name(TriadName(triad));
  const Eigen::Vector3d reach = strengths[triad] * sensor.nominal.sensitivity.rowwise().norm();
  const double low = (sensor.nominal.bias - reach).minCoeff();
  const double high = (sensor.nominal.bias + reach).maxCoeff();
  problems->Require(std::isfinite(low) && std::isfinite(high),
                    name + ": its readings at rest overflow; lower its bias or gains");
  problems->Require(
      !sensor.range_raw || ((*sensor.range_raw)[0] <= low && high <= (*sensor.range_raw)[1]),
      name + " range is " + RangeText(sensor.range_raw.value_or(Eigen::Vector2d::Zero())) +
          " in the unit of the readings; at rest these reach from " + Number(low) + " to " +
          Number(high) + ", so the sensor would saturate");
  problems->Require(strengths[triad] == 0.0 || sensor.resolution_raw < reach.minCoeff(),
                    name + " resolution is " + Number(sensor.resolution_raw) +
                        " in the unit of the readings; at rest the readings differ by at most " +
                        Number(reach.minCoeff()) + " from the bias, so no signal would be visible");
}

/// The ranges are wide: they serve to find wrong units of measure, off by powers of ten.
void CheckWorld(const SimulatedWorld& world, Problems* problems) {
  problems->About("world.gravity_mps2");
  problems->Require(
      world.gravity_mps2 >= 1.5 && world.gravity_mps2 <= 30.0,
      "gravity is " + Number(world.gravity_mps2) +
          " m/s^2; expected 1.5 to 30: 1 g, 980.665 Gal and 980665 mGal are 9.80665 m/s^2");
  problems->About("world.field.strength_ut");
  problems->Require(world.field_ut == 0.0 || (world.field_ut >= 1.0 && world.field_ut <= 1000.0),
                    "field strength is " + Number(world.field_ut) +
                        " uT; expected 1 to 1000: 48000 nT, 480 mG and 0.48 G are 48 uT");
  problems->About("world.field.dip_deg");
  problems->Require(std::abs(world.dip_rad) <= 0.5 * std::numbers::pi,
                    "the dip must lie between -90 and 90 degrees");
  problems->About("world.earth_rate");
  problems->Finite(!world.earth_rate || (std::isfinite(world.earth_rate->latitude_rad) &&
                                         std::isfinite(world.earth_rate->declination_rad)),
                   "latitude and declination");
}

/// The sampling rate, Hz, of a gyroscope that reports mean rates between samples; unset: none does.
std::optional<double> MeanRateHz(const Scenario& scenario) {
  const auto& gyroscope = scenario.sensors[Triad::kGyroscope];
  if (!gyroscope || gyroscope->gyroscope_output != GyroscopeOutput::kMeanRate) return std::nullopt;
  return gyroscope->sampling.rate_hz;
}

struct CheckStep {
  std::string name;                    ///< "motion step 2".
  double slowest_hz;                   ///< Rate of the slowest sensor.
  std::optional<double> mean_rate_hz;  ///< MeanRateHz.
  Problems* problems;

  void operator()(const PosesStep& step) const {
    problems->Require(!step.poses.empty(), name + " has no poses");
    problems->Require(
        step.rest_s > 0.0,
        name + " rests for " + Number(step.rest_s) + " s; poses without rest cannot be measured");
    problems->Positive(step.move_s, name + " time of a move");
    problems->Require(step.rest_spread >= 0.0 && step.rest_spread <= 0.9,
                      name + " spread of the rests is " + Number(step.rest_spread) +
                          "; it must be between 0 and 0.9");
    const double shortest_s = step.rest_s * (1.0 - step.rest_spread);
    problems->Require(!(shortest_s * slowest_hz < 2.0),
                      name + " rests for as little as " + Number(shortest_s) +
                          " s, which is less than two samples at " + Number(slowest_hz) +
                          " Hz; rest longer or sample faster");
    problems->NotNegative(step.tilt_sigma_rad, name + " tilt sigma");
    problems->NotNegative(step.travel_m, name + " travel");
    for (std::size_t k = 0; k < step.poses.size(); ++k) {
      // Quaternions written by hand may have only four digits.
      constexpr double kFarFromUnit = 1e-3;
      problems->Require(std::abs(step.poses[k].world_from_body.norm() - 1.0) < kFarFromUnit,
                        name + " pose " + std::to_string(k + 1) + " is not a unit quaternion");
    }
  }
  void operator()(const TurnStep& step) const {
    CheckAxis(step.axis_in_body);
    problems->Require(step.turns != 0.0 && std::isfinite(step.turns), name + " turns by zero");
    problems->Positive(step.duration_s, name + " duration");
    problems->NotNegative(step.rest_s, name + " rest");
    constexpr double kPeakOfMinimumJerk = 1.875;  // 30 / 16 times the mean rate, at half time.
    CheckFastest(kPeakOfMinimumJerk * 2.0 * std::numbers::pi * step.turns / step.duration_s);
  }
  void operator()(const RateStep& step) const {
    CheckAxis(step.axis_in_body);
    problems->Require(!step.rates_radps.empty(), name + " has no rates");
    for (const double rate_radps : step.rates_radps) {
      problems->Require(
          rate_radps != 0.0 && std::isfinite(rate_radps),
          name + " has a rate of " + Number(rate_radps) + "; use a pose for a turntable at rest");
      CheckFastest(rate_radps);
    }
    problems->Positive(step.hold_s, name + " hold");
    problems->Positive(step.ramp_s, name + " ramp");
    problems->NotNegative(step.rest_s, name + " rest");
  }
  void operator()(const TumbleStep& step) const {
    problems->Positive(step.duration_s, name + " duration");
    problems->Positive(step.rms_rate_radps, name + " RMS rate");
    problems->NotNegative(step.hand_acceleration_mps2, name + " hand acceleration");
    // The worst case: three rates, each a third of the mean square, all at their peaks about one
    // axis.
    CheckFastest(std::sqrt(6.0) * step.rms_rate_radps);
  }

 private:
  void CheckAxis(const Eigen::Vector3d& axis) const {
    problems->Require(axis.norm() > 0.0 && axis.allFinite(), name + " has an axis of zero length");
  }

  /// A mean rate is computed from two attitudes. A turn of over 180° between them looks like a turn
  /// in the other direction.
  void CheckFastest(double rate_radps) const {
    if (!mean_rate_hz || !(*mean_rate_hz > 0.0)) return;
    const double turn_rad = std::abs(rate_radps) / *mean_rate_hz;
    problems->Require(turn_rad < std::numbers::pi,
                      name + " turns at up to " + Number(std::abs(rate_radps) * kDegPerRad) +
                          " deg/s, which is " + Number(turn_rad * kDegPerRad) +
                          " deg in one sampling interval of the gyroscope at " +
                          Number(*mean_rate_hz) +
                          " Hz; a mean rate needs less than half a turn: sample faster, turn "
                          "slower, or write `output: instantaneous`");
  }
};

struct CheckSegment {
  Problems* problems;

  void operator()(const TemperatureHold& hold) const {
    problems->Positive(hold.duration_s, "duration of a temperature hold");
  }
  void operator()(const TemperatureRamp& ramp) const {
    problems->Positive(ramp.rate_degcps, "rate of a temperature ramp");
    problems->Finite(std::isfinite(ramp.to_degc), "end of a temperature ramp");
  }
  void operator()(const TemperatureSine& sine) const {
    problems->Positive(sine.duration_s, "duration of a temperature sine");
    problems->Positive(sine.period_s, "period of a temperature sine");
    problems->Finite(std::isfinite(sine.amplitude_degc), "amplitude of a temperature sine");
  }
};

void CheckTemperature(const Scenario& scenario, Problems* problems) {
  const SimulatedTemperature& temperature = scenario.temperature;
  problems->About("temperature");
  problems->Finite(std::isfinite(temperature.start_degc), "temperature at the start");
  for (const TemperatureSegment& segment : temperature.profile) {
    std::visit(CheckSegment{problems}, segment);
  }
  const bool has_profile = !temperature.profile.empty();
  problems->Require(!has_profile || temperature.soak_degc.empty(),
                    "a temperature profile and soak temperatures exclude each other; to remove "
                    "those of the base scenario, write `profile: []` or `soak_degc: []`");
  for (std::size_t k = 0; k < scenario.motion.size(); ++k) {
    const auto* const poses = std::get_if<PosesStep>(&scenario.motion[k]);
    const bool asks_for_temperature =
        poses != nullptr && std::any_of(poses->poses.begin(), poses->poses.end(), [](auto& pose) {
          return pose.temperature_degc.has_value();
        });
    if (!asks_for_temperature) continue;
    const std::string name = "motion step " + std::to_string(k + 1);
    problems->About(ItemKey("motion", k));
    problems->Require(!has_profile,
                      name +
                          " has poses with their own temperatures, which excludes a temperature "
                          "profile; remove one of the two");
    problems->Require(
        temperature.soak_degc.empty(),
        name +
            " has poses with their own temperatures, which excludes `soak_degc`; remove this key, "
            "or write `soak_degc: []` to override that of the base scenario");
  }
  problems->About("temperature");
  for (const double degc : temperature.soak_degc) {
    problems->Finite(std::isfinite(degc), "a soak temperature");
  }
  problems->Positive(temperature.chamber_rate_degcps, "rate of the chamber");
  problems->NotNegative(temperature.settle_s, "time for the chamber to settle");
  problems->NotNegative(temperature.element_lag_s, "lag of the sensing elements");
  problems->NotNegative(temperature.thermometer_lag_s, "lag of the thermometer");
  problems->NotNegative(temperature.thermometer_noise_degc, "noise of the thermometer");
  problems->NotNegative(temperature.thermometer_resolution_degc, "resolution of the thermometer");
  problems->NotNegative(temperature.hysteresis_degc, "hysteresis");
  problems->NotNegative(temperature.ambient_lag_s, "lag of the ambient thermometer");
  problems->NotNegative(temperature.ambient_noise_degc, "noise of the ambient thermometer");
  problems->NotNegative(temperature.ambient_resolution_degc,
                        "resolution of the ambient thermometer");
  problems->Require(
      temperature.element_ambient_share >= 0.0 && temperature.element_ambient_share <= 1.0,
      "share of the ambient temperature in the elements' temperature must lie between 0 and 1");
}

struct CheckDisturbance {
  const Scenario& scenario;
  std::string name;  ///< "disturbance 2".
  Problems* problems;

  void operator()(const Knock& knock) const {
    CheckTime(knock.when, knock.duration_s);
    problems->Finite(knock.peak_mps2.allFinite(), name + " peak");
  }
  void operator()(const MagnetPassing& magnet) const {
    CheckTime(magnet.when, magnet.duration_s);
    problems->Finite(magnet.peak_ut.allFinite(), name + " peak");
  }
  void operator()(const HardIronStep& step) const { CheckStep(step); }
  void operator()(const FieldStep& step) const { CheckStep(step); }
  void operator()(const StuckSamples& stuck) const {
    CheckTime(stuck.when, stuck.duration_s);
    problems->Require(
        scenario.sensors[stuck.triad].has_value(),
        name + " affects the " + std::string(TriadName(stuck.triad)) + ", which is not simulated");
  }
  void operator()(const UnsettledPose& unsettled) const {
    problems->Positive(unsettled.decay_s, name + " decay");
    problems->Finite(unsettled.tilt_rad.allFinite(), name + " tilt");
  }

 private:
  template <typename Step>
  void CheckStep(const Step& step) const {
    problems->NotNegative(step.when.offset_s, name + " offset");
    problems->Finite(step.change_ut.allFinite(), name + " change");
    problems->Require(scenario.sensors[Triad::kMagnetometer].has_value(),
                      name + " changes the field, but no magnetometer is simulated");
  }
  void CheckTime(const DisturbanceTime& when, double duration_s) const {
    problems->NotNegative(when.offset_s, name + " offset");
    problems->Positive(duration_s, name + " duration");
  }
};

DisturbanceTime TimeOf(const Disturbance& disturbance) {
  return std::visit(
      [](const auto& what) -> DisturbanceTime {
        if constexpr (requires { what.when; }) {
          return what.when;
        } else {
          return {what.rest, 0.0};
        }
      },
      disturbance);
}

/// Checks that the number of rests is not too large, before memory is allocated for each rest.
void CheckRests(const Scenario& scenario, Problems* problems) {
  struct Count {
    std::size_t operator()(const PosesStep& step) const { return step.poses.size(); }
    std::size_t operator()(const TurnStep& /*step*/) const { return 1; }
    std::size_t operator()(const RateStep& step) const { return step.rates_radps.size(); }
    std::size_t operator()(const TumbleStep& /*step*/) const { return 0; }
  };
  // Chosen: a rest and its move take 3.5 kB as motion phases, so that 1 GB is allocated at most.
  constexpr std::size_t kMostSimulatedRests = 300000;
  const std::size_t soaks = std::max<std::size_t>(scenario.temperature.soak_degc.size(), 1);
  std::size_t rests = 0;
  for (const MotionStep& step : scenario.motion) rests += std::visit(Count(), step);
  problems->About("motion");
  problems->Require(
      rests * soaks <= kMostSimulatedRests,
      "the motion has " + std::to_string(rests) + " rests" +
          (soaks > 1 ? " at each of " + std::to_string(soaks) + " temperatures" : "") +
          "; at most " + std::to_string(kMostSimulatedRests) + " in all are allowed");
}

/// A sensor measures nothing at a temperature at which a gain is zero.
void CheckGains(const Scenario& scenario, const Eigen::Vector2d& range_degc, Problems* problems) {
  constexpr int kGainSteps = 64;  // Many steps, as a cubic has up to two turning points.
  for (const Triad triad : kTriads) {
    if (!scenario.sensors[triad] || !scenario.sensors[triad]->thermal) continue;
    const SimulatedTriad& sensor = *scenario.sensors[triad];
    const Eigen::Array3d nominal = sensor.nominal.sensitivity.diagonal();
    for (int i = 0; i <= kGainSteps; ++i) {
      const double degc = range_degc[0] + (range_degc[1] - range_degc[0]) * i / kGainSteps;
      const TriadModel<double> model = ModelAtTemperature(sensor.nominal, *sensor.thermal, degc);
      const Eigen::Array3d share = model.sensitivity.diagonal().array() / nominal;
      if ((share > 0.0).all()) continue;
      problems->About(SensorKey(triad));
      problems->Require(false,
                        std::string(TriadName(triad)) + ": a gain is " + Number(share.minCoeff()) +
                            " of its nominal size at " + Number(degc) +
                            " degC, within the simulated range (" + RangeText(range_degc) +
                            "); lower its temperature terms so that the gain keeps its sign");
      break;
    }
  }
}

/// Checks the motion as a whole, which is only possible if every single value is right.
void CheckTimeline(const Scenario& scenario, Problems* problems) {
  const Timeline timeline = MakeTimeline(scenario, 0);
  constexpr double kLongestS = 1e8;  // Three years; far below the end of int64 nanoseconds.
  problems->About("motion");
  problems->Require(timeline.motion.duration_s() <= kLongestS,
                    "the recording would last " + Number(timeline.motion.duration_s()) +
                        " s; the limit is 1e8 s");
  const int rests = static_cast<int>(timeline.rests.size());
  for (std::size_t k = 0; k < scenario.disturbances.size(); ++k) {
    const std::string name = "disturbance " + std::to_string(k + 1);
    const DisturbanceTime when = TimeOf(scenario.disturbances[k]);
    problems->About(ItemKey("disturbances", k));
    const bool has_rest = !when.rest || (*when.rest >= 1 && *when.rest <= rests);
    problems->Require(has_rest,
                      name + " is set for rest " + std::to_string(when.rest.value_or(0)) +
                          "; expected rests 1 to " + std::to_string(rests));
    if (!has_rest) continue;
    const double begin_s = SpanOf(when, 0.0, timeline.rests).begin_s;
    problems->Require(begin_s < timeline.motion.duration_s(),
                      name + " begins at " + Number(begin_s) + " s; the recording ends at " +
                          Number(timeline.motion.duration_s()) + " s");
  }
  CheckGains(scenario, ElementRange(scenario, timeline), problems);
}

}  // namespace

std::vector<Error> Scenario::Mistakes() const {
  Problems problems;
  // The folders of units are numbered with four digits.
  constexpr int kMostUnits = 9999;
  problems.About("description");
  problems.Require(
      description.find_first_of("\r\n") == std::string::npos,
      "the description must be one line; it is written to the first line of recordings");
  problems.About("count");
  problems.Require(count >= 1 && count <= kMostUnits,
                   "count is " + std::to_string(count) + "; it must be 1 to 9999 units");
  problems.About("device.serial");
  problems.Require(
      !serial.empty() && serial != "." && serial != ".." &&
          serial.find_first_of("/\\\n\"") == std::string::npos,
      "the serial is used as a file name; it must not be empty or contain a slash or a quote");
  problems.About("sensors");
  problems.Require(
      std::any_of(
          sensors.begin(), sensors.end(), [](const auto& sensor) { return sensor.has_value(); }),
      "no sensor is enabled; list at least one of accelerometer, gyroscope and magnetometer");
  const std::size_t before_world = problems.errors().size();
  CheckWorld(world, &problems);
  const bool is_world_right = problems.errors().size() == before_world;
  for (const Triad triad : kTriads) {
    if (!sensors[triad]) continue;
    problems.About(SensorKey(triad));
    CheckTriad(triad, *sensors[triad], &problems);
    // If the world is wrong, a sensor that does not fit it may be right.
    if (is_world_right) CheckSeesWorld(triad, *sensors[triad], world, &problems);
  }
  double slowest_hz = std::numeric_limits<double>::infinity();
  for (const auto& sensor : sensors) {
    if (sensor) slowest_hz = std::min(slowest_hz, sensor->sampling.rate_hz);
  }
  problems.About("motion");
  problems.Require(!motion.empty(), "the motion has no steps");
  for (std::size_t k = 0; k < motion.size(); ++k) {
    problems.About(ItemKey("motion", k));
    std::visit(
        CheckStep{"motion step " + std::to_string(k + 1), slowest_hz, MeanRateHz(*this), &problems},
        motion[k]);
  }
  problems.About("first_rest_s");
  problems.NotNegative(first_rest_s, "the first rest");
  CheckTemperature(*this, &problems);
  for (std::size_t k = 0; k < disturbances.size(); ++k) {
    problems.About(ItemKey("disturbances", k));
    std::visit(CheckDisturbance{*this, "disturbance " + std::to_string(k + 1), &problems},
               disturbances[k]);
  }
  CheckRests(*this, &problems);
  if (problems.empty()) CheckTimeline(*this, &problems);
  return problems.errors();
}

Status Scenario::Validate() const {
  const std::vector<Error> mistakes = Mistakes();
  return mistakes.empty() ? Status() : Joined(mistakes);
}

}  // namespace truetriad
