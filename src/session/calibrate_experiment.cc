// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "config/field_check.h"
#include "session/load_sessions.h"
#include "session/settle_experiment.h"
#include "truetriad/base/version.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/session/session.h"
#include "verdict/checks/units.h"

namespace truetriad {
namespace {

Calibration NotEnough(const Experiment& experiment, const Error& reason) {
  Calibration calibration;
  calibration.findings = {RefusalOf(reason)};
  calibration.outcome = OutcomeOf(calibration.findings);
  calibration.mode = experiment.options.mode();
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
    // A wrong unit of time leaves no rest.
    if (auto reason = WhyNotAsStated(loaded.poses, experiment.options)) {
      calibration.findings = {*std::move(reason)};
      calibration.outcome = OutcomeOf(calibration.findings);
    }
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

Result<Calibration> CalibrateExperiment(Experiment experiment, const ProgressCallback& progress) {
  Result<LoadedPoses> read = LoadSessions(experiment, progress);
  if (!read) return AtItsKey(experiment, read.error());
  LoadedPoses loaded = *std::move(read);
  TRUETRIAD_RETURN_IF_ERROR(CheckSerial(loaded, experiment));
  if (!loaded.not_enough) {
    TRUETRIAD_RETURN_IF_ERROR(SettleWithRecording(&loaded, &experiment));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(Calibration calibration, CalibratePoses(loaded, experiment));
  calibration.serial = experiment.serial.empty() ? loaded.poses.serial : experiment.serial;
  calibration.model = experiment.model;
  calibration.software_version = Version();
  calibration.created = TimestampUtc();
  calibration.inputs = std::move(loaded.inputs);
  CheckField(experiment, &calibration);
  calibration.findings.insert(
      calibration.findings.end(), loaded.poses.findings.begin(), loaded.poses.findings.end());
  for (const Triad triad : kTriads) {
    if (std::optional<TriadCalibration>& sensor = calibration.sensors[triad]) {
      sensor->si_per_count = loaded.si_per_count[triad];
    }
  }
  return calibration;
}

}  // namespace truetriad
