// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gflags/gflags.h>

#include "base/companion.h"
#include "config/schemas.h"
#include "report/table.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "truetriad/base/result.h"

DEFINE_string(
    as,
    "text",
    "FORM: text, or for all verbs: man (the manual page) or bash (completion); or schema, of "
    "the kind of YAML file that the word names");

namespace truetriad {
namespace {

constexpr std::string_view kInRepository = "build/truetriad";
constexpr std::string_view kFlagsOfAllVerbs =
    "With every verb: --json, one JSON object on stdout instead of text; --quiet, no notes and no\n"
    "progress; --v=1, the library's log.\n";
constexpr std::array<std::string_view, 5> kExitCodes = {
    "good",
    "wrong usage",
    "bad input, nothing written",
    "readable, but not enough for a calibration",
    "usable, but outside the stated limits (fleet run: with --fail-on=unit)"};

/// The end of the help of every verb.
std::string CommonText() {
  std::string codes = "Exit codes:";
  for (std::size_t i = 0; i < kExitCodes.size(); ++i) {
    codes.append(i == 0 ? " " : " · ").append(std::to_string(i)).append(" ").append(kExitCodes[i]);
  }
  return std::string(kFlagsOfAllVerbs) + Wrapped(codes, 0);
}

void ReplaceAll(std::string_view from, std::string_view to, std::string& text) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
}

std::string Indented(std::string lines) {
  ReplaceAll("\n", "\n  ", lines);
  return "  " + lines + '\n';
}

/// The examples with valid paths. An installed program gets paths that are valid in any folder;
/// otherwise they are valid in the root of the repository.
std::string ExampleText(std::string_view examples) {
  const std::string_view known = "configs/experiments/joint.yaml";
  const Result<std::string> installed = FindSharedFile(known);
  if (!installed) {
    return "Example, from the root of the repository:\n" + Indented(std::string(examples));
  }
  const std::string share = installed->substr(0, installed->size() - known.size());
  std::string text(examples);
  ReplaceAll(kInRepository, kInRepository.substr(kInRepository.find('/') + 1), text);
  for (const char before : {' ', '='}) {
    for (const std::string_view folder : {"configs/", "datasets/"}) {
      ReplaceAll(before + std::string(folder), before + share + std::string(folder), text);
    }
  }
  return "Example:\n" + Indented(text);
}

/// `text` escaped for troff, which prints it as it is: backslashes, hyphens, and at the beginning
/// of a line points and apostrophes.
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

/// Lines of source code or of a table, which troff must not re-flow.
std::string Verbatim(std::string_view lines) {
  return ".PP\n.nf\n" + Plain(lines) + (lines.ends_with('\n') ? "" : "\n") + ".fi\n";
}

/// The names of a flag, "-o, --output".
std::string NamesOf(const CommandFlag& flag) {
  return (flag.letter ? std::string("-") + *flag.letter + ", " : "") + "--" + flag.name;
}

std::string MeaningOf(const CommandFlag& flag) {
  return flag.meaning + (flag.required ? " (required)" : "");
}

std::string DetailsOf(const Command& command) {
  return (command.list != nullptr ? command.list() : "") + std::string(command.details);
}

std::string ManPageOf(const Command& command) {
  std::string text = ".SS " + std::string(command.name) + '\n' + Plain(command.summary) + '\n';
  text += Verbatim(UsageOf(command));
  const std::string details = DetailsOf(command);
  if (!details.empty()) text += Verbatim(details);
  for (const CommandFlag& flag : FlagsOf(command)) {
    text += ".TP\n\\fB" + Plain(NamesOf(flag)) + "\\fR=\\fI" + Plain(flag.placeholder) + "\\fR\n" +
            Plain(MeaningOf(flag)) + '\n';
  }
  return text + ".PP\nExample:\n" + Verbatim(command.examples);
}

/// The beginning of truetriad.1, before the verbs.
constexpr std::string_view kManHead = R"(.TH TRUETRIAD 1 "" "truetriad @version@" "User Commands"
.SH NAME
truetriad \- calibrate accelerometers, magnetometers and gyroscopes
.SH SYNOPSIS
.B truetriad
.I VERB
[\fB\-\-flag\fR=\fIvalue\fR ...]
.SH DESCRIPTION
truetriad estimates the biases, gains and misalignments of a unit's sensors from rests in many attitudes and the turns between them, with a reliable uncertainty for every number. If a parameter is unobservable, it names the poses to add.
.PP
Results go to stdout, messages to stderr; \-\-v=1 adds the library's log. A flag and its value are one word or two: \-\-input=LOG or \-\-input LOG; words alone stand for the flags that a verb's first line names. \-\- ends the flags.
.SH VERBS
)";

