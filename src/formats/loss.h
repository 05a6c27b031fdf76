// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "formats/format.h"
#include "formats/restate.h"
#include "truetriad/formats/export.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// What `equation` makes of the readings that `restated.whole` says a triad gives for truths on a
// sphere (gravity, the field's strength or pi rad/s in radius), over the calibrated temperatures,
// against those truths. `calibration` is the one before it was restated: its covariance tells how
// well it predicts itself. Terms in the rate of temperature that the format does not hold are in
// at_rates alone.
ExportLoss LossOf(Triad triad,
                  const Equation& equation,
                  const Restated& restated,
                  const Calibration& calibration);

// By how much a corrected reading is uncertain from the calibration's own covariance, by axis, true
// unit squared: the mean over a sphere of truths, at the reference temperature.
Eigen::Vector3d ReadingVariances(Triad triad, const Calibration& calibration);

}  // namespace truetriad
