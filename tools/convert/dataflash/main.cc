// SPDX-License-Identifier: Apache-2.0
//
// Converts ArduPilot DataFlash logs (.bin) to a recording. docs/converting.md.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "formats/parameter_pattern.h"
#include "tools/convert/common/converter.h"
#include "tools/convert/common/recording_folder.h"
#include "tools/convert/dataflash/dataflash_log.h"
#include "tools/convert/dataflash/firmware_correction.h"
#include "tools/truetriad/progress.h"

namespace truetriad::convert {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr int kMostImus = 5;  // INS_MAX_INSTANCES of ArduPilot.

/// Kinds of messages with readings. Older logs number the messages (IMU2), newer ones have a field
/// I.
constexpr std::array<std::string_view, 4> kKinds = {"IMU", "ACC", "GYR", "MAG"};

/// Kind and sensor index of a message: "IMU2" is {IMU, 1}.
struct Source {
  std::string_view kind;  ///< Empty: a message without readings.
  int instance = 0;

  friend auto operator<=>(const Source&, const Source&) = default;
};

Source SourceOf(const MessageFormat& format, std::string_view record) {
  for (const std::string_view kind : kKinds) {
    if (!format.name.starts_with(kind)) continue;
    const std::string_view number = std::string_view(format.name).substr(kind.size());
    if (number.empty()) {
      const MessageField* const field = format.Find("I");
      return {kind, field == nullptr ? 0 : static_cast<int>(NumberIn(*field, record))};
    }
    if (number.size() == 1 && number[0] >= '1' && number[0] <= '9') return {kind, number[0] - '1'};
  }
  return {};
}

/// Nanoseconds since the autopilot's start; nullopt if the message has no time. Logs before 2015
/// have milliseconds.
std::optional<std::int64_t> TimeOf(const MessageFormat& format,
                                   std::string_view record,
                                   std::string_view field_name) {
  std::int64_t unit_ns = 1000;
  const MessageField* field = format.Find(field_name);
  if (field == nullptr) field = format.Find("TimeUS");
  if (field == nullptr) {
    field = format.Find("TimeMS");
    unit_ns *= 1000;
  }
  const std::optional<std::uint64_t> time =
      field == nullptr ? std::nullopt : IntegerIn(*field, record);
  const auto most = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max() / unit_ns);
  if (!time || *time > most) return std::nullopt;
  return static_cast<std::int64_t>(*time) * unit_ns;
}

/// The field of a chip's temperature in degC; null if the message has none.
const MessageField* TemperatureOf(const MessageFormat& format) {
  const MessageField* const field = format.Find("T");
  return field == nullptr ? format.Find("Temp") : field;
}

/// Three fields of a message.
struct Axes {
  std::array<const MessageField*, 3> fields{};

  static std::optional<Axes> Of(const MessageFormat& format, const std::string& prefix) {
    Axes axes;
    constexpr std::array<char, 3> kLetters = {'X', 'Y', 'Z'};
    for (std::size_t i = 0; i < 3; ++i) {
      axes.fields[i] = format.Find(prefix + kLetters[i]);
      if (axes.fields[i] == nullptr) return std::nullopt;
    }
    return axes;
  }
  Eigen::Vector3d In(std::string_view record) const {
    return {
        NumberIn(*fields[0], record), NumberIn(*fields[1], record), NumberIn(*fields[2], record)};
  }
};

/// The results of the first pass through the log.
struct Contents {
  struct Messages {
    std::uint64_t count = 0;
    std::int64_t first_ns = 0, last_ns = 0;
  };
  std::map<Source, Messages> sources;
  Parameters parameters;
  /// Earlier values of parameters that changed after readings began.
  std::map<std::string, std::vector<double>> earlier;
  std::map<int, Eigen::Vector3d> compass_offsets;  ///< In the first row of each magnetometer.
  std::set<int> with_temperature;                  ///< Instances whose IMU messages have one.
  bool in_milliseconds = false;                    ///< Times are in ms, as before 2015.
  std::string firmware;
  std::uint64_t records = 0, skipped_bytes = 0, damages = 0;
};

