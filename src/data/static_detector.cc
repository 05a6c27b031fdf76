// SPDX-License-Identifier: Apache-2.0
#include "data/static_detector.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <glog/logging.h>

#include "model/mechanisms.h"

namespace truetriad {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();

// Chosen: the activity of a window is measured over the five windows around it. So a rest loses two
// windows at each end, in which the unit settles.
constexpr std::size_t kSpan = 5;

// Chosen, in log2 of variance: levels are tried in steps of a factor 1.4.
constexpr double kLevelStep = 0.5;
// Chosen: a number of rests that persists over a factor of 16 in variance has the full score.
constexpr double kPersistentLevels = 4.0 / kLevelStep;
// Chosen: a number of rests that persists over less than a factor of 4 in variance is chance.
constexpr double kFewestLevels = 2.0 / kLevelStep;

// A mean within 4 σ of its noise has not moved; white noise exceeds that once in 16000.
constexpr double kNoiseSigmas = 4.0;
// In a rest the mean may move by 1 % of the range, which is 1.1 deg if the range is 2 g. Averaging
// over such a turn shortens the mean of a unit vector by only 2e-5.
constexpr double kSteadyShare = 0.01;
// Chosen: a rest may also drift thermally, by this share of the range in a second: 0.1 mg/s of 2 g.
constexpr double kThermalShareHz = 5e-5;
// Chosen: shares of the range, 2 g. Attitudes before and after a knock are the same if they differ
// by up to 6 mg (0.3 deg). A tilt by more than 0.1 g (6 deg) during the knock is handling.
constexpr double kSameAttitudeShare = 0.003, kHandledShare = 0.05;
// Chosen: the heading is the same if the gyroscope's integral about each axis is up to 2.9 deg. If
// the unit is unknown, the limit is 0.02 s times the range of the readings.
constexpr double kSameHeadingRad = 0.05, kSameHeadingShareS = 0.02;
// Chosen: after a knock the gyroscope's reading is as before, to this share of the range.
constexpr double kSameRateShare = 0.005;

Eigen::Vector3d MeanOf(const std::vector<TriadWindow>& windows,
                       std::size_t begin,
                       std::size_t end) {
  const Eigen::Vector3d& origin = windows[begin].mean_raw;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double samples = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    const auto count = static_cast<double>(windows[i].count);
    sum += count * (windows[i].mean_raw - origin);
    samples += count;
  }
  return origin + sum / std::max(samples, 1.0);
}

// Variance of MeanOf, from the scatter within windows. This includes spikes, but not slow turns.
Eigen::Array3d MeanVarianceOf(const std::vector<TriadWindow>& windows,
                              std::size_t begin,
                              std::size_t end) {
  Eigen::Array3d scatter = Eigen::Array3d::Zero();
  double samples = 0.0, dof = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    scatter += windows[i].scatter_raw.diagonal().array();
    samples += static_cast<double>(windows[i].count);
    dof += static_cast<double>(windows[i].count - 1);
  }
  return scatter / std::max(dof, 1.0) / std::max(samples, 1.0);
}

// Square of the share of MeanVarianceOf that is white noise. It is 1 if the means of neighbouring
// windows differ by no more than the scatter within windows explains. The more they differ, as in a
// trembling or turning hand, the smaller it is.
Eigen::Array3d WhiteShareOf(const std::vector<TriadWindow>& windows,
                            std::size_t begin,
                            std::size_t end) {
  Eigen::Array3d differences = Eigen::Array3d::Zero(), noise = Eigen::Array3d::Zero();
  Eigen::Array3d before = MeanVarianceOf(windows, begin, begin + 1);
  for (std::size_t i = begin + 1; i < end; ++i) {
    differences += (windows[i].mean_raw - windows[i - 1].mean_raw).array().square();
    const Eigen::Array3d here = MeanVarianceOf(windows, i, i + 1);
    noise += before + here;
    before = here;
  }
  return (differences > noise).select(noise / differences, Eigen::Array3d::Ones()).square();
}

