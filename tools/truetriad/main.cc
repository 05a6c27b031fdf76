// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <optional>
#include <set>
#include <string_view>

#include <gflags/gflags.h>
#include <glog/logging.h>
#include <malloc.h>
#include <unistd.h>

#include "base/spelling.h"
#include "base/utf8.h"
#include "fleet/unit_work.h"
#include "io/input_guard.h"
#include "model/finding_fields.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_progress.h"
#include "tools/truetriad/progress.h"
#include "tree/to_tree.h"

namespace truetriad {
namespace {

/// Flags of every verb; `v` belongs to glog and sets the logging level of the library.
constexpr std::array<std::string_view, 3> kCommonFlags = {"v", "json", "quiet"};

bool IsCommon(std::string_view name) {
  return std::find(kCommonFlags.begin(), kCommonFlags.end(), name) != kCommonFlags.end();
}

bool IsHelp(const std::string& argument) { return argument == "--help" || argument == "-h"; }

bool IsFlag(const std::string& argument) { return argument.size() > 1 && argument[0] == '-'; }

// The name of a flag such as "--output=DIR", and its value if it states one.
struct StatedFlag {
  std::string name;
  std::optional<std::string> value;
};

std::optional<StatedFlag> ParseFlag(const std::string& argument) {
  if (!IsFlag(argument)) return std::nullopt;
  const std::size_t begin = argument.find_first_not_of('-');
  const std::size_t equals = argument.find('=');
  if (begin > 2 || begin >= equals) return std::nullopt;
  StatedFlag stated{argument.substr(begin, equals - begin), std::nullopt};
  if (equals != std::string::npos) stated.value = argument.substr(equals + 1);
  return stated;
}

// Finds a flag by its name or letter.
std::optional<CommandFlag> FindFlag(const Command& command, std::string_view name) {
  for (CommandFlag& flag : FlagsOf(command)) {
    const bool is_letter = flag.letter && name == std::string_view(&*flag.letter, 1);
    if (is_letter || GflagsName(flag.name) == GflagsName(name)) return std::move(flag);
  }
  return std::nullopt;
}

bool IsBoolean(const std::string& name) {
  gflags::CommandLineFlagInfo info;
  return gflags::GetCommandLineFlagInfo(name.c_str(), &info) && info.type == "bool";
}

Error UnknownFlag(const Command& command, const std::string& name) {
  const auto has_it = [&](const Command& other) { return FindFlag(other, name).has_value(); };
  if (std::any_of(Commands().begin(), Commands().end(), has_it)) {
    return Error(ErrorCode::kUnknownFlag, "--" + name + " does not apply to this verb");
  }
  std::vector<std::string> flags;
  for (const CommandFlag& flag : FlagsOf(command)) flags.push_back("--" + flag.name);
  return Error(
      ErrorCode::kUnknownFlag,
      "--" + name + " is not a flag" + DidYouMean("--" + name, {flags.begin(), flags.end()}));
}

// Sets a command's flags from arguments. The parser of gflags would accept flags of other verbs and
// of libraries, and would silently use the last value of a repeated flag.
class FlagSetter {
 public:
  FlagSetter(const Command& command, const std::vector<std::string>& arguments)
      : command_(command), arguments_(arguments) {}

  // Guards input files against being replaced. Input files are all values of flags that name files,
  // except outputs.
  void GuardInputs() const {
    for (const std::string& name : given_) {
      std::string value;
      if (name == "output" || name == "report") continue;
      gflags::GetCommandLineOption(name.c_str(), &value);
      InputGuard::Add(value);
      for (const std::string& part : CommaSeparated(value)) InputGuard::Add(part);
    }
    for (const std::string& word : more_words_) InputGuard::Add(word);
  }

  // Returns the words that are not values of a flag.
  Result<std::vector<std::string>> Set() {
    for (; at_ < arguments_.size(); ++at_) {
      if (!only_words_ && arguments_[at_] == "--") {
        only_words_ = true;
      } else if (!only_words_ && IsFlag(arguments_[at_])) {
        TRUETRIAD_RETURN_IF_ERROR(SetFlag());
      } else {
        TRUETRIAD_RETURN_IF_ERROR(TakeWord());
      }
    }
    for (const CommandFlag& flag : FlagsOf(command_)) {
      const bool has_words = flag.name == command_.more_words && !more_words_.empty();
      if (!flag.required || has_words || given_.contains(GflagsName(flag.name))) continue;
      const auto& words = command_.words;
      const bool is_word = std::find(words.begin(), words.end(), flag.name) != words.end();
      return Error(
          ErrorCode::kMissingArgument,
          is_word ? flag.placeholder + " is missing; expected `" + UsageOf(command_) + "`"
                  : "--" + flag.name + "=" + flag.placeholder + " is missing; this verb needs it");
    }
    return more_words_;
  }

