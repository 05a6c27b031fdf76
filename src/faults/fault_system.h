// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "noise/components.h"
#include "solve/reduced_system.h"

namespace truetriad {

// A fault with unknowns h changes the predictions by Z h. Only the rows of Z that are not zero are
// stored: three rows per block, in the units of the readings (turns: rad).
struct FaultColumn {
  struct Block {
    Eigen::Index row = 0;
    Eigen::MatrixXd value;  // 3 x unknowns
  };
  std::vector<Block> blocks;
  Eigen::Index unknowns = 0;
  bool is_noisy = false;  // computed from readings whose noise is also in the residuals

  // Adds a block, unless all its values are zero.
  void Add(Eigen::Index row, const Eigen::Ref<const Eigen::MatrixXd>& value);
  // Z^T y; y has all rows of the system.
  Eigen::MatrixXd Transposed(const StackedRows& y) const;
  Eigen::VectorXd TransposedVector(const Eigen::VectorXd& y) const;
};

// The columns of all faults in the model, with a normal prior for each unknown h.
struct AddedColumns {
  StackedRows Z;          // has all rows of the graph
  Eigen::VectorXd sigma;  // prior σ of h about its mean
  Eigen::VectorXd mean;   // prior mean, zero unless stated
  Eigen::VectorXd at;     // h by which the graph's readings are corrected already

  Eigen::Index size() const { return Z.cols(); }
  void Append(const FaultColumn& column, const Eigen::VectorXd& sigma_of, Eigen::Index rows);
};

// A second variance component of turns, beside their excess: one factor v times a matrix per turn.
using TurnVariances = std::vector<Eigen::Matrix3d>;

// The linearised graph with faults included. P_0 is the graph's projector (reduced_system.h), Z are
// the faults' columns, σ the prior σ of their unknowns, and Λ = diag(1 / σ^2). The projector is
//
//   P = P_0 - U U^T      U = P_0 Z L^-T,  L L^T = Z^T P_0 Z + Λ
//
// A fault thus costs two products, and all further equations are as without faults. If there are at
// most kMostDenseRows rows, P is formed as a matrix: few rows of a column Z are not zero.
class FaultSystem : public ReducedSystem {
 public:
  // Three rows whose covariance contains a variance component c: V = rest + v_c R R^T.
  struct Part {
    Eigen::Index row = 0;
    Eigen::Index component = 0;
    Eigen::Matrix3d root = Eigen::Matrix3d::Identity();  // R
  };

  // P is formed for at most this many rows, and then has 8 MB. 64 poses of 15 rows have 960 rows.
  static constexpr Eigen::Index kMostDenseRows = 1024;

  // `system`: the linear system of `graph`. `components`: those whose excess is estimated.
  FaultSystem(const ReducedSystem& system,
              const PoseGraph& graph,
              std::vector<NoiseComponent> components,
              Eigen::Index most_dense_rows = kMostDenseRows);

  // Sets `unit` as the last variance component; if `unit` is empty, removes this component. P must
  // be formed (is_dense). Call TakeIn, Eliminate or Linearise next.
  void SetTurnVariances(TurnVariances unit) { turn_unit_ = std::move(unit); }
  // All three replace the included columns by `columns`. Linearise repeats the linearisation, the
  // elimination of poses and the solution; Eliminate the last two; TakeIn only the last.
  void Linearise(const PoseGraph& graph, const AddedColumns& columns);
  void Eliminate(const PoseGraph& graph, const AddedColumns& columns);
  void TakeIn(const PoseGraph& graph, const AddedColumns& columns);

  // P Z of a fault's columns Z, and P y for a matrix y with any number of columns.
  StackedRows Projected(const FaultColumn& column) const;
  StackedRows Projected(const StackedRows& y) const;
  // Whether P is formed.
  bool is_dense() const { return P_.size() > 0; }
  // Z_g^T P Z_h of each pair of faults, in block (g, h). All faults have equally many unknowns.
  Eigen::MatrixXd InformationOf(const std::vector<FaultColumn>& columns) const;
  // P r: the weighted residuals at the optimum.
  const Eigen::VectorXd& q() const { return q_; }
  // h of the included columns, and the covariance of h.
  const Eigen::VectorXd& h() const { return h_; }
  const Eigen::MatrixXd& h_covariance() const { return h_covariance_; }

