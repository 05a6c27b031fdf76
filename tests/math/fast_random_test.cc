// SPDX-License-Identifier: Apache-2.0
#include "math/fast_random.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "math/distributions.h"
#include "support/kolmogorov_smirnov.h"

namespace truetriad {
namespace fast_random_test {

/// P(|x| > size) of a standard normal.
double TailProbability(double size) { return std::erfc(size / std::numbers::sqrt2); }

TEST(FastRandom, NormalsFollowTheNormalDistribution) {
  FastRandom random({1});
  std::vector<double> probabilities(400'000);
  for (double& p : probabilities) p = 0.5 * std::erfc(-random.Normal() / std::numbers::sqrt2);
  EXPECT_GT(KolmogorovSmirnovUniform(std::move(probabilities)).p_value, 0.01);
}

TEST(FastRandom, NormalsHaveTheRightMomentsAndTails) {
  constexpr int kCount = 4'000'000;
  FastRandom random({2});
  std::array<double, 4> moments{};
  // Inside the layers, at the start of the tail (3.654) and far out in it.
  constexpr std::array<double, 5> kSizes = {0.3, 2.0, 3.3, 3.6541528853610088, 4.5};
  std::array<int, 5> beyond{};
  for (int i = 0; i < kCount; ++i) {
    const double x = random.Normal();
    double power = 1.0;
    for (double& moment : moments) moment += (power *= x) / kCount;
    for (std::size_t k = 0; k < kSizes.size(); ++k) beyond[k] += std::abs(x) > kSizes[k] ? 1 : 0;
  }
  // Four sigma of a mean of x^k: sqrt((E x^2k - (E x^k)^2) / n), E x^2 = 1, x^4 = 3, x^6 = 15,
  // x^8 = 105.
  const double root = std::sqrt(static_cast<double>(kCount));
  EXPECT_NEAR(moments[0], 0.0, 4.0 / root);
  EXPECT_NEAR(moments[1], 1.0, 4.0 * std::sqrt(2.0) / root);
  EXPECT_NEAR(moments[2], 0.0, 4.0 * std::sqrt(15.0) / root);
  EXPECT_NEAR(moments[3], 3.0, 4.0 * std::sqrt(96.0) / root);
  for (std::size_t k = 0; k < kSizes.size(); ++k) {
    const double p = TailProbability(kSizes[k]);
    EXPECT_NEAR(beyond[k], kCount * p, 4.0 * std::sqrt(kCount * p * (1.0 - p))) << kSizes[k];
  }
}

TEST(FastRandom, LayersOfTheZigguratHaveEqualAreas) {
  const ziggurat::Table& table = ziggurat::kTable;
  const double area = table.edge[0] * table.density[1];
  for (std::size_t i = 1; i < ziggurat::kLayers; ++i) {
    // The constants of the construction have 12 digits, and errors add up towards the top.
    EXPECT_NEAR(table.edge[i] * (table.density[i + 1] - table.density[i]), area, 1e-10) << i;
    EXPECT_NEAR(table.density[i], std::exp(-0.5 * table.edge[i] * table.edge[i]), 1e-14) << i;
    EXPECT_GT(table.edge[i], table.edge[i + 1]);
  }
  const double tail = std::sqrt(std::numbers::pi / 2.0) * TailProbability(table.edge[1]);
  EXPECT_NEAR(table.edge[1] * table.density[1] + tail, area, 1e-12);
}

TEST(FastRandom, SequencesOfDifferentKeysAreUncorrelated) {
  constexpr int kCount = 100'000;
  std::vector<FastRandom> sources = {
      FastRandom({1, 0}), FastRandom({1, 1}), FastRandom({2, 0}), FastRandom({0, 1})};
  Eigen::Matrix4d products = Eigen::Matrix4d::Zero();
  for (int i = 0; i < kCount; ++i) {
    Eigen::Vector4d x;
    for (int k = 0; k < 4; ++k) x[k] = sources[static_cast<std::size_t>(k)].Normal();
    products += x * x.transpose() / kCount;
  }
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < i; ++j) EXPECT_NEAR(products(i, j), 0.0, 4.0 / std::sqrt(kCount));
  }
}

TEST(FastRandom, UniformsAreUniform) {
  FastRandom random({3});
  std::vector<double> values(100'000);
  std::array<int, 7> counts{};
  for (double& value : values) {
    value = random.Uniform();
    ++counts[static_cast<std::size_t>(random.Below(7))];
  }
  EXPECT_GT(KolmogorovSmirnovUniform(std::move(values)).p_value, 0.01);
  // Four binomial sigma.
  for (const int count : counts) EXPECT_NEAR(count, 1e5 / 7.0, 4.0 * std::sqrt(1e5 * 6.0 / 49.0));
}

}  // namespace fast_random_test
}  // namespace truetriad
