// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "base/utf8.h"
#include "truetriad/base/result.h"

namespace truetriad::convert {

/// Thrown at the next row after a signal to end the program; incomplete files are then removed.
struct Interrupted {};

/// The flags that `truetriad convert` passes on.
struct Arguments {
  std::vector<std::string> inputs;                         ///< Several only if the format allows.
  std::string output;                                      ///< Empty only with `list`.
  std::vector<std::string> topics;                         ///< Empty: the converter's choice.
  std::optional<int> instance;                             ///< Range: >= 0.
  bool list = false;                                       ///< Only lists the contents of the log.
  std::map<std::string, std::string, std::less<>> others;  ///< "columns", "units", "layout".
};

/// One converter program.
struct Converter {
  std::string_view format;  ///< "dataflash": the program is truetriad-convert-dataflash.
  std::vector<std::string_view> flags;  ///< In addition to --output, --list and --json: "topic".
  bool takes_several = false;           ///< Several inputs, separated by commas, are one recording.
  /// Converts or lists the inputs. Error: usage, or bad input; then nothing is written.
  std::function<Status(const Arguments& arguments)> run = {};
};

/// The `main` of a converter. Exit code: 0 success, 1 usage, 2 bad input.
int RunConverter(const Converter& converter, int argc, char** argv);

/// Limits the memory of this process to what files as large as those of `paths` can need.
void BoundMemory(const std::vector<std::string>& paths);

/// The input files. A folder is replaced by its files that end with `ending` (".db3"), sorted by
/// the numbers in their names. Error: a folder has no such file.
Result<std::vector<std::string>> InputFiles(const Arguments& arguments, std::string_view ending);

/// The items between separators; an empty last item is dropped.
std::vector<std::string> Split(const std::string& text, char separator);
/// Parses `text` as a number; unset unless the whole text is one number.
template <typename Number>
std::optional<Number> ParseWhole(std::string_view text) {
  Number number{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}
inline std::optional<std::uint32_t> WholeNumber(std::string_view text) {
  return ParseWhole<std::uint32_t>(text);
}
/// "2-4" or "3" as {2, 4} or {3, 3}; unset if the first number is 0 or above the second.
std::optional<std::pair<std::uint32_t, std::uint32_t>> ParseRange(std::string_view text);
/// 100 of "100Hz"; unset if the text is not a rate above 0 and below 1e9 Hz.
std::optional<double> ParseRate(std::string_view text);

/// Reports the error on stderr, and with --json as an object on stdout. Returns the exit code.
int Report(const Error& error);

/// "/a, /b and 3 more", for messages. Control characters of damaged names are replaced, so that
/// they cannot reach a terminal.
std::string ListOf(const std::vector<std::string>& names, std::size_t most = 12);
/// The name of this program, "truetriad-convert-ros1".
const std::string& ProgramName();
/// Prints a message to stderr, after the program's name.
void Note(const std::string& message);

}  // namespace truetriad::convert
