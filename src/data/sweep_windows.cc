// SPDX-License-Identifier: Apache-2.0
#include "data/sweep_windows.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "math/distributions.h"
#include "thermometer/temperature_smoothing.h"
#include "thermometer/thermometer.h"
#include "truetriad/base/triad.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

constexpr std::size_t kMaxCells = 32768;
// Cells where the experiment states no window.
constexpr std::int64_t kFirstCellNs = 250'000'000;
constexpr std::size_t kFewestCells = 40;
// Of a thermometer that is read now and then.
constexpr int kFewestReadings = 40;
// A window ends when the temperature has changed by this share of its range, or this share of the
// recording has passed.
constexpr double kThermalShare = 1.0 / 200.0;
constexpr double kTimeShare = 1.0 / 400.0;
// Neighbours on each side that say where a cell should be, and how many σ it may be off.
constexpr std::size_t kNeighbours = 5;
constexpr double kFarOffSigmas = 10.0;
constexpr double kDisturbedFactor = 4.0;
constexpr double kDisturbedLevel = 1e-9;
// More rows than this are counted, not named.
constexpr std::size_t kNamed = 10;
// A change of specific force from one window to the next that no temperature makes.
constexpr double kTurnedShare = 0.03;

// What a robust straight line through the neighbours of each value leaves of it (Theil 1950, Sen
// 1968). `time` increases.
std::vector<double> OffNeighbours(const std::vector<double>& time,
                                  const std::vector<double>& value) {
  std::vector<double> off;
  off.reserve(value.size());
  std::vector<double> slopes, levels;
  const std::size_t count = std::min(2 * kNeighbours + 1, value.size());
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::size_t begin = std::min(i - std::min(i, kNeighbours), value.size() - count);
    slopes.clear(), levels.clear();
    for (std::size_t j = begin; j < begin + count; ++j) {
      for (std::size_t k = begin; k < j; ++k) {
        if (j == i || k == i || !(time[j] > time[k])) continue;
        slopes.push_back((value[j] - value[k]) / (time[j] - time[k]));
      }
    }
    if (slopes.empty()) {
      off.push_back(0.0);
      continue;
    }
    const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
    std::nth_element(slopes.begin(), middle, slopes.end());
    for (std::size_t j = begin; j < begin + count; ++j) {
      if (j != i) levels.push_back(value[j] - *middle * (time[j] - time[i]));
    }
    off.push_back(value[i] - Median(levels));
  }
  return off;
}

// How far each value is outside of those beside it.
std::vector<double> BeyondNeighbours(const std::vector<double>& value) {
  std::vector<double> beyond;
  for (std::size_t i = 0; i < value.size(); ++i) {
    double low = value[i == 0 ? std::min<std::size_t>(1, value.size() - 1) : i - 1];
    double high = low;
    if (i > 0 && i + 1 < value.size()) {
      low = std::min(low, value[i + 1]);
      high = std::max(high, value[i + 1]);
    }
    beyond.push_back(std::max({0.0, value[i] - high, low - value[i]}));
  }
  return beyond;
}

double UsualStep(const std::vector<double>& value) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < value.size(); ++i) steps.push_back(std::abs(value[i] - value[i - 1]));
  return steps.empty() ? 0.0 : Median(std::move(steps));
}

double SigmaOf(const std::vector<double>& values) {
  std::vector<double> sizes;
  sizes.reserve(values.size());
  for (const double value : values) sizes.push_back(std::abs(value));
  return sizes.empty() ? 0.0 : kMadToSigma * Median(std::move(sizes));
}

// Places far off what is expected of them and beyond both neighbours: a turning point, which bends
// away from any line, goes beyond by a usual step at most.
std::vector<bool> FarOff(const std::vector<double>& value,
                         const std::vector<double>& off,
                         double least) {
  const double sigma = SigmaOf(off);
  const double limit = std::max(kFarOffSigmas * sigma, least);
  const double step = UsualStep(value);
  const std::vector<double> beyond = BeyondNeighbours(value);
  std::vector<bool> far_off(value.size(), false);
  if (!(limit > 0.0)) return far_off;
  for (std::size_t i = 0; i < value.size(); ++i) {
    far_off[i] = std::abs(off[i]) > limit && beyond[i] > 0.5 * limit + 1.5 * step;
  }
  return far_off;
}

