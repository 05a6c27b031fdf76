// SPDX-License-Identifier: Apache-2.0
#include "verdict/lost_rows.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace truetriad {
namespace {

// A step is told that is larger than so many σ of two readings.
constexpr double kToldSigmas = 2.0;
// Variance of k^3 of a step without noise: not all of a step is turned at one rate.
constexpr double kLeastVariance = 0.01;
constexpr double kSureSigmas = 5.0;
// Steps on each side that tell what is usual; what they add to the variance of one.
constexpr std::size_t kBeside = 4;
constexpr double kWithBeside = 1.25;
// Two rows that are lost on end.
constexpr double kMostBeyond = 2.0;
constexpr double kFewestSteps = 50.0;

}  // namespace

void LostRowCounter::Add(std::span<const std::int64_t> time_ns,
                         std::span<const Eigen::Vector3d> gyroscope_raw,
                         std::span<const Eigen::Vector3d> vector_raw) {
  if (vector_raw.size() != gyroscope_raw.size()) return;
  const Eigen::Matrix3d to_rate = gyroscope_.Correction(), to_field = vector_.Correction();
  const double least = kToldSigmas * std::numbers::sqrt2 * sigma_;
  std::vector<Step> steps(vector_raw.size());
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < vector_raw.size(); ++i) {
    const Eigen::Vector3d field = (to_field * (vector_raw[i] - vector_.bias)).normalized();
    if (i > 0) {
      const double step_s = 1e-9 * static_cast<double>(time_ns[i] - time_ns[i - 1]);
      const Eigen::Vector3d rates = gyroscope_raw[i] + gyroscope_raw[i - 1] - 2.0 * gyroscope_.bias;
      const Eigen::Vector3d told = before.cross(0.5 * step_s * to_rate * rates);
      const double size = told.norm();
      if (size > least) {
        steps[i] = {told.dot(field - before) / (size * size) - 1.0,
                    std::numbers::sqrt2 * sigma_ / size,
                    true};
      }
    }
    before = field;
  }
  for (std::size_t i = kBeside; i + kBeside < steps.size(); ++i) {
    double sum = 0.0, count = 0.0;
    for (std::size_t j = i - kBeside; j <= i + kBeside; ++j) {
      if (j == i || !steps[j].is_told) continue;
      sum += steps[j].more;
      count += 1.0;
    }
    if (steps[i].is_told && count >= kBeside) AddStep(steps[i].more - sum / count, steps[i].noise);
  }
}

void LostRowCounter::AddStep(double beyond, double noise) {
  // Of noise s, and of what is beside it. The cube of noise of variance v has the variance 15 v^3.
  const double variance = kWithBeside * noise * noise;
  const double weight = 1.0 / (15.0 * variance * variance * variance + kLeastVariance);
  const double within = std::clamp(beyond, -kMostBeyond, kMostBeyond);
  const double cube = within * within * within;
  steps_ += 1.0;
  weight_ += weight;
  cube_ += weight * cube;
  weight_square_ += weight * weight;
  cross_ += weight * weight * cube;
  cube_square_ += weight * weight * cube * cube;
}

double LostRowCounter::Share() const {
  if (steps_ < kFewestSteps) return 0.0;
  const double mean = cube_ / weight_;
  const double variance =
      (cube_square_ - 2.0 * mean * cross_ + mean * mean * weight_square_) / (weight_ * weight_);
  if (mean < kSureSigmas * std::sqrt(variance)) return 0.0;
  return std::min(mean, 0.5);
}

}  // namespace truetriad
