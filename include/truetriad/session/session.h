// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "truetriad/base/input_file.h"
#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/config/experiment.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/io/recording.h"
#include "truetriad/model/calibration.h"
#include "truetriad/planning/plan.h"

namespace truetriad {

/// Opens a recording from its beginning, as often as it is asked for. Unset: the file of that name.
using RecordingOpener = std::function<Result<std::unique_ptr<SampleSource>>(
    const std::string& input, const OpenRecordingOptions& options)>;

/// What was read of one sensor, whatever file it is in, how that is written or packed and where its
/// times begin: two that have the same digest have the same values.
struct SensorReadings {
  std::string sensor;  ///< "accelerometer".
  std::string digest;  ///< 16 hexadecimal digits.
};

/// The poses of one recording or pose table, and where they came from.
struct LoadedPoses {
  std::string input;   ///< As it was named.
  PosesConfig config;  ///< How they were looked for.
  PoseSet poses;
  std::vector<InputFile> inputs;
  std::vector<SensorReadings> readings;  ///< Of each sensor; of sessions one after the other.
  PerTriad<std::optional<double>> si_per_count;
  /// Static detection looked for them: neither the recording nor the caller says where they are.
  bool are_detected = false;
  bool are_rows = false;  ///< Each row is a pose.
  /// Why there is no pose in a recording that could be read. `poses` then describes its streams.
  std::optional<Error> not_enough;
};

/// Reads a pose table, or a recording whose poses are where `config` says; unless it does
/// (`given`), where the recording says, and else where static detection finds them. What `opener`
/// opens is no pose table.
/// Error (bad input): what cannot be read or trusted.
Result<LoadedPoses> LoadPoses(const std::string& input,
                              const PosesConfig& config,
                              const ProgressCallback& progress = {},
                              const RecordingOpener& opener = {});

/// Of a recording the first `most` readings of each sensor, or all. Unset: it cannot be read.
std::optional<std::vector<SensorReadings>> ReadingsOf(const std::string& log,
                                                      std::optional<std::int64_t> most);

/// Whether the calibration was made from one of these files.
bool IsMadeFrom(const Calibration& calibration, const std::vector<InputFile>& inputs);

/// Error (bad input): both state a unit, or device ids of their sensors, and not the same. `what`:
/// "log.csv: the recording", which states `serial` and `tags`.
Status CheckSameSensors(const std::string& what,
                        const std::string& serial,
                        const Tags& tags,
                        const Calibration& of,
                        const std::string& remedy = "give the calibration of this sensor");
/// The same of two calibrations.
inline Status CheckSameSensors(
    const std::string& file,
    const Calibration& one,
    const Calibration& other,
    const std::string& remedy = "give those of one sensor (`import --id=N` chooses it)") {
  return CheckSameSensors(file, one.serial, one.tags, other, remedy);
}

/// The poses of a recording on which calibrations are evaluated: where `poses` (ParsePoses) says,
/// with the clocks of the first calibration. Errors: as LoadPoses; there is no pose; of other
/// sensors.
Result<LoadedPoses> LoadToEvaluate(const std::vector<Calibration>& calibrations,
                                   const std::string& input,
                                   const std::string& poses,
                                   const ProgressCallback& progress = {},
                                   const RecordingOpener& opener = {});

/// Calibrates what `experiment` asks for from experiment.inputs; everything of calibration.yaml is
/// filled. Too little data is an outcome. `first` is what was read of the first of them before:
/// unless the experiment asks for other things of it, it is not read again. `poses` and `readings`,
/// unless null, are set to those that were calibrated from. Error (bad input, usage): files that
/// contradict the experiment or each other.
Result<Calibration> CalibrateExperiment(Experiment experiment,
                                        const ProgressCallback& progress = {},
                                        std::optional<LoadedPoses> first = std::nullopt,
                                        PoseSet* poses = nullptr,
                                        const RecordingOpener& opener = {},
                                        std::vector<SensorReadings>* readings = nullptr);

/// What there is to know of recordings of one unit from the first of them.
struct FirstLook {
  std::string experiment_yaml;  ///< Every sensor that any holds, with defaults and comments.
  LoadedPoses loaded;
};

/// Paths in the experiment are relative to `folder`, where it is to lie (empty: the current one).
/// Error (bad input): a recording that cannot be read. Error (not enough): a gyroscope alone.
Result<FirstLook> InitialExperiment(const std::vector<std::string>& inputs,
                                    const std::string& folder,
                                    const ProgressCallback& progress = {},
                                    const RecordingOpener& opener = {});

/// What a calibration of every sensor makes of a recording of which nothing else is known, poses
/// where `config` says. Too little data is an outcome. Errors: as InitialExperiment and
/// CalibrateExperiment.
Result<Calibration> TryCalibration(const std::string& input,
                                   const LoadedPoses& loaded,
                                   const PosesConfig& config,
                                   const ProgressCallback& progress = {});

/// Plans what the `plan:` block of `experiment` asks for, on top of the poses of the recording at
/// `measured`; where that is empty, of the experiment's own if it asks for that (`start:
/// recording`), or of none. Error (bad input, usage): as CalibrateExperiment, and what
/// MakePlan refuses.
Result<Plan> PlanExperiment(Experiment experiment,
                            const std::string& measured,
                            const ProgressCallback& progress = {});

}  // namespace truetriad
