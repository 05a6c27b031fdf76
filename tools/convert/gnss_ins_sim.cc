// SPDX-License-Identifier: Apache-2.0
//
// Converts the output of gnss-ins-sim to a recording: one file of times and one for each sensor.
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "io/csv_reader.h"
#include "io/recording_layout.h"
#include "tools/convert/common/converter.h"
#include "tools/convert/common/recording_folder.h"
#include "truetriad/base/triad.h"

namespace truetriad::convert {
namespace {

namespace fs = std::filesystem;

Result<std::unique_ptr<CsvReader>> Open(const fs::path& path) {
  CsvLayout layout;
  layout.separator = ',';
  layout.header = CsvLayout::Header::kPresent;
  return CsvReader::Open(path.string(), layout);
}

/// The opened file of one sensor; its columns are assigned to the axes.
struct SensorFile {
  TriadColumns triad;
  std::unique_ptr<CsvReader> csv;
};

Result<SensorFile> OpenSensor(const fs::path& path, Triad triad) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<CsvReader> csv, Open(path));
  SensorFile file;
  file.triad.triad = triad;
  constexpr std::array<char, 3> kAxes = {'x', 'y', 'z'};
  if (csv->column_count() != 3) {
    return Error(ErrorCode::kWrongFieldCount,
                 {path.string()},
                 "has " + std::to_string(csv->column_count()) + " columns; expected x, y and z");
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const HeaderColumn heading = ParseHeaderColumn(csv->header()[axis]);
    const std::string expected = std::string(TriadPrefix(triad)) + "_" + kAxes[axis];
    if (heading.name != expected || (axis > 0 && heading.unit != file.triad.unit)) {
      return Error(ErrorCode::kWrongFormat,
                   path.string() + ":1: column `" + csv->header()[axis] + "`; expected `" +
                       expected + " (unit)`, the same unit for all three axes");
    }
    file.triad.unit = heading.unit;
    TRUETRIAD_RETURN_IF_ERROR(csv->Map(axis, CsvReader::Kind::kNumber));
  }
  if (const Result<Unit> unit = ParseTriadUnit(triad, file.triad.unit); !unit) {
    return Error(ErrorCode::kUnknownUnit, path.string() + ":1: " + unit.error().message);
  }
  file.csv = std::move(csv);
  return file;
}

Result<std::unique_ptr<CsvReader>> OpenTime(const fs::path& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<CsvReader> csv, Open(path));
  const HeaderColumn heading = ParseHeaderColumn(csv->header()[0]);
  if (csv->column_count() != 1 || heading.name != "time" || heading.unit != "sec") {
    return Error(ErrorCode::kMissingTime, path.string() + ":1: expected one column `time (sec)`");
  }
  TRUETRIAD_RETURN_IF_ERROR(csv->Map(0, CsvReader::Kind::kTime, /*power=*/9));
  return csv;
}

Status CopyRows(CsvReader* time, std::vector<SensorFile>* sensors, Table* table) {
  for (;;) {
    const Result<std::size_t> count = time->Read();
    TRUETRIAD_RETURN_IF_ERROR(count);
    for (SensorFile& sensor : *sensors) {
      TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t rows, sensor.csv->Read());
      if (rows == *count) continue;
      return Error(ErrorCode::kDoesNotMatch,
                   {sensor.csv->path()},
                   std::string("has ") + (rows < *count ? "fewer" : "more") + " rows than " +
                       time->path() + "; both need one row for each sample");
    }
    if (*count == 0) return {};
    for (std::size_t i = 0; i < *count; ++i) {
      if (time->Times(0)[i] == CsvReader::kMissingTime) {
        return Error(ErrorCode::kUnreadableNumber, {time->path(), time->Line(i)}, "has no time");
      }
      std::array<double, 9> readings{};
      for (std::size_t sensor = 0; sensor < sensors->size(); ++sensor) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          readings[3 * sensor + axis] = (*sensors)[sensor].csv->Numbers(axis)[i];
        }
      }
      table->Add(time->Times(0)[i], readings.data());
    }
  }
}

Status Run(const Arguments& arguments) {
  const fs::path folder = arguments.inputs[0];
  std::error_code missing;
  if (!fs::is_directory(folder, missing)) {
    return Error(ErrorCode::kWrongFormat,
                 {arguments.inputs[0]},
                 "is not a folder; expected one with time.csv, accel-0.csv, …");
  }
  const std::string run = std::to_string(arguments.instance.value_or(0));
  std::vector<std::pair<Triad, fs::path>> found;
  for (const Triad triad : kTriads) {
    const fs::path path = folder / (std::string(TriadPrefix(triad)) + "-" + run + ".csv");
    if (fs::is_regular_file(path, missing)) found.emplace_back(triad, path);
  }
  if (found.empty()) {
    return Error(
        ErrorCode::kMissingSensor,
        {arguments.inputs[0]},
        "contains none of accel-" + run + ".csv, gyro-" + run + ".csv, mag-" + run + ".csv");
  }
  if (arguments.list) {
    for (const auto& [triad, path] : found) {
      std::printf("%s %s\n", std::string(TriadName(triad)).c_str(), path.filename().c_str());
    }
    return {};
  }
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<CsvReader> time, OpenTime(folder / "time.csv"));
  std::vector<SensorFile> sensors;
  std::vector<TriadColumns> triads;
  for (const auto& [triad, path] : found) {
    TRUETRIAD_ASSIGN_OR_RETURN(SensorFile sensor, OpenSensor(path, triad));
    triads.push_back(sensor.triad);
    sensors.push_back(std::move(sensor));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<RecordingFolder> recording,
                             RecordingFolder::Create(arguments.output));
  recording->SetOrigin("gnss-ins-sim");
  recording->SetSource("run", run);
  Table* const table = recording->AddTable("recording.csv", triads, {});
  TRUETRIAD_RETURN_IF_ERROR(CopyRows(time.get(), &sensors, table));
  return recording->Commit();
}

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  return truetriad::convert::RunConverter(
      {.format = "gnss-ins-sim", .flags = {"instance"}, .run = truetriad::convert::Run},
      argc,
      argv);
}
