// SPDX-License-Identifier: Apache-2.0
#include "line/chart_limits.h"

#include <cmath>

#include "math/distributions.h"

namespace truetriad::line {

double C4(double n) {
  return std::sqrt(2.0 / (n - 1.0)) * std::exp(std::lgamma(0.5 * n) - std::lgamma(0.5 * (n - 1.0)));
}

double PredictiveWidth(double width, double dof) {
  return -StudentQuantile(NormalCdf(-width), dof);
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

}  // namespace truetriad::line
