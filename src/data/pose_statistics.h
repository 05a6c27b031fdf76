// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "data/window_statistics.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Scatter of batch means about a straight line in time, per axis. A batch is a number of
/// consecutive windows, the same number for all batches.
struct BatchScatter {
  Eigen::Array3d residual_square = Eigen::Array3d::Zero();  ///< Sum of squares * samples per batch.
  double dof = 0.0;

  void Add(const BatchScatter& other) {
    residual_square += other.residual_square;
    dof += other.dof;
  }
  /// Long-run variance of one sample, estimated from batches of this length; zero if dof is zero.
  Eigen::Array3d variance() const {
    return dof > 0.0 ? Eigen::Array3d(residual_square / dof)
                     : Eigen::Array3d(Eigen::Array3d::Zero());
  }
};

/// Number of equal parts of a pose that are compared with each other.
inline constexpr std::size_t kEighths = 8;
/// Chosen: if an eighth differs from the middle half by over 8 times its white noise and over 8
/// times the drift of the middle half, this is not by chance.
inline constexpr double kClearFactor = 8.0;

/// `eighths` must have kEighths elements.
inline Eigen::Vector3d MeanOfMiddleHalf(const std::vector<Eigen::Vector3d>& eighths) {
  return 0.25 * (eighths[2] + eighths[3] + eighths[4] + eighths[5]);
}

/// The moments of one triad's samples in one pose.
struct TriadPoseMoments {
  std::int64_t count = 0;
  Eigen::Vector3d mean_raw = Eigen::Vector3d::Zero();
  Eigen::Vector3d minimum_raw = Eigen::Vector3d::Zero();
  Eigen::Vector3d maximum_raw = Eigen::Vector3d::Zero();
  Eigen::Matrix3d window_scatter_raw = Eigen::Matrix3d::Zero();  ///< About each window's mean.
  double window_dof = 0.0;
  /// Sums over windows of d and of d^2. d: the middle between the window's extremes, less its mean.
  Eigen::Array3d off_middle = Eigen::Array3d::Zero();
  Eigen::Array3d off_middle_square = Eigen::Array3d::Zero();
  std::int64_t windows = 0;
  /// Number of windows in which all readings of an axis are the same.
  Eigen::Array3d constant = Eigen::Array3d::Zero();
  /// Number of windows that contain the pose's extreme reading, per axis.
  Eigen::Array3d at_minimum = Eigen::Array3d::Zero();
  Eigen::Array3d at_maximum = Eigen::Array3d::Zero();
  /// Scatter of batches of 1, 2, 4, … windows.
  std::vector<BatchScatter> batches;
  /// Mean of each eighth less `mean_raw`, in time order; empty if the pose has fewer than two
  /// segments for each eighth.
  std::vector<Eigen::Vector3d> eighths_raw;
  Eigen::Vector3d end_to_end_raw = Eigen::Vector3d::Zero();  ///< See TriadPose.
};

/// σ of the mean of an eighth of a pose by white noise, per axis; zero if no window holds two
/// readings.
inline Eigen::Array3d NoiseOfEighth(const TriadPoseMoments& moments) {
  if (!(moments.window_dof > 0.0)) return Eigen::Array3d::Zero();
  const double readings = static_cast<double>(moments.count) / kEighths;
  return (moments.window_scatter_raw.diagonal().array() / moments.window_dof / readings).sqrt();
}

/// Sums for a least-squares line of values over time, updated value by value (West 1979).
template <typename Value>
struct RunningLine {
  explicit RunningLine(const Value& zero) : mean(zero), square(zero), product(zero) {}

  double weight = 0.0, time = 0.0, time_square = 0.0;
  Value mean, square, product;

  void Add(double at, double samples, const Value& value) {
    weight += samples;
    const double time_step = at - time;
    const Value step = value - mean;
    time += time_step * samples / weight;
    mean += step * samples / weight;
    time_square += samples * time_step * (at - time);
    square += samples * step * (value - mean);
    product += samples * time_step * (value - mean);
  }
};

