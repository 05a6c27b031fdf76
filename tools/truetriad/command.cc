// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/command.h"

#include <algorithm>
#include <cctype>
#include <sstream>

#include <gflags/gflags.h>

#include "base/spelling.h"

namespace truetriad {
namespace {

/// The second words of verbs that begin with `first`: "run, query" for "fleet".
std::string SecondWords(std::string_view first) {
  std::string words;
  for (const Command& command : Commands()) {
    if (!command.name.starts_with(std::string(first) + " ")) continue;
    words += (words.empty() ? "" : ", ") + std::string(command.name.substr(first.size() + 1));
  }
  return words;
}

std::vector<std::string> ValuesOf(const Command& command, const CommandFlag& flag) {
  for (const auto& [name, values] : command.values) {
    if (name == flag.name) return values;
  }
  std::vector<std::string> values;
  const bool are_words = std::all_of(flag.placeholder.begin(), flag.placeholder.end(), [](char c) {
    return c == '|' || (c >= 'a' && c <= 'z');
  });
  std::istringstream items(are_words ? flag.placeholder : "");
  for (std::string item; std::getline(items, item, '|');) values.push_back(item);
  return values;
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

std::vector<CommandFlag> FlagsOf(const Command& command) {
  std::vector<CommandFlag> flags;
  std::istringstream words(command.flags);
  for (std::string word; words >> word;) {
    CommandFlag& flag = flags.emplace_back();
    for (; word.back() == '!' || word.back() == '*'; word.pop_back()) {
      (word.back() == '!' ? flag.required : flag.repeats) = true;
    }
    const std::size_t equals = word.find('=');
    flag.name = word.substr(0, equals);
    if (flag.name == "config" || flag.name == "output") flag.letter = flag.name[0];
    const auto info = gflags::GetCommandLineFlagInfoOrDie(GflagsName(flag.name).c_str());
    flag.placeholder = "true|false";
    flag.meaning = info.description;
    if (info.type != "bool") {
      const std::size_t colon = info.description.find(": ");
      flag.placeholder = info.description.substr(0, colon);
      flag.meaning = info.description.substr(colon + 2);
    }
    if (equals != std::string::npos) flag.placeholder = word.substr(equals + 1);
    flag.values = ValuesOf(command, flag);
  }
  return flags;
}

std::string UsageOf(const Command& command) {
  std::string usage = "truetriad " + std::string(command.name);
  const std::vector<CommandFlag> flags = FlagsOf(command);
  const auto shown = [&flags](std::string_view word, const std::string& more = "") {
    for (const CommandFlag& flag : flags) {
      if (flag.name != word) continue;
      const std::string name =
          flag.placeholder.substr(0, flag.placeholder.find_first_of(",[")) + more;
      return flag.required ? name : "[" + name + "]";
    }
    std::string name(word);
    std::transform(
        name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::toupper(c); });
    return "[" + name + "]";
  };
  for (const std::string_view word : command.words) usage += " " + shown(word);
  if (!command.more_words.empty()) usage += " " + shown(command.more_words, " ...");
  for (const CommandFlag& flag : flags) {
    const bool is_word = flag.name == command.more_words ||
                         std::ranges::find(command.words, flag.name) != command.words.end();
    if (flag.required && !is_word) usage += " --" + flag.name + "=" + flag.placeholder;
  }
  return command.flags.empty() ? usage : usage + " [flags]";
}

const std::vector<Command>& Commands() {
  static const auto& commands = *new std::vector<Command>{
      InspectCommand(),     InitCommand(),        CheckCommand(),        CalibrateCommand(),
      ApplyCommand(),       EvaluateCommand(),    CompareCommand(),      CheckStationCommand(),
      AllanCommand(),       SimulateCommand(),    PlanCommand(),         ConvertCommand(),
      ExportCommand(),      ImportCommand(),      ReportCommand(),       ExplainCommand(),
      FleetRunCommand(),    FleetWatchCommand(),  FleetQueryCommand(),   FleetSummaryCommand(),
      FleetReportCommand(), FleetExportCommand(), FleetCollectCommand(), FleetDisposeCommand(),
      HelpCommand(),        VersionCommand()};
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
