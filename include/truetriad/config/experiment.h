// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/model/calibration.h"
#include "truetriad/planning/plan.h"
#include "truetriad/problem/options.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {

/// `plan: { nominal: { <sensor>: … } }`: the approximate properties of the unit.
struct NominalSensor {
  std::optional<Unit> unit;                        ///< Unit of future readings; default: true unit.
  std::optional<Eigen::Matrix3d> sensitivity;      ///< Raw per true unit; default: unit's scale.
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  ///< Raw.
};

/// `plan:` of an experiment: which poses to search for. A calibration ignores it.
struct PlanConfig {
  PlanConfig() { options.random_draws = 200; }

  PlanOptions options;          ///< Has the values that `plan:` states.
  std::string program;          ///< File to evaluate instead of searching; resolved, or empty.
  bool from_recording = false;  ///< `start: recording`: complete the experiment's own recording.
  PerTriad<NominalSensor> nominal;
};

/// `turns:` and `rates:` of an experiment.
struct KnownMotionsConfig {
  std::string turns_file;  ///< Resolved against the experiment file; empty when not given.
  double turn_sigma_deg = 0.5;
  double turn_axis_sigma_deg = 1.0;
  std::vector<std::string> held_out_turns;  ///< Ids of the turns; "all" means every turn.
  std::string rates_file;                   ///< Resolved as turns_file.
  double rate_sigma_degps = 0.0;
  double rate_axis_sigma_deg = 0.0;
  bool rate_axes_known = true;

  bool operator==(const KnownMotionsConfig&) const = default;
};

/// One item of `exclude:`.
struct ExcludedSeconds {
  double from_s = 0.0, to_s = 0.0;  ///< Counted from the recording's first sample.
  std::string stated_in;            ///< "experiment.yaml:12: exclude", for messages.

  bool operator==(const ExcludedSeconds&) const = default;
};

/// `poses:` of an experiment.
struct PosesConfig {
  /// How poses are found; by default rests are detected. With kRanges, the poses are those of
  /// `file`.
  PoseSelectionKind kind = PoseSelectionKind::kDetect;
  bool given = false;  ///< Whether the experiment has `poses:`; if not, a manifest's is used.
  std::int64_t every = 0;
  std::string column;
  std::string file;                ///< Resolved against the experiment file.
  double motion_spacing_s = 0.1;   ///< MotionOptions::spacing_s of kMotion.
  SweepWindows sweep;              ///< For kSweep; `file`, if set, then lists the attitudes.
  bool moves = false;              ///< Also keeps the gyroscope's readings between poses.
  bool ignores_gyroscope = false;  ///< Whether rests are found without the gyroscope.
  KnownMotionsConfig known_motions;
  TimeStamps time_stamps = TimeStamps::kAuto;
  std::vector<ExcludedSeconds> exclude;  ///< Readings that are left out.
  /// `sensors: { <sensor>: { time_offset_s: … } }`: subtracted from the times of that sensor's
  /// readings.
  PerTriad<double> time_offset_s{};

  bool operator==(const PosesConfig&) const = default;
};

/// `reference: {position: …}` of an experiment: the place of the measurement.
struct SitePosition {
  double latitude_deg = 0.0;
  std::optional<double> longitude_deg;
  double height_m = 0.0;  ///< Above the ellipsoid.
  std::string date;       ///< "2026-01-31"; empty when not given.
};

/// `reference: {field: {site: …}}`.
enum class FieldSite {
  kUnknown,  ///< Iron and currents may be near: the Earth's field is used only for comparison.
  kClean,    ///< Nothing disturbs the Earth's field: it is the reference.
};

struct ExperimentDraft;

