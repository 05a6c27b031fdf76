// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "sweep/sweep_problem.h"

namespace truetriad {

// The result of fitting one axis with given terms and lags.
struct SweepFit {
  ThermalOptions terms;
  SweepLags lags;
  std::vector<int> columns;
  Eigen::VectorXd coefficients;  // of the columns, then of the lags that are not zero
  Eigen::MatrixXd covariance;    // of `coefficients`
  Eigen::VectorXd residuals;
  double weighted_square = 0.0;  // sum of w r^2
  double correlation = 0.0;      // of neighbouring residuals
};

// The correlation of neighbouring residuals in the same attitude.
double CorrelationOf(const Eigen::VectorXd& residuals, const std::vector<int>& attitudes);

// The number of independent readings that have as much information as `count` correlated readings.
double EffectiveCount(double count, double correlation);

// Long-run covariance of the scores: products of each row with itself and with neighbouring rows.
Eigen::MatrixXd LongRunCovariance(const Eigen::MatrixXd& scores, double correlation);

// Weighted least squares of columns.
struct ColumnFit {
  Eigen::VectorXd coefficients, residuals;
  double weighted_square = 0.0;  // sum of w r^2
};
ColumnFit FitColumns(const Eigen::MatrixXd& columns,
                     const Eigen::VectorXd& readings,
                     const Eigen::VectorXd& weights);

// The covariance (X^T W X)^-1 Omega (X^T W X)^-1 of FitSweep; `count`: rows of non-zero weight.
Eigen::MatrixXd SandwichCovariance(const Eigen::MatrixXd& columns,
                                   const Eigen::VectorXd& weights,
                                   const Eigen::VectorXd& residuals,
                                   const std::vector<int>& attitudes,
                                   int count);

using NoteError = std::function<void(const Eigen::VectorXd&)>;
using ForEachError = std::function<void(const NoteError&)>;

// As above, for residuals that include errors of the columns with known covariance.
// `for_each_error` passes each independent error e_m, taken as 1 sigma. In Omega the known effect
// of these errors replaces the estimated one:
//
//   Omega  -  sum_m Omega(W M e_m)  +  sum_m (X^T W e_m) (X^T W e_m)^T       M: residuals of a fit
//
// The reason: errors that last so long that they look like the columns hardly show in the
// residuals. The first two terms together are at least the effect of the readings' noise,
// `variances`.
Eigen::MatrixXd SandwichCovariance(const Eigen::MatrixXd& columns,
                                   const Eigen::VectorXd& weights,
                                   const Eigen::VectorXd& residuals,
                                   const std::vector<int>& attitudes,
                                   const Eigen::VectorXd& variances,
                                   const ForEachError& for_each_error);

// Weighted least squares. The covariance of the estimate is taken from the residuals, since the
// weights are not inverse variances and neighbouring residuals are correlated:
//
//   (X^T W X)^-1  Omega  (X^T W X)^-1     Omega: long-run covariance of w_i r_i x_i
//
// Omega is estimated from scores whitened to first order, with a Bartlett kernel, and recoloured
// (Andrews and Monahan 1992). The derivative of the fit by a lag is a further column, so that the
// lag's uncertainty is part of the terms' covariance.
//
// `with_thermometer`: the covariance includes the noise of the thermometer.
SweepFit FitSweep(const SweepProblem& problem,
                  int axis,
                  const ThermalOptions& terms,
                  const SweepLags& lags,
                  bool with_thermometer = false);

// Sum of w r^2 of a least-squares fit with these terms and lags.
double WeightedSquareAt(const SweepProblem& problem,
                        int axis,
                        const ThermalOptions& terms,
                        const SweepLags& lags);

// WeightedSquareAt, computed from the sums of the blocks alone. `but`: the fold that is left out,
// or -1 for none.
double WeightedSquare(const std::vector<SweepBlock>& blocks,
                      const std::vector<int>& columns,
                      int axis,
                      int but);

// The sum of r^2 over a fold that is predicted from the other folds. If these do not determine the
// constant of an attitude, it is taken from the fold itself.
double HeldOutSquare(const std::vector<SweepBlock>& blocks,
                     const std::vector<int>& columns,
                     int attitude_count,
                     int axis,
                     int fold);

// The RMS of the residuals of all windows at given lags. Each residual is from a fit without the
// fold of its window.
double HeldOutRms(SweepProblem* problem,
                  int axis,
                  const ThermalOptions& terms,
                  const SweepLags& lags);

// The p-value of the joint effect of the columns `tested`: Wald's F from their covariance.
double WaldProbability(const SweepFit& fit, const std::vector<int>& tested);

}  // namespace truetriad
