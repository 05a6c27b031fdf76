// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/applied_correction.h"
#include "io/csv_reader.h"
#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/io/recording.h"

namespace truetriad {

/// Where the times of a stream come from.
struct TimeColumn {
  enum class Kind { kNone, kColumn, kRowNumber };

  Kind kind = Kind::kNone;
  std::size_t column = 0;
  int power = 9;         ///< time_ns = value * 10^power / rate.
  double rate_hz = 1.0;  ///< Other than 1 only if the time counts samples or rows.
};

/// The temperature column and its unit.
struct TemperatureColumn {
  std::size_t column = 0;
  TemperatureUnit unit;
  int wrap_bits = 0;                ///< Width of a register that wraps around; 0: none.
  std::optional<bool> is_signed{};  ///< Whether the first number is signed; unset: not stated.
};

/// The columns of a file that hold one triad.
struct StreamLayout {
  StreamInfo info;
  TimeColumn time;
  std::array<std::size_t, 3> axes{};
  std::optional<TemperatureColumn> temperature;
  std::optional<TemperatureColumn> ambient;
  std::optional<std::size_t> pose;
  std::optional<AppliedCorrection> applied;  ///< Undone on reading, so that readings are raw.
};

/// One file and the streams in it, with mapped columns.
struct FileLayout {
  std::unique_ptr<CsvReader> csv;
  std::vector<StreamLayout> streams;
};

/// An opened recording before any row is read.
struct RecordingLayout {
  RecordingInfo info;
  std::vector<FileLayout> files;
  std::optional<InputFile> manifest;
};

/// True when `path` names a YAML file, which is then a manifest.
bool IsManifest(const std::string& path);

/// Opens a CSV that names quantity, axis and unit in its header. docs/recordings.md.
Result<RecordingLayout> OpenSelfDescribing(const std::string& path, const std::string& pose_column);

/// Opens a manifest and the files it names. docs/recordings.md.
Result<RecordingLayout> OpenManifest(const std::string& path, const OpenRecordingOptions& options);

/// The tables that a manifest names, each once, and its file of poses, with paths relative to the
/// working folder. Errors (bad input): as OpenManifest, except those of the tables.
Result<std::vector<std::string>> FilesOfManifest(const std::string& path);

/// Serial number and tags of a manifest, even if other parts of it are wrong.
RecordingInfo IdentityInManifest(const std::string& path);

/// True for a face of the six-face block: +x, -x, +y, -y, +z, -z.
bool IsFace(std::string_view text);

/// A column of a self-describing header: "accel_x[m/s^2]" or "accel_x (m/s^2)" → name "accel_x",
/// unit "m/s^2".
struct HeaderColumn {
  std::string name;
  std::string unit;  ///< Empty when not stated.
};
HeaderColumn ParseHeaderColumn(const std::string& field);

/// Stands for the name of a first column that has no name.
inline constexpr std::string_view kUnnamedRowNumbers = "without a name (row numbers)";

/// `text` in lower case: names are compared without regard to case.
std::string LowerCase(std::string text);

/// This project's name for the likely content of a column: "accel_x", or "accel_" if the axis is
/// unclear; empty if the column is probably not needed.
std::string SeeminglyCalled(const std::string& column);

/// The unit that the last word of a column's name indicates, in this program's spelling: "ms" for
/// "t_ms". Empty if the word indicates no unit.
std::string SeeminglyIn(const std::string& column);

/// Reads the columns of a self-describing header one by one, each at most once.
class HeaderColumns {
 public:
  /// Error: there is no header, or it has duplicate names.
  static Result<HeaderColumns> Of(const CsvReader& csv);

  /// The index of the column `name` (case is ignored), which then counts as taken; nullopt if there
  /// is none.
  std::optional<std::size_t> Take(const std::string& name);
  /// The unit of a column. Error: no unit is stated; the message proposes `name[example]`.
  Result<std::string> UnitOf(std::size_t column, std::string_view example) const;
  /// The unit of several columns. Error: they do not have the same unit.
  Result<std::string> CommonUnitOf(const std::vector<std::size_t>& columns,
                                   std::string_view example) const;
  /// An error whose message begins with "file:line: column `accel_x`: ".
  Error Fail(ErrorCode code, std::size_t column, const std::string& message) const;
  /// The columns that were not taken. Error: one of them may hold a reading, a time or a
  /// temperature that no taken column holds. The message proposes a header, or lists the names that
  /// were asked for.
  Result<std::vector<std::string>> Ignored() const;
  /// The error for a header without any sensor.
  Error NoSensors() const;

  /// The three axes `prefix`_x, _y, _z and their unit; nullopt if there is none of them. Error:
  /// only some exist, or they do not share one unit of `triad`.
  struct Axes {
    std::array<std::size_t, 3> columns{};
    Unit unit;
  };
  Result<std::optional<Axes>> TakeAxes(Triad triad, const std::string& prefix);

 private:
  /// Whether a column that was not taken may be a reading, a time or a temperature that is needed
  /// and that no other column holds.
  bool MayBeNeeded(const HeaderColumn& column) const;
  bool HasTaken(std::string_view name) const;
  /// "time, accel_x, …": the names of all columns.
  std::string Names() const;
  /// The header with the likely names of its columns; empty if a column is unclear.
  std::string Understandable() const;

  FilePlace place_;
  std::vector<HeaderColumn> columns_;
  std::vector<bool> taken_;
  std::vector<std::string> asked_;
  bool may_number_rows_ = false;  ///< The first column may be row numbers.
};

/// The time column of a self-describing header; kNone if there is none. The unit is s, ms, us or
/// ns.
Result<TimeColumn> TakeTime(HeaderColumns* header);

/// The column of a temperature and its unit; `name`: temperature or ambient_temperature.
Result<std::optional<TemperatureColumn>> TakeTemperature(HeaderColumns* header,
                                                         const std::string& name = "temperature");

/// The power for which one `unit` is 10^power ns; nullopt unless `unit` is s, ms, us or ns.
std::optional<int> TimePower(std::string_view unit);

}  // namespace truetriad
