// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <gflags/gflags.h>

#include "truetriad/base/result.h"

// These flags select what is converted of a log, like --instance and --units of flags.h.
DECLARE_string(topic);
DECLARE_string(columns);

namespace truetriad {

/// The path of `program`, which is part of this distribution and runs under Node. Error (usage):
/// the program or Node is missing. The message begins with the `flag` that needs the program, and
/// states what to install.
Result<std::string> FindNodeProgram(const std::string& program, const std::string& flag);

/// The exit code of a program, and its output if RunProgram captured it.
struct ProgramRun {
  int exit_code = 0;
  std::string out, err;
};

/// Runs a program to its end. `captures`: output is returned, not shown. Error: it could not run.
Result<ProgramRun> RunProgram(const std::string& program,
                              const std::vector<std::string>& arguments,
                              bool captures);

/// A log format that a converter program reads.
struct LogFormat {
  std::string_view name;
  std::string_view description;
  std::string_view needs = {};       ///< Packages needed to build the program; empty: none.
  std::string_view how_to_log = {};  ///< How a vehicle is set to log what a calibration needs.
};

/// The format of a log by its first bytes, or of a log's folder by the names of the files in it;
/// null: not a format to convert.
const LogFormat* LogFormatOf(const std::string& log);

/// Converts a log into `folder`. Returns the recordings by sensor instance; with --instance, only
/// one.
Result<std::map<int, std::string>> ConvertedLog(const LogFormat& format,
                                                const std::string& log,
                                                const std::string& folder);

/// A file of configs/mappings, as it was when the program was built.
struct ShippedMapping {
  std::string_view name;  ///< "euroc"
  std::string_view text;
};

/// All mappings, sorted by name.
const std::vector<ShippedMapping>& ShippedMappings();

}  // namespace truetriad
