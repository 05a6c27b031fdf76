// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad {

/// `program`, one that runs under Node and comes with this one. Error (usage): it or Node is not
/// there; begins with the `flag` that needs it and says what to install.
Result<std::string> FindNodeProgram(const std::string& program, const std::string& flag);

/// How a program ended, and what it said, where that was captured: else it has been shown.
struct ProgramRun {
  int exit_code = 0;
  std::string out, err;
};

/// Runs a program to its end, or says why it did not run. `captures` what it says.
Result<ProgramRun> RunProgram(const std::string& program,
                              const std::vector<std::string>& arguments,
                              bool captures);

}  // namespace truetriad
