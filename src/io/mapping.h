// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad {

/// What a mapping says about the log that it describes.
struct MappingInfo {
  std::string about;                ///< One line.
  std::vector<std::string> inputs;  ///< What each input file is, in order.
};
Result<MappingInfo> ReadMappingInfo(const std::string& text, const std::string& name);

/// The manifest (recording.yaml) of a log in a known layout of columns, as text to be saved in
/// `directory`; it names the `inputs` by their path from there. The YAML `text` of a mapping is in
/// docs/converting.md, `name` stands for it in messages.
///
/// Of several candidates for a triad the first whose columns the file has is taken.
/// Error: malformed mapping; another number of inputs; a first line or columns that are not there.
Result<std::string> ManifestFromMapping(const std::string& text,
                                        const std::string& name,
                                        const std::vector<std::string>& inputs,
                                        const std::string& directory);

}  // namespace truetriad
