// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/completion.h"

#include <map>
#include <string_view>
#include <vector>

#include "tools/truetriad/command.h"

namespace truetriad {
namespace {

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// What completes the value of `flag`, as a line of shell.
std::string ValueLine(const CommandFlag& flag) {
  if (!flag.values.empty())
    return "COMPREPLY=($(compgen -W '" + Joined(flag.values) + "' -- \"$cur\"))";
  if (flag.placeholder == "true|false") return "COMPREPLY=($(compgen -W 'true false' -- \"$cur\"))";
  if (flag.placeholder == "DIR") return "COMPREPLY=($(compgen -d -- \"$cur\"))";
  for (const std::string_view kind : {"FILE", "LOG", "CSV", ".yaml", "PATH"}) {
    if (flag.placeholder.find(kind) != std::string_view::npos) {
      return "COMPREPLY=($(compgen -f -- \"$cur\"))";
    }
  }
  return ":";
}

std::string VerbCase(const Command& command) {
  std::vector<std::string> names;
  std::string values;
  for (const CommandFlag& flag : command.flags) {
    const std::string name = "--" + std::string(flag.name);
    names.push_back(name + "=");
    values += "      " + name + ") " + ValueLine(flag) + "; return ;;\n";
  }
  names.emplace_back("--help");
  std::string text = "  '" + std::string(command.name) + "')\n";
  if (!values.empty()) text += "    case $flag in\n" + values + "    esac\n";
  return text + "    flags='" + Joined(names) + "' ;;\n";
}

/// Verbs of two words.
std::string SecondCases(const std::map<std::string, std::string>& seconds) {
  std::string cases;
  for (const auto& [first, words] : seconds) {
    cases += "  " + first +
             ")\n"
             "    if ((COMP_CWORD == 2)); then\n"
             "      COMPREPLY=($(compgen -W '" +
             words.substr(1) +
             "' -- \"$cur\"))\n"
             "      return\n"
             "    fi\n"
             "    verb+=\" ${COMP_WORDS[2]}\" ;;\n";
  }
  return cases;
}

}  // namespace

std::string BashCompletion() {
  std::vector<std::string> verbs;
  std::string cases;
  std::map<std::string, std::string> seconds;
  for (const Command& command : Commands()) {
    const std::string first(command.name.substr(0, command.name.find(' ')));
    if (verbs.empty() || verbs.back() != first) verbs.push_back(first);
    if (first != command.name) seconds[first] += std::string(command.name.substr(first.size()));
    cases += VerbCase(command);
  }
  // bash splits words at `=`: "--to=p" arrives as "--to", "=", "p".
  return "# bash completion for truetriad; made by `truetriad help --as=bash`\n"
         "_truetriad() {\n"
         "  local cur=${COMP_WORDS[COMP_CWORD]} flag='' flags=''\n"
         "  local verbs='" +
         Joined(verbs) +
         "'\n"
         "  COMPREPLY=()\n"
         "  if ((COMP_CWORD == 1)); then\n"
         "    COMPREPLY=($(compgen -W \"$verbs\" -- \"$cur\"))\n"
         "    return\n"
         "  fi\n"
         "  if [[ $cur == = ]]; then\n"
         "    flag=${COMP_WORDS[COMP_CWORD-1]} cur=''\n"
         "  elif [[ ${COMP_WORDS[COMP_CWORD-1]} == = ]]; then\n"
         "    flag=${COMP_WORDS[COMP_CWORD-2]}\n"
         "  elif [[ $cur != -* ]]; then\n"
         "    flag=${COMP_WORDS[COMP_CWORD-1]}\n"
         "  fi\n"
         "  if [[ ${COMP_WORDS[1]} == help && $flag != --* ]]; then\n"
         "    COMPREPLY=($(compgen -W \"$verbs --as=\" -- \"$cur\"))\n"
         "    return\n"
         "  fi\n"
         "  local verb=${COMP_WORDS[1]}\n"
         "  case $verb in\n" +
         SecondCases(seconds) +
         "  esac\n"
         "  case $verb in\n" +
         cases +
         "  esac\n"
         "  COMPREPLY=($(compgen -W \"$flags\" -- \"$cur\"))\n"
         "  [[ ${COMPREPLY[0]-} == *= ]] && compopt -o nospace 2>/dev/null\n"
         "  return 0\n"
         "}\n"
         "complete -o filenames -F _truetriad truetriad\n";
}

}  // namespace truetriad
