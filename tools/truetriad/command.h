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
inline constexpr int kExitOutsideLimits = 4;

/// What a verb has to say.
struct VerbResult {
  int exit_code = kExitGood;
  std::string text = {};         ///< On stdout, for people.
  Json result = Json::object();  ///< With --json, for programs.
  /// The same for both: notes, and why the result is not all that was asked for.
  Findings findings = {};
  /// What to say on stderr, too: why there is not more.
  std::string failure = {};
  /// Why a result cannot be used, or that it can, where the verb judges that.
  std::optional<Outcome> outcome = {};
  /// Of the unit, where the verb judges one.
  std::optional<Verdict> verdict = {};
  /// How good the news in the first line of the text is, for its colour; unset: no news.
  std::optional<Grade> grade = {};
};

/// A text that is all there is.
inline VerbResult Shown(const std::string& text) {
  return {.text = text, .result = {{"text", text}}};
}

/// A flag as a verb takes it.
struct CommandFlag {
  std::string name;                 ///< With hyphens where gflags' has underscores.
  std::string placeholder;          ///< What stands for the value in help: "LOG".
  std::string meaning;              ///< What help says of it.
  std::vector<std::string> values;  ///< What it can be, for completion; empty: anything.
  std::optional<char> letter;       ///< "-o" for --output; none for most.
  bool required = false;
  bool repeats = false;  ///< May be given again: the values are joined by lines.
};

/// One verb of the command line.
struct Command {
  std::string_view name;
  std::string_view summary;         ///< The question it answers, half a line.
  std::string_view examples;        ///< Lines that work from the root of the repository.
  std::string_view details = {};    ///< What else a user must know.
  std::string (*list)() = nullptr;  ///< What comes before that and takes a while to put together.
  /// Names of flags, "input=FILE! set*": `!` after one that must be given, `*` after one that may
  /// be given again, `=` before what stands for the value, where it is not what the flag's own
  /// description begins with ("LOG: the log, …"). Words in small letters are all values there are.
  std::string flags = {};
  /// The values of flags of which that does not tell.
  std::vector<std::pair<std::string_view, std::vector<std::string>>> values = {};
  /// Flags that words without a flag stand for, one each, in this order.
  std::vector<std::string_view> words = {};
  /// What any further words are values of: a flag, or the name of something else.
  std::string_view more_words = {};
  /// Does the work with these further words; flags have been checked and set.
  Result<VerbResult> (*run)(const std::vector<std::string>& words) = nullptr;
};

/// The flag's name in gflags.
std::string GflagsName(std::string_view flag);

std::vector<CommandFlag> FlagsOf(const Command& command);

/// "truetriad evaluate [FILE] [LOG] [flags]": words stand for the flags of these names.
std::string UsageOf(const Command& command);

/// The verbs of this version, in the order of the overview.
const std::vector<Command>& Commands();

/// How many of `arguments`, which are not empty, make the name of a verb: 2 for "fleet run".
std::size_t VerbWords(const std::vector<std::string>& arguments);

/// The command called `name`. Error (usage): there is none; says which is nearest, or that this
/// version does not have it.
Result<const Command*> FindCommand(std::string_view name);

/// The overview of all verbs.
std::string OverviewText();
/// Everything about one verb, example first.
std::string HelpText(const Command& command);

// In commands/, and in help.cc.
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
