// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <gflags/gflags.h>

#include "truetriad/base/result.h"

// Flags that several verbs share; gflags stops the program at a second definition.
DECLARE_string(input);
DECLARE_string(output);
DECLARE_string(config);
DECLARE_string(calibration);
DECLARE_string(poses);
DECLARE_string(set);
DECLARE_string(tag);
DECLARE_string(report);
DECLARE_string(fail_on);
DECLARE_bool(json);
DECLARE_bool(quiet);

namespace truetriad {

/// The items of --set. Brackets and quotes that do not match are left for the YAML reader to
/// report.
std::vector<std::string> Overrides();

/// Those and the values of --tag. Error (usage): a tag without value, or with another name.
Result<std::vector<std::string>> OverridesAndTags();

/// The values of a flag that takes several with commas between them.
std::vector<std::string> CommaSeparated(const std::string& values);

/// The logs of --input (a file whose name has a comma is one) and of `words`.
std::vector<std::string> StatedInputs(const std::vector<std::string>& words);

/// Error (usage): --fail-on is neither empty nor `word`.
Status CheckFailOn(const std::string& word);

/// What people should know of a run, on stderr unless --quiet.
void Note(const std::string& text);

/// What would do harm where nobody knows of it, on stderr, --quiet or not.
void Warn(const std::string& text);

}  // namespace truetriad
