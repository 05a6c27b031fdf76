// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/help.h"

#include <cstdio>

namespace truetriad {
namespace {

Result<int> Run(const std::vector<std::string>& words) {
  if (words.empty()) {
    std::fputs(OverviewText().c_str(), stdout);
    return kExitGood;
  }
  if (words.size() > 1) return UsageError("expected one verb");
  const Result<const Command*> command = FindCommand(words[0]);
  TRUETRIAD_RETURN_IF_ERROR(command);
  std::fputs(HelpText(**command).c_str(), stdout);
  return kExitGood;
}

}  // namespace

Command HelpCommand() {
  return {.name = "help",
          .summary = "How is a verb used?",
          .examples = "build/truetriad help calibrate",
          .takes_words = true,
          .run = Run};
}

}  // namespace truetriad