/// Reduces the windows of one triad in one pose, in one pass.
class TriadPoseAccumulator {
 public:
  void Add(const TriadWindow& window);
  /// Marks a gap or a knock. No batch extends across it.
  void Break();
  TriadPoseMoments Finish() const;
  bool empty() const { return total_.count == 0; }

 private:
  // Consecutive windows; all segments have the same number of them.
  struct Segment {
    double samples = 0.0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    void Merge(const Segment& later);
  };
  void AddToSegments(const TriadWindow& window);
  std::vector<Eigen::Vector3d> Eighths() const;

  struct Level {
    RunningLine<Eigen::Array3d> line{Eigen::Array3d::Zero()};  // Batch means over window number.
    double samples = 0.0;
    // The first of two batches that make one of the next level.
    Eigen::Array3d half_mean = Eigen::Array3d::Zero();
    double half_samples = 0.0, half_time = 0.0;
    bool has_half = false;
  };

  TriadPoseMoments moments_;
  TriadWindow total_;
  std::vector<Level> levels_;
  std::vector<Segment> segments_;  // The last segment may lack windows.
  std::int64_t segment_windows_ = 1, last_segment_windows_ = 0;
};

/// Builds a pose from windows, which are added in time order for each triad.
class PoseAccumulator {
 public:
  void Add(Triad triad, const TriadWindow& window);
  void Break(Triad triad) { triads_[triad].Break(); }
  bool empty() const {
    return triads_.items[0].empty() && triads_.items[1].empty() && triads_.items[2].empty();
  }

  /// Returns the pose without covariances, because these need all poses. Gives the moments from
  /// which they are computed.
  StaticPose Finish(Triad leading, PerTriad<TriadPoseMoments>* moments) const;

 private:
  struct Extent {
    std::int64_t first_ns = 0, last_ns = 0, first_row = 0, last_row = 0;
  };
  PerTriad<TriadPoseAccumulator> triads_;
  PerTriad<Extent> extents_;
  RunningLine<double> degc_{0.0};
  std::int64_t degc_origin_ns_ = 0;
};

/// Fills the covariances of all poses of a set and the noise of its streams.
///
/// Noise is pooled over the poses: the white part from inside the windows, the long-run part from
/// the means of batches of 1, 2, 4, … windows. The inflation is the ratio of long-run to white
/// variance, at the shortest batches beyond which it does not grow significantly; white noise has
/// inflation 1. A pose that is significantly noisier than the others keeps its own variance.
///   covariance of the mean = D R D / n,  D^2 = variance * inflation,  R: correlation of the axes
/// plus the rounding of coarse steps, q^2/12 exp(-4 pi^2 sigma^2/q^2) per axis, which no averaging
/// reduces.
/// `moments[i]` belongs to set->poses[i]; `resolution_raw` is the step q, 0 when fine.
void FillCovariances(const std::vector<PerTriad<TriadPoseMoments>>& moments,
                     const PerTriad<Eigen::Vector3d>& resolution_raw,
                     PoseSet* set);

/// Mean square of the error that rounding to `step` adds to a mean of many readings, averaged over
/// all places of the true value between two steps. Widrow & Kollar 2008, sec. 9: the error is
/// periodic in this place, with an amplitude that falls as exp(-2 pi^2 sigma^2/step^2); without
/// noise, its mean square is step^2/12. `variance` is that of rounded readings, which contains
/// step^2/12. It must be pooled over all poses: in a single pose half-way between two steps
/// readings scatter by half a step.
double RoundingVariance(double variance, double step);

/// Like RoundingVariance, for poses that all lie at the same place between two steps, as a
/// gyroscope's rests do. `mean` and `variance` are of the rounded readings. Half-way between two
/// steps, readings scatter by half a step however small the noise is. So the function searches for
/// the noise that explains both `mean` and `variance`.
double RoundingVarianceAt(double mean, double variance, double step);

/// Lowest, mean and highest temperature of the poses; unset if any pose has none.
std::optional<Eigen::Vector3d> RecordedDegc(const PoseSet& poses);

}  // namespace truetriad
