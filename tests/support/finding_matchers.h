// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <gmock/gmock.h>

#include "truetriad/model/finding.h"

namespace truetriad {

// Findings by what programs look for: Contains(HasCode(FindingCode::kClockOffset)).
MATCHER_P(HasCode, code, "has the code " + std::string(FindingCodeName(code))) {
  *result_listener << FindingCodeName(arg.code) << ": " << arg.Message();
  return arg.code == code;
}

MATCHER_P(IsAbout, triad, "is about the " + std::string(TriadName(triad))) {
  return arg.sensor == triad;
}

// By words, where they hold what nothing else does: a line to paste, a place.
MATCHER_P(Says, words, "says " + ::testing::PrintToString(words)) {
  return ::testing::ExplainMatchResult(words, arg.Message(), result_listener);
}

}  // namespace truetriad
