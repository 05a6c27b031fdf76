// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>

#include "faults/fault_system.h"
#include "faults/fault_test.h"
#include "faults/fault_trials.h"
#include "faults/scan.h"
#include "faults/scene.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace columns_test {

using Eigen::MatrixXd;
using Eigen::Vector3d;

SettledModel NineAxes() {
  Random random(5);
  return trials::Settled(trials::MakeFaultTrial({.poses = 10}, &random));
}

// The rows of a column at `row`, summed over all stretches.
MatrixXd RowsAt(const std::vector<FaultColumn>& columns, Eigen::Index row) {
  MatrixXd sum = MatrixXd::Zero(3, columns.front().unknowns);
  for (const FaultColumn& column : columns) {
    for (const FaultColumn::Block& block : column.blocks) {
      if (block.row == row) sum += block.value;
    }
  }
  return sum;
}

// What one unknown adds to a gyroscope's readings along a turn: u and the rate that are there, the
// attitude, and the largest u and rate of the run.
using TurnError = Vector3d (*)(int unknown,
                               const Vector3d& u,
                               double rate,
                               const Vector3d& up,
                               const Vector3d& field,
                               double largest,
                               double largest_rate);

struct TurnCase {
  FaultForm form;
  TurnError error;
};
const TurnCase kTurnCases[] = {
    {FaultForm::kBias,
     [](int j, const Vector3d&, double, const Vector3d&, const Vector3d&, double, double) {
       return Vector3d(Vector3d::Unit(j));
     }},
    {FaultForm::kGain,
     [](int j, const Vector3d& u, double, const Vector3d&, const Vector3d&, double, double) {
       return Vector3d(u[j] * Vector3d::Unit(j));
     }},
    {FaultForm::kSize,
     [](int j, const Vector3d& u, double, const Vector3d&, const Vector3d&, double most, double) {
       return Vector3d(std::abs(u[j]) / most * Vector3d::Unit(j));
     }},
    {FaultForm::kSquare,
     [](int j, const Vector3d& u, double, const Vector3d&, const Vector3d&, double most, double) {
       return Vector3d(std::pow(u[j] / most, 2) * Vector3d::Unit(j));
     }},
    {FaultForm::kCube,
     [](int j, const Vector3d& u, double, const Vector3d&, const Vector3d&, double most, double) {
       return Vector3d(std::pow(u[j] / most, 3) * Vector3d::Unit(j));
     }},
    {FaultForm::kGainByRate,
     [](int j,
        const Vector3d& u,
        double rate,
        const Vector3d&,
        const Vector3d&,
        double most,
        double fastest) { return Vector3d(u[j] / most * rate / fastest * Vector3d::Unit(j)); }},
    {FaultForm::kByForce,
     [](int j, const Vector3d&, double, const Vector3d& up, const Vector3d&, double, double) {
       return Vector3d(up[j % 3] * Vector3d::Unit(j / 3));
     }},
    {FaultForm::kByField,
     [](int j, const Vector3d&, double, const Vector3d&, const Vector3d& field, double, double) {
       return Vector3d(field[j % 3] * Vector3d::Unit(j / 3));
     }},
};

