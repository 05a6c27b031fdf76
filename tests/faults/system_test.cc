// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "faults/fault_system.h"
#include "faults/fault_test.h"
#include "faults/fault_trials.h"
#include "faults/log_tail.h"
#include "faults/scan.h"
#include "faults/scene.h"

namespace truetriad {
namespace system_test {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// The system of a FaultSystem, but straight from its formulas: all rows and all unknowns in one
// matrix, attitudes too, whitened and factored by QR.
struct Dense {
  VectorXd r;
  MatrixXd J, V;            // J: free shared coordinates, then attitudes
  std::vector<MatrixXd> D;  // dV / d excess
  Eigen::Index shared = 0;

  MatrixXd P, C;  // projector and covariance of all unknowns
  double log_determinant = 0.0;

  // Factors the system with further columns Z, whose unknowns have σ.
  void Factor(const MatrixXd& Z, const VectorXd& sigma) {
    const Eigen::Index rows = r.size(), all = J.cols() + Z.cols();
    const MatrixXd W = V.llt().matrixL().solve(MatrixXd::Identity(rows, rows));
    MatrixXd whole = MatrixXd::Zero(rows + Z.cols(), all);
    whole.topLeftCorner(rows, J.cols()) = W * J;
    whole.topRightCorner(rows, Z.cols()) = W * Z;
    whole.bottomRightCorner(Z.cols(), Z.cols()) = sigma.cwiseInverse().asDiagonal();
    const VectorXd scale = whole.colwise().norm().cwiseInverse();
    const Eigen::HouseholderQR<MatrixXd> qr(whole * scale.asDiagonal());
    const MatrixXd Q = (qr.householderQ() * MatrixXd::Identity(whole.rows(), all)).topRows(rows);
    P = W.transpose() * (MatrixXd::Identity(rows, rows) - Q * Q.transpose()) * W;
    const MatrixXd R = qr.matrixQR().topRows(all).triangularView<Eigen::Upper>();
    const MatrixXd inverse =
        scale.asDiagonal() * R.triangularView<Eigen::Upper>().solve(MatrixXd::Identity(all, all));
    C = inverse * inverse.transpose();
    log_determinant = 2.0 * R.diagonal().cwiseAbs().array().log().sum() -
                      2.0 * scale.array().log().sum() - 2.0 * W.diagonal().array().log().sum();
  }
};

Dense DenseOf(const PoseGraph& graph, const std::vector<NoiseComponent>& components) {
  const FaultSystem system(ReducedSystem(graph), graph, components);
  Dense dense;
  const Eigen::Index rows = system.residual().size();
  dense.shared = graph.layout.free_size();
  dense.r.resize(rows);
  dense.J = MatrixXd::Zero(rows, dense.shared + 3 * std::ssize(graph.nodes));
  dense.V = MatrixXd::Zero(rows, rows);
  dense.D.assign(components.size(), MatrixXd::Zero(rows, rows));
  PoseSharedJacobian by_shared;
  Eigen::Index row = 0;
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const PoseNode& node = graph.nodes[k];
    PoseResidual12 residual;
    PoseStateJacobian by_state;
    node.Evaluate(
        graph.layout, graph.shared.data(), node.state.data(), &residual, &by_shared, &by_state);
    const Eigen::Index count = residual.size();
    dense.r.segment(row, count) = residual;
    dense.J.block(row, 0, count, dense.shared) = by_shared * graph.layout.basis;
    dense.J.block(row, dense.shared + 3 * static_cast<Eigen::Index>(k), count, 3) = by_state;
    dense.V.block(row, row, count, count) = MatrixXd(node.Information()).inverse();
    row += count;
  }
  for (const IncrementEdge& edge : graph.increments) {
    Eigen::Vector3d residual;
    Eigen::Matrix3d first, second;
    edge.Evaluate(graph.layout,
                  graph.shared.data(),
                  graph.nodes[edge.from].state.data(),
                  graph.nodes[edge.from + 1].state.data(),
                  &residual,
                  &by_shared,
                  &first,
                  &second);
    dense.r.segment<3>(row) = residual;
    dense.J.block(row, 0, 3, dense.shared) = by_shared * graph.layout.basis;
    const Eigen::Index at = dense.shared + 3 * static_cast<Eigen::Index>(edge.from);
    dense.J.block<3, 3>(row, at) = first;
    dense.J.block<3, 3>(row, at + 3) = second;
    dense.V.block<3, 3>(row, row) = edge.variance;
    row += 3;
  }
  for (const VariancePart& part : PartsOf(graph)) {
    for (std::size_t c = 0; c < components.size(); ++c) {
      if (components[c] != part.component) continue;
      const Eigen::Index at = system.factors()[part.factor].row + part.row;
      dense.D[c].block<3, 3>(at, at) = part.unit;
    }
  }
  return dense;
}

struct Case {
  SettledModel settled;
  FaultColumn taken, tested;
};

Case MakeCase(std::uint64_t seed) {
  Random random(seed);
  Case made{trials::Settled(trials::MakeFaultTrial({.poses = 9, .scatter = 1.0}, &random)), {}, {}};
  // Every component has some excess, also where the draw had none.
  for (const NoiseComponent component : made.settled.noise.estimated) {
    made.settled.noise.excess[component] =
        0.7 * MeanKnownVariance(made.settled.graph, component) * (1.0 + random.Uniform());
  }
  ApplyExcess(made.settled.noise.excess, &made.settled.graph);
  const FaultScene scene(made.settled.graph);
  const ScannedForm world(scene.ColumnsOf(Triad::kMagnetometer, FaultForm::kWorld), false);
  const ScannedForm bias(scene.ColumnsOf(Triad::kGyroscope, FaultForm::kBias), false);
  made.taken = world.Column(WeightsOf(FaultShape::kStep, {4, 9}, scene));
  made.tested = bias.Column(WeightsOf(FaultShape::kDrift, {0, 9}, scene));
  return made;
}

MatrixXd AllRows(const FaultColumn& column, Eigen::Index rows) {
  AddedColumns added;
  added.Append(column, VectorXd::Ones(column.unknowns), rows);
  return added.Z;
}

void ExpectNear(const MatrixXd& found, const MatrixXd& expected, double share, const char* what) {
  ASSERT_EQ(found.rows(), expected.rows()) << what;
  EXPECT_LE((found - expected).norm(), share * (expected.norm() + 1e-300)) << what << "\n"
                                                                           << found << "\nfor\n"
                                                                           << expected;
}

TEST(FaultSystem, IsThatOfAllRowsAndUnknownsInOneMatrix) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const Case made = MakeCase(seed);
    const PoseGraph& graph = made.settled.graph;
    const auto& components = made.settled.noise.estimated;
    ASSERT_GE(components.size(), 3U);
    Dense dense = DenseOf(graph, components);
    FaultSystem system(ReducedSystem(graph), graph, components);
    const Eigen::Index rows = dense.r.size();
    dense.Factor(MatrixXd(rows, 0), VectorXd());
    const double likelihood_without =
        -0.5 * (dense.log_determinant + dense.r.dot(dense.P * dense.r));
    const double found_without = system.LogLikelihood();