double SamplesIn(const std::vector<TriadWindow>& windows, const WindowRun& run) {
  double samples = 0.0;
  for (std::size_t i = run.first; i < run.second; ++i) {
    samples += static_cast<double>(windows[i].count);
  }
  return samples;
}

// Trace of the covariance of all samples of the windows.
double TotalVariance(const std::vector<TriadWindow>& windows, std::size_t begin, std::size_t end) {
  const Eigen::Vector3d mean = MeanOf(windows, begin, end);
  double scatter = 0.0, samples = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    const auto count = static_cast<double>(windows[i].count);
    scatter += windows[i].scatter_raw.trace() + count * (windows[i].mean_raw - mean).squaredNorm();
    samples += count;
  }
  return scatter / std::max(samples - 1.0, 1.0);
}

// Lower and upper end of `values` after the lowest and the highest 1 % are left out.
std::pair<double, double> CentralRange(std::vector<double>* values) {
  const auto tail = static_cast<std::ptrdiff_t>(values->size() / 100);
  const auto low = values->begin() + tail, high = values->end() - 1 - tail;
  std::nth_element(values->begin(), low, values->end());
  const double lowest = *low;
  std::nth_element(values->begin(), high, values->end());
  return {lowest, *high};
}

}  // namespace

StaticDetector::StaticDetector(const StaticDetectorOptions& options,
                               std::vector<DetectorTriad> triads,
                               const std::vector<DetectorTriad>& witnesses,
                               double window_s)
    : options_(options), triads_(std::move(triads)), all_(triads_), window_s_(window_s) {
  CHECK(!triads_.empty());
  all_.insert(all_.end(), witnesses.begin(), witnesses.end());
  range_raw_.items.fill(0.0);
  for (const DetectorTriad& known : all_) range_raw_[known.triad] = known.expected_range_raw;
}

std::vector<Rest> StaticDetector::Find(const WindowBuffer& buffer, std::size_t count) {
  if (count < kSpan) return {};
  UpdateRange(buffer, count);
  MeasureActivity(buffer, count);
  WidenRangeIfQuietThroughout(buffer);
  std::vector<Rest> rests = RestsBelow(buffer, ChooseLevel(buffer));
  // If turns are used, ends are cut off shorter rests, too: motion inside a rest is missing from
  // the turn beside it. Otherwise a short rest stays whole, since this improves its mean.
  const std::size_t fewest = (options_.has_turns ? 2 : 4) * kSpan;
  for (Rest& rest : rests) {
    for (const DetectorTriad& known : triads_) {
      CutSettling(buffer.windows(known.triad), fewest, &rest.runs.front());
      if (rest.runs.size() > 1) {
        CutSettling(buffer.windows(known.triad), fewest, &rest.runs.back());
      }
    }
  }
  // The cuts may have left too little.
  std::erase_if(rests, [&](const Rest& rest) { return !IsLongEnough(rest); });
  return rests;
}

void StaticDetector::UpdateRange(const WindowBuffer& buffer, std::size_t count) {
  // Up to 1024 windows determine the range; leaving out 1 % on each side excludes shocks.
  const std::size_t stride = count / 1024 + 1;
  std::vector<double> means;
  for (const DetectorTriad& known : all_) {
    const auto& windows = buffer.windows(known.triad);
    for (int axis = 0; axis < 3; ++axis) {
      means.clear();
      for (std::size_t i = 0; i < count; i += stride) {
        if (windows[i].count > 0) means.push_back(windows[i].mean_raw[axis]);
      }
      if (means.empty()) continue;
      const auto [low, high] = CentralRange(&means);
      range_raw_[known.triad] = std::max(range_raw_[known.triad], high - low);
    }
  }
}

