// SPDX-License-Identifier: Apache-2.0
#include "sweep/sweep_fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Core>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "math/dense/qr.h"
#include "math/distributions.h"

namespace truetriad {
namespace {

// The largest correlation of neighbouring residuals that is assumed; with it, 66 residuals count as
// one.
constexpr double kMostCorrelation = 0.97;
// Step of a lag's central difference, as a share of the lag: the error is of order 1e-6.
constexpr double kLagStep = 1e-3;
// Temperature errors are subtracted from Omega if they are a larger share of a variance than this;
// a smaller share changes a σ by at most 1 %.
constexpr double kErrorsMatter = 0.02;
// After so many lags, a filter retains exp(-10) of an input, one part in 20,000.
constexpr double kForgotten = 10.0;
// Step of central differences, as a share of half the range and of the fastest rate: their error is
// of order 1e-8.
constexpr double kSlopeStep = 1e-4;

// The normal equations of the chosen columns, summed over all blocks except one.
struct NormalEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;
  double square = 0.0;
};

NormalEquations SumOf(const std::vector<SweepBlock>& blocks,
                      const std::vector<int>& columns,
                      int axis,
                      int but) {
  const auto size = static_cast<Eigen::Index>(columns.size());
  NormalEquations sum{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size), 0.0};
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (static_cast<int>(b) == but) continue;
    sum.right += blocks[b].weighted_right(columns, axis);
    sum.matrix.triangularView<Eigen::Lower>() += blocks[b].weighted(columns, columns);
    sum.square += blocks[b].weighted_square[axis];
  }
  sum.matrix.triangularView<Eigen::StrictlyUpper>() = sum.matrix.transpose();
  // If an attitude has no window, its constant is undetermined and becomes zero.
  for (Eigen::Index i = 0; i < size; ++i) {
    if (sum.matrix(i, i) == 0.0) sum.matrix(i, i) = 1.0;
  }
  return sum;
}

// Derivatives of each window's fitted reading by its temperature and by its rate.
Eigen::MatrixX2d Slopes(const SweepProblem& problem, const SweepFit& fit) {
  const Eigen::MatrixX2d states = problem.States(fit.lags);
  Eigen::MatrixX2d slopes(states.rows(), 2);
  const Eigen::RowVector2d steps(kSlopeStep * problem.scale().half_range_degc,
                                 kSlopeStep * problem.scale().rate_degcps);
  const auto fitted_at = [&](const Eigen::MatrixX2d& moved) {
    return TimesVector(problem.Columns(moved)(Eigen::all, fit.columns),
                       fit.coefficients.head(std::ssize(fit.columns)));
  };
  for (Eigen::Index which = 0; which < 2; ++which) {
    Eigen::MatrixX2d more = states, less = states;
    more.col(which).array() += steps[which];
    less.col(which).array() -= steps[which];
    slopes.col(which) = (fitted_at(more) - fitted_at(less)) / (2.0 * steps[which]);
  }
  return slopes;
}

// For each independent part of the thermometer's noise, taken as 1 sigma: passes to `note` the
// errors that it causes in all windows' fitted readings, to first order. Errors of temperature and
// rate pass through the fit's lags. Parts are handled one by one, since all together may exceed the
// memory.
void ForEachTemperatureError(const SweepProblem& problem,
                             const SweepFit& fit,
                             const NoteError& note) {
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
    // `noise.first` never decreases.
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

}  // namespace

double CorrelationOf(const Eigen::VectorXd& residuals, const std::vector<int>& attitudes) {
  double products = 0.0;
  for (Eigen::Index i = 1; i < residuals.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (attitudes[at] == attitudes[at - 1]) products += residuals[i] * residuals[i - 1];
  }
  const double squares = residuals.squaredNorm();
  return squares > 0.0 ? products / squares : 0.0;
}

