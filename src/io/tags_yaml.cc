// SPDX-License-Identifier: Apache-2.0
#include "io/tags_yaml.h"

#include "io/yaml_fields.h"
#include "io/yaml_text.h"
#include "model/calibration_fields.h"

namespace truetriad {
namespace {

constexpr std::size_t kLongestNote = 2000;

}  // namespace

void ReadDeviceTags(YamlReader* device, Tags* tags) {
  for (const TagKey& tag : kDeviceTags) device->Child(tag.key).ReadName(&(tags->*tag.value));
  ReadDeviceIds(device->Child("ids"), tags);
}

void ReadDeviceIds(YamlReader ids, Tags* tags) {
  if (!ids) return;
  for (const Triad triad : kTriads) {
    YamlReader stated = ids.Child(TriadName(triad));
    std::int64_t id = 0;
    if (!stated || !stated.Read(&id)) continue;
    if (id <= 0) stated.Fail("must be above zero, which firmware takes for no sensor");
    tags->device_ids[triad] = id;
  }
  ids.RejectUnknown();
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
  YamlText text;
  YamlFieldWriter visit(text, 0, YamlFieldWriter::Place::kFlowMap);
  DeviceTagFields(visit, tags);
  return text.str();
}

std::string RunTagsText(const Tags& tags) {
  YamlText text;
  YamlFieldWriter visit(text, 0, YamlFieldWriter::Place::kFlowMap);
  TagFields(visit, kRunTags, tags);
  return text.str();
}

}  // namespace truetriad
