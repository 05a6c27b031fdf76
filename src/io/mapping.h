// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad {

/// What a mapping states about the logs that it is for.
struct MappingInfo {
  std::string about;                ///< One line.
  std::vector<std::string> inputs;  ///< The kind of each input file, in order.
};
Result<MappingInfo> ReadMappingInfo(const std::string& text, const std::string& name);

/// The manifest (recording.yaml) of a log in a known layout of columns, as text to be saved in
/// `directory`; it names the `inputs` by their path from there. docs/converting.md describes the
/// YAML `text` of a mapping; `name` replaces it in messages.
///
/// Of the mapping's candidates for a triad, the first whose columns the file has is used. Error:
/// malformed mapping; another number of inputs; a missing first line or missing columns.
Result<std::string> ManifestFromMapping(const std::string& text,
                                        const std::string& name,
                                        const std::vector<std::string>& inputs,
                                        const std::string& directory);

}  // namespace truetriad
