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

/// Thrown where rows are added once a signal wants the program to end: what is half written goes.
struct Interrupted {};

/// What `truetriad convert` hands on of its flags.
struct Arguments {
  std::vector<std::string> inputs;                         ///< One where the format takes one.
  std::string output;                                      ///< Empty only with `list`.
  std::vector<std::string> topics;                         ///< Empty: the converter's choice.
  std::optional<int> instance;                             ///< Range: >= 0.
  bool list = false;                                       ///< Only say what the log holds.
  std::map<std::string, std::string, std::less<>> others;  ///< "columns", "units", "layout".
};

/// One converter program.
struct Converter {
  std::string_view format;  ///< "dataflash": the program is truetriad-convert-dataflash.
  std::vector<std::string_view> flags;  ///< That apply beside --output, --list and --json: "topic".
  bool takes_several = false;           ///< Inputs, in one or separated by commas.
  /// Converts or lists. Error: usage, or bad input; then nothing has been written.
  std::function<Status(const Arguments& arguments)> run = {};
};

/// The `main` of a converter. Exit code: 0 good, 1 usage, 2 bad input.
int RunConverter(const Converter& converter, int argc, char** argv);

/// Bounds the memory of this process by what files of this size can sensibly hold.
void BoundMemory(const std::vector<std::string>& paths);

/// The inputs, where one that is a folder stands for the files in it that end with `ending`
/// (".db3"), by the numbers in their names. Error: a folder without any.
Result<std::vector<std::string>> InputFiles(const Arguments& arguments, std::string_view ending);

/// What stands between separators; an empty item at the end is none.
std::vector<std::string> Split(const std::string& text, char separator);
/// The number that all of `text` is.
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
/// "2-4" or "3" as {2, 4} or {3, 3}, if the first is not 0 and not above the second.
std::optional<std::pair<std::uint32_t, std::uint32_t>> ParseRange(std::string_view text);
/// 100 of "100Hz"; unset where it is no rate up to that of a clock of nanoseconds.
std::optional<double> ParseRate(std::string_view text);

/// Says why there is nothing: on stderr, and with --json as an object on stdout. The exit code.
int Report(const Error& error);

/// "/a, /b and 3 more", for messages; nothing of a damaged name can reach the terminal as a control
/// character.
std::string ListOf(const std::vector<std::string>& names, std::size_t most = 12);
/// "truetriad-convert-ros1".
const std::string& ProgramName();
/// Says something on stderr, after the program's name.
void Note(const std::string& message);

}  // namespace truetriad::convert
