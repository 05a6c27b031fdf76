// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

struct ImportOptions {
  /// The version of the importing program: "0.1.0".
  std::string software_version = {};
  /// Units of the readings for the calibration; unset: true units, or those of the file. Must be
  /// set if the file does not state them.
  PerTriad<std::optional<std::string>> units = {};
  /// The number of one of several equal sensors in the other system's counting; unset: its first.
  std::optional<int> instance = {};
  /// Selects a sensor by its identification instead of `instance`, for formats that state one.
  PerTriad<std::optional<std::int64_t>> device_ids = {};
};

struct Import {
  Calibration calibration;
  std::vector<std::string> notes;  ///< The assumptions that were made.
};

/// The calibration that a unit uses today, for comparison and evaluation: the consumer's equation
/// as bias and sensitivity, every σ zero. The gauge follows from the form of the leading triad's
/// matrix. Errors: no such format, one that cannot be imported, an unknown unit (usage); files that
/// cannot be read or hold no calibration (bad input).
Result<Import> ImportCalibration(std::string_view format,
                                 const std::vector<std::string>& paths,
                                 const ImportOptions& options = {});

}  // namespace truetriad
