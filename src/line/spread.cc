// SPDX-License-Identifier: Apache-2.0
#include "line/spread.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "math/distributions.h"

namespace truetriad::line {

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
  // Of |D1| and |D2|, differences of one value with those on its sides, which correlate by -1/2:
  // 4/pi (sqrt(3)/2 + pi/12) - 4/pi.
  const double covariance =
      4.0 / std::numbers::pi * (0.5 * std::numbers::sqrt3 + std::numbers::pi / 12.0 - 1.0);
  const double relative = ((2.0 - d2 * d2) * m + 2.0 * covariance * (m - 1.0)) / (m * m * d2 * d2);
  const double sigma = (values.tail(count) - values.head(count)).cwiseAbs().mean() / d2;
  return {sigma * sigma, 0.5 / relative};
}

Spread SubgroupSpread(const Eigen::VectorXd& values, const std::vector<std::string>& groups) {
  struct Group {
    double count = 0.0, mean = 0.0, squares = 0.0;
  };
  std::map<std::string, Group> by_name;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    Group& group = by_name[groups[static_cast<std::size_t>(i)]];
    const double from_mean = values[i] - group.mean;
    group.mean += from_mean / ++group.count;
    group.squares += from_mean * (values[i] - group.mean);
  }
  double squares = 0.0, dof = 0.0;
  for (const auto& [name, group] : by_name) {
    squares += group.squares;
    dof += group.count - 1.0;
  }
  return dof > 0.0 ? Spread{squares / dof, dof} : Spread{};
}

}  // namespace truetriad::line
