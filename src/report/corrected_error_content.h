// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "report/content.h"

namespace truetriad {

/// What somebody who only uses the readings wants to know: what they are off by, raw and corrected,
/// over all directions, and a compass of the unit round the horizon. Empty where nothing is usable.
Section CorrectedErrorSection(const Calibration& calibration);

}  // namespace truetriad
