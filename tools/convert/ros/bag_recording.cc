// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/ros/bag_recording.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <sstream>
#include <utility>

#include "io/yaml_reader.h"
#include "tools/convert/common/named_readings.h"
#include "truetriad/base/units.h"

namespace truetriad::convert {
namespace {

/// "/imu:gx+gy+gz@t": a topic, fields of its messages, and the field with their time.
struct Reference {
  std::string topic, fields, time;

  static Reference Of(const std::string& text) {
    Reference reference;
    const std::size_t at = std::min(text.rfind('@'), text.size());
    if (at + 1 < text.size()) reference.time = text.substr(at + 1);
    const std::string rest = text.substr(0, at);
    const std::size_t colon = std::min(rest.find(':'), rest.size());
    reference.topic = rest.substr(0, colon);
    if (colon < rest.size()) reference.fields = rest.substr(colon + 1);
    return reference;
  }
};

/// Reference by role. Error (usage): no such role, or one twice.
Result<std::map<std::string, std::string>> ParseColumns(const std::string& columns) {
  std::map<std::string, std::string> roles;
  std::istringstream stream(columns);
  for (std::string item; std::getline(stream, item, ',');) {
    const std::size_t equals = std::min(item.find('='), item.size());
    const std::string role = item.substr(0, equals);
    if (equals == item.size() || (!TriadFromName(role) && role != "temperature")) {
      return Error(ErrorCode::kInvalidArgument,
                   "--columns: `" + Printable(item) +
                       "` is not one of accelerometer=, gyroscope=, magnetometer=, temperature=, "
                       "as in accelerometer=/topic:fields");
    }
    if (!roles.emplace(role, item.substr(equals + 1)).second)
      return Error(ErrorCode::kInvalidArgument, "--columns: " + role + " is given twice");
  }
  return roles;
}

/// Nanoseconds; unset where they are beyond what a time can be.
std::optional<std::int64_t> TimeNs(const MessageNumbers::Number& number, double ns_per_unit) {
  if (ns_per_unit == 0.0) return number.integer;
  constexpr long double kLargest = 9.2e18L;
  // Of 64 bits, a double would lose some.
  const long double value = number.integer != 0 ? static_cast<long double>(number.integer)
                                                : static_cast<long double>(number.value);
  const long double time_ns = value * static_cast<long double>(ns_per_unit);
  if (!(std::abs(time_ns) < kLargest)) return std::nullopt;
  return std::llround(time_ns);
}

}  // namespace

std::vector<std::size_t> BagTopics::Add(const std::vector<Topic>& topics) {
  std::vector<std::size_t> places;
  for (const Topic& topic : topics) {
    const auto found = std::find_if(topics_.begin(), topics_.end(), [&](const Topic& other) {
      return other.name == topic.name && other.type == topic.type;
    });
    places.push_back(static_cast<std::size_t>(found - topics_.begin()));
    if (found == topics_.end()) {
      topics_.push_back(topic);
      continue;
    }
    found->is_counted = found->is_counted && topic.is_counted;
    if (found->definition.empty()) found->definition = topic.definition;
    if (topic.messages == 0) continue;
    found->first_ns =
        found->messages == 0 ? topic.first_ns : std::min(found->first_ns, topic.first_ns);
    found->last_ns = std::max(found->last_ns, topic.last_ns);
    found->messages += topic.messages;
  }
  return places;
}

std::int64_t BeginOf(const std::vector<Topic>& topics) {
  std::int64_t begin = std::numeric_limits<std::int64_t>::max();
  for (const Topic& topic : topics) {
    if (topic.messages > 0) begin = std::min(begin, topic.first_ns);
  }
  return begin;
}

Result<std::unique_ptr<BagRecording>> BagRecording::Create(const std::vector<Topic>& topics,
                                                           const Arguments& arguments,
                                                           Encoding encoding,
                                                           const std::string& format,
                                                           const std::string& converter,
                                                           ReadMessage read) {
  std::unique_ptr<BagRecording> recording(new BagRecording());
  recording->topics_ = topics;
  recording->read_ = std::move(read);
  if (arguments.others.contains("columns")) {
    TRUETRIAD_RETURN_IF_ERROR(recording->OpenLaidOut(arguments, encoding, format, converter));
    return recording;
  }
  for (const std::string flag : {"units", "layout"}) {
    if (!arguments.others.contains(flag)) continue;
    return Error(ErrorCode::kMissingArgument,
                 "--" + flag + " needs --columns, as in --columns=accelerometer=/topic:fields");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(recording->choice_, ChooseTopics(recording->topics_, arguments));
  TRUETRIAD_ASSIGN_OR_RETURN(
      recording->standard_, ImuRecording::Create(recording->choice_, arguments, format, converter));
  return recording;
}

Result<std::size_t> BagRecording::FindTopic(const std::string& name) const {
  std::vector<std::string> held;
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    held.push_back(topics_[i].name + " (" + topics_[i].type + ")");
    if (topics_[i].name != name) continue;
    if (found) {
      return Error(ErrorCode::kInvalidArgument,
                   "--columns: " + Printable(name) + " has messages of two types, " +
                       Printable(topics_[*found].type) + " and " + Printable(topics_[i].type));
    }
    found = i;
  }
  if (found) return *found;
  if (held.empty())
    return Error(ErrorCode::kNoReadings, "the bag contains no topic that can be read");
  return Error(ErrorCode::kUnknownName,
               "--columns: no topic " + Printable(name) + "; the bag contains " + ListOf(held));
}

/// Which fields the messages of `topics` have: as the bag says, or --layout.
Status BagRecording::ReadLayouts(const Arguments& arguments,
                                 const std::vector<std::size_t>& topics) {
  Status of_bag;
  for (const std::size_t topic : topics) {
    if (topics_[topic].definition.empty()) continue;
    Status status = layouts_->Define(topics_[topic].type, topics_[topic].definition);
    if (!status) of_bag = std::move(status);
  }
  const auto file = arguments.others.find("layout");
  if (file != arguments.others.end()) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string text, ReadSmallFile(file->second));
    // What begins without a name is that of the only type there is.
    std::vector<std::string> types;
    for (const std::size_t topic : topics) {
      if (std::find(types.begin(), types.end(), topics_[topic].type) == types.end())
        types.push_back(topics_[topic].type);
    }
    const Status status = layouts_->Define(types.size() == 1 ? types[0] : "", text);
    if (!status) return Error(status.error().code, {file->second}, status.error().message);
  } else if (!of_bag) {
    return Error(of_bag.error().code,
                 {arguments.input},
                 of_bag.error().message + "; the bag is damaged there: give --layout=FILE.msg");
  }
  for (const std::size_t topic : topics)
    TRUETRIAD_RETURN_IF_ERROR(layouts_->Check(topics_[topic].type));
  return {};
}

