// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/help.h"

#include <cstdio>

#include <gflags/gflags.h>

#include "tools/truetriad/completion.h"
#include "tools/truetriad/man_page.h"

DEFINE_string(as, "text", "text, or for all verbs: man (the manual page) or bash (completion)");

namespace truetriad {
namespace {

Result<int> RunHelp(const std::vector<std::string>& words) {
  if (FLAGS_as != "text") {
    if (!words.empty()) return UsageError("--as=" + FLAGS_as + " covers all verbs; name none");
    if (FLAGS_as != "man" && FLAGS_as != "bash") {
      return UsageError("--as=" + FLAGS_as + " is unknown; expected text, man or bash");
    }
    std::fputs((FLAGS_as == "man" ? ManPage() : BashCompletion()).c_str(), stdout);
    return kExitGood;
  }
  if (words.empty()) {
    std::fputs(OverviewText().c_str(), stdout);
    return kExitGood;
  }
  if (words.size() > 1) return UsageError("expected one verb");
  TRUETRIAD_ASSIGN_OR_RETURN(const Command* const command, FindCommand(words[0]));
  std::fputs(HelpText(*command).c_str(), stdout);
  return kExitGood;
}

}  // namespace

Command HelpCommand() {
  return {.name = "help",
          .summary = "How do I use a verb?",
          .examples = "build/truetriad help calibrate",
          .flags = {{"as", "FORM", false, {"text", "man", "bash"}}},
          .more_words = "verb",
          .run = RunHelp};
}

}  // namespace truetriad
