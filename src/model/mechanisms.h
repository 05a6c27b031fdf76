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
// The first mechanism with the code; kRemark if none has it.
Mechanism MechanismOf(FindingCode code);

#ifdef TRUETRIAD_MECHANISMS
inline constexpr bool kCountsMechanisms = true;
// Asked where a change is applied: `if (condition && Acts(Mechanism::kKnocks))`. False if the
// mechanism is switched off; else records that it acted and is true.
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
