// SPDX-License-Identifier: Apache-2.0
#include "problem/pose_node.h"

#include <memory>

#include <ceres/gradient_checker.h>
#include <ceres/manifold.h>
#include <ceres/sphere_manifold.h>
#include <gtest/gtest.h>

#include "math/random.h"
#include "solve/shared_blocks.h"
#include "support/pose_cost.h"

namespace truetriad {
namespace {

// A layout with both triads, a higher term of each and one face, at a point that is nobody's
// optimum.
struct Fixture {
  SharedLayout layout;
  Eigen::VectorXd shared;
};

Fixture MakeFixture(Random* random) {
  Fixture fixture;
  fixture.layout.bias[Triad::kAccelerometer] = 0;
  fixture.layout.sensitivity[Triad::kAccelerometer] = 3;
  fixture.layout.bias[Triad::kMagnetometer] = 12;
  fixture.layout.sensitivity[Triad::kMagnetometer] = 15;
  fixture.layout.quadratic[Triad::kAccelerometer] = 24;
  fixture.layout.asymmetry[Triad::kMagnetometer] = 27;
  fixture.layout.reference = 30;
  fixture.layout.face_tilt[3] = 30 + kReferenceSize;
  fixture.layout.size = 30 + kReferenceSize + 2;
  fixture.layout.basis.setIdentity(fixture.layout.size, fixture.layout.size);
  fixture.shared.resize(fixture.layout.size);
  for (double& value : fixture.shared) value = random->Normal();
  // Of readings of 10 to 50: higher terms of some per cent.
  fixture.shared.segment<6>(24) *= 0.002;
  fixture.shared.segment<4>(30) << 9.8, 48.0, 1.1, 0.3;
  return fixture;
}

PoseNode MakeNode(PoseKind kind, Random* random) {
  PoseNode node;
  node.kind = kind;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (kind == PoseKind::kDirection && triad == Triad::kMagnetometer) continue;
    Observation observation;
    observation.triad = triad;
    observation.mean_raw = 10.0 * random->Normal3();
    const Eigen::Matrix3d root =
        Eigen::Matrix3d::NullaryExpr([random] { return random->Normal(); });
    observation.variance = root * root.transpose() + 0.1 * Eigen::Matrix3d::Identity();
    observation.weight = 0.7;
    node.observations.push_back(observation);
  }
  node.face = 3;
  node.seat_sigma_rad = 0.1;
  if (kind == PoseKind::kDirection) {
    const Eigen::Vector3d up = random->Normal3().normalized();
    node.state = {up.x(), up.y(), up.z(), 0.0};
  } else {
    const Eigen::Quaterniond q = random->Rotation();
    node.state = {q.x(), q.y(), q.z(), q.w()};
    node.has_attitude_prior = true;
    // Away from half a turn, where Log jumps.
    const Eigen::Vector3d axis = random->Normal3().normalized();
    node.prior_world_from_body = q * Eigen::AngleAxisd(random->Uniform(0.0, 2.5), axis);
    node.prior_sigma_rad << 0.1, 0.2, 0.3;
  }
  return node;
}

// Ceres differentiates the cost along the manifolds; entries that are exactly zero are compared
// absolutely, by block norm.
void ExpectJacobiansMatch(const SharedLayout& layout,
                          const Eigen::VectorXd& shared,
                          const PoseNode& node) {
  const PoseCost cost(layout, node);
  const auto blocks = SharedBlocks(layout);
  std::vector<const ceres::Manifold*> manifolds(blocks.size(), nullptr);
  std::unique_ptr<ceres::Manifold> state_manifold;
  if (node.kind == PoseKind::kDirection) {
    state_manifold = std::make_unique<ceres::SphereManifold<3>>();
  } else {
    state_manifold = std::make_unique<ceres::EigenQuaternionManifold>();
  }
  manifolds.push_back(state_manifold.get());
  std::vector<const double*> parameters;
  for (const SharedBlock& block : blocks) parameters.push_back(shared.data() + block.offset);
  parameters.push_back(node.state.data());
  ceres::NumericDiffOptions numeric;
  numeric.ridders_relative_initial_step_size = 1e-4;  // short of the kink of an asymmetry
  const ceres::GradientChecker checker(&cost, &manifolds, numeric);
  ceres::GradientChecker::ProbeResults results;
  checker.Probe(parameters.data(), 1.0, &results);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const double size = 1.0 + results.local_numeric_jacobians[i].norm();
    // Ridders' method in double precision: about nine digits.
    EXPECT_LT((results.local_jacobians[i] - results.local_numeric_jacobians[i]).norm(), 1e-7 * size)
        << "block " << i;
  }
}

void ExpectJacobiansMatch(PoseKind kind) {
  Random random(17);
  for (int repeat = 0; repeat < 20; ++repeat) {
    const Fixture fixture = MakeFixture(&random);
    ExpectJacobiansMatch(fixture.layout, fixture.shared, MakeNode(kind, &random));
  }
}

