// SPDX-License-Identifier: Apache-2.0
#include "faults/face_curvatures.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"

namespace truetriad {
namespace {

// The least variance of a combination of curvatures, as a share of the largest. It is above zero,
// since the combination's information, the inverse of the variance, must be finite.
constexpr double kLeastCurvature = 1e-6;

// Second derivatives of readings S u on faces with respect to S and the tilts t of the face, in
// coordinates of unit covariance. u = g (a (1 - |t|^2 / 2) + E t), with the face's axis a and the
// two axes E across it. A face f has three readings, and so three matrices; first[f] is the first.
std::vector<Eigen::MatrixXd> CurvaturesOfFaces(const PoseGraph& graph,
                                               const Eigen::MatrixXd& covariance,
                                               std::array<Eigen::Index, kFaceCount>* first) {
  const SharedLayout& layout = graph.layout;
  const double gravity = WorldVector(Triad::kAccelerometer, graph.reference()).norm();
  const SymmetricEigen known = EigenOfSymmetric(covariance);
  const Eigen::MatrixXd moves =
      Times(layout.basis, known.vectors * known.values.cwiseMax(0.0).cwiseSqrt().asDiagonal());
  std::vector<Eigen::MatrixXd> curvatures;
  for (int face = 0; face < kFaceCount; ++face) {
    const auto at = static_cast<std::size_t>(face);
    if (layout.face_tilt[at] < 0) continue;
    (*first)[at] = static_cast<Eigen::Index>(curvatures.size());
    const Eigen::Matrix3d axes = FaceAxes(face);
    const Eigen::MatrixXd tilt = moves.middleRows<2>(layout.face_tilt[at]);
    const Eigen::MatrixXd cosine = Times(tilt.transpose(), tilt);
    const Eigen::Vector3d along = graph.sensitivity(Triad::kAccelerometer) * axes.col(0);
    for (int i = 0; i < 3; ++i) {
      Eigen::MatrixXd across = Eigen::MatrixXd::Zero(2, moves.cols());  // derivative of row i of SE
      for (int j = 0; j < 3; ++j) {
        const int entry = layout.sensitivity[Triad::kAccelerometer] + i + 3 * j;
        across += axes.row(j).tail<2>().transpose() * moves.row(entry);
      }
      const Eigen::MatrixXd turned = Times(across.transpose(), tilt);
      curvatures.push_back(gravity * (turned + turned.transpose() - along[i] * cosine));
    }
  }
  return curvatures;
}

}  // namespace

std::optional<StatedFault> FaceCurvatures(const PoseGraph& graph,
                                          const Eigen::MatrixXd& covariance) {
  const auto is_free = [](int tilt) { return tilt >= 0; };
  if (std::ranges::none_of(graph.layout.face_tilt, is_free)) return std::nullopt;
  std::array<Eigen::Index, kFaceCount> first{};
  const std::vector<Eigen::MatrixXd> curvatures = CurvaturesOfFaces(graph, covariance, &first);
  const auto count = static_cast<Eigen::Index>(curvatures.size());
  Eigen::VectorXd mean(count);
  Eigen::MatrixXd spread(count, count);
  for (Eigen::Index a = 0; a < count; ++a) {
    const Eigen::MatrixXd& of_a = curvatures[static_cast<std::size_t>(a)];
    mean[a] = 0.5 * of_a.trace();
    for (Eigen::Index b = 0; b < count; ++b) {
      spread(a, b) = 0.5 * of_a.cwiseProduct(curvatures[static_cast<std::size_t>(b)]).sum();
    }
  }
  if (!(spread.trace() > 0.0)) return std::nullopt;
  const SymmetricEigen eigen = EigenOfSymmetric(spread);
  const double least = kLeastCurvature * eigen.values.maxCoeff();
  StatedFault fault{
      {}, eigen.values.cwiseMax(least).cwiseSqrt(), Times(eigen.vectors.transpose(), mean)};
  Eigen::Index row = 0;
  for (const PoseNode& node : graph.nodes) {
    for (std::size_t i = 0; i < node.observations.size() && node.face >= 0; ++i) {
      if (node.observations[i].triad != Triad::kAccelerometer) continue;
      fault.column.Add(row + 3 * static_cast<Eigen::Index>(i),
                       eigen.vectors.middleRows<3>(first[static_cast<std::size_t>(node.face)]));
    }
    row += node.row_count();
  }
  if (fault.column.blocks.empty()) return std::nullopt;
  return fault;
}

}  // namespace truetriad
