// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gflags/gflags.h>

#include "calibrate/verdict_fields.h"
#include "fleet/json_lines.h"
#include "fleet/log_files.h"
#include "fleet/store.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_progress.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "tree/to_tree.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"

DEFINE_string(golden, "", "FILE: calibration.yaml of the golden unit, the reference");
DEFINE_string(
    repeatability,
    "",
    "SENSOR.bias=SIGMA,...: σ by which the golden unit itself differs from run to run, as in "
    "accelerometer.bias=0.01,magnetometer.scale=0.001 (m/s^2, rad/s, uT; for scale a relative "
    "value)");

namespace truetriad {
namespace {

/// Parses "accelerometer.bias=0.01,gyroscope.scale=1e-4".
Result<Repeatability> ParseRepeatability(const std::string& text) {
  Repeatability repeatability;
  for (const std::string& item : CommaSeparated(text)) {
    const std::size_t dot = item.find('.'), equals = item.find('=');
    const bool has_both = dot < equals && equals != std::string::npos;
    const std::optional<Triad> triad = TriadFromName(item.substr(0, dot));
    const std::string quantity = has_both ? item.substr(dot + 1, equals - dot - 1) : "";
    const Error error(ErrorCode::kInvalidArgument,
                      "--repeatability: `" + item +
                          "` is not understood; expected SENSOR.bias=σ in m/s^2, rad/s or uT, or "
                          "SENSOR.scale=σ as a share, as in accelerometer.bias=0.01");
    if (!triad || (quantity != "bias" && quantity != "scale")) return error;
    const Result<double> value = ParseReal("repeatability", item.substr(equals + 1));
    if (!value || *value < 0.0) return error;
    (quantity == "bias" ? repeatability.bias : repeatability.scale)[*triad] = *value;
  }
  return repeatability;
}

/// The experiment of the golden unit's calibration with today's recording as input.
Result<Experiment> ExperimentOf(const Calibration& golden, std::vector<std::string> inputs) {
  if (FLAGS_config.empty() && golden.config_yaml.empty()) {
    return Error(ErrorCode::kMissingArgument,
                 FLAGS_golden +
                     ": does not state the experiment that it was made by (it was imported or "
                     "simulated); give one with --config");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> overrides, OverridesAndTags());
  TRUETRIAD_ASSIGN_OR_RETURN(
      Experiment experiment,
      ReadExperiment(FLAGS_config.empty() ? FLAGS_golden : FLAGS_config, overrides));
  if (!FLAGS_store.empty() && experiment.tags.station.empty()) {
    return Error(
        ErrorCode::kMissingArgument,
        "--store needs the name of the station whose check it keeps; give --tag=station=NAME");
  }
  experiment.inputs = std::move(inputs);
  return experiment;
}

/// Error (usage): --store names a file of JSON lines, which cannot keep station checks.
Status CheckStore() {
  if (FLAGS_store.empty()) return {};
  TRUETRIAD_RETURN_IF_ERROR(fleet::CheckStoreUrl(FLAGS_store));
  if (!fleet::JsonLinesPath(FLAGS_store)) return {};
  return BadValue("store",
                  FLAGS_store,
                  ": a file of JSON lines cannot hold station checks; name an SQLite file, as in "
                  "--store=fleet.db, or PostgreSQL");
}

/// Today's recording of the golden unit.
struct Today {
  Calibration calibration;
  std::string recording;                ///< Identifies the readings (RecordingOf).
  std::optional<std::string> recorded;  ///< The recording's time; unset: unknown.
};

Result<Today> TodayOf(const Experiment& experiment) {
  const std::string& log = experiment.inputs.front();
  ProgressLine progress("reading " + log);
  std::vector<SensorReadings> readings;
  PoseSet poses;
  TRUETRIAD_ASSIGN_OR_RETURN(
      Calibration calibration,
      CalibrateExperiment(experiment, progress.callback(), {}, &poses, {}, &readings));
  Today today{std::move(calibration), fleet::RecordingOf(readings), std::nullopt};
  std::optional<fleet::Recorded> recorded = fleet::RecordedOf(poses);
  const std::optional<fleet::LogStamp> stamp = fleet::StampOf(log);
  if (!recorded && stamp) {
    recorded = fleet::RecordedOf(*stamp);
    if (!FLAGS_store.empty()) {
      Warn(log + ": does not state when it was recorded; the time of the file, " + recorded->at +
           ", is used instead, but copying may have changed it");
    }
  }
  if (recorded) today.recorded = recorded->at;
  return today;
}

/// Adds the check to the store of --store. `comparison` is null if today's recording was refused,
/// which counts as disagreement. If another check counts instead of this one, returns that check.
Result<std::optional<fleet::StationCheck>> KeepCheck(const Experiment& experiment,
                                                     const Calibration& golden,
                                                     const Today& today,
                                                     const Comparison* comparison) {
  if (FLAGS_store.empty()) return std::optional<fleet::StationCheck>();
  fleet::StationCheck check;
  check.id = fleet::NewRunId();
  check.station = experiment.tags.station;
  check.serial = golden.serial;
  check.created = TimestampUtc();
  check.log = experiment.inputs.front();
  check.recorded = today.recorded.value_or(check.created);
  check.recording = today.recording;
  check.repeatability = FLAGS_repeatability;
  if (comparison != nullptr) {
    check.agrees = AgreementOf(*comparison) == Agreement::kAgree;
    check.p = comparison->p_value;
    check.largest = comparison->largest_in_sigmas;
    const ComparisonEntry* const largest = LargestOf(*comparison);
    if (largest != nullptr) check.parameter = largest->parameter;
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store,
                             fleet::OpenStore(FLAGS_store));
  return store->AddStationCheck(check);
}

/// Whether the check that counts was made from the same recording as today's.
bool IsRepeat(const fleet::StationCheck& counting, const Today& today) {
  return !today.recording.empty() && counting.recording == today.recording;
}

/// The text if another check counts, `counting`, which decides about the station instead.
std::string OtherCountsText(const std::optional<fleet::StationCheck>& counting,
                            const Today& today) {
  if (!counting) return "";
  return "DOES NOT COUNT: " +
         (IsRepeat(*counting, today)
              ? "this recording was checked at " + counting->created + " already"
              : "a later recording of the golden unit, of " + counting->recorded +
                    ", was checked already") +
         ", and " + (counting->agrees ? "agreed" : "did not agree") +
         "; that result holds until the golden unit is recorded again\n";
}

/// Compares today's calibration with the reference; the store keeps the result.
Result<VerbResult> Judged(const Experiment& experiment,
                          const Calibration& golden,
                          const Today& measured,
                          const Repeatability& repeatability) {
  VerbResult result;
  const Calibration& today = measured.calibration;
  result.findings = today.findings;
  result.outcome = today.outcome;
  result.result = {{"agrees", nullptr}};
  if (!today.IsUsable()) {
    TRUETRIAD_ASSIGN_OR_RETURN(const auto counting,
                               KeepCheck(experiment, golden, measured, nullptr));
    result.exit_code = kExitNotEnough;
    result.text = OtherCountsText(counting, measured) + CalibrationText(today);
    result.grade = Grade::kBad;
    result.failure = "the station cannot be judged: today's recording was refused";
    return result;
  }
  // Gravity depends on the station, so it must not count as a difference.
  const double gravity_mps2 = golden.reference.gravity_mps2;
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Comparison comparison,
      Compare(AtGravity(gravity_mps2, WithRepeatability(repeatability, golden)),
              AtGravity(gravity_mps2, WithRepeatability(repeatability, today))));
  if (IsMadeFrom(golden, today.inputs) || IsTooAlike(comparison)) {
    result.exit_code = kExitOutsideLimits;
    result.text =
        "NO TEST: these are the readings that the reference was made from; record the golden unit "
        "again\n";
    result.grade = Grade::kCaution;
    return result;
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const auto counting,
                             KeepCheck(experiment, golden, measured, &comparison));
  // If another check counts (the first of this recording, or of a later one), it must agree, too.
  const bool agrees =
      AgreementOf(comparison) == Agreement::kAgree && (!counting || counting->agrees);
  result.exit_code = agrees ? kExitGood : kExitOutsideLimits;
  result.grade = agrees ? Grade::kGood : Grade::kBad;
  result.text = OtherCountsText(counting, measured) +
                std::string(agrees ? "STATION AGREES" : "STATION DOES NOT AGREE") +
                " with the reference of its golden unit\n" +
                ReportOf(comparison,
                         {"a: the reference, " + OriginOf(FLAGS_golden, golden),
                          "b: today, " + experiment.inputs.front()})
                    .text;
  result.result = {{"agrees", agrees}, {"comparison", ToTree(comparison)}};
  if (counting) {
    result.result[IsRepeat(*counting, measured) ? "first_check" : "later_check"] = {
        {"created", counting->created},
        {"recorded", counting->recorded},
        {"agrees", counting->agrees}};
  }
  return result;
}

Result<VerbResult> RunCheckStation(const std::vector<std::string>& words) {
  std::vector<std::string> inputs = StatedInputs(words);
  if (inputs.empty()) {
    return Error(ErrorCode::kMissingArgument,
                 "no log; name today's recording of the golden unit (--input=LOG)");
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckStore());
  TRUETRIAD_ASSIGN_OR_RETURN(const Repeatability repeatability,
                             ParseRepeatability(FLAGS_repeatability));
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration golden, ReadCalibration(FLAGS_golden));
  if (!golden.IsUsable()) {
    return Error(
        ErrorCode::kCalibrationNotUsable,
        {FLAGS_golden},
        "is not usable (" + std::string(golden.ReasonNotUsable()) + "), so it is no reference");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const Experiment experiment, ExperimentOf(golden, std::move(inputs)));
  TRUETRIAD_ASSIGN_OR_RETURN(const Today today, TodayOf(experiment));
  TRUETRIAD_RETURN_IF_ERROR(
      CheckSameSensors(experiment.inputs.front() + ": the recording", today.calibration, golden));
  return Judged(experiment, golden, today, repeatability);
}

}  // namespace

Command CheckStationCommand() {
  return {
      .name = "check-station",
      .summary = "Does this station, today, still measure its golden unit as before?",
      .examples =
          R"(build/truetriad simulate -c configs/scenarios/consumer-9dof.yaml -o out/first-day
build/truetriad simulate -c configs/scenarios/consumer-9dof.yaml --set=seed=7 -o out/today
build/truetriad calibrate out/first-day/recording.yaml -o out/golden
build/truetriad check-station --golden=out/golden/calibration.yaml out/today/recording.yaml --repeatability=gyroscope.bias=2e-4)",
      .details =
          R"(Calibrates today's recording of the golden unit by the experiment of its reference, and compares
this calibration with the reference. Exit code 4: they do not agree (p of all differences together
below 0.01), or the reference was made from the same recording; 3: today's recording was refused. The unit
itself changes between two days, above all its biases; this is no fault of the station, so state it
with --repeatability. With --store and --tag=station=NAME the store keeps the outcome, for --require-golden
of fleet run and fleet watch; the golden unit's last recording at a station decides whether the station agrees.
)",
      .flags = "golden! input=LOG,... config repeatability store set* tag*",
      .more_words = "input",
      .run = RunCheckStation};
}

}  // namespace truetriad