void ReadParameter(const DataflashLog::Record& record, bool readings_began, Contents* contents) {
  const MessageField* const name_field = record.format->Find("Name");
  const MessageField* const value_field = record.format->Find("Value");
  if (name_field == nullptr || value_field == nullptr) return;
  const std::string name(TextIn(*name_field, record.bytes));
  const double value = NumberIn(*value_field, record.bytes);
  const auto [known, fresh] = contents->parameters.emplace(name, value);
  if (!fresh && known->second != value) {
    if (readings_began) contents->earlier[name].push_back(known->second);
    known->second = value;
  }
}

/// Keeps the first message that names a version, "ArduCopter V4.6.2 (1ebd4d99)".
void ReadMessage(const DataflashLog::Record& record, Contents* contents) {
  const MessageField* const text = record.format->Find("Message");
  if (text == nullptr || !contents->firmware.empty()) return;
  const std::string_view words = TextIn(*text, record.bytes);
  if (words.starts_with("Ardu")) contents->firmware = words;
}

/// Whether the log names Copter or Plane up to 3.2 as its firmware.
bool IsOf2014(const Contents& contents) {
  for (const std::string_view vehicle : {"ArduCopter V", "ArduPlane V"}) {
    if (!contents.firmware.starts_with(vehicle)) continue;
    const std::string_view version = std::string_view(contents.firmware).substr(vehicle.size());
    for (const std::string_view known : {"2.", "3.0", "3.1", "3.2"}) {
      if (version.starts_with(known)) return true;
    }
  }
  return false;
}

/// Firmware of 2014 has no parameters of a compass matrix, so the identity is added. Other firmware
/// with times in milliseconds gets the identity, too, if its log is undamaged and names no such
/// parameter.
void StateNoCompassMatrix(Contents* contents) {
  if (!contents->in_milliseconds || (!IsOf2014(*contents) && contents->damages > 0)) return;
  Parameters& parameters = contents->parameters;
  for (const auto& [name, value] : parameters) {
    if (name.starts_with("COMPASS_DIA") || name.starts_with("COMPASS_ODI")) return;
  }
  for (const std::string compass : {"", "2", "3"}) {
    for (const std::string axis : {"_X", "_Y", "_Z"}) {
      parameters.emplace("COMPASS_DIA" + compass + axis, 1.0);
      parameters.emplace("COMPASS_ODI" + compass + axis, 0.0);
    }
  }
}

/// The order in which the firmware corrects; for compasses it never changed. Error: the log has
/// times in milliseconds and names no version up to 3.2, so its firmware may have either order.
Result<CorrectionOrder> OrderOf(const Contents& contents, Triad triad) {
  if (!contents.in_milliseconds || triad == Triad::kMagnetometer) {
    return CorrectionOrder::kSensorFrame;
  }
  if (IsOf2014(contents)) return CorrectionOrder::kVehicleFrame;
  return Error(ErrorCode::kMissingKey,
               "the log is older than 2015, and does not name Copter or Plane up to 3.2 as its "
               "firmware");
}