Eigen::MatrixXd LongRunCovariance(const Eigen::MatrixXd& scores, double correlation) {
  const Eigen::Index rows = scores.rows();
  const double limit = 2.0 / std::sqrt(static_cast<double>(rows));
  const double rho = correlation > limit ? std::min(correlation, kMostCorrelation) : 0.0;
  if (rho == 0.0) return TransposeTimes(scores, scores);
  const Eigen::MatrixXd freed = scores.bottomRows(rows - 1) - rho * scores.topRows(rows - 1);
  Eigen::MatrixXd sum = TransposeTimes(freed, freed);
  const auto reach =
      static_cast<Eigen::Index>(4.0 * std::pow(static_cast<double>(rows) / 100.0, 2.0 / 9.0));
  for (Eigen::Index lag = 1; lag <= reach; ++lag) {
    const Eigen::MatrixXd product =
        TransposeTimes(freed.bottomRows(freed.rows() - lag), freed.topRows(freed.rows() - lag));
    const double share = 1.0 - static_cast<double>(lag) / static_cast<double>(reach + 1);
    sum += share * (product + product.transpose());
  }
  return sum / ((1.0 - rho) * (1.0 - rho));
}

double EffectiveCount(double count, double correlation) {
  const double rho = std::clamp(correlation, 0.0, kMostCorrelation);
  return count * (1.0 - rho) / (1.0 + rho);
}

ColumnFit FitColumns(const Eigen::MatrixXd& columns,
                     const Eigen::VectorXd& readings,
                     const Eigen::VectorXd& weights) {
  ColumnFit fit;
  const Eigen::VectorXd root = weights.cwiseSqrt();
  fit.coefficients =
      LeastSquares(ScaledRows(root, columns)).SolveVector(root.cwiseProduct(readings));
  fit.residuals = readings - TimesVector(columns, fit.coefficients);
  fit.weighted_square = (weights.array() * fit.residuals.array().square()).sum();
  return fit;
}

Eigen::MatrixXd SandwichCovariance(const Eigen::MatrixXd& columns,
                                   const Eigen::VectorXd& weights,
                                   const Eigen::VectorXd& residuals,
                                   const std::vector<int>& attitudes,
                                   int count) {
  // All columns are scaled to size 1, since the column of a lag may be far smaller than the other
  // columns.
  const Eigen::VectorXd size = columns.colwise().norm().transpose().cwiseMax(1e-300);
  const Eigen::MatrixXd scaled = columns * size.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd inverse =
      PivotedCholesky(TransposeTimes(ScaledRows(weights, scaled), scaled)).Inverse();
  const Eigen::VectorXd weighted_residuals = weights.cwiseProduct(residuals);
  const Eigen::MatrixXd scores = ScaledRows(weighted_residuals, scaled);
  const auto n = static_cast<double>(count);
  const double few = n / std::max(1.0, n - static_cast<double>(columns.cols()));
  const Eigen::MatrixXd covariance =
      Times(Times(few * inverse, LongRunCovariance(scores, CorrelationOf(residuals, attitudes))),
            inverse);
  return ScaledBothSides(size.cwiseInverse(), covariance);
}

