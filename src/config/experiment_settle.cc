// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "config/experiment_draft.h"
#include "truetriad/model/calibration.h"

// Derives those options of an experiment that depend on several of its keys.

namespace truetriad {
namespace {

using Draft = ExperimentDraft;

Knowledge KnowledgeOf(const Stated& stated, double unit = 1.0) {
  if (!stated.value) return {};
  return {*stated.value * unit, stated.sigma.value_or(0.0) * unit};
}

// σ of gravity at an unknown place: gravity is 9.78 m/s^2 at the equator and 9.83 at the poles.
constexpr double kAnywhereGravitySigmaMps2 = 0.02;

void SettleGravity(Draft* draft) {
  Stated& gravity = draft->gravity_mps2;
  if (!gravity.value && draft->experiment.position) {
    const SitePosition& position = *draft->experiment.position;
    draft->given.emplace("reference.gravity_mps2", "");
    gravity = {NormalGravityMps2(position.latitude_deg, position.height_m),
               gravity.sigma.value_or(kNormalGravitySigmaMps2)};
  }
  if (!gravity.value) {
    gravity = {kStandardGravityMps2, gravity.sigma.value_or(kAnywhereGravitySigmaMps2)};
  }
  draft->experiment.options.reference.gravity_mps2 = KnowledgeOf(gravity);
}

/// Finds the Earth's field at the position, or the reason why it is unknown.
void FindEarthField(Experiment* experiment) {
  experiment->earth_field.reset();
  experiment->no_earth_field.clear();
  if (!experiment->position) {
    experiment->no_earth_field =
        "`reference.position` is missing; give its latitude_deg, longitude_deg, height_m and date";
    return;
  }
  const SitePosition& position = *experiment->position;
  if (!position.longitude_deg || position.date.empty()) {
    experiment->no_earth_field = "`reference.position` has no " +
                                 std::string(position.longitude_deg  ? "date"
                                             : position.date.empty() ? "longitude_deg and no date"
                                                                     : "longitude_deg") +
                                 "; state longitude_deg and date";
    return;
  }
  const Result<double> year = DecimalYear(position.date);
  if (!year) return;  // The invalid date has been reported at its key.
  const Result<EarthField> field = WorldMagneticModel(
      {position.latitude_deg, *position.longitude_deg, position.height_m}, *year);
  if (field) {
    experiment->earth_field = *field;
  } else {
    experiment->no_earth_field = field.error().message;
  }
}

/// Completes the field and the hemisphere: values that the experiment does not state come from the
/// model of the Earth's field. Strength and dip are completed only if the site is clean.
void SettleField(Draft* draft) {
  Experiment& experiment = draft->experiment;
  FindEarthField(&experiment);
  const std::optional<EarthField>& earth = experiment.earth_field;
  // A stated value takes precedence, even if it is `unknown`.
  const auto take = [&](const char* key, double value, double sigma, Stated* stated) {
    const std::string name = std::string("reference.field.") + key;
    if (stated->value || draft->given.contains(name)) return;
    draft->given.emplace(name, "");
    *stated = {value, stated->sigma.value_or(sigma)};
  };
  if (draft->field_site == FieldSite::kClean && earth) {
    take("strength_ut", earth->strength_ut, earth->strength_sigma_ut, &draft->strength_ut);
    take("dip_deg", earth->dip_deg, earth->dip_sigma_deg, &draft->dip_deg);
  }
  // The magnetic equator is within 16 degrees of the geographic one everywhere.
  constexpr double kNearEquatorDeg = 20.0;
  const bool is_far_from_equator =
      experiment.position && std::abs(experiment.position->latitude_deg) > kNearEquatorDeg;
  if ((earth || is_far_from_equator) && !draft->given.contains("reference.field.hemisphere")) {
    draft->given.emplace("reference.field.hemisphere", "");
    experiment.options.reference.northern_hemisphere =
        (earth ? earth->dip_deg : experiment.position->latitude_deg) >= 0.0;
    experiment.options.reference.is_hemisphere_stated = true;
  }
  experiment.options.reference.field_ut = KnowledgeOf(draft->strength_ut);
  experiment.options.reference.dip_rad = KnowledgeOf(draft->dip_deg, kRadPerDeg);
}

void SettleEarthRate(Draft* draft) {
  const Experiment& experiment = draft->experiment;
  draft->experiment.options.reference.earth_rate.reset();
  if (!draft->earth_rate) return;
  StatedEarthRate& rate = *draft->earth_rate;
  if (!rate.latitude && experiment.position) {
    draft->given.emplace("reference.earth_rate.latitude_deg", "");
    rate.latitude = experiment.position->latitude_deg;
  }
  if (!rate.declination && experiment.earth_field) {
    draft->given.emplace("reference.earth_rate.declination_deg", "");
    rate.declination = experiment.earth_field->declination_deg;
  }
  draft->experiment.options.reference.earth_rate = EarthRateOptions{
      rate.latitude.value_or(0.0) * kRadPerDeg, rate.declination.value_or(0.0) * kRadPerDeg};
}

bool HasKnownMotions(const Experiment& experiment) {
  const KnownMotionsConfig& motions = experiment.poses.known_motions;
  return !(motions.turns_file.empty() && motions.rates_file.empty());
}

/// Sets the options that depend on how poses are found.
void SettlePoses(Draft* draft) {
  Experiment& experiment = draft->experiment;
  CalibrateOptions& options = experiment.options;
  PosesConfig& poses = experiment.poses;
  poses.moves = options.triads[Triad::kGyroscope].enabled;
  experiment.reference_given = draft->given.contains("reference.temperature_degc");
  options.motion.reset();
  options.sweep.reset();
  if (poses.kind == PoseSelectionKind::kMotion) {
    options.motion = MotionOptions{poses.motion_spacing_s};
  }
  if (poses.kind != PoseSelectionKind::kSweep) return;
  options.sweep.emplace();
  // Neighbouring windows are correlated, so cross-validation holds out blocks of time: each of the
  // 14 is 7 % of the sweep.
  constexpr int kSweepFolds = 14;
  if (!draft->given.contains("cross_validation.folds")) {
    options.cross_validation_folds = kSweepFolds;
  }
  for (const TriadOptions& sensor : options.triads) {
    const ThermalOptions& thermal = sensor.thermal;
    poses.sweep.ambient |= sensor.enabled && (thermal.has_factor(RegressionFactor::kAmbient) ||
                                              thermal.has_factor(RegressionFactor::kAmbientRate));
  }
}

/// If a sensor's matrix model is `auto`, the terms of the automatic model that the experiment does
/// not state become `auto`, too.
void LeaveModelsOpen(Draft* draft) {
  CalibrateOptions& options = draft->experiment.options;
  for (const Triad triad : kTriads) {
    TriadOptions& sensor = options.triads[triad];
    if (sensor.model != MatrixModel::kAuto) continue;
    const auto leave_open = [&](std::string_view key, Wanted* term) {
      const std::string name = "sensors." + std::string(TriadName(triad)) + "." + std::string(key);
      if (!draft->given.contains(name)) *term = Wanted::kAuto;
    };
    // The g-sensitivity is observable only if gravity is measured.
    if (triad == Triad::kGyroscope && options.triads[Triad::kAccelerometer].enabled) {
      leave_open("g_sensitivity", &sensor.g_sensitivity);
    }
    for (const AxisTermInfo& info : kAxisTerms) {
      if (info.triad == triad && info.is_in_auto_model) {
        leave_open(info.name, &sensor.axis_terms[info.term]);
      }
    }
  }
}

/// If no mounting is stated, it is the one nearest to the fixed matrix, or else to the prior.
/// Without both, the axes of accelerometer and gyroscope are those of the body, and the
/// magnetometer's mounting is unknown.
void SettleMounting(const Draft& draft, CalibrateOptions* options) {
  for (const Triad triad : kTriads) {
    TriadOptions& sensor = options->triads[triad];
    sensor.mounting.reset();
    if (draft.mounting[triad]) {
      sensor.mounting = draft.mounting[triad]->map;
      continue;
    }
    const double sign = sensor.sign == AccelerometerSign::kGravity ? -1.0 : 1.0;
    if (sensor.fixed_sensitivity) {
      sensor.mounting = NearestAxisMap(sign * *sensor.fixed_sensitivity);
    } else if (sensor.prior && sensor.prior->sensitivity_sigma.allFinite()) {
      sensor.mounting = NearestAxisMap(sign * sensor.prior->sensitivity);
    } else if (triad != Triad::kMagnetometer) {
      sensor.mounting = Eigen::Matrix3d::Identity();
    }
  }
}

/// A rule for a combination of keys, and the message if the rule is broken.
struct Rule {
  bool is_broken;
  std::string key;
  std::string sentence;
};

std::vector<Rule> ReferenceRules(const Draft& draft) {
  const Experiment& experiment = draft.experiment;
  const auto& position = experiment.position;
  const StatedEarthRate rate = draft.earth_rate.value_or(StatedEarthRate{0.0, 0.0});
  const auto lacks_value = [](const Stated& stated) { return stated.sigma && !stated.value; };
  return {{draft.field_site == FieldSite::kClean && !experiment.earth_field &&
               !(draft.strength_ut.value && draft.dip_deg.value),
           "reference.field",
           "`site: clean` takes the field from the model of the Earth's field, but " +
               experiment.no_earth_field},
          {lacks_value(draft.strength_ut),
           "reference.field.strength_ut",
           "has a sigma but no value; add `value:`"},
          {lacks_value(draft.dip_deg),
           "reference.field.dip_deg",
           "has a sigma but no value; add `value:`"},
          {!rate.latitude,
           "reference.earth_rate",
           "the latitude is missing; give `latitude_deg:` or `reference.position`"},
          {!rate.declination && position && position->longitude_deg && !position->date.empty() &&
               !experiment.no_earth_field.empty(),
           "reference.earth_rate",
           "the declination is missing, because " + experiment.no_earth_field +
               "; fix that or give `declination_deg:`"}};
}

std::vector<Rule> SensorRules(const Draft& draft, Triad triad) {
  const CalibrateOptions& options = draft.experiment.options;
  const TriadOptions& sensor = options.triads[triad];
  const bool is_sweep = options.sweep.has_value();
  const std::string name = "sensors." + std::string(TriadName(triad));
  const auto is_half = [&](const std::string& value) {
    const std::string key = name + ".prior." + value;
    return draft.given.contains(key) != draft.given.contains(key + "_sigma");
  };
  return {
      {is_half("bias"),
       name + ".prior.bias",
       "belongs together with bias_sigma; give both or none"},
      {is_half("sensitivity"),
       name + ".prior.sensitivity",
       "belongs together with sensitivity_sigma; give both or none"},
      {!is_sweep && sensor.thermal.needs_sweep(),
       name + ".thermal",
       "knots, lags and a regression need a sweep, `poses: { sweep: auto }`; remove them"},
      {is_sweep && sensor.prior, name + ".prior", "has no effect on a sweep; remove it"},
      {is_sweep && sensor.nonlinearity,
       name + ".nonlinearity",
       "has no effect on a sweep, which does not estimate the sensitivity; state it in the "
       "experiment of the static calibration instead"},
      {is_sweep && (sensor.noise_sigma_raw || sensor.allan || sensor.excess == ExcessNoise::kGiven),
       name + ".noise",
       "has no effect on a sweep, which estimates the noise from its windows; remove it"}};
}

std::vector<Rule> PoseRules(const Draft& draft) {
  const Experiment& experiment = draft.experiment;
  const CalibrateOptions& options = experiment.options;
  const bool is_sweep = options.sweep.has_value(), is_motion = options.motion.has_value();
  const bool has_motions = HasKnownMotions(experiment);
  const std::string motions = experiment.poses.known_motions.turns_file.empty() ? "rates" : "turns";
  return {
      {has_motions && !options.triads[Triad::kGyroscope].enabled,
       motions,
       "turns: and rates: need the gyroscope, which is not enabled; list it under `sensors:`, or "
       "remove these keys"},
      {(is_motion || is_sweep) && !experiment.exclude_poses.empty(),
       "exclude_poses",
       "applies only to numbered poses, which motion and sweeps lack; exclude times with "
       "`exclude:`"},
      {is_motion && !options.corrects_clocks,
       "clocks",
       "`as_stated` cannot be combined with motion, which needs estimated clock offsets; remove "
       "it"},
      {is_motion && has_motions,
       motions,
       "turns: and rates: need rests and cannot be combined with `poses: { motion: {} }`; remove "
       "these keys or the motion"},
      {!is_sweep && !experiment.static_file.empty(),
       "static",
       "applies only to `poses: { sweep: auto }`; remove it"},
      {is_sweep && experiment.plan,
       "plan",
       "applies to poses, not to a sweep; remove the plan or the sweep"},
      {is_sweep && (has_motions || options.attitudes.kind != AttitudeKind::kNone),
       "poses",
       "a sweep cannot be combined with turns:, rates: or attitudes:, which apply to poses; remove "
       "these keys"},
      {is_sweep && options.initialise.only,
       "initialise.only",
       "a sweep has no start values; remove it"}};
}

std::vector<Rule> Rules(const Draft& draft) {
  const CalibrateOptions& options = draft.experiment.options;
  std::vector<Rule> rules = ReferenceRules(draft);
  const auto add = [&rules](const std::vector<Rule>& more) {
    rules.insert(rules.end(), more.begin(), more.end());
  };
  add({{options.gauge == Gauge::kFixture && !options.IsBodyKnown(),
        "gauge",
        "fixture needs known attitudes, or known axes of rates; give `attitudes:` or choose "
        "another gauge"},
       {std::none_of(options.triads.begin(),
                     options.triads.end(),
                     [](const TriadOptions& sensor) { return sensor.enabled; }),
        "sensors",
        "is missing; list what to calibrate, as in `sensors: { accelerometer: {} }`"}});
  add(PoseRules(draft));
  for (const Triad triad : kTriads) add(SensorRules(draft, triad));
  return rules;
}

}  // namespace

void Settle(Draft* draft, std::vector<Error>* errors) {
  CalibrateOptions& options = draft->experiment.options;
  const KnownMotionsConfig& motions = draft->experiment.poses.known_motions;
  SettleGravity(draft);
  SettleField(draft);
  SettleEarthRate(draft);
  // A stated turn always has an axis.
  options.has_stated_axes = motions.rate_axes_known || !motions.turns_file.empty();
  options.gauge = draft->gauge.value_or(options.IsBodyKnown() ? Gauge::kFixture : Gauge::kAccelX);
  LeaveModelsOpen(draft);
  SettleMounting(*draft, &options);
  SettlePoses(draft);
  for (const auto& [is_broken, key, sentence] : Rules(*draft)) {
    if (!is_broken) continue;
    errors->push_back(ErrorAtKey(*draft, ErrorCode::kConflictingKeys, key, key + ": " + sentence));
  }
}

}  // namespace truetriad