Result<Contents> Survey(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<DataflashLog> log, DataflashLog::Open(path));
  Contents contents;
  for (auto record = log->Next(); record.format != nullptr; record = log->Next()) {
    const MessageFormat& format = *record.format;
    if (format.name == "PARM") {
      ReadParameter(record, !contents.sources.empty(), &contents);
    } else if (format.name == "MSG") {
      ReadMessage(record, &contents);
    } else if (const Source source = SourceOf(format, record.bytes); !source.kind.empty()) {
      Contents::Messages& messages = contents.sources[source];
      const std::int64_t time_ns = TimeOf(format, record.bytes, "TimeUS").value_or(0);
      if (messages.count++ == 0) messages.first_ns = time_ns;
      messages.last_ns = time_ns;
      if (format.Find("TimeUS") == nullptr && format.Find("TimeMS") != nullptr)
        contents.in_milliseconds = true;
      if (source.kind == "IMU" && TemperatureOf(format) != nullptr)
        contents.with_temperature.insert(source.instance);
      if (source.kind == "MAG" && messages.count == 1) {
        const std::optional<Axes> offsets = Axes::Of(format, "Ofs");
        if (offsets) contents.compass_offsets[source.instance] = offsets->In(record.bytes);
      }
    }
  }
  if (log->read_failed())
    return Error(ErrorCode::kDamagedFile, {path}, "could not be read to its end");
  if (log->next_log() > 0) {
    return Error(
        ErrorCode::kWrongFormat,
        {path},
        "another log begins at byte " + std::to_string(log->next_log()) +
            ": logs of several starts of the vehicle were joined; convert each one separately");
  }
  contents.records = log->records();
  contents.skipped_bytes = log->skipped_bytes();
  contents.damages = log->damages();
  StateNoCompassMatrix(&contents);
  return contents;
}

std::string SourceName(const Source& source) {
  return std::string(source.kind) + " of instance " + std::to_string(source.instance);
}

/// The kinds of messages that become one recording.
struct Choice {
  int instance = 0;
  std::string suffix;  ///< End of its file names: "-1".
  std::set<std::string_view> kinds;
};

/// Returns one choice for each requested instance, and at least one choice.
Result<std::vector<Choice>> Choose(const Contents& contents, const Arguments& arguments) {
  for (const std::string& topic : arguments.topics) {
    if (std::find(kKinds.begin(), kKinds.end(), topic) == kKinds.end()) {
      return Error(ErrorCode::kInvalidArgument,
                   "--topic=" + topic + ": is not among IMU, ACC, GYR, MAG");
    }
  }
  std::set<int> instances;
  for (const auto& [source, messages] : contents.sources) instances.insert(source.instance);
  // Numbers that ArduPilot's IMUs cannot have are damage.
  instances.erase(instances.lower_bound(kMostImus), instances.end());
  if (arguments.instance) instances = {*arguments.instance};
  std::vector<Choice> choices;
  for (const int instance : instances) {
    Choice choice{.instance = instance, .suffix = {}, .kinds = {}};
    for (const std::string_view kind : kKinds) {
      const auto& topics = arguments.topics;
      const bool is_asked_for =
          topics.empty() || std::find(topics.begin(), topics.end(), kind) != topics.end();
      if (is_asked_for && contents.sources.contains({kind, instance})) choice.kinds.insert(kind);
    }
    // If a further instance has only GYR, its messages are filtered copies (INS_RAW_LOG_OPT).
    const bool is_further = choice.kinds == std::set<std::string_view>{"GYR"} && !choices.empty();
    if (choice.kinds.empty() || is_further) continue;
    if (!choices.empty()) choice.suffix = "-" + std::to_string(instance);
    choices.push_back(choice);
  }
  if (!choices.empty()) return choices;
  std::vector<std::string> held;
  for (const auto& [source, messages] : contents.sources) held.push_back(SourceName(source));
  return Error(ErrorCode::kNoReadings,
               {arguments.inputs[0]},
               "contains no readings of the requested kind" +
                   (arguments.instance ? " (instance " + std::to_string(*arguments.instance) + ")"
                                       : std::string()) +
                   "; messages with readings: " + ListOf(held) +
                   (held.empty() ? ". Enable IMU logging in LOG_BITMASK and record again" : ""));
}

/// The correction of a sensor's readings, and the mounting of a compass.
std::pair<std::string, std::optional<Eigen::Vector3d>> CorrectionIn(const Parameters& parameters,
                                                                    Triad triad,
                                                                    int instance) {
  const Result<std::string> applied =
      AppliedByFirmware(parameters, CorrectionOrder::kSensorFrame, triad, instance);
  const bool is_compass = triad == Triad::kMagnetometer;
  return {applied ? *applied : applied.error().message,
          is_compass ? DeviceOf(parameters, instance).magnetometer_mount_deg : std::nullopt};
}

