// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/ros/imu_log.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>

namespace truetriad::convert {
namespace {

constexpr double kMicroteslaPerTesla = 1e6;

std::string NameAndType(const Topic& topic) { return topic.name + " (" + topic.type + ")"; }

/// The one topic of `role` among `candidates`; null when there is none.
Result<const Topic*> TheOnly(Role role, const std::vector<const Topic*>& candidates) {
  const Topic* found = nullptr;
  std::vector<std::string> names;
  for (const Topic* topic : candidates) {
    if (RoleOf(topic->type) != role) continue;
    found = topic;
    names.push_back(topic->name);
  }
  if (names.size() > 1) {
    return Error(ErrorCode::kMissingArgument,
                 "several topics have the same type: " + ListOf(names) +
                     "; choose one with --topic=NAME, or one of each type, separated by commas");
  }
  return found;
}

}  // namespace

Role RoleOf(std::string_view type) {
  if (type == "sensor_msgs/Imu" || type == "sensor_msgs/msg/Imu") return Role::kImu;
  if (type == "sensor_msgs/MagneticField" || type == "sensor_msgs/msg/MagneticField") {
    return Role::kMagneticField;
  }
  if (type == "sensor_msgs/Temperature" || type == "sensor_msgs/msg/Temperature") {
    return Role::kTemperature;
  }
  return Role::kNone;
}

Role TopicChoice::RoleOfTopic(const Topic* topic) const {
  if (topic == nullptr) return Role::kNone;
  if (topic == imu) return Role::kImu;
  if (topic == field) return Role::kMagneticField;
  if (topic == temperature) return Role::kTemperature;
  return Role::kNone;
}

Result<TopicChoice> ChooseTopics(const std::vector<Topic>& topics, const Arguments& arguments) {
  std::vector<std::string> held;
  std::vector<const Topic*> candidates;
  for (const Topic& topic : topics) {
    held.push_back(NameAndType(topic));
    const bool may_have_any = topic.messages > 0 || !topic.is_counted;
    if (arguments.topics.empty() && may_have_any) candidates.push_back(&topic);
  }
  for (const std::string& name : arguments.topics) {
    const auto found = std::find_if(
        topics.begin(), topics.end(), [&](const Topic& topic) { return topic.name == name; });
    if (found == topics.end() && held.empty())
      return Error(ErrorCode::kNoReadings, "the bag contains no topic that can be read");
    if (found == topics.end()) {
      return Error(ErrorCode::kUnknownName,
                   "--topic=" + name + ": no such topic; the bag contains " + ListOf(held));
    }
    if (RoleOf(found->type) == Role::kNone) {
      return Error(ErrorCode::kInvalidArgument,
                   "--topic=" + name + " is of type " + Printable(found->type) +
                       "; supported are Imu, MagneticField and Temperature of sensor_msgs");
    }
    candidates.push_back(&*found);
  }
  TopicChoice choice;
  TRUETRIAD_ASSIGN_OR_RETURN(const Topic* const imu, TheOnly(Role::kImu, candidates));
  choice.imu = imu;
  TRUETRIAD_ASSIGN_OR_RETURN(const Topic* const field, TheOnly(Role::kMagneticField, candidates));
  choice.field = field;
  // A temperature could be that of anything: only one that was named is the sensor's.
  if (!arguments.topics.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(const Topic* const temperature,
                               TheOnly(Role::kTemperature, candidates));
    choice.temperature = temperature;
  }
  if (choice.imu == nullptr && choice.field == nullptr) {
    return Error(ErrorCode::kNoReadings,
                 {arguments.input},
                 "contains no sensor_msgs/Imu or sensor_msgs/MagneticField messages, so "
                 "nothing to calibrate; topics: " +
                     ListOf(held));
  }
  return choice;
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
                Printable(topic.name).c_str(),
                Printable(topic.type).c_str(),
                static_cast<unsigned long long>(topic.messages),
                1e-9 * static_cast<double>(topic.first_ns),
                1e-9 * static_cast<double>(topic.last_ns));
  }
}

Result<std::unique_ptr<ImuRecording>> ImuRecording::Create(const TopicChoice& choice,
                                                           const Arguments& arguments,
                                                           const std::string& format,
                                                           const std::string& converter) {
  std::unique_ptr<ImuRecording> recording(new ImuRecording());
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<RecordingFolder> folder,
                             RecordingFolder::Create(arguments.output));
  recording->folder_ = std::move(folder);
  RecordingFolder& files = *recording->folder_;
  files.SetSource("format", format);
  files.SetSource("file", std::filesystem::path(arguments.input).filename().string());
  files.SetSource("converter", converter);
  const bool has_temperature = choice.temperature != nullptr;
  if (choice.imu != nullptr) {
    files.SetSource("imu topic", choice.imu->name);
    recording->imu_ =
        files.AddTable("imu.csv",
                       {{.triad = Triad::kGyroscope, .unit = "rad/s", .applied = {}},
                        {.triad = Triad::kAccelerometer, .unit = "m/s^2", .applied = {}}},
                       {has_temperature});
  }
  if (choice.field != nullptr) {
    files.SetSource("magnetic field topic", choice.field->name);
    recording->field_ =
        files.AddTable("magnetometer.csv",
                       {{.triad = Triad::kMagnetometer, .unit = "uT", .applied = {}}},
                       {has_temperature});
  }
  if (has_temperature) files.SetSource("temperature topic", choice.temperature->name);
  return recording;
}

void ImuRecording::Add(Role role, std::int64_t received_ns, const ImuMessage& message) {
  ++messages_;
  std::int64_t time_ns = message.stamp_ns;
  if (time_ns == 0) {
    time_ns = received_ns;
    ++without_stamp_;
  }
  if (role == Role::kTemperature) {
    for (Table* table : {imu_, field_}) {
      if (table != nullptr) table->SetTemperature(message.values[0]);
    }
  } else if (role == Role::kImu) {
    if (frame_.empty()) frame_ = message.frame;
    imu_->Add(time_ns, message.values.data());
  } else if (role == Role::kMagneticField) {
    if (field_frame_.empty()) field_frame_ = message.frame;
    const std::array<double, 3> field_ut = {message.values[0] * kMicroteslaPerTesla,
                                            message.values[1] * kMicroteslaPerTesla,
                                            message.values[2] * kMicroteslaPerTesla};
    field_->Add(time_ns, field_ut.data());
  }
}

Status ImuRecording::Commit() {
  if (damaged_ > 0) {
    Note(Count(damaged_, "message", "messages") + " skipped (too short or malformed)");
    folder_->SetSource("messages skipped", std::to_string(damaged_));
  }
  if (without_stamp_ > 0) {
    Note(Count(without_stamp_, "message", "messages") + " of " + std::to_string(messages_) +
         " without a time stamp; used the time the bag received them");
  }
  folder_->SetFrame(frame_.empty() ? field_frame_ : frame_);
  if (!frame_.empty() && !field_frame_.empty() && frame_ != field_frame_) {
    folder_->SetSource("frame of the magnetometer", field_frame_);
    Note("the magnetometer's frame is " + Printable(field_frame_) + ", the other sensors' is " +
         Printable(frame_) + "; axes are not rotated");
  }
  return folder_->Commit();
}

}  // namespace truetriad::convert
