// SPDX-License-Identifier: Apache-2.0
#include "io/tags_yaml.h"

namespace truetriad {
namespace {

constexpr std::size_t kLongestNote = 2000;

}  // namespace

void ReadDeviceTags(YamlReader* device, Tags* tags) {
  for (const TagKey& tag : kDeviceTags) device->Child(tag.key).ReadName(&(tags->*tag.value));
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

}  // namespace truetriad
