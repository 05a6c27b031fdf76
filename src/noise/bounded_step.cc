// SPDX-License-Identifier: Apache-2.0
#include "noise/bounded_step.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "math/dense/lu.h"
#include "math/dense/products.h"

namespace truetriad {
namespace {

// If the score of a component divided by its σ is larger than this, the component leaves its limit.
// Smaller scores are rounding.
constexpr double kNoPull = 1e-9;
// The most passes per component, as in Lawson and Hanson's own program.
constexpr Eigen::Index kMostFreed = 3;

Eigen::VectorXd BalanceOf(const Eigen::MatrixXd& information) {
  Eigen::VectorXd balance(information.rows());
  for (Eigen::Index s = 0; s < balance.size(); ++s) {
    const double own = information(s, s);
    balance[s] = own > 0.0 ? 1.0 / std::sqrt(own) : 1.0;
  }
  return balance;
}

// The solution for the components `free`, with zeros for the others.
Eigen::VectorXd SolveFor(const std::vector<Eigen::Index>& free,
                         const Eigen::MatrixXd& information,
                         const Eigen::VectorXd& right) {
  const Eigen::MatrixXd own = information(free, free);
  const Eigen::VectorXd of_free = right(free);
  Eigen::VectorXd solved = Eigen::VectorXd::Zero(right.size());
  solved(free) = TimesVector(BalancedInverse(own), of_free);
  return solved;
}

// Moves the `free` components of x towards the solution without limits. If a component reaches zero
// on the way, it is removed from `free`, and the others go on.
void GoTo(const Eigen::MatrixXd& information,
          const Eigen::VectorXd& right,
          std::vector<Eigen::Index>* free,
          Eigen::VectorXd* x) {
  while (!free->empty()) {
    const Eigen::VectorXd wanted = SolveFor(*free, information, right);
    double share = 1.0;
    auto first = free->end();
    for (auto at = free->begin(); at != free->end(); ++at) {
      if (wanted[*at] > 0.0) continue;
      const double own = (*x)[*at] / ((*x)[*at] - wanted[*at]);
      if (!(own < share)) continue;
      share = own;
      first = at;
    }
    if (first == free->end()) {
      *x = wanted;
      return;
    }
    *x += share * (wanted - *x);
    (*x)[*first] = 0.0;
    free->erase(first);
  }
}

}  // namespace

Eigen::MatrixXd BalancedInverse(const Eigen::MatrixXd& information) {
  const Eigen::VectorXd balance = BalanceOf(information);
  return ScaledBothSides(balance, InverseByLu(ScaledBothSides(balance, information)));
}

Eigen::VectorXd StepAbove(const Eigen::VectorXd& limit,
                          const Eigen::MatrixXd& information,
                          const Eigen::VectorXd& score) {
  const Eigen::Index count = score.size();
  const Eigen::VectorXd right = score - information * limit;
  const Eigen::VectorXd balance = BalanceOf(information);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(count);  // the step minus its limit
  std::vector<Eigen::Index> free;
  for (Eigen::Index pass = 0; pass < kMostFreed * count; ++pass) {
    const Eigen::VectorXd pull = balance.cwiseProduct(right - information * x);
    Eigen::Index strongest = -1;
    for (Eigen::Index s = 0; s < count; ++s) {
      const bool is_free = std::find(free.begin(), free.end(), s) != free.end();
      if (is_free || !(pull[s] > kNoPull)) continue;
      if (strongest < 0 || pull[s] > pull[strongest]) strongest = s;
    }
    if (strongest < 0) break;
    free.push_back(strongest);
    GoTo(information, right, &free, &x);
  }
  return x + limit;
}

}  // namespace truetriad
