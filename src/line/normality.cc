// SPDX-License-Identifier: Apache-2.0
#include "line/normality.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "line/interval.h"
#include "line/spread.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

// Beyond, p is below 1e-30; the fits that give it are meant for less.
constexpr double kLargestStatistic = 13.0;

/// p of the statistic after its correction for the number of values.
double ProbabilityBeyond(double statistic) {
  const double a = std::min(statistic, kLargestStatistic);
  if (a >= 0.6) return std::exp(1.2937 - 5.709 * a + 0.0186 * a * a);
  if (a > 0.34) return std::exp(0.9177 - 4.279 * a - 1.38 * a * a);
  if (a > 0.2) return 1.0 - std::exp(-8.318 + 42.796 * a - 59.938 * a * a);
  return 1.0 - std::exp(-13.436 + 101.14 * a - 223.73 * a * a);
}

}  // namespace

double AndersonDarlingP(const Eigen::VectorXd& values) {
  constexpr Eigen::Index kFewest = 8;
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

}  // namespace truetriad::line
