// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "report/content.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// What a temperature sweep says axis by axis: terms and lags, errors before and after, what was
/// left out, how terms were chosen, the fit beside the data and the bias over temperature and rate.
/// Empty for other calibrations.
Section SweepSection(const Calibration& calibration);

}  // namespace truetriad
