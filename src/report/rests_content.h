// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "report/content.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// What a calibration from poses says besides its parameters; empty where there is nothing to say.
Section LeftOutSection(const Quality& quality);
Section ModelChoiceSection(const Quality& quality);
Section HeldOutSection(const Calibration& calibration);
Section ResidualsSection(const Calibration& calibration);
Section CoverageSection(const Quality& quality);

/// The biases of a sensor's sessions, to stand beside its parameters.
void AddSessions(const RestQuality& quality,
                 Triad triad,
                 const std::string& unit,
                 Section* section);

}  // namespace truetriad
