// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/tags.h"

namespace truetriad {

/// A place where a recording was joined from pieces, so that no turn may be integrated across it.
struct RecordingJoint {
  std::int64_t time_ns = 0;  ///< Time of the first reading after the joint.
  std::int64_t row = 0;      ///< Data row of that reading.
  std::string seen;          ///< The evidence for the joint, in words.
  bool is_told = false;      ///< Whether a finding already reports the joint.
};

/// What is known of one triad of a recording before any row is read.
struct StreamInfo {
  Triad triad = Triad::kAccelerometer;
  Unit unit;
  std::string file;                    ///< Path of the file with this triad, as the user gave it.
  std::optional<double> si_per_count;  ///< SI units per count; unset if not stated.
  bool has_temperature = false;
  bool has_ambient = false;  ///< Whether there is a second thermometer, outside of the unit.
  bool has_pose_column = false;
  /// Rows are read together in groups of this size, counted from the first row. Only the last row
  /// of a group has its own time stamp; the stamps of the other rows are computed by spacing them
  /// evenly up to that time.
  std::int64_t window_samples = 1;
};

/// Properties of a recording as a whole.
struct RecordingInfo {
  std::string path;                 ///< The CSV or manifest that was opened.
  std::string serial;               ///< Empty when not given.
  Tags tags;                        ///< What the manifest states about the unit and the run.
  bool has_time = true;             ///< False: rows only; time_ns then counts rows.
  std::vector<StreamInfo> streams;  ///< At most one per triad.
  std::vector<std::string>
      ignored_columns;  ///< Columns with neither a reading, a time, a temperature nor a pose.
  const StreamInfo* Find(Triad triad) const {
    for (const StreamInfo& stream : streams) {
      if (stream.triad == triad) return &stream;
    }
    return nullptr;
  }
};

/// A run of consecutive samples of one triad. The spans stay valid until the source's next call.
/// Readings are in the stream's raw unit; rows with an empty or NaN field have been dropped.
struct SampleBlock {
  Triad triad = Triad::kAccelerometer;
  std::span<const std::int64_t> time_ns;
  std::span<const double> x, y, z;
  std::span<const double> temperature_degc;  ///< Empty, or as long as x; NaN while unknown.
  std::span<const std::int32_t> pose;        ///< Empty, or as long as x; 0 = moving.
  std::span<const std::int64_t> row;         ///< 0-based data row in the stream's file.
  /// Ambient temperature, NaN while it is not known yet; empty unless the source was asked to read
  /// it.
  std::span<const double> ambient_degc{};
};

/// Counts of a stream's rows; complete once Next has returned false.
struct StreamCounts {
  std::int64_t samples = 0;        ///< Number of samples that Next gave.
  std::int64_t dropped_empty = 0;  ///< Rows with an empty or NaN field.
};

/// Samples of all triads of one recording, streamed with bounded memory.
class SampleSource {
 public:
  virtual ~SampleSource() = default;
  virtual const RecordingInfo& info() const = 0;

  /// Clears `blocks` and fills it with the next samples. The blocks of a triad come in order of
  /// time; equal times are allowed. If there are several files, the one with the earliest unread
  /// time is read next, so that the times of the streams differ by at most one block. Returns false
  /// at the end, with `blocks` empty.
  virtual Result<bool> Next(std::vector<SampleBlock>* blocks) = 0;

  /// Share of the input already read, 0…1, for progress.
  virtual double progress() const = 0;

  virtual StreamCounts counts(Triad triad) const = 0;

  /// The places at which times restarted; the times after such a place were shifted so that they
  /// continue. Complete once Next has returned false.
  virtual std::vector<RecordingJoint> joints() const { return {}; }

  /// Files with hash and sample count; complete once Next has returned false.
  virtual std::vector<InputFile> inputs() const = 0;
};

}  // namespace truetriad
