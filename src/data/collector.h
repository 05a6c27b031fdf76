// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "data/pose_statistics.h"
#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/finding.h"

namespace truetriad {

class StreamMonitor;

// Chosen: a message names at most ten poses or other places; a number or an ellipsis stands for the
// rest.
inline constexpr std::size_t kMostPlacesNamed = 10;

// Lists names as in "3, 4, 7, …": at most kMostPlacesNamed of `count` names. `name(k)` gives name
// k, from 0.
template <typename Name>
std::string Named(std::size_t count, const Name& name) {
  std::string text;
  for (std::size_t k = 0; k < std::min(count, kMostPlacesNamed); ++k) {
    text += (k == 0 ? "" : ", ") + name(k);
  }
  return text + (count > kMostPlacesNamed ? ", …" : "");
}

// The error of a recording without time: `so` is the consequence, `remedy` one more remedy.
inline Error NoTime(const RecordingInfo& info,
                    const std::string& so,
                    const std::string& remedy = {}) {
  return Error(ErrorCode::kMissingTime,
               {info.path},
               "has no time, so " + so +
                   "; add a time column, or state the rate in a manifest (`time: {unit: samples, "
                   "rate_hz: 100}`)" +
                   remedy);
}

/// Reduces a recording to a PoseSet while it streams by; the kind of pose selection determines the
/// subclass. The StreamMonitors see each block before Add does.
class Collector {
 public:
  virtual ~Collector() = default;

  /// Error: the recording or the selection lacks what this collector needs.
  virtual Status Validate() const = 0;
  /// Takes the blocks that one call of SampleSource::Next gave.
  virtual Status Add(const std::vector<SampleBlock>& blocks) = 0;
  /// Completes `set`, whose streams are filled in already. Error: there is too little data.
  virtual Status Finish(PoseSet* set) = 0;
};

/// Keeps all readings of a unit that never rests.
std::unique_ptr<Collector> MakeMotionCollector(const RecordingInfo& info);

/// A pose and the moments that its covariance is computed from.
struct CollectedPose {
  StaticPose pose;
  PerTriad<TriadPoseMoments> moments;
};

/// Finds the poses of a recording with rests.
class RestFinder {
 public:
  virtual ~RestFinder() = default;

  virtual Status Validate() const = 0;
  virtual Status Add(const std::vector<SampleBlock>& blocks) = 0;
  /// The poses that are complete so far, in order.
  virtual const std::vector<CollectedPose>& poses() const = 0;
  /// Every pose that ends before this time is complete; unset as long as no such time is known.
  virtual std::optional<std::int64_t> judged_before_ns() const = 0;
  /// Returns all poses in order; adds findings.
  virtual Result<std::vector<CollectedPose>> Finish(Findings* findings) = 0;
  /// The error to report if Finish gave no pose.
  virtual Error NoPose(const PoseSet& set) const = 0;
};

/// Collects rests and the gyroscope's readings between them. `monitors` belong to the caller.
std::unique_ptr<Collector> MakeRestCollector(std::unique_ptr<RestFinder> finder,
                                             const PoseSelection& selection,
                                             const RecordingInfo& info,
                                             const PerTriad<StreamMonitor*>& monitors,
                                             Triad leading);

// A joint is where a recording was put together from pieces: the gyroscope does not show the change
// of attitude there, so no turn is integrated across it.

// Sets the fault of each move across a joint, and adds findings. Joints are those in set->joints,
// and those that the readings show.
void BreakMovesAtJoints(PoseSet* set);

// Finds the joints in the readings of a unit that never rests. Adds them to set->joints, and
// reports them.
void FindJointsInMotion(PoseSet* set);

}  // namespace truetriad
