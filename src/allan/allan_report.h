// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/allan/allan.h"
#include "truetriad/report/report.h"

namespace truetriad {

/// What `allan` prints: first which triads were not at rest, and thus have no coefficients; for
/// each other triad a table of the coefficients with 95 % intervals and units, then what may spoil
/// them. Counts are shown in true units when the recording states their scale.
std::string AllanText(const AllanResult& result);

/// The same as a self-contained page, with the curves.
std::string AllanHtml(const AllanResult& result);

/// The curves, for other pages.
Drawing AllanDrawing(const AllanResult& result);

/// One self-contained SVG: a log-log panel for each axis with the deviation, its 95 % band and the
/// slope line of each coefficient (of a triad that was not at rest the marked curve alone), drawn
/// from and labelled with the numbers that AllanText prints. Same input, same bytes.
std::string AllanSvg(const AllanResult& result);

}  // namespace truetriad
