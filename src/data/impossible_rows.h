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

/// No sensor reads this much in any unit. Squares of smaller values, up to 1e60, fit into a double.
inline constexpr double kNoSensorReads = 1e30;

/// Removes error words from one stream: rows that a driver or a bus writes in place of a reading.
class RowScreen {
 public:
  explicit RowScreen(Triad triad) : triad_(triad) {}

  /// True if the next block has no suspected word and no row is held back. The caller then calls
  /// Accept and uses the block as it is. Otherwise the caller calls Hold, then Judge.
  bool IsClean(const SampleBlock& block);
  void Accept(const SampleBlock& block);
  /// Copies the block into the rows that are held back.
  void Hold(const SampleBlock& block) { rows_.Append(block); }
  /// Judges the held rows as far as possible; `at_end`: all rows. Returns the judged rows without
  /// error words; they stay valid until the next call.
  SampleBlock Judge(bool at_end);
  bool is_empty() const { return rows_.size() == handed_; }

  /// Reports how many rows were left out, and why; unset if none was.
  std::optional<Finding> Left() const;

 private:
  /// Why a row is no reading.
  enum Kind : std::size_t { kZero, kWord, kKinds };
  void WatchSteps(const SampleBlock& block);
  bool MayHaveSuspects(const SampleBlock& block) const;
  bool IsSuspect(const Eigen::Vector3d& reading, const Eigen::Vector3d& before) const;
  void Remember(const Eigen::Vector3d& reading);
  std::vector<Eigen::Vector3d> ReadingsAbout(std::size_t begin, bool* is_enough) const;
  bool IsCoarseRest(std::size_t begin, std::size_t end) const;
  bool LeaveOut(const Eigen::Vector3d& reading, std::int64_t row);

  Triad triad_;
  HeldSamples rows_;                      // Rows handed over last, then rows held back.
  std::size_t handed_ = 0;                // Number of rows in rows_ that were handed over.
  std::vector<Eigen::Vector3d> history_;  // The last readings that were kept.
  // Per axis: smallest change between neighbouring rows above rounding, and largest reading.
  Eigen::Vector3d step_ = Eigen::Vector3d::Constant(1e300);
  Eigen::Vector3d largest_ = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> last_;  // Last reading of the last block.
  std::int64_t rows_seen_ = 0;
  std::array<std::int64_t, kKinds> left_{};
  std::int64_t first_row_ = -1;
  Eigen::Vector3d example_ = Eigen::Vector3d::Zero();
};

/// The screens of all streams of a recording.
class ImpossibleRows {
 public:
  /// Removes error words from `blocks`, which stay valid until the next call.
  void Apply(std::vector<SampleBlock>* blocks);
  /// At the end of the recording: replaces `blocks` by the rows that were held back, without error
  /// words.
  void Flush(std::vector<SampleBlock>* blocks);
  Findings Left() const;

 private:
  PerTriad<RowScreen> screens_ = {{RowScreen(Triad::kAccelerometer),
                                   RowScreen(Triad::kGyroscope),
                                   RowScreen(Triad::kMagnetometer)}};
};

}  // namespace truetriad
