// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace truetriad {

/// How long a stream's readings are, as most of them have it: spikes and lost words do not hide
/// that a sensor was normalised. Keeps some hundreds of readings, evenly spread over the stream.
class LengthSpread {
 public:
  void Add(const Eigen::Vector3d& reading) {
    if (count_++ % stride_ == 0) Keep(reading);
  }

  /// Of the half of the readings whose lengths lie closest together (the shorth, Andrews et al.
  /// 1972). All zero before there are two readings.
  struct Half {
    double length = 0.0;   ///< In the middle of it.
    double scatter = 0.0;  ///< Sigma of all lengths if they are normal, as a share of that.
    /// From the least to the largest reading of it, per axis, as a share of the length.
    Eigen::Vector3d extent = Eigen::Vector3d::Zero();
  };
  Half ShortestHalf() const;

 private:
  void Keep(const Eigen::Vector3d& reading);

  std::vector<Eigen::Vector3d> kept_;
  std::int64_t count_ = 0, stride_ = 1;
};

}  // namespace truetriad
