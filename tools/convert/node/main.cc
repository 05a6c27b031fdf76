// SPDX-License-Identifier: Apache-2.0
//
// Logs whose readings a script in Node finds, PX4 ULog and Parquet, to a recording.
// docs/converting.md.
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/board_rotation.h"
#include "tools/convert/common/byte_stream.h"
#include "tools/convert/common/converter.h"
#include "tools/convert/common/recording_folder.h"
#include "tools/convert/node/node_log.h"

namespace truetriad::convert {
namespace {

/// What the frames of a script say, made a recording.
class ScriptedRecording {
 public:
  explicit ScriptedRecording(const Arguments& arguments) : arguments_(arguments) {}

  Status Take(const NodeLog::Frame& frame) {
    if (frame.kind == 'W') {
      TakeRow(frame.body);
      return {};
    }
    const Json said = Json::parse(frame.body);
    return frame.kind == 'T' ? AddTable(said) : Describe(said);
  }

  /// Nothing was converted where the log was only listed.
  Status Commit() { return folder_ ? folder_->Commit() : Status(); }

 private:
  /// {"recording": 0, "file": …, "triad": …, "unit": …, "applied": …, "temperature": true}
  Status AddTable(const Json& said) {
    if (!folder_) {
      TRUETRIAD_ASSIGN_OR_RETURN(folder_, RecordingFolder::Create(arguments_.output));
    }
    folder_->BeginRecording(said.at("recording"));
    tables_.push_back(
        folder_->AddTable(said.at("file"),
                          {{.triad = *TriadFromName(said.at("triad").get<std::string>()),
                            .unit = said.at("unit"),
                            .applied = said.value("applied", "")}},
                          {.has_temperature = said.at("temperature"), .is_unchecked = true}));
    return {};
  }

  /// A table's number, a time, three readings and a temperature.
  void TakeRow(std::string_view body) {
    ByteCursor row(body);
    Table* const table = tables_.at(row.Take<std::uint16_t>());
    const auto time_ns = row.Take<std::int64_t>();
    const auto readings = row.Take<std::array<double, 3>>();
    table->SetTemperature(row.Take<double>());
    table->Add(time_ns, readings.data());
  }

  /// {"recording": 0, "source": {…}, "frame": …, "serial": …, "firmware": "px4", "ids":
  /// {"accelerometer": 1310988}, "slots": {…}, "thermalSlots": {…}, "idleThermalSlots":
  /// {"accelerometer": [1, 2]}, "magnetometerTurn": [nine], "siPerCount": {"0": 0.25}}: the last by
  /// the numbers of tables.
  Status Describe(const Json& said) {
    folder_->BeginRecording(said.at("recording"));
    folder_->SetOrigin(said.at("format"), {arguments_.input});
    for (const auto& [key, value] : said.at("source").items()) folder_->SetSource(key, value);
    folder_->SetFrame(said.value("frame", ""));
    folder_->SetSerial(said.value("serial", ""));
    Tags device;
    device.firmware = said.value("firmware", "");
    for (const auto& [key, of] : {std::pair("ids", &Tags::device_ids),
                                  std::pair("slots", &Tags::device_slots),
                                  std::pair("thermalSlots", &Tags::thermal_slots)}) {
      const Json numbers = said.value(key, Json::object());
      for (const auto& [triad, number] : numbers.items())
        (device.*of)[*TriadFromName(triad)] = number;
    }
    const Json idle = said.value("idleThermalSlots", Json::object());
    for (const auto& [triad, slots] : idle.items())
      device.idle_thermal_slots[*TriadFromName(triad)] = slots.get<std::vector<std::int64_t>>();
    if (said.contains("magnetometerTurn")) {
      const std::array<double, 9> rows = said.at("magnetometerTurn");
      // Its own axes are those in which it is corrected.
      const Eigen::Map<const Eigen::Matrix3d> mount(rows.data());
      device.magnetometer_turn_deg = TurnDegOf(mount.transpose());
      device.magnetometer_mount_deg = TurnDegOf(mount);
    }
    folder_->SetDevice(device);
    for (const auto& [table, size] : said.at("siPerCount").items())
      tables_.at(std::stoul(table))->triads()[0].si_per_count = size;
    return {};
  }

  const Arguments& arguments_;
  std::unique_ptr<RecordingFolder> folder_;
  std::vector<Table*> tables_;
};

Status Run(const Arguments& arguments) {
  Json request = {{"format", TRUETRIAD_FORMAT},
                  {"input", arguments.input},
                  {"list", arguments.list},
                  {"topics", arguments.topics},
                  {"others", arguments.others}};
  if (arguments.instance) request["instance"] = *arguments.instance;
  for (std::size_t i = 0; i < kPx4BoardRotations; ++i)
    request["rotations"].push_back(RowsJson(TurnOf(Eigen::Vector3d(kBoardRotations[i].data()))));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<NodeLog> log, NodeLog::Start(request));
  ScriptedRecording recording(arguments);
  for (;;) {
    TRUETRIAD_ASSIGN_OR_RETURN(const NodeLog::Frame frame, log->Next());
    if (frame.kind == '\0') return recording.Commit();
    TRUETRIAD_RETURN_IF_ERROR(recording.Take(frame));
  }
}

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  using truetriad::convert::Converter;
  const Converter ulog = {.format = "ulog",
                          .input = "a PX4 log (.ulg)",
                          .details = R"(
Taken are sensor_accel, sensor_gyro and sensor_mag (or their _fifo), which the firmware has not
corrected. Of several instances the first is recording.yaml, the others recording-N.yaml.
--topic=sensor_combined, say, asks for readings that the firmware has corrected; the recording
says how.
)",
                          .takes_topics = true,
                          .takes_instance = true,
                          .run = truetriad::convert::Run};
  const Converter parquet = {.format = "parquet",
                             .input = "a Parquet table (.parquet)",
                             .details = R"(
Columns are named as in a self-describing CSV: time[ns], accel_x[m/s^2], …, temperature[degC]; a
column of type TIMESTAMP called time or timestamp includes its unit. For other names:
--columns=time[s]=t,accel_x[g]=acc.x,accel_y[g]=acc.y,accel_z[g]=acc.z (a.b: b inside a).
)",
                             .others = {"columns"},
                             .run = truetriad::convert::Run};
  const bool is_ulog = ulog.format == TRUETRIAD_FORMAT;
  return truetriad::convert::RunConverter(is_ulog ? ulog : parquet, argc, argv);
}
