// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "truetriad/base/triad.h"

namespace truetriad {

/// What every exported file of a calibration says of itself, with the version in between.
inline constexpr std::string_view kExportedBy = "Exported by truetriad ";
inline constexpr std::string_view kWasCalibrated = "; calibrated ";

// How the comment of a file begins that was exported of a unit which may not leave.
inline constexpr std::string_view kMustNotLeave = "THIS UNIT MUST NOT LEAVE";

// The line of an exported file that says which units a sensor's numbers are for.
std::string UnitComment(Triad triad, std::string_view reading_unit, std::string_view result_unit);

// The unit of the readings that such a line of `text` states; empty when there is none.
std::string UnitFromComment(const std::string& text, Triad triad);

}  // namespace truetriad
