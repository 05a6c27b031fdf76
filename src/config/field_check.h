// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/config/experiment.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// Adds a message when strength or dip of the field in `calibration` is far from the Earth's field
/// at the experiment's position, or cannot be checked against it. Indoors they differ by tens of
/// percent, so this is a hint at iron, a wrong position or a wrong unit, not a verdict.
void CheckField(const Experiment& experiment, Calibration* calibration);

}  // namespace truetriad
