// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "faults/fault_system.h"

namespace truetriad {

// For each variance component of a system: its excess v, at or near its REML optimum, its mean
// variance at rest, and the lower limit of v.
struct ExcessState {
  Eigen::VectorXd v, rest, least;
  // Degrees of freedom of the residuals. If no excess is estimated and the residuals exceed the
  // stated noise, tests replace that noise by the residuals' scatter.
  double dof = 0.0;
};

// Sums over columns Z for their tests: Z^T P Z, Z^T P r and the diagonal of Z^T V^-1 Z.
struct ColumnSums {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  Eigen::VectorXd squares;
};

// Test of a fault with the columns Z, beside the faults that the system includes. T spans the
// directions that the rows determine, such that T^T Z^T P Z T = I. With Y = P Z T and z = T^T Z^T P
// r:
//
//   s_c = 1/2 (|R_c^T (P r - Y z)|^2 - t_c + tr E_c)    score of v with the fault included
//   v¹  = argmax over v¹ >= least of s^T (v¹ - v) - 1/2 (v¹ - v)^T F¹ (v¹ - v)
//   X   = z^T M^-1 z  ~  rank F(rank, ν)      M = I + Σ (v¹_c - v_c) E_c,  ν = 2 / (g^T F¹^-1 g)
//   g_c = tr(M^-1 E_c) / rank (v¹_c + rest_c) / (v_c + rest_c)
//
// Noise that the fault itself has made thus does not hide the fault, and the test accounts for a
// noise with few degrees of freedom.
struct FaultTest {
  // 0 if the fault would leave too few degrees of freedom to the noise: 2 (v + rest)^2 F¹ < 3 for a
  // component that contributes to the test.
  double log_p = 0.0;
  int rank = 0;
  double dof = std::numeric_limits<double>::infinity();  // ν
  Eigen::MatrixXd T;                                     // unknowns x rank
  Eigen::VectorXd h;                                     // -T z
};

// The T of a test. A direction is undetermined if the model leaves less than 1e-4 of its square in
// the rows.
Eigen::MatrixXd SeenDirections(const ColumnSums& sums);

// z^T z and the rank. For three well determined unknowns a few products suffice.
struct QuickTest {
  double square = 0.0;
  int rank = 0;
};
QuickTest QuickTestOf(const ColumnSums& sums);

// `Y` = P Z.
FaultTest TestOf(const FaultSystem& system,
                 const ExcessState& excess,
                 const StackedRows& Y,
                 const ColumnSums& sums);

// ν of X if the excess goes from `from` to `to`; `fisher`: its information with the fault included.
double DegreesOfFreedom(const std::vector<Eigen::MatrixXd>& E,
                        const Eigen::MatrixXd& M,
                        const Eigen::MatrixXd& fisher,
                        const ExcessState& from,
                        const Eigen::VectorXd& to);

// A lower limit of p from z^T z alone. Whatever part of a component's noise the fault explains, X
// is at most z^T z / (1 - v / (v + rest)), and no more significant than F with the degrees of
// freedom that remain to the component.
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
  // Indexed by rank: the z^T z below which p is above kWorthALook.
  std::vector<double> least_square_;
};

}  // namespace truetriad
