// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad {

/// Laboratory, procedure and equipment of a calibration, for its record. A field that is not stated
/// is empty.
struct Equipment {
  std::string name, serial, certificate;
  std::string calibrated;  ///< The day on which it was calibrated itself: "2026-01-31".
  std::string due;         ///< The last day on which that calibration is valid.
};
struct Laboratory {
  std::string name, address, accreditation, procedure;
  std::vector<Equipment> equipment;
};

/// The keys of laboratory.yaml and of the record, in their order. In each list the first key is
/// required.
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

/// Reads a laboratory.yaml. Errors (bad input), reported together with file and line: a missing
/// name, an invalid day, an unknown key.
Result<Laboratory> ReadLaboratory(const std::string& path);

/// Whether the calibration time `created` (ISO 8601) is after the due day of the equipment; unset
/// if the time or the due day is not stated.
std::optional<bool> IsOverdue(const Equipment& equipment, const std::string& created);

}  // namespace truetriad
