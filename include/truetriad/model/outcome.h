// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

namespace truetriad {

/// How a calibration ended. A converged fit need not be observable, and an observable one need not
/// meet its limits.
enum class Outcome {
  kNotCalled,      ///< Nothing was run.
  kConverged,      ///< Usable.
  kNotObservable,  ///< The poses do not determine every parameter that was asked for.
  kNotConverged,   ///< The optimiser gave up, or the fit does not explain the data.
  kNotEnough,      ///< No rests, or fewer poses than parameters.
};
std::string_view OutcomeName(Outcome outcome);  ///< "converged", "not_observable", …
std::optional<Outcome> OutcomeFromName(std::string_view name);

/// The verdict on a unit, at the head of every output about it.
enum class Verdict {
  kPass,      ///< Usable, and every limit is met.
  kNoLimits,  ///< Usable; no limit was set to judge by.
  kFail,      ///< Usable, and a limit is missed.
  kNoResult,  ///< There is no calibration.
};
std::string_view VerdictName(Verdict verdict);   ///< "PASS", "NO_LIMITS", "FAIL", "NO_RESULT".
std::string_view VerdictWords(Verdict verdict);  ///< For readers: "NO RESULT".
std::optional<Verdict> VerdictFromName(std::string_view name);

/// The kind of data from which a unit was calibrated.
enum class Mode {
  kPoses,   ///< Rests, known turns and rates.
  kMotion,  ///< Continuous motion.
  kSweep,   ///< A sweep of temperature.
};
std::string_view ModeName(Mode mode);  ///< "poses", "motion", "sweep".
std::optional<Mode> ModeFromName(std::string_view name);

}  // namespace truetriad
