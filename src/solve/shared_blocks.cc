// SPDX-License-Identifier: Apache-2.0
#include "solve/shared_blocks.h"

namespace truetriad {
namespace {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

void AddTriadBlocks(const SharedLayout& layout, Triad triad, std::vector<SharedBlock>* blocks) {
  if (!layout.Has(triad)) return;
  blocks->push_back({layout.bias[triad], 3});
  blocks->push_back({layout.sensitivity[triad], 9});
  const ThermalBlock& thermal = layout.thermal[triad];
  if (thermal.size() > 0) blocks->push_back({thermal.at, thermal.size()});
  for (const int at : {layout.quadratic[triad], layout.asymmetry[triad]}) {
    if (at >= 0) blocks->push_back({at, 3});
  }
  if (triad == Triad::kGyroscope && layout.g_sensitivity >= 0) {
    blocks->push_back({layout.g_sensitivity, 9});
  }
}

}  // namespace

std::vector<SharedBlock> GyroscopeBlocks(const SharedLayout& layout) {
  std::vector<SharedBlock> blocks;
  AddTriadBlocks(layout, Triad::kGyroscope, &blocks);
  // The heading of the earth's rate.
  if (layout.CountsEarthRate()) blocks.push_back({layout.reference, kReferenceSize});
  return blocks;
}

std::vector<SharedBlock> SharedBlocks(const SharedLayout& layout) {
  std::vector<SharedBlock> blocks;
  for (const Triad triad : kTriads) AddTriadBlocks(layout, triad, &blocks);
  blocks.push_back({layout.reference, kReferenceSize});
  for (const int tilt : layout.face_tilt) {
    if (tilt >= 0) blocks.push_back({tilt, 2});
  }
  return blocks;
}

bool LinearManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  Eigen::Map<Eigen::VectorXd>(x_plus_delta, basis_.rows()) =
      Eigen::Map<const Eigen::VectorXd>(x, basis_.rows()) +
      basis_ * Eigen::Map<const Eigen::VectorXd>(delta, basis_.cols());
  return true;
}

bool LinearManifold::PlusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<RowMajorMatrix>(jacobian, basis_.rows(), basis_.cols()) = basis_;
  return true;
}

bool LinearManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<Eigen::VectorXd>(y_minus_x, basis_.cols()) =
      basis_.transpose() * (Eigen::Map<const Eigen::VectorXd>(y, basis_.rows()) -
                            Eigen::Map<const Eigen::VectorXd>(x, basis_.rows()));
  return true;
}

bool LinearManifold::MinusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<RowMajorMatrix>(jacobian, basis_.cols(), basis_.rows()) = basis_.transpose();
  return true;
}

}  // namespace truetriad
