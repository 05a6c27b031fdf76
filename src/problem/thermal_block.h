// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>

#include <Eigen/Core>

#include "truetriad/model/calibration.h"
#include "truetriad/model/triad_model.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Largest number of bias terms of a triad: powers of tau and three rates.
inline constexpr int kMaxThermalVectors =
    ThermalOptions::kMaxBiasOrder + static_cast<int>(kRateTermCount);
// Largest number of unknowns of a triad's temperature terms: 3 per bias term, 9 per power of tau in
// the sensitivity.
inline constexpr int kMaxThermalSize = 3 * kMaxThermalVectors + 9 * ThermalOptions::kMaxMatrixOrder;

// Stands for no session: the bias is then the mean over the sessions.
inline constexpr int kNoSession = -1;

// Factors that multiply the terms of a triad at one pose: the factors of temperature terms, and the
// session, which determines the factors of session biases (session_block.h).
struct ThermalFactors {
  std::array<double, ThermalOptions::kMaxBiasOrder>
      power{};  // [i - 1]: factor of the term for tau^i
  PerRateTerm<double> rate;
  int session = kNoSession;
};

// The scaled variables of temperature terms. They are of the order of 1 over the poses, and zero at
// the reference temperature, for which bias and sensitivity are stated.
//
//   power i   T_i(v) - T_i(v_ref)      T_i: Chebyshev polynomial,  v = (T - centre) / half_range
//   rates     of tau / half_range and q, terms.h                   q = T' / rate
//
// Powers of tau themselves are nearly collinear over a range: the normal equations of order 7 would
// have no significant digit.
struct ThermalScale {
  double reference_degc = 25.0;
  double centre_degc = 25.0;
  double half_range_degc = 1.0;
  double rate_degcps = 1.0;

  ThermalFactors FactorsAt(double temperature_degc, double temperature_rate_degcps) const;

  // Column i - 1: the coefficients of tau^1 … tau^order in the variable of power i. Upper
  // triangular.
  Eigen::MatrixXd PowersOfTau(int order) const;
};

// Places of the temperature terms of one triad in the shared vector, one after another:
//
//   bias         3 for each power      raw unit, scaled variables
//   rates        3 for each wanted     in the order of kRateTerms
//   sensitivity  9 for each power      column-major
struct ThermalBlock {
  int at = -1;
  ThermalOptions terms;

  int vector_count() const {
    return terms.bias_order +
           static_cast<int>(std::count(terms.rate.begin(), terms.rate.end(), true));
  }
  int size() const { return 3 * vector_count() + 9 * terms.matrix_order; }
  int vector_at(int i) const { return at + 3 * i; }
  int matrix_at(int i) const { return at + 3 * vector_count() + 9 * i; }

  // Factors of the block's vectors, in their order. The factors of its matrices are factors.power.
  std::array<double, kMaxThermalVectors> VectorFactors(const ThermalFactors& factors) const;

  // Adds the terms, with the values in `shared`, to a model at the reference temperature.
  void AddTerms(const ThermalFactors& factors,
                const double* shared,
                TriadModel<double>* model) const;

  // Row i expresses term i of ThermalTerms (tau^1, tau^2, … and, for the bias, rates) by this
  // block's vectors or, for the sensitivity, by its matrices.
  Eigen::MatrixXd ListedFromVectors(const ThermalScale& scale) const;
  Eigen::MatrixXd ListedFromMatrices(const ThermalScale& scale) const;

  // The terms in tau, without their range of validity.
  ThermalTerms TermsInTau(const ThermalScale& scale, const double* shared) const;
};

}  // namespace truetriad