/// A parameter that changed within the log and altered a sensor's correction; empty: none.
std::string ChangedCorrection(const Contents& contents, Triad triad, int instance) {
  const auto correction = CorrectionIn(contents.parameters, triad, instance);
  Parameters parameters = contents.parameters;
  for (const auto& [name, values] : contents.earlier) {
    double& value = parameters.at(name);
    const double last = value;
    for (const double earlier : values) {
      value = earlier;
      if (CorrectionIn(parameters, triad, instance) != correction) return name;
    }
    value = last;
  }
  return "";
}

/// The text after `applied.<triad>:`; ` unknown`, with a note, if the log does not determine the
/// correction.
std::string Applied(const Contents& contents, Triad triad, int instance) {
  constexpr std::string_view kWhatToDo =
      "; the recording states `applied: unknown` and is refused until you complete it by hand "
      "(docs/recordings.md)";
  const Result<CorrectionOrder> order = OrderOf(contents, triad);
  Result<std::string> applied =
      order ? AppliedByFirmware(contents.parameters, *order, triad, instance) : order.error();
  const std::string changed = ChangedCorrection(contents, triad, instance);
  if (!changed.empty())
    applied = Error(ErrorCode::kInvalidValue, changed + " changed during the log");
  if (applied && triad == Triad::kMagnetometer) {
    const Result<Eigen::Vector3d> offsets = CompassOffsets(contents.parameters, instance);
    const auto logged = contents.compass_offsets.find(instance);
    // Rows state the offsets truncated to integers.
    if (offsets && logged != contents.compass_offsets.end() &&
        ((*offsets - logged->second).array().abs() >= 1.0 + 1e-3).any()) {
      applied = Error(ErrorCode::kDoesNotMatch,
                      "the offsets logged in its rows differ from the COMPASS_OFS parameters");
    }
  }
  if (applied) return *applied;
  Note(std::string(TriadName(triad)) + ": firmware correction unknown: " + applied.error().message +
       std::string(kWhatToDo));
  return " unknown\n";
}

/// A sensor's three fields of a message: AccX, AccY, AccZ.
struct Part {
  Triad triad;
  std::string prefix, unit;
};
const Part kGyroscope = {Triad::kGyroscope, "Gyr", "rad/s"};
const Part kAccelerometer = {Triad::kAccelerometer, "Acc", "m/s^2"};
const Part kMagnetometer = {Triad::kMagnetometer, "Mag", "mG"};

/// The table for one kind of message, and the sensors in it.
struct Route {
  Table* table = nullptr;
  std::string time_field;
  std::vector<Part> parts;
};

/// Restates the rows of a compass, m = D·s·(y + Ofs) + MO: with the offsets Ofs of the first row,
/// and without the contribution MO of the motors.
class CompassRows {
 public:
  CompassRows(const Contents& contents, int instance)
      : matrix_(CompassMatrix(contents.parameters, instance)) {
    const auto found = contents.compass_offsets.find(instance);
    if (found != contents.compass_offsets.end()) first_offsets_ = found->second;
  }

  Eigen::Vector3d Restated(const MessageFormat& format, std::string_view record) {
    Eigen::Vector3d reading = Axes::Of(format, "Mag")->In(record);
    std::optional<Axes> motor = Axes::Of(format, "MO");
    if (!motor) motor = Axes::Of(format, "MOfs");
    if (motor) reading -= motor->In(record);
    const std::optional<Axes> offset_fields = Axes::Of(format, "Ofs");
    if (!offset_fields || !first_offsets_ || !matrix_) return reading;
    const Eigen::Vector3d change = *first_offsets_ - offset_fields->In(record);
    if (change.isZero(0.0)) return reading;
    ++restated_;
    for (int axis = 0; axis < 3; ++axis) reading += matrix_->col(axis) * change[axis];
    return reading;
  }