std::string Fixed1(double value) {
  std::string text = std::to_string(value);
  return text.substr(0, text.find('.') + 2);
}

}  // namespace

void SweepCutter::Cell::Merge(const Cell& later) {
  degc_count += later.degc_count;
  degc_sum += later.degc_sum;
  time_sum_s += later.time_sum_s;
  ambient_count += later.ambient_count;
  ambient_sum += later.ambient_sum;
  const auto samples = [](const Cell& cell) {
    std::int64_t count = 0;
    for (const TriadWindow& window : cell.triads.items) count += window.count;
    return count;
  };
  if (attitude == later.attitude) {
    for (const Triad triad : kTriads) triads[triad].Merge(later.triads[triad]);
  } else if (samples(later) > samples(*this)) {
    triads = later.triads;
    attitude = later.attitude;
  }
}

SweepCutter::SweepCutter(const PoseSelection& selection, const RecordingInfo& info, Triad leading)
    : selection_(selection), info_(info), leading_(leading) {
  cell_samples_ = selection.sweep.window_samples;
  cell_ns_ = selection.sweep.window_s > 0.0
                 ? static_cast<std::int64_t>(
                       std::llround(std::clamp(selection.sweep.window_s, 1e-9, 1e9) * 1e9))
                 : kFirstCellNs;
  for (const PoseRange& range : selection.ranges) {
    const std::string name =
        range.id.empty() ? std::to_string(range_attitude_.size() + 1) : range.id;
    const auto known = std::find(attitude_names_.begin(), attitude_names_.end(), name);
    range_attitude_.push_back(static_cast<int>(known - attitude_names_.begin()));
    if (known == attitude_names_.end()) attitude_names_.push_back(name);
  }
  if (attitude_names_.empty()) attitude_names_.emplace_back("1");
  range_used_.assign(selection.ranges.size(), false);
}

Status SweepCutter::Validate() const {
  if (!info_.has_time) {
    return BadInputError(info_.path +
                         ": has no time, so the temperature rate is unknown; add a time column, or "
                         "state the rate in a manifest (`time: {unit: samples, rate_hz: 100}`)");
  }
  const bool has_temperature =
      std::any_of(info_.streams.begin(), info_.streams.end(), [](const StreamInfo& stream) {
        return stream.has_temperature;
      });
  if (!has_temperature) {
    return BadInputError(info_.path +
                         ": has no temperature, but a sweep needs it; add a column "
                         "`temperature[degC]`, or `temperature:` to a stream in a manifest");
  }
  const bool has_ambient = std::any_of(info_.streams.begin(),
                                       info_.streams.end(),
                                       [](const StreamInfo& stream) { return stream.has_ambient; });
  if (selection_.sweep.ambient && !has_ambient) {
    return BadInputError(info_.path +
                         ": has no ambient temperature, but it is a factor of `thermal: { "
                         "regression }`; add a column `ambient_temperature[degC]`, or "
                         "`ambient_temperature:` to a stream in a manifest, or remove that factor");
  }
  std::int64_t previous = -1;
  for (std::size_t i = 0; i < selection_.ranges.size(); ++i) {
    const PoseRange& range = selection_.ranges[i];
    if (range.first <= previous || range.last < range.first) {
      return BadInputError("poses.sweep.attitudes: range " + std::to_string(i + 1) + " is rows " +
                           std::to_string(range.first) + " to " + std::to_string(range.last) +
                           "; expected first <= last, both 0-based, in file order, without "
                           "overlap");
    }
    previous = range.last;
  }
  if (selection_.ranges.empty() && cell_samples_ == 0) return {};
  for (const StreamInfo& stream : info_.streams) {
    if (stream.file == info_.Find(leading_)->file) continue;
    return BadInputError(info_.path + ": " + stream.file + " and " + info_.Find(leading_)->file +
                         " have separate rows, so row numbers are ambiguous for windows and "
                         "attitudes; state `window_s`, or put all sensors into one file");
  }
  return {};
}

