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
#include "truetriad/base/result.h"
#include "truetriad/model/calibration.h"
#include "truetriad/model/finding.h"
#include "truetriad/model/quality.h"
#include "truetriad/model/tags.h"
#include "truetriad/session/session.h"

namespace truetriad::fleet {

/// Whether a unit with this verdict needs attention.
inline bool IsRed(Verdict verdict) {
  return verdict == Verdict::kFail || verdict == Verdict::kNoResult;
}

/// The meaning of a code of runs that is neither the code of a finding nor of an error.
struct RunCode {
  std::string_view name;  ///< "limit:NAME" stands for all names.
  std::string_view meaning, remedy, operator_remedy;
};
/// Codes for a worker that crashed or exceeded its time or memory. kLimit precedes a limit's name.
inline constexpr char kCrashed[] = "crashed", kTimeLimit[] = "time-limit",
                      kMemoryLimit[] = "memory-limit", kLimit[] = "limit:";
inline constexpr std::array<RunCode, 4> kRunCodes = {
    {{"limit:NAME", "The unit exceeds this limit", "see its report", "set it aside"},
     {kCrashed, "Calibration process crashed", "report log and version", "call the engineer"},
     {kTimeLimit, "Calibration took too long", "raise --time-limit", "call the engineer"},
     {kMemoryLimit,
      "Calibration needed too much memory",
      "raise --memory-limit",
      "call the engineer"}}};
/// Returns nullptr for other codes.
const RunCode* RunCodeOf(std::string_view code);

/// One number of a calibration.
struct Parameter {
  std::string name;  ///< "accelerometer.bias.x", "magnetometer.sensitivity.xy".
  double value = 0.0;
  double sigma = 0.0;  ///< 0: fixed.
};

/// The result of all runs of a unit.
struct Standing {
  std::string run;  ///< The current run.
  Verdict first_verdict = Verdict::kNoResult;
  Verdict final_verdict = Verdict::kNoResult;  ///< By the current run or a person.
  std::int64_t attempts = 0;                   ///< Number of recordings.
  std::optional<std::int64_t> most = {};       ///< RetestPolicy::most.
  /// Who decided the final verdict, why and when; empty: nobody.
  std::string disposed_by = {}, disposed_why = {}, disposed_at = {};
  /// tied_with: a run of another log, stated to be measured in the same second as the current run;
  /// empty: none. log, recorded, recorded_by: of the current run.
  std::string tied_with = {}, log = {}, recorded = {}, recorded_by = {};
};

/// A unit's final verdict in words, with the run or the person that decides it.
std::string ReasonOf(const Standing& unit);

/// The sources for the time of measurement, by priority: the list, the recording's own times, or
/// the time of its file.
inline constexpr std::string_view kByList = "list", kByRecording = "recording", kByFile = "file";
inline constexpr std::array kRecordedBy = {kByList, kByRecording, kByFile};

/// A store's data on one run of one unit. It is never changed; a later run supersedes it.
struct UnitRun {
  std::string id;                                   ///< NewRunId.
  std::string serial;                               ///< Of the unit.
  std::string log;                                  ///< Path of the log as it was named.
  std::int64_t log_bytes = 0, log_modified_ns = 0;  ///< State of the log when read.
  std::string created;                              ///< ISO 8601, UTC.
  /// The time of measurement (ISO 8601, UTC) and its source; empty: unknown.
  std::string recorded, recorded_by;
  std::string software_version;
  std::string config_sha256;  ///< Digest of experiment, overrides and formats.
  std::string shard;          ///< "2/8"; empty: no shards.
  std::string folder;         ///< Folder of its files; empty: none.
  Verdict verdict = Verdict::kNoResult;
  std::string code;     ///< Code of the finding or error, or one of kRunCodes.
  std::string message;  ///< The reason for the verdict in words.
  std::string mode;     ///< "poses", "motion", "sweep"; empty without a calibration.
  Tags tags;
  double wall_s = 0.0, cpu_s = 0.0;  ///< Time used by the worker, s.
  double effective_dof = 0.0;        ///< Degrees of freedom of sigma; 0: many.
  /// Mean over the recording; NaN: unknown.
  double temperature_degc = std::numeric_limits<double>::quiet_NaN();
  std::vector<InputFile> inputs;
  std::vector<SensorReadings> readings;
  std::vector<Parameter> parameters;
  std::vector<double> covariance;  ///< Of the parameters: lower triangle, row by row.
  Findings findings;
  std::vector<LimitCheck> judgements;
  /// The unit's standing, if the run is current and was read from a store; not part of the run.
  std::optional<Standing> standing = {};
};

/// A unique name of a run. It is greater than earlier ones unless the clock has gone back.
std::string NewRunId();
/// A unique name that is greater than `id`, whatever the clock says.
std::string NewRunIdAfter(const std::string& id);

/// Sets the fields that follow from a calibration, or from an error if there is none.
void Fill(const Calibration& calibration, UnitRun* run);
void Fill(const Error& error, UnitRun* run);

/// A run as a line of JSON, in which numbers keep every bit.
std::string LineOf(const UnitRun& run);
/// Reads a line that LineOf made. Error (bad input): the line is not a run.
Result<UnitRun> ReadLine(std::string_view line);

/// Sets the tag of this name ("lot", "part"), if there is one.
void SetTag(std::string_view name, const std::string& value, Tags* tags);
/// The tags that are set as JSON, by their names; and the tags that such JSON states.
Json JsonOf(const Tags& tags);
Tags TagsFrom(const Json& json);

/// Reads a run from the JSON of a line. If it is not a run, throws a std::exception.
UnitRun UnitRunFrom(const Json& json);

/// A warning about a unit in the form of a finding.
inline Finding WarningOf(const std::string& text) {
  Finding warning(FindingCode::kMessage, text);
  warning.severity = Severity::kWarning;
  return warning;
}

/// Reads a finding from the JSON of ToTree. If the JSON is not a finding, throws an exception of
/// the JSON library.
Finding FindingFrom(const Json& json);

}  // namespace truetriad::fleet
