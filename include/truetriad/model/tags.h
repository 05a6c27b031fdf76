// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/triad.h"

namespace truetriad {

/// What the record says of a unit and its run beside serial number and model. Nothing is computed
/// from it.
struct Tags {
  std::string part, revision;                                                  ///< `device:`
  std::string lot, station, operator_name, slot, fixture, order_number, note;  ///< `run:`
  /// `device.firmware`: whose log the recording is of ("px4"); what follows holds for it alone.
  std::string firmware;
  /// `device.ids`: the number by which firmware knows each sensor.
  PerTriad<std::optional<std::int64_t>> device_ids;
  /// `device.slots`: which of its sets of parameters firmware has for the sensor with this number,
  /// as it counts them; kNoSlot: all are other sensors'. `device.thermal_slots`: the same of its
  /// temperature terms, where these have numbers of their own.
  PerTriad<std::optional<std::int64_t>> device_slots, thermal_slots;
  static constexpr std::int64_t kNoSlot = -1;  // No set of parameters has this number.
  /// `device.idle_thermal_slots`: those with terms that firmware has and does not use. It uses the
  /// terms of all sensors of a kind, or of none.
  PerTriad<std::vector<std::int64_t>> idle_thermal_slots;
  /// `device.magnetometer_turn_deg`: roll, pitch and yaw that turn the recording's axes into those
  /// in which firmware corrects the magnetometer (formats/board_rotation.h); unset: not known.
  std::optional<Eigen::Vector3d> magnetometer_turn_deg;
  /// `device.magnetometer_mount_deg`: those that turn its own axes into the recording's, where the
  /// vehicle's parameters state how it is mounted; unset: no parameter has a part in them.
  std::optional<Eigen::Vector3d> magnetometer_mount_deg;

  bool operator==(const Tags&) const = default;
};

/// A key of `device:` or `run:` and what it says.
struct TagKey {
  std::string_view key;
  std::string Tags::*value;
};
inline constexpr std::array<TagKey, 2> kDeviceTags = {
    {{"part", &Tags::part}, {"revision", &Tags::revision}}};
inline constexpr std::array<TagKey, 7> kRunTags = {{{"lot", &Tags::lot},
                                                    {"station", &Tags::station},
                                                    {"operator", &Tags::operator_name},
                                                    {"slot", &Tags::slot},
                                                    {"fixture", &Tags::fixture},
                                                    {"order", &Tags::order_number},
                                                    {"note", &Tags::note}}};

/// What `own` does not say is as in `other`.
inline Tags OrElse(Tags own, const Tags& other) {
  const auto take = [&](const TagKey& tag) {
    std::string& value = own.*tag.value;
    if (value.empty()) value = other.*tag.value;
  };
  for (const TagKey& tag : kDeviceTags) take(tag);
  for (const TagKey& tag : kRunTags) take(tag);
  if (own.firmware.empty()) own.firmware = other.firmware;
  for (const Triad triad : kTriads) {
    for (const auto of : {&Tags::device_ids, &Tags::device_slots, &Tags::thermal_slots}) {
      if (!(own.*of)[triad]) (own.*of)[triad] = (other.*of)[triad];
    }
    std::vector<std::int64_t>& idle = own.idle_thermal_slots[triad];
    if (idle.empty()) idle = other.idle_thermal_slots[triad];
  }
  for (const auto of : {&Tags::magnetometer_turn_deg, &Tags::magnetometer_mount_deg}) {
    if (!(own.*of)) own.*of = other.*of;
  }
  return own;
}

}  // namespace truetriad