  // Tests whether turn errors, of whatever size, have the directions of variances Q. For each turn:
  //
  //   d = (q^T Q q - |w|^2 tr Q' / k) / (|w|^2 s)
  //   s^2 = 2 a^2 / (k (k + 2)),  a^2 = tr Q'^2 - tr^2 Q' / k
  //
  // q is the turn's part of P r, Π its block of P, and k the number of directions that Π
  // determines; w = Π^-1/2 q and Q' = Π^1/2 Q Π^1/2. Without such variances, d has variance 1. The
  // test is of Σ a d over its σ; for more than 64 turns, this σ includes the correlation of
  // neighbouring turns. `unit`: Q; `component`: the factor of Q that explains q^T Q q.
  struct Alignment {
    double log_p = 0.0;
    double component = 0.0;
  };
  Alignment AlignmentOf(const TurnVariances& unit) const;

  // Of the free shared coordinates: their covariance; BeyondGraph, its part due to the included
  // columns; and SharedShift, their change by h = 1 of a column that is not included.
  Eigen::MatrixXd SharedCovariance() const { return covariance() + BeyondGraph(); }
  Eigen::MatrixXd BeyondGraph() const;
  // χ² without faults, at the variances of `graph`. The system is invalid until linearised again.
  double ChiSquareOf(const PoseGraph& graph);
  Eigen::MatrixXd SharedShift(const FaultColumn& column) const;

  // r^T V^-1 r of the three rows from `row` on.
  double WhitenedSquare(Eigen::Index row) const;
  // The diagonal of Z^T V^-1 Z.
  Eigen::VectorXd Squares(const FaultColumn& column) const;

  // REML of the variance components v_c, with D_c = dV / dv_c. `traces`: t_c = tr(P D_c); then the
  // score, its Fisher information F, and the log likelihood without constant terms.
  Eigen::Index components() const {
    return static_cast<Eigen::Index>(components_.size() + (turn_unit_.empty() ? 0 : 1));
  }
  const std::vector<Part>& parts() const { return parts_; }
  const Eigen::VectorXd& traces() const { return traces_; }
  const Eigen::VectorXd& score() const { return score_; }
  const Eigen::MatrixXd& fisher() const { return fisher_; }
  double LogLikelihood() const;

  // If columns Z are added, the projector becomes P - Y Y^T, with Y = P Z T and T^T Z^T P Z T = I.
  // The information becomes F_cd - 1/2 (tr X_cd + tr X_dc - tr E_c E_d), with E_c = Y^T D_c Y
  // (ComponentSquares) and X_cd = Y^T D_c P D_d Y.
  std::vector<Eigen::MatrixXd> ComponentSquares(const StackedRows& Y) const;
  Eigen::MatrixXd FisherWithout(const StackedRows& Y, const std::vector<Eigen::MatrixXd>& E) const;

 private:
  void PlaceParts(const PoseGraph& graph);
  void SolveFor(const AddedColumns& columns);
  void FormDense();
  template <int kWide>
  Eigen::Matrix<double, kWide, kWide> Between(const FaultColumn& a, const FaultColumn& b) const;
  template <int kWide>
  Eigen::MatrixXd DenseInformation(const std::vector<FaultColumn>& columns) const;
  StackedRows ProjectedByFactors(const FaultColumn& column) const;
  void StateRemlDense();
  void StateRemlByRows(const PoseGraph& graph);
  const Factor& FactorOf(Eigen::Index row) const;
  Eigen::Matrix3d BlockOfP(Eigen::Index row) const;
  Eigen::MatrixXd InformationByFactors(const std::vector<FaultColumn>& columns) const;
  ChainFactor::Panel PanelOf(const FaultColumn& column, std::size_t least_end) const;
  Eigen::MatrixXd WeightedSquares(const std::vector<FaultColumn>& columns) const;
  Eigen::MatrixXd CrossTraces(const StackedRows& Y) const;

  std::vector<NoiseComponent> components_;
  Eigen::Index most_dense_rows_;
  TurnVariances turn_unit_;
  std::vector<Part> parts_;
  StackedRows U_;      // P_0 Z L^-T: rows x unknowns of all faults
  Eigen::MatrixXd V_;  // M^-1 J^T D Z L^-T: change of the shared coordinates by faults
  StackedRows P_;      // formed only if there are few rows
  Eigen::VectorXd q_, h_, along_;
  Eigen::MatrixXd h_covariance_;
  double log_determinant_ = 0.0;  // of L L^T Λ^-1
  double prior_square_ = 0.0;
  Eigen::VectorXd traces_, score_;
  Eigen::MatrixXd fisher_;
};

}  // namespace truetriad
