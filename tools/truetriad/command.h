// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tree/json.h"
#include "truetriad/base/result.h"
#include "truetriad/model/finding.h"
#include "truetriad/model/outcome.h"
#include "truetriad/report/report.h"

namespace truetriad {

/// Exit codes of verbs that do not fail.
inline constexpr int kExitGood = 0;
inline constexpr int kExitNotEnough = static_cast<int>(ErrorKind::kNotEnough);
inline constexpr int kExitOutsideLimits = 4;  // After the error kinds, 1 to 3.

/// The result of a verb.
struct VerbResult {
  int exit_code = kExitGood;
  std::string text = {};         ///< On stdout, for people.
  Json result = Json::object();  ///< With --json, for programs.
  /// Notes, and reasons why the result is incomplete, for people and for programs.
  Findings findings = {};
  /// Why the result is incomplete, as text that is also printed on stderr.
  std::string failure = {};
  /// Whether the result can be used and why not, if the verb judges that.
  std::optional<Outcome> outcome = {};
  /// The verdict on the unit, if the verb judges one.
  std::optional<Verdict> verdict = {};
  /// The grade of the text's first line, which sets the line's colour; unset: no colour.
  std::optional<Grade> grade = {};
};

/// A result of only a text.
inline VerbResult Shown(const std::string& text) {
  return {.text = text, .result = {{"text", text}}};
}

/// A flag of a verb.
struct CommandFlag {
  std::string name;                 ///< With hyphens instead of gflags' underscores.
  std::string placeholder;          ///< The name of the value in help: "LOG".
  std::string meaning;              ///< The description in help.
  std::vector<std::string> values;  ///< The possible values, for completion; empty: any value.
  std::optional<char> letter;       ///< "-o" for --output; none for most.
  bool required = false;
  bool repeats = false;  ///< It may be given several times; the values are joined by newlines.
};

/// One verb of the command line.
struct Command {
  std::string_view name;
  std::string_view summary;         ///< The question it answers, half a line.
  std::string_view examples;        ///< Lines that work in the root of the repository.
  std::string_view details = {};    ///< Further help for the user.
  std::string (*list)() = nullptr;  ///< Builds a text before `details`, which takes time.
  /// Names of flags, "input=FILE! set*": `!` follows a required flag, `*` one that may be repeated,
  /// `=` precedes the name of the value if the flag's own description does not begin with it ("LOG:
  /// the log, …"). Words in lower case are all possible values.
  std::string flags = {};
  /// The possible values of flags for which `flags` does not state them.
  std::vector<std::pair<std::string_view, std::vector<std::string>>> values = {};
  /// Flags that are set by words without a flag: one word for each flag, in this order.
  std::vector<std::string_view> words = {};
  /// The meaning of further words: a flag, or the name of something else.
  std::string_view more_words = {};
  /// Does the work with these further words, after flags have been checked and set.
  Result<VerbResult> (*run)(const std::vector<std::string>& words) = nullptr;
};

/// The flag's name in gflags.
std::string GflagsName(std::string_view flag);

std::vector<CommandFlag> FlagsOf(const Command& command);

/// The usage line, "truetriad evaluate [FILE] [LOG] [flags]"; words are named as their flags.
std::string UsageOf(const Command& command);

/// The verbs of this version, in the order of the overview.
const std::vector<Command>& Commands();

/// The number of `arguments` (not empty) that form the name of a verb: 2 for "fleet run".
std::size_t VerbWords(const std::vector<std::string>& arguments);

/// The command called `name`. Error (usage): there is none; the message suggests the nearest, or
/// states that this version lacks it.
Result<const Command*> FindCommand(std::string_view name);

/// The overview of all verbs.
std::string OverviewText();
/// Everything about one verb, example first.
std::string HelpText(const Command& command);

// Defined in commands/ and in help.cc.
Command InspectCommand();
Command InitCommand();
Command CheckCommand();
Command CalibrateCommand();
Command ApplyCommand();
Command EvaluateCommand();
Command CompareCommand();
Command CheckStationCommand();
Command AllanCommand();
Command SimulateCommand();
Command PlanCommand();
Command ConvertCommand();
Command ExportCommand();
Command ImportCommand();
Command ReportCommand();
Command ExplainCommand();
Command FleetRunCommand();
Command FleetDisposeCommand();
Command FleetWatchCommand();
Command FleetQueryCommand();
Command FleetCollectCommand();
Command FleetExportCommand();
Command FleetReportCommand();
Command FleetSummaryCommand();
Command HelpCommand();
Command VersionCommand();

}  // namespace truetriad
