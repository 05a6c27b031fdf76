// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"

namespace truetriad {

// A variable of MATLAB: "A", or a field of a struct, "accel.C". It holds numbers or a text.
struct MatlabVariable {
  std::string name;
  Eigen::MatrixXd numbers;
  std::string text;  // only if there are no numbers
};
using MatlabVariables = std::vector<MatlabVariable>;

// Returns nullptr when there is no variable of that name.
const MatlabVariable* FindVariable(const MatlabVariables& variables, const std::string& name);

// The text of a script (.m): the lines of the comment, then the assignments.
std::string ScriptText(const MatlabVariables& variables, const std::vector<std::string>& comment);
// Reads assignments of constants from a script; other statements are skipped.
MatlabVariables ParseScript(const std::string& text);

// Reads and writes .mat. libmatio needs some sixty libraries, which would more than double the
// start time of every verb, so it is loaded only when a .mat is used.
struct MatlabModule {
  // The bytes of a .mat, version 5.
  Result<std::string> (*write)(const MatlabVariables& variables,
                               const std::vector<std::string>& comment);
  // Reads versions 5 and 7.3.
  Result<MatlabVariables> (*parse)(const std::string& bytes, const std::string& name);
};

// The companion library (base/companion.h) and its only function, `const MatlabModule* ()`.
inline constexpr char kMatlabModuleFile[] = "truetriad_matlab.so";
inline constexpr char kMatlabModuleFunction[] = "TruetriadMatlabModule";
// Loads the module once and keeps it until the program ends; nullptr if it is missing or cannot be
// loaded.
const MatlabModule* MatlabModuleOf();

// Whether the bytes are a .mat of any version.
bool IsMatFile(const std::string& bytes);

}  // namespace truetriad
