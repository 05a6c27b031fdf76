// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "truetriad/base/result.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

/// Linear least squares for y = S x + b with known x.
struct KnownFieldFit {
  TriadModel<double> model;
  Eigen::MatrixXd residual;  ///< One row per reading.
  bool is_determined = false;
};
/// `thin`: pivots below this share of the largest count as zero; the default corresponds to
/// rounding.
KnownFieldFit FitKnownField(const std::vector<Eigen::Vector3d>& readings,
                            const std::vector<Eigen::Vector3d>& fields,
                            double thin = 4.0 * std::numeric_limits<double>::epsilon());

/// The fit of a triad in attitudes that a fixture states, in a field of unknown direction.
struct FixtureFit {
  TriadModel<double> model;  ///< In the body frame that the attitudes define.
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< Of the field in the fixture.
};

/// Least squares for y = S R_k^T (strength * u) + b with a full S and an unknown unit vector u. For
/// a given u the problem is linear in S and b, so that only the two angles of u are searched, on a
/// grid and then by Gauss-Newton (variable projection, Golub and Pereyra 1973). (S, u) and (-S, -u)
/// are the same solution: det S > 0 is returned. Exact for exact readings. Error (not enough):
/// fewer than five poses, or attitudes that do not determine the solution.
Result<FixtureFit> FitInFixture(const std::vector<Eigen::Vector3d>& readings,
                                const std::vector<Eigen::Quaterniond>& fixture_from_body,
                                double strength);

}  // namespace truetriad
