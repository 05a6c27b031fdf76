// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <gflags/gflags.h>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/report/report.h"

// Flags that several verbs share; gflags aborts at a second definition.
DECLARE_string(input);
DECLARE_string(output);
DECLARE_string(config);
DECLARE_string(calibration);
DECLARE_string(poses);
DECLARE_string(set);
DECLARE_string(tag);
DECLARE_string(report);
DECLARE_bool(overwrite);
DECLARE_string(fail_on);
DECLARE_string(instance);
DECLARE_string(units);
DECLARE_string(to);
DECLARE_bool(json);
DECLARE_bool(quiet);

namespace truetriad {

/// The items of --set. Unbalanced brackets and quotes are left to the YAML reader to report.
std::vector<std::string> Overrides();

/// Overrides(), and the values of --tag. Error (usage): a tag without value, or of an unknown name.
Result<std::vector<std::string>> OverridesAndTags();

/// The comma-separated values of a flag.
std::vector<std::string> CommaSeparated(const std::string& values);

/// The logs of --input (a file whose name has a comma counts as one) and of `words`.
std::vector<std::string> StatedInputs(const std::vector<std::string>& words);

/// The names of all `things`.
template <typename Things>
std::vector<std::string> NamesOf(const Things& things) {
  std::vector<std::string> names;
  for (const auto& thing : things) names.emplace_back(thing.name);
  return names;
}

/// The error for a flag's value: "--jobs=-1 is invalid; expected …".
Error BadValue(std::string_view flag, const std::string& value, const std::string& what);

/// Error (usage): the value is none of `words`; the message ends with `is_not`.
Status CheckOneOf(std::string_view flag,
                  const std::string& value,
                  const std::vector<std::string>& words,
                  const std::string& is_not = " is invalid");

/// Error (usage): --fail-on is neither empty nor `word`.
Status CheckFailOn(const std::string& word);

/// Whether --report is true or not given, for verbs that write reports by default.
Result<bool> StatedReport(const std::string& hint = "");

/// The number in a text, "12" or "0.5". Error (usage): another text; the message names the flag.
Result<std::int64_t> ParseInteger(const std::string& flag, const std::string& text);
Result<double> ParseReal(const std::string& flag, const std::string& text);

/// Seconds in a text, "8h", "30m", "1d", "90s". Error (usage): as above.
Result<double> ParseDuration(const std::string& flag, const std::string& text);

/// The value of --instance.
Result<std::optional<int>> ParseInstance();

/// Whether --outside-limits allows exports of units that may not be delivered.
Result<bool> AllowsOutsideLimits();

/// The value of --units: each unit applies to the sensor of its quantity, `counts` to all.
Result<PerTriad<std::optional<std::string>>> ParseUnits();

/// The looks of reports that --interactive chooses.
ReportLooks StatedLooks();

/// Plotly's bundle gl3d with its licence; empty if it was missing at build time.
EmbeddedScript EmbeddedPlotScript();

/// Formats like printf.
[[gnu::format(printf, 1, 2)]] std::string Formatted(const char* format, ...);

/// Prints information about a run to stderr, unless --quiet.
void Note(const std::string& text);

/// Prints a warning that must not be missed to stderr, also with --quiet.
void Warn(const std::string& text);

}  // namespace truetriad
