// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "allan/allan_file.h"
#include "base/sensor_line.h"
#include "data/repeats.h"
#include "session/steps.h"
#include "truetriad/base/triad.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"
#include "verdict/checks/soak.h"

namespace truetriad {
namespace {

/// The table `file` as poses; it must have one row for each of `poses`, in the same order.
Result<PoseSet> ReadRowsFor(const PoseSet& poses, const std::string& file) {
  TRUETRIAD_ASSIGN_OR_RETURN(PoseTable table, ReadPoseTable(file));
  if (table.poses.poses.size() == poses.poses.size()) return std::move(table.poses);
  return Error(ErrorCode::kDoesNotMatch,
               {file},
               "has " + std::to_string(table.poses.poses.size()) + " rows, but the recording has " +
                   std::to_string(poses.poses.size()) +
                   " poses; expected one row per pose, in the same order (`truetriad inspect` "
                   "lists the poses)");
}

Error LacksInRow(const std::string& file, const StaticPose& row, const std::string& what) {
  return {
      ErrorCode::kMissingColumn, {file}, "row " + std::to_string(row.number) + " has no " + what};
}

Status AttachAttitudes(const Experiment& experiment, PoseSet* poses) {
  const std::string& file = experiment.attitudes_file;
  if (file.empty()) return {};
  TRUETRIAD_ASSIGN_OR_RETURN(const PoseSet rows, ReadRowsFor(*poses, file));
  for (std::size_t k = 0; k < rows.poses.size(); ++k) {
    const StaticPose& row = rows.poses[k];
    if (!row.attitude) {
      return LacksInRow(file, row, "attitude; expected the columns qw,qx,qy,qz");
    }
    poses->poses[k].attitude = row.attitude;
    poses->poses[k].attitude->sigma_rad.setConstant(experiment.attitudes_sigma_deg * kRadPerDeg);
  }
  return {};
}

Status ReadKnownForces(const PoseSet& poses, Experiment* experiment) {
  const std::string& file = experiment->forces_file;
  if (file.empty()) return {};
  TRUETRIAD_ASSIGN_OR_RETURN(const PoseSet rows, ReadRowsFor(poses, file));
  const StreamSummary* stream = rows.Find(Triad::kAccelerometer);
  for (const StaticPose& row : rows.poses) {
    const Boxed<TriadPose>& force = row.triads[Triad::kAccelerometer];
    if (!force || stream == nullptr || stream->unit.is_counts) {
      return LacksInRow(
          file, row, "known force; expected accel_x, accel_y, accel_z in m/s^2, g or mg");
    }
    experiment->options.initialise.known_forces.push_back(force->mean_raw *
                                                          stream->unit.truth_per_raw);
  }
  return {};
}

/// The sensitivity of an ideal chip in its mounting: truth = raw, in true units.
Result<Eigen::Matrix3d> IdentitySensitivity(const LoadedPoses& loaded,
                                            Triad triad,
                                            const TriadOptions& options) {
  const Unit& unit = loaded.poses.Find(triad)->unit;
  const std::optional<double> truth_per_raw =
      unit.is_counts ? loaded.si_per_count[triad] : unit.truth_per_raw;
  if (!truth_per_raw) {
    return Error(ErrorCode::kCountsOfUnknownSize,
                 {loaded.poses.source},
                 "the " + std::string(TriadName(triad)) +
                     " is in counts of unknown size, so its matrix cannot be held at identity; "
                     "state `si_per_count:` of the stream in a manifest, or give the matrix as " +
                     SensorLine(triad, "fixed: { matrix: [[…], […], […]] }"));
  }
  const bool reports_gravity =
      triad == Triad::kAccelerometer && options.sign == AccelerometerSign::kGravity;
  return Eigen::Matrix3d(options.mounting.value_or(Eigen::Matrix3d::Identity()) *
                         ((reports_gravity ? -1.0 : 1.0) / *truth_per_raw));
}

/// Noise of `triad` in the recording's unit from the Allan result in `file`.
Result<AllanNoise> ReadAllanNoise(const std::string& file, Triad triad, const PoseSet& poses) {
  TRUETRIAD_ASSIGN_OR_RETURN(const AllanResult allan, ReadAllanFile(file));
  const std::string name(TriadName(triad));
  const AllanTriad* found = allan.Find(triad);
  if (found == nullptr) {
    return Error(ErrorCode::kMissingSensor,
                 {file},
                 "contains no " + name +
                     ", whose noise the experiment reads from this file; give an Allan deviation "
                     "of that sensor, or state its noise");
  }
  if (!found->at_rest()) {
    return Error(ErrorCode::kDoesNotMatch,
                 {file},
                 "the " + name + " was not at rest (" + found->disturbance +
                     "), so its noise is unknown; analyse a log of the unit at rest, or state " +
                     SensorLine(name, "noise: { sigma: [x, y, z] }"));
  }
  const Unit& unit = poses.Find(triad)->unit;
  if (found->unit.is_counts != unit.is_counts) {
    return Error(ErrorCode::kUnitMismatch,
                 {file},
                 "the " + name + " is in " + found->unit.name + ", but " + poses.source +
                     " is in " + unit.name +
                     "; counts cannot be converted: analyse a recording in the same unit");
  }
  for (const AllanAxis& axis : found->axes) {
    if (axis.white_density && axis.white_density->value > 0.0 && axis.instability) continue;
    return Error(ErrorCode::kDoesNotMatch,
                 {file},
                 "the " + name +
                     " has an axis without noise density or bias instability; analyse a longer "
                     "rest, or state " +
                     SensorLine(name, "noise: { sigma: [x, y, z] }"));
  }
  // For counts, both factors are 1.
  const double scale = found->unit.truth_per_raw / unit.truth_per_raw;
  AllanNoise noise;
  for (int axis = 0; axis < 3; ++axis) {
    const AllanAxis& seen = found->axes[static_cast<std::size_t>(axis)];
    noise.white_density_raw[axis] = scale * seen.white_density->value;
    noise.instability_raw[axis] = scale * seen.instability->coefficient.value;
  }
  return noise;
}

/// Prepares a sweep that starts from a calibration at one temperature (`static:`).
Status SettleSweep(const LoadedPoses& loaded, Experiment* experiment) {
  CalibrateOptions& options = experiment->options;
  TRUETRIAD_ASSIGN_OR_RETURN(Calibration known, ReadCalibration(experiment->static_file));
  const std::string& serial = experiment->serial.empty() ? loaded.poses.serial : experiment->serial;
  if (!known.serial.empty() && !serial.empty() && known.serial != serial) {
    return Error(ErrorCode::kOtherDevice,
                 {experiment->static_file},
                 "is the calibration of " + known.serial + ", but this sweep is of " + serial +
                     "; give the calibration of " + serial + " at one temperature");
  }
  const double wanted = options.reference.temperature_degc;
  const auto& recorded = known.reference.recorded_degc;
  const double stated = recorded ? (*recorded)[1] : known.reference.temperature_degc;
  if (experiment->reference_given && wanted != stated) {
    return Error(
        ErrorCode::kDoesNotMatch,
        {experiment->static_file},
        "was made at " + std::to_string(stated) + " degC, but reference.temperature_degc is " +
            std::to_string(wanted) +
            "; its bias is valid only at its own temperature: remove reference.temperature_degc");
  }
  const Knowledge& gravity = options.reference.gravity_mps2;
  const double stated_mps2 = gravity.value.value_or(kStandardGravityMps2);
  const double off = stated_mps2 - known.reference.gravity_mps2;
  // Standard gravity counts as not stated. The values of two places on Earth differ by up to 0.05
  // m/s^2.
  constexpr double kNotable = 1e-3;
  if (stated_mps2 != kStandardGravityMps2 && std::abs(off) > kNotable) {
    return Error(ErrorCode::kDoesNotMatch,
                 {experiment->static_file},
                 "was made with gravity " + std::to_string(known.reference.gravity_mps2) +
                     " m/s^2, but this experiment states " + std::to_string(stated_mps2) +
                     "; its sensitivity is valid only with the gravity that it was made with: "
                     "remove gravity_mps2 or position from the reference, or repeat that "
                     "calibration with the gravity at its site");
  }
  for (const Triad triad : kTriads) {
    if (known.sensors[triad]) options.triads[triad].mounting = known.sensors[triad]->mounting;
  }
  options.sweep->static_calibration = std::move(known);
  options.sweep->static_file = experiment->static_file;
  return {};
}

/// Leaves out the poses that the experiment names, with their attitudes and forces.
Status ExcludePoses(PoseSet* poses, Experiment* experiment) {
  const std::vector<int>& excluded = experiment->exclude_poses;
  if (excluded.empty()) return {};
  for (const int number : excluded) {
    const bool is_there = std::any_of(poses->poses.begin(),
                                      poses->poses.end(),
                                      [&](const auto& pose) { return pose.number == number; });
    if (is_there) continue;
    return ErrorIn(ErrorCode::kNotInRecording,
                   experiment->exclude_poses_stated,
                   "there is no pose " + std::to_string(number) + " in " + poses->source +
                       "; `truetriad inspect` lists the poses");
  }
  std::vector<Eigen::Vector3d>& forces = experiment->options.initialise.known_forces;
  std::vector<Eigen::Vector3d> kept_forces;
  std::vector<std::size_t> kept;
  for (std::size_t k = 0; k < poses->poses.size(); ++k) {
    const int number = poses->poses[k].number;
    if (std::find(excluded.begin(), excluded.end(), number) != excluded.end()) continue;
    kept.push_back(k);
    if (!forces.empty()) kept_forces.push_back(forces[k]);
  }
  const std::size_t count = poses->poses.size() - kept.size();
  *poses = PosesAmong(*poses, kept);
  forces = std::move(kept_forces);
  poses->findings.push_back(Finding(FindingCode::kExcluded,
                                    std::to_string(count) +
                                        (count == 1 ? " pose is" : " poses are") +
                                        " left out, as `exclude_poses:` asks")
                                .With("poses", static_cast<double>(count)));
  return {};
}

/// Fixes matrices whose value depends on the recording. In a sweep, these are all matrices;
/// otherwise, those that the experiment names or that its models do not estimate.
Status HoldMatrices(const LoadedPoses& loaded, bool is_sweep, Experiment* experiment) {
  for (const Triad triad : kTriads) {
    TriadOptions& options = experiment->options.triads[triad];
    const bool to_identity =
        experiment->fixed_identity[triad] || (is_sweep && !options.fixed_sensitivity);
    const bool may_be_held =
        options.model == MatrixModel::kBias || options.model == MatrixModel::kAuto;
    const bool held = to_identity || (may_be_held && !options.fixed_sensitivity);
    if (!options.enabled || !held || loaded.poses.Find(triad) == nullptr) continue;
    const bool is_candidate = options.model == MatrixModel::kAuto && !to_identity;
    std::optional<Eigen::Matrix3d>& matrix =
        is_candidate ? options.nominal_sensitivity : options.fixed_sensitivity;
    const bool has_prior = options.prior && options.prior->sensitivity_sigma.allFinite();
    if (has_prior && !to_identity) {
      matrix = options.prior->sensitivity;
      continue;
    }
    const Result<Eigen::Matrix3d> identity = IdentitySensitivity(loaded, triad, options);
    // Counts of unknown size have no nominal matrix.
    if (!identity && is_candidate) continue;
    TRUETRIAD_RETURN_IF_ERROR(identity);
    matrix = *identity;
  }
  return {};
}

/// Noise of each triad from the Allan deviation that the experiment names.
Status SettleAllanNoise(const PoseSet& poses, Experiment* experiment) {
  for (const Triad triad : kTriads) {
    TriadOptions& options = experiment->options.triads[triad];
    const std::string& file = experiment->allan_files[triad];
    if (file.empty() || !options.enabled || poses.Find(triad) == nullptr) continue;
    TRUETRIAD_ASSIGN_OR_RETURN(const AllanNoise noise, ReadAllanNoise(file, triad, poses));
    options.allan = noise;
  }
  return {};
}

/// Error: the recording is of another device than the experiment states.
Status CheckSerial(const LoadedPoses& loaded, const Experiment& experiment) {
  const std::string& serial = loaded.poses.serial;
  if (serial.empty() || experiment.serial.empty() || serial == experiment.serial) return {};
  return Error(ErrorCode::kOtherDevice,
               {experiment.path},
               "device.serial is `" + experiment.serial + "`, but the recording " +
                   loaded.poses.source + " is of unit `" + serial +
                   "`; give that unit's recording, or correct the number");
}

}  // namespace

Status SettleWithRecording(LoadedPoses* loaded, Experiment* experiment) {
  TRUETRIAD_RETURN_IF_ERROR(CheckSerial(*loaded, *experiment));
  if (loaded->not_enough) return {};
  const bool is_taken = !loaded->input.empty();
  const bool is_sweep = is_taken && experiment->options.sweep;
  if (is_sweep) {
    return experiment->static_file.empty() ? HoldMatrices(*loaded, is_sweep, experiment)
                                           : SettleSweep(*loaded, experiment);
  }
  if (is_taken) {
    TRUETRIAD_RETURN_IF_ERROR(AttachAttitudes(*experiment, &loaded->poses));
    TRUETRIAD_RETURN_IF_ERROR(ReadKnownForces(loaded->poses, experiment));
    TRUETRIAD_RETURN_IF_ERROR(ExcludePoses(&loaded->poses, experiment));
    // If attitudes are stated, equal readings may be genuine.
    if (loaded->are_rows && experiment->options.attitudes.kind == AttitudeKind::kNone &&
        experiment->forces_file.empty()) {
      LeaveOutRepeats(&loaded->poses);
    }
  }
  TRUETRIAD_RETURN_IF_ERROR(HoldMatrices(*loaded, is_sweep, experiment));
  return SettleAllanNoise(loaded->poses, experiment);
}

}  // namespace truetriad
