// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The calibration `sensor` converted for readings and results in other units: `reading_per_raw` new
// units are one raw unit, and `result_per_truth` new units are one true unit.
TriadCalibration InUnits(const TriadCalibration& sensor,
                         double reading_per_raw,
                         double result_per_truth);

// Converts the rows and columns of a triad's entries in a covariance to the units of InUnits.
void ScaleCovariance(Triad triad,
                     double reading_per_raw,
                     double result_per_truth,
                     NamedCovariance* covariance);

// Restates `calibration` for readings of `triad` in `unit`. If `unit` is counts, a count is
// `si_per_count` true units. Error (bad input): as ReadingPerRaw.
Status TakeReadingsIn(Triad triad,
                      const Unit& unit,
                      const std::optional<double>& si_per_count,
                      Calibration* calibration);

}  // namespace truetriad
