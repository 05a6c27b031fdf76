// SPDX-License-Identifier: Apache-2.0
#include "io/tags_yaml.h"

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "io/yaml_fields.h"
#include "model/calibration_fields.h"

namespace truetriad {
namespace {

/// Visits FirmwareFields and adds each field to a schema. These fields state no kinds of values, so
/// the kind follows from the type.
struct FirmwareSchema {
  static constexpr bool kReads = false;
  FieldSchema& visit;

  bool operator()(std::string_view key, const std::optional<Eigen::Vector3d>& numbers) {
    return visit(key, numbers, kNumbers);
  }
  bool operator()(std::string_view key, const std::optional<std::int64_t>& number) {
    return visit(key, number, kAnyNumber);
  }
  bool If(bool, std::string_view key, const std::string& text) {
    return visit(key, text, kAnyText);
  }
  bool If(bool, std::string_view key, const std::vector<std::int64_t>& numbers) {
    return visit(key, numbers, ListOf{kAnyNumber});
  }
  template <typename List>
  bool If(bool, std::string_view key, const Part<List>& part, Style) {
    visit.Map(key, [&part](FieldSchema& inside) {
      FirmwareSchema fields{inside};
      part.list(fields);
    });
    return false;
  }
  template <typename Wrong>
  static void Check(std::string_view, const Wrong&) {}
};

void NameFields(auto& visit, Tags& tags) {
  for (const TagKey& tag : kDeviceTags) visit(tag.key, tags.*tag.value, kName);
}

}  // namespace

void DeviceTagFields(FieldReader& visit, Tags& tags) {
  NameFields(visit, tags);
  YamlFieldReader fields(visit.map());
  FirmwareFields(fields, tags);
}

void DeviceTagFields(FieldSchema& visit, Tags& tags) {
  NameFields(visit, tags);
  FirmwareSchema fields{visit};
  FirmwareFields(fields, tags);
}

std::string DeviceTagsText(const Tags& tags) {
  YamlFieldWriter visit(0, 0, YamlFieldWriter::Place::kFlowMap);
  TagFields(visit, kDeviceTags, tags);
  FirmwareFields(visit, tags);
  return visit.text();
}

}  // namespace truetriad
