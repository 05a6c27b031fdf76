// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sim/clock.h"
#include "sim/seeds.h"
#include "sim/sensor.h"
#include "sim/timeline.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {
namespace {

/// True if the triads can share the rows of one file: they have one clock, and every rate is the
/// highest one divided by a whole number.
bool ShareRows(const Scenario& scenario) {
  const SensorSampling* fastest = nullptr;
  for (const auto& triad : scenario.sensors) {
    if (triad && (fastest == nullptr || triad->sampling.rate_hz > fastest->rate_hz)) {
      fastest = &triad->sampling;
    }
  }
  return std::all_of(
      scenario.sensors.begin(), scenario.sensors.end(), [fastest](const auto& triad) {
        if (!triad) return true;
        const double ratio = fastest->rate_hz / triad->sampling.rate_hz;
        return std::abs(ratio - std::round(ratio)) < 1e-9 &&
               triad->sampling.jitter_s == fastest->jitter_s &&
               triad->sampling.clock_offset_s == fastest->clock_offset_s;
      });
}

/// The number of decimals that multiples of `time_ns` need in seconds.
int SecondsDecimals(std::int64_t time_ns) {
  int decimals = 9;
  for (; decimals > 0 && time_ns % 10 == 0; time_ns /= 10) --decimals;
  return decimals;
}

RecordingFormat FormatOf(const Scenario& scenario) {
  RecordingFormat format;
  format.one_file = ShareRows(scenario);
  format.time_decimals = 0;
  for (const Triad triad : kTriads) {
    if (!scenario.sensors[triad]) continue;
    const SensorSampling& sampling = scenario.sensors[triad]->sampling;
    format.decimals[triad] = ReadingDecimals(*scenario.sensors[triad]);
    const double period_ns = 1e9 / sampling.rate_hz;
    const bool irregular = sampling.jitter_s > 0.0 || period_ns != std::round(period_ns);
    const int decimals =
        irregular ? 9
                  : std::max(SecondsDecimals(std::llround(period_ns)),
                             SecondsDecimals(std::llround(sampling.clock_offset_s * 1e9)));
    format.time_decimals = std::max(format.time_decimals, decimals);
  }
  const SimulatedTemperature& temperature = scenario.temperature;
  format.temperature_decimals =
      ReadingDecimals(temperature.thermometer_resolution_degc, temperature.thermometer_noise_degc);
  if (temperature.ambient_logged) {
    const int ambient =
        ReadingDecimals(temperature.ambient_resolution_degc, temperature.ambient_noise_degc);
    const bool as_they_are =
        std::min(ambient, format.temperature_decimals) == RecordingFormat::kShortest;
    format.temperature_decimals =
        as_they_are ? RecordingFormat::kShortest : std::max(format.temperature_decimals, ambient);
  }
  format.comment = "simulated";
  if (!scenario.description.empty()) format.comment += ": " + scenario.description;
  return format;
}

/// Finite parameters may still combine to readings that overflow.
Status CheckFinite(const SampleBlock& block) {
  for (std::size_t i = 0; i < block.x.size(); ++i) {
    const double degc = block.temperature_degc.empty() ? 0.0 : block.temperature_degc[i];
    if (std::isfinite(block.x[i]) && std::isfinite(block.y[i]) && std::isfinite(block.z[i]) &&
        std::isfinite(degc)) {
      continue;
    }
    return Error(ErrorCode::kValueOutOfRange,
                 "the " + std::string(TriadName(block.triad)) + " reads " +
                     std::to_string(block.x[i]) + ", " + std::to_string(block.y[i]) + ", " +
                     std::to_string(block.z[i]) + " at " + std::to_string(degc) + " degC, " +
                     std::to_string(static_cast<double>(block.time_ns[i]) * 1e-9) +
                     " s after the start; lower its gains, bias, noise, temperature terms or "
                     "the disturbances");
  }
  return {};
}

class OneUnit : public Simulation {
 public:
  OneUnit(const Scenario& scenario, int index)
      : timeline_(MakeTimeline(scenario, index)), format_(FormatOf(scenario)) {
    const SimulatedUnit unit = DrawUnit(scenario, index);
    info_.path = "simulated " + unit.serial;
    info_.serial = unit.serial;
    std::vector<Triad> sharing;
    for (const Triad triad : kTriads) {
      if (!scenario.sensors[triad]) continue;
      const SimulatedTriad& sensor = *scenario.sensors[triad];
      StreamInfo stream;
      stream.triad = triad;
      stream.unit = sensor.unit;
      stream.file = info_.path;
      stream.si_per_count = sensor.si_per_count;
      stream.has_temperature = scenario.temperature.logged;
      stream.has_ambient = scenario.temperature.ambient_logged;
      info_.streams.push_back(stream);
      sharing.push_back(triad);
      if (format_.one_file) continue;
      clocks_.emplace_back(scenario, index, unit, timeline_, format_, sharing);
      sharing.clear();
    }
    if (format_.one_file) {
      clocks_.emplace_back(scenario, index, unit, timeline_, format_, sharing);
    }
  }