Eigen::MatrixXd SandwichCovariance(const Eigen::MatrixXd& columns,
                                   const Eigen::VectorXd& weights,
                                   const Eigen::VectorXd& residuals,
                                   const std::vector<int>& attitudes,
                                   const Eigen::VectorXd& variances,
                                   const ForEachError& for_each_error) {
  const Eigen::VectorXd size = columns.colwise().norm().transpose().cwiseMax(1e-300);
  const Eigen::MatrixXd scaled = columns * size.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd weighted = ScaledRows(weights, scaled);
  const PivotedCholesky normal(TransposeTimes(scaled, weighted));
  const double correlation = CorrelationOf(residuals, attitudes);
  const auto omega = [&](const Eigen::VectorXd& left) {
    return LongRunCovariance(ScaledRows(left, weighted), correlation);
  };
  Eigen::MatrixXd told = Eigen::MatrixXd::Zero(columns.cols(), columns.cols());
  for_each_error([&](const Eigen::VectorXd& error) {
    const Eigen::VectorXd one = TransposeTimesVector(weighted, error);
    told += one * one.transpose();
  });
  Eigen::MatrixXd others = omega(residuals);
  const bool matters = (told.diagonal().array() > kErrorsMatter * others.diagonal().array()).any();
  if (matters) {
    for_each_error([&](const Eigen::VectorXd& error) {
      const Eigen::VectorXd right = TransposeTimesVector(weighted, error);
      others -= omega(error - TimesVector(scaled, normal.SolveVector(right)));
    });
  }
  // `others` must be at least the effect of the readings' own noise. If it is smaller, it is raised
  // to that effect.
  const Cholesky root(TransposeTimes(ScaledRows(variances, weighted), weighted));
  if (matters && root.is_positive()) {
    const SymmetricEigen eigen =
        EigenOfSymmetric(root.SolveLower(root.SolveLower(others).transpose()));
    const Eigen::MatrixXd vectors = Times(root.Root(), eigen.vectors);
    others = TimesTranspose(vectors * eigen.values.cwiseMax(1.0).asDiagonal(), vectors);
  }
  const auto n = static_cast<double>(columns.rows());
  const double few = n / std::max(1.0, n - static_cast<double>(columns.cols()));
  const Eigen::MatrixXd inverse = normal.Inverse();
  const Eigen::MatrixXd covariance = Times(Times(inverse, few * others + told), inverse);
  return ScaledBothSides(size.cwiseInverse(), covariance);
}

SweepFit FitSweep(const SweepProblem& problem,
                  int axis,
                  const ThermalOptions& terms,
                  const SweepLags& lags,
                  bool with_thermometer) {
  SweepFit fit;
  fit.terms = terms;
  fit.lags = lags;
  fit.columns = ColumnsOf(problem, terms);
  const auto columns_at = [&](const SweepLags& at) -> Eigen::MatrixXd {
    return problem.Columns(problem.States(at))(Eigen::all, fit.columns);
  };
  const Eigen::MatrixXd X = columns_at(lags);
  ColumnFit plain = FitColumns(X, problem.readings().row(axis).transpose(), problem.weights());
  fit.residuals = std::move(plain.residuals);
  fit.weighted_square = plain.weighted_square;
  fit.correlation = CorrelationOf(fit.residuals, problem.attitudes());
  // The derivatives of the fitted readings by the coefficients.
  const int lag_count = (lags.element_s > 0.0 ? 1 : 0) + (lags.rate_s > 0.0 ? 1 : 0);
  Eigen::MatrixXd derivatives(X.rows(), X.cols() + lag_count);
  derivatives.leftCols(X.cols()) = X;
  fit.coefficients.resize(derivatives.cols());
  fit.coefficients.head(X.cols()) = plain.coefficients;
  Eigen::Index column = X.cols();
  for (double SweepLags::*const lag : {&SweepLags::element_s, &SweepLags::rate_s}) {
    if (!(lags.*lag > 0.0)) continue;
    SweepLags more = lags, less = lags;
    more.*lag *= 1.0 + kLagStep;
    less.*lag *= 1.0 - kLagStep;
    const Eigen::MatrixXd change = columns_at(more) - columns_at(less);
    derivatives.col(column) = change * plain.coefficients / (2.0 * kLagStep * lags.*lag);
    fit.coefficients[column++] = lags.*lag;
  }
  const Eigen::VectorXd& weights = problem.weights();
  const std::vector<int>& attitudes = problem.attitudes();
  fit.covariance =
      with_thermometer
          ? SandwichCovariance(
                derivatives,
                weights,
                fit.residuals,
                attitudes,
                problem.noise_variance().row(axis).transpose(),
                [&](const NoteError& note) { ForEachTemperatureError(problem, fit, note); })
          : SandwichCovariance(derivatives, weights, fit.residuals, attitudes, problem.size());
  return fit;
}