TEST(PoseCost, JacobianMatchesFiniteDifferencesForARotation) {
  ExpectJacobiansMatch(PoseKind::kRotation);
}

TEST(PoseCost, JacobianMatchesFiniteDifferencesForADirection) {
  ExpectJacobiansMatch(PoseKind::kDirection);
}

// Central differences along the tangent space: their error falls with the square of the step, 1e-10
// of the residual here, and rounding leaves 1e-11 of it.
TEST(PoseNode, StepsAlongTheTangentSpaceOfItsJacobian) {
  constexpr double kStep = 1e-5;
  Random random(29);
  for (const PoseKind kind : {PoseKind::kRotation, PoseKind::kDirection}) {
    const Fixture fixture = MakeFixture(&random);
    const PoseNode node = MakeNode(kind, &random);
    const auto evaluate = [&](const PoseNode& at, PoseStateJacobian* jacobian) {
      PoseResidual12 residual;
      at.Evaluate(
          fixture.layout, fixture.shared.data(), at.state.data(), &residual, nullptr, jacobian);
      return Eigen::VectorXd(residual);
    };
    PoseStateJacobian jacobian;
    const double size = evaluate(node, &jacobian).norm();
    for (int i = 0; i < node.tangent_size(); ++i) {
      PoseNode ahead = node, behind = node;
      ahead.Step(kStep * Eigen::VectorXd::Unit(node.tangent_size(), i));
      behind.Step(-kStep * Eigen::VectorXd::Unit(node.tangent_size(), i));
      const Eigen::VectorXd change = evaluate(ahead, nullptr) - evaluate(behind, nullptr);
      EXPECT_LT((change / (2.0 * kStep) - jacobian.col(i)).norm(), 1e-6 * (size + 1.0));
    }
  }
}

// A gyroscope at rest on an earth that turns as fast as a double needs to see it, with all that it
// can have beside.
TEST(PoseCost, JacobianMatchesFiniteDifferencesWhileTheEarthTurns) {
  Random random(23);
  for (int repeat = 0; repeat < 20; ++repeat) {
    Fixture fixture = MakeFixture(&random);
    SharedLayout& layout = fixture.layout;
    const int at = layout.size;
    layout.bias[Triad::kGyroscope] = at;
    layout.sensitivity[Triad::kGyroscope] = at + 3;
    layout.g_sensitivity = at + 12;
    layout.size = at + 21;
    layout.earth_rate_radps << 0.6, 0.3, 0.7;
    fixture.shared.conservativeResize(layout.size);
    for (int i = at; i < layout.size; ++i) fixture.shared[i] = random.Normal();
    PoseNode node = MakeNode(PoseKind::kRotation, &random);
    node.observations.push_back(node.observations.front());
    node.observations.back().triad = Triad::kGyroscope;
    node.face = -1;  // three triads and an attitude fill the rows
    ExpectJacobiansMatch(layout, fixture.shared, node);
  }
}

// The weights are those of the stated covariances, block by block.
TEST(PoseNode, SquareRootInformationWhitensEveryRow) {
  Random random(5);
  const PoseNode node = MakeNode(PoseKind::kRotation, &random);
  PoseRowMatrix covariance = PoseRowMatrix::Zero(node.row_count(), node.row_count());
  covariance.block<3, 3>(0, 0) = node.observations[0].variance / node.observations[0].weight;
  covariance.block<3, 3>(3, 3) = node.observations[1].variance / node.observations[1].weight;
  covariance.diagonal().segment<3>(6) = node.prior_sigma_rad.cwiseAbs2();
  covariance.diagonal().segment<2>(9).setConstant(node.seat_sigma_rad * node.seat_sigma_rad);
  const PoseRowMatrix root = node.SquareRootInformation();
  const PoseRowMatrix white = root * covariance * root.transpose();
  // Condition numbers up to some hundreds, times the rounding of a double.
  EXPECT_LT((white - PoseRowMatrix::Identity(11, 11)).norm(), 1e-12);
}

TEST(LinearManifold, PlusAndMinusUndoEachOther) {
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(4, 2);
  basis(0, 0) = 1.0;
  basis(2, 1) = basis(3, 1) = std::sqrt(0.5);
  const LinearManifold manifold(basis);
  const Eigen::Vector4d x(1.0, 2.0, 3.0, 4.0);
  const Eigen::Vector2d delta(0.5, -0.25);
  Eigen::Vector4d y;
  Eigen::Vector2d back;
  ASSERT_TRUE(manifold.Plus(x.data(), delta.data(), y.data()));
  ASSERT_TRUE(manifold.Minus(y.data(), x.data(), back.data()));
  EXPECT_LT((back - delta).norm(), 1e-15);
  EXPECT_EQ(y[1], 2.0);               // held
  EXPECT_EQ(y[3] - 4.0, y[2] - 3.0);  // tied
}

}  // namespace
}  // namespace truetriad
