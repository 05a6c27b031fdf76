// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/ros2_db3/cdr_messages.h"

#include <limits>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/exceptions/Exception.h>

namespace truetriad::convert {
namespace {

constexpr std::size_t kEncapsulation = 4;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// x, y, z, and the nine numbers of a covariance, whose first is -1 where there is no reading.
void ReadVector(eprosima::fastcdr::Cdr* cdr, bool with_covariance, double* vector) {
  for (int axis = 0; axis < 3; ++axis) *cdr >> vector[axis];
  if (!with_covariance) return;
  double covariance = 0.0;
  *cdr >> covariance;
  if (covariance == -1.0) vector[0] = vector[1] = vector[2] = kNone;
  for (int i = 1; i < 9; ++i) *cdr >> covariance;
}

}  // namespace

std::optional<ImuMessage> CdrMessages::Read(Role role, const void* bytes, std::size_t size) {
  if (size < kEncapsulation) return std::nullopt;
  // Only read from; the library has no buffer of const bytes.
  eprosima::fastcdr::FastBuffer buffer(const_cast<char*>(static_cast<const char*>(bytes)), size);
  eprosima::fastcdr::Cdr cdr(
      buffer, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR);
  try {
    cdr.read_encapsulation();
    std::int32_t seconds = 0;
    std::uint32_t nanoseconds = 0;
    ImuMessage message;
    cdr >> seconds >> nanoseconds >> frame_;
    message.stamp_ns = StampNs(seconds, nanoseconds);
    message.frame = frame_;
    if (role == Role::kImu) {
      double skipped = 0.0;
      for (int i = 0; i < 4 + 9; ++i) cdr >> skipped;  // Orientation and its covariance.
      ReadVector(&cdr, true, message.values.data());
      ReadVector(&cdr, true, message.values.data() + 3);
    } else if (role == Role::kMagneticField) {
      ReadVector(&cdr, false, message.values.data());
    } else {
      cdr >> message.values[0];
    }
    return message;
  } catch (const eprosima::fastcdr::exception::Exception&) {
    return std::nullopt;
  }
}

}  // namespace truetriad::convert
