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
  std::string applied;  ///< What firmware has done to it: YAML behind `applied.<triad>:`; or empty.
  std::uint64_t rows = 0;
  std::uint64_t without_numbers = 0;        ///< Rows with NaN, or what no sensor says.
  std::optional<double> si_per_count = {};  ///< The size of a count, where the log states it.

  /// One that gave no valid number is in the recording all the same: it is there, and broken.
  bool IsSeen() const { return rows > 0 || without_numbers > 0; }
};

/// What the rows of a table hold beside readings.
struct TableColumns {
  bool has_temperature = false;
  bool has_time = true;  ///< Else the times that rows are added with are only their order.
  /// Of a log without checksums, or whose rows may lack a temperature: rows at either end whose
  /// clock jumps are left out, and the manifest has a temperature only where all rows have.
  bool is_unchecked = false;
};

/// One CSV of a recording: rows of a time, some triads and perhaps a temperature.
///
/// Rows may come a little out of order: the last kReach are put in order of time. A row that comes
/// later still is left out and counted, because a recording's time never goes back.
class Table {
 public:
  static constexpr std::size_t kReach = 1024;      ///< A second of 1 kHz.
  static constexpr std::size_t kMostColumns = 10;  ///< Three triads and a temperature.

  Table(const std::string& folder,
        std::string file,
        std::vector<TriadColumns> triads,
        TableColumns columns);

  /// Adds a row: three readings for each triad, in their order; bit i of `present` says whether the
  /// i-th triad has any at this time. One that has, but not three numbers that can be
  /// readings, is counted.
  void Add(std::int64_t time_ns, const double* readings, unsigned present = ~0U);
  /// The temperature that rows carry from now on, in degC.
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
  std::vector<double> largest_;  ///< Of a reading, by triad.
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

/// DIR/recording.yaml, further recordings beside it, and the CSVs they name, written in a folder
/// beside DIR that takes its name once everything is whole; or, where DIR exists, moved into it
/// file by file, the manifest last.
class RecordingFolder {
 public:
  /// Error: DIR cannot be written.
  static Result<std::unique_ptr<RecordingFolder>> Create(const std::string& directory);
  ~RecordingFolder();  ///< Leaves nothing behind unless committed.
  RecordingFolder(const RecordingFolder&) = delete;
  RecordingFolder& operator=(const RecordingFolder&) = delete;

  /// Valid as long as the folder.
  Table* AddTable(std::string file, std::vector<TriadColumns> triads, TableColumns columns);

  /// What follows belongs to recording-N.yaml, of the log's sensors of that number; the first with
  /// rows is recording.yaml.
  void BeginRecording(int instance);

  /// What the manifest says about the origin: `source: {key: value, …}`, `frame:`, and
  /// what firmware says of the sensors that have rows as `device:`.
  /// The first of them: what the log is called, its files where they are told, and the converter.
  void SetOrigin(const std::string& format, const std::vector<std::string>& paths = {});
  void SetSource(const std::string& key, const std::string& value);
  void SetFrame(const std::string& frame) { recordings_[current_].frame = frame; }
  void SetSerial(const std::string& serial) { recordings_[current_].serial = serial; }
  void SetDevice(const Tags& device) { recordings_[current_].device = device; }
  /// The text of poses.yaml, when the log says where its rests are.
  void SetPoses(const std::string& poses) { poses_ = poses; }

  /// Writes the manifests, gives the folder its name, and prints the manifests' paths on stdout and
  /// what they hold on stderr. Error: no triad has a row; or a file cannot be written.
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
  std::size_t current_ = 0;  ///< Of recordings_.
  std::string poses_;
};

}  // namespace truetriad::convert
