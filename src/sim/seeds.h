// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "math/fast_random.h"
#include "truetriad/base/triad.h"

namespace truetriad {

/// What random numbers of a simulation are for. Each purpose has a sequence of its own, so that
/// switching one source of randomness off leaves the others as they were. The numbers must not
/// change: the bytes of recordings depend on them.
enum class Purpose : std::uint64_t {
  kUnit = 1,  ///< The unit's deviation from the nominal unit.
  kPoseOrder = 2,
  kPoseTilt = 3,
  kRestLength = 4,
  kTravel = 5,
  kTumble = 6,
  kWhiteNoise = 7,
  kBiasInstability = 8,
  kRandomWalk = 9,
  kJitter = 10,
  kDropout = 11,
  kThermometer = 12,
  kAmbient = 13,
  kTurnOn = 14,   ///< The bias of a session.
  kSession = 15,  ///< The seed of a session.
};

/// Random numbers for a unit as a whole.
inline FastRandom UnitRandom(std::uint64_t seed, int unit, Purpose purpose) {
  return FastRandom({seed, static_cast<std::uint64_t>(unit), static_cast<std::uint64_t>(purpose)});
}

/// Random numbers for one triad of a unit.
inline FastRandom TriadRandom(std::uint64_t seed, int unit, Purpose purpose, Triad triad) {
  return FastRandom({seed,
                     static_cast<std::uint64_t>(unit),
                     static_cast<std::uint64_t>(purpose),
                     static_cast<std::uint64_t>(triad)});
}

}  // namespace truetriad
