// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tree/json.h"
#include "truetriad/base/input_file.h"
#include "truetriad/base/result.h"
#include "truetriad/model/calibration.h"
#include "truetriad/model/finding.h"
#include "truetriad/model/outcome.h"
#include "truetriad/model/quality.h"
#include "truetriad/model/tags.h"
#include "truetriad/session/session.h"

namespace truetriad::fleet {

/// Somebody has to look at the unit.
inline bool IsRed(Verdict verdict) {
  return verdict == Verdict::kFail || verdict == Verdict::kNoResult;
}

/// A code of runs that is of no finding and no error.
struct RunCode {
  std::string_view name;  ///< Of "limit:NAME" all that begin so.
  std::string_view meaning, remedy, operator_remedy;
};
/// The worker's death, and what it may take; the limit that is missed.
inline constexpr char kCrashed[] = "crashed", kTimeLimit[] = "time-limit",
                      kMemoryLimit[] = "memory-limit", kLimit[] = "limit:";
inline constexpr std::array<RunCode, 4> kRunCodes = {
    {{"limit:NAME", "The unit exceeds this limit", "see its report", "set it aside"},
     {kCrashed, "Its process ended", "report log and version", "call the engineer"},
     {kTimeLimit, "It took too long", "raise --time-limit", "call the engineer"},
     {kMemoryLimit, "It needed too much memory", "raise --memory-limit", "call the engineer"}}};
/// Null: it is none of them.
const RunCode* RunCodeOf(std::string_view code);

/// One number of a calibration.
struct Parameter {
  std::string name;  ///< "accelerometer.bias.x", "magnetometer.sensitivity.xy".
  double value = 0.0;
  double sigma = 0.0;  ///< 0: fixed.
};

/// What a unit's runs amount to.
struct Standing {
  std::string run;  ///< That counts.
  Verdict first_verdict = Verdict::kNoResult;
  Verdict final_verdict = Verdict::kNoResult;  ///< Of that run, or of people.
  std::int64_t attempts = 0;                   ///< Recordings, however often each was calibrated.
  std::optional<std::int64_t> most = {};       ///< RetestPolicy::most.
  /// Who decided the final verdict, why and when; empty: nobody.
  std::string disposed_by = {}, disposed_why = {}, disposed_at = {};
  /// Another run, of another log, that by what is stated was measured in the same second as the one
  /// that counts; empty: none. With the log of that one and the time of its recording.
  std::string tied_with = {}, log = {}, recorded = {}, recorded_by = {};
};

/// Why a unit is good, or not, whatever another of its runs says.
std::string ReasonOf(const Standing& unit);

/// What says when a unit was measured, the first of them that does: the list, the recording's own
/// times, or that of its file.
inline constexpr std::string_view kByList = "list", kByRecording = "recording", kByFile = "file";
inline constexpr std::array kRecordedBy = {kByList, kByRecording, kByFile};

/// What a store keeps of one run of one unit. Never changed; a later run of the unit supersedes it.
struct UnitRun {
  std::string id;                                   ///< NewRunId.
  std::string serial;                               ///< Of the unit.
  std::string log;                                  ///< As it was named.
  std::int64_t log_bytes = 0, log_modified_ns = 0;  ///< Of that file when it was read.
  std::string created;                              ///< ISO 8601, UTC.
  /// When it was measured, likewise, and what says so; empty: not known.
  std::string recorded, recorded_by;
  std::string software_version;
  std::string config_sha256;  ///< Of what was asked for: experiment, overrides, formats.
  std::string shard;          ///< "2/8"; empty: not one of several.
  std::string folder;         ///< Where its files are; empty: there are none.
  Verdict verdict = Verdict::kNoResult;
  std::string code;     ///< Why not: of the finding or error, or the name of the limit.
  std::string message;  ///< The same for people.
  std::string mode;     ///< "poses", "motion", "sweep"; empty without a calibration.
  Tags tags;
  double wall_s = 0.0, cpu_s = 0.0;  ///< That the worker took.
  double effective_dof = 0.0;        ///< Behind the sigma; 0: many.
  /// Of the recording, in the mean; NaN: it has none.
  double temperature_degc = std::numeric_limits<double>::quiet_NaN();
  std::vector<InputFile> inputs;
  std::vector<SensorReadings> readings;
  std::vector<Parameter> parameters;
  std::vector<double> covariance;  ///< Of the parameters: lower triangle, row by row.
  Findings findings;
  std::vector<LimitCheck> judgements;
  /// Of one that counts, as the store says it that it is read from; not part of it.
  std::optional<Standing> standing = {};
};

/// Unique, and greater than those made before, as long as the clock does not go back:
/// "20261124T235959.123456Z-4f2a9c01".
std::string NewRunId();
/// The same, greater than `id` whatever the clock says.
std::string NewRunIdAfter(const std::string& id);

/// Fills in what follows from a calibration, or from why there is none.
void Fill(const Calibration& calibration, UnitRun* run);
void Fill(const Error& error, UnitRun* run);

/// A line of JSON and back, numbers to the last bit.
std::string LineOf(const UnitRun& run);
/// Error (bad input): no such line.
Result<UnitRun> ReadLine(std::string_view line);

/// Sets the tag of this name ("lot", "part"), if there is one.
void SetTag(std::string_view name, const std::string& value, Tags* tags);
/// The tags that are stated, by their names, and back.
Json JsonOf(const Tags& tags);
Tags TagsFrom(const Json& json);

/// A run from what a line says. An exception of the JSON library, or another that says what is
/// wrong: it is none.
UnitRun UnitRunFrom(const Json& json);

/// What is said of a unit, for programs.
inline Finding WarningOf(const std::string& text) {
  Finding warning(FindingCode::kMessage, text);
  warning.severity = Severity::kWarning;
  return warning;
}

/// A finding from what ToJson makes of it. An exception of the JSON library: it is none.
Finding FindingFrom(const Json& json);

}  // namespace truetriad::fleet
