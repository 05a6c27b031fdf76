// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"

namespace truetriad {

/// How a calibration ended. A fit that converged need not determine all parameters, and a fit that
/// does need not meet its limits.
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

/// The severity of a finding.
enum class Severity {
  kNote,     ///< For information only; nothing has to be done.
  kWarning,  ///< The result may be worse than it looks.
  kRefusal,  ///< The result cannot be used.
};
std::string_view SeverityName(Severity severity);  ///< "note", "warning", "refusal".
std::optional<Severity> SeverityFromName(std::string_view name);

/// What was done about the effect of a finding on the parameters.
enum class Treatment {
  kNone,       ///< Nothing: there is no known effect, or the effect was neither corrected nor
               ///< included in σ.
  kCorrected,  ///< The effect was subtracted.
  kWidened,    ///< The σ include the effect.
};
std::string_view TreatmentName(Treatment treatment);  ///< "none", "corrected", "widened".
std::optional<Treatment> TreatmentFromName(std::string_view name);

/// The kind of a finding, for programs. FindingKindOf has the code's name in files, which never
/// changes, and the meaning; docs/reasons.md lists all.
enum class FindingCode : int {
  kMessage,
  // The recording.
  kNoReadings,
  kColumnsIgnored,
  kExcluded,
  kEvenTimes,
  kUnevenTimes,
  kTimeGaps,
  kEqualTimes,
  kConstantAxis,
  kRepeatedAxis,
  kStuckReadings,
  kImpossibleRows,
  kClippedPoses,
  kRepeatedRows,
  kJoinedRecording,
  kRowsLeftOver,
  kMovingReadings,
  kClockLag,
  kNoRest,
  kNoPose,
  kTurnGap,
  kTurnSaturated,
  kTurnTooLong,
  kTurnAtKnownRate,
  kTurnCut,
  kWrongUnit,
  kTooSlow,
  kNotRaw,
  // The temperature of a sweep's recording.
  kTemperatureMissing,
  kTemperatureRangeTooSmall,
  kSlowThermometer,
  kWindowsLengthened,
  kReadingsLeftOut,
  kUnitTurned,
  kTooFewWindows,
  // Start values.
  kTooFewPoses,
  kNoKnownMotion,
  kTooFewDirections,
  kNotAnEllipsoid,
  kMissingFaces,
  kFixtureUndetermined,
  kTurnAxesMissing,
  kTurnsUnexplained,
  kAlignmentUndetermined,
  kHeldGyroscope,
  kStartValuesOnly,
  // The fit.
  kSolverFailed,
  kDidNotConverge,
  kNonFinite,
  kNotDetermined,
  kNoUncertainty,
  kRowsFollowEachOther,
  kUnexplainedReadings,
  kTemperatureIgnored,
  kTooManyOutliers,
  kRejectedPoses,
  kFault,
  kMisfit,
  // Noise and σ.
  kNoiseUnknown,
  kSigmaPartlyStated,
  kOutliersNotSought,
  kExcessUnknown,
  kFewDegreesOfFreedom,
  kNoiseFree,
  kNoiseUnderstated,
  kStatedOtherwise,
  kCorrelatedResiduals,
  // Axes, scales, clocks and directions.
  kMountingContradicted,
  kMountingNotStated,
  kMountingFound,
  kLeftHanded,
  kHandAssumed,
  kOddGain,
  kNominalField,
  kFieldUnlikely,
  kFieldNotChecked,
  kClockOffset,
  kClockCorrected,
  kOneSidedPoses,
  kFollowedMotion,
  kGyroscopeGaps,
  // Temperature terms.
  kNoTemperatureTerms,
  kTemperatureWithinPoses,
  kTemperatureEndsMissed,
  kReferenceExtrapolated,
  kCurveUnchecked,
  kBiasDrift,
  kTermInDoubt,
  kNonlinearityStated,
  kLinearityAssumed,
  kFacesTilted,
  kPoorlyKnown,
  kSessions,
  kOneTemperature,
  kStaticTemperature,
  kHeldAtReference,
  kGravityMissed,
  kTermsLeftOut,
  kSweepUnexplained,
  // The choice of a model.
  kChoiceNotMade,
  kTermsNotWeighed,
  kSimulatedTruth,
  kImported,
};

/// The properties that all findings of a code share.
struct FindingKind {
  FindingCode code;
  std::string_view name;  ///< "clock-offset": in files and for scripts, never renamed.
  Severity severity;      ///< The default, which a finding may change.
  /// The outcome of a run if such a finding is a refusal; kConverged if it never is a refusal.
  Outcome outcome;
  std::string_view meaning;  ///< One line.
  std::string_view remedy;   ///< What to do about it, in general; may be empty.
  /// What an operator at the station does after a refusal: "record again".
  std::string_view operator_remedy;
};
std::span<const FindingKind> FindingKinds();  ///< In the order of FindingCode.
const FindingKind& FindingKindOf(FindingCode code);
std::string_view FindingCodeName(FindingCode code);
std::optional<FindingCode> FindingCodeFromName(std::string_view name);

/// A number that belongs to a finding.
struct FindingValue {
  std::string name;  ///< "offset".
  double value = 0.0;
  std::optional<double> sigma;
  std::string unit;  ///< "s"; empty: none.
};

/// A fact about a run that its user should know. Created, for example, by
///
///   Finding(FindingCode::kClockOffset, "…").About(triad).With("offset", 0.01, 0.001, "s")
struct Finding {
  Finding() = default;
  /// A finding with the severity of its code.
  Finding(FindingCode code, std::string text, std::string remedy = {});