int SweepCutter::AttitudeOf(std::int64_t row) {
  if (selection_.ranges.empty()) return 0;
  const auto after = std::upper_bound(
      selection_.ranges.begin(),
      selection_.ranges.end(),
      row,
      [](std::int64_t value, const PoseRange& range) { return value < range.first; });
  if (after == selection_.ranges.begin() || row > std::prev(after)->last) return -1;
  return range_attitude_[static_cast<std::size_t>(after - selection_.ranges.begin()) - 1];
}

void SweepCutter::MergePairs() {
  for (std::size_t i = 0; i < cells_.size(); i += 2) {
    if (i > 0) cells_[i / 2] = std::move(cells_[i]);
    if (i + 1 < cells_.size()) cells_[i / 2].Merge(cells_[i + 1]);
  }
  cells_.resize((cells_.size() + 1) / 2);
  cell_ns_ *= 2;
  cell_samples_ *= 2;
  was_doubled_ = true;
}

std::size_t SweepCutter::CellOf(std::int64_t time_ns, std::int64_t row) {
  const auto place = [&] {
    return static_cast<std::size_t>(
        cell_samples_ > 0 ? row / cell_samples_
                          : std::max<std::int64_t>(time_ns - origin_ns_, 0) / cell_ns_);
  };
  while (place() >= kMaxCells) MergePairs();
  if (place() >= cells_.size()) cells_.resize(place() + 1);
  return place();
}

void SweepCutter::AddRun(const SampleBlock& block, std::size_t begin, std::size_t end) {
  const int attitude = AttitudeOf(block.row[begin]);
  Cell& cell = cells_[CellOf(block.time_ns[begin], block.row[begin])];
  const TriadWindow window = Summarize(block, begin, end);
  if (window.temperature_count > 0) {
    cell.degc_count += window.temperature_count;
    cell.degc_sum += window.temperature_sum_degc;
    const double middle_s = (static_cast<double>(window.first_ns - origin_ns_) +
                             0.5 * static_cast<double>(window.last_ns - window.first_ns)) *
                            1e-9;
    cell.time_sum_s += middle_s * static_cast<double>(window.temperature_count);
  }
  if (!block.ambient_degc.empty()) {
    for (const double degc : block.ambient_degc.subspan(begin, end - begin)) {
      if (std::isnan(degc)) continue;
      cell.ambient_sum += degc;
      ++cell.ambient_count;
    }
  }
  if (attitude < 0) return;
  for (std::size_t i = 0; i < range_used_.size(); ++i) {
    const PoseRange& range = selection_.ranges[i];
    if (block.row[begin] >= range.first && block.row[begin] <= range.last) range_used_[i] = true;
  }
  if (cell.attitude < 0) cell.attitude = attitude;
  if (cell.attitude == attitude) cell.triads[block.triad].Merge(window);
}

void SweepCutter::Add(const SampleBlock& block) {
  if (block.x.empty()) return;
  if (!started_) {
    started_ = true;
    origin_ns_ = block.time_ns.front();
  }
  // Sensors of one file share their thermometer: one of them tells how it reports.
  if (!block.temperature_degc.empty() && watched_.value_or(block.triad) == block.triad) {
    watched_ = block.triad;
    thermometer_.Note(block.time_ns, block.temperature_degc);
    if (!block.ambient_degc.empty()) ambient_thermometer_.Note(block.time_ns, block.ambient_degc);
  }
  for (std::size_t begin = 0; begin < block.x.size();) {
    const std::size_t cell = CellOf(block.time_ns[begin], block.row[begin]);
    const int attitude = AttitudeOf(block.row[begin]);
    std::size_t end = begin + 1;
    while (end < block.x.size() && CellOf(block.time_ns[end], block.row[end]) == cell &&
           AttitudeOf(block.row[end]) == attitude) {
      ++end;
    }
    AddRun(block, begin, end);
    begin = end;
  }
}

