// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/documents.h"
#include "config/experiment_draft.h"
#include "config/yaml_values.h"
#include "truetriad/model/earth.h"
#include "truetriad/model/mounting.h"

// From what the keys of an experiment say to the experiment: what depends on several of them.

namespace truetriad {
namespace {

using Draft = ExperimentDraft;

Knowledge KnowledgeOf(const Stated& stated, double unit = 1.0) {
  if (!stated.value) return {};
  return {*stated.value * unit, stated.sigma.value_or(0.0) * unit};
}

// From 9.78 at the equator to 9.83 at the poles, less up high.
constexpr double kAnywhereGravitySigmaMps2 = 0.02;

void SettleGravity(Draft* draft) {
  Stated& gravity = draft->gravity_mps2;
  if (!gravity.value && draft->experiment.position) {
    const SitePosition& position = *draft->experiment.position;
    draft->given.insert("reference.gravity_mps2");
    gravity = {NormalGravityMps2(position.latitude_deg, position.height_m),
               gravity.sigma.value_or(kNormalGravitySigmaMps2)};
  }
  if (!gravity.value) {
    gravity = {kStandardGravityMps2, gravity.sigma.value_or(kAnywhereGravitySigmaMps2)};
  }
  draft->experiment.options.reference.gravity_mps2 = KnowledgeOf(gravity);
}

/// The Earth's field at the position, or why there is none; neither when nothing asks for it.
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
                                 "; give both";
    return;
  }
  const Result<double> year = DecimalYear(position.date);
  if (!year) return;  // Was refused where it stands.
  const Result<EarthField> field = WorldMagneticModel(
      {position.latitude_deg, *position.longitude_deg, position.height_m}, *year);
  if (field) {
    experiment->earth_field = *field;
  } else {
    experiment->no_earth_field = field.error().message;
  }
}

/// What the experiment leaves to the Earth's field at its position.
template <typename Fail>
void SettleField(Draft* draft, Fail fail) {
  Experiment& experiment = draft->experiment;
  FindEarthField(&experiment);
  const std::optional<EarthField>& earth = experiment.earth_field;
  // What is stated wins, also that it is unknown.
  const auto take = [&](const char* key, double value, double sigma, Stated* stated) {
    const std::string name = std::string("reference.field.") + key;
    if (stated->value || draft->given.contains(name)) return;
    draft->given.insert(name);
    *stated = {value, stated->sigma.value_or(sigma)};
  };
  if (draft->field_site == FieldSite::kClean) {
    if (earth) {
      take("strength_ut", earth->strength_ut, earth->strength_sigma_ut, &draft->strength_ut);
      take("dip_deg", earth->dip_deg, earth->dip_sigma_deg, &draft->dip_deg);
    } else if (!draft->strength_ut.value || !draft->dip_deg.value) {
      fail("reference.field",
           "`site: clean` needs the field at the position, but " + experiment.no_earth_field);
    }
  }
  // The magnetic equator lies nowhere farther from the other one than 16 degrees.
  constexpr double kNearEquatorDeg = 20.0;
  const bool is_far_from_equator =
      experiment.position && std::abs(experiment.position->latitude_deg) > kNearEquatorDeg;
  if ((earth || is_far_from_equator) && !draft->given.contains("reference.field.hemisphere")) {
    draft->given.insert("reference.field.hemisphere");
    experiment.options.reference.northern_hemisphere =
        (earth ? earth->dip_deg : experiment.position->latitude_deg) >= 0.0;
    experiment.options.reference.is_hemisphere_stated = true;
  }
}

template <typename Fail>
void SettleEarthRate(Draft* draft, Fail fail) {
  const Experiment& experiment = draft->experiment;
  draft->experiment.options.reference.earth_rate.reset();
  if (!draft->earth_rate) return;
  StatedEarthRate& rate = *draft->earth_rate;
  if (!rate.latitude && experiment.position) {
    draft->given.insert("reference.earth_rate.latitude_deg");
    rate.latitude = experiment.position->latitude_deg;
  }
  if (!rate.latitude) {
    fail("reference.earth_rate",
         "the latitude is missing; give `latitude_deg:` or `reference.position`");
  }
  const bool has_place = experiment.position && experiment.position->longitude_deg &&
                         !experiment.position->date.empty();
  if (!rate.declination && experiment.earth_field) {
    draft->given.insert("reference.earth_rate.declination_deg");
    rate.declination = experiment.earth_field->declination_deg;
  } else if (!rate.declination && has_place && !experiment.no_earth_field.empty()) {
    fail("reference.earth_rate",
         "the declination is missing, because " + experiment.no_earth_field +
             "; fix that or give `declination_deg:`");
  }
  draft->experiment.options.reference.earth_rate = EarthRateOptions{
      rate.latitude.value_or(0.0) * kRadPerDeg, rate.declination.value_or(0.0) * kRadPerDeg};
}

