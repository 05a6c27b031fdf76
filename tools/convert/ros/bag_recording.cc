// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/ros/bag_recording.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "io/yaml_reader.h"
#include "tools/convert/common/named_readings.h"
#include "tools/convert/common/recording_folder.h"
#include "truetriad/base/triad.h"

namespace truetriad::convert {
namespace {

/// The use of a sensor_msgs topic in a recording.
enum class Role { kNone, kImu, kMagneticField, kTemperature };

constexpr struct {
  Role role;
  std::string_view type, key;  ///< `key`: of the topic's name, under `source:`.
} kStandard[] = {{Role::kImu, "sensor_msgs/Imu", "imu topic"},
                 {Role::kMagneticField, "sensor_msgs/MagneticField", "magnetic field topic"},
                 {Role::kTemperature, "sensor_msgs/Temperature", "temperature topic"}};

Role RoleOf(const Topic& topic) {
  const std::string name = TypeName(topic.type);
  for (const auto& [role, type, key] : kStandard) {
    if (type == name) return role;
  }
  return Role::kNone;
}

std::vector<std::string> NamesAndTypes(const std::vector<Topic>& topics) {
  std::vector<std::string> held;
  for (const Topic& topic : topics) held.push_back(topic.name + " (" + topic.type + ")");
  return held;
}

Error NothingReadable() {
  return Error(ErrorCode::kNoReadings, "the bag contains no topic that can be read");
}

/// The topics of a recording: one Imu, one MagneticField or both, and optionally a Temperature.
using TopicChoice = std::map<Role, std::size_t>;

/// Selects a candidate of `role`, if there is one: the candidate with the number `instance`, or
/// without `instance` the only one. Error (usage): there are several, and no `instance`.
Status TakeTheOnly(Role role,
                   const std::vector<Topic>& topics,
                   const std::vector<std::size_t>& candidates,
                   std::optional<int> instance,
                   TopicChoice* choice) {
  std::vector<std::size_t> found;
  std::vector<std::string> names;
  for (const std::size_t topic : candidates) {
    if (RoleOf(topics[topic]) != role) continue;
    found.push_back(topic);
    names.push_back(topics[topic].name);
  }
  const std::size_t place = static_cast<std::size_t>(instance.value_or(0));
  if (found.size() > 1 && !instance) {
    return Error(ErrorCode::kMissingArgument,
                 "several topics have the same type: " + ListOf(names) +
                     "; choose one with --topic=NAME, or one of each type, separated by commas");
  }
  if (place < found.size()) (*choice)[role] = found[place];
  return {};
}

/// The topics that the user named, or the only topic of each type. Error (usage): a type has
/// several topics and the user named none. Error (bad input): no topic has readings.
Result<TopicChoice> ChooseTopics(const std::vector<Topic>& topics, const Arguments& arguments) {
  std::vector<std::size_t> candidates;
  for (std::size_t i = 0; arguments.topics.empty() && i < topics.size(); ++i) {
    if (topics[i].messages > 0 || !topics[i].is_counted) candidates.push_back(i);
  }
  for (const std::string& name : arguments.topics) {
    const auto found = std::find_if(
        topics.begin(), topics.end(), [&](const Topic& topic) { return topic.name == name; });
    if (topics.empty()) return NothingReadable();
    if (found == topics.end()) {
      return Error(
          ErrorCode::kUnknownName,
          "--topic=" + name + ": no such topic; the bag contains " + ListOf(NamesAndTypes(topics)));
    }
    if (RoleOf(*found) == Role::kNone) {
      return Error(ErrorCode::kInvalidArgument,
                   "--topic=" + name + " is of type " + PrintableLine(found->type) +
                       "; supported are Imu, MagneticField and Temperature of sensor_msgs");
    }
    candidates.push_back(static_cast<std::size_t>(found - topics.begin()));
  }
  TopicChoice choice;
  for (const auto& [role, type, key] : kStandard) {
    // A temperature can belong to anything, so it is used only if named.
    if (role == Role::kTemperature && arguments.topics.empty()) continue;
    TRUETRIAD_RETURN_IF_ERROR(TakeTheOnly(role, topics, candidates, arguments.instance, &choice));
  }
  if (choice.contains(Role::kImu) || choice.contains(Role::kMagneticField)) return choice;
  if (arguments.instance && !candidates.empty()) {
    return Error(ErrorCode::kInvalidArgument,
                 "--instance=" + std::to_string(*arguments.instance) +
                     ": no such instance; no type has that many topics (the first is 0)");
  }
  return Error(ErrorCode::kNoReadings,
               {arguments.inputs[0]},
               "contains no sensor_msgs/Imu or sensor_msgs/MagneticField messages, so "
               "nothing to calibrate; topics: " +
                   ListOf(NamesAndTypes(topics)));
}

void ListTopics(const std::vector<Topic>& topics) {
  std::printf("%-40s %-32s %10s %20s %20s\n",
              "topic",
              "type",
              "messages",
              "first received [s]",
              "last received [s]");
  for (const Topic& topic : topics) {
    std::printf("%-40s %-32s %10llu %20.6f %20.6f\n",
                PrintableLine(topic.name).c_str(),
                PrintableLine(topic.type).c_str(),
                static_cast<unsigned long long>(topic.messages),
                1e-9 * static_cast<double>(topic.first_ns),
                1e-9 * static_cast<double>(topic.last_ns));
  }
}

/// "/imu:gx+gy+gz@t": a topic, fields of its messages, and the field with the messages' time.
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

constexpr std::array<std::string_view, 4> kRoles = {
    "accelerometer", "gyroscope", "magnetometer", "temperature"};

/// The time in nanoseconds; unset if it is out of range.
std::optional<std::int64_t> TimeNs(const MessageNumbers::Number& number, double ns_per_unit) {
  if (ns_per_unit == 0.0) return number.integer;
  constexpr long double kLargest = 9.2e18L;
  // A double would lose digits of a 64-bit integer.
  const long double value = number.integer != 0 ? static_cast<long double>(number.integer)
                                                : static_cast<long double>(number.value);
  const long double time_ns = value * static_cast<long double>(ns_per_unit);
  if (!(std::abs(time_ns) < kLargest)) return std::nullopt;
  return std::llround(time_ns);
}

/// Builds a recording from messages of sensor_msgs, or from those of --columns.
class BagRecording {
 public:
  BagRecording(const BagFormat& format, const std::vector<Topic>& topics)
      : format_(format), topics_(topics), layouts_(format.encoding) {}