TemperatureTrack SweepCutter::SmoothAmbient(const TemperatureTrack& track) const {
  std::vector<double> time_s, degc;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (cells_[i].ambient_count == 0) continue;
    time_s.push_back(track.time_s[i]);
    degc.push_back(cells_[i].ambient_degc());
  }
  constexpr std::size_t kFewest = 4;
  TemperatureTrack known;
  if (time_s.size() >= kFewest) {
    Result<TemperatureTrack> smooth = SmoothTemperature(
        time_s,
        Bridged(time_s, degc, TemperatureSpikes(degc, ambient_thermometer_.step_degc())),
        ambient_thermometer_.step_degc(),
        ambient_thermometer_.hold_s());
    if (smooth) {
      known = *std::move(smooth);
    } else {
      // It stays where it is, which tells nothing, and is no error.
      known.degc = degc;
      known.rate_degcps.assign(degc.size(), 0.0);
    }
  }
  TemperatureTrack ambient = known;
  ambient.time_s = track.time_s;
  ambient.degc.assign(cells_.size(), std::numeric_limits<double>::quiet_NaN());
  ambient.rate_degcps = ambient.degc;
  if (known.degc.empty()) return ambient;
  for (std::size_t i = 0, k = 0; i < cells_.size(); ++i) {
    if (cells_[i].ambient_count == 0) continue;
    ambient.degc[i] = known.degc[k];
    ambient.rate_degcps[i] = known.rate_degcps[k++];
  }
  return ambient;
}

void SweepCutter::LeaveOutFarOff(const TemperatureTrack& track,
                                 const std::vector<bool>& spikes,
                                 PoseSet* set) {
  std::vector<std::vector<std::string>> reasons(cells_.size());
  const auto leave_out = [&](std::size_t i, const std::string& what) {
    cells_[i].far_off = true;
    if (std::find(reasons[i].begin(), reasons[i].end(), what) == reasons[i].end()) {
      reasons[i].push_back(what);
    }
  };
  std::vector<double> degc, residuals;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    degc.push_back(cells_[i].degc());
    residuals.push_back(cells_[i].degc() - track.degc[i]);
  }
  // Between two readings of a slow thermometer a repeated one is off by what it changes meanwhile.
  const bool is_held = thermometer_.hold_s() > 0.0;
  const std::vector<bool> odd_degc =
      is_held ? spikes : FarOff(degc, residuals, 1.5 * track.step_degc);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (odd_degc[i] || spikes[i]) leave_out(i, "temperature");
  }
  for (const StreamInfo& stream : info_.streams) {
    std::vector<std::size_t> index;
    std::vector<double> time, value;
    for (std::size_t a = 0; a < attitude_names_.size(); ++a) {
      for (int axis = 0; axis < 3; ++axis) {
        index.clear(), time.clear(), value.clear();
        std::vector<double> variances;
        for (std::size_t i = 0; i < cells_.size(); ++i) {
          const TriadWindow& window = cells_[i].triads[stream.triad];
          if (cells_[i].attitude != static_cast<int>(a) || window.count == 0) continue;
          index.push_back(i);
          time.push_back(track.time_s[i]);
          value.push_back(window.mean_raw[axis]);
          const auto dof = static_cast<double>(window.count - 1);
          if (dof < 1.0) continue;
          // Median of χ² over its degrees of freedom, Wilson and Hilferty 1931.
          const double median = std::pow(1.0 - 2.0 / (9.0 * dof), 3);
          variances.push_back(window.scatter_raw(axis, axis) / dof / median);
        }
        const std::string name = std::string(TriadName(stream.triad)) + " " +
                                 kAxisLetters[static_cast<std::size_t>(axis)];
        const std::vector<bool> odd = FarOff(value, OffNeighbours(time, value), 0.0);
        for (std::size_t i = 0; i < odd.size(); ++i) {
          if (odd[i]) leave_out(index[i], name);
        }
        const double variance = variances.empty() ? 0.0 : Median(variances);
        if (!(variance > 0.0)) continue;
        for (const std::size_t i : index) {
          const TriadWindow& window = cells_[i].triads[stream.triad];
          if (window.count < 2) continue;
          const double chi2 = window.scatter_raw(axis, axis) / variance;
          const auto dof = static_cast<double>(window.count - 1);
          if (chi2 > kDisturbedFactor * ChiSquareQuantile(1.0 - kDisturbedLevel, dof)) {
            leave_out(i, name + " (disturbed)");
          }
        }
      }
    }
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (reasons[i].empty() || ++count > kNamed) continue;
    std::int64_t first = std::numeric_limits<std::int64_t>::max(), last = -1;
    for (const StreamInfo& stream : info_.streams) {
      const TriadWindow& window = cells_[i].triads[stream.triad];
      if (window.count == 0) continue;
      first = std::min(first, window.first_row), last = std::max(last, window.last_row);
    }
    const std::string rows = first == last
                                 ? "row " + std::to_string(first)
                                 : "rows " + std::to_string(first) + " to " + std::to_string(last);
    std::string what;
    for (const std::string& reason : reasons[i]) what += (what.empty() ? "" : ", ") + reason;
    set->sweep.left_out.push_back(rows + " (at " + Fixed1(track.time_s[i]) + " s, " +
                                  Fixed1(track.degc[i]) + " degC): outliers: " + what);
  }
  if (count > kNamed) {
    set->sweep.left_out.push_back(std::to_string(count - kNamed) + " more places with outliers");
  }
}

