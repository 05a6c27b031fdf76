// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "io/pose_program_file.h"
#include "model/attitude_sets.h"
#include "session/steps.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

/// The streams of the nominal unit, without any pose.
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

/// The recording whose poses the plan is to complete; empty if there is none.
Result<std::string> MeasuredFor(const Experiment& experiment, const std::string& stated) {
  if (!stated.empty() || !experiment.plan->from_recording) return stated;
  const std::size_t count = experiment.inputs.size();
  if (count == 1) return experiment.inputs.front();
  return Error(
      count == 0 ? ErrorCode::kMissingArgument : ErrorCode::kConflictingArguments,
      {experiment.path},
      std::string("`start: recording` ") +
          (count == 0 ? "needs a recording; add `input:`" : "takes one recording; give it") +
          " or state it with the call (--input=LOG)");
}

}  // namespace

Result<Plan> PlanExperiment(Experiment experiment,
                            const std::string& stated,
                            const ProgressCallback& progress) {
  if (!experiment.plan) {
    return Error(ErrorCode::kInvalidExperiment,
                 {experiment.path},
                 "has no `plan:`; state what to plan for, as in `plan: { poses: 12 }`");
  }
  const PlanConfig& config = *experiment.plan;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string measured, MeasuredFor(experiment, stated));
  LoadedPoses loaded = NothingMeasured(experiment);
  if (!measured.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(loaded, LoadPoses(measured, experiment.poses, progress));
  }
  TRUETRIAD_RETURN_IF_ERROR(SettleWithRecording(&loaded, &experiment));
  if (loaded.not_enough) return *loaded.not_enough;

  PlanOptions options = config.options;
  options.calibrate = experiment.options;
  for (const Triad triad : kTriads) {
    const NominalSensor& nominal = config.nominal[triad];
    const StreamSummary* stream = loaded.poses.Find(triad);
    if (stream == nullptr || (!nominal.sensitivity && nominal.bias.isZero(0.0))) continue;
    const Eigen::Matrix3d own_scale =
        experiment.options.triads[triad].mounting.value_or(Eigen::Matrix3d::Identity()) /
        stream->unit.truth_per_raw;
    options.nominal[triad] = {nominal.sensitivity.value_or(own_scale), nominal.bias};
  }
  if (const std::optional<EarthField>& earth = experiment.earth_field) {
    if (!options.nominal_field_ut) options.nominal_field_ut = earth->strength_ut;
    if (!options.nominal_dip_rad) options.nominal_dip_rad = earth->dip_deg * kRadPerDeg;
  }
  options.attitude_sigma_rad.setConstant(experiment.attitudes_sigma_deg * kRadPerDeg);
  if (options.grid.attitudes.empty()) {
    options.grid.attitudes = experiment.options.attitudes.kind == AttitudeKind::kSixFace
                                 ? SixFaceAttitudes()
                                 : HandAttitudes();
  }
  options.max_poses = std::max(options.max_poses, options.poses);
  if (!config.program.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(PoseProgram program, ReadPoseProgram(config.program));
    options.program = std::move(program);
  }
  Result<Plan> plan = MakePlan(loaded.poses, options);
  if (!plan) return AtItsKey(experiment, plan.error());
  return plan;
}

}  // namespace truetriad