void StaticDetector::MeasureActivity(const WindowBuffer& buffer, std::size_t count) {
  activity_.assign(count, kNever);
  std::size_t whole = 0;  // Number of consecutive windows up to here that have all triads.
  for (std::size_t last = 0; last < count; ++last) {
    bool good = true;
    for (const DetectorTriad& known : triads_) {
      good = good && buffer.windows(known.triad)[last].count > 0;
    }
    const bool follows = last > 0 && buffer.index(last) == buffer.index(last - 1) + 1;
    whole = !good ? 0 : (follows ? whole + 1 : 1);
    if (whole < kSpan) continue;
    double product = 1.0;
    for (const DetectorTriad& known : triads_) {
      const double range = range_raw_[known.triad];
      // Readings that stay on one step have the variance of rounding. The other terms avoid the
      // logarithm of zero, as simulated readings may have no noise.
      const double floor = known.resolution_raw.squaredNorm() / 12.0 + 1e-12 * range * range +
                           std::numeric_limits<double>::min();
      product *= floor + TotalVariance(buffer.windows(known.triad), last + 1 - kSpan, last + 1);
    }
    activity_[last - kSpan / 2] =
        static_cast<float>(std::log2(product) / static_cast<double>(triads_.size()));
  }
}

// If nothing moves in the whole buffer, the range of the signal is noise and drift, which does not
// show how far a mean may move. Then a hundred times the noise replaces the range.
void StaticDetector::WidenRangeIfQuietThroughout(const WindowBuffer& buffer) {
  std::vector<double> finite;
  for (const float activity : activity_) {
    if (activity != kNever) finite.push_back(activity);
  }
  if (finite.empty()) return;
  const auto [low, high] = CentralRange(&finite);
  // 5 windows of 4 samples and 3 axes have 57 degrees of freedom: 98 % of such variances lie within
  // a factor of 2.4. Twice that, 2^2.25, allows for correlated noise.
  if (high - low > 2.25) return;
  for (const DetectorTriad& known : all_) {
    if (known.expected_range_raw > 0.0) continue;
    double noise_variance = 0.0;
    for (std::size_t i = 0; i < activity_.size(); ++i) {
      if (activity_[i] == kNever) continue;
      noise_variance += TotalVariance(buffer.windows(known.triad), i, i + 1);
    }
    const double noise_raw = std::sqrt(noise_variance / static_cast<double>(finite.size()));
    double& range = range_raw_[known.triad];
    if (range < 20.0 * noise_raw && Acts(Mechanism::kQuietThroughout)) range = 100.0 * noise_raw;
  }
}

double StaticDetector::ChooseLevel(const WindowBuffer& buffer) const {
  double lowest = kNever, highest = -kNever;
  for (const float activity : activity_) {
    if (activity == kNever) continue;
    lowest = std::min<double>(lowest, activity);
    highest = std::max<double>(highest, activity);
  }
  if (lowest > highest) return -kNever;
  const auto levels = static_cast<int>((highest - lowest) / kLevelStep) + 2;
  std::vector<std::size_t> rests;  // Number of rests by level.
  rests.reserve(static_cast<std::size_t>(levels));
  for (int step = 0; step < levels; ++step) {
    rests.push_back(RestsBelow(buffer, lowest + kLevelStep * step).size());
  }
  // For each number n of rests: finds the runs of levels that give at least n rests. The score of a
  // run is n times its width, which counts up to kPersistentLevels.
  double best_score = 0.0, best_level = -kNever;
  for (const std::size_t number : rests) {
    if (number == 0) continue;
    for (std::size_t begin = 0; begin < rests.size(); ++begin) {
      if (rests[begin] < number) continue;
      std::size_t end = begin + 1;
      while (end < rests.size() && rests[end] >= number) ++end;
      const bool reaches_top = end == rests.size();  // This holds at every higher level, too.
      const auto width = static_cast<double>(end - begin) + (reaches_top ? kPersistentLevels : 0.0);
      const double first_level = lowest + kLevelStep * static_cast<double>(begin);
      begin = end;
      if (width < kFewestLevels) continue;
      const double score = static_cast<double>(number) * std::min(1.0, width / kPersistentLevels);
      if (score > best_score) {
        best_score = score;
        // A third of the way up: above the noise and far below motion.
        best_level = first_level + kLevelStep * (width - 1.0) / 3.0;
      }
    }
  }
  return best_level;
}

