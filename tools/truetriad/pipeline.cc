// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/pipeline.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>

#include "truetriad/config/field_check.h"
#include "truetriad/estimation/calibrate.h"
#include "truetriad/io/allan_file.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/known_motion_file.h"
#include "truetriad/io/pose_program_file.h"
#include "truetriad/io/recording.h"
#include "truetriad/model/attitude_sets.h"

namespace truetriad {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

Result<PoseSelection> SelectionOf(const PosesConfig& config) {
  PoseSelection selection;
  selection.kind = config.kind;
  selection.every = config.every;
  selection.sweep = config.sweep;
  const bool has_attitudes = config.kind == PoseSelectionKind::kSweep && !config.file.empty();
  if (config.kind == PoseSelectionKind::kRanges || has_attitudes) {
    Result<std::vector<PoseRange>> ranges = ReadPoseRanges(config.file);
    TRUETRIAD_RETURN_IF_ERROR(ranges);
    selection.ranges = *std::move(ranges);
  }
  return selection;
}

/// The turns and rates that the experiment states.
Status SelectKnownMotions(const KnownMotionsConfig& config, PoseSelection* selection) {
  if (!config.turns_file.empty()) {
    Result<std::vector<StatedTurn>> turns = ReadStatedTurns(
        config.turns_file,
        {config.turn_sigma_deg * kRadPerDeg, config.turn_axis_sigma_deg * kRadPerDeg});
    TRUETRIAD_RETURN_IF_ERROR(turns);
    for (const std::string& id : config.held_out_turns) {
      bool found = false;
      for (StatedTurn& turn : *turns) {
        if (id != "all" && id != turn.id) continue;
        found = turn.held_out = true;
      }
      if (found) continue;
      return BadInputError("turns.held_out: `" + id + "` is the id of no turn in " +
                           config.turns_file);
    }
    selection->turns = *std::move(turns);
  }
  if (!config.rates_file.empty()) {
    Result<std::vector<StatedRate>> rates = ReadStatedRates(
        config.rates_file,
        {config.rate_sigma_degps * kRadPerDeg, config.rate_axis_sigma_deg * kRadPerDeg});
    TRUETRIAD_RETURN_IF_ERROR(rates);
    selection->rates = *std::move(rates);
  }
  return {};
}

/// Where a recording's poses are when nobody said: its manifest, its pose column, or detection.
Result<PoseSelection> StatedSelection(const std::string& input, const RecordingInfo& info) {
  Result<std::optional<PoseSelection>> stated = ManifestPoseSelection(input);
  TRUETRIAD_RETURN_IF_ERROR(stated);
  if (*stated) return **std::move(stated);
  PoseSelection selection;
  for (const StreamInfo& stream : info.streams) {
    if (stream.has_pose_column) selection.kind = PoseSelectionKind::kColumn;
  }
  return selection;
}

/// A table is already averaged: to find rests in it, or to take each row, is to read it as it is.
bool MayBeTable(const PosesConfig& config) {
  return config.kind == PoseSelectionKind::kDetect || config.kind == PoseSelectionKind::kEveryRow;
}

/// What can be said about the streams of a recording without any pose.
Result<PoseSet> DescribeStreams(const std::string& input, const OpenRecordingOptions& options) {
  const Result<std::unique_ptr<SampleSource>> source = OpenRecording(input, options);
  TRUETRIAD_RETURN_IF_ERROR(source);
  PoseSelection everything;
  everything.kind = PoseSelectionKind::kEveryN;
  everything.every = std::numeric_limits<std::int64_t>::max();
  Result<PoseSet> set = CollectPoses(**source, everything);
  TRUETRIAD_RETURN_IF_ERROR(set);
  set->poses.clear();
  set->how = "static detection";
  set->static_share = 0.0;
  for (StreamSummary& stream : set->streams) {
    // Spread over motion, which is not noise.
    stream.noise_sigma_raw.setZero();
    stream.correlation_inflation.setOnes();
  }
  return set;
}

Result<LoadedPoses> LoadRecording(const std::string& input,
                                  const PosesConfig& config,
                                  const ProgressCallback& progress) {
  const OpenRecordingOptions options{config.column, config.sweep.ambient};
  const Result<std::unique_ptr<SampleSource>> source = OpenRecording(input, options);
  TRUETRIAD_RETURN_IF_ERROR(source);
  Result<PoseSelection> selection =
      config.given ? SelectionOf(config) : StatedSelection(input, (*source)->info());
  TRUETRIAD_RETURN_IF_ERROR(selection);

  selection->moves = config.moves;
  selection->time_offset_s = config.time_offset_s;
  TRUETRIAD_RETURN_IF_ERROR(SelectKnownMotions(config.known_motions, &*selection));
  LoadedPoses loaded;
  Result<PoseSet> poses = CollectPoses(**source, *selection, {}, progress);
  if (!poses && poses.error().code == ErrorCode::kNotEnough) {
    loaded.not_enough = poses.error();
    poses = DescribeStreams(input, options);
  }
  TRUETRIAD_RETURN_IF_ERROR(poses);
  loaded.poses = *std::move(poses);
  loaded.inputs = (*source)->inputs();
  for (const StreamInfo& stream : (*source)->info().streams) {
    loaded.si_per_count[stream.triad] = stream.si_per_count;
  }
  return loaded;
}

/// Each row of the table `file` for the pose of the same number, to be read by `assign`.
template <typename Assign>
Status AssignRows(const std::string& file, std::vector<StaticPose>* poses, Assign assign) {
  const Result<PoseTable> table = ReadPoseTable(file);
  TRUETRIAD_RETURN_IF_ERROR(table);
  const std::vector<StaticPose>& rows = table->poses.poses;
  if (rows.size() != poses->size()) {
    return BadInputError(file + ": has " + std::to_string(rows.size()) +
                         " rows, but the recording has " + std::to_string(poses->size()) +
                         " poses; expected one row a pose, in the same order (`truetriad inspect` "
                         "lists the poses)");
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    TRUETRIAD_RETURN_IF_ERROR(assign(table->poses, rows[k], &(*poses)[k]));
  }
  return {};
}

Status AttachAttitudes(const Experiment& experiment, PoseSet* poses) {
  if (experiment.attitudes_file.empty()) return {};
  const double sigma_rad = experiment.attitudes_sigma_deg * kRadPerDeg;
  return AssignRows(experiment.attitudes_file,
                    &poses->poses,
                    [&](const PoseSet&, const StaticPose& row, StaticPose* pose) -> Status {
                      if (!row.attitude) {
                        return BadInputError(experiment.attitudes_file + ": row " +
                                             std::to_string(row.number) +
                                             " has no attitude; expected the columns qw,qx,qy,qz");
                      }
                      pose->attitude = row.attitude;
                      pose->attitude->sigma_rad.setConstant(sigma_rad);
                      return {};
                    });
}

Status ReadKnownForces(const std::string& file,
                       PoseSet* poses,
                       std::vector<Eigen::Vector3d>* forces) {
  if (file.empty()) return {};
  return AssignRows(
      file, &poses->poses, [&](const PoseSet& table, const StaticPose& row, StaticPose*) -> Status {
        const std::optional<TriadPose>& force = row.triads[Triad::kAccelerometer];
        const StreamSummary* stream = table.Find(Triad::kAccelerometer);
        if (!force || stream == nullptr || stream->unit.is_counts) {
          return BadInputError(file + ": row " + std::to_string(row.number) +
                               " has no known force; expected accel_x, accel_y, accel_z in m/s^2, "
                               "g or mg");
        }
        forces->push_back(force->mean_raw * stream->unit.truth_per_raw);
        return {};
      });
}

/// The sensitivity of a perfect chip: truth = raw, in true units.
Result<Eigen::Matrix3d> IdentitySensitivity(const LoadedPoses& loaded,
                                            Triad triad,
                                            const TriadOptions& options) {
  const Unit& unit = loaded.poses.Find(triad)->unit;
  const std::optional<double> truth_per_raw =
      unit.is_counts ? loaded.si_per_count[triad] : unit.truth_per_raw;
  if (!truth_per_raw) {
    return BadInputError(loaded.poses.source + ": the " + std::string(TriadName(triad)) +
                         " is in counts of unknown size, so its matrix cannot be held at identity; "
                         "state `si_per_count:` of the stream in a manifest, or give the matrix as "
                         "`fixed: { matrix: [[…],[…],[…]] }`");
  }
  const bool reports_gravity =
      triad == Triad::kAccelerometer && options.sign == AccelerometerSign::kGravity;
  return Eigen::Matrix3d(Eigen::Matrix3d::Identity() *
                         ((reports_gravity ? -1.0 : 1.0) / *truth_per_raw));
}

/// Fills in the matrices that are held at a value which only the recording can tell.
Status HoldMatrices(const LoadedPoses& loaded, Experiment* experiment) {
  for (const Triad triad : kTriads) {
    TriadOptions& options = experiment->options.triads[triad];
    const bool may_be_held =
        options.model == MatrixModel::kBias || options.model == MatrixModel::kAuto;
    const bool held =
        experiment->fixed_identity[triad] || (may_be_held && !options.fixed_sensitivity);
    if (!options.enabled || !held || loaded.poses.Find(triad) == nullptr) continue;
    const bool is_candidate =
        options.model == MatrixModel::kAuto && !experiment->fixed_identity[triad];
    std::optional<Eigen::Matrix3d>& matrix =
        is_candidate ? options.nominal_sensitivity : options.fixed_sensitivity;
    const bool has_prior = options.prior && options.prior->sensitivity_sigma.allFinite();
    if (has_prior && !experiment->fixed_identity[triad]) {
      matrix = options.prior->sensitivity;
      continue;
    }
    const Result<Eigen::Matrix3d> identity = IdentitySensitivity(loaded, triad, options);
    // Counts of unknown size have no nominal matrix to choose.
    if (!identity && is_candidate) continue;
    TRUETRIAD_RETURN_IF_ERROR(identity);
    matrix = *identity;
  }
  return {};
}

/// `axes` of a coefficient in the recording's unit.
template <typename Get>
Eigen::Vector3d PerAxis(const AllanTriad& triad, double scale, Get get) {
  return scale * Eigen::Vector3d(get(triad.axes[0]), get(triad.axes[1]), get(triad.axes[2]));
}

/// Noise of `triad` in the recording's unit from the Allan result in `file`.
Result<AllanNoise> ReadAllanNoise(const std::string& file, Triad triad, const PoseSet& poses) {
  const Result<AllanResult> allan = ReadAllanFile(file);
  TRUETRIAD_RETURN_IF_ERROR(allan);
  const std::string name(TriadName(triad));
  const AllanTriad* found = allan->Find(triad);
  if (found == nullptr) {
    return BadInputError(file + ": holds no " + name + ", whose noise is to come from here");
  }
  if (!found->at_rest()) {
    return BadInputError(file + ": the " + name + " was not at rest (" + found->disturbance +
                         "), so its noise is not known; analyse a log of the unit at rest, or "
                         "state `noise: { sigma: [x, y, z] }`");
  }
  const Unit& unit = poses.Find(triad)->unit;
  if (found->unit.is_counts != unit.is_counts) {
    return BadInputError(file + ": the " + name + " is in " + found->unit.name + ", but " +
                         poses.source + " is in " + unit.name +
                         "; counts convert to nothing: analyse a recording in the same unit");
  }
  for (const AllanAxis& axis : found->axes) {
    if (axis.white_density && axis.white_density->value > 0.0 && axis.instability) continue;
    return BadInputError(file + ": the " + name +
                         " has an axis without noise density or bias instability; analyse a longer "
                         "rest, or state `noise: { sigma: [x, y, z] }`");
  }
  // Both are 1 for counts.
  const double scale = found->unit.truth_per_raw / unit.truth_per_raw;
  return AllanNoise{
      PerAxis(*found, scale, [](const AllanAxis& axis) { return axis.white_density->value; }),
      PerAxis(*found, scale, [](const AllanAxis& axis) {
        return axis.instability->coefficient.value;
      })};
}

Status SettleAllanNoise(const PoseSet& poses, Experiment* experiment) {
  for (const Triad triad : kTriads) {
    TriadOptions& options = experiment->options.triads[triad];
    const std::string& file = experiment->allan_files[triad];
    if (file.empty() || !options.enabled || poses.Find(triad) == nullptr) continue;
    const Result<AllanNoise> noise = ReadAllanNoise(file, triad, poses);
    TRUETRIAD_RETURN_IF_ERROR(noise);
    options.allan = *noise;
  }
  return {};
}

/// What a sweep takes from a calibration at one temperature, or without one from the units.
Status SettleSweep(const LoadedPoses& loaded, Experiment* experiment) {
  CalibrateOptions& options = experiment->options;
  if (experiment->static_file.empty()) {
    for (const Triad triad : kTriads) {
      TriadOptions& sensor = options.triads[triad];
      if (!sensor.enabled || sensor.fixed_sensitivity || !loaded.poses.Find(triad)) continue;
      const Result<Eigen::Matrix3d> identity = IdentitySensitivity(loaded, triad, sensor);
      TRUETRIAD_RETURN_IF_ERROR(identity);
      sensor.fixed_sensitivity = *identity;
    }
    return {};
  }
  Result<Calibration> known = ReadCalibration(experiment->static_file);
  TRUETRIAD_RETURN_IF_ERROR(known);
  const std::string& serial = experiment->serial.empty() ? loaded.poses.serial : experiment->serial;
  if (!known->serial.empty() && !serial.empty() && known->serial != serial) {
    return BadInputError(experiment->static_file + ": is of device " + known->serial +
                         ", but this is a sweep of " + serial + "; give the calibration of " +
                         serial + " at one temperature");
  }
  const double wanted = options.reference.temperature_degc;
  const auto& recorded = known->reference.recorded_degc;
  const double stated = recorded ? (*recorded)[1] : known->reference.temperature_degc;
  if (experiment->reference_given && wanted != stated) {
    return BadInputError(
        experiment->static_file + ": was made at " + std::to_string(stated) +
        " degC, but reference.temperature_degc is " + std::to_string(wanted) +
        "; its bias holds at its own temperature: leave reference.temperature_degc "
        "out");
  }
  const Knowledge& gravity = options.reference.gravity_mps2;
  const double stated_mps2 = gravity.value.value_or(kStandardGravityMps2);
  const double off = stated_mps2 - known->reference.gravity_mps2;
  // Gravity that nobody stated is the standard one. Another place's is off by up to 0.05.
  constexpr double kNotable = 1e-3;
  if (stated_mps2 != kStandardGravityMps2 && std::abs(off) > kNotable) {
    return BadInputError(
        experiment->static_file + ": was made with gravity " +
        std::to_string(known->reference.gravity_mps2) + " m/s^2, but this experiment states " +
        std::to_string(stated_mps2) +
        "; its sensitivity holds with its own: leave reference.gravity out, or calibrate it again "
        "with the gravity of its place");
  }
  options.sweep->static_calibration = *std::move(known);
  options.sweep->static_file = experiment->static_file;
  return {};
}

/// Fills in what the experiment leaves to files and to the recording.
Status SettleWithRecording(LoadedPoses* loaded, Experiment* experiment) {
  if (experiment->options.sweep) return SettleSweep(*loaded, experiment);
  TRUETRIAD_RETURN_IF_ERROR(AttachAttitudes(*experiment, &loaded->poses));
  TRUETRIAD_RETURN_IF_ERROR(ReadKnownForces(
      experiment->forces_file, &loaded->poses, &experiment->options.initialise.known_forces));
  TRUETRIAD_RETURN_IF_ERROR(HoldMatrices(*loaded, experiment));
  return SettleAllanNoise(loaded->poses, experiment);
}

/// What a recording of the nominal unit would be, before any pose is taken.
LoadedPoses NothingMeasured(const Experiment& experiment) {
  LoadedPoses loaded;
  loaded.poses.source = experiment.path;
  for (const Triad triad : kTriads) {
    if (!experiment.options.triads[triad].enabled) continue;
    StreamSummary stream;
    stream.triad = triad;
    stream.unit = experiment.plan->nominal[triad].unit.value_or(
        Unit{std::string(TruthUnitName(triad)), 1.0, false});
    loaded.poses.streams.push_back(stream);
  }
  return loaded;
}

Calibration NotEnough(const Experiment& experiment, const Error& reason) {
  Calibration calibration;
  calibration.outcome = Outcome::kNotEnough;
  calibration.messages = {reason.message};
  calibration.gauge = experiment.options.gauge;
  if (!experiment.options.triads[Triad::kAccelerometer].enabled) {
    calibration.gauge_sensor =
        experiment.options.HasGyroscopeAlone() ? Triad::kGyroscope : Triad::kMagnetometer;
  }
  const ReferenceOptions& reference = experiment.options.reference;
  calibration.reference.gravity_mps2 = *reference.gravity_mps2.value;
  calibration.reference.temperature_degc = reference.temperature_degc;
  return calibration;
}

Result<Calibration> CalibratePoses(const LoadedPoses& loaded, const Experiment& experiment) {
  if (loaded.not_enough) {
    Calibration calibration = NotEnough(experiment, *loaded.not_enough);
    calibration.config_yaml = experiment.resolved_yaml;
    return calibration;
  }
  Result<CalibrationSummary> summary = Calibrate(loaded.poses, experiment.options);
  if (!summary) return AtItsKey(experiment, summary.error());
  // A choice that failed leaves it to the next run to choose.
  summary->calibration.config_yaml = summary->calibration.IsUsable()
                                         ? ResolvedWithChoice(experiment, summary->options)
                                         : experiment.resolved_yaml;
  return std::move(summary->calibration);
}

}  // namespace

