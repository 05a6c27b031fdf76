// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "problem/thermal_block.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The lags of one axis, s; 0 means no lag. model/thermal.h.
struct SweepLags {
  double element_s = 0.0;
  double rate_s = 0.0;
  auto operator<=>(const SweepLags&) const = default;
};

// Computes, in order of time, an element's temperature and rate from those of the thermometer,
// which the element follows with lags. Both results are linear in both inputs (model/thermal.h).
class SweepFilter {
 public:
  explicit SweepFilter(const SweepLags& lags)
      : element_lag_(lags.element_s), rate_lag_(lags.rate_s) {}
  Eigen::Vector2d Next(double time_s, double degc, double rate_degcps);

 private:
  FirstOrderLag element_lag_, rate_lag_;
};

// Sums over one block of time for all columns. Any subset of the columns can be fitted and tested
// from these sums.
struct SweepBlock {
  Eigen::MatrixXd weighted, plain;                                       // X^T W X, X^T X
  Eigen::Matrix<double, Eigen::Dynamic, 3> weighted_right, plain_right;  // X^T W y, X^T y by axis
  Eigen::Vector3d weighted_square = Eigen::Vector3d::Zero();
  Eigen::Vector3d plain_square = Eigen::Vector3d::Zero();
};

// Sums of each fold [begin[f], begin[f + 1]) of the rows of `columns`; readings: a column per axis.
std::vector<SweepBlock> SumFolds(const std::vector<int>& fold_begin,
                                 const Eigen::MatrixXd& columns,
                                 const Eigen::MatrixX3d& readings,
                                 const Eigen::VectorXd& weights);

// One triad over the windows of a sweep: per axis the linear regression
//
//   y = c_attitude + sum_i a_i (T_i(v) - T_i(v_ref)) + rates          ThermalScale
//
// with every window weighted by its number of samples. If `even_temperatures`, this is divided by
// the time spent at the window's temperature: all temperatures then count alike.
//
// Columns: a constant for each attitude (one for all if a gyroscope, whose bias is absolute),
// powers 1 to kMaxBiasOrder, rate terms, then two for each knot.
class SweepProblem {
 public:
  // `poses` must outlive the problem; windows without the triad are skipped. `folds`: blocks
  // of time.
  SweepProblem(
      const PoseSet& poses, Triad triad, double reference_degc, bool even_temperatures, int folds);

  int size() const { return static_cast<int>(window_.size()); }
  int attitude_count() const { return attitude_count_; }
  int column_count() const {
    return attitude_count_ + kMaxThermalVectors + 2 * static_cast<int>(knots_degc_.size());
  }
  int power_column(int power) const { return attitude_count_ + power - 1; }
  int rate_column(RateTerm rate) const {
    return attitude_count_ + ThermalOptions::kMaxBiasOrder + static_cast<int>(rate);
  }
  // The column of knot k: the kink (v - v_k)+ or its square, the curve; each minus its value at
  // v_ref.
  int knot_column(int knot, bool curve) const {
    return attitude_count_ + kMaxThermalVectors + 2 * knot + (curve ? 1 : 0);
  }
  // SetKnots changes the columns of the knots.
  const std::vector<double>& knots_degc() const { return knots_degc_; }
  void SetKnots(std::vector<double> knots_degc);
  const std::vector<int>& fold_begin() const { return fold_begin_; }
  int fold_count() const { return static_cast<int>(fold_begin_.size()) - 1; }
  // Readings minus `origin`, a row per axis: sums of squares thus lose no digits to large offsets.
  const Eigen::Matrix3Xd& readings() const { return readings_; }
  const Eigen::Vector3d& origin() const { return origin_; }
  const Eigen::Matrix3Xd& noise_variance() const { return noise_variance_; }
  const Eigen::VectorXd& weights() const { return weights_; }  // their mean is 1
  const std::vector<int>& attitudes() const { return attitudes_; }
  const StaticPose& window(int i) const {
    return poses_.poses[window_[static_cast<std::size_t>(i)]];
  }
  // First and last place of window i in the temperature's track.
  std::pair<std::size_t, std::size_t> places(int i) const {
    const std::size_t k = window_[static_cast<std::size_t>(i)];
    return {poses_.sweep.first[k], poses_.sweep.last[k]};
  }
  const TemperatureTrack& temperature() const { return poses_.sweep.temperature; }
  Eigen::Vector2d rate_range_degcps() const;
  double duration_s() const;
  double spacing_s() const;  // of the temperature's track
  const ThermalScale& scale() const { return scale_; }

  // Temperature and rate of each window after the lags, a column each.
  Eigen::MatrixX2d States(const SweepLags& lags) const;
  // Ambient temperature and its rate in window i; NaN if they were not read.
  Eigen::Vector2d AmbientOf(int i) const;
  // All columns at these temperatures and rates.
  Eigen::MatrixXd Columns(const Eigen::MatrixX2d& states) const;
  // Sums of each fold. They are kept, so that they are computed only once for each pair of lags.
  const std::vector<SweepBlock>& Blocks(const SweepLags& lags);

  // The share of the RMS of a rate term's column that neither a function of temperature nor the
  // columns in `beside` explain.
  double ShareOfItsOwn(const Eigen::MatrixX2d& states,
                       RateTerm rate,
                       const std::vector<RateTerm>& beside) const;

 private:
  void WeighTemperatures(bool even_temperatures);

  const PoseSet& poses_;
  Triad triad_;
  std::vector<std::size_t> window_;
  std::vector<int> attitudes_;
  int attitude_count_ = 1;
  std::vector<int> fold_begin_;
  Eigen::Matrix3Xd readings_, noise_variance_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  Eigen::VectorXd weights_;
  ThermalScale scale_;
  std::vector<double> knots_degc_;
  std::map<SweepLags, std::vector<SweepBlock>> blocks_;
};

// The columns that `terms` use.
std::vector<int> ColumnsOf(const SweepProblem& problem, const ThermalOptions& terms);

}  // namespace truetriad
