// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "faults/search.h"

namespace truetriad {

// Statements about a fault, in parts for a report to arrange.
struct FaultWords {
  std::string what;    // "magnetometer: bias step, from pose 12 on"
  std::string size;    // "(0.41, -0.50, 0.30) ± (0.01, 0.01, 0.01) uT"
  std::string chance;  // "by chance alone, 1 of 10^37 fault-free recordings shows as much"
  std::string shift;   // "left uncorrected, it would shift a parameter by up to 25.0 σ"
  // Empty if nothing else explains the readings nearly as well.
  std::vector<std::string> rivals;
  std::string remedy;

  // All parts except the remedy, as one sentence.
  std::string Statement() const;
};

// `raw_units`: of each sensor's readings.
FaultWords WordsOf(const TakenFault& fault, const PerTriad<std::string>& raw_units);

// "magnetometer: bias step, from pose 12 on".
std::string WordsOf(const FaultPlace& place);
std::string WordsOf(const FaultNote& note);
std::string WordsOf(const LostRowsFound& lost);
// Empty if the readings are explained.
std::string WordsOf(const OverallMisfit& misfit);

}  // namespace truetriad
