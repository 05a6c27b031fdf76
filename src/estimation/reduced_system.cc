// SPDX-License-Identifier: Apache-2.0
#include "estimation/reduced_system.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace truetriad {
namespace {

// Eigenvalues of the scaled information below this share of the largest are rounding: the
// elimination squares the condition number, so half the digits of a double remain.
constexpr double kRankTolerance = 1e-14;

}  // namespace

ReducedSystem::ReducedSystem(const PoseGraph& graph) {
  const SharedLayout& layout = graph.layout;
  const int n = layout.free_size();
  poses_.resize(graph.nodes.size());
  PoseSharedJacobian shared_jacobian;
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    Pose& pose = poses_[k];
    graph.nodes[k].Evaluate(layout,
                            graph.shared.data(),
                            graph.nodes[k].state.data(),
                            &pose.residual,
                            &shared_jacobian,
                            &pose.A);
    pose.J = shared_jacobian * layout.basis;
  }
  const Eigen::VectorXd typical = TypicalSizes(layout, graph.shared);
  scale_ = (typical.asDiagonal() * layout.basis).colwise().norm();

  prior_information_ = Eigen::MatrixXd::Zero(n, n);
  prior_gradient_ = Eigen::VectorXd::Zero(n);
  for (const ScalarPrior& prior : graph.priors) {
    const Eigen::RowVectorXd row = layout.basis.row(prior.index) / prior.sigma;
    prior_information_ += row.transpose() * row;
    prior_gradient_ += row.transpose() * ((graph.shared[prior.index] - prior.mean) / prior.sigma);
  }
  Eliminate(graph);
}

void ReducedSystem::Eliminate(const PoseGraph& graph) {
  information_ = prior_information_;
  Eigen::VectorXd gradient = prior_gradient_;
  for (std::size_t k = 0; k < poses_.size(); ++k) {
    Pose& pose = poses_[k];
    const PoseRowMatrix root = graph.nodes[k].SquareRootInformation();
    const PoseRowMatrix information = root.transpose() * root;
    pose.D = information;
    if (pose.A.cols() > 0) {
      const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3> pose_information =
          pose.A.transpose() * information * pose.A;
      const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoseRows, 3> weighted =
          information * pose.A;
      pose.D -= weighted * pose_information.inverse() * weighted.transpose();
    }
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoseRows, kMaxSharedSize>
        projected = pose.D * pose.J;
    information_.noalias() += pose.J.transpose() * projected;
    gradient.noalias() += projected.transpose() * pose.residual;
  }

  if (information_.rows() == 0) return;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale_.asDiagonal() * information_ *
                                                              scale_.asDiagonal());
  eigenvalues_ = solver.eigenvalues();
  eigenvectors_ = solver.eigenvectors();
  const double largest = eigenvalues_.size() > 0 ? eigenvalues_.maxCoeff() : 0.0;
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(eigenvalues_.size());
  rank_ = 0;
  for (Eigen::Index i = 0; i < inverse.size(); ++i) {
    if (eigenvalues_[i] > kRankTolerance * largest) {
      inverse[i] = 1.0 / eigenvalues_[i];
      ++rank_;
    }
  }
  const Eigen::MatrixXd scaled_vectors = scale_.asDiagonal() * eigenvectors_;
  covariance_ = scaled_vectors * inverse.asDiagonal() * scaled_vectors.transpose();
  step_ = -covariance_ * gradient;
  for (Pose& pose : poses_) pose.projected = pose.D * (pose.residual + pose.J * step_);
}

Eigen::MatrixXd ReducedSystem::ProjectorBlock(std::size_t pose) const {
  const Eigen::MatrixXd B = poses_[pose].D * poses_[pose].J;
  return poses_[pose].D - B * covariance_ * B.transpose();
}

}  // namespace truetriad
