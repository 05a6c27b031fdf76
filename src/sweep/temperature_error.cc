// SPDX-License-Identifier: Apache-2.0
#include "sweep/temperature_error.h"

#include <algorithm>
#include <cmath>

#include "truetriad/model/thermal.h"

namespace truetriad {
namespace {

// A filter has forgotten after so many lags: a part in twenty thousand is left.
constexpr double kForgotten = 10.0;
// Step of the derivatives, as a share of the range and of the fastest rate.
constexpr double kStep = 1e-4;

// Change of the fitted reading of each window with its temperature and its rate.
Eigen::MatrixX2d Slopes(const SweepProblem& problem, const SweepFit& fit) {
  const Eigen::MatrixX2d states = problem.States(fit.lags);
  Eigen::MatrixX2d slopes(states.rows(), 2);
  const Eigen::RowVector2d steps(kStep * problem.scale().half_range_degc,
                                 kStep * problem.scale().rate_degcps);
  const auto fitted_at = [&](const Eigen::MatrixX2d& moved) {
    const Eigen::MatrixXd columns = problem.Columns(moved);
    Eigen::VectorXd fitted = Eigen::VectorXd::Zero(states.rows());
    for (std::size_t j = 0; j < fit.columns.size(); ++j) {
      fitted += fit.coefficients[static_cast<Eigen::Index>(j)] * columns.col(fit.columns[j]);
    }
    return fitted;
  };
  for (Eigen::Index which = 0; which < 2; ++which) {
    Eigen::MatrixX2d more = states, less = states;
    more.col(which).array() += steps[which];
    less.col(which).array() -= steps[which];
    slopes.col(which) = (fitted_at(more) - fitted_at(less)) / (2.0 * steps[which]);
  }
  return slopes;
}

}  // namespace

void ForEachTemperatureError(const SweepProblem& problem,
                             const SweepFit& fit,
                             const std::function<void(const Eigen::VectorXd&)>& note) {
  const TemperatureTrack& track = problem.temperature();
  const TemperatureNoise& noise = track.noise;
  if (noise.empty()) return;
  const Eigen::MatrixX2d slopes = Slopes(problem, fit);
  const std::size_t places = track.time_s.size(), blocks = noise.sigma_degc.size();
  const double forgotten_s = kForgotten * (fit.lags.element_s + fit.lags.rate_s);
  Eigen::VectorXd errors(problem.size());
  std::vector<Eigen::Vector2d> off(places);
  std::size_t begin = 0;
  int first_window = 0;
  for (std::size_t block = 0; block < blocks; ++block) {
    // `first` never goes down.
    while (begin < places && noise.first[begin] + noise.reach <= block) ++begin;
    if (begin == places) break;
    errors.setZero();
    SweepFilter filter(fit.lags);
    if (begin > 0) filter.Next(track.time_s[begin - 1], 0.0, 0.0);
    std::size_t end = begin;
    double last_s = track.time_s[begin];
    for (; end < places; ++end) {
      const bool reaches = noise.first[end] <= block;
      if (reaches) last_s = track.time_s[end];
      if (!reaches && track.time_s[end] > last_s + forgotten_s) break;
      const std::size_t at = end * noise.reach + (block - noise.first[end]);
      off[end] = filter.Next(track.time_s[end],
                             reaches ? static_cast<double>(noise.degc[at]) : 0.0,
                             reaches ? static_cast<double>(noise.rate[at]) : 0.0);
    }
    while (first_window < problem.size() && problem.places(first_window).second < begin) {
      ++first_window;
    }
    for (int i = first_window; i < problem.size(); ++i) {
      const auto [from, to] = problem.places(i);
      if (from >= end) break;
      Eigen::Vector2d sum = Eigen::Vector2d::Zero();
      for (std::size_t at = std::max(from, begin); at < std::min(to + 1, end); ++at) sum += off[at];
      errors[i] =
          noise.sigma_degc[block] * slopes.row(i).dot(sum) / static_cast<double>(to - from + 1);
    }
    note(errors);
  }
}

}  // namespace truetriad
