// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "motion/track.h"
#include "problem/graph.h"

namespace truetriad {

// Noise of a tumbling unit's readings, white at the frequencies that matter: raw unit squared times
// seconds, per axis. A mean over T seconds has the variance density / T.
struct MotionNoise {
  PerTriad<Eigen::Vector3d> density;
};

// The factor graph of a tumbling unit: a chain of attitudes R_k, seen by the vector sensors and
// linked by the gyroscope; every row whitened. docs/method.md, "Factors".
//
//   vector sensor  S M_k R_k^T v + b - y_k               M_k: GatheredReadings::turn
//   turn           Log(dR(b, S, G)^T R_k^T R_k+1)        integrated at the present parameters
//
// Linearised, the attitudes (R_k <- R_k Exp(d_k)) form a block tridiagonal system that is
// eliminated from the first to the last, the shared parameters coming last: an arrow. Time and
// memory are linear in the number of attitudes.
class MotionChain {
 public:
  // All must outlive the chain. `layout` and `priors` are those of the shared parameters.
  MotionChain(const SharedLayout& layout,
              const std::vector<ScalarPrior>& priors,
              const MotionTrack& track,
              std::vector<MotionNode> nodes,
              std::vector<Eigen::Quaterniond> attitudes);

  // What rows are weighted with; the turns' noise goes through the correction at `shared`.
  void SetNoise(const MotionNoise& noise, const double* shared);

  // Linearises about `shared` and the attitudes as they are.
  void Linearise(const double* shared);
  // Of the last Linearise: half the sum of squares, and the reduced system of the free shared
  // coordinates, gradient and information, with the attitudes at their best for each.
  double cost() const { return cost_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  const Eigen::MatrixXd& information() const { return information_; }

  // The attitudes that go with shared parameters moved by `step` (free coordinates) from where they
  // were linearised.
  std::vector<Eigen::Quaterniond> AttitudesAfter(const Eigen::VectorXd& step) const;
  // Half the sum of squares anywhere.
  double CostAt(const double* shared, const std::vector<Eigen::Quaterniond>& attitudes) const;

  const std::vector<Eigen::Quaterniond>& attitudes() const { return attitudes_; }
  void SetAttitudes(std::vector<Eigen::Quaterniond> attitudes) {
    attitudes_ = std::move(attitudes);
  }
  const std::vector<MotionNode>& nodes() const { return nodes_; }
  std::vector<MotionNode>& nodes() { return nodes_; }

  // Residuals of one sensor (the gyroscope: of the turns), per axis over its noise, and how much
  // of each the attitudes leave: 1 - leverage. Rows of what is not seen are zero and leave nothing.
  // After Linearise.
  struct Residuals {
    Eigen::Matrix3Xd value;  // a node a column
    Eigen::Matrix3Xd left;
  };
  PerTriad<Residuals> AllResiduals(const double* shared) const;

  // By how much more than allowed for a vector sensor's clock is ahead of the gyroscope's, with its
  // σ: the residuals against how fast the field turns, dx/dt = x x omega.
  struct ClockError {
    double ahead_s = 0.0;
    double sigma_s = 0.0;
  };
  ClockError ClockErrorOf(Triad triad, const double* shared) const;

 private:
  using Matrix3 = Eigen::Matrix3d;
  // Which free coordinates touch a triad's rows, and how its own columns (bias, sensitivity,
  // g-sensitivity or reference) make them.
  struct Columns {
    struct Term {
      int column = 0;  // compact
      int own = 0;
      double factor = 0.0;
    };
    std::vector<int> free;
    std::vector<Term> terms;
  };
  Eigen::Vector3d VectorResidual(Triad triad,
                                 const MotionNode& node,
                                 const TriadModel<double>& model,
                                 const Eigen::Vector3d& field) const;
  double RootWeight(const GatheredReadings& seen) const;
  Columns ColumnsOf(Triad triad) const;
  GyroModel GyroscopeAt(const double* shared) const;
  bool HoldsHeading(std::size_t k) const;

  const SharedLayout& layout_;
  const std::vector<ScalarPrior>& priors_;
  const MotionTrack& track_;
  std::vector<MotionNode> nodes_;
  std::vector<Eigen::Quaterniond> attitudes_;
  bool has_magnetometer_ = false;

  MotionNoise noise_;
  PerTriad<Eigen::Vector3d> inverse_sigma_;  // of one reading of a vector sensor
  Matrix3 turn_root_ = Matrix3::Identity();  // of a turn that takes one second

  PerTriad<Columns> columns_;
  double cost_ = 0.0;
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd information_;
  // What elimination leaves behind: Cholesky factors of the pivots, G_k, and the whitened columns
  // of the shared coordinates and the right side, some nodes a panel.
  std::vector<Matrix3> inverse_factor_, gain_;
  std::vector<Eigen::MatrixXd> panels_;
};

}  // namespace truetriad
