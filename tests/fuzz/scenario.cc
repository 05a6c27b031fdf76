// SPDX-License-Identifier: Apache-2.0
//
// A scenario. None is simulated: how long it takes is up to what it says.
#include "fuzz/fuzz_target.h"
#include "truetriad/config/scenario.h"

using namespace truetriad;  // NOLINT: of this source alone.

TRUETRIAD_FUZZ_TARGET(scenario) {
  const Result<Scenario> scenario =
      ReadScenario(fuzz::WriteInput("scenario.yaml", fuzz::TextOf(input)));
  if (!scenario) fuzz::MustSay(scenario.error());
  return 0;
}
