// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "math/random.h"
#include "truetriad/sim/scenario.h"
#include "trust/recording.h"

namespace truetriad::trust {

// How a unit is recorded and calibrated.
enum class Regime {
  kHand,           // nine axes, rests by hand and the turns between them
  kAccelerometer,  // the accelerometer of such a recording alone
  kRows,           // a magnetometer that is turned about, every row a direction
  kMotion,         // nine axes, tumbled without rests
  kFaces,          // an accelerometer on the six faces of a block
  kAttitudes,      // accelerometer and magnetometer at attitudes from a table
  kRates,          // a gyroscope on a rate table
};
inline constexpr Regime kRegimes[] = {Regime::kHand,
                                      Regime::kAccelerometer,
                                      Regime::kRows,
                                      Regime::kMotion,
                                      Regime::kFaces,
                                      Regime::kAttitudes,
                                      Regime::kRates};
std::string_view RegimeName(Regime regime);
// The sensors that are calibrated.
std::vector<Triad> SensorsOf(Regime regime);

// What a trustworthy program does with a recording that has a fault.
enum class Expected {
  kEither,   // is right, or refuses
  kRefusal,  // the recording contradicts what was stated: it must be refused
  kUnseen,   // nothing in a recording can show it
};

// How a fault befalls one recording.
struct Strike {
  Triad triad = Triad::kAccelerometer;  // that it befalls
  double severity = 0.0;
  Random* random = nullptr;
};

struct Fault {
  std::string_view name;
  double least = 0.0, most = 0.0;  // Severity, drawn evenly over its logarithm.
  std::vector<Triad> triads;       // that it may befall; empty: the recording as a whole
  std::vector<Regime> regimes;     // empty: all
  Expected expected = Expected::kEither;
  void (*before)(const Strike&, Scenario*) = nullptr;
  void (*after)(const Strike&, Recording*) = nullptr;
  std::vector<Regime> unseen = {};  // regimes in which nothing shows the fault
};
// In the order in which they strike a recording: the unit, its surroundings, its firmware, the log.
std::span<const Fault> Faults();

}  // namespace truetriad::trust
