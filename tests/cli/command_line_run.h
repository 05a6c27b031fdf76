// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>

#include "io/temporary_folder.h"
#include "support/patience.h"

namespace truetriad {

/// What a run of a program left behind.
struct Finished {
  int exit_code = -1;  ///< -1: it crashed.
  std::string out;
  std::string err;
};

/// Runs a line of shell in `folder`, neither stdout nor stderr a terminal. It may `await` that a
/// command succeeds.
inline Finished RunShell(const std::string& line,
                         const std::string& folder = TRUETRIAD_SOURCE_DIR) {
  const TemporaryFolder streams;
  const std::string out = streams.Path("out");
  const std::string err = streams.Path("err");
  const std::string await = "await() { timeout " + std::to_string(kPatience.count()) +
                            " sh -c \"until $1; do sleep 0.02; done\"; }; ";
  const int status = std::system(
      ("cd '" + folder + "' && { " + await + line + "\n} >'" + out + "' 2>'" + err + "'").c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1,
          TemporaryFolder::Read(out),
          TemporaryFolder::Read(err)};
}

/// Of all files below a folder, their texts.
inline std::map<std::string, std::string> FilesIn(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    files[std::filesystem::relative(entry.path(), folder).string()] =
        TemporaryFolder::Read(entry.path().string());
  }
  return files;
}

/// Runs `truetriad ARGUMENTS`; no argument may hold a single quote.
inline Finished RunTruetriad(const std::vector<std::string>& arguments) {
  std::string line = "'" TRUETRIAD_BINARY "'";
  for (const std::string& argument : arguments) line += " '" + argument + "'";
  return RunShell(line);
}

/// An experiment with an accelerometer alone.
inline constexpr char kAccelerometerExperiment[] = R"(experiment: 1
device: { serial: T1 }
sensors: { accelerometer: { model: full } }
)";

}  // namespace truetriad