    AddedColumns added;
    added.Append(made.taken, VectorXd::Constant(made.taken.unknowns, 0.3), rows);
    system.TakeIn(graph, added);
    dense.Factor(added.Z, added.sigma);
    ExpectNear(system.q(), dense.P * dense.r, 1e-6, "P r");
    ExpectNear(system.SharedCovariance(),
               dense.C.topLeftCorner(dense.shared, dense.shared),
               1e-6,
               "covariance");
    ExpectNear(system.h_covariance(), dense.C.bottomRightCorner(3, 3), 1e-6, "of h");
    MatrixXd whole(rows, dense.J.cols() + 3);
    whole << dense.J, added.Z;
    const MatrixXd right = whole.transpose() * dense.V.inverse();
    ExpectNear(system.h(), -(dense.C * (right * dense.r)).tail(3), 1e-6, "h");
    const MatrixXd Z = AllRows(made.tested, rows);
    ExpectNear(system.SharedShift(made.tested),
               -(dense.C * (right * Z)).topRows(dense.shared),
               1e-6,
               "shift");
    ExpectNear(system.Projected(made.tested), dense.P * Z, 1e-6, "P Z");
    ExpectNear(system.Projected(StackedRows(Z)), dense.P * Z, 1e-6, "P Z by rows");
    for (std::size_t c = 0; c < components.size(); ++c) {
      const auto at = static_cast<Eigen::Index>(c);
      const MatrixXd PD = dense.P * dense.D[c];
      EXPECT_NEAR(system.traces()[at], PD.trace(), 1e-6 * PD.trace());
      for (std::size_t d = 0; d < components.size(); ++d) {
        const double expected = 0.5 * (PD * dense.P * dense.D[d]).trace();
        const double size = std::sqrt(system.fisher()(at, at) *
                                      system.fisher().diagonal()[static_cast<Eigen::Index>(d)]);
        EXPECT_NEAR(system.fisher()(at, static_cast<Eigen::Index>(d)), expected, 1e-6 * size);
      }
    }
    const double likelihood =
        -0.5 * (dense.log_determinant + 2.0 * added.sigma.array().log().sum() +
                dense.r.dot(dense.P * dense.r));
    EXPECT_NEAR(system.LogLikelihood() - found_without, likelihood - likelihood_without, 1e-4);
  }
}

