// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/base/result.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// The text of calibration.yaml, with 17 significant digits. Sensors and covariance are left out
/// unless the outcome is converged. Residuals of single poses are left out if there are more than
/// 2000 of them.
std::string CalibrationToYaml(const Calibration& calibration);

/// Reads calibration.yaml. Every number is read back exactly as it was written. Errors (bad input)
/// state the line: an unknown, duplicate or missing key, another format version, a correction that
/// is not the inverse of its sensitivity. `name` is the name of the file in messages.
Result<Calibration> ReadCalibration(const std::string& path);
Result<Calibration> CalibrationFromYaml(const std::string& text, const std::string& name);

/// The serial number in a calibration.yaml. Only the keys before `inputs:` are parsed. Errors (bad
/// input): the file is unreadable or of another kind.
Result<std::string> ReadSerial(const std::string& path);

/// The current time as "2026-01-31T12:00:00Z". If the environment variable SOURCE_DATE_EPOCH states
/// a time (whole seconds since 1970), that time is used, so that the same input gives the same
/// bytes. A malformed variable is ignored.
std::string TimestampUtc();

/// Writes `text` to `path` so that the file appears whole or not at all: it is written beside the
/// target and renamed. A device or pipe is written directly.
Status WriteFileAtomically(const std::string& path, const std::string& text);

/// Creates `directory` (and parents) if needed and checks that files can be written in it.
Status EnsureWritableDirectory(const std::string& directory);

}  // namespace truetriad
