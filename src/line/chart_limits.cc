// SPDX-License-Identifier: Apache-2.0
#include "line/chart_limits.h"

#include <cmath>

#include "math/distributions.h"

namespace truetriad::line {

double C4(double n) {
  return std::sqrt(2.0 / (n - 1.0)) * std::exp(std::lgamma(0.5 * n) - std::lgamma(0.5 * (n - 1.0)));
}

double PredictiveLimit(double width, double variance, double weight, const Known& known) {
  const double t = -StudentQuantile(NormalCdf(-width), known.dof);
  const double centre = weight * weight / known.count;
  return t * std::sqrt(known.own ? variance - centre : variance + centre);
}

SpreadLimits LimitsOfSpread(int size, double probability, const Known& known) {
  const double dof = size - 1.0;
  if (known.own) {
    // Its share of all squares is a beta(dof / 2, rest / 2), a function of Fisher's F.
    const double rest = known.dof - dof;
    const auto spread_of = [&](double f) {
      const double share = dof * f / (rest + dof * f);
      return std::sqrt(share * known.dof / dof);
    };
    return {spread_of(1.0 / FisherUpperQuantile(0.5 * probability, rest, dof)),
            spread_of(FisherUpperQuantile(0.5 * probability, dof, rest))};
  }
  // The quantile from below is one over that from above with the degrees of freedom exchanged.
  return {std::sqrt(1.0 / FisherUpperQuantile(0.5 * probability, known.dof, dof)),
          std::sqrt(FisherUpperQuantile(0.5 * probability, dof, known.dof))};
}

double HotellingLimit(int dimension, double probability, double count, bool own) {
  const double p = dimension;
  if (!own) {
    return p * (count - 1.0) / (count - p) * FisherUpperQuantile(probability, p, count - p);
  }
  // (n - 1) times a beta(p / 2, (n - p - 1) / 2), which is a function of Fisher's F.
  const double rest = count - p - 1.0;
  const double f = p / rest * FisherUpperQuantile(probability, p, rest);
  return (count - 1.0) * f / (1.0 + f);
}

double HotellingUpper(int dimension, double t2, double count, bool own) {
  const double p = dimension;
  if (!own) return FisherUpper(t2 * (count - p) / (p * (count - 1.0)), p, count - p);
  const double share = t2 / (count - 1.0);
  if (share >= 1.0) return 0.0;
  const double rest = count - p - 1.0;
  return FisherUpper(share / (1.0 - share) * rest / p, p, rest);
}

}  // namespace truetriad::line
