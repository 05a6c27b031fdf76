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

/// What a record states about a unit and its run, besides serial number and model. Results do not
/// depend on tags.
struct Tags {
  std::string part, revision;                                                  ///< `device:`
  std::string lot, station, operator_name, slot, fixture, order_number, note;  ///< `run:`
  /// `device.firmware`: the firmware that wrote the log ("px4"). The members below belong to this
  /// firmware alone.
  std::string firmware;
  /// `device.ids`: the number by which firmware knows each sensor.
  PerTriad<std::optional<std::int64_t>> device_ids;
  /// `device.slots`: the firmware's number of the set of parameters for the sensor with that id;
  /// kNoSlot if all sets belong to other sensors. `device.thermal_slots`: the number of the set of
  /// temperature terms, if firmware counts these sets separately.
  PerTriad<std::optional<std::int64_t>> device_slots, thermal_slots;
  static constexpr std::int64_t kNoSlot = -1;  // No set of parameters has this number.
  /// `device.idle_thermal_slots`: sets of temperature terms that firmware has but does not use.
  /// Firmware uses the terms of all sensors of a kind, or of none.
  PerTriad<std::vector<std::int64_t>> idle_thermal_slots;
  /// `device.magnetometer_turn_deg`: roll, pitch and yaw from the recording's axes to those in
  /// which firmware corrects the magnetometer (model/board_rotation.h); unset: not known.
  std::optional<Eigen::Vector3d> magnetometer_turn_deg;
  /// `device.magnetometer_mount_deg`: roll, pitch and yaw from the magnetometer's axes to the
  /// recording's, if the vehicle's parameters state the mounting; unset: no parameter affects it.
  std::optional<Eigen::Vector3d> magnetometer_mount_deg;

  bool operator==(const Tags&) const = default;
};

/// A key of `device:` or `run:` and the member that holds its value.
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

/// `own`, with each unset member taken from `other`.
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