  std::uint64_t restated() const { return restated_; }

 private:
  Result<Eigen::Matrix3d> matrix_;
  std::optional<Eigen::Vector3d> first_offsets_;
  std::uint64_t restated_ = 0;
};

/// The second pass: converts messages to rows of tables.
class Conversion {
 public:
  Conversion(const Contents& contents, const Choice& choice, RecordingFolder* folder)
      : choice_(choice), compass_(contents, choice.instance) {
    is_thermal_ = contents.with_temperature.contains(choice.instance) &&
                  IsCorrectedByTemperature(contents.parameters, choice.instance);
    const auto add = [&](const std::string& kind,
                         const std::string& time_field,
                         const std::string& file,
                         const std::vector<Part>& parts) {
      std::vector<TriadColumns> columns;
      for (const Part& part : parts)
        columns.push_back({part.triad, part.unit, Applied(contents, part.triad, choice.instance)});
      const bool has_temperature =
          kind != "MAG" && contents.with_temperature.contains(choice.instance);
      Table* const table =
          folder->AddTable(file + choice.suffix + ".csv", std::move(columns), {has_temperature});
      routes_[kind] = {table, time_field, parts};
    };
    const auto& kinds = choice.kinds;
    std::vector<Part> imu;
    if (!kinds.contains("GYR")) imu.push_back(kGyroscope);
    if (!kinds.contains("ACC")) imu.push_back(kAccelerometer);
    if (kinds.contains("IMU") && !imu.empty()) add("IMU", "TimeUS", "imu", imu);
    if (kinds.contains("GYR")) add("GYR", "SampleUS", "gyroscope", {kGyroscope});
    if (kinds.contains("ACC")) add("ACC", "SampleUS", "accelerometer", {kAccelerometer});
    if (kinds.contains("MAG")) add("MAG", "TimeUS", "magnetometer", {kMagnetometer});
  }

  void Take(const Source& source, const MessageFormat& format, std::string_view record) {
    if (source.instance != choice_.instance) return;
    if (source.kind == "IMU") SetTemperature(format, record);
    // A temperature correction cannot be undone without the temperature.
    if (is_thermal_ && !has_temperature_ && source.kind != "MAG") {
      ++without_temperature_;
      return;
    }
    const auto route = routes_.find(source.kind);
    if (route == routes_.end()) return;
    const std::optional<std::int64_t> time_ns = TimeOf(format, record, route->second.time_field);
    std::array<double, 6> readings{};
    readings.fill(kNothing);
    bool whole = time_ns.has_value();
    auto reading = readings.begin();
    for (const Part& part : route->second.parts) {
      const std::optional<Axes> axes = Axes::Of(format, part.prefix);
      const bool is_field = part.triad == Triad::kMagnetometer;
      whole = whole && (axes || !is_field);
      if (whole && axes) {
        const Eigen::Vector3d values =
            is_field ? compass_.Restated(format, record) : axes->In(record);
        std::copy(values.begin(), values.end(), reading);
      }
      reading += 3;
    }
    if (!whole) {
      ++without_time_;
      return;
    }
    route->second.table->Add(*time_ns, readings.data());
  }

  std::uint64_t restated() const { return compass_.restated(); }
  std::uint64_t without_time() const { return without_time_; }
  std::uint64_t without_temperature() const { return without_temperature_; }

 private:
  void SetTemperature(const MessageFormat& format, std::string_view record) {
    const MessageField* const field = TemperatureOf(format);
    if (field == nullptr) return;
    const double temperature_degc = NumberIn(*field, record);
    has_temperature_ = true;
    for (auto& [kind, route] : routes_) {
      if (route.table->has_temperature()) route.table->SetTemperature(temperature_degc);
    }
  }

  Choice choice_;
  CompassRows compass_;
  std::map<std::string, Route, std::less<>> routes_;
  std::uint64_t without_time_ = 0, without_temperature_ = 0;
  bool is_thermal_ = false, has_temperature_ = false;
};

