// SPDX-License-Identifier: Apache-2.0
#include "data/pose_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glog/logging.h>

#include "math/distributions.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// Chosen: one-sided outliers are assumed if there are 50 windows or more, and if mid-ranges differ
// from means by over 4 σ and over 5 % of a reading's noise. The mean shifts by at most half of this
// difference.
constexpr double kFewestOneSided = 50.0, kOneSidedSigmas = 4.0, kOneSidedShare = 0.05,
                 kOneSidedMean = 0.5;

// Variances are compared if both have 8 degrees of freedom or more; the σ of a variance is then at
// most half of it.
constexpr double kEnoughDof = 8.0;
// Longer batches are used if their larger variance would be chance in one set of 1000 at most.
constexpr double kLongerBatchLevel = 1e-3;
// Significance level for a pose that is noisier than the others; low, as a set has many poses.
constexpr double kNoisierLevel = 1e-6;
// Chosen: a noisier pose has at least 1.5 times the variance (1.22 times the σ) of the others; less
// is harmless.
constexpr double kNoisierFactor = 1.5;
// Chosen: at most 128 segments of a long pose are kept. Merging leaves 64 or more, 8 in an eighth.
constexpr std::size_t kMostSegments = 128;

bool IsSignificantlyMore(double variance, double dof, double than, double than_dof, double level) {
  if (dof < kEnoughDof || than_dof < kEnoughDof || variance <= than) return false;
  return than <= 0.0 || 1.0 - FisherCdf(variance / than, dof, than_dof) < level;
}

// The noise of one axis of one triad, over all poses.
class AxisNoise {
 public:
  AxisNoise(const std::vector<const TriadPoseMoments*>& poses, int axis)
      : poses_(poses), axis_(axis), noisier_(poses.size(), false) {
    // Noisy poses raise the pooled variance, so they are left out and the search is repeated.
    for (int round = 0; round < 5; ++round) {
      Pool();
      if (!FlagNoisier()) break;
    }
    Pool();
  }

  double white_variance() const { return white_.variance()[axis_]; }
  double inflation() const { return white_variance() > 0.0 ? LongRun() / white_variance() : 1.0; }
  bool known() const { return white_.dof > 0.0; }

  // Long-run variance of one sample of pose i; divided by n it is the variance of the pose's mean.
  double VarianceOfPose(std::size_t i) const {
    if (!noisier_[i]) return LongRun();
    const double own_white = White(*poses_[i]).variance()[axis_] * inflation();
    double variance = std::max(LongRun(), own_white);
    if (chosen_ > 0) {
      const BatchScatter own = Batch(*poses_[i], chosen_ - 1);
      if (own.dof >= kEnoughDof) variance = std::max(variance, own.variance()[axis_]);
    }
    return variance;
  }

 private:
  static BatchScatter White(const TriadPoseMoments& pose) {
    return {pose.window_scatter_raw.diagonal().array(), pose.window_dof};
  }
  static BatchScatter Batch(const TriadPoseMoments& pose, std::size_t level) {
    return level < pose.batches.size() ? pose.batches[level] : BatchScatter();
  }

  // Scatter of a stage. 0: inside the windows; l > 0: of the means of batches of 2^(l-1) windows.
  const BatchScatter& Stage(std::size_t stage) const {
    return stage == 0 ? white_ : batches_[stage - 1];
  }
  double LongRun() const { return Stage(chosen_).variance()[axis_]; }

