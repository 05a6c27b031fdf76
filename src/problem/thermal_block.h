// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>

#include <Eigen/Core>

#include "truetriad/model/calibration.h"
#include "truetriad/model/triad_model.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Bias terms of a triad that temperature and its rate may have: powers of tau and three rates.
inline constexpr int kMaxThermalVectors =
    ThermalOptions::kMaxBiasOrder + static_cast<int>(kRateTermCount);
inline constexpr int kMaxThermalSize = 3 * kMaxThermalVectors + 9 * ThermalOptions::kMaxMatrixOrder;

// No session in particular: biases are then the mean of the sessions.
inline constexpr int kNoSession = -1;

// What the terms of a triad are multiplied with at one pose: those of temperature, and through the
// session that the pose belongs to (session_block.h) those of the bias.
struct ThermalFactors {
  std::array<double, ThermalOptions::kMaxBiasOrder> power{};  // the terms that stand for tau^i
  PerRateTerm<double> rate;
  int session = kNoSession;
};

// The variables that temperature terms are solved in: of size 1 over the poses, and zero at the
// reference, so that bias and sensitivity are the values there.
//
//   power i   T_i(v) - T_i(v_ref)      T_i: Chebyshev polynomial,  v = (T - centre) / half_range
//   rates     of tau / half_range and q, terms.h                   q = T' / rate
//
// Powers of tau themselves are so alike over a range that the normal equations of order 7 would
// keep no digit.
struct ThermalScale {
  double reference_degc = 25.0;
  double centre_degc = 25.0;
  double half_range_degc = 1.0;
  double rate_degcps = 1.0;

  ThermalFactors FactorsAt(double temperature_degc, double temperature_rate_degcps) const;

  // Column i - 1: what power i holds of tau^1 … tau^order. Upper triangular.
  Eigen::MatrixXd PowersOfTau(int order) const;
};

// Where the temperature terms of one triad stand in the shared vector, one after another:
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

  // Rows i: what listed term i (bias tau^1, tau^2, …, rates) holds of each vector, and the same for
  // the matrices. Listed terms are those of ThermalTerms.
  Eigen::MatrixXd ListedFromVectors(const ThermalScale& scale) const;
  Eigen::MatrixXd ListedFromMatrices(const ThermalScale& scale) const;

  // The terms in tau; their range is not known here.
  ThermalTerms TermsInTau(const ThermalScale& scale, const double* shared) const;
};

}  // namespace truetriad