void List(const Contents& contents) {
  if (!contents.firmware.empty())
    std::printf("firmware: %s\n", PrintableLine(contents.firmware).c_str());
  std::printf(
      "%-6s %8s %10s %14s %14s\n", "topic", "instance", "messages", "first [s]", "last [s]");
  for (const auto& [source, messages] : contents.sources) {
    std::printf("%-6s %8d %10llu %14.6f %14.6f\n",
                std::string(source.kind).c_str(),
                source.instance,
                static_cast<unsigned long long>(messages.count),
                1e-9 * static_cast<double>(messages.first_ns),
                1e-9 * static_cast<double>(messages.last_ns));
  }
}

void SayWhatIsDamaged(const Contents& contents, const std::string& path) {
  if (contents.skipped_bytes == 0) return;
  Note(path + ": " + Counted(contents.skipped_bytes, "byte") + " in " +
       Counted(contents.damages, "place") +
       " skipped, since they are not part of a complete message; " +
       Counted(contents.records, "message") + " complete");
}

/// Fills in the manifest of the recording that begins.
void Describe(const Contents& contents,
              const std::string& input,
              int instance,
              RecordingFolder* folder) {
  folder->SetOrigin("ardupilot-dataflash", {input});
  folder->SetSource("instance", std::to_string(instance));
  if (!contents.firmware.empty()) folder->SetSource("firmware", contents.firmware);
  if (contents.skipped_bytes > 0) {
    folder->SetSource("bytes skipped", std::to_string(contents.skipped_bytes));
  }
  folder->SetFrame("vehicle, after AHRS_ORIENTATION; board once `applied` is undone");
  Tags device = DeviceOf(contents.parameters, instance);
  const Result<CorrectionOrder> order = OrderOf(contents, Triad::kAccelerometer);
  if (order && *order == CorrectionOrder::kVehicleFrame) device.firmware = kArduPilotOf2014;
  folder->SetDevice(device);
}

Status Run(const Arguments& arguments) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Contents contents, Survey(arguments.inputs[0]));
  SayWhatIsDamaged(contents, arguments.inputs[0]);
  if (arguments.list) {
    List(contents);
    return {};
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<Choice> choices, Choose(contents, arguments));
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<RecordingFolder> folder,
                             RecordingFolder::Create(arguments.output));
  std::vector<Conversion> conversions;
  for (const Choice& choice : choices) {
    if (!conversions.empty()) folder->BeginRecording(choice.instance);
    Describe(contents, arguments.inputs[0], choice.instance, folder.get());
    conversions.emplace_back(contents, choice, folder.get());
  }
  {
    TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<DataflashLog> log,
                               DataflashLog::Open(arguments.inputs[0]));
    ProgressLine line("Converting");
    const ProgressCallback progress = line.callback();
    for (auto record = log->Next(); record.format != nullptr; record = log->Next()) {
      const Source source = SourceOf(*record.format, record.bytes);
      if (source.kind.empty()) continue;
      for (Conversion& conversion : conversions) {
        conversion.Take(source, *record.format, record.bytes);
      }
      if (progress) progress(log->progress());
    }
  }
  for (const Conversion& conversion : conversions) {
    if (conversion.restated() > 0) {
      Note("magnetometer: " + Counted(conversion.restated(), "row") +
           " logged with changed offsets; converted as if logged with the first offsets");
    }
    if (conversion.without_temperature() > 0) {
      Note(Counted(conversion.without_temperature(), "row") +
           " before the first temperature skipped: their temperature correction (INS_TCAL) is not "
           "known");
    }
    if (conversion.without_time() > 0) {
      Note(Counted(conversion.without_time(), "message") + " skipped (no time or no readings)");
    }
  }
  return folder->Commit();
}

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  return truetriad::convert::RunConverter(
      {.format = "dataflash", .flags = {"topic", "instance"}, .run = truetriad::convert::Run},
      argc,
      argv);
}