  void Pool() {
    white_ = BatchScatter();
    batches_.clear();
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      if (noisier_[i]) continue;
      white_.Add(White(*poses_[i]));
      batches_.resize(std::max(batches_.size(), poses_[i]->batches.size()));
      for (std::size_t l = 0; l < poses_[i]->batches.size(); ++l) {
        batches_[l].Add(poses_[i]->batches[l]);
      }
    }
    // With one sample per window, the scatter of the windows' means is that of the samples.
    if (white_.dof < kEnoughDof && !batches_.empty()) white_ = batches_.front();
    chosen_ = 0;
    for (std::size_t longer = 1; longer <= batches_.size(); ++longer) {
      const BatchScatter& now = Stage(chosen_);
      const BatchScatter& then = Stage(longer);
      if (IsSignificantlyMore(then.variance()[axis_],
                              then.dof,
                              now.variance()[axis_],
                              now.dof,
                              kLongerBatchLevel) &&
          Acts(Mechanism::kLongBatches)) {
        chosen_ = longer;
      }
    }
  }

  bool FlagNoisier() {
    bool any = false;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      if (noisier_[i]) continue;
      const auto is_noisier = [&](const BatchScatter& own, const BatchScatter& pool) {
        const double own_variance = own.variance()[axis_], pool_variance = pool.variance()[axis_];
        return own_variance > kNoisierFactor * pool_variance &&
               IsSignificantlyMore(own_variance, own.dof, pool_variance, pool.dof, kNoisierLevel);
      };
      noisier_[i] = (is_noisier(White(*poses_[i]), white_) ||
                     (chosen_ > 0 && is_noisier(Batch(*poses_[i], chosen_ - 1), Stage(chosen_)))) &&
                    Acts(Mechanism::kNoisierPoses);
      any = any || noisier_[i];
    }
    return any;
  }

  const std::vector<const TriadPoseMoments*>& poses_;
  int axis_;
  std::vector<bool> noisier_;
  BatchScatter white_;
  std::vector<BatchScatter> batches_;
  std::size_t chosen_ = 0;
};

// Correlation matrix of a scatter matrix; an axis without scatter is uncorrelated.
Eigen::Matrix3d CorrelationOf(const Eigen::Matrix3d& scatter) {
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double scale = std::sqrt(scatter(i, i) * scatter(j, j));
      if (i != j && scale > 0.0) correlation(i, j) = scatter(i, j) / scale;
    }
  }
  return correlation;
}

// An outlier in a window moves the mid-range by half of its error, but the mean only by its error
// over the number of readings. So one-sided outliers show in mid-range less mean, averaged over all
// windows. Noise with tails of any length moves the mid-range to both sides alike.
// If steps are larger than the noise, rounding moves the extremes of all windows to the same side.
Eigen::Vector3d OneSidedShift(const std::vector<const TriadPoseMoments*>& poses,
                              const Eigen::Vector3d& sigma_raw,
                              const Eigen::Vector3d& step_raw) {
  double windows = 0.0;
  Eigen::Array3d sum = Eigen::Array3d::Zero(), square = sum;
  for (const TriadPoseMoments* pose : poses) {
    windows += static_cast<double>(pose->windows);
    sum += pose->off_middle;
    square += pose->off_middle_square;
  }
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  if (windows < kFewestOneSided) return shift;
  const Eigen::Array3d mean = sum / windows;
  const Eigen::Array3d scatter = (square / windows - mean.square()).max(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const double size = std::abs(mean[axis]);
    // A mid-range has half of the variance of each extreme.
    const double rounding = RoundingVariance(2.0 * scatter[axis], step_raw[axis]);
    if (size < kOneSidedSigmas * std::sqrt(scatter[axis] / windows + rounding)) continue;
    if (size < kOneSidedShare * sigma_raw[axis]) continue;
    shift[axis] = kOneSidedMean * mean[axis];
  }
  return shift;
}

// `deviation`: σ of the pose's mean. The mean of a quarter has four times the variance of the
// pose's mean, and the mean of the middle half has twice that variance.
void AddQuarters(const TriadPoseMoments& moments,
                 const Eigen::Vector3d& deviation,
                 double duration_s,
                 TriadPose* pose) {
  const std::vector<Eigen::Vector3d>& eighths = moments.eighths_raw;
  if (eighths.size() != kEighths) return;
  const Eigen::Vector3d middle = MeanOfMiddleHalf(eighths);
  const double quarter_s = 0.25 * duration_s;
  pose->first_quarter_raw_s = quarter_s * (0.5 * (eighths[0] + eighths[1]) - middle);
  pose->last_quarter_raw_s = quarter_s * (0.5 * (eighths[6] + eighths[7]) - middle);
  pose->quarter_sigma_raw_s = quarter_s * std::sqrt(4.0 + 2.0) * deviation;
}

