// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <charconv>
#include <cstddef>
#include <system_error>

#include "truetriad/base/result.h"

namespace truetriad {
namespace {

using enum ErrorCode;

using Text = std::string_view;

constexpr ErrorInfo Usage(ErrorCode code, Text name, Text meaning, Text remedy) {
  return {code, name, ErrorKind::kUsage, meaning, remedy};
}
constexpr ErrorInfo BadInput(ErrorCode code, Text name, Text meaning, Text remedy) {
  return {code, name, ErrorKind::kBadInput, meaning, remedy};
}
constexpr ErrorInfo NotEnough(ErrorCode code, Text name, Text meaning, Text remedy) {
  return {code, name, ErrorKind::kNotEnough, meaning, remedy};
}

// `truetriad explain` writes docs/reasons.md from this table.
constexpr auto kErrors = std::to_array<ErrorInfo>({
    Usage(kUnknownVerb, "unknown-verb", "No verb has this name", "`truetriad help` lists them"),
    Usage(kUnknownFlag,
          "unknown-flag",
          "The verb has no such flag",
          "`truetriad help VERB` lists its flags"),
    Usage(kMissingArgument,
          "missing-argument",
          "A flag, a value or a word is missing",
          "`truetriad help VERB` shows what is needed"),
    Usage(
        kExtraArgument, "extra-argument", "One word is too many", "give each value after its flag"),
    Usage(kInvalidArgument,
          "invalid-argument",
          "The flag does not take this value",
          "`truetriad help VERB` says which values it takes"),
    Usage(kConflictingArguments,
          "conflicting-arguments",
          "Two parts of the call exclude each other",
          "leave one out"),
    Usage(kUnknownName,
          "unknown-name",
          "The name of a format, limit or topic is unknown",
          "use a name that the message lists"),
    Usage(kInvalidExperiment,
          "invalid-experiment",
          "The experiment does not fit the verb or the data",
          "correct the key that the message names"),
    Usage(
        kNothingToEstimate, "nothing-to-estimate", "Every parameter is fixed", "free a parameter"),
    Usage(kMissingProgram,
          "missing-program",
          "A part that is built or installed separately is missing",
          "install or build what the message names"),
    BadInput(kUnreadableFile,
             "unreadable-file",
             "A file is missing or cannot be read",
             "check path and permissions"),
    BadInput(kEmptyFile, "empty-file", "A file is empty", "check whether the log was closed"),
    BadInput(kDamagedFile,
             "damaged-file",
             "A file is cut off, or its parts contradict each other",
             "copy it again from where it was recorded"),
    BadInput(kWrongFormat,
             "wrong-format",
             "A file is of another kind than expected",
             "convert it first, or give the file that belongs here"),
    BadInput(kBadYaml, "bad-yaml", "A file is not YAML, or not a map", "correct the line"),
    BadInput(kUnknownKey, "unknown-key", "The key is unknown", "check its spelling and its place"),
    BadInput(kDuplicateKey, "duplicate-key", "A key or name is given twice", "keep only one"),
    BadInput(kMissingKey, "missing-key", "A key that is needed is missing", "add it"),
    BadInput(kInvalidValue, "invalid-value", "The key does not take this value", "correct it"),
    BadInput(kConflictingKeys,
             "conflicting-keys",
             "Keys of a file contradict each other, or need each other",
             "correct the key that the message names"),
    BadInput(kNoHeader,
             "no-header",
             "A table has no header",
             "name the columns with their units in the first line"),
    BadInput(kMissingColumn,
             "missing-column",
             "A column that is needed is missing",
             "add it, or map another column in a manifest"),
    BadInput(kDuplicateColumn,
             "duplicate-column",
             "A column occurs or is used twice",
             "rename one of them"),
    BadInput(kUnknownColumn,
             "unknown-column",
             "A column has an unknown name, but may be needed",
             "rename it, or map it in a manifest"),
    BadInput(kMissingUnit,
             "missing-unit",
             "A column has no unit",
             "write it after the name, as in `accel_x[m/s^2]`"),
    BadInput(kUnknownUnit,
             "unknown-unit",
             "A unit is unknown, or does not fit the quantity",
             "use a unit that the message lists"),
    BadInput(kUnitMismatch, "unit-mismatch", "Units differ that must be the same", "use one unit"),
    BadInput(kWrongFieldCount,
             "wrong-field-count",
             "A row has more or fewer fields than the header",
             "correct the row; `ragged: allow` in a manifest leaves such rows out"),
    BadInput(kUnreadableNumber,
             "unreadable-number",
             "A field is not a finite number",
             "correct the field, or leave it empty"),
    BadInput(kValueOutOfRange,
             "value-out-of-range",
             "A number is too large or too small",
             "check its unit"),
    BadInput(kTooMany,
             "too-many",
             "The number of rows or poses is implausibly large",
             "check that it is the right file, and its manifest"),
    BadInput(kMissingTime,
             "missing-time",
             "Time is needed, and the recording has none",
             "add a time column, or state the rate in a manifest"),
    BadInput(kTimeGoesBack,
             "time-goes-back",
             "Time goes backwards",
             "sort the log, or split it where the clock was set"),
    BadInput(kMissingTemperature,
             "missing-temperature",
             "The temperature is needed, and a row or pose has none",
             "add a temperature column"),
    BadInput(kMissingSensor,
             "missing-sensor",
             "A sensor that is needed is not in the file",
             "record it, or do without it"),
    BadInput(kNoReadings,
             "no-readings",
             "A sensor or file has no reading",
             "check the columns and the log"),
    BadInput(kStuckSensor,
             "stuck-sensor",
             "A sensor repeats one reading, or is clipped at its range limit",
             "check wiring, bus and range"),
    BadInput(kRepeatedRows,
             "repeated-rows",
             "Too many rows repeat others",
             "check how the table was made"),
    BadInput(kWrongUnit,
             "wrong-unit",
             "No sensor of this kind has readings of this size in the stated unit",
             "correct the unit"),
    BadInput(kCountsOfUnknownSize,
             "counts-of-unknown-size",
             "Readings are in counts, but the size of a count is needed",
             "state `si_per_count:` in a manifest"),
    BadInput(kNotInRecording,
             "not-in-recording",
             "The recording lacks a pose, row or time that was stated",
             "`truetriad inspect` lists what it has"),
    BadInput(kDoesNotMatch,
             "does-not-match",
             "Two files, or a file and the experiment, do not belong together",
             "give files that match"),
    BadInput(
        kOtherDevice, "other-device", "Files are of different devices", "give files of one device"),
    BadInput(kStationNotChecked,
             "station-not-checked",
             "A station's golden unit was not measured in time, or did not agree",
             "measure it, and run check-station with --store"),
    BadInput(kCalibrationNotUsable,
             "calibration-not-usable",
             "A calibration was refused",
             "resolve its findings, and calibrate again"),
    BadInput(kOutsideLimits,
             "outside-limits",
             "A unit outside its limits, or refused by a person, is not exported",
             "measure it again, or state --outside-limits=allow"),
    BadInput(kNotRepresentable,
             "not-representable",
             "The format cannot hold this calibration",
             "choose another format"),
    BadInput(kSingularMatrix, "singular-matrix", "A matrix has no inverse", "check the file"),
    BadInput(kOutputInTheWay,
             "output-in-the-way",
             "The output's place is taken or in use",
             "free it, or choose another --output"),
    BadInput(kCannotWrite,
             "cannot-write",
             "A file cannot be written",
             "check disk, folder and permissions"),
    BadInput(kStopped, "stopped", "The run was stopped", "run it again"),
    BadInput(kSystemFailure,
             "system-failure",
             "The operating system refused",
             "try again; the message says why"),
    BadInput(kBrokenInstallation,
             "broken-installation",
             "A file of truetriad itself is missing or damaged",
             "install truetriad again"),
    NotEnough(kNotEnoughData,
              "not-enough-data",
              "The data do not determine what was asked for",
              "record more, as the message says"),
    BadInput(kStoreFailure,
             "store-failure",
             "A fleet's store cannot be opened, read or written",
             "check its name, its disk or its server; runs added before are kept"),
});

FilePlace PlaceIn(const std::string& text) {
  if (text.starts_with("--")) return {};  // If the text is a flag, it is no place in a file.
  const char* const text_end = text.data() + text.size();
  for (std::size_t colon = text.find(':'); colon != std::string::npos;
       colon = text.find(':', colon + 1)) {
    int line = 0;
    const auto [end, failure] = std::from_chars(text.data() + colon + 1, text_end, line);
    if (failure == std::errc() && line > 0 && (end == text_end || *end == ':')) {
      return {text.substr(0, colon), line};
    }
  }
  return {text.substr(0, text.find(": "))};
}

}  // namespace

std::span<const ErrorInfo> AllErrorCodes() { return kErrors; }

const ErrorInfo& InfoOf(ErrorCode code) { return kErrors[static_cast<std::size_t>(code)]; }

std::string Error::What() const {
  const std::string before = place.Text() + ": ";
  return place.file.empty() || !message.starts_with(before) ? message
                                                            : message.substr(before.size());
}

Error ErrorIn(ErrorCode code, const std::string& place, const std::string& text) {
  Error error(code, place + ": " + text);
  error.place = PlaceIn(place);
  return error;
}

Error Joined(const std::vector<Error>& errors) {
  Error all = errors.front();
  for (std::size_t i = 1; i < errors.size(); ++i) all.message += "\n" + errors[i].message;
  return all;
}

}  // namespace truetriad
