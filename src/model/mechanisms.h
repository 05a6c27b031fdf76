// SPDX-License-Identifier: Apache-2.0
//
// What each mechanism is worth: a build with TRUETRIAD_MECHANISMS counts in which runs each one
// changed anything, and can run without it. In any other build Acts() is true and compiled away.
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
// They stand in the order of Mechanism.
std::span<const MechanismInfo> Mechanisms();
std::optional<Mechanism> MechanismFromName(std::string_view name);
// The first that has the code; kRemark where none has.
Mechanism MechanismOf(FindingCode code);

#ifdef TRUETRIAD_MECHANISMS
inline constexpr bool kCountsMechanisms = true;
// Stands where a change is applied, `if (condition && Acts(Mechanism::kKnocks))`, and counts it;
// false where the mechanism is switched off.
bool Acts(Mechanism mechanism);
#else
inline constexpr bool kCountsMechanisms = false;
constexpr bool Acts(Mechanism) { return true; }
#endif

// Those that acted in this thread since the last call, in their order.
std::vector<Mechanism> TakeActed();
// Of this thread; the environment's TRUETRIAD_WITHOUT=NAME[,NAME] is of all. What acted in a
// process is appended to the file TRUETRIAD_MECHANISMS_LOG, a line of names for each process.
void SwitchMechanism(Mechanism mechanism, bool is_off);

// Takes out refusals whose mechanism is switched off.
void DropSwitchedOff(Findings* findings);

}  // namespace truetriad