Status BagRecording::OpenLaidOut(const Arguments& arguments,
                                 Encoding encoding,
                                 const std::string& format,
                                 const std::string& converter) {
  if (!arguments.topics.empty()) {
    return Error(ErrorCode::kConflictingArguments,
                 "--topic and --columns exclude each other; --columns names its topics");
  }
  const std::string& columns = arguments.others.at("columns");
  TRUETRIAD_ASSIGN_OR_RETURN(const auto roles, ParseColumns(columns));
  std::vector<std::size_t> topics;
  for (const auto& [role, text] : roles) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t topic, FindTopic(Reference::Of(text).topic));
    topics.push_back(topic);
  }
  layouts_.emplace(encoding);
  TRUETRIAD_RETURN_IF_ERROR(ReadLayouts(arguments, topics));
  std::map<std::string, std::string> with_units;
  for (const auto& [role, text] : roles) {
    const Reference reference = Reference::Of(text);
    TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t topic, FindTopic(reference.topic));
    std::optional<MessageNumbers>& numbers = laid_out_[topic].numbers;
    if (!numbers) numbers.emplace(&*layouts_, topics_[topic].type, encoding);
    // A time of ROS has a unit already.
    const bool has_unit = reference.time.empty() || numbers->IsTime(reference.time);
    with_units[role] = has_unit ? reference.topic : reference.topic + '@' + reference.time;
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const auto units, ReadUnits(with_units, arguments));
  TRUETRIAD_ASSIGN_OR_RETURN(folder_, RecordingFolder::Create(arguments.output));
  folder_->SetSource("format", format);
  folder_->SetSource("file", std::filesystem::path(arguments.input).filename().string());
  folder_->SetSource("converter", converter);
  folder_->SetSource("columns", columns);
  for (const auto& [role, text] : roles)
    TRUETRIAD_RETURN_IF_ERROR(AddRole(role, text, units, roles.contains("temperature")));
  return {};
}