double WeightedSquareAt(const SweepProblem& problem,
                        int axis,
                        const ThermalOptions& terms,
                        const SweepLags& lags) {
  const Eigen::VectorXd root = problem.weights().cwiseSqrt();
  const Eigen::MatrixXd X = ScaledRows(
      root, problem.Columns(problem.States(lags))(Eigen::all, ColumnsOf(problem, terms)));
  const Eigen::VectorXd y = root.cwiseProduct(problem.readings().row(axis).transpose());
  const Eigen::VectorXd solved =
      PivotedCholesky(TransposeTimes(X, X)).SolveVector(TransposeTimesVector(X, y));
  return (y - TimesVector(X, solved)).squaredNorm();
}

double WeightedSquare(const std::vector<SweepBlock>& blocks,
                      const std::vector<int>& columns,
                      int axis,
                      int but) {
  const NormalEquations sum = SumOf(blocks, columns, axis, but);
  return sum.square - sum.right.dot(PivotedCholesky(sum.matrix).SolveVector(sum.right));
}

double HeldOutSquare(const std::vector<SweepBlock>& blocks,
                     const std::vector<int>& columns,
                     int attitude_count,
                     int axis,
                     int fold) {
  const NormalEquations others = SumOf(blocks, columns, axis, fold);
  Eigen::VectorXd solved = PivotedCholesky(others.matrix).SolveVector(others.right);
  const SweepBlock& own = blocks[static_cast<std::size_t>(fold)];
  const Eigen::MatrixXd matrix = own.plain(columns, columns);
  const Eigen::VectorXd right = own.plain_right(columns, axis);
  for (Eigen::Index a = 0; a < attitude_count; ++a) {
    bool is_told = false;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      is_told = is_told || (static_cast<int>(b) != fold && blocks[b].plain(a, a) > 0.0);
    }
    if (is_told || !(matrix(a, a) > 0.0)) continue;
    solved[a] = 0.0;
    solved[a] = (right[a] - matrix.row(a).dot(solved)) / matrix(a, a);
  }
  return own.plain_square[axis] - 2.0 * solved.dot(right) + QuadraticForm(matrix, solved);
}

double HeldOutRms(SweepProblem* problem,
                  int axis,
                  const ThermalOptions& terms,
                  const SweepLags& lags) {
  const std::vector<SweepBlock>& blocks = problem->Blocks(lags);
  const std::vector<int> columns = ColumnsOf(*problem, terms);
  double sum = 0.0;
  for (int fold = 0; fold < problem->fold_count(); ++fold) {
    sum += HeldOutSquare(blocks, columns, problem->attitude_count(), axis, fold);
  }
  return std::sqrt(std::max(sum, 0.0) / problem->size());
}

double WaldProbability(const SweepFit& fit, const std::vector<int>& tested) {
  std::vector<Eigen::Index> places;
  for (std::size_t j = 0; j < fit.columns.size(); ++j) {
    if (std::find(tested.begin(), tested.end(), fit.columns[j]) != tested.end()) {
      places.push_back(static_cast<Eigen::Index>(j));
    }
  }
  if (places.empty()) return 1.0;
  const auto size = static_cast<Eigen::Index>(places.size());
  const Eigen::VectorXd effect = fit.coefficients(places);
  const Eigen::MatrixXd covariance = fit.covariance(places, places);
  const double wald =
      effect.dot(PivotedCholesky(covariance).SolveVector(effect)) / static_cast<double>(size);
  const double dof =
      std::max(1.0,
               EffectiveCount(static_cast<double>(fit.residuals.size()), fit.correlation) -
                   static_cast<double>(fit.columns.size()));
  if (!(wald > 0.0)) return 1.0;
  return 1.0 - FisherCdf(wald, static_cast<double>(size), dof);
}

}  // namespace truetriad
