// SPDX-License-Identifier: Apache-2.0
#include "verdict/own_residuals.h"

#include <algorithm>
#include <cmath>

#include "math/distributions.h"

namespace truetriad {
namespace {

// What scatters without what explains everything, of what scatters with it.
constexpr double kLeastLeft = 1e-3;

bool IsOf(NoiseComponent component, Triad triad) {
  if (component == PoseNoise(triad)) return true;
  return triad == Triad::kGyroscope && !TriadOf(component);
}

}  // namespace

double OwnResiduals::LeftWithout(double part) const {
  return std::max(chi2 - part, kLeastLeft * chi2);
}

double OwnResiduals::ChanceOf(double part, int rank) const {
  if (rank == 0) return 1.0;
  if (!IsJudgedByRest(rank)) return 1.0 - ChiSquareCdf(part, rank);
  const double left = dof - rank;
  return 1.0 - FisherCdf(part / rank / (LeftWithout(part) / left), rank, left);
}

double OwnResiduals::ChanceBeside(double part, int rank, const OwnResiduals& left) const {
  if (rank == 0) return 1.0;
  if (!IsJudgedByRest(rank)) return ChanceOf(part, rank);
  // With less than one nothing can be held against it.
  if (!(left.dof >= 1.0)) return 1.0;
  return 1.0 - FisherCdf(part / rank / (left.chi2 / left.dof), rank, left.dof);
}

double OwnResiduals::VarianceWithout(double part, int rank) const {
  return IsJudgedByRest(rank) ? LeftWithout(part) / (dof - rank) : 1.0;
}

double OwnResiduals::LikelihoodOf(double part, int rank) const {
  return IsJudgedByRest(rank) ? dof * std::log1p(part / LeftWithout(part)) : part;
}

OwnResiduals OwnResidualsOf(const PoseGraph& graph,
                            const ReducedSystem& system,
                            const NoiseState& noise,
                            Triad triad,
                            double level,
                            bool of_poses,
                            const FittedBeside* beside) {
  OwnResiduals own;
  for (const VariancePart& part : PartsOf(graph)) {
    if (part.rejected || !IsOf(part.component, triad)) continue;
    if (of_poses && part.factor >= graph.nodes.size()) continue;
    const Eigen::Matrix3d variance = part.variance / part.weight;
    const Eigen::Index row = system.factors()[part.factor].row + part.row;
    Eigen::Vector3d projected = system.projected().segment<3>(row);
    own.dof += (system.ProjectorBlock(part.factor, part.row) * variance).trace();
    if (beside != nullptr) {
      const Eigen::MatrixXd columns = beside->projected.middleRows<3>(row);
      projected += columns * beside->step;
      own.dof -= (columns * beside->covariance * columns.transpose() * variance).trace();
    }
    own.chi2 += projected.dot(variance * projected);
  }
  own.is_estimated = own.dof > 1.0 && 1.0 - ChiSquareCdf(own.chi2, own.dof) < level;
  for (const NoiseComponent component : noise.estimated) {
    own.is_estimated =
        own.is_estimated || (IsOf(component, triad) && noise.excess[component] > 0.0);
  }
  return own;
}

}  // namespace truetriad
