// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"

namespace truetriad {

// A variable of MATLAB: "A", or a field of a struct, "accel.C". Numbers, or a text.
struct MatlabVariable {
  std::string name;
  Eigen::MatrixXd numbers;
  std::string text;  // only without numbers
};
using MatlabVariables = std::vector<MatlabVariable>;

// Nullptr when there is none of that name.
const MatlabVariable* FindVariable(const MatlabVariables& variables, const std::string& name);

// Statements of a script (.m), comments first.
std::string ScriptText(const MatlabVariables& variables, const std::vector<std::string>& comment);
// Assignments of constants; others are passed over.
MatlabVariables ParseScript(const std::string& text);

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
// Loaded once, kept until the program ends. Nullptr: it is not there, or does not load.
const MatlabModule* MatlabModuleOf();

// The bytes are those of a .mat, whatever its version.
bool IsMatFile(const std::string& bytes);

}  // namespace truetriad