 private:
  // Assigns a word to the first of the verb's word flags that is not given; collects further words.
  Status TakeWord() {
    const std::string& word = arguments_[at_];
    for (const std::string_view name : command_.words) {
      if (!given_.contains(GflagsName(name))) return Give(*FindFlag(command_, name), word);
    }
    if (!command_.more_words.empty()) {
      more_words_.push_back(word);
      return {};
    }
    return Error(ErrorCode::kExtraArgument,
                 "`" + word + "` is one word too many; expected `" + UsageOf(command_) + "`");
  }

  Status SetFlag() {
    const std::string& argument = arguments_[at_];
    const std::optional<StatedFlag> stated = ParseFlag(argument);
    if (!stated) return Error(ErrorCode::kUnknownFlag, "`" + argument + "` is not a flag");
    if (IsCommon(stated->name)) {
      return SetGflag(stated->name, stated->value.value_or(IsBoolean(stated->name) ? "true" : ""));
    }
    const std::optional<CommandFlag> flag = FindFlag(command_, stated->name);
    if (!flag) return UnknownFlag(command_, stated->name);
    if (given_.contains(GflagsName(flag->name)) && !flag->repeats) {
      return Error(ErrorCode::kConflictingArguments,
                   "--" + flag->name + " is given twice; separate several values by commas");
    }
    if (stated->value) return Give(*flag, *stated->value);
    if (IsBoolean(GflagsName(flag->name))) return Give(*flag, "true");
    if (at_ + 1 < arguments_.size() && !IsAnotherFlag(arguments_[at_ + 1])) {
      return Give(*flag, arguments_[++at_]);
    }
    return Give(*flag, "");
  }

  // Whether an argument is a flag. If not, it is the value of a flag and may begin with a hyphen.
  bool IsAnotherFlag(const std::string& argument) const {
    const std::optional<StatedFlag> stated = ParseFlag(argument);
    return stated && (argument.starts_with("--") || FindFlag(command_, stated->name).has_value());
  }

  Status Give(const CommandFlag& flag, const std::string& value) {
    const std::string name = GflagsName(flag.name);
    const bool is_first = given_.insert(name).second;
    if (value.empty()) {
      return Error(ErrorCode::kMissingArgument,
                   "--" + flag.name + " has no value; give one after `=`");
    }
    if (flag.placeholder == "PAGE.html" && !value.ends_with(".html") && !value.ends_with(".htm")) {
      return BadValue(flag.name, value, " is not the name of an HTML page; end it in .html");
    }
    std::string before;
    if (!is_first && gflags::GetCommandLineOption(name.c_str(), &before)) before += '\n';
    return SetGflag(name, before + value);
  }

  static Status SetGflag(const std::string& name, const std::string& value) {
    if (!gflags::SetCommandLineOption(name.c_str(), value.c_str()).empty()) return {};
    const std::string expected = IsBoolean(name) ? "true or false" : "a number";
    return BadValue(name, value, " is invalid; expected " + expected);
  }

