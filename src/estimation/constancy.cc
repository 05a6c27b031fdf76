// SPDX-License-Identifier: Apache-2.0
#include "estimation/constancy.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>

#include "estimation/reduced_system.h"
#include "truetriad/math/distributions.h"

namespace truetriad {
namespace {

constexpr Triad kMagnetometer = Triad::kMagnetometer;
// Poses on each side of a change that tell it from a disturbed pose.
constexpr std::size_t kFewestPoses = 4;
constexpr std::size_t kMostPoses = 200;
// So many left out by the robust step may be one side of a change.
constexpr std::ptrdiff_t kManyRejected = 3;
// Of a step on one of its sides, and of that share on the other; more than this of all is no
// handful of poses beside a magnet.
constexpr double kLeftOutShare = 0.25;
// One explanation is named when its log likelihood is better by this: odds of 20.
constexpr double kClearlyBetter = 6.0;
// Below this share of the largest eigenvalue a component of a step is not seen.
constexpr double kNotSeen = 1e-6;
// What scatters without a step that explains everything, of what scatters with it.
constexpr double kLeastLeft = 1e-3;

struct Place {
  std::size_t node = 0;
  int row = 0;  // of the magnetometer in the node's rows
  bool rejected = false;
};

std::vector<Place> PlacesOf(const PoseGraph& graph) {
  std::vector<Place> places;
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const std::vector<Observation>& seen = graph.nodes[k].observations;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (seen[i].triad != kMagnetometer) continue;
      places.push_back({k, 3 * static_cast<int>(i), seen[i].rejected});
    }
  }
  return places;
}

// A step's test at one place.
struct StepTest {
  double statistic = 0.0;
  int rank = 0;
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
};

// The tests of a step at every place, in their order. `columns`: of each place the derivative of
// its three rows by a step there or before.
std::vector<StepTest> TestSteps(const ReducedSystem& system,
                                const std::vector<Place>& places,
                                const std::vector<Eigen::Matrix3d>& columns) {
  // All places side by side; a step is the sum of those from its own on.
  const auto count = static_cast<Eigen::Index>(places.size());
  StackedRows Z = StackedRows::Zero(system.residual().size(), 3 * count);
  const auto row_of = [&](std::size_t i) {
    return system.factors()[places[i].node].row + places[i].row;
  };
  for (std::size_t i = 0; i < places.size(); ++i) {
    Z.block<3, 3>(row_of(i), 3 * static_cast<Eigen::Index>(i)) = columns[i];
  }
  const StackedRows DZ = system.Project(Z);
  StackedRows projected = StackedRows::Zero(Z.rows(), 3);
  Eigen::Matrix3d whole = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, Eigen::Dynamic, 3> shared =
      Eigen::Matrix<double, Eigen::Dynamic, 3>::Zero(system.size(), 3);
  Eigen::Vector3d u = Eigen::Vector3d::Zero();
  std::vector<StepTest> tests(places.size());
  for (std::size_t i = places.size(); i-- > 0;) {
    const Eigen::Index row = row_of(i);
    const auto own = DZ.middleCols<3>(3 * static_cast<Eigen::Index>(i));
    const Eigen::Matrix3d across = columns[i].transpose() * projected.middleRows<3>(row);
    whole += across + across.transpose() + columns[i].transpose() * own.middleRows<3>(row);
    projected += own;
    shared += system.B().middleRows<3>(row).transpose() * columns[i];
    u += columns[i].transpose() * system.projected().segment<3>(row);
    const Eigen::Matrix3d information = whole - shared.transpose() * (system.covariance() * shared);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(information);
    StepTest& test = tests[i];
    for (int axis = 0; axis < 3; ++axis) {
      const double eigenvalue = solver.eigenvalues()[axis];
      if (eigenvalue <= kNotSeen * solver.eigenvalues()[2]) continue;
      const Eigen::Vector3d direction = solver.eigenvectors().col(axis);
      const double share = direction.dot(u) / eigenvalue;
      test.statistic += share * share * eigenvalue;
      test.step -= share * direction;
      ++test.rank;
    }
  }
  return tests;
}

// What the magnetometer's own residuals amount to, and how many they are after all that was fitted.
struct OwnResiduals {
  double chi2 = 0.0;
  double dof = 0.0;
};

OwnResiduals OwnResidualsOf(const PoseGraph& graph,
                            const ReducedSystem& system,
                            const std::vector<Place>& places) {
  OwnResiduals own;
  for (const Place& place : places) {
    const PoseNode& node = graph.nodes[place.node];
    const Observation& seen = node.observations[static_cast<std::size_t>(place.row / 3)];
    if (seen.rejected) continue;
    const Eigen::Matrix3d variance = seen.variance / seen.weight;
    const Eigen::Index row = system.factors()[place.node].row + place.row;
    const Eigen::Vector3d projected = system.projected().segment<3>(row);
    const Eigen::Matrix3d P = system.ProjectorBlock(place.node, place.row);
    own.chi2 += projected.dot(variance * projected);
    own.dof += (P * variance).trace();
  }
  return own;
}

