// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "config/experiment_draft.h"
#include "config/plan.h"
#include "config/yaml_values.h"
#include "io/tags_yaml.h"
#include "io/yaml_reader.h"
#include "truetriad/model/earth.h"
#include "truetriad/model/mounting.h"

// What each key of an experiment says, on top of what was said before.

namespace truetriad {
namespace {

using Draft = ExperimentDraft;

void ReadDevice(YamlReader reader, Experiment* experiment) {
  if (!reader) return;
  reader.Child("serial").ReadName(&experiment->serial);
  reader.Child("model").ReadName(&experiment->model);
  ReadDeviceTags(&reader, &experiment->tags);
  reader.RejectUnknown();
}

// `given`: what any document states; the parts of a position may be in several.
void ReadPosition(YamlReader reader,
                  const std::set<std::string>& given,
                  std::optional<SitePosition>* position) {
  if (!reader) return;
  SitePosition site = position->value_or(SitePosition());
  const auto read = [&](const std::string& key, const Range& range, double* value) {
    const bool is_stated = given.contains("reference.position." + key);
    ReadNumber(is_stated ? reader.Child(key) : reader.RequireChild(key), range, value);
  };
  read("latitude_deg", kLatitudeDeg, &site.latitude_deg);
  read("height_m", {-1000.0, 20000.0, "a height in metres"}, &site.height_m);
  if (double longitude = 0.0; ReadNumber(reader.Child("longitude_deg"),
                                         {-180.0, 360.0, "a longitude of -180 to 360 degrees"},
                                         &longitude)) {
    site.longitude_deg = longitude;
  }
  if (YamlReader date = reader.Child("date"); date.Read(&site.date)) {
    if (const Result<double> year = DecimalYear(site.date); !year) date.Fail(year.error().message);
  }
  reader.RejectUnknown();
  *position = site;
}

void ReadEarthRate(YamlReader reader, std::optional<StatedEarthRate>* earth_rate) {
  if (!reader) return;
  if (IsWord(reader, "none")) {
    earth_rate->reset();
    return;
  }
  if (IsWord(reader, "position")) {
    *earth_rate = StatedEarthRate();
    return;
  }
  StatedEarthRate stated = earth_rate->value_or(StatedEarthRate());
  double latitude = 0.0;
  if (ReadNumber(reader.Child("latitude_deg"), kLatitudeDeg, &latitude)) {
    stated.latitude = latitude;
  }
  double declination = 0.0;
  if (ReadNumber(reader.Child("declination_deg"), kDeclinationDeg, &declination)) {
    stated.declination = declination;
  }
  reader.RejectUnknown();
  *earth_rate = stated;
}

// `true`: one σ.
void ReadStrict(YamlReader reader, std::optional<double>* shift_sigmas) {
  if (!reader) return;
  if (IsWord(reader, "false")) {
    shift_sigmas->reset();
    return;
  }
  double most = 1.0;
  if (!IsWord(reader, "true")) ReadNumber(std::move(reader), kNotNegative, &most);
  *shift_sigmas = most;
}

void ReadReference(YamlReader reader, Draft* draft) {
  if (!reader) return;
  ReferenceOptions& reference = draft->experiment.options.reference;
  ReadStated(reader.Child("gravity_mps2"),
             {9.7, 9.9, "gravity at the Earth's surface in m/s^2, 9.7 to 9.9"},
             false,
             &draft->gravity_mps2);
  ReadPosition(reader.Child("position"), draft->given, &draft->experiment.position);
  if (YamlReader field = reader.Child("field")) {
    // No upper end: people normalise the field to 1 or use coils.
    ReadStated(field.Child("strength_ut"), kPositive, true, &draft->strength_ut);
    ReadStated(field.Child("dip_deg"), kDipDeg, true, &draft->dip_deg);
    if (YamlReader hemisphere = field.Child("hemisphere")) {
      ReadChoice(std::move(hemisphere), kHemispheres, &reference.northern_hemisphere);
      reference.is_hemisphere_stated = true;
    }
    ReadChoice(field.Child("site"), kFieldSites, &draft->field_site);
    field.RejectUnknown();
  }
  ReadNumber(reader.Child("temperature_degc"), kTemperatureDegc, &reference.temperature_degc);
  ReadEarthRate(reader.Child("earth_rate"), &draft->earth_rate);
  reader.RejectUnknown();
}

/// `auto`, or windows of a length in time or samples, and the file that says where attitudes are.
void ReadSweep(YamlReader reader, Draft* draft, SweepWindows* windows) {
  if (IsWord(reader, "auto")) return;
  ReadNumber(reader.Child("window_s"), kPositive, &windows->window_s);
  if (YamlReader samples = reader.Child("window_samples");
      samples.Read(&windows->window_samples) && windows->window_samples < 1) {
    samples.Fail("expected at least 1 sample");
  }
  if (windows->window_s > 0.0 && windows->window_samples > 0) {
    reader.Fail("window_s and window_samples exclude each other; keep one");
  }
  reader.Optional("attitudes", &draft->pose_file);
  reader.RejectUnknown();
  if (reader.IsScalar()) {
    reader.Fail("expected `auto`, { window_s: … } or { window_samples: … }");
  }
}

void ReadMounting(YamlReader reader, Draft* draft) {
  if (!reader) return;
  for (const Triad triad : kTriads) {
    YamlReader sensor = reader.Child(TriadName(triad));
    std::string name;
    if (!sensor.Read(&name)) continue;
    StatedMounting stated{AxisMapFromName(name)};
    if (stated.map || name == "any") {
      draft->mounting[triad] = stated;
    } else {
      sensor.Fail("expected the body axes of sensing x, y, z, such as +y+x-z, or any, but `" +
                  name + "` is neither");
    }
  }
  reader.RejectUnknown();
}

std::string PlaceFor(const YamlReader& reader) {
  const std::string place = reader.Place();
  return place.substr(0, place.find_last_not_of(": ") + 1);
}

void ReadExclude(YamlReader reader, std::vector<ExcludedSeconds>* exclude) {
  if (!reader) return;
  exclude->clear();
  for (YamlReader& item : reader.Items()) {
    ExcludedSeconds& range = exclude->emplace_back();
    range.stated_in = PlaceFor(item);
    ReadNumber(item.RequireChild("from_s"), kNotNegative, &range.from_s);
    if (ReadNumber(item.RequireChild("to_s"), kNotNegative, &range.to_s) &&
        !(range.to_s > range.from_s)) {
      item.Fail("expected to_s after from_s");
    }
    item.RejectUnknown();
  }
}

void ReadExcludePoses(YamlReader reader, Experiment* experiment) {
  if (!reader) return;
  experiment->exclude_poses.clear();
  experiment->exclude_poses_stated = PlaceFor(reader);
  for (YamlReader& item : reader.Items()) {
    int number = 0;
    if (!item.Read(&number)) continue;
    if (number < 1) item.Fail("expected the number of a pose, from 1 on");
    experiment->exclude_poses.push_back(number);
  }
}

void ReadPoses(YamlReader reader, Draft* draft) {
  if (!reader) return;
  PosesConfig poses;
  poses.given = true;
  if (IsWord(reader, "every_row")) {
    poses.kind = PoseSelectionKind::kEveryRow;
  } else {
    int said = 0;
    if (YamlReader detect = reader.Child("detect")) {
      ++said;
      if (!IsWord(detect, "auto")) detect.Fail("expected `auto`");
    }
    if (YamlReader every = reader.Child("every")) {
      ++said;
      poses.kind = PoseSelectionKind::kEveryN;
      if (every.Read(&poses.every) && poses.every < 1) every.Fail("expected at least 1 row");
    }
    if (reader.Optional("column", &poses.column)) {
      ++said;
      poses.kind = PoseSelectionKind::kColumn;
    }
    if (reader.Optional("file", &draft->pose_file)) {
      ++said;
      poses.kind = PoseSelectionKind::kRanges;
    }
    if (YamlReader motion = reader.Child("motion")) {
      ++said;
      poses.kind = PoseSelectionKind::kMotion;
      ReadNumber(motion.Child("spacing_s"), kNotNegative, &poses.motion_spacing_s);
      motion.RejectUnknown();
    }
    if (YamlReader sweep = reader.Child("sweep")) {
      ++said;
      poses.kind = PoseSelectionKind::kSweep;
      ReadSweep(sweep, draft, &poses.sweep);
    }
    reader.RejectUnknown();
    if (reader.IsMap() && said != 1) {
      reader.Fail("expected one of detect, every, column, file, motion, sweep, or every_row");
    }
  }
  draft->experiment.poses = poses;
}

void ReadAttitudes(YamlReader reader, Draft* draft) {
  if (!reader) return;
  AttitudeOptions& attitudes = draft->experiment.options.attitudes;
  if (IsWord(reader, "none")) {
    attitudes.kind = AttitudeKind::kNone;
    return;
  }
  YamlReader six_face = reader.Child("six_face");
  YamlReader file = reader.Child("file");
  if (six_face) {
    attitudes.kind = AttitudeKind::kSixFace;
    ReadNumber(six_face.Child("tilt_sigma_deg"), kPositive, &attitudes.tilt_sigma_deg);
    ReadNumber(six_face.Child("seat_sigma_deg"), kNotNegative, &attitudes.seat_sigma_deg);
    six_face.RejectUnknown();
  }
  if (file.Read(&draft->attitudes_file)) attitudes.kind = AttitudeKind::kGiven;
  if (attitudes.kind == AttitudeKind::kGiven) {
    ReadNumber(reader.Child("sigma_deg"), kPositive, &draft->experiment.attitudes_sigma_deg);
    ReadChoice(
        reader.Child("fixture_rotation"), kFixtureRotations, &attitudes.unknown_fixture_rotation);
  }
  reader.RejectUnknown();
  if (reader.IsMap() && attitudes.kind == AttitudeKind::kNone) {
    reader.Fail("expected one of six_face, file, or none");
  }
  if (six_face && file) reader.Fail("six_face and file exclude each other; keep one");
}

void ReadTurns(YamlReader reader, Draft* draft) {
  if (!reader) return;
  if (IsWord(reader, "none")) {
    draft->turns_file.clear();
    return;
  }
  KnownMotionsConfig& config = draft->known_motions;
  reader.Optional("file", &draft->turns_file);
  ReadNumber(reader.Child("sigma_deg"), kPositive, &config.turn_sigma_deg);
  ReadNumber(reader.Child("axis_sigma_deg"), kPositive, &config.turn_axis_sigma_deg);
  if (YamlReader held_out = reader.Child("held_out"); IsWord(held_out, "all")) {
    config.held_out_turns = {"all"};
  } else if (held_out) {
    config.held_out_turns.clear();
    for (YamlReader& item : held_out.Items()) item.Read(&config.held_out_turns.emplace_back());
  }
  reader.RejectUnknown();
  if (draft->turns_file.empty()) reader.Fail("expected `file:` with the turns, or none");
}

void ReadRates(YamlReader reader, Draft* draft) {
  if (!reader) return;
  if (IsWord(reader, "none")) {
    draft->rates_file.clear();
    return;
  }
  KnownMotionsConfig& config = draft->known_motions;
  reader.Optional("file", &draft->rates_file);
  ReadNumber(reader.Child("sigma_degps"), kNotNegative, &config.rate_sigma_degps);
  ReadNumber(reader.Child("axis_sigma_deg"), kNotNegative, &config.rate_axis_sigma_deg);
  ReadChoice(reader.Child("axes"), kRateAxes, &config.rate_axes_known);
  reader.RejectUnknown();
  if (draft->rates_file.empty()) reader.Fail("expected `file:` with the rates, or none");
}

// A recording, or a list of them: sessions.
void ReadInputs(YamlReader reader, std::vector<std::string>* inputs) {
  if (!reader) return;
  inputs->clear();
  if (!reader.IsSequence()) {
    reader.Read(&inputs->emplace_back());
    return;
  }
  for (YamlReader& item : reader.Items()) item.Read(&inputs->emplace_back());
  if (inputs->empty()) reader.Fail("expected a recording, or a list of recordings of one unit");
}

void ReadRobust(YamlReader reader, RobustOptions* robust) {
  if (!reader) return;
  if (reader.IsScalar()) {
    ReadChoice(reader, kLosses, &robust->enabled);
    return;
  }
  ReadChoice(reader.Child("loss"), kLosses, &robust->enabled);
  ReadNumber(reader.Child("scale"), kPositive, &robust->scale);
  reader.RejectUnknown();
}

void ReadInitialise(YamlReader reader, Draft* draft) {
  if (!reader) return;
  InitialiseOptions& initialise = draft->experiment.options.initialise;
  ReadChoice(reader.Child("method"), kMethods, &initialise.method);
  reader.Optional("only", &initialise.only);
  reader.Optional("forces", &draft->forces_file);
  reader.RejectUnknown();
}

bool IsLimit(YamlReader reader) {
  return reader.IsScalar() || reader.Child("lower") || reader.Child("upper") ||
         reader.Child("target");
}

// A number, which is ±, or { lower, target, upper }.
void ReadLimit(YamlReader reader, const std::string& name, LimitOptions* options) {
  const Result<LimitName> parsed = ParseLimitName(name);
  if (!parsed) return reader.Fail(parsed.error().message, ErrorCode::kUnknownKey);
  Limit limit;
  double number = 0.0;
  if (reader.IsScalar()) {
    if (!ReadNumber(reader, kNotNegative, &number)) return;
    limit = Limit::Within(number);
  } else {
    ReadNumber(reader.Child("lower"), kAnyNumber, &limit.lower);
    ReadNumber(reader.Child("upper"), kAnyNumber, &limit.upper);
    if (ReadNumber(reader.Child("target"), kAnyNumber, &number)) limit.target = number;
    reader.Optional("if_present", &limit.if_present);
    reader.RejectUnknown();
    if (std::isinf(limit.lower) && std::isinf(limit.upper)) {
      return reader.Fail("has no limit; expected lower, upper, or both");
    }
    const double target = limit.target.value_or(limit.lower);
    if (!(limit.lower <= target && target <= limit.upper)) {
      return reader.Fail("expected lower <= target <= upper");
    }
  }
  options->limits[name] = limit;
}

// `accelerometer.bias: 0.5` or, as overrides are spelled, `accelerometer: { bias: 0.5 }`.
void ReadLimitsBelow(YamlReader& reader, const std::string& path, LimitOptions* options) {
  for (const std::string& key : reader.Keys()) {
    if (path.empty() && (key == "decision" || key == "preset")) continue;
    const std::string name = path.empty() ? key : path + "." + key;
    YamlReader child = reader.Child(key);
    if (IsLimit(child)) {
      ReadLimit(child, name, options);
    } else if (child.IsMap() && !child.Keys().empty()) {
      ReadLimitsBelow(child, name, options);
    } else {
      child.Fail("expected a number or { lower, target, upper }");
    }
  }
}

void ReadLimits(YamlReader reader, LimitOptions* options) {
  if (!reader) return;
  reader.Child("preset");  // Has been read before all documents.
  ReadLimitsBelow(reader, "", options);
  if (YamlReader decision = reader.Child("decision"); IsWord(decision, "simple")) {
    options->guard_band_k = 0.0;
  } else if (decision) {
    ReadNumber(decision.RequireChild("guard_band_k"), kNotNegative, &options->guard_band_k);
    decision.RejectUnknown();
  }
  reader.RejectUnknown();
}

void ReadCrossValidation(YamlReader reader, int* folds) {
  if (!reader) return;
  if (YamlReader child = reader.Child("folds"); child.Read(folds) && (*folds < 0 || *folds == 1)) {
    child.Fail("expected 0 (none) or at least 2 folds");
  }
  reader.RejectUnknown();
}

}  // namespace

void ReadLimitsOfPreset(YamlReader reader, LimitOptions* options) {
  ReadLimitsBelow(reader, "", options);
  for (auto& [name, limit] : options->limits) limit.if_present = true;
}

void ReadDocument(YamlReader root, Draft* draft) {
  CalibrateOptions& options = draft->experiment.options;
  ReadVersion(root.Child("experiment"));
  ReadInputs(root.Child("input"), &draft->inputs);
  ReadDevice(root.Child("device"), &draft->experiment);
  ReadRunTags(root.Child("run"), &draft->experiment.tags);
  ReadReference(root.Child("reference"), draft);
  if (Gauge gauge; ReadChoice(root.Child("gauge"), Gauges(), &gauge)) draft->gauge = gauge;
  ReadChoice(root.Child("clocks"), kClocks, &options.corrects_clocks);
  ReadChoice(root.Child("units"), kUnitChecks, &options.check_units);
  if (YamlReader sensors = root.Child("sensors")) {
    for (const Triad triad : kTriads) {
      if (YamlReader sensor = sensors.Child(TriadName(triad))) {
        options.triads[triad].enabled = true;
        sensor.Child("preset");  // Has been read before all documents.
        ReadSensor(sensor, triad, draft);
      }
    }
    sensors.RejectUnknown();
  }
  ReadMounting(root.Child("mounting"), draft);
  ReadPoses(root.Child("poses"), draft);
  ReadChoice(root.Child("time"), kTimeStamps, &draft->time_stamps);
  ReadExclude(root.Child("exclude"), &draft->exclude);
  ReadExcludePoses(root.Child("exclude_poses"), &draft->experiment);
  ReadAttitudes(root.Child("attitudes"), draft);
  root.Optional("static", &draft->static_file);
  ReadTurns(root.Child("turns"), draft);
  ReadRates(root.Child("rates"), draft);
  ReadRobust(root.Child("robust"), &options.robust);
  ReadInitialise(root.Child("initialise"), draft);
  ReadLimits(root.Child("limits"), &options.limits);
  ReadCrossValidation(root.Child("cross_validation"), &options.cross_validation_folds);
  ReadStrict(root.Child("strict"), &options.strict_shift_sigmas);
  ReadNumber(root.Child("observable_sigma"),
             {std::numeric_limits<double>::denorm_min(),
              std::nextafter(1.0, 0.0),
              "a share between 0 and 1"},
             &options.observable_sigma);
  if (YamlReader plan = root.Child("plan")) {
    if (!draft->experiment.plan) draft->experiment.plan = PlanConfig();
    ReadPlan(plan, draft->experiment.path, &*draft->experiment.plan);
  }
  root.RejectUnknown();
}

}  // namespace truetriad
