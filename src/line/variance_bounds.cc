// SPDX-License-Identifier: Apache-2.0
#include "line/variance_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "math/distributions.h"

namespace truetriad::line {
namespace {

constexpr double kManyDof = std::numeric_limits<double>::infinity();

double Squared(double value) { return value * value; }

/// How far a bound lies from the sum, squared: V_L of the papers where `probability` is 1 - tail,
/// for the lower bound; V_U where it is tail, for the upper one.
double SquaredDistance(const std::vector<MeanSquareTerm>& terms, double probability) {
  const bool is_lower = probability > 0.5;
  const auto own = [&](const MeanSquareTerm& term) {
    const bool is_over = (term.factor > 0.0) == is_lower;
    const double p = is_lower ? probability : 1.0 - probability;
    return is_over ? 1.0 - 1.0 / FisherQuantile(p, term.dof, kManyDof)
                   : 1.0 / FisherQuantile(1.0 - p, term.dof, kManyDof) - 1.0;
  };
  double sum = 0.0;
  int positive = 0;
  for (const MeanSquareTerm& term : terms) {
    sum += Squared(own(term) * term.factor * term.mean_square);
    if (term.factor > 0.0) ++positive;
  }
  const bool is_difference = positive < static_cast<int>(terms.size());
  for (std::size_t i = 0; i < terms.size(); ++i) {
    for (std::size_t j = 0; j < terms.size(); ++j) {
      const MeanSquareTerm &one = terms[i], &other = terms[j];
      const double product =
          one.factor * one.mean_square * std::abs(other.factor) * other.mean_square;
      if (one.factor > 0.0 && other.factor < 0.0) {
        const double f = FisherQuantile(probability, one.dof, other.dof);
        sum += product / f * (Squared(f - 1.0) - Squared(own(one) * f) - Squared(own(other)));
      } else if (is_difference && is_lower && i < j && one.factor > 0.0 && other.factor > 0.0) {
        const double both = one.dof + other.dof;
        const double together = 1.0 - 1.0 / FisherQuantile(probability, both, kManyDof);
        sum +=
            product / (positive - 1) *
            (Squared(together * both) / (one.dof * other.dof) -
             Squared(own(one)) * one.dof / other.dof - Squared(own(other)) * other.dof / one.dof);
      }
    }
  }
  return std::max(0.0, sum);
}

}  // namespace

Interval VarianceInterval(const std::vector<MeanSquareTerm>& terms, double confidence) {
  const double tail = 0.5 * (1.0 - confidence);
  double value = 0.0;
  for (const MeanSquareTerm& term : terms) value += term.factor * term.mean_square;
  return {std::max(0.0, value - std::sqrt(SquaredDistance(terms, 1.0 - tail))),
          std::max(0.0, value + std::sqrt(SquaredDistance(terms, tail)))};
}

}  // namespace truetriad::line
