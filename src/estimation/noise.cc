// SPDX-License-Identifier: Apache-2.0
#include "estimation/noise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace truetriad {
namespace {

constexpr int kMaxScoringSteps = 60;

// Mean over accepted poses of the rest variance of `triad` in true units.
double MeanRestVariance(const PoseGraph& graph, Triad triad) {
  const Eigen::Matrix3d correction = graph.sensitivity(triad).inverse();
  double sum = 0.0;
  int count = 0;
  for (const PoseNode& node : graph.nodes) {
    for (const Observation& observation : node.observations) {
      if (observation.triad != triad || observation.rejected) continue;
      sum += (correction * observation.rest_covariance * correction.transpose()).trace() / 3.0;
      ++count;
    }
  }
  return count > 0 ? sum / count : 0.0;
}

}  // namespace

void ApplyExcess(const ExcessVariance& excess, PoseGraph* graph) {
  PerTriad<Eigen::Matrix3d> unit;
  for (const Triad triad : kTriads) {
    if (!graph->layout.Has(triad)) continue;
    unit[triad] = graph->sensitivity(triad) * graph->sensitivity(triad).transpose();
  }
  for (PoseNode& node : graph->nodes) {
    for (Observation& observation : node.observations) {
      observation.variance =
          observation.rest_covariance + excess[observation.triad] * unit[observation.triad];
    }
  }
}