// σ of one sample, from inside the cells, or where cells are single samples from their differences.
Eigen::Vector3d SweepCutter::SampleSigma(Triad triad) const {
  constexpr double kEnoughDof = 20.0;
  Eigen::Vector3d scatter = Eigen::Vector3d::Zero();
  double dof = 0.0;
  std::array<std::vector<double>, 3> differences;
  const Cell* before = nullptr;
  for (const Cell& cell : cells_) {
    const TriadWindow& window = cell.triads[triad];
    if (cell.far_off || window.count == 0) continue;
    scatter += window.scatter_raw.diagonal();
    dof += static_cast<double>(window.count - 1);
    if (before != nullptr && before->attitude == cell.attitude) {
      const TriadWindow& other = before->triads[triad];
      const double share = 1.0 / std::sqrt(1.0 / static_cast<double>(window.count) +
                                           1.0 / static_cast<double>(other.count));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<Eigen::Index>(axis);
        differences[axis].push_back(share * (window.mean_raw[i] - other.mean_raw[i]));
      }
    }
    before = &cell;
  }
  if (dof >= kEnoughDof) return (scatter / dof).cwiseSqrt();
  return {SigmaOf(differences[0]), SigmaOf(differences[1]), SigmaOf(differences[2])};
}

void SweepCutter::AddWindow(std::size_t first, std::size_t last, PoseSet* set) const {
  const TemperatureTrack& track = set->sweep.temperature;
  StaticPose pose;
  PerTriad<TriadWindow> sums;
  double degc = 0.0, rate = 0.0, count = 0.0;
  for (std::size_t i = first; i <= last; ++i) {
    if (cells_[i].far_off) continue;
    for (const Triad triad : kTriads) sums[triad].Merge(cells_[i].triads[triad]);
    degc += track.degc[i], rate += track.rate_degcps[i], count += 1.0;
  }
  const TriadWindow& leading = sums[leading_];
  if (leading.count == 0) return;
  pose.number = static_cast<int>(set->poses.size() + 1);
  pose.start_ns = leading.first_ns, pose.end_ns = leading.last_ns;
  pose.first_row = leading.first_row, pose.last_row = leading.last_row;
  pose.temperature_degc = degc / count;
  pose.temperature_rate_degcps = rate / count;
  const int attitude = cells_[first].attitude;
  pose.id = attitude_names_.size() > 1 ? attitude_names_[static_cast<std::size_t>(attitude)] : "";
  for (const StreamInfo& stream : info_.streams) {
    const TriadWindow& window = sums[stream.triad];
    if (window.count == 0) continue;
    TriadPose& reading = pose.triads[stream.triad].emplace();
    reading.samples = window.count;
    reading.mean_raw = window.mean_raw;
    const Eigen::Vector3d sigma = set->Find(stream.triad)->noise_sigma_raw;
    reading.sample_covariance_raw = sigma.cwiseAbs2().asDiagonal();
    reading.mean_covariance_raw = reading.sample_covariance_raw / static_cast<double>(window.count);
    reading.has_covariance = (sigma.array() > 0.0).all();
  }
  set->poses.push_back(std::move(pose));
  set->sweep.first.push_back(first);
  set->sweep.last.push_back(last);
  set->sweep.attitude.push_back(attitude);
}

