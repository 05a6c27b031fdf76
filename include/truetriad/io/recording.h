// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"

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

/// True when the file is a pose table: a self-describing CSV that has sigma or attitude columns, or
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

}  // namespace truetriad
