// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "data/held_samples.h"
#include "truetriad/base/result.h"
#include "truetriad/data/sample_source.h"

namespace truetriad {

/// Merges the samples of several triads into rows, one for each time at which some triad has one.
class MergedRows {
 public:
  struct Stream {
    Triad triad;
    HeldSamples samples = {};  ///< That wait for those of the others.
    std::size_t next = 0;      ///< Of them the first that waits,
    bool is_in_row = false;    ///< which belongs to this row.
    std::size_t waiting() const { return samples.size() - next; }
  };

  void AddStream(Triad triad) { streams_.push_back({triad}); }
  const std::vector<Stream>& streams() const { return streams_; }

  /// Of a triad that has no stream nothing is taken. Only after Next has returned false.
  void Add(const SampleBlock& block);

  /// Goes on to the next row. False: none waits, or samples may still come that belong before it. A
  /// triad that has ended or is silent for long does not make the others wait: the memory is
  /// bounded.
  bool Next(bool at_end);
  std::int64_t time_ns() const { return time_ns_; }

  /// Error: a row came whose time is before that of the one before.
  Status status() const;

 private:
  std::vector<Stream> streams_;
  std::int64_t time_ns_ = std::numeric_limits<std::int64_t>::min();
  bool went_back_ = false;
};

}  // namespace truetriad