// The same poses with every reading of the magnetometer counting fully, solved again.
PoseGraph WithoutWeights(const PoseGraph& graph, const std::vector<Place>& places) {
  PoseGraph whole = graph;
  for (const Place& place : places) {
    Observation& seen =
        whole.nodes[place.node].observations[static_cast<std::size_t>(place.row / 3)];
    seen.rejected = false;
    seen.weight = 1.0;
  }
  SolveGraph(&whole, kRoundTolerance);
  return whole;
}

// A robust fit that takes the readings on one side of a step for disturbed leaves out a good part
// of them and hardly any of the other side; single poses beside a magnet do not lie so.
bool LooksLeftOut(const std::vector<Place>& places, std::size_t first) {
  const auto share = [](auto from, auto to) {
    const auto count = std::count_if(from, to, [](const Place& place) { return place.rejected; });
    return static_cast<double>(count) / static_cast<double>(to - from);
  };
  const auto step = places.begin() + static_cast<std::ptrdiff_t>(first);
  const double before = share(places.begin(), step), after = share(step, places.end());
  if (share(places.begin(), places.end()) >= kLeftOutShare) return true;
  return std::max(before, after) >= kLeftOutShare &&
         std::min(before, after) <= kLeftOutShare * std::max(before, after);
}

}  // namespace

std::optional<MagnetometerChange> FindMagnetometerChange(const PoseGraph& settled,
                                                         const ReducedSystem& settled_system,
                                                         const NoiseState& noise) {
  if (!settled.layout.Has(kMagnetometer) || noise.source[kMagnetometer] == NoiseSource::kResidual) {
    return std::nullopt;
  }
  const std::vector<Place> places = PlacesOf(settled);
  if (places.size() < 2 * kFewestPoses || places.size() > kMostPoses) return std::nullopt;
  const auto rejected = std::count_if(
      places.begin(), places.end(), [](const Place& place) { return place.rejected; });
  const bool readmits = rejected >= kManyRejected;
  std::optional<PoseGraph> whole;
  std::optional<ReducedSystem> whole_system;
  if (readmits) {
    whole = WithoutWeights(settled, places);
    whole_system.emplace(*whole);
  }
  const PoseGraph& graph = readmits ? *whole : settled;
  const ReducedSystem& system = readmits ? *whole_system : settled_system;
  if (system.rank() < system.size()) return std::nullopt;

  std::vector<Eigen::Matrix3d> by_bias, by_field;
  for (const Place& place : places) {
    const PoseNode& node = graph.nodes[place.node];
    const Eigen::Matrix3d S = graph.ModelAt(kMagnetometer, node).sensitivity;
    by_bias.push_back(S);
    by_field.push_back(node.kind == PoseKind::kDirection
                           ? Eigen::Matrix3d::Zero()
                           : Eigen::Matrix3d(S * node.rotation().toRotationMatrix().transpose()));
  }
  const bool estimated = readmits || (noise.excess[kMagnetometer] > 0.0 &&
                                      std::find(noise.estimated.begin(),
                                                noise.estimated.end(),
                                                PoseNoise(kMagnetometer)) != noise.estimated.end());
  const OwnResiduals own = OwnResidualsOf(graph, system, places);
  // T, and where the noise is estimated, in units of what scatters without the step.
  const auto clearness = [&](const StepTest& test) {
    if (!estimated || own.dof - test.rank < 1.0) return test.statistic;
    const double left = std::max(own.chi2 - test.statistic, kLeastLeft * own.chi2);
    return test.statistic / (left / (own.dof - test.rank));
  };
  const auto p_value = [&](const StepTest& test) {
    if (test.rank == 0) return 1.0;
    return estimated && own.dof - test.rank >= 1.0
               ? 1.0 - FisherCdf(clearness(test) / test.rank, test.rank, own.dof - test.rank)
               : 1.0 - ChiSquareCdf(test.statistic, test.rank);
  };

  const Eigen::MatrixXd rows = graph.layout.basis.middleRows<3>(graph.layout.bias[kMagnetometer]);
  const double bias_sigma_ut =
      ((rows * system.covariance() * rows.transpose()).diagonal().array().max(0.0).sqrt() /
       graph.sensitivity(kMagnetometer).rowwise().norm().array())
          .maxCoeff();
  const double tests = 2.0 * static_cast<double>(places.size() - 2 * kFewestPoses + 1);
  const std::vector<StepTest> bias_tests = TestSteps(system, places, by_bias);
  const std::vector<StepTest> field_tests = TestSteps(system, places, by_field);
  double clearest = 0.0;
  std::optional<MagnetometerChange> found;
  for (std::size_t first = kFewestPoses; first + kFewestPoses <= places.size(); ++first) {
    if (readmits && !LooksLeftOut(places, first)) continue;
    const StepTest& bias = bias_tests[first];
    const StepTest& field = field_tests[first];
    const double clear = std::max(clearness(bias), clearness(field));
    const double p = std::min(1.0, tests * std::min(p_value(bias), p_value(field)));
    if (p > kChangeLevel || clear <= clearest) continue;
    clearest = clear;
    const double better = clearness(bias) - clearness(field);
    found = MagnetometerChange{places[first].node,
                               better > kClearlyBetter    ? ChangeKind::kBias
                               : better < -kClearlyBetter ? ChangeKind::kField
                                                          : ChangeKind::kEither,
                               bias.step,
                               field.step,
                               bias_sigma_ut,
                               p};
  }
  return found;
}

}  // namespace truetriad
