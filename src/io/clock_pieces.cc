// SPDX-License-Identifier: Apache-2.0
#include "io/clock_pieces.h"

#include <algorithm>
#include <string>

#include "base/messages.h"

namespace truetriad {
namespace {

// Chosen: a piece has at least this many rows, and at its end time goes back by more than this many
// intervals. If rows are out of order, the time goes back by less, or goes back again after fewer
// rows. The reader refuses such rows.
constexpr std::int64_t kFewestRows = 20;

}  // namespace

// Times here are as stated in the file, without shifts.
bool ClockPieces::BeginsAnew(std::int64_t stated_ns) const {
  const std::int64_t back_ns = *last_ns_ - stated_ns;
  if (rows_ < kFewestRows || back_ns <= 0 || (back_ns - 1) / kFewestRows < spacing_ns_)
    return false;
  // If shifted times would exceed kFarthestTime, the times are not shifted, and the reader refuses
  // the file.
  return back_ns <= CsvReader::kFarthestTime - shift_ns_ - spacing_ns_;
}

void ClockPieces::Follow(const CsvReader& csv, std::size_t row_count) {
  const std::int64_t* const stated_ns = csv.Times(column_);
  shifts_ns_.assign(shift_ns_ == 0 ? 0 : row_count, shift_ns_);
  for (std::size_t row = 0; row < row_count; ++row) {
    const std::int64_t time_ns = stated_ns[row];
    if (time_ns == CsvReader::kMissingTime) continue;
    if (last_ns_ && BeginsAnew(time_ns)) {
      const std::int64_t back_ns = *last_ns_ - time_ns;
      shift_ns_ += back_ns + spacing_ns_;
      shifts_ns_.resize(row, 0);
      shifts_ns_.resize(row_count, shift_ns_);
      rows_ = 0;
      joints_.push_back(
          {time_ns + shift_ns_,
           csv.Rows()[row],
           Format("the time goes back by %.6g s", 1e-9 * static_cast<double>(back_ns)),
           /*is_told=*/false});
    } else if (last_ns_ && time_ns > *last_ns_) {
      spacing_ns_ = time_ns - *last_ns_;
    }
    last_ns_ = time_ns;
    ++rows_;
  }
}

}  // namespace truetriad