ExcessEstimate EstimateExcess(const std::vector<Triad>& triads,
                              const ExcessVariance& start,
                              const ExcessVariance& floor,
                              PoseGraph* graph,
                              ReducedSystem* system) {
  ExcessEstimate estimate;
  estimate.variance = start;
  estimate.triads = triads;
  const auto count = static_cast<Eigen::Index>(triads.size());
  PerTriad<Eigen::Matrix3d> unit;
  for (const Triad triad : triads) {
    unit[triad] = graph->sensitivity(triad) * graph->sensitivity(triad).transpose();
  }
  for (int iteration = 0; iteration < kMaxScoringSteps; ++iteration) {
    ApplyExcess(estimate.variance, graph);
    system->Eliminate(*graph);
    const Eigen::MatrixXd& covariance = system->covariance();

    Eigen::VectorXd score = Eigen::VectorXd::Zero(count);
    Eigen::MatrixXd fisher = Eigen::MatrixXd::Zero(count, count);
    estimate.sensitivities.assign(triads.size(),
                                  Eigen::MatrixXd::Zero(system->size(), system->size()));
    // J^T D Z_s D Z_t D J, then with P in the middle once C_s is whole.
    std::vector<Eigen::MatrixXd> mixed(triads.size() * triads.size(),
                                       Eigen::MatrixXd::Zero(system->size(), system->size()));
    for (std::size_t k = 0; k < graph->nodes.size(); ++k) {
      const PoseNode& node = graph->nodes[k];
      const ReducedSystem::Pose& pose = system->poses()[k];
      const Eigen::MatrixXd B = pose.D * pose.J;
      for (std::size_t i = 0; i < node.observations.size(); ++i) {
        const Observation& first = node.observations[i];
        const auto s = std::find(triads.begin(), triads.end(), first.triad) - triads.begin();
        if (s == count || first.rejected) continue;
        const auto row = static_cast<Eigen::Index>(3 * i);
        const Eigen::Matrix3d Z = unit[first.triad] / first.weight;
        const Eigen::Vector3d q = pose.projected.segment<3>(row);
        score[s] += 0.5 * q.dot(Z * q) - 0.5 * (pose.D.block<3, 3>(row, row) * Z).trace();
        estimate.sensitivities[static_cast<std::size_t>(s)].noalias() +=
            B.middleRows<3>(row).transpose() * Z * B.middleRows<3>(row);
        for (std::size_t j = 0; j < node.observations.size(); ++j) {
          const Observation& second = node.observations[j];
          const auto t = std::find(triads.begin(), triads.end(), second.triad) - triads.begin();
          if (t == count || second.rejected) continue;
          const auto col = static_cast<Eigen::Index>(3 * j);
          const Eigen::Matrix3d Zt = unit[second.triad] / second.weight;
          const Eigen::Matrix3d DZ = pose.D.block<3, 3>(row, col);
          fisher(s, t) += 0.5 * (Z * DZ * Zt * DZ.transpose()).trace();
          mixed[static_cast<std::size_t>(s * count + t)].noalias() +=
              B.middleRows<3>(row).transpose() * Z * DZ * Zt * B.middleRows<3>(col);
        }
      }
    }
    for (Eigen::Index s = 0; s < count; ++s) {
      const Eigen::MatrixXd& Cs = estimate.sensitivities[static_cast<std::size_t>(s)];
      const Eigen::MatrixXd MC = covariance * Cs;
      score[s] += 0.5 * MC.trace();
      for (Eigen::Index t = 0; t < count; ++t) {
        const Eigen::MatrixXd& Ct = estimate.sensitivities[static_cast<std::size_t>(t)];
        Eigen::MatrixXd& pair = mixed[static_cast<std::size_t>(s * count + t)];
        const Eigen::MatrixXd through = Cs * covariance * Ct;
        fisher(s, t) += 0.5 * (covariance * (through - 2.0 * pair)).trace();
        pair -= through;
      }
    }
    estimate.curvatures = std::move(mixed);
    // Components at their floor that would go below it are left out of the step.
    Eigen::VectorXd step = Eigen::VectorXd::Zero(count);
    Eigen::MatrixXd active = fisher;
    Eigen::VectorXd active_score = score;
    for (Eigen::Index s = 0; s < count; ++s) {
      const Triad triad = triads[static_cast<std::size_t>(s)];
      if (estimate.variance[triad] <= floor[triad] && score[s] < 0.0) {
        active.row(s).setZero();
        active.col(s).setZero();
        active(s, s) = 1.0;
        active_score[s] = 0.0;
      }
    }
    step = active.fullPivLu().solve(active_score);
    estimate.covariance = fisher.fullPivLu().inverse();
    double largest_change = 0.0;
    for (Eigen::Index s = 0; s < count; ++s) {
      const Triad triad = triads[static_cast<std::size_t>(s)];
      double& variance = estimate.variance[triad];
      const double sigma = std::sqrt(std::max(1.0 / fisher(s, s), 0.0));
      // Scoring overshoots far from the optimum: at most to a twentieth, never past zero.
      double next = std::max(variance + step[s], 0.05 * variance);
      if (next < 1e-9 * sigma) next = 0.0;
      next = std::isfinite(next) ? std::max(next, floor[triad]) : variance;
      largest_change = std::max(largest_change, std::abs(next - variance) / sigma);
      variance = next;
    }
    if (largest_change < 1e-7) break;
  }
  ApplyExcess(estimate.variance, graph);
  system->Eliminate(*graph);
  return estimate;
}

Eigen::MatrixXd AdjustedCovariance(const ExcessEstimate& estimate, const ReducedSystem& system) {
  Eigen::MatrixXd inner = Eigen::MatrixXd::Zero(system.size(), system.size());
  const auto count = static_cast<Eigen::Index>(estimate.triads.size());
  for (Eigen::Index s = 0; s < count; ++s) {
    for (Eigen::Index t = 0; t < count; ++t) {
      inner +=
          estimate.covariance(s, t) * estimate.curvatures[static_cast<std::size_t>(s * count + t)];
    }
  }
  return system.covariance() +
         system.covariance() * (inner + inner.transpose()) * system.covariance();
}

double ExcessDegreesOfFreedom(const ExcessEstimate& estimate, const PoseGraph& graph, Triad triad) {
  const auto at = std::find(estimate.triads.begin(), estimate.triads.end(), triad);
  if (at == estimate.triads.end()) return std::numeric_limits<double>::infinity();
  const auto s = at - estimate.triads.begin();
  const double total = estimate.variance[triad] + MeanRestVariance(graph, triad);
  return 2.0 * total * total / estimate.covariance(s, s);
}

