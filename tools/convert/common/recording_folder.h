// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/whole_file.h"
#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/tags.h"

namespace truetriad::convert {

/// One triad of a table.
struct TriadColumns {
  Triad triad = Triad::kAccelerometer;
  std::string unit;     ///< As in recordings: "m/s^2".
  std::string applied;  ///< YAML for `applied.<triad>:`, the firmware's correction, or "".
  std::uint64_t rows = 0;
  std::uint64_t without_numbers = 0;        ///< Rows with NaN or an impossible value.
  std::optional<double> si_per_count = {};  ///< The size of a count, if the log states it.

  /// Whether the sensor is in the log. A sensor without any valid number counts, too: it is broken.
  bool IsSeen() const { return rows > 0 || without_numbers > 0; }
};

/// The columns of a table in addition to the readings.
struct TableColumns {
  bool has_temperature = false;
  bool has_time = true;  ///< False: the times of added rows only count the rows.
  /// The log has no checksums, or rows may lack a temperature. Rows beyond a jump of the clock near
  /// either end are then left out, and the manifest states a temperature only if all rows have one.
  bool is_unchecked = false;
};

/// One CSV of a recording: rows of a time, some triads and optionally a temperature.
///
/// Rows may be added slightly out of order, since the last kReach rows are sorted by time. If a row
/// comes even later, it is left out and counted: the time of a recording must not decrease.
class Table {
 public:
  static constexpr std::size_t kReach = 1024;      ///< One second at 1 kHz.
  static constexpr std::size_t kMostColumns = 10;  ///< 3 triads and a temperature.

  Table(const std::string& folder,
        std::string file,
        std::vector<TriadColumns> triads,
        TableColumns columns);

  /// Adds a row: three readings for each triad in order. Bit i of `present` states whether the i-th
  /// triad has readings at this time. Readings that are not three plausible numbers are left out
  /// and counted.
  void Add(std::int64_t time_ns, const double* readings, unsigned present = ~0U);
  /// Sets the temperature of the following rows, in degC.
  void SetTemperature(double temperature_degc) { temperature_degc_ = temperature_degc; }

  Status Commit();

  const std::string& file() const { return file_name_; }
  const std::vector<TriadColumns>& triads() const { return triads_; }
  std::vector<TriadColumns>& triads() { return triads_; }
  bool has_temperature() const { return columns_.has_temperature; }
  bool states_temperature() const {
    return columns_.has_temperature && (!columns_.is_unchecked || with_temperature_ == rows_);
  }
  bool has_time() const { return columns_.has_time; }
  std::uint64_t rows() const { return rows_; }
  bool IsSeen() const;
  std::uint64_t too_late() const { return too_late_; }
  std::int64_t first_time_ns() const { return first_time_ns_; }
  std::int64_t last_time_ns() const { return last_time_ns_; }

 private:
  struct Row {
    std::int64_t time_ns = 0;
    std::array<double, kMostColumns> values{};
  };

  void WriteFirst();
  void LeaveOutLastAfterAJump();
  char* WriteRow(const Row& row, char* text) const;

  std::string file_name_;
  std::vector<TriadColumns> triads_;
  std::vector<double> largest_;  ///< Largest valid reading, by triad.
  TableColumns columns_;
  WholeFile output_;
  std::string text_;
  std::size_t filled_ = 0;
  std::deque<Row> waiting_;
  double temperature_degc_ = std::numeric_limits<double>::quiet_NaN();
  std::uint64_t rows_ = 0, with_temperature_ = 0;
  std::uint64_t too_late_ = 0;
  std::int64_t first_time_ns_ = 0;
  std::int64_t last_time_ns_ = std::numeric_limits<std::int64_t>::min();
};

/// Writes DIR/recording.yaml, further manifests beside it, and the CSVs of all manifests. They are
/// written in a folder beside DIR. When all are complete, this folder is renamed to DIR; if DIR
/// already has files, they are moved into it one by one, the manifests last.
class RecordingFolder {
 public:
  /// Error: DIR cannot be written.
  static Result<std::unique_ptr<RecordingFolder>> Create(const std::string& directory);
  ~RecordingFolder();  ///< Removes everything unless committed.
  RecordingFolder(const RecordingFolder&) = delete;
  RecordingFolder& operator=(const RecordingFolder&) = delete;

  /// The table is valid as long as this object.
  Table* AddTable(std::string file, std::vector<TriadColumns> triads, TableColumns columns);

  /// Begins recording-N.yaml, N = `instance`, for the log's sensors of this number. The first
  /// recording with rows becomes recording.yaml.
  void BeginRecording(int instance);

  /// Set what the manifest states about the origin: `source: {key: value, …}`, `frame:`, the serial
  /// number, and as `device:` the firmware's statements about sensors that have rows. SetOrigin
  /// sets the first keys of the source: the log's format, its files if `paths` is given, and the
  /// converter.
  void SetOrigin(const std::string& format, const std::vector<std::string>& paths = {});
  void SetSource(const std::string& key, const std::string& value);
  void SetFrame(const std::string& frame) { recordings_[current_].frame = frame; }
  void SetSerial(const std::string& serial) { recordings_[current_].serial = serial; }
  void SetDevice(const Tags& device) { recordings_[current_].device = device; }
  /// Sets the text of poses.yaml, if the log states its rests.
  void SetPoses(const std::string& poses) { poses_ = poses; }

  /// Writes the manifests and renames the folder. Prints the manifests' paths on stdout, and a
  /// summary of each sensor's readings on stderr. Error: no triad has a row; a file cannot be
  /// written.
  Status Commit();

 private:
  struct Recording {
    std::string manifest = {};  ///< Name of the file; the first one's is recording.yaml.
    std::vector<std::pair<std::string, std::string>> source = {};
    std::string frame = {};
    std::string serial = {};
    Tags device = {};
    std::vector<Table*> tables = {};
  };

  RecordingFolder(std::string directory, std::string temporary);
  std::string Manifest(const Recording& recording) const;
  Status MoveIntoPlace();
  void SayWhatIsHeld() const;

  std::string directory_;
  std::string temporary_;
  std::vector<std::unique_ptr<Table>> tables_;
  std::vector<Recording> recordings_ = std::vector<Recording>(1);
  std::size_t current_ = 0;  ///< Index in recordings_.
  std::string poses_;
};

}  // namespace truetriad::convert
