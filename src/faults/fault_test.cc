// SPDX-License-Identifier: Apache-2.0
#include "faults/fault_test.h"

#include <algorithm>
#include <cmath>

#include "faults/log_tail.h"
#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "noise/bounded_step.h"

namespace truetriad {
namespace {

// A direction is determined if other unknowns leave at least this share of its column's square.
// Columns are computed from a solution with errors of some thousandths: if less than a hundredth of
// a column is left, 1e-4 of its square, this rest is such an error. (With 1e-6, 7 % of clean tables
// of six faces seemed to have gains that are wrong by 100 %: only the faces' tilts determine these
// gains.)
constexpr double kSeenShare = 1e-4;
// The fewest degrees of freedom of a tested variance. With two or fewer, F has no mean.
constexpr double kFewestDof = 3.0;
// A test is computed in full only if its p may be below this. Without a fault, one test of fifty
// has a smaller p.
constexpr double kWorthALook = 0.02;
// The degrees of freedom of a noise component matter to a test only if the component contributes at
// least this share to it.
constexpr double kCarries = 0.1;

Eigen::VectorXd PerOwn(const Eigen::VectorXd& squares) {
  return squares.cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
}

}  // namespace

Eigen::MatrixXd SeenDirections(const ColumnSums& sums) {
  const Eigen::VectorXd per_own = PerOwn(sums.squares);
  const SymmetricEigen eigen = EigenOfSymmetric(ScaledBothSides(per_own, sums.information));
  const Eigen::Index count = per_own.size();
  Eigen::Index unseen = 0;
  while (unseen < count && !(eigen.values[unseen] > kSeenShare)) ++unseen;
  Eigen::MatrixXd T(count, count - unseen);
  for (Eigen::Index i = unseen; i < count; ++i) {
    T.col(i - unseen) = per_own.cwiseProduct(eigen.vectors.col(i)) / std::sqrt(eigen.values[i]);
  }
  return T;
}

// Three unknowns are eliminated directly. If there is another number of unknowns, or if a pivot is
// small, eigenvalues are computed.
QuickTest QuickTestOf(const ColumnSums& sums) {
  constexpr double kSafePivot = 1e-3;  // ten times kSeenShare: all three are determined
  if (sums.squares.size() == 3) {
    const Eigen::Vector3d per_own = PerOwn(sums.squares);
    Eigen::Matrix3d A =
        per_own.asDiagonal() * sums.information.topLeftCorner<3, 3>() * per_own.asDiagonal();
    Eigen::Vector3d b = per_own.cwiseProduct(sums.gradient.head<3>());
    double square = 0.0;
    bool is_safe = true;
    for (int i = 0; i < 3 && is_safe; ++i) {
      is_safe = A(i, i) > kSafePivot;
      square += b[i] * b[i] / A(i, i);
      for (int j = i + 1; j < 3; ++j) {
        const double factor = A(j, i) / A(i, i);
        A.row(j) -= factor * A.row(i);
        b[j] -= factor * b[i];
      }
    }
    if (is_safe) return {square, 3};
  }
  const Eigen::MatrixXd T = SeenDirections(sums);
  return {TransposeTimesVector(T, sums.gradient).squaredNorm(), static_cast<int>(T.cols())};
}

double DegreesOfFreedom(const std::vector<Eigen::MatrixXd>& E,
                        const Eigen::MatrixXd& M,
                        const Eigen::MatrixXd& fisher,
                        const ExcessState& from,
                        const Eigen::VectorXd& to) {
  const Eigen::Index count = from.v.size();
  if (count == 0 || M.rows() == 0) return std::numeric_limits<double>::infinity();
  const Cholesky factor(M);
  Eigen::VectorXd g(count);
  for (Eigen::Index c = 0; c < count; ++c) {
    g[c] = factor.Solve(E[static_cast<std::size_t>(c)]).trace() / static_cast<double>(M.rows());
    g[c] *= (to[c] + from.rest[c]) / std::max(from.v[c] + from.rest[c], 1e-300);
  }
  const double variance = g.dot(TimesVector(BalancedInverse(fisher), g));
  return std::max(2.0 / std::max(variance, 1e-12), 1.0);
}

FirstLook::FirstLook(const FaultSystem& system, const ExcessState& excess) {
  for (Eigen::Index c = 0; c < excess.v.size(); ++c) {
    const double total = std::max(excess.v[c] + excess.rest[c], 1e-300);
    components_.push_back(
        {(excess.v[c] - excess.least[c]) / total, 2.0 * total * total * system.fisher()(c, c)});
  }
}

double FirstLook::LeastLogP(const QuickTest& quick) const {
  const double rank = quick.rank, square = quick.square;
  double least = LogChiSquareUpper(square, rank);
  for (const Component& component : components_) {
    const double at_rest = LogChiSquareUpper(square / std::max(1.0 - component.share, 1e-9), rank);
    const double left = component.dof - rank;
    double by_dof = -std::numeric_limits<double>::infinity();
    if (left > 1.0 && square < component.dof - 1.0) {
      by_dof = LogFisherUpper((square / rank) / ((component.dof - square) / left), rank, left);
    }
    least = std::min(least, std::max(at_rest, by_dof));
  }
  return least;
}

bool FirstLook::MayBeBelow(double log_p, const QuickTest& quick) {
  if (quick.rank == 0) return false;
  const auto rank = static_cast<std::size_t>(quick.rank);
  least_square_.resize(std::max(least_square_.size(), rank + 1), -1.0);
  double& least = least_square_[rank];
  if (least < 0.0) {
    double above = 20.0 * (1.0 + quick.rank);
    least = 0.0;
    for (int halving = 0; halving < 20; ++halving) {
      const double middle = 0.5 * (least + above);
      (LeastLogP({middle, quick.rank}) > std::log(kWorthALook) ? least : above) = middle;
    }
  }
  return quick.square > least && LeastLogP(quick) < log_p;
}

FaultTest TestOf(const FaultSystem& system,
                 const ExcessState& excess,
                 const StackedRows& Y,
                 const ColumnSums& sums) {
  FaultTest test;
  test.T = SeenDirections(sums);
  test.rank = static_cast<int>(test.T.cols());
  if (test.rank == 0) return test;
  const Eigen::VectorXd z = TransposeTimesVector(test.T, sums.gradient);
  test.h = -TimesVector(test.T, z);
  const Eigen::Index count = system.components();
  const StackedRows seen = Y * test.T;
  const std::vector<Eigen::MatrixXd> E = system.ComponentSquares(seen);
  const Eigen::VectorXd left = system.q() - seen * z;
  Eigen::VectorXd score = -0.5 * system.traces();
  for (const FaultSystem::Part& part : system.parts()) {
    score[part.component] +=
        0.5 * (part.root.transpose() * left.segment<3>(part.row)).squaredNorm();
  }
  for (Eigen::Index c = 0; c < count; ++c) score[c] += 0.5 * E[static_cast<std::size_t>(c)].trace();
  Eigen::VectorXd v = excess.v;
  Eigen::MatrixXd fisher;
  if (count > 0) {
    fisher = system.FisherWithout(seen, E);
    v += StepAbove((excess.least - excess.v).cwiseMin(0.0), fisher, score);
    v = v.cwiseMax(excess.least);
  }
  Eigen::MatrixXd M = Eigen::MatrixXd::Identity(test.rank, test.rank);
  bool is_testable = true;
  for (Eigen::Index c = 0; c < count; ++c) {
    const Eigen::MatrixXd& Ec = E[static_cast<std::size_t>(c)];
    M += (v[c] - excess.v[c]) * Ec;
    const double total = excess.v[c] + excess.rest[c];
    const bool carries = Ec.trace() * total > kCarries * test.rank;
    if (carries && 2.0 * total * total * fisher(c, c) < kFewestDof) is_testable = false;
  }
  test.dof = DegreesOfFreedom(E, M, fisher, excess, v);
  double X = z.dot(Cholesky(M).SolveVector(z));
  const double left_dof = excess.dof - test.rank;
  if (count == 0 && left_dof >= 1.0) {
    const double times = (system.residual().dot(system.q()) - z.squaredNorm()) / left_dof;
    if (times > 1.0) {
      X /= times;
      test.dof = left_dof;
    }
  }
  if (is_testable) test.log_p = LogFisherUpper(X / test.rank, test.rank, test.dof);
  return test;
}

}  // namespace truetriad
