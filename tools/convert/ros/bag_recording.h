// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tools/convert/common/converter.h"
#include "tools/convert/ros/message_layout.h"
#include "truetriad/base/result.h"

namespace truetriad::convert {

/// A topic of a bag.
struct Topic {
  std::string name;
  std::string type;  ///< "sensor_msgs/Imu" (ROS 1) or "sensor_msgs/msg/Imu" (ROS 2).
  std::uint64_t messages = 0;
  bool is_counted = true;                  ///< False: this number is unknown.
  std::int64_t first_ns = 0, last_ns = 0;  ///< Times of reception.
  std::string definition{};                ///< Definition of the type, if the bag has one.
};

/// One file of a bag; its topics are known after opening.
class Bag {
 public:
  virtual ~Bag() = default;

  const std::vector<Topic>& topics() const { return topics_; }

  using Wants = std::function<bool(std::size_t topic)>;
  using Take =
      std::function<void(std::size_t topic, std::int64_t received_ns, std::string_view message)>;
  /// Passes the messages of the wanted topics to `take`. A topic is stated by its index in
  /// topics().
  virtual Status Read(const Wants& wants, const Take& take) = 0;

  /// Numbers of the parts that could not be read: {{"incomplete chunks", 2}}.
  virtual std::map<std::string, std::uint64_t> Damage() const = 0;

 protected:
  std::vector<Topic> topics_;
};

/// A container of ROS messages.
struct BagFormat {
  std::string_view converter;  ///< "ros1": the program is truetriad-convert-ros1.
  std::string_view source;     ///< Name in the manifest: "ros1-bag".
  std::string_view ending;     ///< End of its files' names: ".bag".
  Encoding encoding = Encoding::kRos1;
  Result<std::unique_ptr<Bag>> (*open)(const std::string& path) = nullptr;
};

/// Converts the messages of the bags in `arguments`: those of sensor_msgs, or those that --columns
/// names. With --list, lists the bags' topics. Errors: usage; bad input if there is no message.
Status ConvertBags(const BagFormat& format, const Arguments& arguments);

/// The `main` of the converter of a container.
int RunBagConverter(const BagFormat& format, int argc, char** argv);

}  // namespace truetriad::convert