void FillTriad(Triad triad,
               const std::vector<PerTriad<TriadPoseMoments>>& moments,
               const Eigen::Vector3d& step_raw,
               StreamSummary* stream,
               std::vector<StaticPose>* poses) {
  std::vector<const TriadPoseMoments*> present;
  std::vector<TriadPose*> targets;
  std::vector<double> durations_s;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  double scatter_dof = 0.0;
  for (std::size_t i = 0; i < moments.size(); ++i) {
    Boxed<TriadPose>& target = (*poses)[i].triads[triad];
    if (!target) continue;
    present.push_back(&moments[i][triad]);
    targets.push_back(&*target);
    durations_s.push_back((*poses)[i].duration_s());
    scatter += present.back()->window_scatter_raw;
    scatter_dof += present.back()->window_dof;
  }
  const std::array<AxisNoise, 3> noise = {
      AxisNoise(present, 0), AxisNoise(present, 1), AxisNoise(present, 2)};
  if (!noise[0].known()) return;
  for (int axis = 0; axis < 3; ++axis) {
    const AxisNoise& axis_noise = noise[static_cast<std::size_t>(axis)];
    stream->noise_sigma_raw[axis] = std::sqrt(axis_noise.white_variance());
    stream->correlation_inflation[axis] = axis_noise.inflation();
  }
  stream->one_sided_raw = OneSidedShift(present, stream->noise_sigma_raw, step_raw);
  for (std::size_t i = 0; i < present.size(); ++i) {
    const bool own = present[i]->window_dof >= kEnoughDof;
    const Eigen::Matrix3d& shape = own ? present[i]->window_scatter_raw : scatter;
    const double dof = own ? present[i]->window_dof : scatter_dof;
    if (dof > 0.0) targets[i]->sample_covariance_raw = shape / dof;
    Eigen::Vector3d deviation, rounding;
    for (int axis = 0; axis < 3; ++axis) {
      const double variance = noise[static_cast<std::size_t>(axis)].VarianceOfPose(i);
      deviation[axis] = std::sqrt(variance / static_cast<double>(present[i]->count));
      rounding[axis] =
          RoundingVariance(noise[static_cast<std::size_t>(axis)].white_variance(), step_raw[axis]);
    }
    AddQuarters(*present[i], deviation, durations_s[i], targets[i]);
    targets[i]->mean_covariance_raw =
        deviation.asDiagonal() * CorrelationOf(scatter) * deviation.asDiagonal();
    targets[i]->mean_covariance_raw.diagonal() += rounding;
    targets[i]->has_covariance = (targets[i]->mean_covariance_raw.diagonal().array() > 0.0).all();
  }
}

}  // namespace

double RoundingVariance(double variance, double step) {
  if (!(step > 0.0)) return 0.0;
  constexpr double kPi = std::numbers::pi;
  const double rounding = step * step / 12.0;
  const double before_rounding = std::max(0.0, variance - rounding);
  return rounding * std::exp(-4.0 * kPi * kPi * before_rounding / (step * step));
}

namespace {

struct MeanAndVariance {
  double mean = 0.0, variance = 0.0;
};

// Mean and variance of normal readings about `place` after rounding, all in steps.
MeanAndVariance Rounded(double place, double sigma) {
  const auto below = [&](double edge) { return NormalCdf((edge - place) / sigma); };
  const double reach = std::ceil(6.0 * sigma) + 1.0;  // A share of 2e-9 is beyond 6 σ.
  double sum = 0.0, square = 0.0;
  for (double k = std::round(place) - reach; k <= std::round(place) + reach; k += 1.0) {
    const double share = below(k + 0.5) - below(k - 0.5);
    sum += share * (k - place);
    square += share * (k - place) * (k - place);
  }
  return {place + sum, square - sum * sum};
}

// The variance of rounded readings with this mean, if the noise before rounding is `sigma`.
double VarianceOfRounded(double mean, double sigma) {
  double low = mean - 1.0, high = mean + 1.0;
  while (high - low > 1e-6) {
    const double middle = 0.5 * (low + high);
    (Rounded(middle, sigma).mean < mean ? low : high) = middle;
  }
  return Rounded(0.5 * (low + high), sigma).variance;
}

}  // namespace