Result<LoadedPoses> LoadPoses(const std::string& input,
                              const PosesConfig& config,
                              const ProgressCallback& progress) {
  if (!MayBeTable(config)) return LoadRecording(input, config, progress);
  const Result<bool> is_table = IsPoseTable(input);
  TRUETRIAD_RETURN_IF_ERROR(is_table);
  if (!*is_table) return LoadRecording(input, config, progress);
  Result<PoseTable> table = ReadPoseTable(input);
  TRUETRIAD_RETURN_IF_ERROR(table);
  LoadedPoses loaded;
  loaded.poses = std::move(table->poses);
  loaded.inputs = std::move(table->inputs);
  PoseSelection selection;
  TRUETRIAD_RETURN_IF_ERROR(SelectKnownMotions(config.known_motions, &selection));
  if (!selection.turns.empty()) {
    return BadInputError(input +
                         ": is a table of means, in which no turn can be followed; give the "
                         "recording, or remove `turns:`");
  }
  TRUETRIAD_RETURN_IF_ERROR(TakeRates(selection.rates, &loaded.poses));
  return loaded;
}

Result<PosesConfig> ParsePoses(const std::string& text) {
  PosesConfig config;
  if (text.empty()) return config;
  config.given = true;
  const std::size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  const std::string value = colon == std::string::npos ? "" : text.substr(colon + 1);
  if (text == "detect") return config;
  if (text == "every_row") {
    config.kind = PoseSelectionKind::kEveryRow;
    return config;
  }
  if (kind == "every") {
    config.kind = PoseSelectionKind::kEveryN;
    const char* end = value.data() + value.size();
    const auto [stop, failure] = std::from_chars(value.data(), end, config.every);
    if (failure == std::errc() && stop == end && config.every >= 1) return config;
  }
  if (kind == "column" && !value.empty()) {
    config.kind = PoseSelectionKind::kColumn;
    config.column = value;
    return config;
  }
  if (kind == "file" && !value.empty()) {
    config.kind = PoseSelectionKind::kRanges;
    config.file = value;
    return config;
  }
  if (kind == "sweep") {
    config.kind = PoseSelectionKind::kSweep;
    if (colon == std::string::npos) return config;
    const char* end = value.data() + value.size();
    const auto [stop, failure] = std::from_chars(value.data(), end, config.sweep.window_s);
    if (failure == std::errc() && stop == end && config.sweep.window_s > 0.0) return config;
  }
  return UsageError("--poses=" + text +
                    " is not known; expected detect, every_row, every:N (N >= 1), column:NAME, "
                    "file:PATH, sweep or sweep:SECONDS");
}