// Steps 1 and 2 of the test, by matrices of all rows.
TEST(FaultTest, IsWhatItsFormulasSay) {
  for (std::uint64_t seed = 11; seed <= 15; ++seed) {
    SCOPED_TRACE(seed);
    const Case made = MakeCase(seed);
    const PoseGraph& graph = made.settled.graph;
    const auto& components = made.settled.noise.estimated;
    const auto count = static_cast<Eigen::Index>(components.size());
    Dense dense = DenseOf(graph, components);
    const Eigen::Index rows = dense.r.size();
    dense.Factor(MatrixXd(rows, 0), VectorXd());
    const MatrixXd Z = AllRows(made.tested, rows);
    ExcessState excess;
    excess.v.resize(count), excess.rest.resize(count), excess.least = VectorXd::Zero(count);
    for (Eigen::Index c = 0; c < count; ++c) {
      excess.v[c] = made.settled.noise.excess[components[static_cast<std::size_t>(c)]];
      excess.rest[c] = MeanKnownVariance(graph, components[static_cast<std::size_t>(c)]);
    }

    const MatrixXd T =
        MatrixXd((Z.transpose() * dense.P * Z).llt().matrixL()).inverse().transpose();
    const MatrixXd Y = dense.P * Z * T;
    const VectorXd z = T.transpose() * Z.transpose() * dense.P * dense.r;
    const MatrixXd P1 = dense.P - Y * Y.transpose();
    VectorXd score(count);
    MatrixXd F1(count, count);
    for (Eigen::Index c = 0; c < count; ++c) {
      const MatrixXd& Dc = dense.D[static_cast<std::size_t>(c)];
      score[c] = 0.5 * (dense.r.dot(P1 * Dc * P1 * dense.r) - (P1 * Dc).trace());
      for (Eigen::Index d = 0; d < count; ++d) {
        F1(c, d) = 0.5 * (P1 * Dc * P1 * dense.D[static_cast<std::size_t>(d)]).trace();
      }
    }
    // Tries all patterns of active bounds.
    VectorXd v = excess.v;
    double best = -1e300;
    for (int pattern = 0; pattern < (1 << count); ++pattern) {
      VectorXd step = VectorXd::Zero(count);
      std::vector<Eigen::Index> free;
      for (Eigen::Index c = 0; c < count; ++c) {
        if ((pattern >> c) & 1)
          step[c] = -excess.v[c];
        else
          free.push_back(c);
      }
      if (!free.empty()) {
        const VectorXd own = VectorXd(score - F1 * step)(free);
        const VectorXd scale = F1.diagonal()(free).cwiseSqrt().cwiseInverse();
        const MatrixXd balanced =
            scale.asDiagonal() * MatrixXd(F1(free, free)) * scale.asDiagonal();
        const VectorXd solved = scale.asDiagonal() * balanced.inverse() * scale.asDiagonal() * own;
        for (std::size_t i = 0; i < free.size(); ++i)
          step[free[i]] = solved[static_cast<Eigen::Index>(i)];
      }
      const double gain = score.dot(step) - 0.5 * step.dot(F1 * step);
      if (((excess.v + step).array() < -1e-12 * excess.v.array()).any() || gain <= best) continue;
      best = gain;
      v = (excess.v + step).cwiseMax(0.0);
    }
    MatrixXd M = MatrixXd::Identity(3, 3);
    for (Eigen::Index c = 0; c < count; ++c) {
      M += (v[c] - excess.v[c]) * Y.transpose() * dense.D[static_cast<std::size_t>(c)] * Y;
    }
    VectorXd g(count);
    for (Eigen::Index c = 0; c < count; ++c) {
      g[c] = (M.inverse() * Y.transpose() * dense.D[static_cast<std::size_t>(c)] * Y).trace() /
             3.0 * (v[c] + excess.rest[c]) / (excess.v[c] + excess.rest[c]);
    }
    const VectorXd scale = F1.diagonal().cwiseSqrt().cwiseInverse();
    const VectorXd scaled_g = scale.cwiseProduct(g);
    const double dof =
        2.0 / scaled_g.dot((scale.asDiagonal() * F1 * scale.asDiagonal()).inverse() * scaled_g);

    const FaultSystem system(ReducedSystem(graph), graph, components);
    const StackedRows projected = system.Projected(made.tested);
    const ColumnSums sums{made.tested.Transposed(projected),
                          made.tested.TransposedVector(system.q()),
                          system.Squares(made.tested)};
    const FaultTest test = TestOf(system, excess, projected, sums);
    ASSERT_EQ(test.rank, 3);
    EXPECT_NEAR(test.dof, dof, 1e-4 * dof);
    const double X = z.dot(M.inverse() * z);
    EXPECT_NEAR(test.log_p, LogFisherUpper(X / 3.0, 3.0, dof), 1e-4);
    ExpectNear(test.h, -T * z, 1e-5, "h");
    EXPECT_NEAR(QuickTestOf(sums).square, z.squaredNorm(), 1e-5 * z.squaredNorm());
  }
}

