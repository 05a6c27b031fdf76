// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>

#include <gmock/gmock.h>

#include "truetriad/model/finding.h"

namespace truetriad {

inline void PrintTo(const Finding& finding, std::ostream* out) {
  *out << FindingCodeName(finding.code) << ": " << finding.Message();
}

// Match findings by what programs look for: Contains(HasCode(FindingCode::kClockOffset)).
MATCHER_P(HasCode, code, "has the code " + std::string(FindingCodeName(code))) {
  return arg.code == code;
}

MATCHER_P(IsAbout, triad, "is about the " + std::string(TriadName(triad))) {
  return arg.sensor == triad;
}

// Matches findings by words that no other finding has: a line to paste, a place.
MATCHER_P(Says, words, "says what is looked for") {
  return ::testing::ExplainMatchResult(words, arg.Message(), result_listener);
}

}  // namespace truetriad
