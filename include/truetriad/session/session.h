// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

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

/// Opens a recording from its beginning at each call. Unset: `input` is the name of a file.
using RecordingOpener = std::function<Result<std::unique_ptr<SampleSource>>(
    const std::string& input, const OpenRecordingOptions& options)>;

/// Digest of the readings of one sensor. It does not depend on the file's format, packing or first
/// time: equal digests mean equal values.
struct SensorReadings {
  std::string sensor;  ///< "accelerometer".
  std::string digest;  ///< 16 hexadecimal digits.
};

/// The poses of one recording or pose table, and how they were obtained.
struct LoadedPoses {
  std::string input;   ///< The name with which the input was opened.
  PosesConfig config;  ///< How the poses were searched for.
  PoseSet poses;
  std::vector<InputFile> inputs;
  std::vector<SensorReadings> readings;  ///< One for each sensor, session after session.
  PerTriad<std::optional<double>> si_per_count;
  /// Whether static detection found the poses, since neither the recording nor the caller states
  /// them.
  bool are_detected = false;
  bool are_rows = false;  ///< Each row is a pose.
  /// Why a readable recording has no pose. `poses` then describes its streams.
  std::optional<Error> not_enough;
};

/// Reads a pose table, or a recording. The poses of a recording are found as `config` states if
/// `config.given`, otherwise as the recording states. If neither states how, they are found by
/// static detection. A recording that `opener` opens is never a pose table. Error (bad input): the
/// input cannot be read or trusted.
Result<LoadedPoses> LoadPoses(const std::string& input,
                              const PosesConfig& config,
                              const ProgressCallback& progress = {},
                              const RecordingOpener& opener = {});

/// Digests of the first `most` readings of each sensor, or of all readings if `most` is unset.
/// Nullopt if `log` is unreadable.
std::optional<std::vector<SensorReadings>> ReadingsOf(const std::string& log,
                                                      std::optional<std::int64_t> most);

/// Whether the calibration was made from one of these files.
bool IsMadeFrom(const Calibration& calibration, const std::vector<InputFile>& inputs);

/// Error (bad input): `of` states another serial number or device id than `serial` and `tags`,
/// which are those of `what`, such as "log.csv: the recording".
Status CheckSameSensors(const std::string& what,
                        const std::string& serial,
                        const Tags& tags,
                        const Calibration& of,
                        const std::string& remedy = "give the calibration of this sensor");
/// The same check for two calibrations.
inline Status CheckSameSensors(
    const std::string& file,
    const Calibration& one,
    const Calibration& other,
    const std::string& remedy = "give those of one sensor (`import --id=N` chooses it)") {
  return CheckSameSensors(file, one.serial, one.tags, other, remedy);
}

/// Loads a recording on which calibrations are to be evaluated. `poses` states how its poses are
/// found (ParsePoses); the first calibration states how clocks are treated. Errors: as LoadPoses
/// and CheckSameSensors, or the recording has no pose.
Result<LoadedPoses> LoadToEvaluate(const std::vector<Calibration>& calibrations,
                                   const std::string& input,
                                   const std::string& poses,
                                   const ProgressCallback& progress = {},
                                   const RecordingOpener& opener = {});

/// Calibrates from experiment.inputs and fills in everything that calibration.yaml states. Too
/// little data is an outcome, not an error. `first` is the first input, if it was loaded before: it
/// is read again only if the experiment asks for other poses. Unless they are null, `poses` and
/// `readings` are set to the poses and readings that were used. Error (bad input, usage): files
/// contradict the experiment or each other.
Result<Calibration> CalibrateExperiment(Experiment experiment,
                                        const ProgressCallback& progress = {},
                                        std::optional<LoadedPoses> first = std::nullopt,
                                        PoseSet* poses = nullptr,
                                        const RecordingOpener& opener = {},
                                        std::vector<SensorReadings>* readings = nullptr);

/// A draft of an experiment for recordings of one unit, and the poses of the first of them.
struct FirstLook {
  std::string experiment_yaml;  ///< Has the sensors of all recordings, with defaults and comments.
  LoadedPoses loaded;
};

/// Paths in the experiment are relative to `folder`, where it will be stored (empty: the current
/// one). Error (bad input): a recording that cannot be read. Error (not enough): a gyroscope is the
/// only sensor of the recordings.
Result<FirstLook> InitialExperiment(const std::vector<std::string>& inputs,
                                    const std::string& folder,
                                    const ProgressCallback& progress = {},
                                    const RecordingOpener& opener = {});

/// Calibrates every sensor of a recording about which nothing else is known, with poses as `config`
/// states. Too little data is an outcome, not an error. Errors: those of InitialExperiment and
/// CalibrateExperiment.
Result<Calibration> TryCalibration(const std::string& input,
                                   const LoadedPoses& loaded,
                                   const PosesConfig& config,
                                   const ProgressCallback& progress = {});

/// Plans poses as the `plan:` block of `experiment` asks, in addition to those of the recording
/// `measured`. If this is empty and the block has `start: recording`: in addition to those of the
/// experiment's own recording. Error (bad input, usage): as CalibrateExperiment, and what MakePlan
/// refuses.
Result<Plan> PlanExperiment(Experiment experiment,
                            const std::string& measured,
                            const ProgressCallback& progress = {});

}  // namespace truetriad
