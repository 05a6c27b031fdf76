// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/config/experiment.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// Adds a finding if strength or dip of the field in `calibration` is far from the Earth's field at
/// the experiment's position, or if they cannot be compared. It hints at iron, a wrong position or
/// a wrong unit; as indoor fields differ by tens of percent, it is no verdict.
void CheckField(const Experiment& experiment, Calibration* calibration);

}  // namespace truetriad
