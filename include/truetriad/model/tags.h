// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

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
  /// `device.magnetometer_turn_deg`: roll, pitch and yaw that turn the recording's axes into those
  /// in which firmware corrects the magnetometer (formats/board_rotation.h); unset: not known.
  std::optional<Eigen::Vector3d> magnetometer_turn_deg;

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
    if (!own.device_ids[triad]) own.device_ids[triad] = other.device_ids[triad];
  }
  if (!own.magnetometer_turn_deg) own.magnetometer_turn_deg = other.magnetometer_turn_deg;
  return own;
}

}  // namespace truetriad
