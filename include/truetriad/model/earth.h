// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/base/result.h"

namespace truetriad {

/// Gravity at a place, and the Earth's magnetic field of core and crust there.

/// A place on WGS 84.
struct EarthPlace {
  double latitude_deg = 0.0;   ///< -90 to 90, positive in the north.
  double longitude_deg = 0.0;  ///< East positive.
  double height_m = 0.0;       ///< Above the ellipsoid.
};

/// Typical difference between gravity and the normal gravity of the ellipsoid (50 mGal).
inline constexpr double kNormalGravitySigmaMps2 = 5e-4;

/// Normal gravity of WGS 84, m/s^2.
double NormalGravityMps2(double latitude_deg, double height_m);

/// The Earth's magnetic field away from iron and currents. The σ are those of the model; they
/// include the crust and the average disturbance from ionosphere and magnetosphere.
struct EarthField {
  double strength_ut = 0.0;
  double dip_deg = 0.0;          ///< Positive where the field points down.
  double declination_deg = 0.0;  ///< Of magnetic north from true north, positive to the east.
  double strength_sigma_ut = 0.0;
  double dip_sigma_deg = 0.0;
  double declination_sigma_deg = 0.0;
};

/// The day `date`, "2026-01-31", as a year with fraction: 2026.0 is the first of January.
/// Error (bad input): not a day of the calendar in this form.
Result<double> DecimalYear(const std::string& date);

/// The World Magnetic Model 2025 at `place`. Error (bad input): a year outside of 2025.0 to 2030.0,
/// or data files that are missing (FindSharedFile) or damaged.
Result<EarthField> WorldMagneticModel(const EarthPlace& place, double year);

}  // namespace truetriad
