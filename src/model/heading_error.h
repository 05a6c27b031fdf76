// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "truetriad/model/calibration.h"

namespace truetriad {

/// The error, rad, of a compass at one heading of a level unit, whose tilt comes from the
/// accelerometer.
struct HeadingError {
  double heading_rad = 0.0;       ///< Heading of body x, clockwise from magnetic north.
  std::optional<double> raw_rad;  ///< Reading minus truth in nominal units; unset for counts.
  double sigma_rad = 0.0;         ///< Of a corrected reading, from the parameters' covariance.
};

/// The errors at `count` evenly spaced headings, at the reference temperature. Empty without both
/// sensors, without a covariance, and if the field's strength or dip is unknown.
std::vector<HeadingError> HeadingErrors(const Calibration& calibration, int count);

}  // namespace truetriad
