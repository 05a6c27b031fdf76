// SPDX-License-Identifier: Apache-2.0
#include "verdict/lost_rows.h"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>

namespace truetriad {
namespace {

// A step that is told by so many σ.
constexpr double kToldSigmas = 6.0;
// Half a step beside a whole one more, or a whole one less.
constexpr double kHalfStep = 0.5;
// σ of as many twice as none.
constexpr double kSureSigmas = 6.0;
constexpr double kFewestSteps = 50.0;

}  // namespace

void LostRowCounter::Add(std::span<const std::int64_t> time_ns,
                         std::span<const Eigen::Vector3d> gyroscope_raw,
                         std::span<const Eigen::Vector3d> vector_raw) {
  if (vector_raw.size() != gyroscope_raw.size()) return;
  const Eigen::Matrix3d to_rate = gyroscope_.Correction(), to_field = vector_.Correction();
  const double least = kToldSigmas * std::numbers::sqrt2 * sigma_;
  std::optional<Eigen::Vector3d> before;
  for (std::size_t i = 0; i < vector_raw.size(); ++i) {
    const Eigen::Vector3d field = (to_field * (vector_raw[i] - vector_.bias)).normalized();
    if (before) {
      const double step_s = 1e-9 * static_cast<double>(time_ns[i] - time_ns[i - 1]);
      const Eigen::Vector3d turn =
          0.5 * step_s * to_rate *
          (gyroscope_raw[i] + gyroscope_raw[i - 1] - 2.0 * gyroscope_.bias);
      const Eigen::Vector3d told = before->cross(turn);
      if (told.norm() > least) {
        const double more = told.dot(field - *before) / told.squaredNorm() - 1.0;
        steps_ += 1.0;
        twice_ += more > kHalfStep ? 1.0 : 0.0;
        none_ += more < -kHalfStep ? 1.0 : 0.0;
      }
    }
    before = field;
  }
}

double LostRowCounter::Share() const {
  const double lost = twice_ - none_;
  if (steps_ < kFewestSteps || lost < kSureSigmas * std::sqrt(twice_ + none_)) return 0.0;
  return lost / (steps_ + lost);
}

}  // namespace truetriad