std::vector<Rest> StaticDetector::RestsBelow(const WindowBuffer& buffer, double level) const {
  std::vector<Rest> rests;
  const auto limit = static_cast<float>(level);
  for (std::size_t i = 0; i < activity_.size(); ++i) {
    if (!(activity_[i] <= limit)) continue;
    WindowRun run{i, i + 1};
    while (run.second < activity_.size() && activity_[run.second] <= limit) ++run.second;
    i = run.second;
    if (run.second - run.first < kSpan || !CutUnsteadyEnds(buffer, &run)) continue;
    if (!rests.empty() && IsKnock(buffer, rests.back().runs.back(), run) &&
        Acts(Mechanism::kKnocks)) {
      rests.back().runs.push_back(run);
    } else {
      rests.push_back({{run}});
    }
  }
  std::erase_if(rests, [this](const Rest& rest) { return !IsLongEnough(rest); });
  return rests;
}

// Cuts the ends that differ from the middle. False if most is cut or the mean moves in between.
bool StaticDetector::CutUnsteadyEnds(const WindowBuffer& buffer, WindowRun* run) const {
  const Triad leading = triads_.front().triad;
  const auto& windows = buffer.windows(leading);
  const auto& [begin, end] = *run;
  const double duration_s = static_cast<double>(end - begin) * window_s_;
  const double limit_raw = (kSteadyShare + kThermalShareHz * duration_s) * range_raw_[leading];
  const std::size_t middle = begin + (end - begin - kSpan) / 2;
  const Eigen::Vector3d core = MeanOf(windows, middle, middle + kSpan);
  // Computed only when needed, as few runs need it.
  std::optional<Eigen::Array3d> white, core_noise;
  const auto is_away = [&](std::size_t at) {
    const Eigen::Array3d moved = (MeanOf(windows, at, at + kSpan) - core).array().square();
    const double limit = 0.25 * limit_raw * limit_raw;
    if (!(moved.maxCoeff() > limit)) return false;
    if (!white) {
      white = kNoiseSigmas * kNoiseSigmas * WhiteShareOf(windows, begin, end);
      core_noise = MeanVarianceOf(windows, middle, middle + kSpan);
    }
    const Eigen::Array3d noise = MeanVarianceOf(windows, at, at + kSpan) + *core_noise;
    return (moved - *white * noise).maxCoeff() > limit && Acts(Mechanism::kSteadyRests);
  };
  WindowRun cut = *run;
  while (cut.first < middle && is_away(cut.first)) ++cut.first;
  while (cut.second - kSpan > middle && is_away(cut.second - kSpan)) --cut.second;
  const bool mostly_steady = 2 * (cut.second - cut.first) >= end - begin;
  *run = cut;
  // Two places in between are checked as well, to find a turn there and back.
  const std::size_t third = (cut.second - cut.first - kSpan) / 3;
  return mostly_steady && !is_away(cut.first + third) && !is_away(cut.first + 2 * third);
}

// If a run has `fewest` windows or more, cuts up to a quarter of it at each end. Windows there are
// cut while their mean differs from that of the middle half by over 4 times the noise and over 4
// times the drift of this half. A steady drift is not cut: at the ends it is 3.5 times its RMS in
// the middle half.
void StaticDetector::CutSettling(const std::vector<TriadWindow>& windows,
                                 std::size_t fewest,
                                 WindowRun* run) {
  const std::size_t length = run->second - run->first;
  if (length < fewest) return;
  const WindowRun core{run->first + length / 4, run->second - length / 4};
  const Eigen::Vector3d mean = MeanOf(windows, core.first, core.second);
  const auto deviation = [&](std::size_t at) -> Eigen::Array3d {
    return (MeanOf(windows, at, at + kSpan) - mean).cwiseAbs();
  };
  Eigen::Array3d wander = Eigen::Array3d::Zero();
  double spans = 0.0;
  std::size_t end = core.first;
  for (; end + kSpan <= core.second; end += kSpan, spans += 1.0) {
    wander += deviation(end).square();
  }
  const Eigen::Array3d span_noise = spans * MeanVarianceOf(windows, core.first, end);
  const Eigen::Array3d limit = kNoiseSigmas * (wander / spans).max(span_noise).sqrt();
  const auto is_away = [&](std::size_t at) {
    return (deviation(at) > limit).any() && Acts(Mechanism::kSettlingEnds);
  };
  while (run->first < core.first && is_away(run->first)) ++run->first;
  while (run->second > core.second && is_away(run->second - kSpan)) --run->second;
}

