// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/command_line.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <set>
#include <string_view>

#include <gflags/gflags.h>
#include <glog/logging.h>

#include "base/spelling.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/help.h"

namespace truetriad {
namespace {

/// glog's own flag, which every verb takes: what the library logs.
constexpr std::string_view kVerbosity = "v";

bool IsHelp(const std::string& argument) { return argument == "--help" || argument == "-h"; }

bool IsFlag(const std::string& argument) { return argument.size() > 1 && argument[0] == '-'; }

const CommandFlag* FindFlag(const Command& command, std::string_view name) {
  const auto found = std::find_if(command.flags.begin(), command.flags.end(), [&](const auto& f) {
    return GflagsName(f.name) == GflagsName(name);
  });
  return found == command.flags.end() ? nullptr : &*found;
}

bool IsBoolean(const std::string& name) {
  gflags::CommandLineFlagInfo info;
  return gflags::GetCommandLineFlagInfo(GflagsName(name).c_str(), &info) && info.type == "bool";
}

Error UnknownFlag(const Command& command, const std::string& name) {
  std::vector<std::string_view> known;
  for (const CommandFlag& flag : command.flags) known.push_back(flag.name);
  const bool of_another =
      std::any_of(Commands().begin(), Commands().end(), [&](const Command& other) {
        return FindFlag(other, name) != nullptr;
      });
  return UsageError(of_another ? "--" + name + " does not apply to this verb"
                               : "--" + name + " is not a flag" + DidYouMean(name, known));
}

/// Sets the command's flags from `arguments`; the words that are no flags go to `words`. gflags'
/// own parser would take the flags of every verb and of every library, the last one winning.
Status SetFlags(const Command& command,
                const std::vector<std::string>& arguments,
                std::vector<std::string>* words) {
  std::set<std::string> given;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (!IsFlag(arguments[i])) {
      if (!command.takes_words) {
        return UsageError("`" + arguments[i] + "` is not a flag; expected --name=value");
      }
      words->push_back(arguments[i]);
      continue;
    }
    const std::size_t begin = arguments[i].find_first_not_of('-');
    const std::size_t equals = arguments[i].find('=');
    if (begin > 2 || begin >= equals) return UsageError("`" + arguments[i] + "` is not a flag");
    const std::string name = arguments[i].substr(begin, equals - begin);
    if (name != kVerbosity && FindFlag(command, name) == nullptr) return UnknownFlag(command, name);
    if (!given.insert(GflagsName(name)).second) {
      return UsageError("--" + name + " is given twice; separate several values by commas");
    }
    std::string value;
    if (equals != std::string::npos) {
      value = arguments[i].substr(equals + 1);
    } else if (IsBoolean(name)) {
      value = "true";
    } else if (i + 1 < arguments.size() && !IsFlag(arguments[i + 1])) {
      value = arguments[++i];
    }
    if (value.empty()) return UsageError("--" + name + " has no value; give one after `=`");
    if (gflags::SetCommandLineOption(GflagsName(name).c_str(), value.c_str()).empty()) {
      return UsageError("`" + arguments[i] + "` is invalid; expected " +
                        (IsBoolean(name) ? "true or false" : "a number"));
    }
  }
  for (const CommandFlag& flag : command.flags) {
    if (flag.required && !given.contains(GflagsName(flag.name))) {
      return UsageError("--" + std::string(flag.name) + "=" + std::string(flag.placeholder) +
                        " is missing; this verb needs it");
    }
  }
  return {};
}

int Fail(const std::string& who, const Error& error) {
  std::fprintf(stderr, "%s: %s\n", who.c_str(), error.message.c_str());
  return static_cast<int>(error.code);
}

int Print(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  return kExitGood;
}

int RunVerb(const std::vector<std::string>& arguments) {
  const std::string& verb = arguments[0];
  if (IsHelp(verb)) return Print(OverviewText());
  const Result<const Command*> command = FindCommand(verb == "--version" ? "version" : verb);
  if (!command) return Fail("truetriad", command.error());
  const std::vector<std::string> rest(arguments.begin() + 1, arguments.end());
  if (std::any_of(rest.begin(), rest.end(), IsHelp)) return Print(HelpText(**command));

  const std::string who = "truetriad " + std::string((*command)->name);
  std::vector<std::string> words;
  if (const Status set = SetFlags(**command, rest, &words); !set) {
    return Fail(who, UsageError(set.error().message + "; see `" + who + " --help`"));
  }
  if (FLAGS_v > 0) FLAGS_minloglevel = google::GLOG_INFO;
  const Result<int> exit_code = (*command)->run(words);
  return exit_code ? *exit_code : Fail(who, exit_code.error());
}

}  // namespace

int RunCommandLine(const std::vector<std::string>& arguments) {
  if (arguments.empty()) {
    std::fputs(OverviewText().c_str(), stderr);
    return static_cast<int>(ErrorCode::kUsage);
  }
  const int exit_code = RunVerb(arguments);
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    return Fail("truetriad",
                BadInputError("stdout: cannot be written: " + std::string(std::strerror(errno))));
  }
  return exit_code;
}

}  // namespace truetriad
