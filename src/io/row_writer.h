// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "io/whole_file.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/io/recording.h"

namespace truetriad {

/// An interface that changes readings before they are written into rows.
class ReadingChange {
 public:
  virtual ~ReadingChange() = default;
  /// The reading to be written in place of `raw`; NaN makes an empty field. Called for the readings
  /// of a row in the order in which their streams were added.
  virtual Eigen::Vector3d Changed(Triad triad,
                                  std::int64_t time_ns,
                                  const Eigen::Vector3d& raw,
                                  double temperature_degc) = 0;
  virtual void EndRow() = 0;
};

/// Samples of one triad that wait for samples of the other triads.
struct WaitingSamples {
  StreamInfo stream;
  int decimals = RecordingFormat::kShortest;
  std::vector<std::int64_t> time_ns = {};
  std::vector<double> x = {}, y = {}, z = {}, temperature_degc = {}, ambient_degc = {};
  std::vector<std::int32_t> pose = {};
  std::size_t next = 0;

  std::size_t size() const { return time_ns.size() - next; }
  void Add(const SampleBlock& block);
};

/// Writes a self-describing CSV with a row for each time at which some triad has a sample; fields
/// of triads without a sample stay empty.
class RowWriter {
 public:
  RowWriter(const std::string& path, const RecordingFormat& format, bool has_time);

  void AddStream(const StreamInfo& stream);
  void WriteHeader();
  void Add(const SampleBlock& block);
  /// Writes the rows for which every triad has samples or, if `at_end`, all waiting rows. To bound
  /// the memory, samples do not wait for a triad that has no more samples or pauses for long.
  /// Error: samples are too far out of order, or the file cannot be written.
  Status WriteRows(bool at_end, ReadingChange* change = nullptr);
  Status Commit() { return file_.Commit(); }
  Status status() const { return file_.status(); }

 private:
  bool NothingMissing() const;
  char* WriteRow(char* text, ReadingChange* change);
  char* WriteTime(std::int64_t time_ns, char* text) const;

  WholeFile file_;
  RecordingFormat format_;
  bool has_time_;
  std::vector<WaitingSamples> waiting_;
  bool has_temperature_ = false, has_ambient_ = false, has_pose_ = false;
  int time_decimals_ = 0;
  std::int64_t time_unit_ns_ = 1;
  std::int64_t last_time_ns_ = std::numeric_limits<std::int64_t>::min();
  std::optional<Triad> came_too_late_;
  std::string text_;
};

/// The name of a column, such as "accel_x[m/s^2]".
std::string ColumnOf(const StreamInfo& stream, char axis);
inline constexpr std::string_view kTemperatureColumn = "temperature[degC]";
inline constexpr std::string_view kAmbientColumn = "ambient_temperature[degC]";

}  // namespace truetriad
