// SPDX-License-Identifier: Apache-2.0
#include "problem/hemisphere.h"

#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "math/random.h"
#include "model/world.h"

namespace truetriad {
namespace hemisphere_test {

constexpr Triad kMag = Triad::kMagnetometer;
constexpr double kSigma = 0.01;

CalibrateOptions MagnetometerOptions() {
  CalibrateOptions options;
  options.triads[Triad::kAccelerometer].enabled = true;
  options.triads[kMag].enabled = true;
  return options;
}

PoseGraph GraphWithDip(double dip_rad) {
  Random random(1);
  PoseGraph graph;
  SharedLayout& layout = graph.layout;
  layout.bias[kMag] = 0;
  layout.sensitivity[kMag] = 3;
  layout.reference = 12;
  layout.size = 12 + kReferenceSize;
  layout.basis.setIdentity(layout.size, layout.size);
  graph.shared.setZero(layout.size);
  for (double& value : graph.shared.head<12>()) value = random.Normal();
  graph.shared.segment<kReferenceSize>(layout.reference) << 9.8, 48.0, dip_rad, 0.0, 0.0, 0.0;
  for (int i = 0; i < 5; ++i) {
    PoseNode& node = graph.nodes.emplace_back();
    node.kind = PoseKind::kRotation;
    const Eigen::Quaterniond attitude = random.Rotation();
    node.state = {attitude.x(), attitude.y(), attitude.z(), attitude.w()};
  }
  return graph;
}

// What both sensors read in every pose.
std::vector<Eigen::Vector3d> ReadingsIn(const PoseGraph& graph) {
  std::vector<Eigen::Vector3d> readings;
  for (const PoseNode& node : graph.nodes) {
    const Eigen::Quaterniond body_from_world = node.rotation().conjugate();
    readings.emplace_back(graph.sensitivity(kMag) *
                          (body_from_world * WorldVector(kMag, graph.reference())));
    readings.emplace_back(body_from_world * WorldVector(Triad::kAccelerometer, graph.reference()));
  }
  return readings;
}

// Whatever the dip that it ended with, the readings stay and the dip is that of the hemisphere.
TEST(HemisphereOfField, IsALabelOfTheSameSolution) {
  for (const double dip : {0.4, -0.4, 2.2, -2.2, 4.0, 6.0}) {
    for (const bool north : {true, false}) {
      CalibrateOptions options = MagnetometerOptions();
      options.reference.northern_hemisphere = north;
      PoseGraph graph = GraphWithDip(dip);
      const std::vector<Eigen::Vector3d> before = ReadingsIn(graph);
      SettleHemisphereOfField(options, kSigma, &graph);
      const double settled = graph.shared[graph.layout.reference + kDip];
      EXPECT_EQ(settled > 0.0, north) << dip;
      EXPECT_LT(std::abs(settled), 0.5 * std::numbers::pi) << dip;
      const std::vector<Eigen::Vector3d> after = ReadingsIn(graph);
      for (std::size_t i = 0; i < before.size(); ++i) {
        EXPECT_LT((after[i] - before[i]).norm(), 1e-12 * before[i].norm()) << dip;
      }
    }
  }
}

TEST(HemisphereOfField, ReversedExplainsTheSameReadings) {
  PoseGraph graph = GraphWithDip(0.3);
  const std::vector<Eigen::Vector3d> before = ReadingsIn(graph);
  ReverseField(MagnetometerOptions(), &graph);
  EXPECT_EQ(graph.shared[graph.layout.reference + kDip], -0.3);
  const std::vector<Eigen::Vector3d> after = ReadingsIn(graph);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_LT((after[i] - before[i]).norm(), 1e-12 * before[i].norm());
  }
}

// What the dip cannot tell, the hand does.
TEST(HemisphereOfField, IsThatOfTheHandNearTheEquator) {
  for (const double dip : {0.03, -0.03}) {
    for (const int hand : {1, -1}) {
      CalibrateOptions options = MagnetometerOptions();
      Eigen::Matrix3d mounting = Eigen::Matrix3d::Identity();
      mounting(1, 1) = hand;
      if (hand < 0) options.triads[kMag].mounting = mounting;
      PoseGraph graph = GraphWithDip(dip);
      SettleHemisphereOfField(options, kSigma, &graph);
      EXPECT_GT(graph.sensitivity(kMag).determinant() * hand, 0.0) << dip;
    }
  }
}

// A sensitivity that is held says where north is, but not that the field dips beyond the vertical.
TEST(HemisphereOfField, StaysWhereTheSensitivityIsHeld) {
  CalibrateOptions options = MagnetometerOptions();
  options.triads[kMag].fixed_sensitivity.emplace();
  PoseGraph graph = GraphWithDip(-2.2);
  SettleHemisphereOfField(options, kSigma, &graph);
  EXPECT_NEAR(graph.shared[graph.layout.reference + kDip], 2.2 - std::numbers::pi, 1e-12);
}

}  // namespace hemisphere_test
}  // namespace truetriad
