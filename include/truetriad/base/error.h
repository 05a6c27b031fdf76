// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace truetriad {

/// What kind of failure an error is; the number is the exit code of the command line.
enum class ErrorKind {
  kUsage = 1,      ///< The call itself is wrong: unknown verb or flag, a flag missing.
  kBadInput = 2,   ///< A file is malformed, or no number in it can be trusted as a reading.
  kNotEnough = 3,  ///< The data are readable but do not determine what was asked for.
};

/// Why something failed; docs/reasons.md has them all. Never renamed.
enum class ErrorCode {
  // Of the call.
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
  // Of files.
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
  // Of tables.
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
  // Of readings.
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
  // Of calibrations.
  kCalibrationNotUsable,
  kOutsideLimits,
  kNotRepresentable,
  kSingularMatrix,
  // Of this machine.
  kOutputInTheWay,
  kCannotWrite,
  kStopped,
  kSystemFailure,
  kBrokenInstallation,
  // Of the data.
  kNotEnoughData,
  // Of the fleet.
  kStoreFailure,
};

struct ErrorInfo {
  ErrorCode code;
  std::string_view name;  ///< "missing-column": in files and for scripts.
  ErrorKind kind;
  std::string_view meaning;  ///< One line.
  std::string_view remedy;   ///< What to do about it, in general.
};

/// Of all codes, in their order.
std::span<const ErrorInfo> AllErrorCodes();
const ErrorInfo& InfoOf(ErrorCode code);

/// Where something is wrong.
struct FilePlace {
  std::string file;
  std::int64_t line = 0;  ///< From 1; 0 where it is not known.
  int column = 0;         ///< Of a table the field, of YAML the character, from 1; 0 as well.

  /// "file:line". Here, since modules that are loaded at run time make errors, too.
  std::string Text() const { return line > 0 ? file + ":" + std::to_string(line) : file; }
};

struct Finding;  // model/finding.h

/// A failure: what was seen, where, what was expected, what to try.
struct Error {
  Error(ErrorCode why, std::string text) : code(why), message(std::move(text)) {}
  /// The message begins with the place.
  Error(ErrorCode why, FilePlace at, const std::string& text)
      : code(why), message(at.Text() + ": " + text), place(std::move(at)) {}

  ErrorKind kind() const { return InfoOf(code).kind; }
  /// The message without its place.
  std::string What() const;
  /// The same about a key of the experiment.
  Error About(std::string about) && {
    key = std::move(about);
    return std::move(*this);
  }

  ErrorCode code;
  std::string message;
  FilePlace place = {};
  /// Of a usage error: the key of the experiment that it is about, "sensors.gyroscope"; or empty.
  std::string key = {};
  /// Of data that are not enough: the same for programs, where there is such.
  std::shared_ptr<const Finding> finding = {};
};

/// With its place in words: "file", "file:line" or "file:line: key".
Error ErrorIn(ErrorCode code, const std::string& place, const std::string& text);

/// Of several at once, one or more: the code and the place of the first, the messages of all, each
/// on a line.
Error Joined(const std::vector<Error>& errors);

}  // namespace truetriad