  Status Open(const Arguments& arguments);
  bool Wants(std::size_t topic) const { return taken_.contains(topic); }
  void Take(std::size_t index, std::int64_t received_ns, std::string_view bytes);
  void SetSource(const std::string& key, const std::string& value) {
    folder_->SetSource(key, value);
  }
  Status Commit();

 private:
  /// Three numbers of a message, multiplied by `factor`. If the number at `covariance` is -1, the
  /// message has no such reading.
  struct Readings {
    std::array<std::size_t, 3> places{};
    std::optional<std::size_t> covariance{};
    double factor = 1.0;
  };
  /// How a message becomes a row of a table.
  struct Row {
    Table* table = nullptr;
    std::vector<Readings> readings;
    std::optional<std::size_t> time{};
    double ns_per_unit = 0.0;  ///< 0: the time is in nanoseconds already.
  };
  struct TakenTopic {
    std::optional<MessageNumbers> numbers{};
    std::vector<Row> rows{};
    bool has_magnetometer = false;
    std::optional<std::size_t> temperature{};
    TemperatureUnit temperature_unit{};
    std::optional<std::size_t> frame{};
    std::string first_frame{};
  };

  Status CreateFolder(const Arguments& arguments);
  Status OpenStandard(const Arguments& arguments);
  Status AddStandard(std::size_t topic, Role role, bool has_temperature);
  Status OpenLaidOut(const Arguments& arguments, const std::string& columns);
  Status AddRole(const std::string& role,
                 const std::string& reference,
                 const ByRole& units,
                 bool has_temperature);
  TakenTopic& Taken(std::size_t topic);
  Result<std::size_t> FindTopic(const std::string& name) const;
  Status ReadLayouts(const Arguments& arguments, const std::vector<std::size_t>& topics);
  void StateFrame();

