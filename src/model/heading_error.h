// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "truetriad/model/calibration.h"

namespace truetriad {

/// The error, rad, of a compass at one heading of a level unit. The accelerometer provides the
/// tilt.
struct HeadingError {
  double heading_rad = 0.0;       ///< Heading of body x, clockwise from magnetic north.
  std::optional<double> raw_rad;  ///< Uncalibrated (nominal gains) minus true; unset for counts.
  double sigma_rad = 0.0;         ///< σ of the calibrated heading by the parameters' covariance.
};

/// The errors at `count` evenly spaced headings, at the reference temperature. Empty if the
/// accelerometer, the magnetometer, the covariance, or the field's strength or dip is missing.
std::vector<HeadingError> HeadingErrors(const Calibration& calibration, int count);

}  // namespace truetriad
