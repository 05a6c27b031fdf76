// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

namespace truetriad::line {

/// Mean and spread of values that come one by one.
struct RunningMoments {
  double count = 0.0;
  double mean = 0.0;
  double squares = 0.0;  // sum of squared deviations from the mean

  void Add(double value) {
    count += 1.0;
    const double step = value - mean;
    mean += step / count;
    squares += step * (value - mean);
  }
  double Variance() const { return squares / (count - 1.0); }
};

/// The same of vectors.
struct RunningScatter {
  explicit RunningScatter(Eigen::Index dimension)
      : mean(Eigen::VectorXd::Zero(dimension)),
        squares(Eigen::MatrixXd::Zero(dimension, dimension)) {}

  double count = 0.0;
  Eigen::VectorXd mean;
  Eigen::MatrixXd squares;

  void Add(const Eigen::VectorXd& value) {
    count += 1.0;
    const Eigen::VectorXd step = value - mean;
    mean += step / count;
    squares.noalias() += (1.0 - 1.0 / count) * step * step.transpose();
  }
  Eigen::MatrixXd Covariance() const { return squares / (count - 1.0); }
};

/// Median and σ by the median deviation from it; σ is 0 where more than half of the values are the
/// same (or none vary). At least one value.
struct RobustMoments {
  double centre = 0.0, sigma = 0.0;
};
RobustMoments RobustMomentsOf(const std::vector<double>& values);

/// Which values belong to what most of them come from: first those within 5 robust σ of the median,
/// then those within 4 σ of the mean of what is left, until this stays. Of normal values one in
/// 16,000 is left out; up to a third may be anything.
std::vector<bool> WithoutOutliers(const std::vector<double>& values);

/// Whether values that should vary do: not all of them equal but for rounding.
bool Varies(const std::vector<double>& values);

/// Columns that are not determined by those before them: share of each one's variance that is left
/// is above 1e-8. Of a covariance; columns without variance are none of them.
std::vector<Eigen::Index> IndependentColumns(const Eigen::MatrixXd& covariance);

}  // namespace truetriad::line
