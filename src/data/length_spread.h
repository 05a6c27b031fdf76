// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace truetriad {

/// Estimates the length of a stream's readings, and the scatter of their lengths, robustly against
/// spikes and error words. The scatter shows whether readings were normalised. Keeps 512 to 1024
/// readings, evenly spread over the stream.
class LengthSpread {
 public:
  void Add(const Eigen::Vector3d& reading) {
    if (count_++ % stride_ == 0) Keep(reading);
  }

  /// The half of the readings whose lengths lie closest together (the shorth, Andrews et al.
  /// 1972). All zero before there are two readings.
  struct Half {
    double length = 0.0;   ///< Midpoint of the lengths in the half.
    double scatter = 0.0;  ///< σ of all lengths if these are normal, as a share of `length`.
    /// Range of the half's readings per axis, as a share of `length`.
    Eigen::Vector3d extent = Eigen::Vector3d::Zero();
  };
  Half ShortestHalf() const;

 private:
  void Keep(const Eigen::Vector3d& reading);

  std::vector<Eigen::Vector3d> kept_;
  std::int64_t count_ = 0, stride_ = 1;
};

}  // namespace truetriad
