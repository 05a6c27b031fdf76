// SPDX-License-Identifier: Apache-2.0
#include "io/tags_yaml.h"

#include "io/yaml_fields.h"
#include "model/calibration_fields.h"

namespace truetriad {
namespace {

constexpr std::size_t kLongestNote = 2000;  // Characters, a page; longer notes are refused.

}  // namespace

void ReadDeviceTags(YamlReader* device, Tags* tags) {
  for (const TagKey& tag : kDeviceTags) device->Child(tag.key).ReadName(&(tags->*tag.value));
  YamlFieldReader fields(*device);
  FirmwareFields(fields, *tags);
}

void ReadRunTags(YamlReader run, Tags* tags) {
  if (!run) return;
  for (const TagKey& tag : kRunTags) {
    const bool is_note = tag.value == &Tags::note;
    run.Child(tag.key).ReadName(&(tags->*tag.value),
                                is_note ? kLongestNote : YamlReader::kLongestName);
  }
  run.RejectUnknown();
}

std::string DeviceTagsText(const Tags& tags) {
  YamlFieldWriter visit(0, 0, YamlFieldWriter::Place::kFlowMap);
  TagFields(visit, kDeviceTags, tags);
  FirmwareFields(visit, tags);
  return visit.text();
}

std::string RunTagsText(const Tags& tags) {
  YamlFieldWriter visit(0, 0, YamlFieldWriter::Place::kFlowMap);
  TagFields(visit, kRunTags, tags);
  return visit.text();
}

}  // namespace truetriad
