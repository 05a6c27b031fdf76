// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "report/content.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The sections of a calibration's report; without blocks where there is nothing to say.

/// Errors of readings before and after the calibration, in true units. `turns`: as of SectionsOf.
Section CorrectedErrorSection(const Calibration& calibration, bool turns);

/// What the poses at each temperature say by themselves, against the temperature terms, and the
/// errors with and without those.
Section SoakSection(const Calibration& calibration);

/// What a temperature sweep says axis by axis: terms and lags, errors before and after, what was
/// left out, how terms were chosen, the fit beside the data and the bias over temperature and rate.
Section SweepSection(const Calibration& calibration);

/// What a calibration from poses says besides its parameters.
Section LeftOutSection(const Quality& quality);
Section ModelChoiceSection(const Quality& quality);
Section HeldOutSection(const Calibration& calibration);
Section ResidualsSection(const Calibration& calibration);
Section CoverageSection(const Calibration& calibration);

/// The biases of a sensor's sessions, to stand beside its parameters.
void AddSessions(const RestQuality& quality,
                 Triad triad,
                 const std::string& unit,
                 Section* section);

}  // namespace truetriad
