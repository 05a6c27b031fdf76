// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "tools/convert/ros/imu_log.h"

namespace truetriad::convert {

/// Reads messages of sensor_msgs from CDR as ROS 2 bags hold it: 4 bytes that state the byte order,
/// then the fields, aligned from there on.
class CdrMessages {
 public:
  /// Nullopt when the bytes are no such message. The frame is valid until the next call.
  std::optional<ImuMessage> Read(Role role, const void* bytes, std::size_t size);

 private:
  std::string frame_;
};

}  // namespace truetriad::convert
