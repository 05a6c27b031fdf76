// SPDX-License-Identifier: Apache-2.0
#include "truetriad/model/thermal.h"

#include <gtest/gtest.h>

namespace truetriad {
namespace {

TEST(ModelAtTemperature, IsTheStatedModelAtItsReference) {
  TriadModel<double> model;
  model.bias << 1.0, 2.0, 3.0;
  ThermalTerms thermal;
  thermal.reference_degc = 20.0;
  thermal.bias = {Eigen::Vector3d(0.1, 0.2, 0.3)};
  thermal.sensitivity = {Eigen::Matrix3d::Ones()};
  thermal.rate_cross = Eigen::Vector3d::Ones();
  const TriadModel<double> same = ModelAtTemperature(model, thermal, 20.0, 5.0);
  EXPECT_EQ(same.bias, model.bias);
  EXPECT_EQ(same.sensitivity, model.sensitivity);
}

TEST(ModelAtTemperature, AddsEveryTermOfTheEquation) {
  TriadModel<double> model;
  ThermalTerms thermal;
  thermal.reference_degc = 20.0;
  thermal.bias = {Eigen::Vector3d::Constant(1.0), Eigen::Vector3d::Constant(10.0)};
  thermal.sensitivity = {Eigen::Matrix3d::Constant(1.0),
                         Eigen::Matrix3d::Constant(2.0),
                         Eigen::Matrix3d::Constant(3.0)};
  thermal.rate_linear = Eigen::Vector3d::Constant(100.0);
  thermal.rate_quadratic = Eigen::Vector3d::Constant(1000.0);
  thermal.rate_cross = Eigen::Vector3d::Constant(1e4);
  // tau = 2, rate = -3; outside any range, since nothing is clamped.
  const TriadModel<double> at = ModelAtTemperature(model, thermal, 22.0, -3.0);
  EXPECT_EQ(at.bias.x(), 2.0 + 40.0 - 300.0 + 9000.0 - 6e4);
  EXPECT_EQ(at.sensitivity(0, 0), 1.0 + 2.0 + 8.0 + 24.0);
  EXPECT_EQ(at.sensitivity(0, 1), 2.0 + 8.0 + 24.0);
}

}  // namespace
}  // namespace truetriad
