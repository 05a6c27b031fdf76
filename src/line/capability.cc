// SPDX-License-Identifier: Apache-2.0
#include "line/capability.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "math/distributions.h"

namespace truetriad::line {
namespace {

// A larger Anderson-Darling statistic is replaced by this one, for which p is below 1e-30. The fits
// for p were made for smaller statistics.
constexpr double kLargestStatistic = 13.0;

/// p of an Anderson-Darling statistic that has been corrected for the number of values.
double ProbabilityBeyond(double statistic) {
  const double a = std::min(statistic, kLargestStatistic);
  if (a >= 0.6) return std::exp(1.2937 - 5.709 * a + 0.0186 * a * a);
  if (a > 0.34) return std::exp(0.9177 - 4.279 * a - 1.38 * a * a);
  if (a > 0.2) return 1.0 - std::exp(-8.318 + 42.796 * a - 59.938 * a * a);
  return 1.0 - std::exp(-13.436 + 101.14 * a - 223.73 * a * a);
}

/// The position of the mean within the limits, and its uncertainty.
struct Location {
  double mean = 0.0;
  double lower = 0.0, upper = 0.0;  // limits
  double doubt = 0.0;               // half width of the mean's confidence interval

  /// Distance from the mean to the nearer limit; negative if the mean is outside, infinite without
  /// limits.
  double Distance() const { return std::min(upper - mean, mean - lower); }
};

/// distance / (3 sigma); NaN for 0 / 0.
double InSigmas(double distance, double sigma) { return distance / (3.0 * sigma); }

/// The interval of Cpk, from the intervals of the distance and of sigma.
Interval CpkInterval(const Location& at, double sigma, const Interval& sigmas) {
  const double distance = at.Distance();
  const double one = InSigmas(distance, sigmas.upper), other = InSigmas(distance, sigmas.lower);
  const double by_sigma_low = std::min(one, other), by_sigma_high = std::max(one, other);
  // Without spread Cpk is infinite; only the upper bound of sigma gives a finite bound of Cpk.
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

}  // namespace

double Spread::ProcessSigma() const {
  return std::isnan(variance) ? kNotKnown : std::sqrt(std::max(0.0, variance - known));
}

Interval Spread::ProcessSigmaInterval(double confidence) const {
  if (std::isnan(variance) || !(dof > 0.0)) return {};
  const double tail = 0.5 * (1.0 - confidence);
  const auto bound = [this](double probability) {
    const double observed = variance * dof / ChiSquareQuantile(probability, dof);
    return std::sqrt(std::max(0.0, observed - known));
  };
  return {bound(1.0 - tail), bound(tail)};
}

Spread OverallSpread(const Eigen::VectorXd& values) {
  if (values.size() < 2) return {};
  const double dof = static_cast<double>(values.size() - 1);
  return {(values.array() - values.mean()).square().sum() / dof, dof};
}

Spread MovingRangeSpread(const Eigen::VectorXd& values) {
  if (values.size() < 2) return {};
  const Eigen::Index count = values.size() - 1;
  const double m = static_cast<double>(count);
  const double d2 = 2.0 * std::numbers::inv_sqrtpi;
  // Covariance of |D1| and |D2| for adjacent differences D1, D2. Their correlation is -1/2:
  // 4/pi (sqrt(3)/2 + pi/12) - 4/pi.
  const double covariance =
      4.0 / std::numbers::pi * (0.5 * std::numbers::sqrt3 + std::numbers::pi / 12.0 - 1.0);
  const double relative = ((2.0 - d2 * d2) * m + 2.0 * covariance * (m - 1.0)) / (m * m * d2 * d2);
  const double sigma = (values.tail(count) - values.head(count)).cwiseAbs().mean() / d2;
  return {sigma * sigma, 0.5 / relative};
}

double AndersonDarlingP(const Eigen::VectorXd& values) {
  constexpr Eigen::Index kFewest = 8;  // Below eight values the fits for p are not valid.
  if (values.size() < kFewest) return kNotKnown;
  const double sigma = OverallSpread(values).ProcessSigma();
  if (!(sigma > 0.0)) return kNotKnown;
  Eigen::VectorXd sorted = (values.array() - values.mean()) / sigma;
  std::sort(sorted.begin(), sorted.end());
  const Eigen::Index last = sorted.size() - 1;
  const double n = static_cast<double>(sorted.size());
  const auto log_of = [](double probability) {
    return std::log(std::max(probability, std::numeric_limits<double>::min()));
  };
  double sum = 0.0;
  for (Eigen::Index i = 0; i <= last; ++i) {
    sum += static_cast<double>(2 * i + 1) *
           (log_of(NormalCdf(sorted[i])) + log_of(NormalCdf(-sorted[last - i])));
  }
  const double statistic = -n - sum / n;
  return ProbabilityBeyond(statistic * (1.0 + 0.75 / n + 2.25 / (n * n)));
}

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

  Spread within = MovingRangeSpread(input.values), overall = OverallSpread(input.values);
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
