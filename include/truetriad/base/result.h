// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace truetriad {

/// What a result states about an input file as it was read.
struct InputFile {
  std::string file;
  std::string sha256;
  std::int64_t samples = 0;
};

/// The kind of an error. Its number is the exit code of the command line.
enum class ErrorKind {
  kUsage = 1,      ///< The call itself is wrong: unknown verb or flag, a flag missing.
  kBadInput = 2,   ///< A file is missing, malformed or not usable, or the system failed.
  kNotEnough = 3,  ///< The data are readable, but do not determine the wanted result.
};

/// The reason for a failure; docs/reasons.md lists all reasons. Their names are never changed.
enum class ErrorCode {
  // Errors of the call.
  kUnknownVerb,
  kUnknownFlag,
  kMissingArgument,
  kExtraArgument,
  kInvalidArgument,
  kConflictingArguments,
  kUnknownName,
  kInvalidExperiment,
  kNothingToEstimate,
  kMissingProgram,
  // Errors of files.
  kUnreadableFile,
  kEmptyFile,
  kDamagedFile,
  kWrongFormat,
  kBadYaml,
  kUnknownKey,
  kDuplicateKey,
  kMissingKey,
  kInvalidValue,
  kConflictingKeys,
  // Errors of tables.
  kNoHeader,
  kMissingColumn,
  kDuplicateColumn,
  kUnknownColumn,
  kMissingUnit,
  kUnknownUnit,
  kUnitMismatch,
  kWrongFieldCount,
  kUnreadableNumber,
  kValueOutOfRange,
  kTooMany,
  // Errors of readings.
  kMissingTime,
  kTimeGoesBack,
  kMissingTemperature,
  kMissingSensor,
  kNoReadings,
  kStuckSensor,
  kRepeatedRows,
  kWrongUnit,
  kCountsOfUnknownSize,
  kNotInRecording,
  kDoesNotMatch,
  kOtherDevice,
  kStationNotChecked,
  // Errors of calibrations.
  kCalibrationNotUsable,
  kOutsideLimits,
  kNotRepresentable,
  kSingularMatrix,
  // Errors of this machine.
  kOutputInTheWay,
  kCannotWrite,
  kStopped,
  kSystemFailure,
  kBrokenInstallation,
  // Errors of the data.
  kNotEnoughData,
  // Errors of the fleet.
  kStoreFailure,
};

struct ErrorInfo {
  ErrorCode code;
  std::string_view name;  ///< As in files and scripts: "missing-column".
  ErrorKind kind;
  std::string_view meaning;  ///< What the error means, in one line.
  std::string_view remedy;   ///< What the user can do, in general.
};

/// The descriptions of all codes, in the order of ErrorCode.
std::span<const ErrorInfo> AllErrorCodes();
const ErrorInfo& InfoOf(ErrorCode code);

/// The place of an error in a file.
struct FilePlace {
  std::string file;
  std::int64_t line = 0;  ///< From 1; 0 where unknown.
  int column = 0;         ///< Field of a table or character of a YAML line, from 1; 0: unknown.

  /// "file:line". Inline, since modules that are loaded at run time also create errors.
  std::string Text() const { return line > 0 ? file + ":" + std::to_string(line) : file; }
};

struct Finding;  // model/finding.h

/// A failure. Its message states what was seen and where, what was expected, and what to try.
struct Error {
  Error(ErrorCode why, std::string text) : code(why), message(std::move(text)) {}
  /// Makes an error whose message begins with the place.
  Error(ErrorCode why, FilePlace at, const std::string& text)
      : code(why), message(at.Text() + ": " + text), place(std::move(at)) {}

  ErrorKind kind() const { return InfoOf(code).kind; }
  /// The message without its place.
  std::string What() const;
  /// Sets `key`, the key of the experiment that this error concerns, and returns this error.
  Error About(std::string about) && {
    key = std::move(about);
    return std::move(*this);
  }

  ErrorCode code;
  std::string message;
  FilePlace place = {};
  /// The key of the experiment that a usage error concerns, such as "sensors.gyroscope"; or empty.
  std::string key = {};
  /// If the data are not enough: the reason as a finding, for programs. May be null.
  std::shared_ptr<const Finding> finding = {};
};

/// An error at `place`, which is "file", "file:line" or "file:line: key".
Error ErrorIn(ErrorCode code, const std::string& place, const std::string& text);

/// Joins `errors` (at least one) into one error. It has the code and the place of the first error,
/// and the messages of all, each on its own line.
Error Joined(const std::vector<Error>& errors);

/// A value or the reason why there is none. Spelled like std::expected, which needs C++23.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : content_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool has_value() const { return content_.index() == 0; }
  explicit operator bool() const { return has_value(); }

  T& value() & { return std::get<0>(content_); }
  const T& value() const& { return std::get<0>(content_); }
  T&& value() && { return std::get<0>(std::move(content_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  const Error& error() const { return std::get<1>(content_); }

 private:
  std::variant<T, Error> content_;
};

/// Success, or the reason for failure.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(Error error) : error_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool has_value() const { return !error_.has_value(); }
  explicit operator bool() const { return has_value(); }
  const Error& error() const { return *error_; }

 private:
  std::optional<Error> error_;
};

/// The version of this library: "0.1.0".
std::string Version();

}  // namespace truetriad

/// If `expression` (a Status or Result) has an error, returns that error from the enclosing
/// function.
#define TRUETRIAD_RETURN_IF_ERROR(expression)            \
  do {                                                   \
    if (auto&& status_or_ = (expression); !status_or_) { \
      return status_or_.error();                         \
    }                                                    \
  } while (false)

#define TRUETRIAD_JOIN_NAMES_OF(a, b) a##b
#define TRUETRIAD_JOIN_NAMES(a, b) TRUETRIAD_JOIN_NAMES_OF(a, b)

/// If the Result that follows has a value, sets `declaration` to it; otherwise returns the error
/// from the enclosing function: TRUETRIAD_ASSIGN_OR_RETURN(const Unit unit, ParseTriadUnit(triad,
/// name));
#define TRUETRIAD_ASSIGN_OR_RETURN(declaration, ...)            \
  auto TRUETRIAD_JOIN_NAMES(result_, __LINE__) = (__VA_ARGS__); \
  if (!TRUETRIAD_JOIN_NAMES(result_, __LINE__)) {               \
    return TRUETRIAD_JOIN_NAMES(result_, __LINE__).error();     \
  }                                                             \
  declaration = *std::move(TRUETRIAD_JOIN_NAMES(result_, __LINE__))