JointTest KenwardRogerTest(const ExcessEstimate& estimate, const ReducedSystem& system) {
  JointTest test;
  const auto count = static_cast<Eigen::Index>(estimate.triads.size());
  const double q = system.size();
  double a1 = 0.0;
  double a2 = 0.0;
  for (Eigen::Index s = 0; s < count; ++s) {
    const Eigen::MatrixXd Ms =
        system.covariance() * estimate.sensitivities[static_cast<std::size_t>(s)];
    for (Eigen::Index t = 0; t < count; ++t) {
      const Eigen::MatrixXd Mt =
          system.covariance() * estimate.sensitivities[static_cast<std::size_t>(t)];
      a1 += estimate.covariance(s, t) * Ms.trace() * Mt.trace();
      a2 += estimate.covariance(s, t) * (Ms * Mt).trace();
    }
  }
  // Nothing was estimated, or nothing that matters: χ².
  if (!(a2 > 1e-12 * q)) return test;
  const double b = (a1 + 6.0 * a2) / (2.0 * q);
  const double g = ((q + 1.0) * a1 - (q + 4.0) * a2) / ((q + 2.0) * a2);
  const double d = 3.0 * q + 2.0 * (1.0 - g);
  const double c1 = g / d;
  const double c2 = (q - g) / d;
  const double c3 = (q + 2.0 - g) / d;
  // The moments are expansions for many degrees of freedom; where they break down there are few.
  const double mean_inverse = 1.0 - a2 / q;
  const double spread = (1.0 - c2 * b) * (1.0 - c2 * b) * (1.0 - c3 * b);
  if (mean_inverse > 0.05 && 1.0 - c2 * b > 0.0 && 1.0 - c3 * b > 0.0) {
    const double mean = 1.0 / mean_inverse;
    const double variance = 2.0 / q * (1.0 + c1 * b) / spread;
    const double rho = variance / (2.0 * mean * mean);
    // An F distribution with a variance has more than four; anything else is the expansion's fault.
    if (q * rho > 1.0) {
      test.dof = 4.0 + (q + 2.0) / (q * rho - 1.0);
      test.scale = std::min(1.0, test.dof / (mean * (test.dof - 2.0)));
      return test;
    }
  }
  test.dof = std::max(1.0, 2.0 * q * q / std::max(a1, 2.0 * q * a2));
  return test;
}

// With the score q = (P r) of one observation and its block A of P, deleting it changes χ² by
// q^T A^+ q. Its residual against the prediction from everything else is A^-1 q with covariance
// A^-1 (at the weight it has); taking its own variance back to weight 1 gives the test at face
// value, whatever the robust step did.
std::vector<DeletionTest> DeletionTests(const PoseGraph& graph, const ReducedSystem& system) {
  std::vector<DeletionTest> tests;
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const Eigen::MatrixXd P = system.ProjectorBlock(k);
    for (std::size_t i = 0; i < graph.nodes[k].observations.size(); ++i) {
      const Observation& observation = graph.nodes[k].observations[i];
      const auto row = static_cast<Eigen::Index>(3 * i);
      // In units of the observation's own standard deviation, so that eigenvalues compare.
      const Eigen::Matrix3d root =
          Eigen::LLT<Eigen::Matrix3d>(observation.variance / observation.weight).matrixL();
      const Eigen::Matrix3d A = root.transpose() * P.block<3, 3>(row, row) * root;
      const Eigen::Vector3d q = root.transpose() * system.poses()[k].projected.segment<3>(row);
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(A);
      DeletionTest test{k, i, 0.0, 0};
      for (int axis = 0; axis < 3; ++axis) {
        const double eigenvalue = solver.eigenvalues()[axis];
        // Below this the observation is needed to determine something: it tests nothing.
        if (eigenvalue < 1e-6) continue;
        const double residual = solver.eigenvectors().col(axis).dot(q) / eigenvalue;
        const double variance = 1.0 / eigenvalue - (1.0 - observation.weight);
        test.chi2 += residual * residual / variance;
        ++test.rank;
      }
      // Beyond what a double holds nothing is tested; the verdict looks at the parameters.
      if (!std::isfinite(test.chi2)) test = {k, i, 0.0, 0};
      tests.push_back(test);
    }
  }
  return tests;
}

}  // namespace truetriad
