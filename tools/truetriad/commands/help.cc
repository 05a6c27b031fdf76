// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/help.h"

#include <gflags/gflags.h>

#include "tools/truetriad/completion.h"
#include "tools/truetriad/man_page.h"

DEFINE_string(as, "text", "text, or for all verbs: man (the manual page) or bash (completion)");

namespace truetriad {
namespace {

VerbResult Shown(const std::string& text) { return {.text = text, .result = {{"text", text}}}; }

Result<VerbResult> RunHelp(const std::vector<std::string>& words) {
  if (FLAGS_as != "text") {
    if (!words.empty())
      return Error(ErrorCode::kConflictingArguments,
                   "--as=" + FLAGS_as + " covers all verbs; name none");
    if (FLAGS_as != "man" && FLAGS_as != "bash") {
      return Error(ErrorCode::kInvalidArgument,
                   "--as=" + FLAGS_as + " is unknown; expected text, man or bash");
    }
    return Shown(FLAGS_as == "man" ? ManPage() : BashCompletion());
  }
  if (words.empty()) return Shown(OverviewText());
  const std::size_t count = VerbWords(words);
  if (words.size() > count) return Error(ErrorCode::kMissingArgument, "expected one verb");
  TRUETRIAD_ASSIGN_OR_RETURN(const Command* const command,
                             FindCommand(count == 1 ? words[0] : words[0] + " " + words[1]));
  return Shown(HelpText(*command));
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
