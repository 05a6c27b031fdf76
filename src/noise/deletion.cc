// SPDX-License-Identifier: Apache-2.0
#include "noise/deletion.h"

#include <algorithm>
#include <cmath>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"

namespace truetriad {

// With the score q = (P r) of one observation and its block A of P, deleting it changes χ² by
// q^T A^+ q. Its residual against the prediction from everything else is A^-1 q with covariance
// A^-1 (at the weight it has); taking its own variance back to weight 1 gives the test at face
// value, whatever the robust step did.
std::vector<DeletionTest> DeletionTests(const PoseGraph& graph, const ReducedSystem& system) {
  std::vector<DeletionTest> tests;
  for (const VariancePart& part : PartsOf(graph)) {
    const ReducedSystem::Factor& factor = system.factors()[part.factor];
    // In units of the observation's own standard deviation, so that eigenvalues compare.
    const Eigen::Matrix3d root = CholeskyRoot(part.variance / part.weight);
    const Eigen::Matrix3d A =
        root.transpose() * system.ProjectorBlock(part.factor, part.row) * root;
    const Eigen::Vector3d q =
        root.transpose() * system.projected().segment<3>(factor.row + part.row);
    const SymmetricEigen3 solver = EigenOfSymmetric3(A);
    DeletionTest test{part.component, factor.node, part.index, 0.0, 0};
    for (int axis = 0; axis < 3; ++axis) {
      const double eigenvalue = solver.values[axis];
      // Below this the observation is needed to determine something: it tests nothing.
      if (eigenvalue < 1e-6) continue;
      const double residual = solver.vectors.col(axis).dot(q) / eigenvalue;
      // No eigenvalue is above 1 but by rounding.
      const double variance = std::max(1.0 / eigenvalue - (1.0 - part.weight), part.weight);
      test.chi2 += residual * residual / variance;
      ++test.rank;
    }
    // Beyond what a double holds nothing is tested; the verdict looks at the parameters.
    if (!std::isfinite(test.chi2)) {
      test.chi2 = 0.0;
      test.rank = 0;
    }
    tests.push_back(test);
  }
  return tests;
}

}  // namespace truetriad
