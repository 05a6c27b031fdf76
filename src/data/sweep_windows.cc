// SPDX-License-Identifier: Apache-2.0
#include "data/sweep_windows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "base/rounded_text.h"
#include "model/mechanisms.h"
#include "thermometer/temperature_smoothing.h"
#include "thermometer/thermometer.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

// The largest number of cells: two hours of 0.25 s each; their sums take some megabytes.
constexpr std::size_t kMaxCells = 32768;
// Chosen: cells of 0.25 s if the experiment states no window.
constexpr std::int64_t kFirstCellNs = 250'000'000;
// Chosen: an axis has about ten thermal terms, and each term needs four windows. A slow thermometer
// must give as many readings.
constexpr std::size_t kFewestCells = 40;
// Chosen: a window ends when the temperature has changed by this share of its range, or when this
// share of the recording has passed, so that a sweep of one ramp has at most 600 windows.
constexpr double kThermalShare = 1.0 / 200.0, kTimeShare = 1.0 / 400.0;

Status CheckEnough(std::size_t windows, const std::string& what, const PoseSet& set) {
  if (windows >= kFewestCells) return {};
  return NotEnoughError(Finding(FindingCode::kTooFewWindows,
                                set.source + ": only " + std::to_string(windows) + " windows" +
                                    what + "; a sweep needs at least " +
                                    std::to_string(kFewestCells),
                                "record longer, or state shorter windows")
                            .With("windows", static_cast<double>(windows))
                            .With("needed", static_cast<double>(kFewestCells)));
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
    return NoTime(info_, "the temperature rate is unknown");
  }
  const bool has_temperature =
      std::any_of(info_.streams.begin(), info_.streams.end(), [](const StreamInfo& stream) {
        return stream.has_temperature;
      });
  if (!has_temperature) {
    return Error(ErrorCode::kMissingTemperature,
                 {info_.path},
                 "has no temperature, but a sweep needs it; add a column "
                 "`temperature[degC]`, or `temperature:` to a stream in a manifest");
  }
  const bool has_ambient = std::any_of(info_.streams.begin(),
                                       info_.streams.end(),
                                       [](const StreamInfo& stream) { return stream.has_ambient; });
  if (selection_.sweep.ambient && !has_ambient) {
    return Error(ErrorCode::kMissingTemperature,
                 {info_.path},
                 "has no ambient temperature, but it is a factor of the sensor's "
                 "`regression`; add a column `ambient_temperature[degC]`, or "
                 "`ambient_temperature:` to a stream in a manifest, or remove that factor");
  }
  std::int64_t previous = -1;
  for (std::size_t i = 0; i < selection_.ranges.size(); ++i) {
    const PoseRange& range = selection_.ranges[i];
    if (range.first <= previous || range.last < range.first) {
      return Error(ErrorCode::kInvalidValue,
                   "poses.sweep.attitudes: range " + std::to_string(i + 1) + " is rows " +
                       std::to_string(range.first) + " to " + std::to_string(range.last) +
                       "; expected first <= last, both 0-based, in file order, without "
                       "overlap");
    }
    previous = range.last;
  }
  if (selection_.ranges.empty() && cell_samples_ == 0) return {};
  for (const StreamInfo& stream : info_.streams) {
    if (stream.file == info_.Find(leading_)->file) continue;
    return Error(ErrorCode::kDoesNotMatch,
                 {info_.path},
                 stream.file + " and " + info_.Find(leading_)->file +
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

void SweepCutter::AddBlock(const SampleBlock& block) {
  if (block.x.empty()) return;
  if (!started_) {
    started_ = true;
    origin_ns_ = block.time_ns.front();
  }
  // Sensors of one file share their thermometer, so only one of them is watched.
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

Status SweepCutter::Add(const std::vector<SampleBlock>& blocks) {
  for (const SampleBlock& block : blocks) AddBlock(block);
  return {};
}

TemperatureTrack SweepCutter::SmoothAmbient(const TemperatureTrack& track) const {
  std::vector<double> time_s, degc;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (cells_[i].ambient_count == 0) continue;
    time_s.push_back(track.time_s[i]);
    degc.push_back(cells_[i].ambient_degc());
  }
  TemperatureTrack known;
  if (time_s.size() >= kFewestSmoothed) {
    Result<TemperatureTrack> smooth = SmoothTemperature(
        time_s,
        Bridged(time_s, degc, TemperatureSpikes(degc, ambient_thermometer_.step_degc())),
        ambient_thermometer_.step_degc(),
        ambient_thermometer_.hold_s());
    if (smooth) {
      known = *std::move(smooth);
    } else {
      // A constant ambient temperature is no error; its rate is zero.
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

void SweepCutter::AddWindow(std::size_t first, std::size_t last, PoseSet* set) const {
  const TemperatureTrack& track = set->sweep.temperature;
  StaticPose pose;
  PerTriad<TriadWindow> sums;
  double degc = 0.0, rate = 0.0, count = 0.0;
  for (std::size_t i = first; i <= last; ++i) {
    if (!cells_[i].far_off.empty()) continue;
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
    if (!cells_[i].far_off.empty()) continue;
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

Status SweepCutter::CheckRangesUsed() const {
  for (std::size_t i = 0; i < range_used_.size(); ++i) {
    if (range_used_[i]) continue;
    const PoseRange& range = selection_.ranges[i];
    return Error(ErrorCode::kNotInRecording,
                 "poses.sweep.attitudes: range " + std::to_string(i + 1) + " (rows " +
                     std::to_string(range.first) + " to " + std::to_string(range.last) +
                     ") has no reading in " + info_.Find(leading_)->file);
  }
  return {};
}

void SweepCutter::LeaveOutWithoutTemperature(PoseSet* set) {
  std::size_t seen = 0, without = 0;
  for (const Cell& cell : cells_) {
    if (cell.triads[leading_].count == 0) continue;
    ++seen;
    if (cell.degc_count == 0) ++without;
  }
  // Chosen: a smaller share is not reported, as a percent of a sweep changes its terms little.
  constexpr double kNotableWithoutDegc = 0.01;
  if (static_cast<double>(without) > kNotableWithoutDegc * static_cast<double>(seen)) {
    const double share = static_cast<double>(without) / static_cast<double>(seen);
    set->findings.push_back(
        Finding(FindingCode::kTemperatureMissing,
                "skipped: " + std::to_string(std::lround(100.0 * share)) +
                    " % of the time, without a temperature reading for more than a minute")
            .With("share", share));
  }
  std::erase_if(cells_, [](const Cell& cell) { return cell.degc_count == 0; });
}

void SweepCutter::LeaveOutStuckTemperature(PoseSet* set) {
  std::vector<double> time_s, degc;
  for (const Cell& cell : cells_) time_s.push_back(cell.time_s()), degc.push_back(cell.degc());
  for (const auto& [begin, end] : StuckTemperatures(time_s, degc)) {
    if (!Acts(Mechanism::kStuckTemperature)) return;
    const double from_s = time_s[begin] - time_s.front();
    const double to_s = time_s[end - 1] - time_s.front();
    set->findings.push_back(Finding(FindingCode::kStuckReadings,
                                    "the thermometer repeats " + Fixed1(degc[begin]) +
                                        " degC from " + Fixed1(from_s) + " to " + Fixed1(to_s) +
                                        " s and then jumps; this interval is skipped")
                                .With("from", from_s, "s")
                                .With("to", to_s, "s"));
    for (std::size_t i = begin; i < end; ++i) cells_[i].degc_count = 0;
  }
  std::erase_if(cells_, [](const Cell& cell) { return cell.degc_count == 0; });
}

void SweepCutter::Warn(double duration_s, PoseSet* set) const {
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
  const double taken = thermometer_.hold_s() > 0.0 ? duration_s / thermometer_.hold_s() : 1e9;
  if (taken < static_cast<double>(kFewestCells)) {
    set->findings.push_back(Finding(FindingCode::kSlowThermometer,
                                    "the thermometer is read only every " +
                                        Fixed1(thermometer_.hold_s()) +
                                        " s and repeated in between: " + Fixed1(taken) +
                                        " readings are too few for a sweep, expected at least " +
                                        std::to_string(kFewestCells),
                                    "read it more often")
                                .With("interval", thermometer_.hold_s(), "s")
                                .With("readings", taken));
  } else {
    // Turns are sought here only, since with too few temperature readings one reading fills a whole
    // window.
    NameTurns(set);
  }
}

Status SweepCutter::Finish(PoseSet* set) {
  TRUETRIAD_RETURN_IF_ERROR(CheckRangesUsed());
  LeaveOutWithoutTemperature(set);
  LeaveOutStuckTemperature(set);
  TRUETRIAD_RETURN_IF_ERROR(CheckEnough(cells_.size(), " have temperatures", *set));
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
      return Error(ErrorCode::kMissingTemperature,
                   {set->source},
                   "the ambient temperature has values in only " + std::to_string(known) + " of " +
                       std::to_string(set->sweep.ambient.degc.size()) +
                       " windows of the sweep; record it throughout, or remove it from the "
                       "factors of `regression`");
    }
  }
  set->sweep.temperature = *std::move(track);
  for (StreamSummary& stream : set->streams) stream.noise_sigma_raw = SampleSigma(stream.triad);
  MakeWindows(set);
  TRUETRIAD_RETURN_IF_ERROR(CheckEnough(set->poses.size(), " remain", *set));
  Warn(time_s.back() - time_s.front(), set);
  return CheckHeld(*set);
}

}  // namespace truetriad