double RoundingVarianceAt(double mean, double variance, double step) {
  if (!(step > 0.0)) return 0.0;
  // Noise of one step reduces the variance of rounding to about 1e-17 of step^2 / 12.
  const double wanted = variance / (step * step);
  if (wanted > 1.0) return RoundingVariance(variance, step);
  const double place = std::remainder(mean / step, 1.0);
  double low = 0.0, high = 1.0;
  while (high - low > 1e-3) {
    const double middle = 0.5 * (low + high);
    (VarianceOfRounded(place, middle) < wanted ? low : high) = middle;
  }
  return RoundingVariance((low * low + 1.0 / 12.0) * step * step, step);
}

void TriadPoseAccumulator::Add(const TriadWindow& window) {
  if (window.count == 0) return;
  moments_.window_scatter_raw += window.scatter_raw;
  moments_.window_dof += static_cast<double>(window.count - 1);
  const Eigen::Array3d off_middle =
      (0.5 * (window.minimum_raw + window.maximum_raw) - window.mean_raw).array();
  moments_.off_middle += off_middle;
  moments_.off_middle_square += off_middle.square();
  for (int axis = 0; axis < 3; ++axis) {
    const bool first = total_.count == 0;
    const double low = window.minimum_raw[axis], high = window.maximum_raw[axis];
    moments_.constant[axis] += low == high ? 1.0 : 0.0;
    if (first || low < total_.minimum_raw[axis]) moments_.at_minimum[axis] = 0.0;
    if (first || high > total_.maximum_raw[axis]) moments_.at_maximum[axis] = 0.0;
    if (first || low <= total_.minimum_raw[axis]) moments_.at_minimum[axis] += 1.0;
    if (first || high >= total_.maximum_raw[axis]) moments_.at_maximum[axis] += 1.0;
  }
  total_.Merge(window);
  AddToSegments(window);

  // Two batches of one level are merged into one of the next, as in a binary counter.
  Eigen::Array3d mean = window.mean_raw.array();
  auto samples = static_cast<double>(window.count);
  auto time = static_cast<double>(moments_.windows++);
  for (std::size_t l = 0;; ++l) {
    if (l == levels_.size()) levels_.emplace_back();
    Level& level = levels_[l];
    level.line.Add(time, 1.0, mean);
    level.samples += samples;
    if (!level.has_half) {
      level.has_half = true;
      level.half_mean = mean, level.half_samples = samples, level.half_time = time;
      return;
    }
    level.has_half = false;
    mean = level.half_mean + (mean - level.half_mean) * (samples / (samples + level.half_samples));
    time = 0.5 * (time + level.half_time);
    samples += level.half_samples;
  }
}

void TriadPoseAccumulator::Break() {
  for (Level& level : levels_) level.has_half = false;
}

void TriadPoseAccumulator::Segment::Merge(const Segment& later) {
  samples += later.samples;
  if (samples > 0.0) mean += (later.mean - mean) * (later.samples / samples);
}

void TriadPoseAccumulator::AddToSegments(const TriadWindow& window) {
  if (segments_.empty() || last_segment_windows_ == segment_windows_) {
    if (segments_.size() == kMostSegments) {
      for (std::size_t i = 0; i < kMostSegments / 2; ++i) {
        segments_[i] = segments_[2 * i];
        segments_[i].Merge(segments_[2 * i + 1]);
      }
      segments_.resize(kMostSegments / 2);
      segment_windows_ *= 2;
    }
    segments_.emplace_back();
    last_segment_windows_ = 0;
  }
  segments_.back().Merge({static_cast<double>(window.count), window.mean_raw});
  ++last_segment_windows_;
}

std::vector<Eigen::Vector3d> TriadPoseAccumulator::Eighths() const {
  if (segments_.size() < 2 * kEighths) return {};
  std::vector<Eigen::Vector3d> eighths;
  for (std::size_t part = 0; part < kEighths; ++part) {
    Segment whole;
    for (std::size_t i = part * segments_.size() / kEighths;
         i < (part + 1) * segments_.size() / kEighths;
         ++i) {
      whole.Merge(segments_[i]);
    }
    eighths.emplace_back(whole.mean - total_.mean_raw);
  }
  return eighths;
}

