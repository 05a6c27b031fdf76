// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/command.h"

#include <algorithm>
#include <array>

#include "base/spelling.h"

namespace truetriad {
namespace {

/// Verbs of the interface that this version does not have yet.
constexpr std::array<std::string_view, 1> kUnavailable = {"fleet"};

}  // namespace

std::string GflagsName(std::string_view flag) {
  std::string name(flag);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

std::string DetailsOf(const Command& command) {
  return (command.list != nullptr ? command.list() : "") + std::string(command.details);
}

const std::vector<Command>& Commands() {
  static const auto& commands = *new std::vector<Command>{InspectCommand(),
                                                          CalibrateCommand(),
                                                          ApplyCommand(),
                                                          EvaluateCommand(),
                                                          CompareCommand(),
                                                          AllanCommand(),
                                                          SimulateCommand(),
                                                          PlanCommand(),
                                                          ConvertCommand(),
                                                          ExportCommand(),
                                                          ImportCommand(),
                                                          ReportCommand(),
                                                          HelpCommand(),
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
  if (std::find(kUnavailable.begin(), kUnavailable.end(), name) != kUnavailable.end()) {
    return UsageError(quoted +
                      " is not available in this version; `truetriad help` lists the verbs");
  }
  return UsageError(quoted + " is not a verb" + DidYouMean(name, names) +
                    "; `truetriad help` lists them");
}

}  // namespace truetriad