/// The end of truetriad.1, after the exit codes. The installation replaces the folders by their
/// installed paths (tools/cmake/InstalledTexts.cmake).
constexpr std::string_view kManTail = R"(.SH ENVIRONMENT
.TP
.B TRUETRIAD_SHARE
Folder with truetriad's data files; default: share/truetriad beside the program.
.TP
.B TRUETRIAD_LIBEXEC
Folder to search for converters and modules before libexec/truetriad beside the program.
.TP
.B SOURCE_DATE_EPOCH
Seconds since 1970 to record as the creation time of results, so that the same input gives the same bytes.
.SH FILES
.TP
.I configs/
Experiments, scenarios, plans, limits and sensors to begin with.
.TP
.I datasets/
The recordings of the examples.
)";

std::string ManPage() {
  std::string text(kManHead);
  ReplaceAll("@version@", Version(), text);
  for (const Command& command : Commands()) text += ManPageOf(command);
  text += ".SH EXIT STATUS\n";
  for (std::size_t i = 0; i < kExitCodes.size(); ++i) {
    text += ".TP\n.B " + std::to_string(i) + '\n' + std::string(kExitCodes[i]) + '\n';
  }
  return text.append(kManTail);
}

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// The shell line that completes the value of `flag`.
std::string ValueLine(const CommandFlag& flag) {
  std::string how;
  if (!flag.values.empty()) {
    how = "-W '" + Joined(flag.values) + "'";
  } else if (flag.placeholder == "DIR") {
    how = "-d";
  }
  for (const std::string_view kind : {"FILE", "LOG", "CSV", ".yaml", "PATH"}) {
    if (how.empty() && flag.placeholder.find(kind) != std::string::npos) how = "-f";
  }
  return how.empty() ? ":" : "COMPREPLY=($(compgen " + how + " -- \"$cur\"))";
}

std::string CompletionOf(const Command& command) {
  std::string names, values;
  for (const CommandFlag& flag : FlagsOf(command)) {
    names += "--" + flag.name + "= ";
    values += "      --" + flag.name + ") " + ValueLine(flag) + "; return ;;\n";
  }
  std::string text = "  '" + std::string(command.name) + "')\n";
  if (!values.empty()) text += "    case $flag in\n" + values + "    esac\n";
  std::string words = command.more_words == "verb" ? " @verbs@" : "";
  for (const auto& [name, values_of_words] : command.values) {
    if (name == command.more_words) words += ' ' + Joined(values_of_words);
  }
  return text + "    flags='" + names + "--help" + words + "' ;;\n";
}

/// A script for bash, which splits words at `=`: "--to=p" becomes "--to", "=", "p".
constexpr std::string_view kBashCompletion =
    R"script(# bash completion for truetriad; made by `truetriad help --as=bash`
_truetriad() {
  local cur=${COMP_WORDS[COMP_CWORD]} flag='' flags=''
  local verbs='@verbs@'
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    COMPREPLY=($(compgen -W "$verbs" -- "$cur"))
    return
  fi
  if [[ $cur == = ]]; then
    flag=${COMP_WORDS[COMP_CWORD-1]} cur=''
  elif [[ ${COMP_WORDS[COMP_CWORD-1]} == = ]]; then
    flag=${COMP_WORDS[COMP_CWORD-2]}
  elif [[ $cur != -* ]]; then
    flag=${COMP_WORDS[COMP_CWORD-1]}
  fi
  local verb=${COMP_WORDS[1]}
  case $verb in
@second words@  esac
  case $verb in
@cases@  esac
  COMPREPLY=($(compgen -W "$flags" -- "$cur"))
  [[ ${COMPREPLY[0]-} == *= ]] && compopt -o nospace 2>/dev/null
  return 0
}
complete -o filenames -F _truetriad truetriad
)script";

constexpr std::string_view kSecondWords = R"script(  @first@)
    if ((COMP_CWORD == 2)); then
      COMPREPLY=($(compgen -W '@words@' -- "$cur"))
      return
    fi
    verb+=" ${COMP_WORDS[2]}" ;;
)script";

