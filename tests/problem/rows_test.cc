// SPDX-License-Identifier: Apache-2.0
//
// Every row of the problem: the derivative that is written by hand against that of the same row by
// Ceres' Jets, along the manifolds of attitudes and directions.
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <ceres/dynamic_autodiff_cost_function.h>
#include <ceres/gradient_checker.h>
#include <ceres/manifold.h>
#include <ceres/sphere_manifold.h>
#include <gtest/gtest.h>

#include "math/random.h"
#include "problem/graph_rows.h"
#include "problem/pose_node.h"
#include "problem/rows/accelerometer_row.h"
#include "problem/rows/attitude_row.h"
#include "problem/rows/face_row.h"
#include "problem/rows/gyroscope_row.h"
#include "problem/rows/known_rate_row.h"
#include "problem/rows/known_speed_row.h"
#include "problem/rows/magnetometer_row.h"
#include "problem/rows/prior_row.h"
#include "problem/rows/turn_row.h"
#include "problem/rows/whitened_row.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace rows_test {

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kGyro = Triad::kGyroscope;
constexpr Triad kMag = Triad::kMagnetometer;
using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A layout with every term of every triad, at a point that is nobody's optimum.
struct Everything {
  SharedLayout layout;
  Eigen::VectorXd shared;
};

Everything WithEveryTerm(Random* random) {
  ThermalOptions terms;
  terms.bias_order = ThermalOptions::kMaxBiasOrder;
  terms.matrix_order = ThermalOptions::kMaxMatrixOrder;
  terms.rate = PerRateTerm<bool>::All(true);
  Everything all;
  SharedLayout& layout = all.layout;
  int size = 0;
  const auto take = [&size](int count) { return std::exchange(size, size + count); };
  for (const Triad triad : kTriads) {
    layout.bias[triad] = take(3);
    layout.sensitivity[triad] = take(9);
    layout.thermal[triad] = {size, terms};
    take(layout.thermal[triad].size());
    layout.sessions[triad] = {size, {0, 1, 2}, 3};
    take(layout.sessions[triad].size());
  }
  for (const AxisTermInfo& info : kAxisTerms) {
    layout.axis_terms[info.triad].push_back({info.term, take(3)});
  }
  layout.g_sensitivity = take(9);
  layout.reference = take(kReferenceSize);
  layout.face_tilt[3] = take(2);
  layout.thermal_scale = {25.0, 10.0, 40.0, 0.02};
  layout.earth_rate_radps << 0.6, 0.3, 0.7;  // as fast as a double needs to see it
  layout.size = size;
  layout.basis.setIdentity(size, size);
  all.shared.resize(size);
  for (double& value : all.shared) value = random->Normal();
  // Readings of 10 to 50: higher terms of some per cent.
  for (const Triad triad : kTriads) {
    for (const auto& [term, at] : layout.axis_terms[triad]) {
      all.shared.segment<3>(at) *= 0.02 / InfoOf(term).PowerOf(10.0);
    }
  }
  all.shared.segment<kReferenceSize>(layout.reference) << 9.8, 48.0, 1.1, 0.3, 0.1, -0.2;
  return all;
}

// Without temperature terms, for what depends on them only by its blocks.
Everything WithoutTemperature(Random* random) {
  Everything all = WithEveryTerm(random);
  for (const Triad triad : kTriads) {
    all.layout.thermal[triad] = {};
    all.layout.sessions[triad] = {};
  }
  return all;
}

ThermalFactors SomeFactors(const SharedLayout& layout, Triad triad, Random* random) {
  const double degc = random->Uniform(-30.0, 50.0), rate_degcps = random->Uniform(-0.02, 0.02);
  return layout.FactorsOf(triad, degc, rate_degcps, random->Below(3));
}

PoseValues RandomState(PoseKind kind, Random* random) {
  if (kind == PoseKind::kRotation) return ValuesOf(random->Rotation());
  const Eigen::Vector3d direction = random->Normal3().normalized();
  return {direction.x(), direction.y(), direction.z(), 0.0};
}

// A row as a functor for Ceres' dynamic differentiation.
template <typename RowType>
struct Functor {
  const RowType* row;
  template <typename T>
  bool operator()(T const* const* parameters, T* residuals) const {
    return (*row)(parameters, residuals);
  }
};