TriadPoseMoments TriadPoseAccumulator::Finish() const {
  TriadPoseMoments moments = moments_;
  moments.count = total_.count;
  moments.mean_raw = total_.mean_raw;
  moments.minimum_raw = total_.minimum_raw;
  moments.maximum_raw = total_.maximum_raw;
  moments.eighths_raw = Eighths();
  if (segments_.size() > 1) moments.end_to_end_raw = segments_.back().mean - segments_.front().mean;
  for (const Level& level : levels_) {
    const RunningLine<Eigen::Array3d>& line = level.line;
    if (line.weight < 3.0) break;
    BatchScatter scatter;
    scatter.residual_square = (line.square - line.product.square() / line.time_square).max(0.0) *
                              (level.samples / line.weight);
    scatter.dof = line.weight - 2.0;
    moments.batches.push_back(scatter);
  }
  return moments;
}

void PoseAccumulator::Add(Triad triad, const TriadWindow& window) {
  if (window.count == 0) return;
  Extent& extent = extents_[triad];
  if (triads_[triad].empty())
    extent.first_ns = window.first_ns, extent.first_row = window.first_row;
  extent.last_ns = window.last_ns, extent.last_row = window.last_row;
  triads_[triad].Add(window);
  if (window.temperature_count > 0) {
    const auto count = static_cast<double>(window.temperature_count);
    const std::int64_t time_ns = window.first_ns + (window.last_ns - window.first_ns) / 2;
    if (degc_.weight == 0.0) degc_origin_ns_ = time_ns;
    degc_.Add(static_cast<double>(time_ns - degc_origin_ns_) * 1e-9,
              count,
              window.temperature_sum_degc / count);
  }
}

StaticPose PoseAccumulator::Finish(Triad leading, PerTriad<TriadPoseMoments>* moments) const {
  StaticPose pose;
  for (const Triad triad : kTriads) {
    if (triads_[triad].empty()) continue;
    TriadPoseMoments& triad_moments = (*moments)[triad];
    triad_moments = triads_[triad].Finish();
    TriadPose& reading = pose.triads[triad].emplace();
    reading.samples = triad_moments.count;
    reading.mean_raw = triad_moments.mean_raw;
    reading.end_to_end_raw = triad_moments.end_to_end_raw;
  }
  const Extent& extent = extents_[leading];
  pose.start_ns = extent.first_ns, pose.end_ns = extent.last_ns;
  pose.first_row = extent.first_row, pose.last_row = extent.last_row;
  if (degc_.weight > 0.0) {
    pose.temperature_degc = degc_.mean;
    // The rate stays zero when all readings have one time.
    if (degc_.time_square > 0.0) pose.temperature_rate_degcps = degc_.product / degc_.time_square;
  }
  return pose;
}

void FillCovariances(const std::vector<PerTriad<TriadPoseMoments>>& moments,
                     const PerTriad<Eigen::Vector3d>& resolution_raw,
                     PoseSet* set) {
  CHECK_EQ(moments.size(), set->poses.size());
  for (StreamSummary& stream : set->streams) {
    FillTriad(stream.triad, moments, resolution_raw[stream.triad], &stream, &set->poses);
  }
}

std::optional<Eigen::Vector3d> RecordedDegc(const PoseSet& poses) {
  if (poses.poses.empty()) return std::nullopt;
  double low = std::numeric_limits<double>::infinity(), high = -low, sum = 0.0;
  for (const StaticPose& pose : poses.poses) {
    if (!pose.temperature_degc) return std::nullopt;
    low = std::min(low, *pose.temperature_degc);
    high = std::max(high, *pose.temperature_degc);
    sum += *pose.temperature_degc;
  }
  // The clamp removes the rounding of a sum of equal values.
  const double mean = sum / static_cast<double>(poses.poses.size());
  return Eigen::Vector3d(low, std::clamp(mean, low, high), high);
}

}  // namespace truetriad
