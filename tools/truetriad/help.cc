// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/help.h"

#include <algorithm>

#include <gflags/gflags.h>

#include "base/companion.h"

namespace truetriad {
namespace {

constexpr std::size_t kWidth = 100;
constexpr std::string_view kInRepository = "build/truetriad";
constexpr std::string_view kFlagsOfAllVerbs =
    "With every verb: --json, one JSON object on stdout instead of text; --quiet, no notes and no\n"
    "progress; --v=1, the library's log.\n";
constexpr std::string_view kExitCodes =
    "Exit codes: 0 good · 1 wrong usage · 2 bad input, nothing written · 3 readable, but "
    "not\nenough for a calibration · 4 usable, but outside the stated limits\n";

/// `text` in lines of at most kWidth, the second and later ones indented by `indent`; `column` is
/// where the first begins.
std::string Wrapped(std::string_view text, std::size_t column, std::size_t indent) {
  std::string wrapped;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    if (column > indent && column + 1 + end > kWidth) {
      wrapped += '\n' + std::string(indent, ' ');
      column = indent;
    } else if (column > indent) {
      wrapped += ' ';
      ++column;
    }
    wrapped += text.substr(0, end);
    column += end;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return wrapped + '\n';
}

std::string Indented(std::string_view lines) {
  std::string text;
  while (!lines.empty()) {
    const std::size_t end = std::min(lines.find('\n'), lines.size());
    text += "  " + std::string(lines.substr(0, end)) + '\n';
    lines.remove_prefix(std::min(end + 1, lines.size()));
  }
  return text;
}

void ReplaceAll(std::string_view from, std::string_view to, std::string& text) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
}

/// `examples` as they are typed: from the root of the repository, or where the program is
/// installed, in any folder.
std::string ExampleText(std::string_view examples) {
  const std::string_view known = "configs/experiments/joint.yaml";
  const Result<std::string> installed = FindSharedFile(known);
  if (!installed) {
    return "Example, from the root of the repository:\n" + Indented(examples);
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

/// Two columns: names, and what they mean.
std::string Listed(const std::vector<std::pair<std::string, std::string>>& entries) {
  std::size_t widest = 0;
  for (const auto& [name, meaning] : entries) widest = std::max(widest, name.size());
  const std::size_t indent = 2 + widest + 2;
  std::string text;
  for (const auto& [name, meaning] : entries) {
    text +=
        "  " + name + std::string(indent - 2 - name.size(), ' ') + Wrapped(meaning, indent, indent);
  }
  return text;
}

}  // namespace

std::string OverviewText() {
  std::vector<std::pair<std::string, std::string>> verbs;
  for (const Command& command : Commands()) {
    verbs.emplace_back(command.name, command.summary);
  }
  return ExampleText(CalibrateCommand().examples) +
         "\nUsage: truetriad VERB [LOG …] [--flag=value …]\n\n" + Listed(verbs) +
         "\nMore about one verb: `truetriad help VERB` or `truetriad VERB --help`. Results go to "
         "stdout,\nmessages to stderr.\n" +
         std::string(kFlagsOfAllVerbs) + std::string(kExitCodes);
}

std::string HelpText(const Command& command) {
  std::string text = ExampleText(command.examples) + "\ntruetriad " + std::string(command.name) +
                     ": " + std::string(command.summary) + "\n";
  const std::string details = DetailsOf(command);
  if (!details.empty()) text += '\n' + details;
  text += "\nUsage: " + UsageOf(command) + '\n';
  std::vector<std::pair<std::string, std::string>> flags;
  for (const CommandFlag& flag : command.flags) {
    const std::string name(flag.name);
    flags.emplace_back(NamesOf(flag) + "=" + std::string(flag.placeholder),
                       gflags::GetCommandLineFlagInfoOrDie(GflagsName(name).c_str()).description +
                           (flag.required ? " (required)" : ""));
  }
  if (!flags.empty()) text += "\nFlags:\n" + Listed(flags);
  return text + '\n' + std::string(kFlagsOfAllVerbs) + std::string(kExitCodes);
}

}  // namespace truetriad