// d row / d block, along the manifold where the block is a state.
struct Derivatives {
  Eigen::VectorXd residual;
  std::vector<Eigen::MatrixXd> by_block;
};

Derivatives DerivativesOf(const ceres::CostFunction& cost,
                          const Row& row,
                          const Everything& all,
                          const std::vector<PoseValues>& states) {
  std::vector<const double*> parameters;
  for (const SharedBlock& block : row.shared_blocks()) {
    parameters.push_back(all.shared.data() + block.offset);
  }
  for (const PoseValues& state : states) parameters.push_back(state.data());
  const int rows = row.num_residuals();
  std::vector<RowMajorMatrix> jacobians;
  for (const int size : row.parameter_block_sizes()) {
    jacobians.push_back(RowMajorMatrix::Constant(rows, size, 1e300));  // every entry must be set
  }
  std::vector<double*> pointers;
  for (RowMajorMatrix& jacobian : jacobians) pointers.push_back(jacobian.data());
  Derivatives derivatives;
  derivatives.residual.resize(rows);
  EXPECT_TRUE(cost.Evaluate(parameters.data(), derivatives.residual.data(), pointers.data()));
  const ceres::EigenQuaternionManifold quaternions;
  const ceres::SphereManifold<3> sphere;
  for (std::size_t i = 0; i < jacobians.size(); ++i) {
    if (i < row.shared_blocks().size()) {
      derivatives.by_block.emplace_back(jacobians[i]);
      continue;
    }
    const ceres::Manifold& manifold = jacobians[i].cols() == kAttitudeSize
                                          ? static_cast<const ceres::Manifold&>(quaternions)
                                          : sphere;
    RowMajorMatrix plus(manifold.AmbientSize(), manifold.TangentSize());
    manifold.PlusJacobian(parameters[i], plus.data());
    derivatives.by_block.emplace_back(jacobians[i] * plus);
  }
  return derivatives;
}

void ExpectSame(const Derivatives& found, const Derivatives& expected, double tolerance) {
  EXPECT_LT((found.residual - expected.residual).norm(), 1e-12 * (1.0 + expected.residual.norm()));
  for (std::size_t i = 0; i < found.by_block.size(); ++i) {
    const double size = 1.0 + expected.by_block[i].norm();
    EXPECT_LT((found.by_block[i] - expected.by_block[i]).norm(), tolerance * size) << "block " << i;
  }
}

// Both are exact but for rounding: some hundred operations on numbers of some hundreds.
template <typename RowType>
void ExpectJetsAgree(const RowType& row,
                     const Everything& all,
                     const std::vector<PoseValues>& states) {
  ASSERT_EQ(row.state_count(), states.size());
  ceres::DynamicAutoDiffCostFunction<Functor<RowType>> by_jets(new Functor<RowType>{&row});
  for (const int size : row.parameter_block_sizes()) by_jets.AddParameterBlock(size);
  by_jets.SetNumResiduals(row.num_residuals());
  ExpectSame(DerivativesOf(row, row, all, states), DerivativesOf(by_jets, row, all, states), 1e-11);
}

class FieldRows : public ::testing::TestWithParam<PoseKind> {};

TEST_P(FieldRows, HaveTheDerivativesOfTheirPrediction) {
  Random random(17);
  for (int repeat = 0; repeat < 20; ++repeat) {
    const Everything all = WithEveryTerm(&random);
    FieldRow::Reading reading{10.0 * random.Normal3(), Eigen::Matrix3d::Identity(), {}};
    if (GetParam() == PoseKind::kRotation) {
      reading.mean_turn = 0.9 * random.Rotation().toRotationMatrix();
    }
    const std::vector<PoseValues> state = {RandomState(GetParam(), &random)};
    reading.thermal = SomeFactors(all.layout, kAccel, &random);
    ExpectJetsAgree(AccelerometerRow(all.layout, GetParam(), reading), all, state);
    reading.thermal = SomeFactors(all.layout, kMag, &random);
    ExpectJetsAgree(MagnetometerRow(all.layout, GetParam(), reading), all, state);
    if (GetParam() != PoseKind::kRotation) continue;
    reading.turning = std::make_shared<const Turning>(Turning{
        random.Uniform(-0.1, 0.1), random.Uniform(0.0, 0.01), random.Normal3(), random.Normal3()});
    ExpectJetsAgree(MagnetometerRow(all.layout, GetParam(), reading), all, state);
  }
}