  Finding& As(Severity severity);
  Finding& About(Triad triad);
  Finding& About(Triad triad, int axis);  ///< Axis: 0, 1, 2.
  Finding& AtPose(int number);            ///< StaticPose::number.
  Finding& With(std::string name, double value, std::string unit = {});
  Finding& With(std::string name, double value, double sigma, std::string unit);
  /// Adds the value "effect": ignoring the finding shifts the most affected parameter by `sigmas`
  /// σ.
  Finding& Shifting(double sigmas, Treatment treatment);

  bool IsRefusal() const { return severity == Severity::kRefusal; }
  /// Whether the finding shifts a parameter by more than its σ and was neither corrected nor
  /// included in σ: no result with such a finding is usable.
  bool IsLeftStanding() const;
  /// Text and remedy as one message.
  std::string Message() const;
  /// A value by its name; nullopt if there is none.
  std::optional<double> Value(std::string_view name) const;

  FindingCode code = FindingCode::kMessage;
  Severity severity = Severity::kNote;
  std::optional<Triad> sensor;
  std::optional<int> axis;
  std::optional<int> pose;
  std::vector<FindingValue> values;
  Treatment treatment = Treatment::kNone;
  std::string text;  ///< A sentence without its full stop.
  std::string
      remedy;  ///< What to do here, including the line to paste if there is one; may be empty.
};

/// The findings of a run, in the order in which they arose.
using Findings = std::vector<Finding>;

/// The outcome of a completed run: the outcome of its first refusal, or kConverged if there is no
/// refusal.
Outcome OutcomeOf(const Findings& findings);

/// The first finding of a code, or null.
const Finding* Find(const Findings& findings, FindingCode code);
/// The first finding that refuses, or null.
const Finding* FirstRefusal(const Findings& findings);

/// An error for too little data that carries `finding`.
Error NotEnoughError(Finding finding);

/// The finding that lists the columns of a table that are not read; unset if there are none.
std::optional<Finding> IgnoredColumns(const std::vector<std::string>& names);

/// The refusal that `error` carries as its finding; if it has none, a refusal of `code` with the
/// error's message.
Finding RefusalOf(const Error& error, FindingCode code = FindingCode::kNoPose);

}  // namespace truetriad
