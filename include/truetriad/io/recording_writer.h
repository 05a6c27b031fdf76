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

/// The number of digits of a recording, and its files.
struct RecordingFormat {
  /// In place of a number of digits: as many as read back to the same double, which is slower.
  static constexpr int kShortest = -1;
  int time_decimals = 9;  ///< Of times in s; 9 is exact. Range: -1…9.
  PerTriad<int> decimals = {{kShortest, kShortest, kShortest}};  ///< Of readings. Range: -1…15.
  int temperature_decimals = kShortest;
  /// False: one file per triad, and a manifest.
  bool one_file = true;
  std::string comment;  ///< First line of every file, without '#'; empty: none.
};

/// The number that the file has for `value`: `value` rounded to `decimals` decimals (halves away
/// from zero), as the nearest double. `value` itself for kShortest, and if it is so large that a
/// double does not have such decimals.
double WrittenNumber(double value, int decimals);

/// Streams `source` into files that OpenRecording reads back: `directory`/recording.yaml, a
/// manifest with the serial, and recording.csv, with a row for each time at which some triad has a
/// sample (fields of the others empty), or accelerometer.csv, gyroscope.csv and magnetometer.csv. A
/// single CSV is self-describing and can be opened without the manifest, too. Every file is written
/// beside its name, and all are renamed when all are complete. Returns the manifest's path.
Result<std::string> WriteRecording(SampleSource& source,
                                   const RecordingFormat& format,
                                   const std::string& directory,
                                   const ProgressCallback& progress = {});

/// The text of `poses.yaml`, which ReadPoseRanges (io/recording.h) reads.
std::string PoseRangesToYaml(const std::vector<PoseRange>& ranges);

}  // namespace truetriad
