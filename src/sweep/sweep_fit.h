// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "sweep/sweep_problem.h"

namespace truetriad {

// One axis fitted with given terms and lags.
struct SweepFit {
  ThermalOptions terms;
  SweepLags lags;
  std::vector<int> columns;
  Eigen::VectorXd coefficients;  // of the columns, then of the lags that are not zero
  Eigen::MatrixXd covariance;    // likewise
  Eigen::VectorXd residuals;
  double weighted_square = 0.0;  // sum of w r^2
  double correlation = 0.0;      // of neighbouring residuals
};

// Of neighbouring residuals in one attitude.
double CorrelationOf(const Eigen::VectorXd& residuals, const std::vector<int>& attitudes);

// Independent readings that `count` of them are worth.
double EffectiveCount(double count, double correlation);

// Sum of the products of the scores' rows, those of neighbours too.
Eigen::MatrixXd LongRunCovariance(const Eigen::MatrixXd& scores, double correlation);

// Weighted least squares of columns.
struct ColumnFit {
  Eigen::VectorXd coefficients, residuals;
  double weighted_square = 0.0;  // sum of w r^2
};
ColumnFit FitColumns(const Eigen::MatrixXd& columns,
                     const Eigen::VectorXd& readings,
                     const Eigen::VectorXd& weights);

// (X^T W X)^-1 Omega (X^T W X)^-1 of FitSweep; `count`: rows that weigh anything.
Eigen::MatrixXd SandwichCovariance(const Eigen::MatrixXd& columns,
                                   const Eigen::VectorXd& weights,
                                   const Eigen::VectorXd& residuals,
                                   const std::vector<int>& attitudes,
                                   int count);

using NoteError = std::function<void(const Eigen::VectorXd&)>;
using ForEachError = std::function<void(const NoteError&)>;

// The same where part of the residuals is what errors of the columns leave, of which this is known:
// `for_each_error` hands over each independent one, of 1 sigma. In place of what Omega makes of
// that part stands what it is:
//
//   Omega  -  sum_m Omega(W M e_m)  +  sum_m (X^T W e_m) (X^T W e_m)^T       M: what a fit leaves
//
// Some of it lasts so long that it looks like the columns, and hardly shows in the residuals. Not
// less than what the noise of the readings, `variances`, makes.
Eigen::MatrixXd SandwichCovariance(const Eigen::MatrixXd& columns,
                                   const Eigen::VectorXd& weights,
                                   const Eigen::VectorXd& residuals,
                                   const std::vector<int>& attitudes,
                                   const Eigen::VectorXd& variances,
                                   const ForEachError& for_each_error);

// Weighted least squares with the covariance of its estimate from the residuals themselves: the
// weights are no inverse variances, and neighbouring residuals hang together.
//
//   (X^T W X)^-1  Omega  (X^T W X)^-1     Omega: long-run covariance of w_i r_i x_i
//
// Omega is that of scores freed of their first-order correlation, with a Bartlett kernel, coloured
// again (Andrews and Monahan 1992). A lag's column is the derivative of the fit by it, so that what
// is not known about the lag is in the covariance of the terms.
//
// `with_thermometer`: the noise of the thermometer is in the covariance.
SweepFit FitSweep(const SweepProblem& problem,
                  int axis,
                  const ThermalOptions& terms,
                  const SweepLags& lags,
                  bool with_thermometer = false);

// Sum of w r^2 with these terms at any lags.
double WeightedSquareAt(const SweepProblem& problem,
                        int axis,
                        const ThermalOptions& terms,
                        const SweepLags& lags);

// The same from the blocks' sums alone; `but`: a fold left out, or -1.
double WeightedSquare(const std::vector<SweepBlock>& blocks,
                      const std::vector<int>& columns,
                      int axis,
                      int but);

// Sum of r^2 over a fold, predicted by the others. A constant that the others do not tell is taken
// from the fold itself.
double HeldOutSquare(const std::vector<SweepBlock>& blocks,
                     const std::vector<int>& columns,
                     int attitude_count,
                     int axis,
                     int fold);

// RMS over all windows, each predicted by the blocks of time that it is not in, at given lags.
double HeldOutRms(SweepProblem* problem,
                  int axis,
                  const ThermalOptions& terms,
                  const SweepLags& lags);

// Probability of so large an effect of the columns from `first` on if they had none, by their
// covariance.
double WaldProbability(const SweepFit& fit, const std::vector<int>& tested);

}  // namespace truetriad
