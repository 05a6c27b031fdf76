// SPDX-License-Identifier: Apache-2.0
#include "data/clock_lags.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <glog/logging.h>

#include "base/messages.h"
#include "data/window_statistics.h"
#include "math/distributions.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// Readings are averaged over slots of 0.1 s, far shorter than a lag that would ruin a rest of 1 s.
constexpr double kSlotS = 1e-9 * static_cast<double>(kWindowNs);
// Number of slots before the first reading (10 s), since other streams may begin earlier.
constexpr std::int64_t kSlotsBefore = 100;
// Six hours of slots, which bound the memory to 2.6 MB for each triad.
constexpr std::int64_t kMostSlots = 216'000;
// Chosen: changes are computed between slots up to 0.5 s apart, so that triads of 2 Hz are usable.
constexpr std::size_t kLongestGapSlots = 5;
// The longest lag, in slots: 6 s in either direction. Buffers and rounded stamps cause shorter
// lags; clocks that were never set differ by far more and give no peak.
constexpr int kMostLag = 60;
// Chosen, in slots: a peak reaches 1 s to each side; a second peak beyond makes the lag ambiguous.
constexpr int kPeakWidth = 10;
// Chosen: the least correlation of a clear peak. Half of the variance of either triad is then
// common to both.
constexpr double kClearCorrelation = 0.5;
// The log likelihood of a lag must exceed that of any rival by this much: a ratio of e^6 = 403.
constexpr double kClearlyLikelier = 6.0;
// Chosen: the share of variance that triads do not have in common even without noise; it bounds the
// likelihood of a perfect correlation.
constexpr double kUnlikeShare = 0.1;
// Number of slots in 1.2 s, about the duration of a turn by hand. They count as one observation.
constexpr double kSlotsOfATurn = 12.0;
// Chosen: a correlation needs half a minute of slots, which is 25 turns of kSlotsOfATurn.
constexpr int kFewestPairs = 300;
// Chosen: a change counts as rest if its square is below this share of the 90 % quantile of all
// squares. For the change itself, the share is a thousandth.
constexpr double kRestShare = 1e-6;
// Smallest lag to report, s: estimation finds smaller ones better, from the moves between rests.
constexpr double kSaidS = 0.25;

float Ninetieth(std::vector<float> values) {
  if (values.empty()) return 0.0F;
  const auto at = static_cast<std::ptrdiff_t>(9 * values.size() / 10);
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

const Eigen::Vector3f kNoReading = Eigen::Vector3f::Constant(std::nanf(""));

bool IsReading(const Eigen::Vector3f& mean) { return !std::isnan(mean.x()); }

// The median over the slots, per axis: a gyroscope's reading at rest if most slots are at rest.
Eigen::Vector3f MedianOf(const std::vector<Eigen::Vector3f>& means) {
  Eigen::Vector3f median = Eigen::Vector3f::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float> values;
    for (const Eigen::Vector3f& mean : means) {
      if (IsReading(mean)) values.push_back(mean[axis]);
    }
    if (values.empty()) continue;
    const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), half, values.end());
    median[axis] = *half;
  }
  return median;
}

// How much the unit turns from slot to slot, squared, in raw units. For a gyroscope, this is the
// rate less the rate at rest; for other sensors, the change of the reading. Negative: not known.
std::vector<float> Changes(Triad triad, const std::vector<Eigen::Vector3f>& means) {
  const bool is_rate = triad == Triad::kGyroscope;
  const Eigen::Vector3f rest = is_rate ? MedianOf(means) : Eigen::Vector3f::Zero();
  std::vector<float> changes(means.size(), -1.0F);
  std::optional<std::size_t> last;
  for (std::size_t i = 0; i < means.size(); ++i) {
    if (!IsReading(means[i])) continue;
    if (last && i - *last <= kLongestGapSlots) {
      const Eigen::Vector3f& before = means[*last];
      changes[i] = is_rate ? (0.5F * (means[i] + before) - rest).squaredNorm()
                           : (means[i] - before).squaredNorm();
    }
    last = i;
  }
  return changes;
}

