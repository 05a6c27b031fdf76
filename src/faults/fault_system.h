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
  bool is_noisy = false;  // computed from noisy readings, which the rows contain as well

  // Adds a block, unless all its values are zero.
  void Add(Eigen::Index row, const Eigen::Ref<const Eigen::MatrixXd>& value);
  // Z^T y for all rows y.
  Eigen::MatrixXd Transposed(const StackedRows& y) const;
  Eigen::VectorXd TransposedVector(const Eigen::VectorXd& y) const;
};

// Columns of faults in the model, beside the graph's own, with a prior for each unknown.
struct AddedColumns {
  StackedRows Z;          // all rows
  Eigen::VectorXd sigma;  // prior σ of h about its mean
  Eigen::VectorXd mean;   // prior mean, zero unless stated
  Eigen::VectorXd at;     // h by which the graph's readings are corrected already

  Eigen::Index size() const { return Z.cols(); }
  void Append(const FaultColumn& column, const Eigen::VectorXd& sigma_of, Eigen::Index rows);
};

// A variance component of turns, added to their excess: one matrix per turn, in the turns' order.
using TurnVariances = std::vector<Eigen::Matrix3d>;

// The linearised graph with faults included. With the graph's projector P_0 (reduced_system.h) and
// columns Z whose unknowns have prior σ (Λ = diag(1 / σ^2)), the projector is
//
//   P = P_0 - U U^T      U = P_0 Z L^-T,  L L^T = Z^T P_0 Z + Λ
//
// A fault thus costs two products, and all further equations are as without faults. If there are at
// most kMostDenseRows rows, P is formed as a matrix, since a fault's columns have few rows each.
class FaultSystem : public ReducedSystem {
 public:
  // A block of rows with a variance component, V = rest + v_c R R^T.
  struct Part {
    Eigen::Index row = 0;
    Eigen::Index component = 0;
    Eigen::Matrix3d root = Eigen::Matrix3d::Identity();  // R
  };

  // 64 poses of fifteen rows have 960 rows, and P has 8 MB. With more rows, P is not formed.
  static constexpr Eigen::Index kMostDenseRows = 1024;

  // `system`: of the graph. Components that are not in `components` have no estimated excess.
  FaultSystem(const ReducedSystem& system,
              const PoseGraph& graph,
              std::vector<NoiseComponent> components,
              Eigen::Index most_dense_rows = kMostDenseRows);

  // Sets the turns' component, the last, or removes it if empty. P must be formed; then call
  // TakeIn.
  void SetTurnVariances(TurnVariances unit) { turn_unit_ = std::move(unit); }
  // Set `columns` in place of all former ones. Linearise repeats all stages, Eliminate all but the
  // linearisation, TakeIn neither that nor the elimination of poses.
  void Linearise(const PoseGraph& graph, const AddedColumns& columns);
  void Eliminate(const PoseGraph& graph, const AddedColumns& columns);
  void TakeIn(const PoseGraph& graph, const AddedColumns& columns);

  // P y, for any number of columns.
  StackedRows Projected(const FaultColumn& column) const;
  StackedRows Projected(const StackedRows& y) const;
  // Whether P is formed.
  bool is_dense() const { return P_.size() > 0; }
  // Z_g^T P Z_h of all pairs of columns, in block (g, h); the columns have equally many unknowns.
  Eigen::MatrixXd InformationOf(const std::vector<FaultColumn>& columns) const;
  // P r: the weighted residuals at the optimum.
  const Eigen::VectorXd& q() const { return q_; }
  // h of the included columns, and the covariance of h.
  const Eigen::VectorXd& h() const { return h_; }
  const Eigen::MatrixXd& h_covariance() const { return h_covariance_; }

  // Tests whether turn errors have the directions of variances Q, whatever the errors' sizes:
  //
  //   d = (q^T Q q - |w|^2 tr Q' / k) / (|w|^2 s)
  //   s^2 = 2 a^2 / (k (k + 2)),  a^2 = tr Q'^2 - tr^2 Q' / k
  //
  // Without such variances, d has variance 1. w = Π^-1/2 q and Q' = Π^1/2 Q Π^1/2 are over the k
  // directions of the turn's block Π of P. Tested is Σ a d over its σ; for more than 64 turns, σ
  // includes the correlation of neighbours. `component`: the factor of Q that explains q^T Q q.
  struct Alignment {
    double log_p = 0.0;
    double component = 0.0;
  };
  Alignment AlignmentOf(const TurnVariances& unit) const;

  // Of the free shared coordinates: their covariance, its part due to the included columns
  // (BeyondGraph), and their change by h = 1 of a column that is not included (SharedShift).
  Eigen::MatrixXd SharedCovariance() const { return covariance() + BeyondGraph(); }
  Eigen::MatrixXd BeyondGraph() const;
  // χ² without faults, at the variances of `graph`. The system is invalid until linearised again.
  double ChiSquareOf(const PoseGraph& graph);
  Eigen::MatrixXd SharedShift(const FaultColumn& column) const;

  // r^T V^-1 r of the three rows from `row` on.
  double WhitenedSquare(Eigen::Index row) const;
  // The diagonal of Z^T V^-1 Z.
  Eigen::VectorXd Squares(const FaultColumn& column) const;

  // REML with D_c = dV / dv_c: t_c = tr(P D_c), score and Fisher information of the components, and
  // the log likelihood without terms that all variances share.
  Eigen::Index components() const {
    return static_cast<Eigen::Index>(components_.size() + (turn_unit_.empty() ? 0 : 1));
  }
  const std::vector<Part>& parts() const { return parts_; }
  const Eigen::VectorXd& traces() const { return traces_; }
  const Eigen::VectorXd& score() const { return score_; }
  const Eigen::MatrixXd& fisher() const { return fisher_; }
  double LogLikelihood() const;

  // If columns Z are added, the projector is P - Y Y^T, with Y = P Z T and T^T Z^T P Z T = I, and
  // the information is F_cd - 1/2 (tr X_cd + tr X_dc - tr E_c E_d), with E_c = Y^T D_c Y and X_cd =
  // Y^T D_c P D_d Y.
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
  StackedRows WithoutShared(StackedRows Dy,
                            const Eigen::MatrixXd& By,
                            const Eigen::MatrixXd& Uy) const;
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
  StackedRows U_;      // rows x faults' unknowns
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
