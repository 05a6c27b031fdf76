// SPDX-License-Identifier: Apache-2.0
//
// A scenario. None is simulated: how long it takes is up to what it says.
#include "fuzz/fuzz_target.h"
#include "truetriad/config/experiment.h"

using namespace truetriad;  // NOLINT: of this source alone.

namespace {

/// What `base: base.yaml` names.
constexpr const char* kBase = R"(scenario: 1
world: { gravity_mps2: 9.8, field: { strength_ut: 48, dip_deg: 62 } }
sensors:
  accelerometer: { bias_mps2: [0.1, 0.2, 0.3], noise: { velocity_random_walk_mps_rth: 0.03 }, sampling: { rate_hz: 100 } }
  gyroscope: { noise: { angle_random_walk_deg_rth: 0.25 }, sampling: { rate_hz: 100 } }
  magnetometer: { noise: { sample_sigma_ut: 0.2 }, sampling: { rate_hz: 100 } }
motion: [ { poses: { attitudes: six_face, rest_s: 20, move_s: 2 } } ]
)";

}  // namespace

TRUETRIAD_FUZZ_TARGET(scenario) {
  static const std::string base = fuzz::WriteInput("base.yaml", kBase);
  const Result<Scenario> scenario =
      ReadScenario(fuzz::WriteInput("scenario.yaml", fuzz::TextOf(input)));
  if (!scenario) fuzz::MustSay(scenario.error());
  return 0;
}