/// An experiment file, with defaults, presets and paths filled in. docs/experiments.md.
struct Experiment {
  std::string path;
  /// Recordings, resolved against the experiment file; empty when not given. Several recordings are
  /// sessions of one unit, which was switched off between them.
  std::vector<std::string> inputs;
  std::string serial;
  std::string model;
  Tags tags;
  std::optional<SitePosition> position;  ///< Gravity is computed from it, unless gravity is stated.
  /// The undisturbed Earth's field at the position, if the position has a longitude and a date. It
  /// is the reference only if the site is stated as clean. If unset, `no_earth_field` says why.
  std::optional<EarthField> earth_field;
  std::string no_earth_field;
  CalibrateOptions options;
  PosesConfig poses;
  std::vector<int> exclude_poses;    ///< Numbers of poses that are left out.
  std::string exclude_poses_stated;  ///< Where they are stated, for messages.
  std::string static_file;           ///< `static:`, resolved; empty when not given.
  bool reference_given = false;      ///< `reference.temperature_degc` is stated.
  std::string attitudes_file;        ///< `attitudes: {file: …}`, resolved; empty when not given.
  double attitudes_sigma_deg = 0.01;
  /// `fixed: {matrix: identity}`: the sensitivity is fixed such that truth = raw, converted to true
  /// units by the recording's unit.
  PerTriad<bool> fixed_identity{};
  PerTriad<std::string> allan_files;  ///< `noise: {allan: …}`, resolved; empty when not given.
  std::optional<PlanConfig> plan;     ///< `plan:`, which a calibration ignores.
  std::string forces_file;  ///< `initialise: {forces: …}`, resolved; empty when not given.
  /// The experiment as YAML text, with every default written out and presets filled in; paths are
  /// as written. It reads back as an experiment with the same options.
  std::string resolved_yaml;
  std::shared_ptr<const ExperimentDraft> draft;  ///< The source of resolved_yaml.
};

/// The names of all files that the experiment may state, except recordings and the plan's program.
/// Names that are not stated are empty.
std::vector<std::string*> FilesOf(Experiment& experiment);

/// `resolved_yaml` with every `auto` replaced by what was chosen. The experiment read from it gives
/// the same result without a choice.
std::string ResolvedWithChoice(const Experiment& experiment, const CalibrateOptions& chosen);

/// The experiment with other `time_offset_s`, also in its `resolved_yaml`.
Experiment WithTimeOffsets(const Experiment& experiment, const PerTriad<double>& offset_s);

/// The experiment with its kind of poses changed to `kind`: kDetect, kEveryRow or kMotion.
Experiment WithPoses(const Experiment& experiment, PoseSelectionKind kind);

/// The experiment for a recording that has only the sensors `recorded`: keys of other sensors are
/// removed, also from `resolved_yaml`.
Experiment OfSensors(const Experiment& experiment, const PerTriad<bool>& recorded);

/// Parses the value of --poses: detect, every_row, every:N, column:NAME, file:PATH, sweep,
/// sweep:SECONDS; empty: not given. Error (usage): anything else.
Result<PosesConfig> ParsePoses(const std::string& text);

/// Sets the time offsets and the treatment of time stamps in `poses` to those of the experiment
/// inside a calibration, since clocks are a property of the unit.
void TakeClocks(const Calibration& calibration, PosesConfig* poses);

/// If `error` is a usage error, adds the file and line of the experiment's key that it concerns
/// (Error::key). Other errors are returned unchanged.
Error AtItsKey(const Experiment& experiment, const Error& error);

/// Reads an experiment, or the one inside a calibration.yaml.
///
/// `overrides` are `key.sub=value` pairs (the `--set` flag), the value in YAML flow style; they
/// replace the file's values before anything is checked. Paths are relative to the file, in
/// overrides too. A sensor's `preset:` names a file of defaults for that sensor (configs/sensors).
/// Errors (bad input), all at once: unknown and duplicate keys, wrong types and values out of
/// range, with file:line or the override; combinations that are not supported.
Result<Experiment> ReadExperiment(const std::string& path,
                                  const std::vector<std::string>& overrides = {});

/// Like ReadExperiment, but reads the text of an experiment that is to be written to `path`.
Result<Experiment> ReadExperimentText(const std::string& text,
                                      const std::string& path,
                                      const std::vector<std::string>& overrides = {});

/// Reads a scenario (`scenario: 1`), docs/simulation.md, and converts its quantities from the units
/// of data sheets to those of sim/scenario.h.
///
/// `base:` names a scenario from which all keys are taken that the scenario itself does not state.
/// Lists (motion, disturbances) replace those of the base as a whole. `overrides` are
/// `key.sub=value` pairs (the `--set` flag), the value in YAML flow style, read after both. Paths
/// are relative to the file that names them; paths in overrides, to `path`. Errors (bad input), all
/// at once: unknown and duplicate keys, wrong types and values out of range, with file:line or the
/// override; a quantity stated in two units; values that contradict each other.
Result<Scenario> ReadScenario(const std::string& path,
                              const std::vector<std::string>& overrides = {});

/// Like ReadScenario, but reads the text of a scenario. Relative paths are resolved as if the text
/// were the file `path`.
Result<Scenario> ReadScenarioText(const std::string& text,
                                  const std::string& path,
                                  const std::vector<std::string>& overrides = {});

}  // namespace truetriad
