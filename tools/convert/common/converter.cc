// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/common/converter.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <sstream>

#include <glog/logging.h>

#include "io/input_guard.h"
#include "model/finding_fields.h"
#include "tools/truetriad/interruption.h"
#include "tree/to_tree.h"

namespace truetriad::convert {
namespace {

std::string program = "truetriad-convert";  // NOLINT: set once before any message.
bool says_json = false;                     // NOLINT: likewise.

std::vector<std::string> SplitList(const std::string& list) {
  std::vector<std::string> items = Split(list, ',');
  std::erase(items, "");
  return items;
}

/// Removes and returns the value of a flag; empty if it is not given.
std::string TakeFlag(std::string_view name, Arguments* arguments) {
  const auto found = arguments->others.find(name);
  return found == arguments->others.end() ? "" : arguments->others.extract(found).mapped();
}

/// Moves the values of the common flags to their members. Error (usage): a number is invalid; there
/// is no input, or too many inputs; there is no output.
Status Check(const Converter& converter, Arguments* arguments) {
  arguments->output = TakeFlag("output", arguments);
  arguments->topics = SplitList(TakeFlag("topic", arguments));
  if (const std::string text = TakeFlag("instance", arguments); !text.empty()) {
    const std::optional<std::uint32_t> instance = WholeNumber(text);
    if (!instance || !std::in_range<int>(*instance)) {
      return Error(ErrorCode::kInvalidArgument,
                   "--instance=" + text + ": expected a whole number, 0 or more");
    }
    arguments->instance = static_cast<int>(*instance);
  }
  if (arguments->inputs.empty())
    return Error(ErrorCode::kMissingArgument, "no log given; name the file to convert");
  if (arguments->inputs.size() > 1 && !converter.takes_several) {
    return Error(ErrorCode::kExtraArgument,
                 "`" + arguments->inputs[1] + "`: give one log at a time");
  }
  if (!arguments->output.empty() || arguments->list) return {};
  return Error(ErrorCode::kMissingArgument,
               "no --output given; name the folder for the recording, or use --list");
}

/// Flags have the form --name=value; other words are inputs.
Result<Arguments> Parse(const Converter& converter, const std::vector<std::string>& words) {
  Arguments arguments;
  for (const std::string& word : words) {
    if (word == "--list" || word == "--json") {
      arguments.list = arguments.list || word == "--list";
    } else if (word.starts_with("--")) {
      const std::size_t equals = std::min(word.find('='), word.size());
      const std::string name = word.substr(2, equals - 2);
      const auto& flags = converter.flags;
      if (name != "output" && std::find(flags.begin(), flags.end(), name) == flags.end()) {
        return Error(ErrorCode::kConflictingArguments,
                     "--" + name + " does not apply to this format");
      }
      if (equals + 1 >= word.size())
        return Error(ErrorCode::kMissingArgument, "--" + name + " needs a value");
      arguments.others[name] = word.substr(equals + 1);
    } else {
      std::error_code missing;
      const bool is_list = converter.takes_several && !std::filesystem::exists(word, missing);
      for (std::string& file : is_list ? SplitList(word) : std::vector<std::string>{word})
        arguments.inputs.push_back(std::move(file));
    }
  }
  TRUETRIAD_RETURN_IF_ERROR(Check(converter, &arguments));
  return arguments;
}

}  // namespace

Result<std::vector<std::string>> InputFiles(const Arguments& arguments, std::string_view ending) {
  namespace fs = std::filesystem;
  std::vector<std::string> files;
  for (const std::string& input : arguments.inputs) {
    std::error_code failure;
    if (!fs::is_directory(input, failure)) {
      files.push_back(input);
      continue;
    }
    std::vector<std::string> found;
    for (fs::directory_iterator entry(input, failure), end; !failure && entry != end;
         entry.increment(failure)) {
      if (entry->path().string().ends_with(ending)) found.push_back(entry->path().string());
    }
    if (found.empty()) {
      return Error(ErrorCode::kUnreadableFile,
                   {input},
                   "is a folder without any file that ends with " + std::string(ending));
    }
    // Sorts by number: log_10 comes after log_9.
    std::sort(found.begin(), found.end(), [](const std::string& a, const std::string& b) {
      return a.size() != b.size() ? a.size() < b.size() : a < b;
    });
    for (std::string& file : found) {
      InputGuard::Add(file);
      files.push_back(std::move(file));
    }
  }
  return files;
}

std::vector<std::string> Split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

std::optional<std::pair<std::uint32_t, std::uint32_t>> ParseRange(std::string_view text) {
  const std::size_t dash = text.find('-');
  const auto first = WholeNumber(text.substr(0, dash));
  const auto last = dash == std::string_view::npos ? first : WholeNumber(text.substr(dash + 1));
  if (!first || !last || *first < 1 || *last < *first) return std::nullopt;
  return std::pair(*first, *last);
}

std::optional<double> ParseRate(std::string_view text) {
  if (!text.ends_with("Hz")) return std::nullopt;
  text.remove_suffix(2);
  const std::optional<double> rate_hz = ParseWhole<double>(text);
  return rate_hz && *rate_hz > 0.0 && *rate_hz < 1e9 ? rate_hz : std::nullopt;
}

int Report(const Error& error) {
  Note(error.message);
  if (says_json) std::fputs(TextOf({{"error", ToTree(error)}}).c_str(), stdout);
  std::fflush(stdout);
  return static_cast<int>(error.kind());
}

int RunConverter(const Converter& converter, int argc, char** argv) {
  program = "truetriad-convert-" + std::string(converter.format);
  FLAGS_logtostderr = true;
  FLAGS_minloglevel = google::GLOG_FATAL;
  google::InitGoogleLogging(argc > 0 ? argv[0] : program.c_str());
  const std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  says_json = std::find(words.begin(), words.end(), "--json") != words.end();
  try {
    const Result<Arguments> arguments = Parse(converter, words);
    if (!arguments) return Report(arguments.error());
    const InputGuard guard;
    for (const std::string& input : arguments->inputs) InputGuard::Add(input);
    const Status status = converter.run(*arguments);
    if (!status) return Report(status.error());
  } catch (const Interrupted&) {
    EndAsInterrupted();
  } catch (const std::exception& failure) {
    return Report(Error(ErrorCode::kDamagedFile, failure.what()));
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    return Report(Error(ErrorCode::kCannotWrite,
                        "stdout: cannot be written: " + std::string(std::strerror(errno))));
  }
  return 0;
}

std::string ListOf(const std::vector<std::string>& names, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), most); ++i) {
    text += (i > 0 ? ", " : "") + PrintableLine(names[i]);
  }
  if (names.size() > most) text += " and " + std::to_string(names.size() - most) + " more";
  return text.empty() ? "none" : text;
}

const std::string& ProgramName() { return program; }

void Note(const std::string& message) {
  std::fprintf(stderr, "%s: %s\n", program.c_str(), message.c_str());
}

}  // namespace truetriad::convert
