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
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

struct OpenRecordingOptions {
  /// Name of the column that numbers poses, if it is not `pose`. Empty: `pose`.
  std::string pose_column;
  /// Read the ambient temperature too, if the recording has one.
  bool ambient = false;
  /// Whether a single file may be joined from pieces. If the present piece has 20 rows or more and
  /// time goes back by over 20 intervals, another piece begins: its times are shifted to follow the
  /// previous piece, and SampleSource::joints lists the place. Otherwise times that go back are an
  /// error.
  bool may_be_joined = false;
  /// Sensors of a manifest that are not read: their files and columns may be missing.
  PerTriad<bool> left_out = {};
};

/// Opens a self-describing CSV (plain or .gz) or a recording manifest (.yaml).
/// docs/recordings.md. The header is checked here, the rows while streaming.
Result<std::unique_ptr<SampleSource>> OpenRecording(const std::string& path,
                                                    const OpenRecordingOptions& options = {});

/// Poses that the recording itself states (`poses:` of a manifest); unset if it states none.
Result<std::optional<PoseSelection>> ManifestPoseSelection(const std::string& path);

/// Reads `poses.yaml`: `poses: [ { first, last, id?, face? }, … ]`.
Result<std::vector<PoseRange>> ReadPoseRanges(const std::string& path);

/// Whether the file is a pose table: a self-describing CSV that has sigma or attitude columns, or
/// that has neither a time column nor a `pose` column (which numbers rests of several rows).
Result<bool> IsPoseTable(const std::string& path);

/// A pose table: one row per pose, `accel_x[m/s^2],…`, optional `accel_sigma[m/s^2]` or
/// `accel_sigma_x[…],…` (σ of the row's mean), optional `temperature[degC]`, optional attitude
/// `qw,qx,qy,qz` (world <- body), optional `face` (+x, -x, …), optional `id`.
struct PoseTable {
  PoseSet poses;
  std::vector<InputFile> inputs;
};
Result<PoseTable> ReadPoseTable(const std::string& path);

/// How a recording is written: numbers of decimals, and which files.
struct RecordingFormat {
  /// Used in place of a number of decimals: as many digits as are needed to read back the same
  /// double. This is slower.
  static constexpr int kShortest = -1;
  int time_decimals = 9;  ///< Decimals of times in s; 9 is exact. Range: -1…9.
  PerTriad<int> decimals = {{kShortest, kShortest, kShortest}};  ///< Of readings. Range: -1…15.
  int temperature_decimals = kShortest;
  /// True: one CSV for all triads. False: one CSV per triad. A manifest is written in both cases.
  bool one_file = true;
  std::string comment;  ///< First line of every file, without '#'; empty: none.
};

/// The number that the file states for `value`: `value` rounded to `decimals` decimals (halves away
/// from zero), as the nearest double. `value` itself if `decimals` is kShortest, or if `value` is
/// so large that a double has no such decimals.
double WrittenNumber(double value, int decimals);

/// Streams `source` into files in `directory` that OpenRecording reads back. recording.yaml is a
/// manifest with the serial. If `format.one_file`, recording.csv has a row for each time at which
/// some triad has a sample; fields of triads without a sample are empty. Otherwise there are
/// accelerometer.csv, gyroscope.csv and magnetometer.csv. recording.csv is self-describing and can
/// be opened without the manifest, too. Files are written under temporary names and renamed when
/// all are complete. Returns the manifest's path.
Result<std::string> WriteRecording(SampleSource& source,
                                   const RecordingFormat& format,
                                   const std::string& directory,
                                   const ProgressCallback& progress = {});

/// The text of `poses.yaml`, which ReadPoseRanges (io/recording.h) reads.
std::string PoseRangesToYaml(const std::vector<PoseRange>& ranges);

struct CorrectedLogSummary {
  std::int64_t rows = 0;
  std::int64_t clamped_temperature = 0;  ///< Rows with a temperature outside the calibrated range.
  /// Rows in which a triad is left empty, because its correction needs a temperature or force that
  /// no earlier row states.
  std::int64_t not_corrected = 0;
  std::vector<Triad> left_out;  ///< Triads of the log that the calibration does not have.
  /// Mean length of the written readings, m/s^2, uT, rad/s; zero if none was written.
  PerTriad<double> mean_length{};
};

/// Corrects the readings of `source` by `calibration` and writes them to a self-describing CSV in
/// true units (m/s^2, rad/s, uT). The file is written beside `path` and renamed when complete.
/// There is a row for each time at which some triad has a sample; fields of triads without a sample
/// stay empty. Triads without a calibration are left out (see the summary). Thermal terms are
/// evaluated at the row's temperature, clamped to the calibrated range. If they depend on the rate
/// of the temperature or on a lag, the temperature is filtered row by row (model/thermal.h). Error:
/// no triad can be corrected, the calibration is not usable, a unit does not fit, a temperature
/// column or accelerometer that the calibration needs is missing, a row cannot be read, or `stop`,
/// which is called repeatedly, returned true. After an error no file is left.
Result<CorrectedLogSummary> WriteCorrectedLog(SampleSource& source,
                                              const Calibration& calibration,
                                              const std::string& path,
                                              const ProgressCallback& progress = {},
                                              const std::function<bool()>& stop = {});

}  // namespace truetriad
