// SPDX-License-Identifier: Apache-2.0
#include "data/length_spread.h"

#include <algorithm>

#include "math/distributions.h"

namespace truetriad {
namespace {

// The largest number of readings kept. Thinning leaves half of them, which give the spread of
// lengths to 5 %.
constexpr std::size_t kMostKept = 1024;

}  // namespace

void LengthSpread::Keep(const Eigen::Vector3d& reading) {
  if (kept_.size() == kMostKept) {
    for (std::size_t i = 0; i < kMostKept / 2; ++i) kept_[i] = kept_[2 * i];
    kept_.resize(kMostKept / 2);
    stride_ *= 2;
  }
  kept_.push_back(reading);
}

LengthSpread::Half LengthSpread::ShortestHalf() const {
  Half half;
  if (kept_.size() < 2) return half;
  std::vector<Eigen::Vector3d> sorted = kept_;
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return a.squaredNorm() < b.squaredNorm();
  });
  const std::size_t further = sorted.size() / 2;
  const auto width = [&](std::size_t i) { return sorted[i + further].norm() - sorted[i].norm(); };
  std::size_t best = 0;
  for (std::size_t i = 1; i + further < sorted.size(); ++i) {
    if (width(i) < width(best)) best = i;
  }
  half.length = 0.5 * (sorted[best].norm() + sorted[best + further].norm());
  if (!(half.length > 0.0)) return half;
  // Half of normal errors lie within the median absolute error, so the width is twice this median.
  half.scatter = 0.5 * kMadToSigma * width(best) / half.length;
  Eigen::Vector3d least = sorted[best], most = sorted[best];
  for (std::size_t i = best; i <= best + further; ++i) {
    least = least.cwiseMin(sorted[i]), most = most.cwiseMax(sorted[i]);
  }
  half.extent = (most - least) / half.length;
  return half;
}

}  // namespace truetriad
