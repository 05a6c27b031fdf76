// SPDX-License-Identifier: Apache-2.0
#include "model/mechanisms.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <iostream>

namespace truetriad {
namespace {

// Each array begins with kMessage, since an array must not be empty; this first entry is skipped
// below.
namespace codes {
using enum FindingCode;
#define MECHANISM(id, name, does, ...) \
  constexpr auto id##Of = std::to_array<FindingCode>({kMessage __VA_OPT__(, ) __VA_ARGS__});
#include "model/mechanisms.def"
#undef MECHANISM
}  // namespace codes

constexpr auto kMechanisms = std::to_array<MechanismInfo>({
#define MECHANISM(id, name, does, ...) \
  {Mechanism::id, name, does, std::span<const FindingCode>(codes::id##Of).subspan(1)},
#include "model/mechanisms.def"
#undef MECHANISM
});

}  // namespace

std::span<const MechanismInfo> Mechanisms() { return kMechanisms; }

std::optional<Mechanism> MechanismFromName(std::string_view name) {
  for (const MechanismInfo& info : kMechanisms) {
    if (info.name == name) return info.mechanism;
  }
  return std::nullopt;
}

Mechanism MechanismOf(FindingCode code) {
  for (const MechanismInfo& info : kMechanisms) {
    if (std::find(info.codes.begin(), info.codes.end(), code) != info.codes.end()) {
      return info.mechanism;
    }
  }
  return Mechanism::kRemark;
}

void DropSwitchedOff(Findings* findings) {
  if constexpr (!kCountsMechanisms) return;
  std::erase_if(*findings, [](const Finding& finding) {
    const Mechanism mechanism = MechanismOf(finding.code);
    return finding.IsRefusal() && mechanism < Mechanism::kNothingToSolve && !Acts(mechanism);
  });
}

#ifdef TRUETRIAD_MECHANISMS
namespace {

using Set = std::array<bool, kMechanisms.size()>;

std::size_t At(Mechanism mechanism) { return static_cast<std::size_t>(mechanism); }

const Set& OffEverywhere() {
  static const Set off = [] {
    Set set{};
    const char* const names = std::getenv("TRUETRIAD_WITHOUT");
    std::string_view left = names == nullptr ? "" : names;
    while (!left.empty()) {
      const std::string_view name = left.substr(0, left.find(','));
      left.remove_prefix(std::min(left.size(), name.size() + 1));
      const auto mechanism = MechanismFromName(name);
      if (!mechanism) {
        std::cerr << "TRUETRIAD_WITHOUT: no mechanism is called " << name << '\n';
        std::exit(1);
      }
      set[At(*mechanism)] = true;
    }
    return set;
  }();
  return off;
}

// Collects the mechanisms that acted in any thread and writes their names when the process ends.
struct Log {
  std::array<std::atomic<bool>, kMechanisms.size()> acted{};

  ~Log() {
    const char* const path = std::getenv("TRUETRIAD_MECHANISMS_LOG");
    if (path == nullptr) return;
    std::ofstream file(path, std::ios::app);
    for (const MechanismInfo& info : kMechanisms) {
      if (acted[At(info.mechanism)]) file << info.name << ' ';
    }
    file << '\n';
  }
};
Log process_log;
thread_local Set acted_here{};
thread_local Set off_here{};

}  // namespace

bool Acts(Mechanism mechanism) {
  const std::size_t at = At(mechanism);
  if (off_here[at] || OffEverywhere()[at]) return false;
  acted_here[at] = true;
  process_log.acted[at] = true;
  return true;
}

std::vector<Mechanism> TakeActed() {
  std::vector<Mechanism> acted;
  for (const MechanismInfo& info : kMechanisms) {
    if (acted_here[At(info.mechanism)]) acted.push_back(info.mechanism);
  }
  acted_here = {};
  return acted;
}

void SwitchMechanism(Mechanism mechanism, bool is_off) { off_here[At(mechanism)] = is_off; }
#else
std::vector<Mechanism> TakeActed() { return {}; }
void SwitchMechanism(Mechanism, bool) {}
#endif

}  // namespace truetriad
