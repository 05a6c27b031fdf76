// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/config/experiment.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// Adds a finding when strength or dip of the field in `calibration` is far from the Earth's field
/// at the experiment's position, or cannot be compared with it. Indoors they differ by tens of
/// percent: it indicates iron, a wrong position or a wrong unit, and is not a verdict.
void CheckField(const Experiment& experiment, Calibration* calibration);

}  // namespace truetriad
