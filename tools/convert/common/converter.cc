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

#include "base/spelling.h"
#include "io/input_guard.h"
#include "model/finding_fields.h"
#include "tools/truetriad/interruption.h"
#include "tree/to_tree.h"

namespace truetriad::convert {
namespace {

std::string program = "truetriad-convert";  // NOLINT: set once, before anything is said.
bool says_json = false;                     // NOLINT: as well.

std::string Usage(const Converter& converter) {
  const std::string input = converter.takes_several ? " INPUT…" : " INPUT";
  std::string flags = input + " --output=DIR";
  if (converter.takes_topics) flags += " [--topic=NAME,…]";
  if (converter.takes_instance) flags += " [--instance=N]";
  for (const std::string_view flag : converter.others) flags += " [--" + std::string(flag) + "=…]";
  return program + flags + "\n" + program + input + " --list\n";
}

std::string Help(const Converter& converter) {
  return "Usage:\n" + Usage(converter) + "\nConverts " + std::string(converter.input) +
         " to DIR/recording.yaml and its CSV files, the input of every truetriad verb.\n"
         "--list shows what the log contains and writes nothing. --json: an error is an object on "
         "stdout, too.\n" +
         std::string(converter.details) + "\nExit codes: 0 good, 1 usage, 2 bad input.\n";
}

std::vector<std::string> SplitList(const std::string& list) {
  std::vector<std::string> items = Split(list, ',');
  std::erase(items, "");
  return items;
}

Status SetFlag(const Converter& converter,
               const std::string& name,
               const std::string& value,
               Arguments* arguments) {
  if (name == "output") {
    arguments->output = value;
  } else if (name == "topic" && converter.takes_topics) {
    arguments->topics = SplitList(value);
  } else if (name == "instance" && converter.takes_instance) {
    const std::optional<std::uint32_t> instance = WholeNumber(value);
    if (!instance || !std::in_range<int>(*instance)) {
      return Error(ErrorCode::kInvalidArgument,
                   "--instance=" + value + ": expected a whole number, 0 or more");
    }
    arguments->instance = static_cast<int>(*instance);
  } else if (std::find(converter.others.begin(), converter.others.end(), name) !=
             converter.others.end()) {
    arguments->others[name] = value;
  } else if (name == "topic" || name == "instance") {
    return Error(ErrorCode::kConflictingArguments, "--" + name + " does not apply to this format");
  } else {
    std::vector<std::string_view> known = {"output", "list", "help"};
    if (converter.takes_topics) known.push_back("topic");
    if (converter.takes_instance) known.push_back("instance");
    known.insert(known.end(), converter.others.begin(), converter.others.end());
    return Error(ErrorCode::kUnknownFlag, "--" + name + " is not a flag" + DidYouMean(name, known));
  }
  return {};
}

Result<Arguments> Parse(const Converter& converter, const std::vector<std::string>& words) {
  Arguments arguments;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "--list") {
      arguments.list = true;
    } else if (word == "--json") {
      continue;  // Has been read.
    } else if (word.starts_with("--")) {
      const std::size_t equals = word.find('=');
      const std::string name = word.substr(2, equals == std::string::npos ? equals : equals - 2);
      std::string value;
      if (equals != std::string::npos) {
        value = word.substr(equals + 1);
      } else if (i + 1 < words.size() && !words[i + 1].starts_with("--")) {
        value = words[++i];
      }
      if (value.empty())
        return Error(ErrorCode::kMissingArgument,
                     std::string("--").append(name).append(" needs a value"));
      TRUETRIAD_RETURN_IF_ERROR(SetFlag(converter, name, value, &arguments));
    } else if (arguments.input.empty()) {
      std::error_code missing;
      const bool is_list = converter.takes_several && !std::filesystem::exists(word, missing);
      const std::vector<std::string> files =
          is_list ? SplitList(word) : std::vector<std::string>{word};
      if (files.empty()) continue;
      arguments.input = files[0];
      arguments.more_inputs.assign(files.begin() + 1, files.end());
    } else if (converter.takes_several) {
      arguments.more_inputs.push_back(word);
    } else {
      return Error(ErrorCode::kExtraArgument, "`" + word + "`: give one log at a time");
    }
  }
  if (arguments.input.empty())
    return Error(ErrorCode::kMissingArgument, "no log given; name the file to convert");
  if (arguments.output.empty() && !arguments.list) {
    return Error(
        ErrorCode::kMissingArgument,
        "no --output given; name the folder for the recording (--output=DIR), or use --list");
  }
  return arguments;
}

}  // namespace

Result<std::vector<std::string>> InputFiles(const Arguments& arguments, std::string_view ending) {
  namespace fs = std::filesystem;
  std::vector<std::string> inputs = {arguments.input};
  inputs.insert(inputs.end(), arguments.more_inputs.begin(), arguments.more_inputs.end());
  std::vector<std::string> files;
  for (const std::string& input : inputs) {
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
    // log_10 comes after log_9.
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
  // A process of its own may have said it.
  if (!error.message.empty()) {
    Note(error.message);
    if (says_json) std::fputs(TextOf({{"error", ToTree(error)}}).c_str(), stdout);
  }
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
  for (const std::string& word : words) {
    if (word == "--help" || word == "-h") {
      std::fputs(Help(converter).c_str(), stdout);
      return 0;
    }
  }
  try {
    const Result<Arguments> arguments = Parse(converter, words);
    if (!arguments) {
      const int code = Report(arguments.error());
      std::fputs(("Usage:\n" + Usage(converter)).c_str(), stderr);
      return code;
    }
    const InputGuard guard;
    InputGuard::Add(arguments->input);
    for (const std::string& input : arguments->more_inputs) InputGuard::Add(input);
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

std::string Printable(std::string_view text) {
  std::string printable(text);
  for (char& c : printable) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte >= 0x7f) c = '?';
  }
  return printable;
}

std::string ListOf(const std::vector<std::string>& names, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), most); ++i) {
    text += (i > 0 ? ", " : "") + Printable(names[i]);
  }
  if (names.size() > most) text += " and " + std::to_string(names.size() - most) + " more";
  return text.empty() ? "none" : text;
}

std::string Count(std::uint64_t count, std::string_view one, std::string_view many) {
  return std::to_string(count) + " " + std::string(count == 1 ? one : many);
}

const std::string& ProgramName() { return program; }

void Note(const std::string& message) {
  std::fprintf(stderr, "%s: %s\n", program.c_str(), message.c_str());
}

}  // namespace truetriad::convert
