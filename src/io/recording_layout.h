// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/applied_correction.h"
#include "io/csv_reader.h"
#include "truetriad/base/input_file.h"
#include "truetriad/base/result.h"
#include "truetriad/base/units.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/io/recording.h"

namespace truetriad {

/// Where the time of a stream comes from.
struct TimeColumn {
  enum class Kind { kNone, kColumn, kRowNumber };

  Kind kind = Kind::kNone;
  std::size_t column = 0;
  int power = 9;         ///< time_ns = value * 10^power / rate.
  double rate_hz = 1.0;  ///< Other than 1 only for a column of sample numbers, or row numbers.
};

/// The temperature column and its unit.
struct TemperatureColumn {
  std::size_t column = 0;
  TemperatureUnit unit;
  int wrap_bits = 0;  ///< Of a register that begins anew behind its last number; 0: it does not.
  std::optional<bool> is_signed{};  ///< The first number of such a register; unset: nobody said.
};

/// Which columns of a file hold one triad.
struct StreamLayout {
  StreamInfo info;
  TimeColumn time;
  std::array<std::size_t, 3> axes{};
  std::optional<TemperatureColumn> temperature;
  std::optional<TemperatureColumn> ambient;
  std::optional<std::size_t> pose;
  std::optional<AppliedCorrection> applied;  ///< What is undone, so that readings are raw.
};

/// One file and the streams that it holds; their columns are mapped.
struct FileLayout {
  std::unique_ptr<CsvReader> csv;
  std::vector<StreamLayout> streams;
};

/// A recording, opened, before any row is read.
struct RecordingLayout {
  RecordingInfo info;
  std::vector<FileLayout> files;
  std::optional<InputFile> manifest;
};

/// True when `path` names a YAML file, so a manifest.
bool IsManifest(const std::string& path);

/// Opens a CSV that names quantity, axis and unit in its header. docs/recordings.md.
Result<RecordingLayout> OpenSelfDescribing(const std::string& path, const std::string& pose_column);

/// Opens a manifest and the files it names. docs/recordings.md.
Result<RecordingLayout> OpenManifest(const std::string& path, const OpenRecordingOptions& options);

/// The tables that a manifest names, each once, and its file of poses, as seen from here. Errors
/// (bad input): as OpenManifest, but for those of the tables.
Result<std::vector<std::string>> FilesOfManifest(const std::string& path);

/// Serial number and tags that a manifest states, whatever else in it is wrong.
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

/// What stands for the name of a column that has none.
inline constexpr std::string_view kUnnamedRowNumbers = "without a name (row numbers)";

/// Names are read in large and small letters alike.
std::string LowerCase(std::string text);

/// The name of this project for what a column seems to hold, without an axis `accel_`; empty where
/// it seems to hold nothing that is read.
std::string SeeminglyCalled(const std::string& column);

/// The unit that the last word of a column's name says, as this program spells it: "ms" of "t_ms";
/// empty where there is none.
std::string SeeminglyIn(const std::string& column);

/// Reads the columns of a self-describing header one by one, each at most once.
class HeaderColumns {
 public:
  /// Error: duplicate names.
  static Result<HeaderColumns> Of(const CsvReader& csv);

  /// The position of the column called `name` in large or small letters, if there is one; it counts
  /// as known from then on.
  std::optional<std::size_t> Take(const std::string& name);
  /// The unit of a column. Error when there is none: says how to state it, as in `name[example]`.
  Result<std::string> UnitOf(std::size_t column, std::string_view example) const;
  /// The unit of several columns, which must be the same.
  Result<std::string> CommonUnitOf(const std::vector<std::size_t>& columns,
                                   std::string_view example) const;
  /// "file:line: column `accel_x`: " + message.
  Error Fail(ErrorCode code, std::size_t column, const std::string& message) const;
  /// The columns that nobody took. Error: one that may be a reading,
  /// time or temperature which the table otherwise lacks; proposes a header, or lists the names
  /// that were asked for.
  Result<std::vector<std::string>> Ignored() const;
  /// Of a header in which no sensor was found.
  Error NoSensors() const;

  /// The three axes `prefix`_x, _y, _z and their unit; nullopt without any. Error: some missing, or
  /// not one and the same unit of `triad`.
  struct Axes {
    std::array<std::size_t, 3> columns{};
    Unit unit;
  };
  Result<std::optional<Axes>> TakeAxes(Triad triad, const std::string& prefix);

 private:
  /// Whether a column that nobody took may be what the table otherwise lacks.
  bool MayBeNeeded(const HeaderColumn& column) const;
  bool HasTaken(std::string_view name) const;
  /// "time, accel_x, …": all of them.
  std::string Names() const;
  /// The header with the names that its columns seem to mean; empty where that is not clear.
  std::string Understandable() const;

  FilePlace place_;
  std::vector<HeaderColumn> columns_;
  std::vector<bool> taken_;
  std::vector<std::string> asked_;
  bool may_number_rows_ = false;  ///< The first column.
};

/// The time column of a self-describing header; kNone without. The unit is s, ms, us or ns.
Result<TimeColumn> TakeTime(HeaderColumns* header);

/// The column of a temperature and its unit; `name`: temperature or ambient_temperature.
Result<std::optional<TemperatureColumn>> TakeTemperature(HeaderColumns* header,
                                                         const std::string& name = "temperature");

/// 10^power ns make one `unit`; nullopt when it is none of s, ms, us, ns.
std::optional<int> TimePower(std::string_view unit);

}  // namespace truetriad