// Beyond a thousand rows P is not formed; the results are the same.
TEST(FaultSystem, SaysTheSameByRowsAsByItsMatrix) {
  const Case made = MakeCase(21);
  const auto& components = made.settled.noise.estimated;
  const ReducedSystem reduced(made.settled.graph);
  FaultSystem dense(reduced, made.settled.graph, components);
  FaultSystem by_rows(reduced, made.settled.graph, components, 0);
  AddedColumns added;
  added.Append(made.taken, VectorXd::Constant(3, 0.3), dense.residual().size());
  dense.TakeIn(made.settled.graph, added);
  by_rows.TakeIn(made.settled.graph, added);
  ExpectNear(by_rows.traces(), dense.traces(), 1e-8, "traces");
  // What columns take of the information is only bounded there: never less than the exact amount.
  EXPECT_TRUE(
      (by_rows.fisher().diagonal().array() <= 1.000001 * dense.fisher().diagonal().array()).all());
  ExpectNear(by_rows.fisher(), dense.fisher(), 0.1, "information");
  dense.TakeIn(made.settled.graph, {});
  by_rows.TakeIn(made.settled.graph, {});
  ExpectNear(by_rows.fisher(), dense.fisher(), 1e-8, "information of the graph");
  ExpectNear(by_rows.Projected(made.tested), dense.Projected(made.tested), 1e-6, "P Z");
}

}  // namespace system_test
}  // namespace truetriad
