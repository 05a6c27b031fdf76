// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "faults/search.h"

namespace truetriad {

// What a report says about a fault, in parts that it can arrange.
struct FaultWords {
  std::string what;    // "magnetometer: bias step, from pose 12 on"
  std::string size;    // "(0.41, -0.50, 0.30) ± (0.01, 0.01, 0.01) uT"
  std::string chance;  // "by chance alone, 1 of 10^37 fault-free recordings shows as much"
  std::string shift;   // "left uncorrected, it would shift a parameter by up to 25.0 σ"
  // Other errors that explain the readings nearly as well; empty if there are none.
  std::vector<std::string> rivals;
  std::string remedy;

  // All parts except the remedy, as one sentence.
  std::string Statement() const;
};

// `raw_units`: the unit of each sensor's readings.
FaultWords WordsOf(const TakenFault& fault, const PerTriad<std::string>& raw_units);

// "magnetometer: bias step, from pose 12 on".
std::string WordsOf(const FaultPlace& place);
std::string WordsOf(const FaultNote& note);
std::string WordsOf(const LostRowsFound& lost);
// Empty if noise and the accepted faults explain the readings.
std::string WordsOf(const OverallMisfit& misfit);

}  // namespace truetriad
