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
// Largest number of unknowns of these terms: 3 per bias term, 9 per power in the sensitivity.
inline constexpr int kMaxThermalSize = 3 * kMaxThermalVectors + 9 * ThermalOptions::kMaxMatrixOrder;

// No session: the bias is then the mean of the sessions.
inline constexpr int kNoSession = -1;

// Factors that multiply the terms of a triad at one pose: those of temperature terms, and the
// pose's session, from which those of session biases follow (session_block.h).
struct ThermalFactors {
  std::array<double, ThermalOptions::kMaxBiasOrder> power{};  // factor of the term for tau^i
  PerRateTerm<double> rate;
  int session = kNoSession;
};

// The variables of temperature terms: of size 1 over the poses, and zero at the reference, where
// bias and sensitivity are stated.
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

  // Column i - 1: coefficients of tau^1 … tau^order in power i. Upper triangular.
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

  // Factors of the vectors, in their order; those of the matrices are factors.power.
  std::array<double, kMaxThermalVectors> VectorFactors(const ThermalFactors& factors) const;

  // Adds the terms at `shared` to the model at the reference.
  void AddTerms(const ThermalFactors& factors,
                const double* shared,
                TriadModel<double>* model) const;

  // Row i: coefficients of listed term i (bias tau^1, tau^2, …, rates) in the vectors, or for
  // sensitivities in the matrices. Listed terms are those of ThermalTerms.
  Eigen::MatrixXd ListedFromVectors(const ThermalScale& scale) const;
  Eigen::MatrixXd ListedFromMatrices(const ThermalScale& scale) const;

  // The terms in tau, without their range of validity.
  ThermalTerms TermsInTau(const ThermalScale& scale, const double* shared) const;
};

}  // namespace truetriad
