// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "io/csv_reader.h"
#include "truetriad/data/sample_source.h"

namespace truetriad {

// Follows the time column of a file that was joined from pieces, each with a clock of its own.
// Shifts the times of each piece so that it begins where the previous piece ended.
class ClockPieces {
 public:
  explicit ClockPieces(std::size_t column) : column_(column) {}

  // Processes the rows that `csv` has just read.
  void Follow(const CsvReader& csv, std::size_t row_count);

  // The shift to add to the time of each row of the last Follow; empty if no time is shifted.
  std::span<const std::int64_t> shifts_ns() const { return shifts_ns_; }

  const std::vector<RecordingJoint>& joints() const { return joints_; }

 private:
  bool BeginsAnew(std::int64_t stated_ns) const;

  std::size_t column_;
  std::int64_t shift_ns_ = 0;  // Shift of the present piece.
  std::optional<std::int64_t> last_ns_;
  std::int64_t rows_ = 0;  // Number of rows of the present piece.
  std::int64_t spacing_ns_ = 0;
  std::vector<std::int64_t> shifts_ns_;
  std::vector<RecordingJoint> joints_;
};

}  // namespace truetriad