bool StaticDetector::IsKnock(const WindowBuffer& buffer,
                             const WindowRun& earlier,
                             const WindowRun& later) const {
  const auto silent =
      static_cast<double>(buffer.index(later.first) - buffer.index(earlier.second - 1) - 1);
  // The activity's span makes the gap longer than the knock.
  if ((silent - static_cast<double>(kSpan - 1)) * window_s_ > options_.max_knock_s) return false;
  const WindowRun before{earlier.second - std::min(kSpan, earlier.second - earlier.first),
                         earlier.second};
  const WindowRun after{later.first, std::min(later.first + kSpan, later.second)};
  return std::all_of(all_.begin(),
                     all_.end(),
                     [&](const DetectorTriad& known) {
                       return IsAsBefore(buffer, known, before, after);
                     }) &&
         !WasHandled(buffer, before, after);
}

// True if the triad has the same reading before and after the gap. The accelerometer does not show
// a turn about the vertical, nor the magnetometer a turn about the field. So a gyroscope must not
// have turned during the gap either.
bool StaticDetector::IsAsBefore(const WindowBuffer& buffer,
                                const DetectorTriad& known,
                                const WindowRun& before,
                                const WindowRun& after) const {
  const auto& windows = buffer.windows(known.triad);
  const double samples_before = SamplesIn(windows, before);
  const double samples_after = SamplesIn(windows, after);
  if (samples_before == 0.0 || samples_after == 0.0) return true;
  const bool is_rate = known.triad == Triad::kGyroscope;
  double limit_raw = (is_rate ? kSameRateShare : kSameAttitudeShare) * range_raw_[known.triad];
  // The limit of the leading triad has no share for noise, so that a small turn is not hidden.
  if (known.triad != triads_.front().triad) {
    limit_raw += kNoiseSigmas *
                 std::sqrt(TotalVariance(windows, before.first, before.second) / samples_before +
                           TotalVariance(windows, after.first, after.second) / samples_after);
  }
  const Eigen::Vector3d mean = MeanOf(windows, before.first, before.second);
  if ((MeanOf(windows, after.first, after.second) - mean).cwiseAbs().maxCoeff() > limit_raw) {
    return false;
  }
  if (!is_rate) return true;
  Eigen::Vector3d angle_raw = Eigen::Vector3d::Zero();
  for (std::size_t i = before.second; i < after.first; ++i) {
    if (windows[i].count > 0) angle_raw += (windows[i].mean_raw - mean) * window_s_;
  }
  const double angle_limit_raw = known.si_per_raw > 0.0
                                     ? kSameHeadingRad / known.si_per_raw
                                     : kSameHeadingShareS * range_raw_[known.triad];
  return angle_raw.cwiseAbs().maxCoeff() <= angle_limit_raw;
}

// True when the leading triad was tilted during the gap, even if there and back.
bool StaticDetector::WasHandled(const WindowBuffer& buffer,
                                const WindowRun& before,
                                const WindowRun& after) const {
  const Triad leading = triads_.front().triad;
  const auto& windows = buffer.windows(leading);
  const Eigen::Vector3d mean = MeanOf(windows, before.first, before.second);
  for (std::size_t at = before.second; at + kSpan <= after.first; ++at) {
    if ((MeanOf(windows, at, at + kSpan) - mean).cwiseAbs().maxCoeff() >
        kHandledShare * range_raw_[leading]) {
      return true;
    }
  }
  return false;
}

bool StaticDetector::IsLongEnough(const Rest& rest) const {
  std::size_t windows = 0;
  for (const auto& [begin, end] : rest.runs) windows += end - begin;
  // Half a window of tolerance, since a rest is measured in whole windows.
  return (static_cast<double>(windows) + 0.5) * window_s_ >= options_.min_duration_s;
}

}  // namespace truetriad
