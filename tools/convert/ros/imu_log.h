// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/convert/common/converter.h"
#include "tools/convert/common/recording_folder.h"
#include "truetriad/base/result.h"

namespace truetriad::convert {

/// A topic of a bag.
struct Topic {
  std::string name;
  std::string type;  ///< "sensor_msgs/Imu" (ROS 1) or "sensor_msgs/msg/Imu" (ROS 2).
  std::uint64_t messages = 0;
  bool is_counted = true;                  ///< False: nobody knows how many messages.
  std::int64_t first_ns = 0, last_ns = 0;  ///< When the bag received them.
  std::string definition{};                ///< Of the type, where the bag holds it.
};

/// What a topic is to a recording.
enum class Role { kNone, kImu, kMagneticField, kTemperature };
Role RoleOf(std::string_view type);

/// One message, as far as it matters. sensor_msgs: Imu.msg, MagneticField.msg, Temperature.msg.
struct ImuMessage {
  std::int64_t stamp_ns = 0;  ///< Of its header.
  std::string_view frame;     ///< Valid as long as the bytes it was read from.
  /// Imu: angular velocity, rad/s, then linear acceleration, m/s^2; NaN where the message's
  /// covariance says that there is none. MagneticField: tesla. Temperature: degC.
  std::array<double, 6> values{};
};

/// The topics of a recording: one Imu, one MagneticField, or both; and a Temperature.
struct TopicChoice {
  const Topic* imu = nullptr;
  const Topic* field = nullptr;
  const Topic* temperature = nullptr;

  Role RoleOfTopic(const Topic* topic) const;
};

/// The topics that the user named, or the only ones there are. Error: usage where there are several
/// and none was named; bad input where there is none.
Result<TopicChoice> ChooseTopics(const std::vector<Topic>& topics, const Arguments& arguments);

/// Prints the topics as a table on stdout.
void ListTopics(const std::vector<Topic>& topics);

/// A recording that is made of messages.
class ImuRecording {
 public:
  /// `format`: "ros1-bag". Error: as RecordingFolder::Create.
  static Result<std::unique_ptr<ImuRecording>> Create(const TopicChoice& choice,
                                                      const Arguments& arguments,
                                                      const std::string& format,
                                                      const std::string& converter);

  /// `received_ns`: when the bag got it; stands for a stamp of zero.
  void Add(Role role, std::int64_t received_ns, const ImuMessage& message);
  void CountDamaged() { ++damaged_; }
  void SetSource(const std::string& key, const std::string& value) {
    folder_->SetSource(key, value);
  }

  Status Commit();

 private:
  ImuRecording() = default;

  std::unique_ptr<RecordingFolder> folder_;
  Table* imu_ = nullptr;
  Table* field_ = nullptr;
  std::string frame_;
  std::string field_frame_;
  std::uint64_t damaged_ = 0;
  std::uint64_t without_stamp_ = 0;
  std::uint64_t messages_ = 0;
};

/// Seconds and nanoseconds of a ROS time.
inline std::int64_t StampNs(std::int64_t seconds, std::uint32_t nanoseconds) {
  return seconds * 1'000'000'000 + nanoseconds;
}

}  // namespace truetriad::convert