// A body that turns steadily, by the field's own turn and by that of a gyroscope of other axes.
TEST(FieldRowOfMotion, FollowsTheGyroscopeThatTurnedItsReadings) {
  Random random(18);
  const Everything all = WithEveryTerm(&random);
  constexpr double kChange = 1e-4;
  for (int repeat = 0; repeat < 20; ++repeat) {
    const Eigen::Vector3d rate = 2.0 * random.Normal3(), other = rate + kChange * random.Normal3();
    const Eigen::Vector3d times = 0.02 * random.Normal3();
    const auto mean_turn = [&](const Eigen::Vector3d& radps) {
      Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
      for (const double time_s : times) sum += RotationExp(-time_s * radps).toRotationMatrix();
      return Eigen::Matrix3d(sum / 3.0);
    };
    const Eigen::Map<const Eigen::Matrix3d> sensitivity(all.shared.data() +
                                                        all.layout.sensitivity[kGyro]);
    const Eigen::Map<const Eigen::Vector3d> bias(all.shared.data() + all.layout.bias[kGyro]);
    FieldRow::Reading reading{10.0 * random.Normal3(), mean_turn(rate), {}};
    reading.thermal = SomeFactors(all.layout, kMag, &random);
    // What it read is, by the parameters as they are, the other rate.
    reading.turning = std::make_shared<const Turning>(Turning{
        times.mean(), times.squaredNorm() / 3.0, rate, sensitivity * other + bias});
    FieldRow::Reading stays = reading, again = reading;
    stays.turning = again.turning = nullptr;
    again.mean_turn = mean_turn(other);
    const std::vector<PoseValues> state = {RandomState(PoseKind::kRotation, &random)};
    const auto residual_of = [&](const FieldRow::Reading& of) {
      const MagnetometerRow row(all.layout, PoseKind::kRotation, of);
      return DerivativesOf(row, row, all, state).residual;
    };
    // Of the change what is left out is its square of 0.02 s times 3.5 rad/s and less.
    const double change = (residual_of(stays) - residual_of(again)).norm();
    EXPECT_LT((residual_of(reading) - residual_of(again)).norm(), 0.03 * change) << repeat;
  }
}

INSTANTIATE_TEST_SUITE_P(EachState,
                         FieldRows,
                         ::testing::Values(PoseKind::kRotation, PoseKind::kDirection));

TEST(GyroscopeRow, HasTheDerivativesOfItsPrediction) {
  Random random(18);
  for (int repeat = 0; repeat < 20; ++repeat) {
    Everything all = WithEveryTerm(&random);
    const ThermalFactors factors = SomeFactors(all.layout, kGyro, &random);
    const Eigen::Vector3d reading = 10.0 * random.Normal3();
    const std::vector<PoseValues> attitude = {RandomState(PoseKind::kRotation, &random)};
    ExpectJetsAgree(GyroscopeRow(all.layout, PoseKind::kRotation, factors, reading), all, attitude);
    // The earth's rate needs an attitude.
    all.layout.earth_rate_radps.setZero();
    ExpectJetsAgree(GyroscopeRow(all.layout, PoseKind::kDirection, factors, reading),
                    all,
                    {RandomState(PoseKind::kDirection, &random)});
    all.layout.g_sensitivity = -1;
    ExpectJetsAgree(GyroscopeRow(all.layout, PoseKind::kRotation, factors, reading), all, {});
  }
}

TEST(KnownRateRow, HasTheDerivativesOfItsPrediction) {
  Random random(19);
  for (int repeat = 0; repeat < 20; ++repeat) {
    const Everything all = WithEveryTerm(&random);
    const KnownRateRow row(all.layout,
                           SomeFactors(all.layout, kGyro, &random),
                           2.0 * random.Normal3(),
                           5.0 * random.Normal3(),
                           10.0 * random.Normal3());
    ExpectJetsAgree(row, all, {});
  }
}

