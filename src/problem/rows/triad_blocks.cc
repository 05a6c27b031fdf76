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
  blocks_.reserve(4 + vectors + matrices);
  terms_.reserve(4 + vectors + matrices);
  Add(Part::kBias, layout.bias[triad], 1.0);
  Add(Part::kSensitivity, layout.sensitivity[triad], 1.0);
  if (vectors > 0) {
    const auto vector_factors = thermal.VectorFactors(factors);
    for (std::size_t i = 0; i < vectors; ++i) {
      Add(Part::kBias, thermal.vector_at(static_cast<int>(i)), vector_factors[i]);
    }
  }
  for (std::size_t i = 0; i < matrices; ++i) {
    Add(Part::kSensitivity, thermal.matrix_at(static_cast<int>(i)), factors.power[i]);
  }
  if (layout.quadratic[triad] >= 0) Add(Part::kQuadratic, layout.quadratic[triad], 1.0);
  if (layout.asymmetry[triad] >= 0) Add(Part::kAsymmetry, layout.asymmetry[triad], 1.0);
}

void TriadBlocks::Add(Part part, int offset, double factor) {
  blocks_.push_back({offset, part == Part::kSensitivity ? 9 : 3});
  terms_.push_back({part, factor});
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
  by.quadratic = felt.cwiseAbs2().asDiagonal();
  by.asymmetry = felt.cwiseAbs().asDiagonal();
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
      case Part::kQuadratic:
        Set<3>(1.0, by.quadratic, jacobians[i]);
        break;
      case Part::kAsymmetry:
        Set<3>(1.0, by.asymmetry, jacobians[i]);
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
