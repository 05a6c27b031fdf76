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
#include "truetriad/report/report.h"

namespace truetriad {

/// Exit codes of verbs that do not fail.
inline constexpr int kExitGood = 0;
inline constexpr int kExitNotEnough = static_cast<int>(ErrorKind::kNotEnough);
inline constexpr int kExitOutsideLimits = 4;  // Error kinds have 1 to 3.

/// The result of a verb.
struct VerbResult {
  int exit_code = kExitGood;
  std::string text = {};         ///< On stdout, for people.
  Json result = Json::object();  ///< With --json, for programs.
  /// Notes, and reasons why the result is incomplete, for people and for programs.
  Findings findings = {};
  /// Why the result is incomplete; printed on stderr.
  std::string failure = {};
  /// Whether the result can be used and why not, if the verb judges that.
  std::optional<Outcome> outcome = {};
  /// The verdict on the unit, if the verb judges one.
  std::optional<Verdict> verdict = {};
  /// The grade of the text's first line, which sets the line's colour; unset: no colour.
  std::optional<Grade> grade = {};
};

/// A result that consists of a text only.
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
  bool repeats = false;  ///< May be given several times; newlines then join the values.
};

/// One verb of the command line.
struct Command {
  std::string_view name;
  std::string_view summary;         ///< The question that the verb answers, half a line.
  std::string_view examples;        ///< Lines that work in the root of the repository.
  std::string_view details = {};    ///< Further help for the user.
  std::string (*list)() = nullptr;  ///< Builds the text before `details`, as building takes time.
  /// Names of flags, "input=FILE! set*": `!` follows a required flag, `*` a flag that may be
  /// repeated. The name of the value follows `=`, or begins the flag's own description ("LOG: the
  /// log, …"); if it is in lower case ("refuse|allow"), it lists all possible values.
  std::string flags = {};
  /// The possible values of flags for which `flags` does not state them.
  std::vector<std::pair<std::string_view, std::vector<std::string>>> values = {};
  /// Flags whose values may be words alone ("inspect LOG"): one word for each, in this order.
  std::vector<std::string_view> words = {};
  /// What all further words are: values of the flag of this name, else what usage calls them, such
  /// as "verb". Empty: there must be no further words.
  std::string_view more_words = {};
  /// Does the work with the further words, after the flags have been checked and set.
  Result<VerbResult> (*run)(const std::vector<std::string>& words) = nullptr;
};

/// The flag's name in gflags.
std::string GflagsName(std::string_view flag);

std::vector<CommandFlag> FlagsOf(const Command& command);

/// The usage line, "truetriad inspect LOG [flags]". A word is named like the value of its flag.
std::string UsageOf(const Command& command);

/// The verbs of this version, in the order of the overview.
const std::vector<Command>& Commands();

/// The number of `arguments` (not empty) that form the name of a verb: 2 for "fleet run".
std::size_t VerbWords(const std::vector<std::string>& arguments);

/// The command called `name`. Error (usage): there is none. The message suggests the nearest name,
/// or states the second words that can follow `name`.
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
