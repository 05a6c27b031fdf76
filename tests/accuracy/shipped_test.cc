// SPDX-License-Identifier: Apache-2.0
//
// Published answers on the small sets that the project ships, run as a user runs them.
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "io/temporary_folder.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace shipped_test {

const std::string kSource = TRUETRIAD_SOURCE_DIR;

Calibration RunShipped(const std::string& experiment) {
  const TemporaryFolder work;
  const std::string command = std::string(TRUETRIAD_BINARY) + " calibrate --config='" + kSource +
                              "/configs/experiments/" + experiment + ".yaml' --output='" +
                              work.Path("out") + "' > /dev/null";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  const auto calibration = ReadCalibration(work.Path("out/calibration.yaml"));
  EXPECT_TRUE(calibration) << calibration.error().message;
  return calibration ? *calibration : Calibration{};
}

// A little over half a unit of the seventh decimal, to which the answers are given.
constexpr double kSevenDecimals = 0.6e-7;

void ExpectNear(const Eigen::Vector3d& value, const Eigen::Vector3d& published) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(value[i], published[i], kSevenDecimals) << i;
}

TEST(SixRows, GiveThePublishedAxisAlignedEllipsoid) {
  const Calibration calibration = RunShipped("six-rows");
  ASSERT_TRUE(calibration.sensors[Triad::kAccelerometer]);
  const TriadModel<double>& model = calibration.sensors[Triad::kAccelerometer]->model;
  ExpectNear(model.bias, {0.1508625, -0.0150391, 0.1313511});
  ExpectNear(9.8 * model.sensitivity.diagonal(), {9.8101783, 9.8147126, 9.8664345});
  EXPECT_LT(*calibration.quality.residual_rms[Triad::kAccelerometer], 1e-9);
}

TEST(SixPosition, GivesThePublishedAnalyticSolutionWithKnownForces) {
  const Calibration calibration = RunShipped("six-position");
  ASSERT_TRUE(calibration.sensors[Triad::kAccelerometer]);
  const TriadModel<double>& model = calibration.sensors[Triad::kAccelerometer]->model;
  const Eigen::Matrix3d E = model.sensitivity - Eigen::Matrix3d::Identity();
  ExpectNear(model.bias, {0.1018152, 0.1861883, 0.2997726});
  ExpectNear(E.diagonal(), {0.0021122, 0.2484990, 0.2598432});
  ExpectNear({E(0, 1), E(0, 2), E(1, 0)}, {-0.0328296, 0.0643740, 0.0356829});
  ExpectNear({E(1, 2), E(2, 0), E(2, 1)}, {0.0074873, 0.0076120, 0.0033713});
}

TEST(SixFace, FindsTheErrorMatrixFromTheReadingsAlone) {
  const Calibration calibration = RunShipped("six-face");
  ASSERT_TRUE(calibration.sensors[Triad::kAccelerometer]);
  const TriadCalibration& sensor = *calibration.sensors[Triad::kAccelerometer];
  // Unknown tilts of the block hide a little of gravity on average: here there were none.
  EXPECT_LT((sensor.model.bias - Eigen::Vector3d(0.1, 0.2, 0.3)).lpNorm<Eigen::Infinity>(),
            0.2 * sensor.bias_sigma.minCoeff());
  EXPECT_LT((sensor.Scale() - Eigen::Vector3d(1.0024, 1.25, 1.26)).lpNorm<Eigen::Infinity>(), 3e-4);
}

// The demo's truth is known: every parameter is within 4 of its printed σ (of 41 parameters, one in
// 380 such draws would have one beyond that).
TEST(Demo, CalibratesToTheTruthWithinItsSigma) {
  const Calibration calibration = RunShipped("joint");
  const YAML::Node truth = YAML::LoadFile(kSource + "/datasets/demo/truth.yaml");
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    ASSERT_TRUE(calibration.sensors[triad]);
    const TriadCalibration& sensor = *calibration.sensors[triad];
    const YAML::Node expected = truth["sensors"][std::string(TriadName(triad))];
    for (std::size_t i = 0; i < 3; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      EXPECT_NEAR(
          sensor.model.bias[row], expected["bias"][i].as<double>(), 4.0 * sensor.bias_sigma[row]);
      for (std::size_t j = 0; j < 3; ++j) {
        const auto col = static_cast<Eigen::Index>(j);
        EXPECT_NEAR(sensor.model.sensitivity(row, col),
                    expected["sensitivity"][i][j].as<double>(),
                    4.0 * sensor.sensitivity_sigma(row, col) + 1e-12);
      }
    }
  }
  EXPECT_EQ(calibration.quality.poses, 24);
}

}  // namespace shipped_test
}  // namespace truetriad
