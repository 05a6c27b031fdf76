// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "data/held_samples.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/model/finding.h"

namespace truetriad {

/// No sensor reads as much, in any unit; squares of larger numbers leave the range of a double.
inline constexpr double kNoSensorReads = 1e30;

/// Leaves out of one stream the rows that are no readings: words that a driver or a bus puts in
/// place of one.
class RowScreen {
 public:
  explicit RowScreen(Triad triad) : triad_(triad) {}

  /// Whether the next block has no such word and nothing is held back: then it can be used as it
  /// is, and is accepted.
  bool IsClean(const SampleBlock& block);
  void Accept(const SampleBlock& block);
  /// Takes the block over.
  void Hold(const SampleBlock& block) { rows_.Append(block); }
  /// What can be judged of what is held, or at the end all of it; it stays until the next call.
  SampleBlock Judge(bool at_end);
  bool is_empty() const { return rows_.size() == handed_; }

  /// How many rows were left out, and why; none: nothing.
  std::optional<Finding> Left() const;

 private:
  /// Why a row is none.
  enum Kind : std::size_t { kZero, kWord, kAbsurd, kKinds };
  void WatchSteps(const SampleBlock& block);
  bool MayHaveSuspects(const SampleBlock& block) const;
  bool IsSuspect(const Eigen::Vector3d& reading, const Eigen::Vector3d& before) const;
  void Remember(const Eigen::Vector3d& reading);
  std::vector<Eigen::Vector3d> ReadingsAbout(std::size_t begin, bool* is_enough) const;
  bool IsCoarseRest(std::size_t begin, std::size_t end) const;
  bool LeaveOut(const Eigen::Vector3d& reading, std::int64_t row);

  Triad triad_;
  HeldSamples rows_;                      // Handed over last, then what is held back.
  std::size_t handed_ = 0;                // Of rows_.
  std::vector<Eigen::Vector3d> history_;  // The last ones that were kept.
  // Of neighbouring rows, the smallest difference that is none of rounding; the largest reading.
  Eigen::Vector3d step_ = Eigen::Vector3d::Constant(1e300);
  Eigen::Vector3d largest_ = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> last_;  // Reading of the last block.
  std::int64_t rows_seen_ = 0;
  std::array<std::int64_t, kKinds> left_{};
  std::int64_t first_row_ = -1;
  Eigen::Vector3d example_ = Eigen::Vector3d::Zero();
};

/// That of all streams of a recording.
class ImpossibleRows {
 public:
  /// Takes them out of `blocks`; what is left stays until the next call.
  void Apply(std::vector<SampleBlock>* blocks);
  /// At the end: what was held back.
  void Flush(std::vector<SampleBlock>* blocks);
  Findings Left() const;

 private:
  PerTriad<RowScreen> screens_ = {{RowScreen(Triad::kAccelerometer),
                                   RowScreen(Triad::kGyroscope),
                                   RowScreen(Triad::kMagnetometer)}};
};

}  // namespace truetriad
