// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "truetriad/data/sample_source.h"

namespace truetriad {

/// Makes equally spaced readings of a stream: jitter of the time stamps is passed over, a few
/// missing samples are filled by straight lines, longer gaps end the stretch.
///
/// The spacing is that of the first thousand samples. With time stamps so irregular that missing
/// samples cannot be told from late ones, nothing is filled and only long gaps count.
class SpacedStream {
 public:
  using Readings = std::array<std::span<const double>, 3>;
  /// `add` takes readings that follow each other, `end` is called where a stretch ends; `start_ns`
  /// is the time of the first of the readings.
  SpacedStream(std::function<void(const Readings&, std::int64_t start_ns)> add,
               std::function<void()> end)
      : add_(std::move(add)), end_(std::move(end)) {}

  void Add(const SampleBlock& block);
  /// No more samples come.
  void Finish();

  /// That of the first samples, ns: known once readings are handed over.
  double typical_ns() const { return typical_ns_; }
  /// Mean over the stretches, ns; 0 with fewer than two samples in all of them or no time passing.
  double spacing_ns() const;
  std::int64_t samples() const { return samples_; }  ///< With those filled in.
  std::int64_t filled() const { return filled_; }
  std::int64_t breaks() const { return breaks_; }
  bool irregular() const { return irregular_; }

 private:
  void Settle();
  void Process(std::span<const std::int64_t> time_ns, const Readings& readings);
  /// Samples missing before sample i; negative: the stretch ends there.
  std::int64_t MissingBefore(std::span<const std::int64_t> time_ns, std::size_t i) const;
  void Fill(std::int64_t missing, const std::array<double, 3>& next);
  void HandOver(const Readings& readings, std::int64_t start_ns);

  std::function<void(const Readings&, std::int64_t)> add_;
  std::function<void()> end_;
  /// The first samples, until the spacing is known.
  std::vector<std::int64_t> pending_ns_;
  std::array<std::vector<double>, 3> pending_;
  bool settled_ = false;
  double typical_ns_ = 0.0, break_ns_ = 0.0;
  bool irregular_ = false;

  bool started_ = false;
  std::int64_t last_ns_ = 0;
  std::array<double, 3> last_{};
  std::int64_t samples_ = 0, filled_ = 0, breaks_ = 0, intervals_ = 0, span_ns_ = 0;
};

}  // namespace truetriad