  const Command& command_;
  const std::vector<std::string>& arguments_;
  std::size_t at_ = 0;
  bool only_words_ = false;
  std::set<std::string> given_;
  std::vector<std::string> more_words_;
};

/// Whether `stream` is a terminal that shows colours (https://no-color.org).
bool ShowsColours(std::FILE* stream) {
  const char* const no_color = std::getenv("NO_COLOR");
  const char* const terminal = std::getenv("TERM");
  return isatty(fileno(stream)) == 1 && (no_color == nullptr || *no_color == '\0') &&
         terminal != nullptr && std::string_view(terminal) != "dumb";
}

std::string Coloured(std::FILE* stream, Grade grade, const std::string& text) {
  if (!ShowsColours(stream)) return text;
  const std::string colour = grade == Grade::kGood      ? "2"
                             : grade == Grade::kNeutral ? "4"
                             : grade == Grade::kCaution ? "3"
                                                        : "1";
  return "\033[1;3" + colour + "m" + text + "\033[0m";
}

void Say(std::string_view verb, const std::string& message) {
  const std::string who = "truetriad" + (verb.empty() ? "" : " " + std::string(verb));
  std::fprintf(stderr,
               "%s %s\n",
               Coloured(stderr, Grade::kBad, who + ":").c_str(),
               Printable(message).c_str());
}

/// Prints the result of a run for other programs: a single JSON object on stdout.
void PrintJson(const Json& json) { std::fputs(TextOf(json).c_str(), stdout); }

int Fail(std::string_view verb, const Error& error) {
  const int exit_code = static_cast<int>(error.kind());
  if (FLAGS_json) {
    PrintJson({{"verb", verb}, {"exit", exit_code}, {"error", ToTree(error)}});
  } else {
    Say(verb, error.message);
  }
  return exit_code;
}

int Show(std::string_view verb, const VerbResult& result) {
  if (!FLAGS_json) {
    std::string text = result.text;
    if (result.grade) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      text.replace(0, end, Coloured(stdout, *result.grade, text.substr(0, end)));
    }
    std::fputs(text.c_str(), stdout);
    if (!result.failure.empty()) Say(verb, result.failure);
    return result.exit_code;
  }
  Json json = {{"verb", verb}, {"exit", result.exit_code}};
  if (result.verdict) json["verdict"] = VerdictName(*result.verdict);
  if (result.outcome) json["outcome"] = OutcomeName(*result.outcome);
  json["findings"] = ToTree(result.findings);
  json["result"] = result.result;
  PrintJson(json);
  return result.exit_code;
}

/// Whether --json is given. Asked before flags are parsed, so that errors about flags are JSON,
/// too.
bool AsksForJson(const std::vector<std::string>& arguments) {
  return std::any_of(arguments.begin(), arguments.end(), [](const std::string& argument) {
    return argument == "--json" || argument == "--json=true";
  });
}

int RunVerb(const std::vector<std::string>& arguments) {
  const auto words_of_verb = static_cast<std::ptrdiff_t>(VerbWords(arguments));
  std::string verb = arguments[0];
  if (words_of_verb > 1) verb += " " + arguments[1];
  FLAGS_json = AsksForJson(arguments);
  if (IsHelp(verb)) return Show("help", Shown(OverviewText()));
  const Result<const Command*> command = FindCommand(verb == "--version" ? "version" : verb);
  if (!command) return Fail("", command.error());
  const std::vector<std::string> rest(arguments.begin() + words_of_verb, arguments.end());
  if (std::any_of(rest.begin(), rest.end(), IsHelp))
    return Show("help", Shown(HelpText(**command)));

  const std::string_view name = (*command)->name;
  FlagSetter flags(**command, rest);
  const Result<std::vector<std::string>> words = flags.Set();
  if (!words) {
    return Fail(
        name,
        Error(words.error().code,
              words.error().message + "; see `truetriad " + std::string(name) + " --help`"));
  }
  if (FLAGS_quiet) ProgressLine::Silence();
  if (FLAGS_v > 0) FLAGS_minloglevel = google::GLOG_INFO;
  const InputGuard guard;
  flags.GuardInputs();
  const Result<VerbResult> result = (*command)->run(*words);
  return result ? Show(name, *result) : Fail(name, result.error());
}

/// Runs `truetriad ARGUMENTS`; returns the exit code. Errors are one message on stderr.
int RunCommandLine(const std::vector<std::string>& arguments) {
  if (arguments.empty()) {
    std::fputs(OverviewText().c_str(), stderr);
    return static_cast<int>(ErrorKind::kUsage);
  }
  if (arguments[0] == kFleetWorker) return fleet::ServeAsWorker(fleet::WorkerPool::kStream);
  const int exit_code = RunVerb(arguments);
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    return Fail("",
                Error(ErrorCode::kCannotWrite,
                      "stdout: cannot be written: " + std::string(std::strerror(errno))));
  }
  return exit_code;
}

// Keeps the pages of freed memory, which is used again soon: to map and clear pages anew took a
// tenth of the time of a calibration.
void KeepFreedMemory() {
  constexpr int kMiB = 1 << 20;  // Blocks below 32 MiB stay in the heap.
  mallopt(M_MMAP_THRESHOLD, 32 * kMiB);
  mallopt(M_TRIM_THRESHOLD, 32 * kMiB);
  mallopt(M_TOP_PAD, kMiB);
}

}  // namespace
}  // namespace truetriad

int main(int argc, char** argv) {
  truetriad::KeepFreedMemory();
  // Logs of library and solver are for developers: they need --v, and never go to a file.
  FLAGS_logtostderr = true;
  FLAGS_minloglevel = google::GLOG_FATAL;
  google::InitGoogleLogging(argv[0]);
  // A file above the shell's size limit becomes a write error with a message, not a signal.
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    return truetriad::RunCommandLine({argv + 1, argv + argc});
  } catch (const std::bad_alloc&) {
    std::fputs(
        "truetriad: memory is short; close other programs, raise `ulimit -v`, or give a shorter "
        "log\n",
        stderr);
    return 2;
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "truetriad: %s\n", failure.what());
    return 2;
  }
}