void SweepCutter::MakeWindows(PoseSet* set) const {
  const TemperatureTrack& track = set->sweep.temperature;
  const bool is_given = selection_.sweep.window_s > 0.0 || selection_.sweep.window_samples > 0;
  const auto [low, high] = std::minmax_element(track.degc.begin(), track.degc.end());
  const double most_degc = kThermalShare * (*high - *low);
  const double most_s = kTimeShare * (track.time_s.back() - track.time_s.front());
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::size_t first = kNone, last = kNone;
  const auto close = [&] {
    if (first != kNone) AddWindow(first, last, set);
    first = kNone;
  };
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (cells_[i].far_off) continue;
    const bool is_over =
        first != kNone && (is_given || cells_[i].attitude != cells_[first].attitude ||
                           std::abs(track.degc[i] - track.degc[first]) > most_degc ||
                           track.time_s[i] - track.time_s[first] > most_s);
    if (cells_[i].attitude < 0 || is_over) close();
    if (cells_[i].attitude < 0) continue;
    if (first == kNone) first = i;
    last = i;
  }
  close();
}

// A unit that was turned shows a step of gravity.
Status SweepCutter::CheckHeld(const PoseSet& set) const {
  constexpr Triad kTriad = Triad::kAccelerometer;
  for (std::size_t k = 1; k < set.poses.size(); ++k) {
    const auto &before = set.poses[k - 1].triads[kTriad], &after = set.poses[k].triads[kTriad];
    if (!before || !after || set.sweep.attitude[k - 1] != set.sweep.attitude[k]) continue;
    const double change = (after->mean_raw - before->mean_raw).norm();
    if (change < kTurnedShare * std::min(before->mean_raw.norm(), after->mean_raw.norm())) continue;
    return NotEnoughError(
        Finding(FindingCode::kUnitTurned,
                set.source + ": the accelerometer jumps between the rows " +
                    std::to_string(set.poses[k - 1].last_row) + " and " +
                    std::to_string(set.poses[k].first_row) + ", as if the unit was turned",
                "state when each attitude was held: `poses: { sweep: { attitudes: poses.yaml } }`")
            .About(kTriad)
            .With("row", static_cast<double>(set.poses[k].first_row)));
  }
  return {};
}

