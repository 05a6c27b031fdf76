// SPDX-License-Identifier: Apache-2.0
#include "io/yaml_reader.h"
#include "truetriad/formats/export.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

template <typename Of, std::size_t kCount>
Of ReadKeys(YamlReader reader, const std::array<LaboratoryKey<Of>, kCount>& keys) {
  Of of;
  for (const LaboratoryKey<Of>& key : keys) {
    const bool is_first = &key == &keys.front();
    YamlReader child = is_first ? reader.RequireChild(key.key) : reader.Child(key.key);
    std::string& value = of.*key.value;
    if (!child.ReadName(&value)) continue;
    if (is_first && value.empty()) child.Fail("is empty; expected a name");
    if (!key.is_day) continue;
    if (const Result<double> year = DecimalYear(value); !year) child.Fail(year.error().message);
  }
  reader.RejectUnknown();
  return of;
}

}  // namespace

Result<Laboratory> ReadLaboratory(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root, YamlReader::FromFile(path));
  Laboratory laboratory;
  if (YamlReader block = root.RequireChild("laboratory")) {
    laboratory = ReadKeys(block, kLaboratoryKeys);
  }
  for (const YamlReader& item : root.Child("equipment").Items()) {
    laboratory.equipment.push_back(ReadKeys(item, kEquipmentKeys));
  }
  root.RejectUnknown();
  TRUETRIAD_RETURN_IF_ERROR(root.status());
  return laboratory;
}

std::optional<bool> IsOverdue(const Equipment& equipment, const std::string& created) {
  if (equipment.due.empty() || created.empty()) return std::nullopt;
  // Days in ISO 8601 sort alphabetically.
  return created.substr(0, 10) > equipment.due;
}

}  // namespace truetriad
