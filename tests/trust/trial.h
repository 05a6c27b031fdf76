// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/mechanisms.h"
#include "trust/faults.h"

namespace truetriad::trust {

// A fault of a sensor (unset: of the whole recording) in a regime.
struct Kind {
  const Fault* fault = nullptr;  // null: clean
  std::optional<Triad> triad;
  Regime regime = Regime::kHand;

  std::string Name() const;
  // Whether something in a recording shows the fault.
  bool CanBeSeen() const;
};
std::vector<Kind> Kinds();

enum class Verdict {
  kRight,    // usable, every parameter within 5 of its σ
  kRefused,  // not usable (exit 3), or not to be read (exit 2)
  kWrong,    // usable, and some parameter is not; or what had to be refused was not
  kCrashed,
};

// What came of one contaminated recording.
struct Trial {
  std::uint64_t seed = 0;
  Kind kind;
  double severity = 0.0;
  std::string second;  // the other fault, in a quarter of the trials
  Verdict verdict = Verdict::kRight;
  double worst_sigmas = 0.0;
  std::string worst_parameter;
  // Codes of the warnings and refusals about the worst parameter's sensor or none.
  std::vector<std::string> said;
  std::string refusal;        // its code, or an error's text
  bool blames_other = false;  // the refusal names a sensor that nothing befell
  double seconds = 0.0;       // of the processor
  // A usable result has an ignored finding that shifts a parameter by more than its σ.
  bool is_left_standing = false;

  // Of a build that counts mechanisms: which acted, the names of all findings, σ by parameter, and
  // the same recording again without each of those that acted.
  std::vector<Mechanism> acted;
  std::vector<std::string> findings;
  std::map<std::string, double> sigmas;
  std::optional<Mechanism> off;
  std::vector<Trial> without;

  bool IsSilent() const { return verdict == Verdict::kWrong && said.empty(); }
};

// The trial of a seed: its kind is number `seed` of Kinds() in turn, the rest is drawn. Its files
// go to `folder`, and stay there. It is run again without each mechanism that acted and that
// `is_priced`.
Trial RunTrial(std::uint64_t seed,
               const std::vector<Kind>& kinds,
               const std::string& folder,
               const std::function<bool(Mechanism)>& is_priced = nullptr);
// Only writes the trial's files: what RunTrial calibrates, truth.yaml and trial.json.
Status WriteTrial(std::uint64_t seed, const std::vector<Kind>& kinds, const std::string& folder);

}  // namespace truetriad::trust