TEST(KnownSpeedRow, HasTheDerivativesOfItsPrediction) {
  Random random(23);
  for (int repeat = 0; repeat < 20; ++repeat) {
    const Everything all = WithEveryTerm(&random);
    const KnownSpeedRow row(all.layout,
                            SomeFactors(all.layout, kGyro, &random),
                            random.Uniform(0.5, 3.0),
                            5.0 * random.Normal3(),
                            10.0 * random.Normal3());
    ExpectJetsAgree(row, all, {RandomState(PoseKind::kDirection, &random)});
  }
}

// Readings of a turn of a quarter of a radian, of a gyroscope near `all`'s.
GyroMove SomeMove(const Everything& all, Random* random) {
  const TriadModel<double> model = all.layout.ModelOf(kGyro, all.shared.data(), {});
  const Eigen::Vector3d rate = random->Normal3().normalized();
  const Eigen::Vector3d axis = random->Normal3().normalized();
  GyroMove move;
  for (int i = 0; i < 50; ++i) {
    move.time_s.push_back(0.005 * i);
    const Eigen::Vector3d wobble = 0.3 * std::sin(0.1 * i) * axis;
    move.reading_raw.push_back(model.RawFromTruth(Eigen::Vector3d(rate + wobble)));
    move.force_mps2.emplace_back(0.1, 0.2, 9.8);
  }
  return move;
}

// A gyroscope with gains near 1, whose readings can be undone.
void MakeRegular(Everything* all) {
  for (int i = 0; i < 9; ++i) {
    all->shared[all->layout.sensitivity[kGyro] + i] *= 0.05;
    all->shared[all->layout.g_sensitivity + i] *= 0.001;
    if (i % 4 == 0) all->shared[all->layout.sensitivity[kGyro] + i] += 1.0;
  }
}

TEST(TurnRow, HasTheDerivativesOfItsPredictionAwayFromWhereItWasIntegrated) {
  Random random(20);
  for (const bool counts_earth_rate : {false, true}) {
    for (int repeat = 0; repeat < 10; ++repeat) {
      Everything all = WithoutTemperature(&random);
      MakeRegular(&all);
      GyroModel at{all.layout.ModelOf(kGyro, all.shared.data(), {})};
      at.g_sensitivity = Eigen::Map<const Eigen::Matrix3d>(&all.shared[all.layout.g_sensitivity]);
      at.is_bent = true;
      const GyroIncrement increment = IntegrateMove(SomeMove(all, &random),
                                                    at,
                                                    Eigen::Vector3d::Constant(1e-3),
                                                    RateSampling::kInstantaneous);
      all.shared.segment<12>(all.layout.bias[kGyro]) += 0.03 * Eigen::VectorXd::Ones(12);
      all.shared[all.layout.axis_terms[kGyro][0].at] += 0.02;
      all.shared[all.layout.g_sensitivity + 4] += 0.01;
      const TurnRow row(all.layout, {}, counts_earth_rate, &at, &increment);
      const Eigen::Quaterniond first = random.Rotation();
      const Eigen::Quaterniond second =
          first * increment.rotation * RotationExp(0.3 * random.Normal3());
      ExpectJetsAgree(row, all, {ValuesOf(first), ValuesOf(second)});
    }
  }
}

TEST(AttitudeRows, HaveTheDerivativesOfTheirPrediction) {
  Random random(22);
  const Everything all = WithoutTemperature(&random);
  for (int repeat = 0; repeat < 20; ++repeat) {
    const Eigen::Quaterniond attitude = random.Rotation();
    // Away from half a turn, where Log jumps.
    const Eigen::Quaterniond given(
        attitude * Eigen::AngleAxisd(random.Uniform(0.0, 2.5), random.Normal3().normalized()));
    ExpectJetsAgree(AttitudeRow(given), all, {ValuesOf(attitude)});
    ExpectJetsAgree(HeldHeadingRow(given), all, {ValuesOf(attitude)});
  }
}

TEST(FaceRow, HasTheDerivativesOfItsPrediction) {
  Random random(23);
  const Everything all = WithoutTemperature(&random);
  const SharedBlock tilt{all.layout.face_tilt[3], 2};
  for (const PoseKind kind : {PoseKind::kRotation, PoseKind::kDirection}) {
    ExpectJetsAgree(FaceRow(3, tilt, kind), all, {RandomState(kind, &random)});
  }
}