// log2 of the changes; NaN for unknown ones.
std::vector<float> Logarithms(const std::vector<float>& change) {
  std::vector<float> known;
  for (const float value : change) {
    if (value >= 0.0F) known.push_back(value);
  }
  const float floor = static_cast<float>(kRestShare) * Ninetieth(known);
  std::vector<float> logs;
  logs.reserve(change.size());
  for (const float value : change) {
    logs.push_back(value >= 0.0F && floor > 0.0F ? std::log2(value + floor) : std::nanf(""));
  }
  return logs;
}

struct Correlation {
  double value = 0.0;
  double pairs = 0.0;

  double log_likelihood(double of_pairs) const {
    return -0.5 * of_pairs / kSlotsOfATurn * std::log(1.0 + kUnlikeShare - value * value);
  }
};

// Values, their squares, and ones. Where a value is unknown, all three are zero.
struct Known {
  explicit Known(const std::vector<float>& values) {
    for (Eigen::VectorXd* of : {&one, &value, &square}) of->setZero(std::ssize(values));
    for (Eigen::Index i = 0; i < one.size(); ++i) {
      const double known = values[static_cast<std::size_t>(i)];
      if (std::isnan(known)) continue;
      one[i] = 1.0;
      value[i] = known;
      square[i] = known * known;
    }
  }
  Eigen::VectorXd one, value, square;
};

// The correlation of a[i] with b[i + lag], over the pairs of which both values are known.
Correlation CorrelationAt(const Known& a, const Known& b, int lag) {
  const Eigen::Index from_a = std::max(0, -lag), from_b = std::max(0, lag);
  const Eigen::Index count = std::min(a.one.size() - from_a, b.one.size() - from_b);
  if (count < kFewestPairs) return {};
  const auto sum = [&](const Eigen::VectorXd& of_a, const Eigen::VectorXd& of_b) {
    return of_a.segment(from_a, count).dot(of_b.segment(from_b, count));
  };
  const double pairs = sum(a.one, b.one);
  if (pairs < kFewestPairs) return {};
  const double mean_a = sum(a.value, b.one) / pairs, mean_b = sum(a.one, b.value) / pairs;
  const double variance_a = sum(a.square, b.one) - pairs * mean_a * mean_a;
  const double variance_b = sum(a.one, b.square) - pairs * mean_b * mean_b;
  if (!(variance_a > 0.0) || !(variance_b > 0.0)) return {};
  const double covariance = sum(a.value, b.value) - pairs * mean_a * mean_b;
  return {covariance / std::sqrt(variance_a * variance_b), pairs};
}

// Median duration of the rests, s.
double TypicalRest(const PoseSet& set) {
  std::vector<double> durations_s;
  for (const StaticPose& pose : set.poses) durations_s.push_back(pose.duration_s());
  return Median(std::move(durations_s));
}

}  // namespace

void ClockLagFinder::Close(Track* track) {
  if (!(track->count > 0.0)) return;
  if (track->slot >= 0 && track->slot < kMostSlots) {
    track->means.resize(static_cast<std::size_t>(track->slot), kNoReading);
    track->means.push_back((track->sum / track->count).cast<float>());
  }
  track->sum.setZero();
  track->count = 0.0;
}

void ClockLagFinder::Add(const SampleBlock& block) {
  if (block.x.empty()) return;
  if (!started_) {
    started_ = true;
    origin_ns_ = block.time_ns.front() - kSlotsBefore * kWindowNs;
  }
  Track& track = tracks_[block.triad];
  for (std::size_t i = 0; i < block.x.size(); ++i) {
    const std::int64_t slot = std::max<std::int64_t>(block.time_ns[i] - origin_ns_, 0) / kWindowNs;
    if (slot >= kMostSlots) break;
    if (slot != track.slot) {
      Close(&track);
      track.slot = slot;
    }
    track.sum += Eigen::Vector3d(block.x[i], block.y[i], block.z[i]);
    track.count += 1.0;
  }
}

