// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "io/pose_program_file.h"
#include "model/attitude_sets.h"
#include "session/steps.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

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

}  // namespace

Result<Plan> PlanExperiment(Experiment experiment,
                            const std::string& measured,
                            const ProgressCallback& progress) {
  if (!experiment.plan) {
    return Error(ErrorCode::kInvalidExperiment,
                 {experiment.path},
                 "has no `plan:`; state what to plan for, as in `plan: { poses: 12 }`");
  }
  const PlanConfig& config = *experiment.plan;
  LoadedPoses loaded = NothingMeasured(experiment);
  if (!measured.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(loaded, LoadPoses(measured, experiment.poses, progress));
  }
  TRUETRIAD_RETURN_IF_ERROR(SettleWithRecording(&loaded, &experiment));
  if (loaded.not_enough) return *loaded.not_enough;

  PlanOptions options;
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
    TRUETRIAD_ASSIGN_OR_RETURN(PoseProgram program, ReadPoseProgram(config.program));
    options.program = std::move(program);
  }
  Result<Plan> plan = MakePlan(loaded.poses, options);
  if (!plan) return AtItsKey(experiment, plan.error());
  return plan;
}

}  // namespace truetriad