TEST(PriorRow, IsTheDistanceOfOneEntryFromItsMean) {
  Random random(24);
  const Everything all = WithoutTemperature(&random);
  const PriorRow row({all.layout.sensitivity[kMag], 9}, 4, 0.5);
  const Derivatives derivatives = DerivativesOf(row, row, all, {});
  EXPECT_EQ(derivatives.residual[0], all.shared[all.layout.sensitivity[kMag] + 4] - 0.5);
  EXPECT_EQ(derivatives.by_block[0], Eigen::RowVectorXd(Eigen::RowVectorXd::Unit(9, 4)));
}

// What the model does not have is no parameter block of a row.
TEST(Rows, HaveNoBlockOfATermThatIsNotThere) {
  SharedLayout layout;
  layout.bias[kAccel] = 0;
  layout.sensitivity[kAccel] = 3;
  layout.bias[kGyro] = 12;
  layout.sensitivity[kGyro] = 15;
  layout.reference = 24;
  layout.size = 24 + kReferenceSize;
  const auto sizes = [](const Row& row) {
    return std::vector<int>(row.parameter_block_sizes().begin(), row.parameter_block_sizes().end());
  };
  EXPECT_EQ(sizes(AccelerometerRow(layout, PoseKind::kRotation, {})),
            (std::vector<int>{3, 9, 6, 4}));
  EXPECT_EQ(sizes(AccelerometerRow(layout, PoseKind::kDirection, {})),
            (std::vector<int>{3, 9, 6, 3}));
  EXPECT_EQ(sizes(GyroscopeRow(layout, PoseKind::kRotation, {}, {})), (std::vector<int>{3, 9}));
  layout.thermal[kAccel] = {30, {}};
  layout.thermal[kAccel].terms.bias_order = 2;
  layout.thermal[kAccel].terms.matrix_order = 1;
  EXPECT_EQ(sizes(AccelerometerRow(layout, PoseKind::kRotation, {})),
            (std::vector<int>{3, 9, 3, 3, 9, 6, 4}));
}

PoseNode MakeNode(PoseKind kind, Random* random) {
  PoseNode node;
  node.kind = kind;
  for (const Triad triad : {kAccel, kMag}) {
    if (kind == PoseKind::kDirection && triad == kMag) continue;
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
  node.state = RandomState(kind, random);
  if (kind == PoseKind::kRotation) {
    node.has_attitude_prior = true;
    const Eigen::Vector3d axis = random->Normal3().normalized();
    node.prior_world_from_body =
        node.rotation() * Eigen::AngleAxisd(random->Uniform(0.0, 2.5), axis);
    node.prior_sigma_rad << 0.1, 0.2, 0.3;
  }
  return node;
}

// Central differences along the tangent space: their error falls with the square of the step, 1e-10
// of the residual here, and rounding leaves 1e-11 of it.
TEST(PoseNode, StepsAlongTheTangentSpaceOfItsJacobian) {
  constexpr double kStep = 1e-5;
  Random random(29);
  for (const PoseKind kind : {PoseKind::kRotation, PoseKind::kDirection}) {
    const Everything all = WithoutTemperature(&random);
    const PoseNode node = MakeNode(kind, &random);
    const auto evaluate = [&](const PoseNode& at, PoseStateJacobian* jacobian) {
      PoseResidual12 residual;
      at.Evaluate(all.layout, all.shared.data(), at.state.data(), &residual, nullptr, jacobian);
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

TEST(WhitenedRow, IsItsRowTimesTheRoot) {
  Random random(6);
  const Everything all = WithoutTemperature(&random);
  FieldRow::Reading reading;
  reading.mean_raw = random.Normal3();
  const auto row = std::make_shared<AccelerometerRow>(all.layout, PoseKind::kRotation, reading);
  const RowRoot root = Eigen::Matrix3d::NullaryExpr([&] { return random.Normal(); });
  const WhitenedRow whitened(row, root);
  const std::vector<PoseValues> state = {RandomState(PoseKind::kRotation, &random)};
  Derivatives expected = DerivativesOf(*row, *row, all, state);
  expected.residual = root * expected.residual;
  for (Eigen::MatrixXd& by_block : expected.by_block) by_block = root * by_block;
  ExpectSame(DerivativesOf(whitened, *row, all, state), expected, 1e-13);
}

}  // namespace rows_test
}  // namespace truetriad
