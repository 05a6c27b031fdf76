// SPDX-License-Identifier: Apache-2.0
//
// Measures the effect of each mechanism: a build with TRUETRIAD_MECHANISMS records which mechanisms
// changed anything in a run, and can switch each of them off. In other builds Acts() is true at
// compile time.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "truetriad/model/finding.h"

namespace truetriad {

enum class Mechanism {
#define MECHANISM(id, ...) id,
#include "model/mechanisms.def"
#undef MECHANISM
};

struct MechanismInfo {
  Mechanism mechanism;
  std::string_view name;
  std::string_view does;
  std::span<const FindingCode> codes;
};
// All mechanisms, in the order of Mechanism.
std::span<const MechanismInfo> Mechanisms();
std::optional<Mechanism> MechanismFromName(std::string_view name);
// The first mechanism whose row lists the code; kRemark if no row lists it.
Mechanism MechanismOf(FindingCode code);

#ifdef TRUETRIAD_MECHANISMS
inline constexpr bool kCountsMechanisms = true;
// Called where a mechanism is about to change something: `if (condition &&
// Acts(Mechanism::kKnocks))`. Returns false if the mechanism is switched off. Otherwise records
// that the mechanism acted and returns true.
bool Acts(Mechanism mechanism);
#else
inline constexpr bool kCountsMechanisms = false;
constexpr bool Acts(Mechanism) { return true; }
#endif

// The mechanisms that acted in this thread since the last call, in the order of Mechanism.
std::vector<Mechanism> TakeActed();
// Switches a mechanism off or on for this thread; the environment variable
// TRUETRIAD_WITHOUT=NAME[,NAME] switches mechanisms off for all threads. When a process ends, it
// appends a line with the names of the mechanisms that acted to the file TRUETRIAD_MECHANISMS_LOG.
void SwitchMechanism(Mechanism mechanism, bool is_off);

// Removes refusals whose mechanism is switched off.
void DropSwitchedOff(Findings* findings);

}  // namespace truetriad
