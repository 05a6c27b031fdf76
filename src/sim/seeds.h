// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "math/fast_random.h"
#include "truetriad/base/triad.h"

namespace truetriad {

/// What random numbers of a simulation are for. Each has a sequence of its own, so that switching
/// one source of randomness off leaves the others as they were. Part of the product: the numbers
/// behind the names decide the bytes of recordings.
enum class Purpose : std::uint64_t {
  kUnit = 1,  ///< The unit's deviation from the nominal one.
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

/// For what concerns a unit as a whole.
inline FastRandom UnitRandom(std::uint64_t seed, int unit, Purpose purpose) {
  return FastRandom({seed, static_cast<std::uint64_t>(unit), static_cast<std::uint64_t>(purpose)});
}

/// For what concerns one of its triads.
inline FastRandom TriadRandom(std::uint64_t seed, int unit, Purpose purpose, Triad triad) {
  return FastRandom({seed,
                     static_cast<std::uint64_t>(unit),
                     static_cast<std::uint64_t>(purpose),
                     static_cast<std::uint64_t>(triad)});
}

}  // namespace truetriad
