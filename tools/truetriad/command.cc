// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/command.h"

#include <algorithm>
#include <cctype>

#include "base/spelling.h"

namespace truetriad {
namespace {

/// The second words of verbs that begin with `first`: "run, query" of "fleet".
std::string SecondWords(std::string_view first) {
  std::string words;
  for (const Command& command : Commands()) {
    if (!command.name.starts_with(std::string(first) + " ")) continue;
    words += (words.empty() ? "" : ", ") + std::string(command.name.substr(first.size() + 1));
  }
  return words;
}

}  // namespace

std::size_t VerbWords(const std::vector<std::string>& arguments) {
  const bool has_two =
      arguments.size() > 1 && !SecondWords(arguments[0]).empty() && !arguments[1].starts_with('-');
  return has_two ? 2 : 1;
}

std::string GflagsName(std::string_view flag) {
  std::string name(flag);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

std::optional<char> ShortNameOf(std::string_view flag) {
  if (flag == "config") return 'c';
  if (flag == "output") return 'o';
  return std::nullopt;
}

std::string NamesOf(const CommandFlag& flag) {
  const std::string name = "--" + std::string(flag.name);
  const std::optional<char> letter = ShortNameOf(flag.name);
  return letter ? std::string("-") + *letter + ", " + name : name;
}

std::string UsageOf(const Command& command) {
  std::string usage = "truetriad " + std::string(command.name);
  const auto shown = [&command](std::string_view word, std::string_view more = "") -> std::string {
    for (const CommandFlag& flag : command.flags) {
      if (flag.name != word) continue;
      const std::string name(flag.placeholder.substr(0, flag.placeholder.find_first_of(",[")));
      return flag.required ? name + std::string(more) : "[" + name + std::string(more) + "]";
    }
    std::string name(word);
    std::transform(
        name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::toupper(c); });
    return "[" + name + "]";
  };
  for (const std::string_view word : command.words) usage += " " + shown(word);
  if (!command.more_words.empty()) usage += " " + shown(command.more_words, " ...");
  return command.flags.empty() ? usage : usage + " [flags]";
}

std::string DetailsOf(const Command& command) {
  return (command.list != nullptr ? command.list() : "") + std::string(command.details);
}

const std::vector<Command>& Commands() {
  static const auto& commands = *new std::vector<Command>{
      InspectCommand(),     InitCommand(),         CheckCommand(),        CalibrateCommand(),
      ApplyCommand(),       EvaluateCommand(),     CompareCommand(),      CheckStationCommand(),
      AllanCommand(),       SimulateCommand(),     PlanCommand(),         ConvertCommand(),
      ExportCommand(),      ImportCommand(),       ReportCommand(),       FleetRunCommand(),
      FleetWatchCommand(),  FleetQueryCommand(),   FleetSummaryCommand(), FleetReportCommand(),
      FleetExportCommand(), FleetCollectCommand(), FleetDisposeCommand(), HelpCommand(),
      VersionCommand()};
  return commands;
}

Result<const Command*> FindCommand(std::string_view name) {
  std::vector<std::string_view> names;
  for (const Command& command : Commands()) {
    if (command.name == name) return &command;
    names.push_back(command.name);
  }
  std::string quoted(1, '`');
  quoted.append(name).append("`");
  if (const std::string words = SecondWords(name); !words.empty()) {
    return Error(ErrorCode::kUnknownVerb,
                 quoted + " needs a second word, one of " + words + "; as in `truetriad " +
                     std::string(name) + " run`");
  }
  return Error(
      ErrorCode::kUnknownVerb,
      quoted + " is not a verb" + DidYouMean(name, names) + "; `truetriad help` lists them");
}

}  // namespace truetriad
