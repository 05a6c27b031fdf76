// SPDX-License-Identifier: Apache-2.0
#include "line/capability.h"

#include <algorithm>
#include <cmath>

#include "line/normality.h"
#include "line/spread.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

/// Where the mean lies in the limits, and how well that is known.
struct Location {
  double mean = 0.0;
  double lower = 0.0, upper = 0.0;  // limits
  double doubt = 0.0;               // half the interval of the mean

  /// To the nearer limit; negative beyond it, infinite without limits.
  double Distance() const { return std::min(upper - mean, mean - lower); }
};

/// distance / (3 sigma), 0 / 0 being none.
double InSigmas(double distance, double sigma) { return distance / (3.0 * sigma); }

/// The interval of Cpk from those of distance and sigma.
Interval CpkInterval(const Location& at, double sigma, const Interval& sigmas) {
  const double distance = at.Distance();
  const double one = InSigmas(distance, sigmas.upper), other = InSigmas(distance, sigmas.lower);
  const double by_sigma_low = std::min(one, other), by_sigma_high = std::max(one, other);
  // No spread at all: Cpk is infinite, and the bounds that are not come from the upper one of
  // sigma.
  if (!(sigma > 0.0)) {
    return {std::min(by_sigma_low, InSigmas(distance - at.doubt, sigmas.upper)),
            std::max(by_sigma_high, InSigmas(distance + at.doubt, sigmas.lower))};
  }
  const double cpk = InSigmas(distance, sigma), by_mean = InSigmas(at.doubt, sigma);
  return {cpk - std::hypot(by_mean, cpk - by_sigma_low),
          cpk + std::hypot(by_mean, by_sigma_high - cpk)};
}

CapabilityIndices IndicesOf(const Spread& spread, const Location& at, double confidence) {
  CapabilityIndices indices;
  if (std::isnan(spread.variance)) return indices;
  indices.dof = spread.dof;
  indices.sigma = {spread.ProcessSigma(), spread.ProcessSigmaInterval(confidence)};
  const double sigma = indices.sigma.value;
  const Interval& sigmas = indices.sigma.interval;
  const double width = at.upper - at.lower;
  if (std::isfinite(width)) {
    indices.cp = {InSigmas(0.5 * width, sigma),
                  {InSigmas(0.5 * width, sigmas.upper), InSigmas(0.5 * width, sigmas.lower)}};
  }
  if (std::isfinite(at.Distance())) {
    indices.cpk = {InSigmas(at.Distance(), sigma), CpkInterval(at, sigma, sigmas)};
    indices.expected_outside = sigma > 0.0 ? NormalCdf((at.lower - at.mean) / sigma) +
                                                 NormalCdf((at.mean - at.upper) / sigma)
                                           : static_cast<double>(at.Distance() < 0.0);
  }
  return indices;
}

Spread WithinSpread(const CapabilityInput& input) {
  return input.subgroups.empty() ? MovingRangeSpread(input.values)
                                 : SubgroupSpread(input.values, input.subgroups);
}

}  // namespace

Capability FindCapability(const CapabilityInput& input, double confidence) {
  Capability found;
  found.units = input.values.size();
  if (found.units == 0) return found;
  found.mean = input.values.mean();
  found.lowest = input.values.minCoeff();
  found.highest = input.values.maxCoeff();
  const auto outside = (input.values.array() < input.lower || input.values.array() > input.upper);
  if (std::isfinite(input.lower) || std::isfinite(input.upper)) {
    found.observed_outside =
        static_cast<double>(outside.count()) / static_cast<double>(found.units);
  }
  const double calibration_variance =
      input.sigma.size() > 0 ? input.sigma.array().square().mean() : kNotKnown;
  found.calibration_sigma = std::sqrt(calibration_variance);
  if (found.units < 2) return found;

  Spread within = WithinSpread(input), overall = OverallSpread(input.values);
  const double doubt = StudentQuantile(0.5 * (1.0 + confidence), overall.dof) *
                       std::sqrt(overall.variance / static_cast<double>(found.units));
  const Location at{found.mean, input.lower, input.upper, doubt};
  found.observed = {IndicesOf(within, at, confidence), IndicesOf(overall, at, confidence)};
  if (!std::isnan(calibration_variance)) {
    within.known = overall.known = calibration_variance;
    found.process = {IndicesOf(within, at, confidence), IndicesOf(overall, at, confidence)};
  }
  found.normality_p = AndersonDarlingP(input.values);
  return found;
}

}  // namespace truetriad::line
