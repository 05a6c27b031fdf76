// SPDX-License-Identifier: Apache-2.0
#include "config/field_check.h"

#include <cmath>
#include <cstdio>
#include <string>

#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

// The crust and the sun change an undisturbed field by less than 5 % and 3 deg. The limits are
// about four and three times as large; rooms without iron rarely reach them.
constexpr double kGrossStrengthShare = 0.2;
constexpr double kGrossDipDeg = 10.0;  // Three times 3 deg, rounded up.

std::string Formatted(const char* format, double found, double expected) {
  char text[256];
  std::snprintf(text, sizeof text, format, found, expected);
  return text;
}

}  // namespace

void CheckField(const Experiment& experiment, Calibration* calibration) {
  const auto& magnetometer = calibration->sensors[Triad::kMagnetometer];
  if (!magnetometer || !experiment.position) return;
  if (!experiment.earth_field) {
    // A position without longitude or date is stated for gravity only: no check was asked for.
    if (experiment.position->longitude_deg && !experiment.position->date.empty()) {
      calibration->findings.emplace_back(
          FindingCode::kFieldNotChecked,
          "the field was not compared with the Earth's field: " + experiment.no_earth_field);
    }
    return;
  }
  const EarthField& earth = *experiment.earth_field;
  const ReferenceValues& reference = calibration->reference;
  std::string found;
  Finding finding(FindingCode::kFieldUnlikely, "");
  // If the size of a count is unknown, so is the strength, which cannot be compared.
  const bool says_strength =
      reference.field_ut && !(reference.field_nominal && magnetometer->input_unit == "counts");
  if (says_strength &&
      std::abs(*reference.field_ut - earth.strength_ut) > kGrossStrengthShare * earth.strength_ut) {
    found =
        Formatted("a strength of %.1f uT, expected %.1f", *reference.field_ut, earth.strength_ut);
    finding.With("strength", *reference.field_ut, "uT").With("expected", earth.strength_ut, "uT");
  }
  if (reference.dip_rad) {
    const double dip_deg = *reference.dip_rad / kRadPerDeg;
    if (std::abs(dip_deg - earth.dip_deg) > kGrossDipDeg) {
      found += (found.empty() ? "" : ", and ") +
               Formatted("a dip of %.1f deg, expected %.1f", dip_deg, earth.dip_deg);
      finding.With("dip", dip_deg, "deg").With("expected_dip", earth.dip_deg, "deg");
    }
  }
  if (found.empty()) return;
  finding.text = "the field differs from the World Magnetic Model at reference.position: " + found;
  finding.remedy =
      "check for iron or currents nearby, a wrong position, a wrong unit or a flipped axis";
  calibration->findings.push_back(std::move(finding.About(Triad::kMagnetometer)));
}

}  // namespace truetriad
