// SPDX-License-Identifier: Apache-2.0
#include "problem/thermal_block.h"

namespace truetriad {

ThermalFactors ThermalScale::FactorsAt(double temperature_degc,
                                       double temperature_rate_degcps) const {
  const double v = (temperature_degc - centre_degc) / half_range_degc;
  const double v_ref = (reference_degc - centre_degc) / half_range_degc;
  ThermalFactors factors;
  // T_{i+1} = 2 v T_i - T_{i-1}, at v and at v_ref.
  double before = 1.0;
  double value = v;
  double before_ref = 1.0;
  double value_ref = v_ref;
  for (double& factor : factors.power) {
    factor = value - value_ref;
    const double next = 2.0 * v * value - before;
    before = value;
    value = next;
    const double next_ref = 2.0 * v_ref * value_ref - before_ref;
    before_ref = value_ref;
    value_ref = next_ref;
  }
  const double q = temperature_rate_degcps / rate_degcps;
  for (const RateTermInfo& info : kRateTerms) {
    factors.rate[info.term] = FactorOf(info.term, v - v_ref, q);
  }
  return factors;
}

Eigen::MatrixXd ThermalScale::PowersOfTau(int order) const {
  // Column i: coefficients of tau^0 … tau^order in T_i(v), v = v_ref + tau / half_range.
  const double v_ref = (reference_degc - centre_degc) / half_range_degc;
  Eigen::MatrixXd chebyshev = Eigen::MatrixXd::Zero(order + 1, order + 1);
  chebyshev(0, 0) = 1.0;
  for (int i = 1; i <= order; ++i) {
    const double twice = i == 1 ? 1.0 : 2.0;
    chebyshev.col(i) = twice * v_ref * chebyshev.col(i - 1);
    chebyshev.col(i).tail(order) += twice / half_range_degc * chebyshev.col(i - 1).head(order);
    if (i > 1) chebyshev.col(i) -= chebyshev.col(i - 2);
  }
  // The constant row is dropped: T_i(v) - T_i(v_ref) is zero at the reference.
  return chebyshev.bottomRightCorner(order, order);
}

std::array<double, kMaxThermalVectors> ThermalBlock::VectorFactors(
    const ThermalFactors& factors) const {
  std::array<double, kMaxThermalVectors> values{};
  std::size_t count = 0;
  while (count < static_cast<std::size_t>(terms.bias_order)) {
    values[count] = factors.power[count];
    ++count;
  }
  for (const RateTermInfo& info : kRateTerms) {
    if (terms.rate[info.term]) values[count++] = factors.rate[info.term];
  }
  return values;
}

void ThermalBlock::AddTerms(const ThermalFactors& factors,
                            const double* shared,
                            TriadModel<double>* model) const {
  const auto vector_factors = VectorFactors(factors);
  for (int i = 0; i < vector_count(); ++i) {
    model->bias += vector_factors[static_cast<std::size_t>(i)] *
                   Eigen::Map<const Eigen::Vector3d>(shared + vector_at(i));
  }
  for (int i = 0; i < terms.matrix_order; ++i) {
    model->sensitivity += factors.power[static_cast<std::size_t>(i)] *
                          Eigen::Map<const Eigen::Matrix3d>(shared + matrix_at(i));
  }
}

Eigen::MatrixXd ThermalBlock::ListedFromVectors(const ThermalScale& scale) const {
  Eigen::MatrixXd listed = Eigen::MatrixXd::Zero(vector_count(), vector_count());
  int i = terms.bias_order;
  listed.topLeftCorner(i, i) = scale.PowersOfTau(i);
  for (const RateTermInfo& info : kRateTerms) {
    if (!terms.rate[info.term]) continue;
    listed(i, i) = 1.0 / FactorOf(info.term, scale.half_range_degc, scale.rate_degcps);
    ++i;
  }
  return listed;
}

Eigen::MatrixXd ThermalBlock::ListedFromMatrices(const ThermalScale& scale) const {
  return scale.PowersOfTau(terms.matrix_order);
}

ThermalTerms ThermalBlock::TermsInTau(const ThermalScale& scale, const double* shared) const {
  ThermalTerms result;
  result.reference_degc = scale.reference_degc;
  const Eigen::MatrixXd vectors =
      Eigen::Map<const Eigen::Matrix3Xd>(shared + vector_at(0), 3, vector_count()) *
      ListedFromVectors(scale).transpose();
  int i = 0;
  while (i < terms.bias_order) result.bias.emplace_back(vectors.col(i++));
  for (const RateTermInfo& info : kRateTerms) {
    if (terms.rate[info.term]) result.rate[info.term] = vectors.col(i++);
  }
  const Eigen::MatrixXd matrices =
      Eigen::Map<const Eigen::MatrixXd>(shared + matrix_at(0), 9, terms.matrix_order) *
      ListedFromMatrices(scale).transpose();
  for (int m = 0; m < terms.matrix_order; ++m) {
    result.sensitivity.emplace_back(matrices.col(m).reshaped(3, 3));
  }
  return result;
}

}  // namespace truetriad