/// What a temperature sweep takes, and what only it takes.
template <typename Fail>
void SettleSweep(const Draft& draft, Experiment* experiment, const Fail& fail) {
  CalibrateOptions& options = experiment->options;
  options.sweep.reset();
  experiment->static_file = Resolve(draft.static_file, experiment->path);
  experiment->reference_given = draft.given.contains("reference.temperature_degc");
  if (experiment->poses.kind != PoseSelectionKind::kSweep) {
    if (!draft.static_file.empty()) {
      fail("static", "applies only to `poses: { sweep: auto }`; remove it");
    }
    for (const Triad triad : kTriads) {
      const ThermalOptions& thermal = options.triads[triad].thermal;
      if (!thermal.needs_sweep()) continue;
      fail("sensors." + std::string(TriadName(triad)) + ".thermal",
           "knots, lags and a regression need a sweep, `poses: { sweep: auto }`; remove them");
    }
    return;
  }
  options.sweep.emplace();
  if (experiment->plan) fail("plan", "applies to poses, not to a sweep; remove one of them");
  // Neighbouring windows are alike: what is held out are blocks of time, enough of them that each
  // is a small part of the temperatures.
  constexpr int kSweepFolds = 14;
  if (!draft.given.contains("cross_validation.folds")) options.cross_validation_folds = kSweepFolds;
  if (!(draft.turns_file.empty() && draft.rates_file.empty()) ||
      options.attitudes.kind != AttitudeKind::kNone) {
    fail("poses",
         "a sweep cannot be combined with turns:, rates: or attitudes:, which apply to poses; "
         "remove them");
  }
  if (options.initialise.only) fail("initialise.only", "a sweep has no start values; remove it");
  for (const Triad triad : kTriads) {
    const TriadOptions& sensor = options.triads[triad];
    experiment->poses.sweep.ambient =
        experiment->poses.sweep.ambient ||
        (sensor.enabled && (sensor.thermal.has_factor(RegressionFactor::kAmbient) ||
                            sensor.thermal.has_factor(RegressionFactor::kAmbientRate)));
    const std::string name = "sensors." + std::string(TriadName(triad));
    if (sensor.prior) fail(name + ".prior", "has no effect on a sweep; remove it");
    if (sensor.nonlinearity) {
      fail(name + ".nonlinearity",
           "a sweep does not estimate the sensitivity, so nothing is widened by it; remove it, and "
           "state it for the calibration at one temperature");
    }
    if (sensor.noise_sigma_raw || sensor.allan || sensor.excess == ExcessNoise::kGiven) {
      fail(name + ".noise", "the noise of a sweep comes from its windows; remove it");
    }
  }
}

