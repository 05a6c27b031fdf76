// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad {

/// What a mapping states about the logs that it converts.
struct MappingInfo {
  std::string about;                ///< A description in one line.
  std::vector<std::string> inputs;  ///< The kind of each input file, in order.
};
Result<MappingInfo> ReadMappingInfo(const std::string& text, const std::string& name);

/// The manifest (recording.yaml) of a log whose columns a mapping describes, as text to be saved in
/// `directory`; paths of the `inputs` are relative to that folder. `text` is the YAML of the
/// mapping (docs/converting.md), `name` the name of the mapping in messages.
///
/// For each triad, the mapping's first candidate whose columns are all in the file is used. Error:
/// the mapping is malformed, the number of inputs is wrong, the first line of the log differs, or
/// no candidate fits.
Result<std::string> ManifestFromMapping(const std::string& text,
                                        const std::string& name,
                                        const std::vector<std::string>& inputs,
                                        const std::string& directory);

}  // namespace truetriad
