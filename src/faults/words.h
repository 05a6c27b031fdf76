// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "faults/search.h"

namespace truetriad {

// What is said of a fault, in parts that a report may set as it likes.
struct FaultWords {
  std::string what;    // "magnetometer: bias step, from pose 12 on"
  std::string size;    // "(0.41, -0.50, 0.30) ± (0.01, 0.01, 0.01) uT"
  std::string chance;  // "chance makes as much in one of 10^37 recordings"
  std::string shift;   // "left in, it would move a parameter by 25 of its σ"
  // Empty: nothing else explains it nearly as well.
  std::vector<std::string> rivals;
  std::string remedy;

  // All of it but the remedy: what was seen, and where.
  std::string Statement() const;
};

// `raw_units`: of each sensor's readings.
FaultWords WordsOf(const TakenFault& fault, const PerTriad<std::string>& raw_units);

// "magnetometer: bias step, from pose 12 on".
std::string WordsOf(const FaultPlace& place);
std::string WordsOf(const FaultNote& note);
std::string WordsOf(const LostRowsFound& lost);
// Empty where the readings are explained.
std::string WordsOf(const OverallMisfit& misfit);

}  // namespace truetriad