std::optional<double> ClockLagFinder::LagOf(Triad triad, Triad reference) const {
  const Known a(Logarithms(Changes(reference, tracks_[reference].means)));
  const Known b(Logarithms(Changes(triad, tracks_[triad].means)));
  std::array<Correlation, 2 * kMostLag + 1> correlation;
  for (int lag = -kMostLag; lag <= kMostLag; ++lag) {
    correlation[static_cast<std::size_t>(lag + kMostLag)] = CorrelationAt(a, b, lag);
  }
  const auto peak = std::max_element(
      correlation.begin(), correlation.end(), [](const Correlation& one, const Correlation& other) {
        return one.value < other.value;
      });
  const auto at = static_cast<int>(peak - correlation.begin());
  VLOG(1) << TriadName(triad) << " against " << TriadName(reference) << ": correlation "
          << peak->value << " at " << kSlotS * (at - kMostLag) << " s, "
          << correlation[kMostLag].value << " at 0";
  if (peak->value < kClearCorrelation || at == 0 || at == 2 * kMostLag) return std::nullopt;
  // Too few common readings at lag 0 do not contradict the stated times. Nor does a distant maximum
  // if lag 0 is a maximum too: poses at even intervals give a maximum at each interval.
  const Correlation& stated = correlation[kMostLag];
  const bool is_top = stated.value > kClearCorrelation &&
                      stated.value >= correlation[kMostLag - 1].value &&
                      stated.value >= correlation[kMostLag + 1].value;
  const bool is_apart = std::abs(at - kMostLag) > kPeakWidth;
  if (!(stated.pairs > 0.0) || (is_apart && is_top)) return std::nullopt;
  for (int other = 0; other <= 2 * kMostLag; ++other) {
    if (std::abs(other - at) <= kPeakWidth) continue;
    const Correlation& rival = correlation[static_cast<std::size_t>(other)];
    // Both likelihoods are computed for the same number of pairs: streams with interruptions have
    // more pairs at some lags, which is no evidence for these lags.
    const double pairs = std::min(rival.pairs, peak->pairs);
    if (rival.value > 0.0 &&
        rival.log_likelihood(pairs) > peak->log_likelihood(pairs) - kClearlyLikelier) {
      return std::nullopt;
    }
  }
  // The maximum of the parabola through the peak and the values on both sides of it.
  const double before = (peak - 1)->value, after = (peak + 1)->value;
  const double bend = before - 2.0 * peak->value + after;
  const double beside = bend < 0.0 ? 0.5 * (before - after) / bend : 0.0;
  return kSlotS * (static_cast<double>(at - kMostLag) + beside);
}

Triad ClockReference(const PoseSet& set) {
  return set.Find(Triad::kGyroscope) != nullptr ? Triad::kGyroscope : Triad::kAccelerometer;
}

Findings FindClockLags(const ClockLagFinder& finder, PoseSet* set) {
  const Triad reference = ClockReference(*set);
  Findings findings;
  std::string block;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (triad == reference || set->Find(triad) == nullptr || set->Find(reference) == nullptr) {
      continue;
    }
    const std::optional<double> lag_s = finder.LagOf(triad, reference);
    if (!lag_s || std::abs(*lag_s) < kSaidS || !Acts(Mechanism::kClockLag)) continue;
    set->clock_lag_s[triad] = *lag_s;
    const std::string name(TriadName(triad));
    findings.push_back(Finding(FindingCode::kClockLag,
                               name + ": readings " + (*lag_s > 0.0 ? "delayed" : "early") +
                                   Format(" by %.1f s relative to the ", std::abs(*lag_s)) +
                                   std::string(TriadName(reference)) + ": the clocks differ")
                           .About(triad)
                           .With("offset", *lag_s, "s"));
    // With this lag, over half of a typical rest's readings come from a turn or from another rest.
    if (!set->poses.empty() && 2.0 * std::abs(*lag_s) > TypicalRest(*set)) {
      findings.back().As(Severity::kRefusal);
    }
    block += (block.empty() ? "" : ", ") + name +
             Format(": { time_offset_s: %.1f }", set->time_offset_s[triad] + *lag_s);
  }
  // One block of configuration corrects all triads. The last finding and each refusal state it.
  for (Finding& finding : findings) {
    if (&finding != &findings.back() && !finding.IsRefusal()) continue;
    finding.remedy =
        "correct it with `sensors: { " + block + " }` and run again to find the remaining delay";
  }
  return findings;
}

}  // namespace truetriad
