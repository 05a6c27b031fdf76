// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "io/field_schema.h"
#include "truetriad/model/tags.h"

namespace truetriad {

/// The fields of `device:` that are tags.
void DeviceTagFields(FieldReader& visit, Tags& tags);
void DeviceTagFields(FieldSchema& visit, Tags& tags);

constexpr std::size_t kLongestNote = 2000;  // Characters, a page; longer notes are refused.

/// The fields of `run:`.
void RunFields(auto& visit, Tags& tags) {
  for (const TagKey& tag : kRunTags) {
    Text text{.is_name = true, .is_left_out = true};
    if (tag.value == &Tags::note) text.longest = kLongestNote;
    visit(tag.key, tags.*tag.value, text);
  }
}

/// The tags of `device:` as written inside a map on one line: ` part: "P1", ids: { gyroscope: 7 }`;
/// empty if there are none.
std::string DeviceTagsText(const Tags& tags);

}  // namespace truetriad
