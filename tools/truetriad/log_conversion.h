// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <gflags/gflags.h>

#include "truetriad/base/result.h"

// Select which contents of a log are converted, as do --instance and --units of flags.h.
DECLARE_string(topic);
DECLARE_string(columns);

namespace truetriad {

/// The path of `program`, which is part of this distribution and runs under Node. Error (usage): it
/// or Node is missing; the message begins with the `flag` that needs it and states what to install.
Result<std::string> FindNodeProgram(const std::string& program, const std::string& flag);

/// The exit code of a program, and its output if that was captured (else it was shown).
struct ProgramRun {
  int exit_code = 0;
  std::string out, err;
};

/// Runs a program to its end. `captures`: its output is not shown. Error: it could not run.
Result<ProgramRun> RunProgram(const std::string& program,
                              const std::vector<std::string>& arguments,
                              bool captures);

/// A log format that a converter program reads.
struct LogFormat {
  std::string_view name;
  std::string_view description;
  std::string_view needs = {};       ///< Needed to build the program; empty: nothing optional.
  std::string_view how_to_log = {};  ///< How a vehicle is set to log what a calibration needs.
};

/// The format of a log, or of a folder of a log's files, by its first bytes; null: another format.
const LogFormat* LogFormatOf(const std::string& log);

/// Converts a log into `folder`. Returns the recordings by sensor instance, or that of --instance.
Result<std::map<int, std::string>> ConvertedLog(const LogFormat& format,
                                                const std::string& log,
                                                const std::string& folder);

/// A file of configs/mappings as of the build.
struct ShippedMapping {
  std::string_view name;  ///< "euroc"
  std::string_view text;
};

/// All mappings, sorted by name.
const std::vector<ShippedMapping>& ShippedMappings();

}  // namespace truetriad