// A small turn: gravity steps across itself, and stays there. What temperature does is slow, and
// goes along gravity as well.
void SweepCutter::NameTurns(PoseSet* set) const {
  constexpr Triad kTriad = Triad::kAccelerometer;
  constexpr std::size_t kReach = 5;
  // Of the usual change over as many windows, of the noise of their means, of gravity; and how much
  // of it may go along gravity.
  constexpr double kUsual = 8.0, kNoise = 8.0, kShare = 1e-3, kAlong = 0.3;
  std::vector<std::size_t> index;
  for (std::size_t k = 0; k < set->poses.size(); ++k) {
    if (set->poses[k].triads[kTriad]) index.push_back(k);
  }
  if (index.size() < 8 * kReach) return;
  const auto reading = [&](std::size_t i) -> const TriadPose& {
    return *set->poses[index[i]].triads[kTriad];
  };
  const auto middle = [&](std::size_t begin) {
    Eigen::Vector3d medians;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (std::size_t i = begin; i < begin + kReach; ++i) {
        values.push_back(reading(i).mean_raw[axis]);
      }
      medians[axis] = Median(std::move(values));
    }
    return medians;
  };
  // From the windows before each one to those after it.
  std::vector<Eigen::Vector3d> steps(index.size(), Eigen::Vector3d::Zero());
  std::vector<double> sizes;
  for (std::size_t i = kReach; i + kReach < index.size(); ++i) {
    if (set->sweep.attitude[index[i - kReach]] != set->sweep.attitude[index[i + kReach]]) continue;
    steps[i] = middle(i + 1) - middle(i - kReach);
    sizes.push_back(steps[i].norm());
  }
  if (sizes.empty()) return;
  const double usual = Median(std::move(sizes));
  for (std::size_t i = kReach; i + kReach < index.size(); ++i) {
    const double size = steps[i].norm();
    const Eigen::Vector3d down = reading(i).mean_raw.normalized();
    const double noise = std::sqrt(reading(i).mean_covariance_raw.trace());
    const double least =
        std::max({kUsual * usual, kNoise * noise, kShare * reading(i).mean_raw.norm()});
    if (size < least || std::abs(steps[i].dot(down)) > kAlong * size) continue;
    bool is_largest = true;
    for (std::size_t j = i - kReach; j <= i + kReach; ++j) {
      is_largest =
          is_largest && (steps[j].norm() < size || j == i || (j > i && steps[j].norm() == size));
    }
    if (!is_largest) continue;
    const double degrees = kDegPerRad * std::atan2(size, reading(i).mean_raw.norm());
    set->findings.push_back(
        Finding(FindingCode::kUnitTurned,
                "near row " + std::to_string(set->poses[index[i]].first_row) +
                    " the accelerometer steps as if the unit was turned by " + Fixed1(degrees) +
                    " degrees and stays there, which is not a thermal effect",
                "fix the unit in place and repeat, or state when each attitude was held: `poses: { "
                "sweep: { attitudes: poses.yaml } }`")
            .About(Triad::kAccelerometer)
            .With("row", static_cast<double>(set->poses[index[i]].first_row))
            .With("turned", degrees, "deg"));
  }
}