  const BagFormat& format_;
  const std::vector<Topic>& topics_;
  MessageLayouts layouts_;
  std::unique_ptr<RecordingFolder> folder_;
  std::map<std::size_t, TakenTopic> taken_;
  std::uint64_t damaged_ = 0, not_three_ = 0, without_stamp_ = 0, messages_ = 0;
};

Status BagRecording::Open(const Arguments& arguments) {
  const auto columns = arguments.others.find("columns");
  if (columns != arguments.others.end()) return OpenLaidOut(arguments, columns->second);
  for (const std::string flag : {"units", "layout"}) {
    if (!arguments.others.contains(flag)) continue;
    return Error(ErrorCode::kMissingArgument,
                 "--" + flag + " needs --columns, as in --columns=accelerometer=/topic:fields");
  }
  return OpenStandard(arguments);
}

Status BagRecording::CreateFolder(const Arguments& arguments) {
  TRUETRIAD_ASSIGN_OR_RETURN(folder_, RecordingFolder::Create(arguments.output));
  folder_->SetOrigin(std::string(format_.source), {arguments.inputs[0]});
  return {};
}

BagRecording::TakenTopic& BagRecording::Taken(std::size_t topic) {
  TakenTopic& taken = taken_[topic];
  if (taken.numbers) return taken;
  MessageNumbers& numbers = taken.numbers.emplace(&layouts_, topics_[topic].type, format_.encoding);
  if (const std::string frame = numbers.Frame(); !frame.empty()) taken.frame = numbers.Ask(frame);
  return taken;
}

Status BagRecording::OpenStandard(const Arguments& arguments) {
  TRUETRIAD_ASSIGN_OR_RETURN(const TopicChoice choice, ChooseTopics(topics_, arguments));
  TRUETRIAD_RETURN_IF_ERROR(CreateFolder(arguments));
  for (const auto& [role, type, key] : kStandard) {
    const auto topic = choice.find(role);
    if (topic == choice.end()) continue;
    SetSource(std::string(key), topics_[topic->second].name);
    TRUETRIAD_RETURN_IF_ERROR(
        AddStandard(topic->second, role, choice.contains(Role::kTemperature)));
  }
  return {};
}

/// sensor_msgs: Imu.msg, MagneticField.msg, Temperature.msg.
Status BagRecording::AddStandard(std::size_t index, Role role, bool has_temperature) {
  constexpr double kMicroteslaPerTesla = 1e6;  // sensor_msgs/MagneticField is in tesla.
  TakenTopic& topic = Taken(index);
  MessageNumbers& numbers = *topic.numbers;
  if (role == Role::kTemperature) {
    topic.temperature = numbers.Ask("temperature");
    topic.temperature_unit = *ParseTemperatureUnit("degC");
    return {};
  }
  Row row;
  row.time = numbers.Ask("header.stamp");
  if (role == Role::kMagneticField) {
    TRUETRIAD_ASSIGN_OR_RETURN(const auto field, numbers.Vector("magnetic_field"));
    row.readings.push_back({.places = numbers.Ask(field), .factor = kMicroteslaPerTesla});
    row.table = folder_->AddTable("magnetometer.csv",
                                  {{.triad = Triad::kMagnetometer, .unit = "uT", .applied = {}}},
                                  {has_temperature});
    topic.has_magnetometer = true;
  } else {
    for (const std::string name : {"angular_velocity", "linear_acceleration"}) {
      TRUETRIAD_ASSIGN_OR_RETURN(const auto vector, numbers.Vector(name));
      row.readings.push_back(
          {.places = numbers.Ask(vector), .covariance = numbers.Ask(name + "_covariance.0")});
    }
    row.table =
        folder_->AddTable("imu.csv",
                          {{.triad = Triad::kGyroscope, .unit = "rad/s", .applied = {}},
                           {.triad = Triad::kAccelerometer, .unit = "m/s^2", .applied = {}}},
                          {has_temperature});
  }
  topic.rows.push_back(row);
  return {};
}

Result<std::size_t> BagRecording::FindTopic(const std::string& name) const {
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    if (topics_[i].name != name) continue;
    if (found) {
      return Error(ErrorCode::kInvalidArgument,
                   "--columns: " + PrintableLine(name) + " has messages of two types, " +
                       PrintableLine(topics_[*found].type) + " and " +
                       PrintableLine(topics_[i].type));
    }
    found = i;
  }
  if (found) return *found;
  if (topics_.empty()) return NothingReadable();
  return Error(ErrorCode::kUnknownName,
               "--columns: no topic " + PrintableLine(name) + "; the bag contains " +
                   ListOf(NamesAndTypes(topics_)));
}

/// Reads the layouts of the messages of `topics` from the bag or from --layout.
Status BagRecording::ReadLayouts(const Arguments& arguments,
                                 const std::vector<std::size_t>& topics) {
  Status of_bag;
  for (const std::size_t topic : topics) {
    if (topics_[topic].definition.empty()) continue;
    Status status = layouts_.Define(topics_[topic].type, topics_[topic].definition);
    if (!status) of_bag = std::move(status);
  }
  const auto file = arguments.others.find("layout");
  if (file != arguments.others.end()) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string text, ReadSmallFile(file->second));
    // If there is only one type, a definition that names no type belongs to it.
    std::set<std::string> types;
    for (const std::size_t topic : topics) types.insert(topics_[topic].type);
    const Status status = layouts_.Define(types.size() == 1 ? *types.begin() : "", text);
    if (!status) return Error(status.error().code, {file->second}, status.error().message);
  } else if (!of_bag) {
    return Error(of_bag.error().code,
                 {arguments.inputs[0]},
                 of_bag.error().message + "; the bag is damaged there: give --layout=FILE.msg");
  }
  for (const std::size_t topic : topics)
    TRUETRIAD_RETURN_IF_ERROR(layouts_.Check(topics_[topic].type));
  return {};
}

