// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "faults/fault_system.h"

namespace truetriad {

// Excess of each component of a system: v, at its REML optimum or near, the mean noise at rest
// beneath it, and the least that v may be.
struct ExcessState {
  Eigen::VectorXd v, rest, least;
  // Of the residuals. Where no excess is estimated and they scatter more than is stated, that is
  // what faults are held against.
  double dof = 0.0;
};

// What tests need of columns Z: Z^T P Z, Z^T P r and Z^T V^-1 Z's diagonal.
struct ColumnSums {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  Eigen::VectorXd squares;
};

// A fault's test beside all that is in the system. With T such that T^T Z^T P Z T = I over the
// directions that are seen, Y = P Z T, and z = T^T Z^T P r:
//
//   s_c = 1/2 (|R_c^T (P r - Y z)|^2 - t_c + tr E_c)    score of the excess with the fault in
//   v¹  = argmax over v¹ >= least of s^T (v¹ - v) - 1/2 (v¹ - v)^T F¹ (v¹ - v)
//   X   = z^T M^-1 z  ~  rank F(rank, ν)      M = I + Σ (v¹_c - v_c) E_c,  ν = 2 / (g^T F¹^-1 g)
//   g_c = tr(M^-1 E_c) / rank (v¹_c + rest_c) / (v_c + rest_c)
//
// so that noise which the fault itself made is no argument against it, and few degrees of freedom
// of the noise are counted.
struct FaultTest {
  // 0 where too little would be left to know the noise by: 2 (v + rest)^2 F¹ < 3 of a component
  // that it rests on.
  double log_p = 0.0;
  int rank = 0;
  double dof = std::numeric_limits<double>::infinity();  // ν
  Eigen::MatrixXd T;                                     // unknowns x rank
  Eigen::VectorXd h;                                     // -T z
};

// T: directions of which the rows show less than 1e-4 beside the model are not seen.
Eigen::MatrixXd SeenDirections(const ColumnSums& sums);

// z^T z and the rank, at the cost of a few products for up to three unknowns.
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

// ν of X where the components, from v to `to`, have this information with the fault in.
double DegreesOfFreedom(const std::vector<Eigen::MatrixXd>& E,
                        const Eigen::MatrixXd& M,
                        const Eigen::MatrixXd& fisher,
                        const ExcessState& from,
                        const Eigen::VectorXd& to);

// What p is at least, by z^T z alone: whatever the fault explains of a component's noise, X is at
// most z^T z / (1 - v / (v + rest)), and at most what is left of that component's degrees of
// freedom makes of it.
class FirstLook {
 public:
  FirstLook(const FaultSystem& system, const ExcessState& excess);
  double LeastLogP(const QuickTest& quick) const;
  // Whether that may be below; asked without logarithms for nearly all.
  bool MayBeBelow(double log_p, const QuickTest& quick);

 private:
  struct Component {
    double share = 0.0;  // of the excess
    double dof = 0.0;
  };
  std::vector<Component> components_;
  // By rank: z^T z below which p is above 2 %.
  std::vector<double> least_square_;
};

}  // namespace truetriad
