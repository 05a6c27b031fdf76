// SPDX-License-Identifier: Apache-2.0
#include "thermometer/thermometer.h"

#include <algorithm>
#include <cmath>

#include "math/distributions.h"

namespace truetriad {
namespace {

// A spike is outside the range of its neighbours by more than 6 times the 95 % quantile of the
// steps from cell to cell, and by more than 5 % of the range of the central 90 % of cells. A
// turning point is outside by three steps, which is half of the limit.
constexpr double kSpikeSteps = 6.0, kSpikeShare = 0.05;
// A change of a reading by up to this, degC, is rounding: of decimals, or by a conversion of units.
constexpr double kLeastStep = 1e-6;

}  // namespace

void ThermometerWatch::Note(std::span<const std::int64_t> time_ns, std::span<const double> degc) {
  for (std::size_t i = 0; i < degc.size(); ++i) {
    ++rows_;
    const double change = std::abs(degc[i] - last_degc_);
    if (!std::isnan(degc[i])) last_degc_ = degc[i];
    if (!(change > kLeastStep)) continue;
    // A change is a whole number of steps, and so is the difference of two changes. So the step is
    // at most as large as either.
    for (const double step : {change, std::abs(change - last_change_degc_)}) {
      if (step > kLeastStep && (step_degc_ == 0.0 || step < step_degc_)) step_degc_ = step;
    }
    last_change_degc_ = change;
    if (has_changed_) {
      const double gap_s = static_cast<double>(time_ns[i] - last_change_ns_) * 1e-9;
      const double place = 4.0 * std::log2(std::max(gap_s * 1e6, 1.0));
      const auto bin = static_cast<std::size_t>(std::min(place, kChangeBins - 1.0));
      ++gaps_[bin];
      gap_sum_s_[bin] += gap_s;
      gap_rows_[bin] += rows_;
      ++changes_;
      change_sum_degc_ += change;
    }
    has_changed_ = true;
    rows_ = 0;
    last_change_ns_ = time_ns[i];
  }
}

double ThermometerWatch::hold_s() const {
  // Five intervals between changes can be compared; even a short sweep has them.
  constexpr std::int64_t kFewestChanges = 5;
  // Readings count as repeated if at most 2 % of the intervals are shorter than the most frequent
  // interval, at least 60 % agree with it, and the mean change is two steps or more.
  constexpr double kSooner = 0.02, kRegular = 0.6, kSteps = 2.0;
  // If the reading changes more often than every third row on average, it is not repeated.
  constexpr double kRows = 3.0;
  if (changes_ < kFewestChanges) return 0.0;
  const auto all = static_cast<double>(changes_);
  if (change_sum_degc_ / all < kSteps * step_degc_) return 0.0;
  const auto most =
      static_cast<std::size_t>(std::max_element(gaps_.begin(), gaps_.end()) - gaps_.begin());
  const std::size_t begin = most - std::min<std::size_t>(most, 1);
  const std::size_t end = std::min<std::size_t>(most + 2, kChangeBins);
  double sooner = 0.0, regular = 0.0, sum_s = 0.0, rows = 0.0;
  for (std::size_t bin = 0; bin < begin; ++bin) sooner += static_cast<double>(gaps_[bin]);
  for (std::size_t bin = begin; bin < end; ++bin) {
    regular += static_cast<double>(gaps_[bin]);
    sum_s += gap_sum_s_[bin];
    rows += static_cast<double>(gap_rows_[bin]);
  }
  if (rows < kRows * regular) return 0.0;
  return sooner > kSooner * all || regular < kRegular * all ? 0.0 : sum_s / regular;
}

TakenReadings ReadingsAsTaken(const std::vector<double>& time_s,
                              const std::vector<double>& degc,
                              double hold_s) {
  const double cell_s = (time_s.back() - time_s.front()) /
                        static_cast<double>(std::max<std::size_t>(time_s.size(), 2) - 1);
  TakenReadings taken;
  if (!(hold_s > 0.0)) return {time_s, degc};
  const auto add = [&taken](double time, double value) {
    if (!taken.time_s.empty() && time <= taken.time_s.back()) return;
    taken.time_s.push_back(time), taken.degc.push_back(value);
  };
  // If a reading was taken again with the same value, it is added again after each hold_s.
  const auto add_repeats = [&](double from, double to, double value) {
    for (double time = from + hold_s; time < to - 0.5 * hold_s; time += hold_s) add(time, value);
  };
  std::size_t level = 0;  // Last cell of the latest level.
  bool has_level = false;
  double from = time_s.front() - hold_s;
  for (std::size_t i = 0; i + 1 < degc.size(); ++i) {
    if (std::abs(degc[i + 1] - degc[i]) > kLeastStep) continue;
    // Cells i and i + 1 have the same reading, a level.
    if (has_level && std::abs(degc[i] - degc[level]) > kLeastStep) {
      // If a cell contains a change, its mean shows which share belongs to the level before.
      double time = time_s[level] + 0.5 * cell_s;
      for (std::size_t m = level + 1; m < i; ++m) {
        time += std::clamp((degc[i] - degc[m]) / (degc[i] - degc[level]), 0.0, 1.0) * cell_s;
      }
      if (taken.time_s.empty()) {
        from = std::max(time - hold_s, time_s.front() - hold_s);
        add(from, degc[level]);
      }
      add_repeats(from, time, degc[level]);
      add(time, degc[i]);
      from = time;
    }
    level = i + 1;
    has_level = true;
  }
  if (!taken.time_s.empty()) add_repeats(from, time_s.back() + 0.5 * hold_s, degc[level]);
  return taken;
}

std::vector<bool> TemperatureSpikes(const std::vector<double>& degc, double step_degc) {
  const auto size = static_cast<std::ptrdiff_t>(degc.size());
  if (size < 2) return std::vector<bool>(degc.size(), false);
  std::vector<double> steps;
  for (std::size_t i = 1; i < degc.size(); ++i) steps.push_back(std::abs(degc[i] - degc[i - 1]));
  const double range = LowerQuantile(degc, 0.95) - LowerQuantile(degc, 0.05);
  const double limit = std::max(
      {kSpikeSteps * LowerQuantile(std::move(steps), 0.95), kSpikeShare * range, 2.0 * step_degc});
  const auto middle = [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    return Median(std::vector<double>(degc.begin() + begin, degc.begin() + end));
  };
  constexpr auto kBeside = static_cast<std::ptrdiff_t>(kNeighbours);
  std::vector<bool> spikes;
  for (std::ptrdiff_t i = 0; i < size; ++i) {
    const std::ptrdiff_t first = std::max<std::ptrdiff_t>(i - kBeside, 0);
    const std::ptrdiff_t last = std::min<std::ptrdiff_t>(i + 1 + kBeside, size);
    double low = i > first ? middle(first, i) : middle(i + 1, last), high = low;
    if (i > first && last > i + 1) {
      const double after = middle(i + 1, last);
      low = std::min(low, after);
      high = std::max(high, after);
    }
    const double value = degc[static_cast<std::size_t>(i)];
    spikes.push_back(limit > 0.0 && std::max(value - high, low - value) > limit);
  }
  return spikes;
}

std::vector<std::pair<std::size_t, std::size_t>> StuckTemperatures(
    const std::vector<double>& time_s, const std::vector<double>& degc) {
  // Chosen: across a gap of more than five cells the temperature may have changed by any amount.
  constexpr double kLongestGap = 5.0;
  std::vector<double> steps, spacings_s;
  for (std::size_t i = 1; i < time_s.size(); ++i) spacings_s.push_back(time_s[i] - time_s[i - 1]);
  const double longest_s = spacings_s.empty() ? 0.0 : kLongestGap * Median(spacings_s);
  for (std::size_t i = 1; i < degc.size(); ++i) {
    const double step = std::abs(degc[i] - degc[i - 1]);
    if (step > kLeastStep) steps.push_back(step);
  }
  std::vector<std::pair<std::size_t, std::size_t>> stuck;
  if (steps.empty()) return stuck;
  const double limit = kSpikeSteps * LowerQuantile(std::move(steps), 0.95);
  for (std::size_t begin = 0, i = 1; i < degc.size(); ++i) {
    if (std::abs(degc[i] - degc[i - 1]) <= kLeastStep) continue;
    // The cell with the jump may hold readings from before the jump: the next one is compared too.
    const double after = degc[std::min(i + 1, degc.size() - 1)];
    const double jump = std::max(std::abs(degc[i] - degc[begin]), std::abs(after - degc[begin]));
    const bool follows = time_s[i] - time_s[i - 1] <= longest_s;
    if (i - begin > 1 && jump > limit && follows) stuck.emplace_back(begin + 1, i);
    begin = i;
  }
  return stuck;
}

std::vector<double> Bridged(const std::vector<double>& time_s,
                            const std::vector<double>& degc,
                            const std::vector<bool>& marked) {
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < degc.size(); ++i) {
    if (!marked[i]) known.push_back(i);
  }
  if (known.empty()) return degc;
  std::vector<double> bridged = degc;
  for (std::size_t i = 0; i < degc.size(); ++i) {
    if (!marked[i]) continue;
    const auto next = std::lower_bound(known.begin(), known.end(), i);
    const std::size_t before = next == known.begin() ? *next : *(next - 1);
    const std::size_t after = next == known.end() ? before : *next;
    const double span_s = time_s[after] - time_s[before];
    const double share = span_s > 0.0 ? (time_s[i] - time_s[before]) / span_s : 0.0;
    bridged[i] = degc[before] + share * (degc[after] - degc[before]);
  }
  return bridged;
}

}  // namespace truetriad
