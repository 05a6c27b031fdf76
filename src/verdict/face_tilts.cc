// SPDX-License-Identifier: Apache-2.0
#include "verdict/face_tilts.h"

#include <cmath>
#include <cstddef>
#include <numbers>

#include <Eigen/Eigenvalues>

#include "math/distributions.h"

namespace truetriad {
namespace {

constexpr double kRadPerDegree = std::numbers::pi / 180.0;
// Of the prior's variance, that readings take away at least where they tell of a tilt.
constexpr double kToldShare = 0.01;
constexpr double kTooSmallByChance = 0.1;

// Covariance of a face's tilts, by the free shared coordinates.
template <typename Rows>
Eigen::MatrixXd CovarianceOf(const Rows& rows, const ReducedSystem& system) {
  return rows * system.covariance() * rows.transpose();
}

}  // namespace

std::optional<TiltsSeen> TiltsAgainstStated(const PoseGraph& graph,
                                            const ReducedSystem& system,
                                            const AttitudeOptions& attitudes) {
  const SharedLayout& layout = graph.layout;
  std::vector<int> tilts;
  for (const int tilt : layout.face_tilt) {
    if (tilt >= 0) tilts.insert(tilts.end(), {tilt, tilt + 1});
  }
  const bool is_known = system.size() > 0 && system.rank() == system.size();
  if (tilts.empty() || !is_known) return std::nullopt;
  const double stated_rad = attitudes.tilt_sigma_deg * kRadPerDegree;
  const Eigen::MatrixXd covariance = CovarianceOf(layout.basis(tilts, Eigen::all), system);
  const auto count = static_cast<Eigen::Index>(tilts.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> told(
      stated_rad * stated_rad * Eigen::MatrixXd::Identity(count, count) - covariance);
  const Eigen::VectorXd seen = told.eigenvectors().transpose() * graph.shared(tilts);
  double chi2 = 0.0;
  int dof = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const double variance = told.eigenvalues()[i];
    if (!(variance > kToldShare * stated_rad * stated_rad)) continue;
    chi2 += seen[i] * seen[i] / variance;
    ++dof;
  }
  if (dof == 0) return std::nullopt;
  return TiltsSeen{
      1.0 - ChiSquareCdf(chi2, dof),
      attitudes.tilt_sigma_deg * std::sqrt(chi2 / ChiSquareQuantile(kTooSmallByChance, dof))};
}

Eigen::MatrixXd TiltCurvature(const PoseGraph& graph, const ReducedSystem& system) {
  const SharedLayout& layout = graph.layout;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(system.size(), system.size());
  if (system.size() == 0 || system.rank() < system.size()) return sum;
  for (std::size_t face = 0; face < layout.face_tilt.size(); ++face) {
    const int tilt = layout.face_tilt[face];
    if (tilt < 0) continue;
    // t^2 / 2 with t ~ N(0, P): mean trace(P) / 2, and as much again about it.
    const double less =
        std::sqrt(0.5) * CovarianceOf(layout.basis.middleRows<2>(tilt), system).trace();
    StackedRows change = StackedRows::Zero(system.residual().size(), 1);
    for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
      const PoseNode& node = graph.nodes[k];
      if (node.face != static_cast<int>(face)) continue;
      for (std::size_t i = 0; i < node.observations.size(); ++i) {
        const Observation& seen = node.observations[i];
        if (seen.triad != Triad::kAccelerometer || seen.rejected) continue;
        change.block<3, 1>(system.factors()[k].row + 3 * static_cast<Eigen::Index>(i), 0) =
            less *
            (seen.mean_raw - node.ModelOfTriad(layout, graph.shared.data(), seen.triad).bias);
      }
    }
    const Eigen::VectorXd moved = system.covariance() * (system.B().transpose() * change.col(0));
    sum += moved * moved.transpose();
  }
  return sum;
}

}  // namespace truetriad
