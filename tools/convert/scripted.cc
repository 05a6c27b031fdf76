// SPDX-License-Identifier: Apache-2.0
//
// Converts PX4 ULog and Parquet logs to a recording; a Node script decodes their readings.
// docs/converting.md.
#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/companion.h"
#include "model/board_rotation.h"
#include "tools/convert/common/converter.h"
#include "tools/convert/common/recording_folder.h"
#include "tools/truetriad/interruption.h"
#include "tree/json.h"

namespace truetriad::convert {
namespace {

/// A log that a Node script reads (tools/convert-node/lib/read.js). The script sends lines through
/// a pipe: a letter, then either JSON or the numbers of a row.
class NodeLog {
 public:
  /// `request`: {"format": "ulog", "input": …} and the options of the format's script. Error: the
  /// script cannot be started.
  static Result<std::unique_ptr<NodeLog>> Start(const Json& request) {
    constexpr int kScriptPipe = 3;  // The descriptor in lib/frames.js.
    const std::optional<std::string> script = FindCompanion("../lib/read.js");
    if (!script)
      return Error(ErrorCode::kBrokenInstallation, "convert-node/lib/read.js is missing");
    int ends[2] = {-1, -1};
    if (pipe2(ends, O_CLOEXEC) != 0)
      return Error(ErrorCode::kSystemFailure,
                   std::string("cannot create a pipe: ") + std::strerror(errno));
    std::unique_ptr<NodeLog> log(new NodeLog());
    log->lines_.reset(fdopen(ends[0], "r"));
    std::string text = request.dump(-1, ' ', /*ensure_ascii=*/true, Json::error_handler_t::replace);
    std::string path = *script, program = "node";
    char* const words[] = {program.data(), path.data(), text.data(), nullptr};
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], kScriptPipe);
    const int failure = posix_spawnp(&log->child_, words[0], &actions, nullptr, words, environ);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    if (failure == 0) return log;
    log->child_ = -1;
    return Error(ErrorCode::kMissingProgram, "needs Node.js, which is not in PATH; install nodejs");
  }

  /// Ends the script.
  ~NodeLog() {
    if (child_ > 0) kill(child_, SIGKILL);
    while (child_ > 0 && waitpid(child_, nullptr, 0) < 0 && errno == EINTR) continue;
    std::free(line_);
  }
  NodeLog(const NodeLog&) = delete;
  NodeLog& operator=(const NodeLog&) = delete;

  /// Returns the next line with data, valid until the next call, and prints the script's messages
  /// before it; empty: the log has ended. Error: the script reports an error, or ends before the
  /// log has ended.
  Result<std::string_view> Next() {
    for (;;) {
      const ssize_t size = getline(&line_, &capacity_, lines_.get());
      if (IsInterrupted()) throw Interrupted();
      if (size <= 0 || line_[size - 1] != '\n')
        return Error(ErrorCode::kDamagedFile, "the log is damaged; its reader crashed on it");
      const std::string_view line(line_, static_cast<std::size_t>(size - 1));
      const std::string_view said = line.substr(1);
      if (line[0] == 'X') return std::string_view();
      if (line[0] == 'N') {
        Note(Json::parse(said).get<std::string>());
      } else if (line[0] == 'O') {
        std::puts(Json::parse(said).get<std::string>().c_str());
      } else if (line[0] == 'E') {
        return ErrorOf(Json::parse(said));
      } else {
        return line;
      }
    }
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  NodeLog() = default;

  static Error ErrorOf(const Json& said) {
    Error error(ErrorCode::kDamagedFile, said.at("message").get<std::string>());
    for (const ErrorInfo& info : AllErrorCodes()) {
      if (info.name == said.at("code").get<std::string>()) error.code = info.code;
    }
    return error;
  }

  pid_t child_ = -1;
  std::unique_ptr<std::FILE, Close> lines_;
  char* line_ = nullptr;  ///< Owned by getline.
  std::size_t capacity_ = 0;
};

/// Builds a recording from the lines of a script.
class ScriptedRecording {
 public:
  explicit ScriptedRecording(const Arguments& arguments) : arguments_(arguments) {}

  Status Take(std::string_view line) {
    if (line[0] == 'W') {
      TakeRow(line.substr(1));
      return {};
    }
    const Json said = Json::parse(line.substr(1));
    return line[0] == 'T' ? AddTable(said) : Describe(said);
  }

  /// If the log was only listed, there is nothing to commit.
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

  /// Adds a row: the index of a table, a time, three readings and a temperature.
  void TakeRow(std::string_view row) {
    const char* at = row.data();
    const auto take = [&](auto* number) {
      at += *at == ' ' ? 1 : 0;
      at = std::from_chars(at, row.data() + row.size(), *number).ptr;
    };
    std::size_t table = 0;
    std::int64_t time_ns = 0;
    std::array<double, 3> readings{};
    double temperature_degc = 0.0;
    take(&table);
    take(&time_ns);
    for (double& reading : readings) take(&reading);
    take(&temperature_degc);
    tables_.at(table)->SetTemperature(temperature_degc);
    tables_[table]->Add(time_ns, readings.data());
  }

  /// {"recording": 0, "source": {…}, "frame": …, "serial": …, "firmware": "px4", "ids":
  /// {"accelerometer": 1310988}, "slots": {…}, "thermalSlots": {…}, "idleThermalSlots":
  /// {"accelerometer": [1, 2]}, "magnetometerTurn": [nine], "siPerCount": {"0": 0.25}}, where "0"
  /// is the index of a table.
  Status Describe(const Json& said) {
    folder_->BeginRecording(said.at("recording"));
    folder_->SetOrigin(said.at("format"), {arguments_.inputs[0]});
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
      // Firmware corrects the magnetometer in the sensor's own axes.
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
                  {"input", arguments.inputs[0]},
                  {"list", arguments.list},
                  {"topics", arguments.topics},
                  {"others", arguments.others}};
  if (arguments.instance) request["instance"] = *arguments.instance;
  for (std::size_t i = 0; i < kPx4BoardRotations; ++i)
    request["rotations"].push_back(RowsJson(TurnOf(Eigen::Vector3d(kBoardRotations[i].data()))));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<NodeLog> log, NodeLog::Start(request));
  ScriptedRecording recording(arguments);
  for (;;) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string_view line, log->Next());
    if (line.empty()) return recording.Commit();
    TRUETRIAD_RETURN_IF_ERROR(recording.Take(line));
  }
}

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  const bool is_ulog = std::string_view(TRUETRIAD_FORMAT) == "ulog";
  const std::vector<std::string_view> of_ulog = {"topic", "instance"}, of_parquet = {"columns"};
  return truetriad::convert::RunConverter({.format = TRUETRIAD_FORMAT,
                                           .flags = is_ulog ? of_ulog : of_parquet,
                                           .run = truetriad::convert::Run},
                                          argc,
                                          argv);
}
