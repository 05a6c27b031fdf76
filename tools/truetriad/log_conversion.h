// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>

#include <gflags/gflags.h>

#include "tools/truetriad/companion_program.h"
#include "truetriad/base/result.h"

// Of a log's contents, what is to be converted; with --instance and --units of format_flags.h.
DECLARE_string(topic);
DECLARE_string(columns);
DECLARE_string(layout);

namespace truetriad {

/// A format that a converter program reads.
struct LogFormat {
  std::string_view name;
  std::string_view description;
  std::string_view needs = {};       ///< To build the program; empty: nothing that may be missing.
  bool is_script = false;            ///< Runs under Node.
  std::string_view how_to_log = {};  ///< What makes a vehicle log what a calibration needs.
};

std::span<const LogFormat> LogFormats();

/// The format called `name`; null: there is none.
const LogFormat* FindLogFormat(std::string_view name);

/// The format of a log, or of a folder of a log's files, by how it begins; null: not one of these.
const LogFormat* LogFormatOf(const std::string& log);

/// Runs the format's converter as --topic, --instance, --columns, --units and --layout say. With
/// `captures` nothing is shown, and an error is one of the result. Error (usage): the program is
/// not there; says what to install.
Result<ProgramRun> RunLogConverter(const LogFormat& format,
                                   const std::string& log,
                                   const std::string& folder,
                                   bool lists,
                                   bool captures);

/// Converts a log into `folder`: its recordings by the number of their sensors, or --instance.
Result<std::map<int, std::string>> ConvertedLog(const LogFormat& format,
                                                const std::string& log,
                                                const std::string& folder);

}  // namespace truetriad
