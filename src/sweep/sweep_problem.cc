// SPDX-License-Identifier: Apache-2.0
#include "sweep/sweep_problem.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Core>

#include "math/dense/products.h"
#include "math/dense/qr.h"

namespace truetriad {
namespace {

// The half-width of the kernel that smooths the time spent at a temperature, as a share of the
// temperature range.
constexpr double kKernelShare = 1.0 / 20.0;
// The number of bins of the temperature range; the half-width of the kernel has 20 bins.
constexpr int kBins = 400;
// Least time at a temperature, as a share of the mean: it bounds the weight of a temperature at
// which the sweep spent hardly any time.
constexpr double kLeastDensity = 1.0 / 500.0;
// The number of straight pieces that represent an arbitrary function of temperature; each spans a
// tenth of the range.
constexpr int kPieces = 10;

// The temperature of an axis and its rate, after the axis' lags, over the whole track.
Eigen::MatrixX2d FilterTrack(const TemperatureTrack& track, const SweepLags& lags) {
  const auto size = static_cast<Eigen::Index>(track.time_s.size());
  Eigen::MatrixX2d states(size, 2);
  SweepFilter filter(lags);
  for (Eigen::Index i = 0; i < size; ++i) {
    const auto at = static_cast<std::size_t>(i);
    states.row(i) = filter.Next(track.time_s[at], track.degc[at], track.rate_degcps[at]);
  }
  return states;
}

}  // namespace

Eigen::Vector2d SweepFilter::Next(double time_s, double degc, double rate_degcps) {
  const double element = element_lag_.Next(time_s, degc);
  if (rate_lag_.lag_s() > 0.0) {
    return {element, (element - rate_lag_.Next(time_s, element)) / rate_lag_.lag_s()};
  }
  if (element_lag_.lag_s() > 0.0) return {element, (degc - element) / element_lag_.lag_s()};
  return {element, rate_degcps};
}

std::vector<SweepBlock> SumFolds(const std::vector<int>& fold_begin,
                                 const Eigen::MatrixXd& columns,
                                 const Eigen::MatrixX3d& readings,
                                 const Eigen::VectorXd& weights) {
  std::vector<SweepBlock> blocks;
  for (std::size_t f = 0; f + 1 < fold_begin.size(); ++f) {
    const int begin = fold_begin[f];
    const int rows = fold_begin[f + 1] - begin;
    const Eigen::MatrixXd X = columns.middleRows(begin, rows);
    const Eigen::VectorXd w = weights.segment(begin, rows);
    const Eigen::MatrixXd WX = w.asDiagonal() * X;
    const Eigen::MatrixX3d y = readings.middleRows(begin, rows);
    SweepBlock& block = blocks.emplace_back();
    block.weighted = X.transpose() * WX;
    block.plain = X.transpose() * X;
    block.weighted_right = WX.transpose() * y;
    block.plain_right = X.transpose() * y;
    for (int axis = 0; axis < 3; ++axis) {
      block.weighted_square[axis] = (w.array() * y.col(axis).array().square()).sum();
      block.plain_square[axis] = y.col(axis).squaredNorm();
    }
  }
  return blocks;
}

SweepProblem::SweepProblem(
    const PoseSet& poses, Triad triad, double reference_degc, bool even_temperatures, int folds)
    : poses_(poses), triad_(triad) {
  for (std::size_t k = 0; k < poses.poses.size(); ++k) {
    if (!poses.poses[k].triads[triad]) continue;
    window_.push_back(k);
    attitudes_.push_back(triad == Triad::kGyroscope ? 0 : poses.sweep.attitude[k]);
  }
  attitude_count_ =
      triad == Triad::kGyroscope ? 1 : static_cast<int>(poses.sweep.attitude_names.size());
  readings_.resize(3, size());
  noise_variance_.resize(3, size());
  double low = 1e300, high = -1e300, fastest = 0.0;
  for (int i = 0; i < size(); ++i) {
    const TriadPose& reading = *window(i).triads[triad];
    readings_.col(i) = reading.mean_raw;
    noise_variance_.col(i) = reading.mean_covariance_raw.diagonal();
    low = std::min(low, *window(i).temperature_degc);
    high = std::max(high, *window(i).temperature_degc);
    fastest = std::max(fastest, std::abs(window(i).temperature_rate_degcps));
  }
  origin_ = readings_.rowwise().mean();
  readings_.colwise() -= origin_;
  scale_.reference_degc = reference_degc;
  scale_.centre_degc = 0.5 * (low + high);
  scale_.half_range_degc = std::max(0.5 * (high - low), 1e-9);
  scale_.rate_degcps = std::max(fastest, 1e-12);
  const int blocks = std::clamp(folds, 2, std::max(2, size() / 2));
  for (int f = 0; f <= blocks; ++f) {
    fold_begin_.push_back(static_cast<int>(static_cast<std::int64_t>(size()) * f / blocks));
  }
  WeighTemperatures(even_temperatures);
}

Eigen::Vector2d SweepProblem::rate_range_degcps() const {
  Eigen::Vector2d range = Eigen::Vector2d::Zero();
  for (int i = 0; i < size(); ++i) {
    range[0] = std::min(range[0], window(i).temperature_rate_degcps);
    range[1] = std::max(range[1], window(i).temperature_rate_degcps);
  }
  return range;
}

double SweepProblem::duration_s() const {
  const std::vector<double>& time = poses_.sweep.temperature.time_s;
  return time.back() - time.front();
}

double SweepProblem::spacing_s() const {
  return duration_s() / static_cast<double>(poses_.sweep.temperature.time_s.size() - 1);
}

void SweepProblem::WeighTemperatures(bool even_temperatures) {
  weights_.resize(size());
  const auto samples = [&](int i) {
    return static_cast<double>(window(i).triads[triad_]->samples);
  };
  const auto bin = [&](int i) {
    const double v =
        (*window(i).temperature_degc - scale_.centre_degc) / scale_.half_range_degc;  // [-1, 1]
    return std::clamp(static_cast<int>(0.5 * (v + 1.0) * kBins), 0, kBins - 1);
  };
  Eigen::ArrayXd time = Eigen::ArrayXd::Zero(kBins);
  for (int i = 0; i < size(); ++i) time[bin(i)] += samples(i);
  constexpr int kReach = static_cast<int>(kKernelShare * kBins);
  const double least = kLeastDensity * time.sum() / kBins;
  Eigen::ArrayXd density(kBins);
  for (int b = 0; b < kBins; ++b) {
    double sum = 0.0, mass = 0.0;
    for (int c = std::max(0, b - kReach); c <= std::min(kBins - 1, b + kReach); ++c) {
      const double kernel = 1.0 - std::abs(b - c) / (kReach + 1.0);
      sum += kernel * time[c], mass += kernel;
    }
    density[b] = std::max(sum / mass, least);
  }
  for (int i = 0; i < size(); ++i) {
    weights_[i] = even_temperatures ? samples(i) / density[bin(i)] : samples(i);
  }
  weights_ /= weights_.mean();
}

Eigen::MatrixX2d SweepProblem::States(const SweepLags& lags) const {
  const Eigen::MatrixX2d track = FilterTrack(poses_.sweep.temperature, lags);
  Eigen::MatrixX2d states(size(), 2);
  for (int i = 0; i < size(); ++i) {
    const auto [first, last] = places(i);
    states.row(i) = track(Eigen::seq(first, last), Eigen::all).colwise().mean();
  }
  return states;
}

Eigen::MatrixXd SweepProblem::Columns(const Eigen::MatrixX2d& states) const {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(states.rows(), column_count());
  for (int i = 0; i < size(); ++i) {
    columns(i, attitudes_[static_cast<std::size_t>(i)]) = 1.0;
    const ThermalFactors factors = scale_.FactorsAt(states(i, 0), states(i, 1));
    for (int power = 1; power <= ThermalOptions::kMaxBiasOrder; ++power) {
      columns(i, power_column(power)) = factors.power[static_cast<std::size_t>(power) - 1];
    }
    for (const RateTermInfo& info : kRateTerms) {
      columns(i, rate_column(info.term)) = factors.rate[info.term];
    }
    for (std::size_t k = 0; k < knots_degc_.size(); ++k) {
      const auto above = [&](double degc) {
        return std::max(0.0, degc - knots_degc_[k]) / scale_.half_range_degc;
      };
      const double here = above(states(i, 0)), at_reference = above(scale_.reference_degc);
      const int knot = static_cast<int>(k);
      columns(i, knot_column(knot, false)) = here - at_reference;
      columns(i, knot_column(knot, true)) = here * here - at_reference * at_reference;
    }
  }
  return columns;
}

void SweepProblem::SetKnots(std::vector<double> knots_degc) {
  if (knots_degc == knots_degc_) return;
  knots_degc_ = std::move(knots_degc);
  blocks_.clear();
}

Eigen::Vector2d SweepProblem::AmbientOf(int i) const {
  const TemperatureTrack& ambient = poses_.sweep.ambient;
  if (ambient.empty()) return Eigen::Vector2d::Constant(std::nan(""));
  const auto [first, last] = places(i);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t at = first; at <= last; ++at) {
    sum += Eigen::Vector2d(ambient.degc[at], ambient.rate_degcps[at]);
  }
  return sum / static_cast<double>(last - first + 1);
}

