// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "truetriad/base/triad.h"
#include "truetriad/io/recording.h"

namespace truetriad {

/// All samples of one triad, copied out of the blocks.
struct StreamSamples {
  std::vector<std::int64_t> time_ns, row;
  std::vector<double> x, y, z, temperature_degc;
  std::vector<std::int32_t> pose;
};

/// A recording read to its end.
struct RecordingSamples {
  RecordingInfo info;
  PerTriad<StreamSamples> streams;
  PerTriad<StreamCounts> counts;
  std::vector<InputFile> inputs;
};

inline Result<RecordingSamples> ReadRecording(const std::string& path,
                                              const OpenRecordingOptions& options = {}) {
  const Result<std::unique_ptr<SampleSource>> source = OpenRecording(path, options);
  TRUETRIAD_RETURN_IF_ERROR(source);
  RecordingSamples recording;
  recording.info = (*source)->info();
  std::vector<SampleBlock> blocks;
  for (;;) {
    const Result<bool> more = (*source)->Next(&blocks);
    TRUETRIAD_RETURN_IF_ERROR(more);
    if (!*more) break;
    const auto append = [](auto span, auto* vector) {
      vector->insert(vector->end(), span.begin(), span.end());
    };
    for (const SampleBlock& block : blocks) {
      StreamSamples& stream = recording.streams[block.triad];
      append(block.time_ns, &stream.time_ns);
      append(block.row, &stream.row);
      append(block.x, &stream.x);
      append(block.y, &stream.y);
      append(block.z, &stream.z);
      append(block.temperature_degc, &stream.temperature_degc);
      append(block.pose, &stream.pose);
    }
  }
  for (const Triad triad : kTriads) recording.counts[triad] = (*source)->counts(triad);
  recording.inputs = (*source)->inputs();
  return recording;
}

/// The error that reading gives; empty when there is none.
inline std::string ReadingError(const std::string& path, const OpenRecordingOptions& options = {}) {
  const Result<RecordingSamples> recording = ReadRecording(path, options);
  return recording ? "" : recording.error().message;
}

}  // namespace truetriad
