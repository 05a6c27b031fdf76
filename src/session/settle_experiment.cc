// SPDX-License-Identifier: Apache-2.0
#include "session/settle_experiment.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "allan/allan_file.h"
#include "base/sensor_line.h"
#include "truetriad/base/units.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"
#include "verdict/checks/soak.h"

namespace truetriad {
namespace {

/// Each row of the table `file` for the pose of the same number, to be read by `assign`.
template <typename Assign>
Status AssignRows(const std::string& file, std::vector<StaticPose>* poses, Assign assign) {
  TRUETRIAD_ASSIGN_OR_RETURN(const PoseTable table, ReadPoseTable(file));
  const std::vector<StaticPose>& rows = table.poses.poses;
  if (rows.size() != poses->size()) {
    return Error(ErrorCode::kDoesNotMatch,
                 {file},
                 "has " + std::to_string(rows.size()) + " rows, but the recording has " +
                     std::to_string(poses->size()) +
                     " poses; expected one row per pose, in the same order (`truetriad "
                     "inspect` lists the poses)");
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    TRUETRIAD_RETURN_IF_ERROR(assign(table.poses, rows[k], &(*poses)[k]));
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
                        return Error(ErrorCode::kMissingColumn,
                                     {experiment.attitudes_file},
                                     "row " + std::to_string(row.number) +
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
        const Boxed<TriadPose>& force = row.triads[Triad::kAccelerometer];
        const StreamSummary* stream = table.Find(Triad::kAccelerometer);
        if (!force || stream == nullptr || stream->unit.is_counts) {
          return Error(ErrorCode::kMissingColumn,
                       {file},
                       "row " + std::to_string(row.number) +
                           " has no known force; expected accel_x, accel_y, accel_z in m/s^2, "
                           "g or mg");
        }
        forces->push_back(force->mean_raw * stream->unit.truth_per_raw);
        return {};
      });
}

/// The sensitivity of a perfect chip, as it is mounted: truth = raw, in true units.
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

/// `axes` of a coefficient in the recording's unit.
template <typename Get>
Eigen::Vector3d PerAxis(const AllanTriad& triad, double scale, Get get) {
  return scale * Eigen::Vector3d(get(triad.axes[0]), get(triad.axes[1]), get(triad.axes[2]));
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
                     ", but its noise is to be read from here; give an Allan deviation of it, "
                     "or state its noise");
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
  // Both are 1 for counts.
  const double scale = found->unit.truth_per_raw / unit.truth_per_raw;
  return AllanNoise{
      PerAxis(*found, scale, [](const AllanAxis& axis) { return axis.white_density->value; }),
      PerAxis(*found, scale, [](const AllanAxis& axis) {
        return axis.instability->coefficient.value;
      })};
}

/// What a sweep takes from a calibration at one temperature, or without one from the units.
Status SettleSweep(const LoadedPoses& loaded, Experiment* experiment) {
  CalibrateOptions& options = experiment->options;
  if (experiment->static_file.empty()) {
    for (const Triad triad : kTriads) {
      TriadOptions& sensor = options.triads[triad];
      if (!sensor.enabled || sensor.fixed_sensitivity || !loaded.poses.Find(triad)) continue;
      TRUETRIAD_ASSIGN_OR_RETURN(const Eigen::Matrix3d identity,
                                 IdentitySensitivity(loaded, triad, sensor));
      sensor.fixed_sensitivity = identity;
    }
    return {};
  }
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
  // Gravity that nobody stated is the standard one. Another place's is off by up to 0.05.
  constexpr double kNotable = 1e-3;
  if (stated_mps2 != kStandardGravityMps2 && std::abs(off) > kNotable) {
    return Error(ErrorCode::kDoesNotMatch,
                 {experiment->static_file},
                 "was made with gravity " + std::to_string(known.reference.gravity_mps2) +
                     " m/s^2, but this experiment states " + std::to_string(stated_mps2) +
                     "; its sensitivity is valid only with its own: remove reference.gravity, "
                     "or repeat that calibration with the gravity at its site");
  }
  for (const Triad triad : kTriads) {
    if (known.sensors[triad]) options.triads[triad].mounting = known.sensors[triad]->mounting;
  }
  options.sweep->static_calibration = std::move(known);
  options.sweep->static_file = experiment->static_file;
  return {};
}

/// Leaves out the poses that the experiment names, with what files say of them.
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

}  // namespace

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

Status CheckSerial(const LoadedPoses& loaded, const Experiment& experiment) {
  const std::string& serial = loaded.poses.serial;
  if (serial.empty() || experiment.serial.empty() || serial == experiment.serial) return {};
  return Error(ErrorCode::kOtherDevice,
               {experiment.path},
               "device.serial is `" + experiment.serial + "`, but the recording " +
                   loaded.poses.source + " is of unit `" + serial +
                   "`; give that unit's recording, or correct the number");
}

Status SettleWithRecording(LoadedPoses* loaded, Experiment* experiment) {
  if (experiment->options.sweep) return SettleSweep(*loaded, experiment);
  TRUETRIAD_RETURN_IF_ERROR(AttachAttitudes(*experiment, &loaded->poses));
  TRUETRIAD_RETURN_IF_ERROR(ReadKnownForces(
      experiment->forces_file, &loaded->poses, &experiment->options.initialise.known_forces));
  TRUETRIAD_RETURN_IF_ERROR(ExcludePoses(&loaded->poses, experiment));
  TRUETRIAD_RETURN_IF_ERROR(HoldMatrices(*loaded, experiment));
  return SettleAllanNoise(loaded->poses, experiment);
}

}  // namespace truetriad
