// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/triad_blocks.h"

namespace truetriad {
namespace {

template <int kColumns>
void Set(double factor, const Eigen::Matrix<double, 3, kColumns>& by_part, double* jacobian) {
  Eigen::Map<Eigen::Matrix<double, 3, kColumns, Eigen::RowMajor>> out(jacobian);
  out = factor * by_part;
}

}  // namespace

TriadBlocks::TriadBlocks(const SharedLayout& layout, Triad triad, const ThermalFactors& factors) {
  const ThermalBlock& thermal = layout.thermal[triad];
  const auto vectors = static_cast<std::size_t>(thermal.vector_count());
  const auto matrices = static_cast<std::size_t>(thermal.terms.matrix_order);
  const auto& axis_terms = layout.axis_terms[triad];
  const SessionBlock& sessions = layout.sessions[triad];
  terms_.reserve(2 + vectors + matrices + axis_terms.size());
  terms_.push_back({layout.bias[triad], Part::kBias});
  terms_.push_back({layout.sensitivity[triad], Part::kSensitivity});
  if (vectors > 0) {
    const auto vector_factors = thermal.VectorFactors(factors);
    for (std::size_t i = 0; i < vectors; ++i) {
      terms_.push_back({thermal.vector_at(static_cast<int>(i)), Part::kBias, vector_factors[i]});
    }
  }
  for (std::size_t i = 0; i < matrices; ++i) {
    terms_.push_back(
        {thermal.matrix_at(static_cast<int>(i)), Part::kSensitivity, factors.power[i]});
  }
  for (int i = 0; i < sessions.block_count(); ++i) {
    const double factor = sessions.Factor(i, factors.session);
    if (factor != 0.0) terms_.push_back({sessions.block_at(i), Part::kBias, factor});
  }
  for (const auto& [term, at] : axis_terms) terms_.push_back({at, Part::kAxisTerm, 1.0, term});
}

std::vector<SharedBlock> TriadBlocks::blocks() const {
  std::vector<SharedBlock> blocks;
  blocks.reserve(terms_.size());
  for (const Term& term : terms_) {
    blocks.push_back({term.offset, term.part == Part::kSensitivity ? 9 : 3});
  }
  return blocks;
}

void TriadBlocks::SetFieldJacobians(const TriadModel<double>& model,
                                    const Eigen::Vector3d& field,
                                    double** jacobians) const {
  const Eigen::Vector3d felt = model.sensitivity * field;
  const Eigen::Vector3d slope = model.Slope(felt);
  ByParts by;
  by.bias.setIdentity();
  for (int axis = 0; axis < 3; ++axis) {
    by.sensitivity.middleCols<3>(3 * axis) = (field[axis] * slope).asDiagonal();
  }
  for (const Term& term : terms_) {
    if (term.part != Part::kAxisTerm) continue;
    by.axis_terms[term.axis_term] =
        felt.unaryExpr([&](double u) { return ValueOf(term.axis_term, u); }).asDiagonal();
  }
  SetJacobians(by, jacobians);
}

void TriadBlocks::SetJacobians(const ByParts& by, double** jacobians) const {
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    if (jacobians[i] == nullptr) continue;
    switch (terms_[i].part) {
      case Part::kBias:
        Set<3>(terms_[i].factor, by.bias, jacobians[i]);
        break;
      case Part::kSensitivity:
        Set<9>(terms_[i].factor, by.sensitivity, jacobians[i]);
        break;
      case Part::kAxisTerm:
        Set<3>(1.0, by.axis_terms[terms_[i].axis_term], jacobians[i]);
        break;
    }
  }
}

void SetMatrixTimesVector(const Eigen::Vector3d& vector, double* jacobian) {
  Eigen::Map<Eigen::Matrix<double, 3, 9, Eigen::RowMajor>> out(jacobian);
  for (int axis = 0; axis < 3; ++axis) {
    out.middleCols<3>(3 * axis) = vector[axis] * Eigen::Matrix3d::Identity();
  }
}

}  // namespace truetriad