Result<Calibration> CalibrateExperiment(Experiment experiment, const ProgressCallback& progress) {
  Result<LoadedPoses> loaded = LoadPoses(experiment.input, experiment.poses, progress);
  TRUETRIAD_RETURN_IF_ERROR(loaded);
  if (!loaded->not_enough) {
    TRUETRIAD_RETURN_IF_ERROR(SettleWithRecording(&*loaded, &experiment));
  }
  Result<Calibration> calibration = CalibratePoses(*loaded, experiment);
  TRUETRIAD_RETURN_IF_ERROR(calibration);
  calibration->serial = experiment.serial.empty() ? loaded->poses.serial : experiment.serial;
  if (!loaded->poses.serial.empty() && calibration->serial != loaded->poses.serial) {
    calibration->messages.push_back("the recording is of `" + loaded->poses.serial +
                                    "`, the experiment says `" + experiment.serial +
                                    "`: check which unit this is");
  }
  calibration->model = experiment.model;
  calibration->software_version = Version();
  calibration->created = TimestampUtc();
  calibration->inputs = std::move(loaded->inputs);
  CheckField(experiment, &*calibration);
  calibration->messages.insert(
      calibration->messages.end(), loaded->poses.warnings.begin(), loaded->poses.warnings.end());
  for (const Triad triad : kTriads) {
    if (std::optional<TriadCalibration>& sensor = calibration->sensors[triad]) {
      sensor->si_per_count = loaded->si_per_count[triad];
    }
  }
  return calibration;
}

