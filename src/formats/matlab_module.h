// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "formats/matlab_values.h"
#include "truetriad/base/result.h"

namespace truetriad {

// What reads and writes .mat. libmatio brings some sixty libraries with it, which would more than
// double the time that any verb takes to start: it is loaded when a .mat is asked for.
struct MatlabModule {
  // The bytes of a .mat, version 5.
  Result<std::string> (*write)(const MatlabVariables& variables,
                               const std::vector<std::string>& comment);
  // Versions 5 and 7.3.
  Result<MatlabVariables> (*parse)(const std::string& bytes, const std::string& name);
};

// The companion (base/companion.h) and its one function, `const MatlabModule* ()`.
inline constexpr char kMatlabModuleFile[] = "truetriad_matlab.so";
inline constexpr char kMatlabModuleFunction[] = "TruetriadMatlabModule";

}  // namespace truetriad
