// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <gflags/gflags.h>

#include "truetriad/base/result.h"

// Of a log's contents, what is to be converted; with --instance and --units of flags.h.
DECLARE_string(topic);
DECLARE_string(columns);

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

/// A format that a converter program reads.
struct LogFormat {
  std::string_view name;
  std::string_view description;
  std::string_view needs = {};       ///< To build the program; empty: nothing that may be missing.
  std::string_view how_to_log = {};  ///< What makes a vehicle log what a calibration needs.
};

/// The format of a log, or of a folder of a log's files, by how it begins; null: not one of these.
const LogFormat* LogFormatOf(const std::string& log);

/// Converts a log into `folder`: its recordings by the number of their sensors, or --instance.
Result<std::map<int, std::string>> ConvertedLog(const LogFormat& format,
                                                const std::string& log,
                                                const std::string& folder);

/// A file of configs/mappings, as the program was built with it.
struct ShippedMapping {
  std::string_view name;  ///< "euroc"
  std::string_view text;
};

/// In the order of their names.
const std::vector<ShippedMapping>& ShippedMappings();

}  // namespace truetriad
