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

#include "truetriad/base/result.h"

namespace truetriad::convert {

/// Thrown where rows are added once a signal wants the program to end: what is half written goes.
struct Interrupted {};

/// What a converter was asked for: `truetriad-convert-FORMAT INPUT --output=DIR [--topic=A,B]
/// [--instance=N] [--list]`.
struct Arguments {
  std::string input;
  std::vector<std::string> more_inputs;                    ///< Where the format takes several.
  std::string output;                                      ///< Empty only with `list`.
  std::vector<std::string> topics;                         ///< Empty: the converter's choice.
  std::optional<int> instance;                             ///< Range: >= 0.
  bool list = false;                                       ///< Only say what the log holds.
  std::map<std::string, std::string, std::less<>> others;  ///< Flags of this converter alone.
};

/// One converter program.
struct Converter {
  std::string_view format;     ///< "dataflash": the program is truetriad-convert-dataflash.
  std::string_view input;      ///< "an ArduPilot log (.bin)"
  std::string_view details;    ///< Lines of --help about topics, instances and choices.
  bool takes_several = false;  ///< Inputs, in one or separated by commas.
  bool takes_topics = false;
  bool takes_instance = false;
  std::vector<std::string_view> others = {};  ///< Names of its own flags.
  /// Converts or lists. Error: usage, or bad input; then nothing has been written.
  std::function<Status(const Arguments& arguments)> run = {};
};

/// The `main` of a converter. Exit code: 0 good, 1 usage, 2 bad input.
int RunConverter(const Converter& converter, int argc, char** argv);

/// Does `work` in a process of its own, with a bound on its memory, for libraries that a damaged
/// file can bring down. Its error becomes that of this process; a crash becomes bad input.
Status Isolated(const std::vector<std::string>& paths, const std::function<Status()>& work);

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
/// `text` with every byte that is not printable ASCII or UTF-8 text as `?`.
std::string Printable(std::string_view text);
/// "1 message", "2 messages".
std::string Count(std::uint64_t count, std::string_view one, std::string_view many);
/// "truetriad-convert-ros1".
const std::string& ProgramName();
/// Says something on stderr, after the program's name.
void Note(const std::string& message);

}  // namespace truetriad::convert
