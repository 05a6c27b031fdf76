// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad {

/// The person, place, procedure and equipment of a calibration, for its record. Fields that are not
/// stated are empty.
struct Equipment {
  std::string name, serial, certificate;
  std::string calibrated;  ///< Day of its own calibration, "2026-01-31".
  std::string due;         ///< The last day on which that calibration is valid.
};
struct Laboratory {
  std::string name, address, accreditation, procedure;
  std::vector<Equipment> equipment;
};

/// The keys of a laboratory.yaml and of the record in their order; the first is required.
template <typename Of>
struct LaboratoryKey {
  std::string_view key;
  std::string Of::*value;
  bool is_day = false;
};
inline constexpr std::array<LaboratoryKey<Laboratory>, 4> kLaboratoryKeys = {
    {{"name", &Laboratory::name},
     {"address", &Laboratory::address},
     {"accreditation", &Laboratory::accreditation},
     {"procedure", &Laboratory::procedure}}};
inline constexpr std::array<LaboratoryKey<Equipment>, 5> kEquipmentKeys = {
    {{"name", &Equipment::name},
     {"serial", &Equipment::serial},
     {"certificate", &Equipment::certificate},
     {"calibrated", &Equipment::calibrated, true},
     {"due", &Equipment::due, true}}};

/// Reads a laboratory.yaml. Errors (bad input), all at once with file and line: no name, an invalid
/// day, unknown keys.
Result<Laboratory> ReadLaboratory(const std::string& path);

/// Whether `created`, the time of a calibration in ISO 8601, is after the due day of the equipment.
/// Unset if one of them is not stated.
std::optional<bool> IsOverdue(const Equipment& equipment, const std::string& created);

}  // namespace truetriad
