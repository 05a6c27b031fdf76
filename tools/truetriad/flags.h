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

/// The items of --set. The YAML reader reports unbalanced brackets and quotes.
std::vector<std::string> Overrides();

/// Overrides(), and the values of --tag. Error (usage): a tag has no value or an unknown name.
Result<std::vector<std::string>> OverridesAndTags();

/// The comma-separated values of a flag.
std::vector<std::string> CommaSeparated(const std::string& values);

/// The logs of --input and of `words`. If --input names an existing file, commas do not separate.
std::vector<std::string> StatedInputs(const std::vector<std::string>& words);

/// The names of all `things`.
template <typename Things>
std::vector<std::string> NamesOf(const Things& things) {
  std::vector<std::string> names;
  for (const auto& thing : things) names.emplace_back(thing.name);
  return names;
}

/// The error for a flag's value: "--jobs=-1" + `what`, which is like " is invalid; expected …".
Error BadValue(std::string_view flag, const std::string& value, const std::string& what);

/// Error (usage): the value is none of `words`: "--to=x" + `is_not` + "; expected csv or jsonl".
Status CheckOneOf(std::string_view flag,
                  const std::string& value,
                  const std::vector<std::string>& words,
                  const std::string& is_not = " is invalid");

/// Error (usage): --fail-on is neither empty nor `word`.
Status CheckFailOn(const std::string& word);

/// For verbs that write a report by default: whether to write it. --report=false forbids it.
Result<bool> StatedReport(const std::string& hint = "");

/// Parses a number, "12" or "0.5". Error (usage): `text` is no number; the message names the flag.
Result<std::int64_t> ParseInteger(const std::string& flag, const std::string& text);
Result<double> ParseReal(const std::string& flag, const std::string& text);

/// Parses a duration, "8h", "30m", "1d" or "90s", in seconds. Error (usage): `text` is none.
Result<double> ParseDuration(const std::string& flag, const std::string& text);

/// The value of --instance.
Result<std::optional<int>> ParseInstance();

/// Whether --outside-limits allows exports of units that may not be delivered.
Result<bool> AllowsOutsideLimits();

/// The units of --units: each applies to the sensor of its quantity, `counts` to all other sensors.
Result<PerTriad<std::optional<std::string>>> ParseUnits();

/// The looks of reports, chosen by --interactive.
ReportLooks StatedLooks();

/// Plotly's bundle gl3d with its licence; empty if it was missing at build time.
EmbeddedScript EmbeddedPlotScript();

/// Formats like printf.
[[gnu::format(printf, 1, 2)]] std::string Formatted(const char* format, ...);

/// Prints information about a run to stderr, unless --quiet.
void Note(const std::string& text);

/// Prints a warning to stderr, also with --quiet, since it must not be missed.
void Warn(const std::string& text);

}  // namespace truetriad