// Readings that are off by ε e move the turn's rows by -ε Z h, as integrating them again shows.
TEST(FaultColumns, OfTurnsAreWhatIntegratingAgainShows) {
  const SettledModel settled = NineAxes();
  const PoseGraph& graph = settled.graph;
  const FaultScene scene(graph);
  double largest = 0.0, fastest = 0.0;
  for (const IncrementEdge& edge : graph.increments) {
    for (const Vector3d& raw : edge.move.reading_raw) {
      const Vector3d u = raw - edge.at.triad.bias;
      largest = std::max(largest, u.cwiseAbs().maxCoeff());
      fastest = std::max(fastest, (edge.at.triad.Correction() * u).norm());
    }
  }
  Eigen::Index row = 0;
  for (const PoseNode& node : graph.nodes) row += node.row_count();
  const Vector3d up = WorldVector(Triad::kAccelerometer, graph.reference()).normalized();
  const Vector3d field = WorldVector(Triad::kMagnetometer, graph.reference()).normalized();
  for (const TurnCase& one : kTurnCases) {
    SCOPED_TRACE(static_cast<int>(one.form));
    const auto columns = scene.ColumnsOf(Triad::kGyroscope, one.form);
    ASSERT_FALSE(columns.empty());
    const auto residual = [&](const IncrementEdge& edge) {
      return edge.Residual(graph.layout,
                           graph.shared.data(),
                           graph.nodes[edge.from].state.data(),
                           graph.nodes[edge.from + 1].state.data());
    };
    for (std::size_t i = 0; i < 3; ++i) {
      const IncrementEdge& edge = graph.increments[i];
      const MatrixXd found = RowsAt(columns, row + 3 * static_cast<Eigen::Index>(i));
      MatrixXd expected(3, found.cols());
      for (int j = 0; j < found.cols(); ++j) {
        constexpr double kSmall = 1e-5;
        const auto moved = [&](double size) {
          IncrementEdge off = edge;
          Eigen::Quaterniond attitude = graph.nodes[edge.from].rotation();
          Vector3d before = Vector3d::Zero();
          for (std::size_t s = 0; s < edge.move.reading_raw.size(); ++s) {
            const Vector3d u = edge.move.reading_raw[s] - edge.at.triad.bias;
            const Vector3d rate = edge.at.triad.Correction() * u;
            if (s > 0) {
              const double step_s = edge.move.time_s[s] - edge.move.time_s[s - 1];
              attitude = attitude * RotationExp(0.5 * step_s * (before + rate));
            }
            before = rate;
            off.move.reading_raw[s] += size * one.error(j,
                                                        u,
                                                        rate.norm(),
                                                        attitude.conjugate() * up,
                                                        attitude.conjugate() * field,
                                                        largest,
                                                        fastest);
          }
          off.Integrate(graph.layout, graph.shared.data());
          return residual(off);
        };
        expected.col(j) = -(moved(kSmall) - moved(-kSmall)) / (2.0 * kSmall);
      }
      // The integral is by trapezoids, with 250 steps a turn.
      EXPECT_LT((found - expected).norm(), 2e-3 * expected.norm()) << found << "\n\n" << expected;
    }
  }
}

TEST(FaultColumns, OfPosesAreDifferencesOfWhatIsPredicted) {
  const SettledModel settled = NineAxes();
  const PoseGraph& graph = settled.graph;
  const FaultScene scene(graph);
  constexpr double kSmall = 1e-6;
  Eigen::Index row = 0;
  for (const PoseNode& node : graph.nodes) {
    for (std::size_t i = 0; i < node.observations.size(); ++i) {
      const Triad triad = node.observations[i].triad;
      const Eigen::Index at = row + 3 * static_cast<Eigen::Index>(i);
      if (triad == Triad::kGyroscope) continue;
      const Eigen::Matrix3d S = graph.sensitivity(triad);
      const Eigen::Matrix3d R = node.rotation().toRotationMatrix();
      const Vector3d world = WorldVector(triad, graph.reference());
      const Vector3d x = R.transpose() * world;
      Eigen::Matrix3d turned, moved;
      for (Eigen::Index j = 0; j < 3; ++j) {
        const Vector3d small = kSmall * Vector3d::Unit(j);
        turned.col(j) = (S * (RotationExp(small).conjugate() * x) - S * x) / kSmall;
        moved.col(j) = (S * (R.transpose() * (world + small)) - S * x) / kSmall;
      }
      const MatrixXd by_turn = RowsAt(scene.ColumnsOf(triad, FaultForm::kTurned), at);
      const MatrixXd by_world = RowsAt(scene.ColumnsOf(triad, FaultForm::kWorld), at);
      EXPECT_LT((by_turn - turned).norm(), 1e-5 * turned.norm());
      EXPECT_LT((by_world - moved).norm(), 1e-5 * moved.norm());
    }
    row += node.row_count();
  }
}

// Poses that all stand alike show no play; the next solution may move some again.
TEST(FaultColumns, WithoutBlocksShowNothing) {
  Random random(3);
  auto trial = trials::MakeFaultTrial({.has_gyroscope = false}, &random);
  SettledModel settled = trials::Settled(trial);
  for (PoseNode& node : settled.graph.nodes) node.state = settled.graph.nodes.front().state;
  const FaultScene scene(settled.graph);
  ScannedForm form(scene.ColumnsOf(Triad::kAccelerometer, FaultForm::kPlay), true);
  const ReducedSystem system(settled.graph);
  form.Project(FaultSystem(system, settled.graph, settled.noise.estimated));
  const ColumnSums sums = form.SumsOf(WeightsOf(FaultShape::kThroughout, {0, 0}, scene));
  EXPECT_EQ(SeenDirections(sums).cols(), 0);
  EXPECT_EQ(sums.squares.size(), 3);
}

}  // namespace columns_test
}  // namespace truetriad