Status BagRecording::OpenLaidOut(const Arguments& arguments, const std::string& columns) {
  if (!arguments.topics.empty() || arguments.instance) {
    return Error(
        ErrorCode::kConflictingArguments,
        "--topic, --instance and --columns exclude each other; --columns names its topics");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const ByRole roles,
                             ParseColumns(columns, kRoles, ", as in accelerometer=/topic:fields"));
  std::vector<std::size_t> topics;
  for (const auto& [role, text] : roles) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t topic, FindTopic(Reference::Of(text).topic));
    topics.push_back(topic);
  }
  TRUETRIAD_RETURN_IF_ERROR(ReadLayouts(arguments, topics));
  ByRole with_units;
  for (const auto& [role, text] : roles) {
    const Reference reference = Reference::Of(text);
    TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t topic, FindTopic(reference.topic));
    // A field of type time has its unit already.
    const bool has_unit = reference.time.empty() || Taken(topic).numbers->IsTime(reference.time);
    with_units[role] = has_unit ? reference.topic : reference.topic + '@' + reference.time;
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const auto units, ReadUnits(with_units, arguments));
  TRUETRIAD_RETURN_IF_ERROR(CreateFolder(arguments));
  SetSource("columns", columns);
  for (const auto& [role, text] : roles)
    TRUETRIAD_RETURN_IF_ERROR(AddRole(role, text, units, roles.contains("temperature")));
  return {};
}

Status BagRecording::AddRole(const std::string& role,
                             const std::string& text,
                             const ByRole& units,
                             bool has_temperature) {
  const Reference reference = Reference::Of(text);
  TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t index, FindTopic(reference.topic));
  TakenTopic& topic = Taken(index);
  MessageNumbers& numbers = *topic.numbers;
  const std::optional<Triad> triad = TriadFromName(role);
  if (!triad) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string path, numbers.Single(reference.fields));
    topic.temperature = numbers.Ask(path);
    topic.temperature_unit = *ParseTemperatureUnit(units.at(role));
    return {};
  }
  Row row;
  TRUETRIAD_ASSIGN_OR_RETURN(const MessageNumbers::Three three, numbers.Vector(reference.fields));
  row.readings.push_back({.places = numbers.Ask(three)});
  std::string time = numbers.Stamp();
  if (!reference.time.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(time, numbers.Single(reference.time));
    if (!numbers.IsTime(time)) row.ns_per_unit = *NanosecondsPer(units.at("time"));
  }
  if (!time.empty()) row.time = numbers.Ask(time);
  row.table = folder_->AddTable(
      role + ".csv", {{.triad = *triad, .unit = units.at(role), .applied = {}}}, {has_temperature});
  topic.has_magnetometer = topic.has_magnetometer || triad == Triad::kMagnetometer;
  topic.rows.push_back(row);
  return {};
}

void BagRecording::Take(std::size_t index, std::int64_t received_ns, std::string_view bytes) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  TakenTopic& topic = taken_.at(index);
  ++messages_;
  MessageNumbers& numbers = *topic.numbers;
  if (!numbers.Read(bytes)) {
    ++(numbers.WasNotThree() ? not_three_ : damaged_);
    return;
  }
  if (topic.frame && topic.first_frame.empty()) topic.first_frame = numbers[*topic.frame].text;
  if (topic.temperature) {
    const TemperatureUnit& unit = topic.temperature_unit;
    const double degc = unit.scale * numbers[*topic.temperature].value + unit.offset;
    for (const auto& [other_index, other] : taken_) {
      for (const Row& row : other.rows) row.table->SetTemperature(degc);
    }
  }
  bool has_stamp = true;
  for (const Row& row : topic.rows) {
    std::optional<std::int64_t> time_ns =
        row.time ? TimeNs(numbers[*row.time], row.ns_per_unit) : 0;
    if (!time_ns) {
      ++damaged_;
      return;
    }
    if (*time_ns == 0 && row.ns_per_unit == 0.0) {
      time_ns = received_ns;
      has_stamp = false;
    }
    std::array<double, 6> readings{};
    auto* reading = readings.begin();
    for (const auto& [places, covariance, factor] : row.readings) {
      const bool is_measured = !covariance || numbers[*covariance].value != -1.0;
      for (const std::size_t place : places)
        *reading++ = is_measured ? factor * numbers[place].value : kNone;
    }
    row.table->Add(*time_ns, readings.data());
  }
  if (!has_stamp) ++without_stamp_;
}

