// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"

namespace truetriad {

/// How a recording is written: numbers of decimals, and which files.
struct RecordingFormat {
  /// In place of a number of decimals: as many digits as read back to the same double. Slower.
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

}  // namespace truetriad
