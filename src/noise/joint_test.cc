// SPDX-License-Identifier: Apache-2.0
#include "noise/joint_test.h"

#include <algorithm>
#include <vector>

#include "math/dense/lu.h"
#include "math/dense/products.h"

namespace truetriad {
namespace {

// `changes`: for each variance, how the tested parameters' covariance changes with it, relative to
// that covariance.
JointTest ApproximateTest(const Eigen::MatrixXd& variance_covariance,
                          const std::vector<Eigen::MatrixXd>& changes,
                          double q) {
  JointTest test;
  double a1 = 0.0;
  double a2 = 0.0;
  for (std::size_t s = 0; s < changes.size(); ++s) {
    for (std::size_t t = 0; t < changes.size(); ++t) {
      const double weight =
          variance_covariance(static_cast<Eigen::Index>(s), static_cast<Eigen::Index>(t));
      a1 += weight * changes[s].trace() * changes[t].trace();
      a2 += weight * changes[s].cwiseProduct(changes[t].transpose()).sum();
    }
  }
  // If no variance was estimated, or none that has an influence, the test is χ².
  if (!(a2 > 1e-12 * q)) return test;
  const double b = (a1 + 6.0 * a2) / (2.0 * q);
  const double g = ((q + 1.0) * a1 - (q + 4.0) * a2) / ((q + 2.0) * a2);
  const double d = 3.0 * q + 2.0 * (1.0 - g);
  const double c1 = g / d;
  const double c2 = (q - g) / d;
  const double c3 = (q + 2.0 - g) / d;
  // The moments are expansions for many degrees of freedom. If there are few, the expansions may
  // fail, which the conditions below detect.
  const double mean_inverse = 1.0 - a2 / q;
  const double spread = (1.0 - c2 * b) * (1.0 - c2 * b) * (1.0 - c3 * b);
  if (mean_inverse > 0.05 && 1.0 - c2 * b > 0.0 && 1.0 - c3 * b > 0.0) {
    const double mean = 1.0 / mean_inverse;
    const double variance = 2.0 / q * (1.0 + c1 * b) / spread;
    const double rho = variance / (2.0 * mean * mean);
    // An F distribution with a finite variance has dof > 4; otherwise the expansion failed.
    if (q * rho > 1.0) {
      test.dof = 4.0 + (q + 2.0) / (q * rho - 1.0);
      test.scale = std::min(1.0, test.dof / (mean * (test.dof - 2.0)));
      return test;
    }
  }
  test.dof = std::max(1.0, 2.0 * q * q / std::max(a1, 2.0 * q * a2));
  return test;
}

}  // namespace

Eigen::MatrixXd AdjustedCovariance(const ExcessEstimate& estimate, const ReducedSystem& system) {
  Eigen::MatrixXd inner = Eigen::MatrixXd::Zero(system.size(), system.size());
  const auto count = static_cast<Eigen::Index>(estimate.components.size());
  for (Eigen::Index s = 0; s < count; ++s) {
    for (Eigen::Index t = 0; t < count; ++t) {
      inner +=
          estimate.covariance(s, t) * estimate.curvatures[static_cast<std::size_t>(s * count + t)];
    }
  }
  inner += inner.transpose().eval();
  return system.covariance() + Times(Times(system.covariance(), inner), system.covariance());
}

JointTest KenwardRogerTest(const ExcessEstimate& estimate, const ReducedSystem& system) {
  std::vector<Eigen::MatrixXd> changes;
  for (const Eigen::MatrixXd& sensitivity : estimate.sensitivities) {
    changes.push_back(Times(system.covariance(), sensitivity));
  }
  return ApproximateTest(estimate.covariance, changes, system.size());
}

double NoiseDof(const ExcessEstimate& estimate, const PoseGraph& graph) {
  if (estimate.components.empty()) return JointTest().dof;
  return KenwardRogerTest(estimate, ReducedSystem(graph)).dof;
}

JointTest KenwardRogerTest(const ExcessEstimate& estimate,
                           const ReducedSystem& system,
                           const PoseGraph& graph,
                           const Eigen::MatrixXd& tested) {
  const Eigen::MatrixXd covariance = Times(system.covariance(), tested);
  const PivotedLu own(TransposeTimes(tested, covariance));
  std::vector<Eigen::MatrixXd> changes(estimate.components.size(),
                                       Eigen::MatrixXd::Zero(tested.cols(), tested.cols()));
  for (const VariancePart& part : PartsOf(graph)) {
    const auto at =
        std::find(estimate.components.begin(), estimate.components.end(), part.component);
    if (part.rejected || at == estimate.components.end()) continue;
    const Eigen::Index row = system.factors()[part.factor].row + part.row;
    const Eigen::MatrixXd rows =
        TransposeTimes(system.B().middleRows(row, 3).transpose(), covariance);
    changes[static_cast<std::size_t>(at - estimate.components.begin())] +=
        TransposedCongruence(rows, part.unit) / part.weight;
  }
  for (Eigen::MatrixXd& change : changes) change = own.Solve(change);
  return ApproximateTest(estimate.covariance, changes, static_cast<double>(tested.cols()));
}

}  // namespace truetriad
