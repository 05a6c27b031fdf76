// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "io/yaml_text.h"
#include "truetriad/model/tags.h"

namespace truetriad {

// "part: "P1", revision: "B"", those that are stated; `comes_after` others, with a comma in front.
inline std::string TagsText(std::span<const TagKey> keys, const Tags& tags, bool comes_after) {
  YamlText text;
  for (const TagKey& tag : keys) {
    if ((tags.*tag.value).empty()) continue;
    text << (comes_after ? ", " : "") << tag.key << ": " << Quoted{tags.*tag.value};
    comes_after = true;
  }
  return text.str();
}

// ", part: "P1", ids: { accelerometer: 1310988 }": what `device:` says behind serial and model.
inline std::string DeviceTagsText(const Tags& tags) {
  std::string ids;
  for (const Triad triad : kTriads) {
    if (!tags.device_ids[triad]) continue;
    ids.append(ids.empty() ? "" : ", ").append(TriadName(triad)).append(": ");
    ids += std::to_string(*tags.device_ids[triad]);
  }
  return TagsText(kDeviceTags, tags, true) + (ids.empty() ? "" : ", ids: { " + ids + " }");
}

}  // namespace truetriad
