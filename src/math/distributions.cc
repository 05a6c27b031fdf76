// SPDX-License-Identifier: Apache-2.0
#include "math/distributions.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <glog/logging.h>

namespace truetriad {
namespace {

// By default Boost computes in long double, at ten times the cost, for digits that are not needed
// here.
using Plain = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
using Normal = boost::math::normal_distribution<double, Plain>;
using ChiSquared = boost::math::chi_squared_distribution<double, Plain>;
using FisherF = boost::math::fisher_f_distribution<double, Plain>;
using StudentsT = boost::math::students_t_distribution<double, Plain>;

void CheckProbability(double probability) {
  CHECK(probability > 0.0 && probability < 1.0) << "probability " << probability;
}

void CheckValue(double value) { CHECK(value >= 0.0) << "value " << value; }

void CheckFiniteDof(double dof) {
  CHECK(dof > 0.0 && std::isfinite(dof)) << "degrees of freedom " << dof;
}

void CheckDof(double dof) { CHECK(dof > 0.0) << "degrees of freedom " << dof; }

}  // namespace

double NormalCdf(double value) { return 0.5 * std::erfc(-value * std::numbers::sqrt2 / 2.0); }

double NormalQuantile(double probability) {
  CheckProbability(probability);
  return boost::math::quantile(Normal(), probability);
}

double ChiSquareCdf(double value, double dof) {
  CheckValue(value);
  CheckFiniteDof(dof);
  if (std::isinf(value)) return 1.0;  // Boost takes finite values only.
  return boost::math::cdf(ChiSquared(dof), value);
}

double ChiSquareQuantile(double probability, double dof) {
  CheckProbability(probability);
  CheckFiniteDof(dof);
  return boost::math::quantile(ChiSquared(dof), probability);
}

double FisherCdf(double value, double dof1, double dof2) {
  CheckValue(value);
  CheckFiniteDof(dof1);
  CheckDof(dof2);
  if (std::isinf(dof2)) return ChiSquareCdf(value * dof1, dof1);
  if (std::isinf(value)) return 1.0;
  return boost::math::cdf(FisherF(dof1, dof2), value);
}

double FisherUpper(double value, double dof1, double dof2) {
  CheckValue(value);
  CheckFiniteDof(dof1);
  CheckFiniteDof(dof2);
  if (std::isinf(value)) return 0.0;
  return boost::math::cdf(boost::math::complement(FisherF(dof1, dof2), value));
}

double FisherUpperQuantile(double probability, double dof1, double dof2) {
  CheckProbability(probability);
  CheckFiniteDof(dof1);
  CheckFiniteDof(dof2);
  return boost::math::quantile(boost::math::complement(FisherF(dof1, dof2), probability));
}

double FisherQuantile(double probability, double dof1, double dof2) {
  CheckProbability(probability);
  CheckFiniteDof(dof1);
  CheckDof(dof2);
  if (std::isinf(dof2)) return ChiSquareQuantile(probability, dof1) / dof1;
  return boost::math::quantile(FisherF(dof1, dof2), probability);
}

double StudentQuantile(double probability, double dof) {
  CheckProbability(probability);
  CheckDof(dof);
  return boost::math::quantile(StudentsT(dof), probability);
}

double MadSigma(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  return values.empty() ? 0.0 : kMadToSigma * Median(std::move(values));
}

double LowerQuantile(std::vector<double> values, double share) {
  CHECK(!values.empty());
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double Median(std::vector<double> values) {
  CHECK(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*std::max_element(values.begin(), middle) + *middle);
}

}  // namespace truetriad
