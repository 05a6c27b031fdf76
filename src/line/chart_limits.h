// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace truetriad::line {

/// Mean of the standard deviation of n normal values of σ 1: c4(n); n >= 2, may be a fraction.
double C4(double n);

/// Limit on both sides, in σ that is estimated with `dof` degrees of freedom, that is exceeded as
/// often as `width` times σ were if that were known: t_dof(1 - Φ(-width)).
double PredictiveWidth(double width, double dof);

/// Weights of the units in a moving average since it began at 0.
class MovingWeights {
 public:
  explicit MovingWeights(double lambda) : lambda_(lambda) {}

  /// `own`: the unit that comes is one of those that the process' mean is estimated from.
  void Add(bool own) {
    all_ += lambda_ * (1.0 - all_);
    own_ += lambda_ * ((own ? 1.0 : 0.0) - own_);
    squares_ += lambda_ * lambda_ - lambda_ * (2.0 - lambda_) * squares_;
  }
  void Restart() { all_ = own_ = squares_ = 0.0; }

  /// Of the average less `all` times a mean of `count` units, for units of variance 1; exact, so
  /// never negative: what own units have in common with the mean is allowed for.
  double Variance(double count) const { return squares_ + all_ * (all_ - 2.0 * own_) / count; }

 private:
  double lambda_;
  double all_ = 0.0, own_ = 0.0, squares_ = 0.0;  // sums of weights and of their squares
};

/// Limit of T^2 = d' S^-1 d / (variance of d, in that of single units) over `dimension` parameters
/// that is exceeded with `probability`, S from `count` units: Fisher's quantile of later units (d's
/// variance with what the centre adds, 1 + 1 / count), a beta's of own.
double HotellingLimit(int dimension, double probability, double count, bool own);
}  // namespace truetriad::line
