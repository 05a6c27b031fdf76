// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_display.h"

#include <cmath>
#include <numbers>

#include "allan/allan_fit.h"
#include "report/format.h"
#include "truetriad/base/units.h"

namespace truetriad {

AllanScale ShownScale(const AllanTriad& triad) {
  if (!triad.si_per_count) return {1.0, DisplayUnit(triad.unit.name)};
  if (triad.triad == Triad::kGyroscope) return {*triad.si_per_count * kDegPerRad, "deg/s"};
  return {*triad.si_per_count, DisplayUnit(TruthUnitName(triad.triad))};
}

std::vector<AllanCoefficient> Coefficients(const AllanAxis& axis, const AllanScale& scale) {
  const double factor = scale.shown_per_raw;
  std::vector<AllanCoefficient> coefficients;
  if (axis.white_density) {
    const Interval value = Scaled(*axis.white_density, factor);
    coefficients.push_back({.symbol = 'N',
                            .value = value,
                            .unit = scale.unit + "/√Hz",
                            .slope = -0.5,
                            .mark_tau_s = 1.0,
                            .mark = value.value});
  }
  if (axis.instability) {
    coefficients.push_back({.symbol = 'B',
                            .value = Scaled(axis.instability->coefficient, factor),
                            .unit = scale.unit,
                            .upper_bound = axis.instability->at_end,
                            .slope = 0.0,
                            .mark_tau_s = axis.instability->tau_s,
                            .mark = factor * axis.instability->minimum.value});
  }
  if (axis.random_walk) {
    const Interval value = Scaled(*axis.random_walk, factor);
    coefficients.push_back({.symbol = 'K',
                            .value = value,
                            .unit = scale.unit + "/s/√Hz",
                            .slope = 0.5,
                            .mark_tau_s = 3.0,
                            .mark = value.value});
  }
  if (axis.quantisation) {
    const Interval value = Scaled(*axis.quantisation, factor);
    coefficients.push_back({.symbol = 'Q',
                            .value = value,
                            .unit = scale.unit + "·s",
                            .slope = -1.0,
                            .mark_tau_s = std::numbers::sqrt3,
                            .mark = value.value});
  }
  return coefficients;
}

std::string AllanNumber(double value) { return Significant(value, 4); }

std::string ValueText(const AllanCoefficient& coefficient) {
  return (coefficient.upper_bound ? "≤ " : "") + AllanNumber(coefficient.value.value);
}

}  // namespace truetriad
