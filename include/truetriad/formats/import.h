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
  /// The program that imports: "0.1.0".
  std::string software_version = {};
  /// Units of the readings that the calibration is to take; unset: true units, or what the file
  /// says. Must be set when the file does not say it.
  PerTriad<std::optional<std::string>> units = {};
  /// Which of several equal sensors, as the other system numbers them; unset: its first.
  std::optional<int> instance = {};
  /// By its number instead, for formats that state one.
  PerTriad<std::optional<std::int64_t>> device_ids = {};
};

struct Import {
  Calibration calibration;
  std::vector<std::string> notes;  ///< What had to be assumed.
};

/// What a unit carries today as a calibration, so that it can be compared and evaluated: the
/// consumer's equation as bias and sensitivity, every σ zero. The gauge is the one in which the
/// leading triad's matrix stands. Errors: no such format, one that cannot be imported, a unit that
/// is not known (usage); files that cannot be read or hold no calibration (bad input).
Result<Import> ImportCalibration(std::string_view format,
                                 const std::vector<std::string>& paths,
                                 const ImportOptions& options = {});

}  // namespace truetriad
