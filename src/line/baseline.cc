// SPDX-License-Identifier: Apache-2.0
#include "line/baseline.h"

#include <algorithm>
#include <cmath>

#include "math/distributions.h"

namespace truetriad::line {
namespace {

using Eigen::Index;

constexpr double kFirstReach = 5.0;
constexpr double kReach = 4.0;
constexpr int kMostRounds = 10;
// Of a value's size: what differs by less is rounding of the same.
constexpr double kSame = 1e-12;
// Of a column's variance: what is left below it is rounding. Tied entries leave 1e-16; a sensor's
// parameters that are correlated by 0.999,999 leave 2e-6.
constexpr double kLeastOwnVariance = 1e-8;

}  // namespace

RobustMoments RobustMomentsOf(const std::vector<double>& values) {
  RobustMoments moments;
  moments.centre = Median(values);
  std::vector<double> deviations(values.size());
  std::transform(values.begin(), values.end(), deviations.begin(), [&](double value) {
    return value - moments.centre;
  });
  moments.sigma = MadSigma(std::move(deviations));
  return moments;
}

std::vector<bool> WithoutOutliers(const std::vector<double>& values) {
  std::vector<bool> good(values.size(), true);
  if (values.empty()) return good;
  const RobustMoments robust = RobustMomentsOf(values);
  if (robust.sigma == 0.0) return good;
  double centre = robust.centre;
  double reach = kFirstReach * robust.sigma;
  for (int round = 0; round < kMostRounds; ++round) {
    RunningMoments moments;
    bool same = true;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const bool within = std::abs(values[k] - centre) <= reach;
      same = same && within == good[k];
      good[k] = within;
      if (within) moments.Add(values[k]);
    }
    if (round > 0 && same) break;
    centre = moments.mean;
    reach = kReach * std::sqrt(moments.Variance());
  }
  return good;
}

bool Varies(const std::vector<double>& values) {
  if (values.empty()) return false;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return *most - *least > kSame * std::max(std::abs(*least), std::abs(*most));
}

std::vector<Index> IndependentColumns(const Eigen::MatrixXd& covariance) {
  std::vector<Index> kept;
  // Cholesky's factor of the correlations, row by row.
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(covariance.rows(), covariance.cols());
  for (Index col = 0; col < covariance.rows(); ++col) {
    if (!(covariance(col, col) > 0.0)) continue;
    const Index place = static_cast<Index>(kept.size());
    Eigen::VectorXd row(place);
    for (Index k = 0; k < place; ++k) {
      const Index other = kept[static_cast<std::size_t>(k)];
      const double correlation =
          covariance(col, other) / std::sqrt(covariance(col, col) * covariance(other, other));
      row[k] = (correlation - row.head(k).dot(root.row(k).head(k))) / root(k, k);
    }
    const double left = 1.0 - row.squaredNorm();
    if (left < kLeastOwnVariance) continue;
    root.row(place).head(place) = row.transpose();
    root(place, place) = std::sqrt(left);
    kept.push_back(col);
  }
  return kept;
}

}  // namespace truetriad::line