std::string BashCompletion() {
  std::vector<std::string> verbs;
  std::string cases, second_words;
  std::map<std::string, std::vector<std::string>> seconds;
  for (const Command& command : Commands()) {
    const std::string name(command.name), first = name.substr(0, name.find(' '));
    if (verbs.empty() || verbs.back() != first) verbs.push_back(first);
    if (first != name) seconds[first].push_back(name.substr(first.size() + 1));
    cases += CompletionOf(command);
  }
  for (const auto& [first, words] : seconds) {
    std::string text(kSecondWords);
    ReplaceAll("@first@", first, text);
    ReplaceAll("@words@", Joined(words), text);
    second_words += text;
  }
  std::string script(kBashCompletion);
  ReplaceAll("@second words@", second_words, script);
  ReplaceAll("@cases@", cases, script);
  ReplaceAll("@verbs@", Joined(verbs), script);
  return script;
}

constexpr std::array<std::pair<std::string_view, Json (*)()>, 5> kSchemas = {{
    {"experiment", ExperimentSchema},
    {"limits", LimitsPresetSchema},
    {"recording", RecordingSchema},
    {"scenario", ScenarioSchema},
    {"sensors", SensorPresetSchema},
}};

/// The JSON Schema of a kind of YAML file, as in share/truetriad/schema.
Result<VerbResult> Schema(const std::vector<std::string>& words) {
  std::vector<std::string> kinds;
  for (const auto& [kind, schema] : kSchemas) {
    if (words.size() == 1 && words[0] == kind) return Shown(TextOf(schema()));
    kinds.emplace_back(kind);
  }
  return Error(ErrorCode::kMissingArgument, "--as=schema: expected one of " + Joined(kinds));
}

Result<VerbResult> RunHelp(const std::vector<std::string>& words) {
  if (FLAGS_as == "schema") return Schema(words);
  if (FLAGS_as != "text") {
    if (!words.empty())
      return Error(ErrorCode::kConflictingArguments,
                   "--as=" + FLAGS_as + " covers all verbs; leave out the verb");
    TRUETRIAD_RETURN_IF_ERROR(
        CheckOneOf("as", FLAGS_as, {"text", "man", "bash", "schema"}, " is unknown"));
    return Shown(FLAGS_as == "man" ? ManPage() : BashCompletion());
  }
  if (words.empty()) return Shown(OverviewText());
  const std::size_t count = VerbWords(words);
  if (words.size() > count) return Error(ErrorCode::kMissingArgument, "expected one verb");
  TRUETRIAD_ASSIGN_OR_RETURN(const Command* const command,
                             FindCommand(count == 1 ? words[0] : words[0] + " " + words[1]));
  return Shown(HelpText(*command));
}

Result<VerbResult> RunVersion(const std::vector<std::string>&) {
  return VerbResult{.text = "truetriad " + Version() + '\n', .result = {{"version", Version()}}};
}

}  // namespace

std::string OverviewText() {
  Table verbs{.header = {}, .alignment = "ll", .rows = {}};
  for (const Command& command : Commands()) verbs.Add() << command.name << command.summary;
  return ExampleText(CalibrateCommand().examples) +
         "\nUsage: truetriad VERB [LOG …] [--flag=value …]\n\n" + TextOf(verbs) +
         "\nMore about one verb: `truetriad help VERB` or `truetriad VERB --help`. Results go to "
         "stdout,\nmessages to stderr.\n" +
         CommonText();
}

std::string HelpText(const Command& command) {
  std::string text = ExampleText(command.examples) + "\ntruetriad " + std::string(command.name) +
                     ": " + std::string(command.summary) + "\n";
  const std::string details = DetailsOf(command);
  if (!details.empty()) text += '\n' + details;
  text += "\nUsage: " + UsageOf(command) + '\n';
  Table flags{.header = {}, .alignment = "ll", .rows = {}};
  for (const CommandFlag& flag : FlagsOf(command)) {
    flags.Add() << NamesOf(flag) + "=" + flag.placeholder << MeaningOf(flag);
  }
  if (!flags.rows.empty()) text += "\nFlags:\n" + TextOf(flags);
  return text + '\n' + CommonText();
}

Command HelpCommand() {
  return {.name = "help",
          .summary = "How do I use a verb?",
          .examples = R"(build/truetriad help calibrate)",
          .flags = "as",
          .values = {{"as", {"text", "man", "bash", "schema"}}},
          .more_words = "verb",
          .run = RunHelp};
}

Command VersionCommand() {
  return {.name = "version",
          .summary = "Which version is this?",
          .examples = R"(build/truetriad version)",
          .run = RunVersion};
}

}  // namespace truetriad