  const RecordingInfo& info() const override { return info_; }

  Result<bool> Next(std::vector<SampleBlock>* blocks) override {
    blocks->clear();
    // The clock with the earliest time comes next, so that the times of the streams differ by at
    // most one block.
    SampleClock* const next = Slowest();
    if (next == nullptr) return false;
    next->Generate(blocks);
    for (const SampleBlock& block : *blocks) TRUETRIAD_RETURN_IF_ERROR(CheckFinite(block));
    return true;
  }

  double progress() const override {
    double share = 1.0;
    for (const SampleClock& clock : clocks_) share = std::min(share, clock.time_s() / duration_s());
    return share;
  }

  StreamCounts counts(Triad triad) const override {
    for (const SampleClock& clock : clocks_) {
      if (const std::optional<StreamCounts> counts = clock.counts(triad)) return *counts;
    }
    return {};
  }

  std::vector<InputFile> inputs() const override { return {}; }
  const std::vector<TrueRest>& rests() const override { return timeline_.rests; }
  double duration_s() const override { return timeline_.motion.duration_s(); }
  const RecordingFormat& format() const override { return format_; }

  std::vector<PoseRange> rest_rows() const override { return Leading().rest_rows(); }
  std::vector<StatedTurn> turns() const override { return Leading().turns(); }
  std::vector<StatedRate> rates() const override { return Leading().rates(); }

  Eigen::Vector3d mean_wander(Triad triad) const override {
    for (const SampleClock& clock : clocks_) {
      if (const auto wander = clock.mean_wander(triad)) return *wander;
    }
    return Eigen::Vector3d::Zero();
  }

  Eigen::Quaterniond WorldFromBody(double time_s) const override {
    const Motion& motion = timeline_.motion;
    return motion.phase(motion.PhaseAt(time_s)).At(time_s).world_from_body;
  }

 private:
  /// The clock whose row numbers describe rests and motions.
  const SampleClock& Leading() const {
    for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer, Triad::kGyroscope}) {
      for (const SampleClock& clock : clocks_) {
        if (clock.counts(triad)) return clock;
      }
    }
    return clocks_.front();  // A valid scenario has at least one sensor.
  }

  SampleClock* Slowest() {
    SampleClock* slowest = nullptr;
    for (SampleClock& clock : clocks_) {
      if (!clock.at_end() && (slowest == nullptr || clock.time_s() < slowest->time_s())) {
        slowest = &clock;
      }
    }
    return slowest;
  }

  Timeline timeline_;
  RecordingFormat format_;
  RecordingInfo info_;
  std::vector<SampleClock> clocks_;
};

}  // namespace

Result<std::unique_ptr<Simulation>> Simulation::Create(const Scenario& scenario, int index) {
  TRUETRIAD_RETURN_IF_ERROR(scenario.Validate());
  return std::unique_ptr<Simulation>(std::make_unique<OneUnit>(scenario, index));
}

}  // namespace truetriad