void BagRecording::StateFrame() {
  std::string frame, of_magnetometer;
  for (const auto& [index, topic] : taken_) {
    std::string& known = topic.has_magnetometer ? of_magnetometer : frame;
    if (known.empty() && !topic.rows.empty()) known = topic.first_frame;
  }
  folder_->SetFrame(frame.empty() ? of_magnetometer : frame);
  if (frame.empty() || of_magnetometer.empty() || frame == of_magnetometer) return;
  SetSource("frame of the magnetometer", of_magnetometer);
  Note("the magnetometer's frame is " + PrintableLine(of_magnetometer) +
       ", the other sensors' is " + PrintableLine(frame) + "; axes are not rotated");
}

Status BagRecording::Commit() {
  if (damaged_ > 0) {
    Note(Counted(damaged_, "message") +
         " skipped (too short, too long, malformed, or of another layout)");
    SetSource("messages skipped", std::to_string(damaged_));
  }
  if (not_three_ > 0) {
    Note(Counted(not_three_, "message") +
         " skipped (an array that does not have three numbers; state which three to use, as in "
         "data:4-6)");
    SetSource("messages skipped for an array of another length", std::to_string(not_three_));
  }
  if (without_stamp_ > 0) {
    Note(Counted(without_stamp_, "message") + " of " + std::to_string(messages_) +
         " without a time stamp; the time at which the bag received them is used");
  }
  StateFrame();
  return folder_->Commit();
}

/// One file of the recording's bags.
struct Part {
  std::unique_ptr<Bag> bag;
  std::vector<std::size_t> topics;  ///< Indices of its topics in the common list.
  std::int64_t begin_ns = 0;        ///< Time of its first message.
};

/// Adds the topics of another file to `all`, in which each topic occurs once.
Part PartOf(std::unique_ptr<Bag> bag, std::vector<Topic>* all) {
  Part part{std::move(bag), {}, std::numeric_limits<std::int64_t>::max()};
  for (const Topic& topic : part.bag->topics()) {
    if (topic.messages > 0) part.begin_ns = std::min(part.begin_ns, topic.first_ns);
    const auto found = std::find_if(all->begin(), all->end(), [&](const Topic& other) {
      return other.name == topic.name && other.type == topic.type;
    });
    part.topics.push_back(static_cast<std::size_t>(found - all->begin()));
    if (found == all->end()) {
      all->push_back(topic);
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
  return part;
}

}  // namespace

Status ConvertBags(const BagFormat& format, const Arguments& arguments) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> paths,
                             InputFiles(arguments, format.ending));
  std::vector<Topic> topics;
  std::vector<Part> parts;
  for (const std::string& path : paths) {
    TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<Bag> bag, format.open(path));
    parts.push_back(PartOf(std::move(bag), &topics));
  }
  std::stable_sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) {
    return a.begin_ns < b.begin_ns;
  });
  if (arguments.list) {
    ListTopics(topics);
    return {};
  }
  BagRecording recording(format, topics);
  TRUETRIAD_RETURN_IF_ERROR(recording.Open(arguments));
  std::map<std::string, std::uint64_t> damage;
  for (const Part& part : parts) {
    TRUETRIAD_RETURN_IF_ERROR(
        part.bag->Read([&](std::size_t topic) { return recording.Wants(part.topics[topic]); },
                       [&](std::size_t topic, std::int64_t received_ns, std::string_view message) {
                         recording.Take(part.topics[topic], received_ns, message);
                       }));
    for (const auto& [what, count] : part.bag->Damage()) damage[what] += count;
  }
  if (parts.size() > 1) recording.SetSource("bags", std::to_string(parts.size()));
  for (const auto& [what, count] : damage) {
    if (count > 0) recording.SetSource(what, std::to_string(count));
  }
  return recording.Commit();
}

int RunBagConverter(const BagFormat& format, int argc, char** argv) {
  return RunConverter(
      {.format = format.converter,
       .flags = {"topic", "instance", "columns", "units", "layout"},
       .takes_several = true,
       .run = [&](const Arguments& arguments) { return ConvertBags(format, arguments); }},
      argc,
      argv);
}

}  // namespace truetriad::convert