Result<Plan> PlanExperiment(Experiment experiment,
                            const std::string& measured,
                            const ProgressCallback& progress) {
  if (!experiment.plan) {
    return UsageError(experiment.path +
                      ": has no `plan:`; say what to plan for, as in `plan: { poses: 12 }`");
  }
  const PlanConfig& config = *experiment.plan;
  LoadedPoses loaded = NothingMeasured(experiment);
  if (measured.empty()) {
    // Attitudes and forces belong to poses that are not there yet.
    TRUETRIAD_RETURN_IF_ERROR(HoldMatrices(loaded, &experiment));
    TRUETRIAD_RETURN_IF_ERROR(SettleAllanNoise(loaded.poses, &experiment));
  } else {
    Result<LoadedPoses> recording = LoadPoses(measured, experiment.poses, progress);
    TRUETRIAD_RETURN_IF_ERROR(recording);
    if (recording->not_enough) return *recording->not_enough;
    loaded = *std::move(recording);
    TRUETRIAD_RETURN_IF_ERROR(SettleWithRecording(&loaded, &experiment));
  }

  PlanOptions options;
  options.calibrate = experiment.options;
  for (const Triad triad : kTriads) {
    const NominalSensor& nominal = config.nominal[triad];
    const StreamSummary* stream = loaded.poses.Find(triad);
    if (stream == nullptr || (!nominal.sensitivity && nominal.bias.isZero(0.0))) continue;
    const Eigen::Matrix3d own_scale = Eigen::Matrix3d::Identity() / stream->unit.truth_per_raw;
    options.nominal[triad] = {nominal.sensitivity.value_or(own_scale), nominal.bias};
  }
  options.nominal_field_ut = config.nominal_strength_ut;
  if (config.nominal_dip_deg) options.nominal_dip_rad = *config.nominal_dip_deg * kRadPerDeg;
  if (const std::optional<EarthField>& earth = experiment.earth_field) {
    if (!options.nominal_field_ut) options.nominal_field_ut = earth->strength_ut;
    if (!options.nominal_dip_rad) options.nominal_dip_rad = earth->dip_deg * kRadPerDeg;
  }
  options.rest_s = config.rest_s;
  options.turn_s = config.turn_s;
  options.turn_sigma_rad = config.turn_sigma_deg * kRadPerDeg;
  options.attitude_sigma_rad.setConstant(experiment.attitudes_sigma_deg * kRadPerDeg);
  options.grid = config.grid;
  if (options.grid.attitudes.empty()) {
    options.grid.attitudes = experiment.options.attitudes.kind == AttitudeKind::kSixFace
                                 ? SixFaceAttitudes()
                                 : HandAttitudes();
  }
  options.criterion = config.criterion;
  options.poses = config.poses;
  options.wanted = config.wanted;
  options.max_poses = std::max(config.max_poses, config.poses);
  options.random_draws = config.random_draws;
  options.seed = config.seed;
  if (!config.program.empty()) {
    Result<PoseProgram> program = ReadPoseProgram(config.program);
    TRUETRIAD_RETURN_IF_ERROR(program);
    options.program = *std::move(program);
  }
  Result<Plan> plan = MakePlan(loaded.poses, options);
  if (!plan) return AtItsKey(experiment, plan.error());
  return plan;
}

std::string Version() { return TRUETRIAD_VERSION; }

}  // namespace truetriad
