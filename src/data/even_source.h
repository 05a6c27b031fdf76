// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "data/held_samples.h"
#include "data/time_stamps.h"
#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/finding.h"

namespace truetriad {

/// Removes readings with times in excluded ranges from a stream.
class ExcludedTime {
 public:
  explicit ExcludedTime(const std::vector<ExcludedRange>& ranges);

  /// Replaces the blocks by their pieces outside of the ranges, in order.
  void Apply(std::vector<SampleBlock>* blocks);

  /// The ranges, clipped to the recording's first and last reading.
  std::vector<TimeRange> Left() const;

  /// Reports how much was left out. Error (bad input): a range without any reading.
  Status Tell(const RecordingInfo& info, Findings* findings) const;

 private:
  std::vector<ExcludedRange> ranges_;
  std::vector<std::int64_t> readings_;  // Number of readings left out by each range.
  // First and last time of all readings, left out or not.
  std::int64_t first_ns_ = std::numeric_limits<std::int64_t>::max();
  std::int64_t last_ns_ = std::numeric_limits<std::int64_t>::min();
};

/// Gives the readings that are not excluded. If stamps scatter about even times, their readings get
/// the even times.
///
/// Blocks pass through while all stamps are even enough. From the first block with uneven stamps
/// on, the samples of all streams are held back, kMostHeldSamples at most, until their stamps have
/// been judged. The judgement of a stream is final.
class EvenSource {
 public:
  /// `source` and `excluded` belong to the caller.
  EvenSource(SampleSource* source, ExcludedTime* excluded, TimeStamps how)
      : source_(source), excluded_(excluded), how_(how) {}

  /// Works as SampleSource::Next does.
  Result<bool> Next(std::vector<SampleBlock>* blocks);

  /// Fills in the kind and the jitter of the stream's stamps; adds a finding if they are uneven.
  void Describe(StreamSummary* summary, Findings* findings) const;

 private:
  enum class Judgement { kOpen, kAsStamped, kEven };
  /// What the stamps of a stream show. Sensors with the same stamps have the same Clock.
  struct Clock {
    bool looks_even = true;
    Judgement judgement = Judgement::kOpen;
    StampKind kind = StampKind::kRegular;
    bool are_true = false;                   // The readings show that the stamps are true.
    double squares_ns2 = 0.0, judged = 0.0;  // Sum of (stamp − even time)²; number of terms.
    std::vector<std::int64_t> even_ns;       // Times of held samples; empty: stamps are used.
  };
  struct Stream {
    StampWatch watch;
    Clock clock;
    HeldSamples held;
    std::size_t handed = 0;  // Number of held samples handed over already.
    std::size_t ready = 0;   // Number of held samples that may be handed over.
    // Time of the last sample handed over.
    std::int64_t last_ns = std::numeric_limits<std::int64_t>::min();

    std::size_t waiting() const { return held.size() - handed; }
    std::span<const std::int64_t> times_ns() const {
      return clock.even_ns.empty() ? held.time_ns : clock.even_ns;
    }
    bool SharesStampsWith(const Stream& other) const {
      return handed == other.handed && held.time_ns == other.held.time_ns &&
             held.row == other.held.row && clock.looks_even == other.clock.looks_even;
    }
  };

  /// Number of samples in one FIFO window, which share a stamp; 1: each sample has its own.
  std::int64_t WindowOf(Triad triad) const;
  bool MustHold(const std::vector<SampleBlock>& blocks);
  void Settle(bool at_end);
  StampShare ShareOf(std::span<const std::int64_t> stamps_ns, double period_ns) const;
  bool Judge(Triad triad);
  bool HandOver(std::vector<SampleBlock>* blocks);

  SampleSource* source_;
  ExcludedTime* excluded_;
  TimeStamps how_;
  PerTriad<Stream> streams_;
  bool holds_ = false, at_end_ = false;
};

}  // namespace truetriad