const std::vector<SweepBlock>& SweepProblem::Blocks(const SweepLags& lags) {
  const auto known = blocks_.find(lags);
  if (known != blocks_.end()) return known->second;
  return blocks_
      .emplace(lags, SumFolds(fold_begin_, Columns(States(lags)), readings_.transpose(), weights_))
      .first->second;
}

double SweepProblem::ShareOfItsOwn(const Eigen::MatrixX2d& states,
                                   RateTerm rate,
                                   const std::vector<RateTerm>& beside) const {
  const Eigen::MatrixXd columns = Columns(states);
  // Hat functions, which span every piecewise linear function of temperature.
  Eigen::MatrixXd others =
      Eigen::MatrixXd::Zero(size(), kPieces + 1 + static_cast<Eigen::Index>(beside.size()));
  const double low = states.col(0).minCoeff();
  const double step = std::max((states.col(0).maxCoeff() - low) / kPieces, 1e-9);
  for (int i = 0; i < size(); ++i) {
    const double place = std::clamp((states(i, 0) - low) / step, 0.0, kPieces - 1e-9);
    const auto piece = static_cast<Eigen::Index>(place);
    others(i, piece) = 1.0 - (place - static_cast<double>(piece));
    others(i, piece + 1) = place - static_cast<double>(piece);
  }
  for (std::size_t b = 0; b < beside.size(); ++b) {
    others.col(kPieces + 1 + static_cast<Eigen::Index>(b)) = columns.col(rate_column(beside[b]));
  }
  const Eigen::VectorXd root = weights_.cwiseSqrt();
  const Eigen::VectorXd own = root.asDiagonal() * columns.col(rate_column(rate));
  const Eigen::MatrixXd weighted = root.asDiagonal() * others;
  const Eigen::VectorXd left = own - TimesVector(weighted, LeastSquares(weighted).SolveVector(own));
  return own.norm() > 0.0 ? left.norm() / own.norm() : 0.0;
}

std::vector<int> ColumnsOf(const SweepProblem& problem, const ThermalOptions& terms) {
  std::vector<int> columns;
  for (int a = 0; a < problem.attitude_count(); ++a) columns.push_back(a);
  for (int power = 1; power <= terms.bias_order; ++power) {
    columns.push_back(problem.power_column(power));
  }
  for (const RateTermInfo& info : kRateTerms) {
    if (terms.rate[info.term]) columns.push_back(problem.rate_column(info.term));
  }
  if (terms.knots_degc.empty()) return columns;
  for (int knot = 0; knot < static_cast<int>(problem.knots_degc().size()); ++knot) {
    if (!terms.smooth_knots) columns.push_back(problem.knot_column(knot, false));
    columns.push_back(problem.knot_column(knot, true));
  }
  return columns;
}

}  // namespace truetriad
