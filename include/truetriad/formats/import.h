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
  /// Units of the calibration's readings. Unset: the true unit if the format fixes a unit,
  /// otherwise the unit that the file states. Must be set if neither states a unit.
  PerTriad<std::optional<std::string>> units = {};
  /// Which of several equal sensors is imported, in the other program's counting. Unset: the first.
  std::optional<int> instance = {};
  /// Device IDs that select the sensors in place of `instance`, for formats that state IDs.
  PerTriad<std::optional<std::int64_t>> device_ids = {};
};

struct Import {
  Calibration calibration;
  std::vector<std::string> notes;  ///< The assumptions that were made.
};

/// Imports the calibration that a unit uses today, for comparison and evaluation. The equation of
/// the other program becomes bias and sensitivity; every σ is zero. The gauge follows from the form
/// of the leading triad's matrix. Errors (usage): no such format; a format that cannot be imported;
/// an unknown unit. Errors (bad input): files that cannot be read or hold no calibration.
Result<Import> ImportCalibration(std::string_view format,
                                 const std::vector<std::string>& paths,
                                 const ImportOptions& options = {});

}  // namespace truetriad