Status BagRecording::AddRole(const std::string& role,
                             const std::string& text,
                             const std::map<std::string, std::string>& units,
                             bool has_temperature) {
  const Reference reference = Reference::Of(text);
  TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t index, FindTopic(reference.topic));
  LaidOutTopic& topic = laid_out_.at(index);
  MessageNumbers& numbers = *topic.numbers;
  const std::optional<Triad> triad = TriadFromName(role);
  if (!triad) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string path, numbers.Single(reference.fields));
    topic.temperature = numbers.Ask(path);
    topic.temperature_unit = *ParseTemperatureUnit(units.at(role));
    return {};
  }
  Sensor sensor;
  sensor.triad = *triad;
  TRUETRIAD_ASSIGN_OR_RETURN(const MessageNumbers::Three three, numbers.Vector(reference.fields));
  sensor.places = numbers.Ask(three);
  std::string time = numbers.Stamp();
  if (!reference.time.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(time, numbers.Single(reference.time));
    if (!numbers.IsTime(time)) sensor.ns_per_unit = *NanosecondsPer(units.at("time"));
  }
  if (!time.empty()) sensor.time = numbers.Ask(time);
  sensor.table = folder_->AddTable(
      role + ".csv", {{.triad = *triad, .unit = units.at(role), .applied = {}}}, {has_temperature});
  topic.sensors.push_back(sensor);
  return {};
}

bool BagRecording::Wants(std::size_t topic) const {
  return standard_ ? choice_.RoleOfTopic(&topics_[topic]) != Role::kNone
                   : laid_out_.contains(topic);
}

void BagRecording::Take(std::size_t topic, std::int64_t received_ns, std::string_view bytes) {
  if (!standard_) {
    TakeLaidOut(&laid_out_.at(topic), received_ns, bytes);
    return;
  }
  const Role role = choice_.RoleOfTopic(&topics_[topic]);
  const std::optional<ImuMessage> message = read_(role, bytes);
  if (message) {
    standard_->Add(role, received_ns, *message);
  } else {
    standard_->CountDamaged();
  }
}

void BagRecording::TakeLaidOut(LaidOutTopic* topic,
                               std::int64_t received_ns,
                               std::string_view bytes) {
  ++messages_;
  MessageNumbers& numbers = *topic->numbers;
  if (!numbers.Read(bytes)) {
    ++(numbers.WasNotThree() ? not_three_ : damaged_);
    return;
  }
  if (topic->temperature) {
    const TemperatureUnit& unit = topic->temperature_unit;
    const double degc = unit.scale * numbers[*topic->temperature].value + unit.offset;
    for (const auto& [index, other] : laid_out_) {
      for (const Sensor& sensor : other.sensors) sensor.table->SetTemperature(degc);
    }
  }
  bool has_stamp = true;
  for (const Sensor& sensor : topic->sensors) {
    std::optional<std::int64_t> time_ns =
        sensor.time ? TimeNs(numbers[*sensor.time], sensor.ns_per_unit) : 0;
    if (!time_ns) {
      ++damaged_;
      return;
    }
    if (*time_ns == 0 && sensor.ns_per_unit == 0.0) {
      time_ns = received_ns;
      has_stamp = false;
    }
    std::array<double, 3> readings{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      readings[axis] = numbers[sensor.places[axis]].value;
    sensor.table->Add(*time_ns, readings.data());
  }
  if (!has_stamp) ++without_stamp_;
}

void BagRecording::SetSource(const std::string& key, const std::string& value) {
  if (standard_) {
    standard_->SetSource(key, value);
  } else {
    folder_->SetSource(key, value);
  }
}

Status BagRecording::Commit() {
  if (standard_) return standard_->Commit();
  if (damaged_ > 0) {
    Note(Count(damaged_, "message", "messages") +
         " skipped (too short, too long, malformed, or not of the layout)");
    folder_->SetSource("messages skipped", std::to_string(damaged_));
  }
  if (not_three_ > 0) {
    Note(Count(not_three_, "message", "messages") +
         " skipped (an array that is not of three numbers; say which three, as in data:4-6)");
    folder_->SetSource("messages skipped for an array of another length",
                       std::to_string(not_three_));
  }
  if (without_stamp_ > 0) {
    Note(Count(without_stamp_, "message", "messages") + " of " + std::to_string(messages_) +
         " without a time stamp; used the time the bag received them");
  }
  return folder_->Commit();
}

std::string_view LaidOutHelp() {
  return "\nOther messages: --columns=accelerometer=/topic:fields,gyroscope=… says which fields "
         "are the\nreadings (acc, gx+gy+gz, or data:4-6, counted from 1), `@field` behind them "
         "which is\ntheir time, temperature=/topic:field; --units=us,m/s^2,rad/s,uT,degC. "
         "--layout=FILE.msg has\nthe definition of the type where the bag does not. Several bags, "
         "or a folder of them, are\none recording.\n";
}

}  // namespace truetriad::convert
