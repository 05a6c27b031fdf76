// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/config/experiment.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// Adds a finding if strength or dip of the field in `calibration` is far from the Earth's field at
/// the experiment's position, or if they cannot be compared. The finding hints at iron, a wrong
/// position or a wrong unit. It does not refuse the calibration, since fields indoors differ by
/// tens of percent.
void CheckField(const Experiment& experiment, Calibration* calibration);

}  // namespace truetriad
