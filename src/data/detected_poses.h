// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/collector.h"
#include "data/held_samples.h"
#include "data/pose_statistics.h"
#include "data/static_detector.h"
#include "data/stream_checks.h"
#include "data/window_statistics.h"
#include "truetriad/base/result.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"

namespace truetriad {

/// Collects the poses that static detection finds. Memory holds a bounded number of windows.
class DetectedPoses : public RestFinder {
 public:
  /// `monitors` belong to the caller and have seen every block before it comes to Add.
  DetectedPoses(const StaticDetectorOptions& options,
                const RecordingInfo& info,
                const PerTriad<StreamMonitor*>& monitors,
                Triad leading);

  /// Error: the recording has no times, or an option is out of range.
  Status Validate() const override;
  Status Add(const std::vector<SampleBlock>& blocks) override;
  const std::vector<CollectedPose>& poses() const override { return poses_; }
  /// Unset before detection has started.
  std::optional<std::int64_t> judged_before_ns() const override {
    return buffer_ ? std::optional(buffer_->begin_ns()) : std::nullopt;
  }

  Result<std::vector<CollectedPose>> Finish(Findings* findings) override;
  Error NoPose(const PoseSet& set) const override;

  /// The largest number of windows held so far, which bounds the memory.
  std::size_t peak_windows() const { return peak_windows_; }

 private:
  // A block that is kept until the rates of all streams are known.
  struct HeldBlock {
    Triad triad;
    HeldSamples samples;
  };

  Status Start();
  Status AddToBuffer(const SampleBlock& block);
  void FindRests(bool at_end);
  void AddWindows(const Rest& rest, std::size_t begin, std::size_t end);
  void ClosePose();

  StaticDetectorOptions options_;
  RecordingInfo info_;
  PerTriad<StreamMonitor*> monitors_;
  Triad leading_;
  std::vector<HeldBlock> held_;
  std::size_t held_samples_ = 0;
  std::optional<WindowBuffer> buffer_;
  std::optional<StaticDetector> detector_;
  std::size_t consumed_ = 0;  // Number of windows at the buffer's front that are in open_ already.
  PoseAccumulator open_;
  std::vector<CollectedPose> poses_;
  std::size_t peak_windows_ = 0;
};

}  // namespace truetriad