Status SweepCutter::Finish(PoseSet* set) {
  for (std::size_t i = 0; i < range_used_.size(); ++i) {
    if (range_used_[i]) continue;
    const PoseRange& range = selection_.ranges[i];
    return BadInputError("poses.sweep.attitudes: range " + std::to_string(i + 1) + " (rows " +
                         std::to_string(range.first) + " to " + std::to_string(range.last) +
                         ") has no reading in " + info_.Find(leading_)->file);
  }
  std::size_t seen = 0, without = 0;
  for (const Cell& cell : cells_) {
    if (cell.triads[leading_].count == 0) continue;
    ++seen;
    if (cell.degc_count == 0) ++without;
  }
  constexpr double kNotable = 0.01;
  if (static_cast<double>(without) > kNotable * static_cast<double>(seen)) {
    const double share = static_cast<double>(without) / static_cast<double>(seen);
    set->findings.push_back(
        Finding(FindingCode::kTemperatureMissing,
                "skipped: " + std::to_string(std::lround(100.0 * share)) +
                    " % of the time, without a temperature reading for more than a minute")
            .With("share", share));
  }
  std::erase_if(cells_, [](const Cell& cell) { return cell.degc_count == 0; });
  if (cells_.size() < kFewestCells) {
    return NotEnoughError(
        Finding(FindingCode::kTooFewWindows,
                set->source + ": has temperatures in only " + std::to_string(cells_.size()) +
                    " windows; a sweep needs at least " + std::to_string(kFewestCells),
                "record longer, or state shorter windows")
            .With("windows", static_cast<double>(cells_.size()))
            .With("needed", static_cast<double>(kFewestCells)));
  }
  std::vector<double> time_s, degc;
  for (const Cell& cell : cells_) {
    time_s.push_back(cell.time_s());
    degc.push_back(cell.degc());
  }
  const double step_degc = thermometer_.step_degc();
  const std::vector<bool> spikes = TemperatureSpikes(degc, step_degc);
  Result<TemperatureTrack> track =
      SmoothTemperature(time_s, Bridged(time_s, degc, spikes), step_degc, thermometer_.hold_s());
  if (!track) {
    Finding why = RefusalOf(track.error(), FindingCode::kTemperatureRangeTooSmall);
    why.text.insert(0, set->source + ": ");
    return NotEnoughError(std::move(why));
  }
  set->sweep.attitude_names = attitude_names_;
  LeaveOutFarOff(*track, spikes, set);
  if (selection_.sweep.ambient) {
    set->sweep.ambient = SmoothAmbient(*track);
    const auto known = std::count_if(set->sweep.ambient.degc.begin(),
                                     set->sweep.ambient.degc.end(),
                                     [](double value) { return std::isfinite(value); });
    if (2 * known < std::ssize(set->sweep.ambient.degc)) {
      return BadInputError(set->source + ": the ambient temperature has values in only " +
                           std::to_string(known) + " of " +
                           std::to_string(set->sweep.ambient.degc.size()) +
                           " windows of the sweep; record it throughout, or remove it from the "
                           "factors of `regression`");
    }
  }
  set->sweep.temperature = *std::move(track);
  for (StreamSummary& stream : set->streams) stream.noise_sigma_raw = SampleSigma(stream.triad);
  MakeWindows(set);
  if (set->poses.size() < kFewestCells) {
    return NotEnoughError(Finding(FindingCode::kTooFewWindows,
                                  set->source + ": " + std::to_string(set->poses.size()) +
                                      " windows remain; a sweep needs at least " +
                                      std::to_string(kFewestCells))
                              .With("windows", static_cast<double>(set->poses.size()))
                              .With("needed", static_cast<double>(kFewestCells)));
  }
  if (was_doubled_ && (selection_.sweep.window_s > 0.0 || selection_.sweep.window_samples > 0)) {
    set->findings.emplace_back(
        FindingCode::kWindowsLengthened,
        "the recording has too many windows for memory; windows are longer than stated: " +
            (cell_samples_ > 0 ? std::to_string(cell_samples_) + " samples"
                               : std::to_string(1e-9 * static_cast<double>(cell_ns_)) + " s"));
  }
  for (const std::string& left_out : set->sweep.left_out) {
    set->findings.emplace_back(FindingCode::kReadingsLeftOut, "skipped: " + left_out);
  }
  const double taken =
      thermometer_.hold_s() > 0.0 ? (time_s.back() - time_s.front()) / thermometer_.hold_s() : 1e9;
  if (taken < static_cast<double>(kFewestReadings)) {
    set->findings.push_back(Finding(FindingCode::kSlowThermometer,
                                    "the thermometer is read only every " +
                                        Fixed1(thermometer_.hold_s()) +
                                        " s and repeated in between: " + Fixed1(taken) +
                                        " readings are too few for a sweep, expected at least " +
                                        std::to_string(kFewestReadings),
                                    "read it more often")
                                .With("interval", thermometer_.hold_s(), "s")
                                .With("readings", taken));
  } else {
    // Of so few readings the windows are as wide as their steps.
    NameTurns(set);
  }
  return CheckHeld(*set);
}

}  // namespace truetriad
