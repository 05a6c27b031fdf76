// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "faults/fault_system.h"

namespace truetriad {

// The state of a system's variance components. For each: v is its excess, at or near the REML
// optimum; `rest` is its mean variance at rest; `least` is the lower limit of v.
struct ExcessState {
  Eigen::VectorXd v, rest, least;
  // Degrees of freedom of the residuals. If no excess is estimated and the residuals exceed the
  // stated noise, tests replace that noise by the residuals' scatter.
  double dof = 0.0;
};

// What a test of columns Z needs: Z^T P Z, Z^T P r and the diagonal of Z^T V^-1 Z, with the
// residuals r, their covariance V, and the projector P of FaultSystem.
struct ColumnSums {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  Eigen::VectorXd squares;
};

// Test of a fault with the columns Z, beside the faults that the system includes. T spans the
// directions of h that the rows determine, scaled to T^T Z^T P Z T = I. With Y = P Z T and
// z = T^T Z^T P r:
//
//   s_c = 1/2 (|R_c^T (P r - Y z)|^2 - t_c + tr E_c)    score of v with the fault included
//   v¹  = argmax over v¹ >= least of s^T (v¹ - v) - 1/2 (v¹ - v)^T F¹ (v¹ - v)
//   X   = z^T M^-1 z  ~  rank F(rank, ν)      M = I + Σ (v¹_c - v_c) E_c,  ν = 2 / (g^T F¹^-1 g)
//   g_c = tr(M^-1 E_c) / rank (v¹_c + rest_c) / (v_c + rest_c)
//
// v¹ are the variances with the fault included: noise that the fault itself causes does not hide
// it. ν accounts for noise that few residuals determine. R_c, t_c, E_c and F are those of
// FaultSystem; F¹ is F with the fault included.
struct FaultTest {
  // log of the probability of this X, or a larger one, without a fault. It is 0 if the fault would
  // leave a component of the test too few degrees of freedom: 2 (v + rest)^2 F¹ < 3.
  double log_p = 0.0;
  int rank = 0;
  double dof = std::numeric_limits<double>::infinity();  // ν
  Eigen::MatrixXd T;                                     // unknowns x rank
  Eigen::VectorXd h;                                     // the fault's unknowns, -T z
};

// The matrix T of FaultTest. A direction of h is undetermined and left out if the model's other
// unknowns explain all but 1e-4 of its square in the rows.
Eigen::MatrixXd SeenDirections(const ColumnSums& sums);

// z^T z and the rank of FaultTest. For three well determined unknowns, a few products suffice.
struct QuickTest {
  double square = 0.0;
  int rank = 0;
};
QuickTest QuickTestOf(const ColumnSums& sums);

// Tests a fault with columns Z; `Y` = P Z, and `sums` are of Z.
FaultTest TestOf(const FaultSystem& system,
                 const ExcessState& excess,
                 const StackedRows& Y,
                 const ColumnSums& sums);

// ν if the excess changes from `from` to `to`; `fisher`: F¹, with the fault included.
double DegreesOfFreedom(const std::vector<Eigen::MatrixXd>& E,
                        const Eigen::MatrixXd& M,
                        const Eigen::MatrixXd& fisher,
                        const ExcessState& from,
                        const Eigen::VectorXd& to);

// A lower limit of p from z^T z alone, which saves most full tests. Whatever part of a component's
// noise the fault explains, X is at most z^T z / (1 - share), with share =
// (v - least) / (v + rest), and no more significant than F with the degrees of freedom that remain
// to the component.
class FirstLook {
 public:
  FirstLook(const FaultSystem& system, const ExcessState& excess);
  double LeastLogP(const QuickTest& quick) const;
  // Whether LeastLogP is below `log_p`; computed without logarithms in nearly all cases.
  bool MayBeBelow(double log_p, const QuickTest& quick);

 private:
  struct Component {
    double share = 0.0;  // (v - least) / (v + rest)
    double dof = 0.0;
  };
  std::vector<Component> components_;
  // By rank: the z^T z below which p is certainly above kWorthALook; negative: not computed yet.
  std::vector<double> least_square_;
};

}  // namespace truetriad