/// A model that is chosen is chosen as a whole, but for what the experiment says itself.
void LeaveModelsOpen(Draft* draft) {
  CalibrateOptions& options = draft->experiment.options;
  for (const Triad triad : kTriads) {
    TriadOptions& sensor = options.triads[triad];
    if (sensor.model != MatrixModel::kAuto) continue;
    const auto leave_open = [&](std::string_view key, Wanted* term) {
      const std::string name = "sensors." + std::string(TriadName(triad)) + "." + std::string(key);
      if (!draft->given.contains(name)) *term = Wanted::kAuto;
    };
    // It shows only where gravity is seen.
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

/// What nobody states follows from a matrix that is held or known beforehand; else the axes of
/// accelerometer and gyroscope are those of the body.
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

// Files stand beside the experiment.
void ResolvePaths(Draft* draft) {
  Experiment& experiment = draft->experiment;
  experiment.inputs.clear();
  for (const std::string& input : draft->inputs) {
    experiment.inputs.push_back(Resolve(input, experiment.path));
  }
  experiment.forces_file = Resolve(draft->forces_file, experiment.path);
  for (const Triad triad : kTriads) {
    experiment.allan_files[triad] = Resolve(draft->allan_files[triad], experiment.path);
  }
  experiment.poses.file = Resolve(draft->pose_file, experiment.path);
  experiment.attitudes_file = experiment.options.attitudes.kind == AttitudeKind::kGiven
                                  ? Resolve(draft->attitudes_file, experiment.path)
                                  : "";
}

}  // namespace

void Settle(Draft* draft, std::vector<Error>* errors) {
  Experiment& experiment = draft->experiment;
  CalibrateOptions& options = experiment.options;
  const auto fail = [&](const std::string& key, const std::string& problem) {
    errors->push_back(ErrorAtKey(*draft, ErrorCode::kConflictingKeys, key, key + ": " + problem));
  };
  const std::string motions_key = draft->turns_file.empty() ? "rates" : "turns";
  SettleGravity(draft);
  SettleField(draft, fail);
  for (const auto& [name, stated] :
       {std::pair("strength_ut", &draft->strength_ut), std::pair("dip_deg", &draft->dip_deg)}) {
    if (stated->sigma && !stated->value) {
      fail(std::string("reference.field.") + name, "has a sigma but no value; add `value:`");
    }
  }
  options.reference.field_ut = KnowledgeOf(draft->strength_ut);
  options.reference.dip_rad = KnowledgeOf(draft->dip_deg, kRadPerDeg);

  SettleEarthRate(draft, fail);

  // A turn has an axis.
  options.has_stated_axes = draft->known_motions.rate_axes_known || !draft->turns_file.empty();
  options.gauge = draft->gauge.value_or(options.IsBodyKnown() ? Gauge::kFixture : Gauge::kAccelX);
  if (options.gauge == Gauge::kFixture && !options.IsBodyKnown()) {
    fail("gauge",
         "fixture needs known attitudes, or known axes of rates; give `attitudes:` or choose "
         "another gauge");
  }

  bool any_enabled = false;
  for (const Triad triad : kTriads) {
    any_enabled |= options.triads[triad].enabled;
    const std::string prior = "sensors." + std::string(TriadName(triad)) + ".prior.";
    for (const std::string value : {"bias", "sensitivity"}) {
      if (draft->given.contains(prior + value) != draft->given.contains(prior + value + "_sigma")) {
        fail(prior + value, "belongs together with " + value + "_sigma; give both or none");
      }
    }
  }
  LeaveModelsOpen(draft);
  SettleMounting(*draft, &options);
  if (!any_enabled) {
    fail("sensors", "is missing; list what to calibrate, as in `sensors: { accelerometer: {} }`");
  }
  const bool has_gyroscope = options.triads[Triad::kGyroscope].enabled;
  if (!has_gyroscope && !(draft->turns_file.empty() && draft->rates_file.empty())) {
    fail(motions_key,
         "turns: and rates: need the gyroscope, which is not enabled; list it under `sensors:` or "
         "remove them");
  }
  experiment.poses.known_motions = draft->known_motions;
  experiment.poses.known_motions.turns_file = Resolve(draft->turns_file, experiment.path);
  experiment.poses.known_motions.rates_file = Resolve(draft->rates_file, experiment.path);
  experiment.poses.moves = has_gyroscope;
  experiment.poses.time_offset_s = draft->time_offset_s;
  experiment.poses.exclude = draft->exclude;
  experiment.poses.time_stamps = draft->time_stamps;
  const bool has_poses = experiment.poses.kind != PoseSelectionKind::kMotion &&
                         experiment.poses.kind != PoseSelectionKind::kSweep;
  if (!has_poses && !experiment.exclude_poses.empty()) {
    fail("exclude_poses", "motion and a sweep have no poses with numbers; use `exclude:`");
  }
  options.motion.reset();
  if (experiment.poses.kind == PoseSelectionKind::kMotion) {
    if (!options.corrects_clocks) {
      fail("clocks", "a motion is followed with the clocks that it shows; remove `as_stated`");
    }
    if (!(draft->turns_file.empty() && draft->rates_file.empty())) {
      fail(motions_key,
           "turns: and rates: need rests and cannot be combined with `poses: { motion: {} }`; remove "
           "one of them");
    }
    options.motion = MotionOptions{experiment.poses.motion_spacing_s};
  }
  SettleSweep(*draft, &experiment, fail);
  ResolvePaths(draft);
}

}  // namespace truetriad
