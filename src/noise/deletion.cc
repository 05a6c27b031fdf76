// SPDX-License-Identifier: Apache-2.0
#include "noise/deletion.h"

#include <algorithm>
#include <cmath>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"

namespace truetriad {

// Let q be the rows of P r that belong to one observation, and A their block of P. Deleting the
// observation changes χ² by q^T A^+ q. Its residual against the prediction from all others is A^-1
// q, with covariance A^-1 at its present weight. The test uses its variance at weight 1, so that
// the robust step has no effect.
std::vector<DeletionTest> DeletionTests(const PoseGraph& graph, const ReducedSystem& system) {
  std::vector<DeletionTest> tests;
  for (const VariancePart& part : PartsOf(graph)) {
    const ReducedSystem::Factor& factor = system.factors()[part.factor];
    // Whitened by the observation's own covariance, so that the eigenvalues are between 0 and 1.
    const Eigen::Matrix3d root = CholeskyRoot(part.variance / part.weight);
    const Eigen::Matrix3d A =
        root.transpose() * system.ProjectorBlock(part.factor, part.row) * root;
    const Eigen::Vector3d q =
        root.transpose() * system.projected().segment<3>(factor.row + part.row);
    const SymmetricEigen3 solver = EigenOfSymmetric3(A);
    DeletionTest test{part.component, factor.node, part.index, 0.0, 0};
    for (int axis = 0; axis < 3; ++axis) {
      const double eigenvalue = solver.values[axis];
      // If the eigenvalue is smaller, only this observation determines some parameter, and it
      // cannot be tested in this direction.
      if (eigenvalue < 1e-6) continue;
      const double residual = solver.vectors.col(axis).dot(q) / eigenvalue;
      // The lower limit acts only if rounding makes an eigenvalue exceed 1.
      const double variance = std::max(1.0 / eigenvalue - (1.0 - part.weight), part.weight);
      test.chi2 += residual * residual / variance;
      ++test.rank;
    }
    // If χ² exceeds the range of a double, there is no test. Checks of the parameters find such a
    // result.
    if (!std::isfinite(test.chi2)) {
      test.chi2 = 0.0;
      test.rank = 0;
    }
    tests.push_back(test);
  }
  return tests;
}

}  // namespace truetriad
