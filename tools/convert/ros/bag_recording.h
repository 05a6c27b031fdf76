// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/convert/common/converter.h"
#include "tools/convert/common/recording_folder.h"
#include "tools/convert/ros/imu_log.h"
#include "tools/convert/ros/message_layout.h"
#include "truetriad/base/units.h"

namespace truetriad::convert {

/// The topics of bags that are one recording, each once.
class BagTopics {
 public:
  /// Takes the topics of one bag; the place of each in all().
  std::vector<std::size_t> Add(const std::vector<Topic>& topics);
  const std::vector<Topic>& all() const { return topics_; }

 private:
  std::vector<Topic> topics_;
};

/// When the first message of a bag came; the latest time of all where it has none.
std::int64_t BeginOf(const std::vector<Topic>& topics);

/// A recording of the messages of a bag: those of sensor_msgs, or what --columns names.
class BagRecording {
 public:
  using ReadMessage = std::function<std::optional<ImuMessage>(Role role, std::string_view bytes)>;

  /// `read`: of a message of sensor_msgs. Error: usage, and bad input where there is nothing.
  static Result<std::unique_ptr<BagRecording>> Create(const std::vector<Topic>& topics,
                                                      const Arguments& arguments,
                                                      Encoding encoding,
                                                      const std::string& format,
                                                      const std::string& converter,
                                                      ReadMessage read);

  bool Wants(std::size_t topic) const;
  void Take(std::size_t topic, std::int64_t received_ns, std::string_view bytes);
  void SetSource(const std::string& key, const std::string& value);
  Status Commit();

 private:
  /// A sensor that --columns names.
  struct Sensor {
    Triad triad = Triad::kAccelerometer;
    Table* table = nullptr;
    std::array<std::size_t, 3> places{};
    std::optional<std::size_t> time;
    double ns_per_unit = 0.0;  ///< 0: nanoseconds already.
  };
  struct LaidOutTopic {
    std::optional<MessageNumbers> numbers;
    std::vector<Sensor> sensors;
    std::optional<std::size_t> temperature;
    TemperatureUnit temperature_unit;
  };

  BagRecording() = default;
  Status OpenLaidOut(const Arguments& arguments,
                     Encoding encoding,
                     const std::string& format,
                     const std::string& converter);
  Status AddRole(const std::string& role,
                 const std::string& reference,
                 const std::map<std::string, std::string>& units,
                 bool has_temperature);
  Result<std::size_t> FindTopic(const std::string& name) const;
  Status ReadLayouts(const Arguments& arguments, const std::vector<std::size_t>& topics);
  void TakeLaidOut(LaidOutTopic* topic, std::int64_t received_ns, std::string_view bytes);

  std::vector<Topic> topics_;
  // Of sensor_msgs.
  TopicChoice choice_;
  std::unique_ptr<ImuRecording> standard_;
  ReadMessage read_;
  // Of --columns.
  std::optional<MessageLayouts> layouts_;
  std::unique_ptr<RecordingFolder> folder_;
  std::map<std::size_t, LaidOutTopic> laid_out_;
  std::uint64_t damaged_ = 0, not_three_ = 0, without_stamp_ = 0, messages_ = 0;
};

/// What --columns, --units and --layout say, for --help.
std::string_view LaidOutHelp();

}  // namespace truetriad::convert
