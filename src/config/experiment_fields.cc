// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/documents.h"
#include "config/experiment_draft.h"
#include "config/fields.h"
#include "config/schemas.h"
#include "io/tags_yaml.h"
#include "io/yaml_text.h"
#include "model/limit_names.h"
#include "truetriad/model/calibration.h"

// Every key of an experiment: its name, its value, its permitted range.

namespace truetriad {
namespace {

const auto kGauges =
    Named(GaugeName, Gauge::kAccelX, Gauge::kAccelZ, Gauge::kSymmetric, Gauge::kFixture);
constexpr NamedValues<bool, 2> kFixtureRotations = {{{false, "identity"}, {true, "unknown"}}};
constexpr NamedValues<bool, 2> kHemispheres = {{{true, "north"}, {false, "south"}}};
constexpr NamedValues<FieldSite, 2> kFieldSites = {{
    {FieldSite::kUnknown, "unknown"},
    {FieldSite::kClean, "clean"},
}};
constexpr NamedValues<bool, 2> kRateAxes = {{{true, "known"}, {false, "unknown"}}};
constexpr NamedValues<bool, 2> kClocks = {{{true, "correct"}, {false, "as_stated"}}};
constexpr NamedValues<bool, 2> kUnitChecks = {{{true, "checked"}, {false, "trust"}}};
constexpr NamedValues<TimeStamps, 3> kTimeStamps = {{
    {TimeStamps::kAuto, "auto"},
    {TimeStamps::kAsStamped, "as_stamped"},
    {TimeStamps::kRegular, "regular"},
}};
constexpr NamedValues<bool, 2> kLosses = {{{true, "huber"}, {false, "none"}}};
constexpr NamedValues<InitialiseMethod, 5> kMethods = {{
    {InitialiseMethod::kAuto, "auto"},
    {InitialiseMethod::kSixFaceExtremes, "six-face-extremes"},
    {InitialiseMethod::kSixPosition, "six-position"},
    {InitialiseMethod::kEllipsoidAxisAligned, "ellipsoid-axis-aligned"},
    {InitialiseMethod::kEllipsoid, "ellipsoid"},
}};

/// A kind of value: one recording, or a list of recordings, each of which is a session.
struct Recordings {};
bool ReadAs(Recordings, YamlReader reader, std::vector<std::string>* inputs) {
  if (!reader) return false;
  if (reader.IsSequence()) {
    ReadAs(ListOf{kAnyText}, reader, inputs);
  } else {
    inputs->clear();
    reader.Read(&inputs->emplace_back());
  }
  if (inputs->empty()) reader.Fail("expected a recording, or a list of recordings of one unit");
  return true;
}
Json SchemaOf(Recordings, const std::vector<std::string>* inputs) {
  return AnyOf(SchemaOf(kAnyText, static_cast<const std::string*>(nullptr)),
               SchemaOf(ListOf{kAnyText}, inputs));
}
std::string TextOf(Recordings, const std::vector<std::string>& inputs) {
  if (inputs.empty()) return "";
  return inputs.size() == 1 ? TextOf(kAnyText, inputs.front()) : TextOf(ListOf{kAnyText}, inputs);
}

/// A kind of value: a date such as "2026-01-31".
struct Date {};
bool ReadAs(Date, YamlReader reader, std::string* date) {
  if (!reader.Read(date)) return false;
  if (const Result<double> year = DecimalYear(*date); !year) reader.Fail(year.error().message);
  return true;
}
Json SchemaOf(Date, const std::string*) {
  return {{"type", "string"}, {"pattern", "^[0-9]{4}-[0-9]{2}-[0-9]{2}$"}};
}
std::string TextOf(Date, const std::string& date) { return TextOf(kFile, date); }

/// A kind of value: a mounting, written as `+y+x-z`, as `ROTATION_YAW_90` or as `any`.
struct Axes {};
bool ReadAs(Axes, YamlReader reader, StatedMounting* stated) {
  std::string name;
  if (!reader.Read(&name)) return false;
  stated->map = AxisMapFromName(name);
  if (stated->map || name == "any") return true;
  reader.Fail(
      "expected the body axes of the sensing axes x, y, z, such as +y+x-z, a rotation by multiples "
      "of 90 "
      "degrees, such as ROTATION_YAW_90, or any, but `" +
      name + "` is none of them");
  return false;
}
Json SchemaOf(Axes, const StatedMounting*) {
  return {{"type", "string"}, {"pattern", "^(any|([+-][xyz]){3}|(MAV_SENSOR_)?ROTATION_.+)$"}};
}
std::string TextOf(Axes, const StatedMounting& stated) {
  return stated.map ? AxisMapName(*stated.map) : "any";
}

/// A kind of value: the shift in σ that a strict run tolerates. `true`: 1 σ, `false`: any shift.
struct Strict {};
bool ReadAs(Strict, YamlReader reader, std::optional<double>* shift_sigmas) {
  if (IsWord(reader, "false")) {
    shift_sigmas->reset();
  } else if (IsWord(reader, "true")) {
    *shift_sigmas = 1.0;
  } else if (double most = 0.0; ReadAs(kNotNegative, reader, &most)) {
    *shift_sigmas = most;
  }
  return bool(reader);
}

Json SchemaOf(Strict, const std::optional<double>*) {
  return AnyOf(WordSchema({"true", "false"}), RangeSchema(kNotNegative, "number"));
}

// A limit: a number x, which means from -x to x, or { lower, target, upper }.
template <typename Visit>
void LimitFields(Visit& visit, Limit& limit) {
  if (visit.Shows(std::isfinite(limit.lower))) visit("lower", limit.lower, kAnyNumber);
  visit("target", limit.target, kAnyNumber);
  if (visit.Shows(std::isfinite(limit.upper))) visit("upper", limit.upper, kAnyNumber);
  if (visit.Shows(limit.if_present)) visit("if_present", limit.if_present, Flag());
  visit.Expect(std::isfinite(limit.lower) || std::isfinite(limit.upper),
               "has neither lower nor upper; give one or both");
  const double target = limit.target.value_or(limit.lower);
  visit.Expect(limit.lower <= target && target <= limit.upper, "expected lower <= target <= upper");
}

void ReadLimit(YamlReader reader, const std::string& name, LimitOptions* options) {
  const Result<LimitName> parsed = ParseLimitName(name);
  if (!parsed) return reader.Fail(parsed.error().message, ErrorCode::kUnknownKey);
  Limit limit;
  if (!reader.IsScalar()) {
    FieldReader::ReadMap(reader, [&](FieldReader& visit) { LimitFields(visit, limit); });
  } else if (double number = 0.0; ReadAs(kNotNegative, reader, &number)) {
    limit = Limit::Within(number);
  } else {
    return;
  }
  options->limits[name] = limit;
}

// Limits may be nested: `accelerometer.bias: 0.5` equals `accelerometer: { bias: 0.5 }`.
void ReadLimitsBelow(YamlReader& reader, const std::string& path, LimitOptions* options) {
  for (const std::string& key : reader.Keys()) {
    if (path.empty() && (key == "decision" || key == "preset")) continue;
    const std::string name = path.empty() ? key : path + "." + key;
    YamlReader child = reader.Child(key);
    if (child.IsScalar() || child.Child("lower") || child.Child("upper") || child.Child("target")) {
      ReadLimit(child, name, options);
    } else if (child.IsMap() && !child.Keys().empty()) {
      ReadLimitsBelow(child, name, options);
    } else {
      child.Fail("expected a number or { lower, target, upper }");
    }
  }
}

/// The schema of a value below `limits`: a limit, or a map from further parts of its name.
Json LimitSchema() {
  Limit limit;
  const Json map = FieldSchema::OfMap([&](FieldSchema& visit) { LimitFields(visit, limit); });
  const Json names = {{"type", "object"},
                      {"minProperties", 1},
                      {"propertyNames", {{"pattern", "^(?!(lower|upper|target)$)"}}},
                      {"additionalProperties", {{"$ref", "#/$defs/limit"}}}};
  return AnyOf(AnyOf(RangeSchema(kNotNegative, "number"), map), names);
}

template <typename Visit>
void LimitsFields(Visit& visit, LimitOptions& options) {
  visit.Has("preset");  // Accepts the key; ReadPresets has read the preset already.
  if constexpr (Visit::kReads) {
    ReadLimitsBelow(visit.map(), "", &options);
  } else if constexpr (!Visit::kWrites) {
    for (const std::string& name : LimitNames()) visit.Add(name, {{"$ref", "#/$defs/limit"}});
  } else {
    for (auto& [name, limit] : options.limits) {
      if (limit.IsAboutZero()) {
        visit(name, limit.upper, kAnyNumber);
      } else {
        visit.Line(name,
                   visit.Flow([&, &of = limit](auto& inside) { LimitFields(inside, of); },
                              std::numeric_limits<double>::max_digits10));
      }
    }
  }
  double& guard_band_k = options.guard_band_k;
  const auto decision = [&](auto& in) {
    in.Require("guard_band_k");
    in("guard_band_k", guard_band_k, kNotNegative);
  };
  visit.Map(
      "decision",
      decision,
      {.is_flow = true, .words = {{"simple", !(guard_band_k > 0.0), [&] { guard_band_k = 0.0; }}}});
}

/// Latitude and height may be in different documents: each is required only if `given`, the keys of
/// all documents, lacks it.
template <typename Visit>
void PositionFields(Visit& visit, SitePosition& site, const Places& given) {
  for (const char* key : {"latitude_deg", "height_m"}) {
    if (!given.contains(std::string("reference.position.") + key)) visit.Require(key);
  }
  visit("latitude_deg", site.latitude_deg, kLatitudeDeg);
  visit("longitude_deg",
        site.longitude_deg,
        Range{-180.0, 360.0, "a longitude of -180 to 360 degrees"});
  visit("height_m", site.height_m, Range{-1000.0, 20000.0, "a height in metres"});
  visit("date", site.date, Date());
}

/// Whether an override states `key`, a key below `reference`. Overrides take precedence over files.
bool IsOverridden(const std::string& key, const ExperimentDraft& draft) {
  return IsOverride(PlaceOf("reference." + key, draft.given));
}

template <typename Visit>
void FieldFields(Visit& visit, ExperimentDraft& draft) {
  ReferenceOptions& reference = draft.experiment.options.reference;
  // There is no upper bound: fields may be normalised to 1 or generated by coils.
  visit("strength_ut", draft.strength_ut, StatedNumber{kPositive, true});
  visit("dip_deg", draft.dip_deg, StatedNumber{kDipDeg, true});
  if (visit.Shows(reference.is_hemisphere_stated)) {
    visit("hemisphere", reference.northern_hemisphere, kHemispheres);
    reference.is_hemisphere_stated |= visit.Has("hemisphere");
  }
  visit("site", draft.field_site, kFieldSites);
  if (!Visit::kReads || !visit.Has("site")) return;
  // If a document states `site`, an `unknown` strength or dip of an earlier document is forgotten,
  // unless an override states it.
  const auto forget = [&](const std::string& key, const Stated& stated) {
    if (visit.Has(key) || stated.value || IsOverridden("field." + key, draft)) return;
    draft.given.erase("reference.field." + key);
  };
  forget("strength_ut", draft.strength_ut);
  forget("dip_deg", draft.dip_deg);
}

template <typename Visit>
void ReferenceFields(Visit& visit, ExperimentDraft& draft) {
  Experiment& experiment = draft.experiment;
  visit("gravity_mps2",
        draft.gravity_mps2,
        StatedNumber{{9.7, 9.9, "gravity at the Earth's surface in m/s^2, 9.7 to 9.9"}});
  const auto position = [&](auto& in) {
    SitePosition site = experiment.position.value_or(SitePosition());
    PositionFields(in, site, draft.given);
    experiment.position = site;
    // If a document states a position but no gravity, the gravity of earlier documents is dropped,
    // as it belongs to no or another position. A gravity that an override states is kept.
    if (Visit::kReads && !visit.Has("gravity_mps2") && !IsOverridden("gravity_mps2", draft)) {
      draft.gravity_mps2 = {};
    }
  };
  visit.Map("position", position, {.is_there = experiment.position.has_value()});
  visit.Map("field", [&](auto& field) { FieldFields(field, draft); });
  // A static calibration has its own reference temperature; a default here would contradict it.
  if (visit.Shows(experiment.static_file.empty() || experiment.reference_given)) {
    visit("temperature_degc", experiment.options.reference.temperature_degc, kTemperatureDegc);
  }
  const auto earth_rate = [&](auto& in) {
    StatedEarthRate rate = draft.earth_rate.value_or(StatedEarthRate());
    in("latitude_deg", rate.latitude, kLatitudeDeg);
    in("declination_deg", rate.declination, kDeclinationDeg);
    draft.earth_rate = rate;
  };
  visit.Map("earth_rate",
            earth_rate,
            {.is_there = draft.earth_rate.has_value(),
             .words = {{"none", false, [&] { draft.earth_rate.reset(); }},
                       {"position", false, [&] { draft.earth_rate.emplace(); }}}});
}

/// Fields of a sweep: the length of a window in seconds or samples, and the file of attitudes.
template <typename Visit>
void SweepFields(Visit& visit, PosesConfig& poses) {
  SweepWindows& windows = poses.sweep;
  if (visit.Shows(windows.window_s > 0.0)) visit("window_s", windows.window_s, kPositive);
  if (visit.Shows(windows.window_samples > 0)) {
    visit("window_samples",
          windows.window_samples,
          Range{.lowest = 1.0, .expected = "at least 1 sample"});
  }
  visit("attitudes", poses.file, kFile);
  visit.Expect(!(windows.window_s > 0.0 && windows.window_samples > 0),
               "window_s and window_samples exclude each other; keep one");
}

/// Resets the choice of poses: a document that states `poses` replaces this choice as a whole.
void Renew(PosesConfig* poses) {
  const PosesConfig fresh;
  poses->given = true;
  poses->kind = fresh.kind;
  poses->every = fresh.every;
  poses->column = fresh.column;
  poses->motion_spacing_s = fresh.motion_spacing_s;
  poses->sweep = fresh.sweep;
}

template <typename Visit>
void PoseFields(Visit& visit, PosesConfig& poses) {
  using Kind = PoseSelectionKind;
  if constexpr (Visit::kReads) Renew(&poses);
  int said = 0;
  const auto is = [&](std::string_view key, Kind kind) {
    const bool is_said = visit.Is(key, poses.kind, kind);
    said += is_said ? 1 : 0;
    return is_said;
  };
  if (is("detect", Kind::kDetect)) visit("detect", OnlyWord{"auto"}, OnlyWord{"auto"});
  if (is("every", Kind::kEveryN)) {
    visit("every", poses.every, Range{.lowest = 1.0, .expected = "at least 1 row"});
  }
  if (is("column", Kind::kColumn)) visit("column", poses.column, kAnyText);
  if (is("file", Kind::kRanges)) visit("file", poses.file, kAnyText);
  if (is("motion", Kind::kMotion)) {
    visit.Map("motion",
              [&](auto& motion) { motion("spacing_s", poses.motion_spacing_s, kNotNegative); });
  }
  if (is("sweep", Kind::kSweep)) {
    const bool is_stated =
        poses.sweep.window_s > 0.0 || poses.sweep.window_samples > 0 || !poses.file.empty();
    visit.Map("sweep",
              [&](auto& sweep) { SweepFields(sweep, poses); },
              {.words = {{"auto", !is_stated}}});
  }
  visit.Expect(said == 1,
               "expected one of detect, every, column, file, motion, sweep, or every_row");
}

template <typename Visit>
void PosesField(Visit& visit, PosesConfig& poses) {
  const auto every_row = [&] {
    Renew(&poses);
    poses.kind = PoseSelectionKind::kEveryRow;
  };
  visit.Map("poses",
            [&](auto& of) { PoseFields(of, poses); },
            {.is_there = poses.given,  // A default would overrule the recording's own statement.
             .is_flow = poses.kind != PoseSelectionKind::kSweep,
             .words = {{"every_row", poses.kind == PoseSelectionKind::kEveryRow, every_row}}});
}

template <typename Visit>
void AttitudeFields(Visit& visit, Experiment& experiment) {
  AttitudeOptions& attitudes = experiment.options.attitudes;
  const bool is_six_face = visit.Is("six_face", attitudes.kind, AttitudeKind::kSixFace);
  if (is_six_face) {
    visit.Map("six_face", [&](auto& six_face) {
      six_face("tilt_sigma_deg", attitudes.tilt_sigma_deg, kPositive);
      six_face("seat_sigma_deg", attitudes.seat_sigma_deg, kNotNegative);
    });
  }
  const bool is_given = visit.Is("file", attitudes.kind, AttitudeKind::kGiven);
  if (is_given) visit("file", experiment.attitudes_file, kAnyText);
  if (attitudes.kind == AttitudeKind::kGiven) {
    visit("sigma_deg", experiment.attitudes_sigma_deg, kPositive);
    visit("fixture_rotation", attitudes.unknown_fixture_rotation, kFixtureRotations);
  }
  visit.Expect(attitudes.kind != AttitudeKind::kNone, "expected one of six_face, file, or none");
  visit.Expect(!(is_six_face && is_given), "six_face and file exclude each other; keep one");
}

template <typename Visit>
void KnownMotionFields(Visit& visit, KnownMotionsConfig& motions) {
  const auto turns = [&](auto& in) {
    in("file", motions.turns_file, kAnyText);
    in("sigma_deg", motions.turn_sigma_deg, kPositive);
    in("axis_sigma_deg", motions.turn_axis_sigma_deg, kPositive);
    if (in.Says("held_out", "all")) {
      motions.held_out_turns = {"all"};
    } else {
      in("held_out", motions.held_out_turns, ListOf{kAnyText});
    }
    in.Expect(!motions.turns_file.empty(), "expected `file:` with the turns, or none");
  };
  const auto rates = [&](auto& in) {
    in("file", motions.rates_file, kAnyText);
    in("sigma_degps", motions.rate_sigma_degps, kNotNegative);
    in("axis_sigma_deg", motions.rate_axis_sigma_deg, kNotNegative);
    in("axes", motions.rate_axes_known, kRateAxes);
    in.Expect(!motions.rates_file.empty(), "expected `file:` with the rates, or none");
  };
  const auto none = [](std::string& file) {
    return MapForm{.words = {{"none", file.empty(), [&file] { file.clear(); }}}};
  };
  visit.Map("turns", turns, none(motions.turns_file));
  visit.Map("rates", rates, none(motions.rates_file));
}

/// The recording, and how its poses are found.
template <typename Visit>
void RecordingFields(Visit& visit, ExperimentDraft& draft) {
  Experiment& experiment = draft.experiment;
  PosesConfig& poses = experiment.poses;
  visit.Map("mounting", [&](auto& mounting) {
    for (const Triad triad : kTriads) {
      if (!mounting.Shows(experiment.options.triads[triad].enabled)) continue;
      mounting(TriadName(triad), draft.mounting[triad], Axes());
    }
  });
  PosesField(visit, poses);
  visit("time", poses.time_stamps, kTimeStamps);
  visit.List("exclude", poses.exclude, [](auto& in, ExcludedSeconds& range) {
    range.stated_in = in.PlaceOf();
    for (const char* key : {"from_s", "to_s"}) in.Require(key);
    in("from_s", range.from_s, kNotNegative);
    if (in("to_s", range.to_s, kNotNegative)) {
      in.Expect(range.to_s > range.from_s, "expected to_s after from_s");
    }
  });
  visit("exclude_poses",
        experiment.exclude_poses,
        ListOf{Range{.lowest = 1.0, .expected = "the number of a pose, from 1 on"}});
  if (visit.Has("exclude_poses")) experiment.exclude_poses_stated = visit.PlaceOf("exclude_poses");
  AttitudeOptions& attitudes = experiment.options.attitudes;
  const bool has_attitudes = attitudes.kind != AttitudeKind::kNone;
  visit.Map("attitudes",
            [&](auto& of) { AttitudeFields(of, experiment); },
            {.words = {{"none", !has_attitudes, [&] { attitudes.kind = AttitudeKind::kNone; }}}});
  visit("static", experiment.static_file, kFile);
  if (visit.Shows(experiment.options.triads[Triad::kGyroscope].enabled)) {
    KnownMotionFields(visit, poses.known_motions);
  }
}

/// How the parameters are estimated and judged.
template <typename Visit>
void FitFields(Visit& visit, Experiment& experiment) {
  CalibrateOptions& options = experiment.options;
  bool& is_robust = options.robust.enabled;
  const auto robust = [&](auto& in) {
    in("loss", is_robust, kLosses);
    in("scale", options.robust.scale, kPositive);
  };
  visit.Map("robust",
            robust,
            {.words = {{"huber", false, [&] { is_robust = true; }},
                       {"none", false, [&] { is_robust = false; }}}});
  visit.Map("initialise", [&](auto& initialise) {
    initialise("method", options.initialise.method, kMethods);
    initialise("only", options.initialise.only, Flag());
    initialise("forces", experiment.forces_file, kFile);
  });
  visit.Map("limits", [&](auto& limits) { LimitsFields(limits, options.limits); });
  visit.Map("cross_validation", [&](auto& of) {
    constexpr std::string_view kFolds = "0 (none) or at least 2 folds";
    int& folds = options.cross_validation_folds;
    of("folds", folds, Range{.lowest = 0.0, .expected = kFolds});
    of.Expect(folds != 1, "expected " + std::string(kFolds), "folds");
  });
  visit("strict", options.strict_shift_sigmas, Strict());
  visit("observable_sigma",
        options.observable_sigma,
        Range{std::numeric_limits<double>::denorm_min(),
              std::nextafter(1.0, 0.0),
              "a share between 0 and 1"});
}

template <typename Visit>
void ExperimentFields(Visit& visit, ExperimentDraft& draft, CalibrateOptions& chosen) {
  Experiment& experiment = draft.experiment;
  CalibrateOptions& options = experiment.options;
  int version = kVersion;
  visit("experiment", version, FormatVersion());
  visit("input", experiment.inputs, Recordings());
  const auto device = [&](auto& in) {
    in("serial", experiment.serial, kName);
    in("model", experiment.model, kName);
    if constexpr (!Visit::kWrites) {
      DeviceTagFields(in, experiment.tags);
    } else {
      const std::string tags = DeviceTagsText(experiment.tags);
      in.Append(tags.empty() ? "" : "," + tags);
    }
  };
  visit.Map("device", device, {.is_flow = true});
  visit.Map("run", [&](auto& run) { RunFields(run, experiment.tags); }, {.is_flow = true});
  visit.Map("reference", [&](auto& reference) { ReferenceFields(reference, draft); });
  visit("gauge", draft.gauge, kGauges);
  visit("clocks", options.corrects_clocks, kClocks);
  visit("units", options.check_units, kUnitChecks);
  visit.Map("sensors", [&](auto& sensors) {
    for (const Triad triad : kTriads) {
      bool& is_enabled = options.triads[triad].enabled;
      is_enabled |= sensors.Has(TriadName(triad));
      sensors.Map(TriadName(triad),
                  [&](auto& sensor) {
                    sensor.Has("preset");  // Accepts the key; ReadPresets has read it.
                    SensorFields(sensor, triad, draft, chosen);
                  },
                  {.is_there = is_enabled});
    }
  });
  RecordingFields(visit, draft);
  FitFields(visit, experiment);
  if constexpr (!Visit::kWrites) {
    if (visit.Has("plan") && !experiment.plan) experiment.plan = PlanConfig();
    visit.Map("plan", [&](auto& plan) { PlanFields(plan, &*experiment.plan); });
  }
}

/// If an override states `sensors` as a whole, `--set=sensors={magnetometer: {}}`, all sensors that
/// it does not name are reset and disabled.
void KeepSensors(YamlReader sensors, Experiment* experiment) {
  for (const Triad triad : kTriads) {
    if (sensors.Child(TriadName(triad))) continue;
    experiment->options.triads[triad] = TriadOptions();
    LeaveOut(triad, &experiment->options);
  }
}

}  // namespace

void LeaveOut(Triad triad, CalibrateOptions* options) {
  options->triads[triad].enabled = false;
  std::erase_if(options->limits.limits,
                [&](const auto& limit) { return limit.first.starts_with(TriadName(triad)); });
}

Json ExperimentSchema() {
  Json schema = FieldSchema::OfFile("An experiment of truetriad", [](FieldSchema& visit) {
    ExperimentDraft draft;
    visit.Require("experiment");
    ExperimentFields(visit, draft, draft.experiment.options);
  });
  schema["$defs"]["limit"] = LimitSchema();
  return schema;
}

Json SensorPresetSchema() {
  return FieldSchema::OfFile("A preset of sensors for experiments", [](FieldSchema& visit) {
    ExperimentDraft draft;
    visit.Require("sensor_preset");
    visit("sensor_preset", kVersion, FormatVersion());
    visit.Has("description");
    for (const Triad triad : kTriads) {
      visit.Map(TriadName(triad), [&](FieldSchema& sensor) {
        SensorFields(sensor, triad, draft, draft.experiment.options);
      });
    }
  });
}

Json LimitsPresetSchema() {
  Json schema = FieldSchema::OfFile("A preset of limits for experiments", [](FieldSchema& visit) {
    LimitOptions options;
    for (const char* key : {"limits_preset", "limits"}) visit.Require(key);
    visit("limits_preset", kVersion, FormatVersion());
    visit.Has("description");
    visit.Map("limits", [&](FieldSchema& limits) { LimitsFields(limits, options); });
  });
  schema["$defs"]["limit"] = LimitSchema();
  return schema;
}

void ReadSensor(YamlReader reader, Triad triad, ExperimentDraft* draft) {
  FieldReader::ReadMap(std::move(reader), [&](FieldReader& sensor) {
    SensorFields(sensor, triad, *draft, draft->experiment.options);
  });
}

void ReadLimitsOfPreset(YamlReader reader, LimitOptions* options) {
  ReadLimitsBelow(reader, "", options);
  for (auto& [name, limit] : options->limits) limit.if_present = true;
}

void ReadDocument(YamlReader root, ExperimentDraft* draft) {
  Experiment& experiment = draft->experiment;
  if (IsOverrideOf(root, "sensors") && root.Child("sensors").IsMap()) {
    KeepSensors(root.Child("sensors"), &experiment);
  }
  FieldReader::ReadMap(std::move(root), [&](FieldReader& visit) {
    ExperimentFields(visit, *draft, experiment.options);
  });
}

std::string ResolvedYaml(const ExperimentDraft& asked, const CalibrateOptions& chosen) {
  // Copies the values that Settle derived into the draft, so that they are written. FieldWriter
  // marks those that no document states as default.
  ExperimentDraft draft = asked;
  CalibrateOptions& options = draft.experiment.options;
  draft.gauge = options.gauge;
  for (const Triad triad : kTriads) {
    draft.mounting[triad] = StatedMounting{options.triads[triad].mounting};
  }
  AttitudeOptions& attitudes = options.attitudes;
  attitudes.tilt_sigma_deg = attitudes.stated_tilt_sigma_deg.value_or(attitudes.tilt_sigma_deg);
  if (draft.earth_rate) {
    draft.earth_rate = StatedEarthRate{draft.earth_rate->latitude.value_or(0.0),
                                       draft.earth_rate->declination.value_or(0.0)};
  }
  CalibrateOptions found = chosen;
  FieldWriter visit(draft.given);
  ExperimentFields(visit, draft, found);
  return visit.text();
}

void TakeClocks(const Calibration& calibration, PosesConfig* poses) {
  const Result<YamlReader> config = YamlReader::FromText(calibration.config_yaml, "config");
  if (!config) return;
  FieldReader root(*config);
  root("time", poses->time_stamps, kTimeStamps);
  root.Map("sensors", [poses](FieldReader& sensors) {
    for (const Triad triad : kTriads) {
      sensors.Map(TriadName(triad), [poses, triad](FieldReader& sensor) {
        sensor("time_offset_s", poses->time_offset_s[triad], kAnyNumber);
      });
    }
  });
}

Result<PosesConfig> ParsePoses(const std::string& text) {
  PosesConfig poses;
  if (text.empty()) return poses;
  const std::size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  const std::string value = colon == std::string::npos ? "auto" : text.substr(colon + 1);
  YamlText yaml;
  if (text == "every_row") {
    yaml << "poses: every_row";
  } else if (kind == "sweep" && colon != std::string::npos) {
    yaml << "poses: { sweep: { window_s: " << Quoted{value} << " } }";
  } else if (colon != std::string::npos || kind == "detect" || kind == "sweep") {
    yaml << "poses: { " << Quoted{kind} << ": " << Quoted{value} << " }";
  }
  const Result<YamlReader> document = YamlReader::FromText(yaml.str(), "--poses");
  if (document && !value.empty()) {
    FieldReader::ReadMap(*document, [&poses](FieldReader& visit) { PosesField(visit, poses); });
    if (document->errors().empty()) return poses;
  }
  return Error(ErrorCode::kInvalidArgument,
               "--poses=" + text +
                   " is unknown; expected detect, every_row, every:N (N >= 1), column:NAME, "
                   "file:PATH, sweep or sweep:SECONDS");
}

}  // namespace truetriad
