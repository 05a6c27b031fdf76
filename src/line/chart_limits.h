// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace truetriad::line {

/// Mean of the standard deviation of n normal values of σ 1: c4(n); n >= 2, may be a fraction.
double C4(double n);

/// What a process' mean and σ are known from.
struct Known {
  double count = 0.0;  // units in the mean
  double dof = 0.0;    // of σ
  bool own = false;    // the values judged are among them (phase I)
};

/// Limit on both sides, in estimated σ, of a mean of later values whose own variance is `variance`
/// (in σ^2) and whose weights sum to `weight`, minus `weight` times the estimated centre. It is
/// exceeded as often as `width` times its σ were if mean and σ were known:
///
///   t_dof(1 - Φ(-width)) sqrt(variance + weight^2 / count)      (-, where the values are own)
double PredictiveLimit(double width, double variance, double weight, const Known& known);

/// Weights of the units in a moving average (or in a single value: λ = 1) since it began at 0.
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
  /// Part of the weights that own units have.
  double OwnShare() const { return own_ / all_; }

 private:
  double lambda_;
  double all_ = 0.0, own_ = 0.0, squares_ = 0.0;  // sums of weights and of their squares
};

/// Limits of the standard deviation of `size` values, in estimated σ: each is exceeded with half of
/// `probability`. Fisher's quantiles; of own values, which are in that σ, the beta's. `known.dof`
/// then exceeds size - 1.
struct SpreadLimits {
  double lower = 0.0, upper = 0.0;
};
SpreadLimits LimitsOfSpread(int size, double probability, const Known& known);

/// Limit of T^2 = d' S^-1 d / (variance of d, in that of single units) over `dimension` parameters
/// that is exceeded with `probability`, S from `count` units: Fisher's quantile of later units (d's
/// variance with what the centre adds, 1 + 1 / count), a beta's of own.
double HotellingLimit(int dimension, double probability, double count, bool own);
/// Its inverse: the probability of a larger T^2.
double HotellingUpper(int dimension, double t2, double count, bool own);

}  // namespace truetriad::line
