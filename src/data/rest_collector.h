// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "data/clock_lags.h"
#include "data/collector.h"
#include "data/known_motions.h"
#include "data/move_recorder.h"
#include "data/stream_checks.h"
#include "truetriad/data/pose_collection.h"

namespace truetriad {

/// Poses, and between them what a gyroscope saw: of detected rests as of those that are given.
class RestCollector : public Collector {
 public:
  /// `monitors` belong to the caller.
  RestCollector(std::unique_ptr<RestFinder> finder,
                const PoseSelection& selection,
                const RecordingInfo& info,
                const PerTriad<StreamMonitor*>& monitors,
                Triad leading);

  Status Validate() const override;
  Status Add(const std::vector<SampleBlock>& blocks) override;
  Status Finish(PoseSet* set) override;

 private:
  std::unique_ptr<RestFinder> finder_;
  PoseSelection selection_;
  PerTriad<StreamMonitor*> monitors_;
  RateMeans rates_;
  bool records_moves_;
  MoveRecorder moves_;
  std::size_t rests_dropped_ = 0;
  bool compares_clocks_;
  ClockLagFinder clock_lags_;
};

}  // namespace truetriad
