// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/triad.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/model/finding.h"

namespace truetriad {

// Rows that are an earlier stretch of rows once more.
struct RepeatedStretch {
  std::int64_t first_row = 0, last_row = 0;  // both included
  std::int64_t first_ns = 0, last_ns = 0;
  std::int64_t of_row = 0;  // the row that first_row repeats
};

// Finds where one triad's readings repeat an earlier stretch to the last digit, all axes at once,
// for so long that noise does not do it.
//
// Only readings that differ from the one before count, so that a sensor that is read faster than it
// measures, is stuck, or has steps coarser than its noise repeats nothing. Memory: 16 bytes a row,
// and a bound.
class RepeatFinder {
 public:
  // Looks at the block's readings; the stretches [begin, end) of it that repeat others. The first
  // rows of a repetition are missing where they came with the block before.
  std::vector<std::pair<std::size_t, std::size_t>> Repeats(const SampleBlock& block);

  const std::vector<RepeatedStretch>& stretches() const { return stretches_; }

 private:
  // As many readings in a row must be equal to earlier ones.
  static constexpr std::size_t kRun = 32;

  void Remember(const Eigen::Vector3d& reading, std::uint64_t hash, std::int64_t row);
  // The last reading of an earlier run that is equal to the last kRun readings, if they are noise.
  std::optional<std::size_t> EarlierRun();
  bool IsNoise() const;
  // Forgets the readings that repeat others up to number `source`; returns the row of their first.
  std::int64_t BeginRepeat(std::size_t source);

  // Of readings that differ from the one before: 0, 1, ….
  std::vector<std::uint64_t> hashes_;
  std::vector<std::int64_t> rows_;
  std::unordered_map<std::uint64_t, std::size_t> runs_;  // The last reading of runs, by their hash.
  std::uint64_t run_hash_ = 0;
  std::vector<Eigen::Vector3d> run_;  // The last readings: kRun of them, or fewer after a repeat.
  std::size_t run_begin_ = 0;         // of the ring run_
  std::optional<Eigen::Vector3d> last_;
  std::optional<std::size_t> source_;  // While a repeat lasts: what its last reading is equal to.
  std::vector<RepeatedStretch> stretches_;
};

// Takes out of a stream of readings what repeats an earlier stretch.
class RepeatedRows {
 public:
  // Leaves the pieces of the blocks that count, in order.
  void Apply(std::vector<SampleBlock>* blocks);

  const std::vector<RepeatedStretch>& StretchesOf(Triad triad) const {
    return finders_[triad].stretches();
  }

  // In order of time; of triads that repeat the same, once.
  std::vector<RepeatedStretch> Stretches() const;

 private:
  PerTriad<RepeatFinder> finders_;
};

// What people should know; times are stated from `origin_ns` on.
Findings FindingsOf(const std::vector<RepeatedStretch>& stretches, std::int64_t origin_ns);

}  // namespace truetriad
