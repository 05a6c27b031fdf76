// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/man_page.h"

#include <algorithm>
#include <string_view>

#include <gflags/gflags.h>

#include "tools/truetriad/command.h"
#include "truetriad/base/version.h"
#include "truetriad/session/session.h"

namespace truetriad {
namespace {

/// `text` as it is, for troff: neither escapes, nor hyphens that break or turn into dashes, nor
/// requests at the begin of a line.
std::string Plain(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const bool begins_line = i == 0 || text[i - 1] == '\n';
    if (begins_line && (c == '.' || c == '\'')) plain += "\\&";
    if (c == '\\') {
      plain += "\\e";
    } else if (c == '-') {
      plain += "\\-";
    } else {
      plain += c;
    }
  }
  return plain;
}

/// Lines of source code or a table.
std::string Verbatim(std::string_view lines) {
  return ".PP\n.nf\n" + Plain(lines) + (lines.ends_with('\n') ? "" : "\n") + ".fi\n";
}

std::string FlagEntry(const CommandFlag& flag) {
  return ".TP\n\\fB" + Plain(NamesOf(flag)) + "\\fR=\\fI" + Plain(flag.placeholder) + "\\fR\n" +
         Plain(gflags::GetCommandLineFlagInfoOrDie(GflagsName(flag.name).c_str()).description) +
         (flag.required ? " (required)" : "") + '\n';
}

std::string Verb(const Command& command) {
  std::string text = ".SS " + std::string(command.name) + '\n' + Plain(command.summary) + '\n';
  text += Verbatim(UsageOf(command));
  const std::string details = DetailsOf(command);
  if (!details.empty()) text += Verbatim(details);
  for (const CommandFlag& flag : command.flags) text += FlagEntry(flag);
  return text + ".PP\nExample:\n" + Verbatim(command.examples);
}

}  // namespace

std::string ManPage() {
  std::string text = ".TH TRUETRIAD 1 \"\" \"truetriad " + Version() +
                     "\" \"User Commands\"\n"
                     ".SH NAME\n"
                     "truetriad \\- calibrate accelerometers, magnetometers and gyroscopes\n"
                     ".SH SYNOPSIS\n"
                     ".B truetriad\n"
                     ".I VERB\n"
                     "[\\fB\\-\\-flag\\fR=\\fIvalue\\fR ...]\n"
                     ".SH DESCRIPTION\n";
  text += Plain(
      "truetriad estimates the biases, gains and misalignments of a unit's sensors from rests in "
      "many attitudes and the turns between them, with a reliable uncertainty for every number. If "
      "a parameter is unobservable, it tells which poses to add.\n");
  text += ".PP\n" +
          Plain(
              "Results go to stdout, messages to stderr; --v=1 adds the library's log. A "
              "flag and its value are one word or two: --input=LOG or --input LOG; words alone "
              "stand for the flags that a verb's first line names. -- ends the flags.\n");
  text += ".SH VERBS\n";
  for (const Command& command : Commands()) text += Verb(command);
  text += ".SH EXIT STATUS\n";
  for (const auto& [code, meaning] : {std::pair("0", "Good."),
                                      std::pair("1", "Wrong usage."),
                                      std::pair("2", "Bad input; nothing written."),
                                      std::pair("3", "Readable, but not enough for a calibration."),
                                      std::pair("4", "Usable, but outside the stated limits.")}) {
    text += std::string(".TP\n.B ") + code + '\n' + meaning + '\n';
  }
  text += ".SH ENVIRONMENT\n";
  for (const auto& [name, meaning] :
       {std::pair(
            "TRUETRIAD_SHARE",
            "Folder with truetriad's data files; default: share/truetriad beside the program."),
        std::pair("TRUETRIAD_LIBEXEC",
                  "Folder to search for converters and modules before libexec/truetriad beside the "
                  "program."),
        std::pair("SOURCE_DATE_EPOCH",
                  "Seconds since 1970 to record as the creation time of results, so that the same "
                  "input gives the same bytes.")}) {
    text += std::string(".TP\n.B ") + name + '\n' + Plain(meaning) + '\n';
  }
  // Installing puts the prefix before them (tools/cmake/InstalledTexts.cmake).
  text += ".SH FILES\n";
  for (const auto& [name, meaning] :
       {std::pair("configs/", "Experiments, scenarios, plans, limits and sensors to begin with."),
        std::pair("datasets/", "The recordings of the examples.")}) {
    text += std::string(".TP\n.I ") + name + '\n' + meaning + '\n';
  }
  return text;
}

}  // namespace truetriad
