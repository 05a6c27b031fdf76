// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "line/effects.h"
#include "line/factors.h"

namespace truetriad::line {

/// Rotations that units of one fixture, slot or position have in common. A unit that sits turned by
/// a small ω in its fixture has the sensitivities S (1 + [ω]x): each sensing axis a (a row of S as
/// a unit vector) moves by a x ω, those of all sensors by the same ω.
///
/// Only where the body frame is the fixture's, that is where attitudes were given: a frame that the
/// accelerometer's own axes define turns with the unit. Such a frame shows as sensitivities that
/// are fixed (accel-x, accel-z) or tied to each other (symmetric); `notes` then says so.
std::vector<FactorTilt> TiltsOf(const LineData& data,
                                const Factors& factors,
                                std::vector<std::string>* notes);

}  // namespace truetriad::line
