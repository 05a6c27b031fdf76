// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/base/result.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// The text of calibration.yaml (interface.md "calibration.yaml"), 17 significant digits.
/// Sensors and covariance are left out unless the outcome is converged.
std::string CalibrationToYaml(const Calibration& calibration);

/// Reads calibration.yaml back to the same bits. Unknown or duplicate keys are errors with their
/// line, missing ones name themselves.
Result<Calibration> ReadCalibration(const std::string& path);
Result<Calibration> CalibrationFromYaml(const std::string& text, const std::string& name);

/// Writes `text` to `path` so that the file appears whole or not at all.
Status WriteFileAtomically(const std::string& path, const std::string& text);

/// Creates `directory` (and parents) if needed and checks that files can be written in it.
Status EnsureWritableDirectory(const std::string& directory);

}  // namespace truetriad
