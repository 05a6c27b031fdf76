// SPDX-License-Identifier: Apache-2.0
#include "sim/clock.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sim/seeds.h"

namespace truetriad {
namespace {

// Chosen: 4096 rows of three axes of 8 bytes are a block of 0.1 MB, which stays in the cache.
constexpr int kRowsPerBlock = 4096;

/// Lowest and highest rate of the triads, Hz.
std::pair<double, double> Rates(const Scenario& scenario, const std::vector<Triad>& triads) {
  double lowest_hz = std::numeric_limits<double>::infinity(), highest_hz = 0.0;
  for (const Triad triad : triads) {
    const double rate_hz = scenario.sensors[triad]->sampling.rate_hz;
    lowest_hz = std::min(lowest_hz, rate_hz);
    highest_hz = std::max(highest_hz, rate_hz);
  }
  return {lowest_hz, highest_hz};
}

}  // namespace

SampleClock::SampleClock(const Scenario& scenario,
                         int unit,
                         const SimulatedUnit& truth,
                         const Timeline& timeline,
                         const RecordingFormat& format,
                         const std::vector<Triad>& triads)
    : rate_hz_(Rates(scenario, triads).second),
      end_ns_(std::llround(timeline.motion.duration_s() * 1e9)),
      offset_ns_(std::llround(scenario.sensors[triads[0]]->sampling.clock_offset_s * 1e9)),
      jitter_ns_(scenario.sensors[triads[0]]->sampling.jitter_s * 1e9),
      jitter_random_(TriadRandom(scenario.seed, unit, Purpose::kJitter, triads[0])),
      temperature_(scenario.temperature),
      temperature_decimals_(format.temperature_decimals),
      thermometer_random_(TriadRandom(scenario.seed, unit, Purpose::kThermometer, triads[0])),
      ambient_random_(TriadRandom(scenario.seed, unit, Purpose::kAmbient, triads[0])),
      element_(timeline.chamber, scenario.temperature),
      thermometer_(timeline.chamber, scenario.temperature.thermometer_lag_s),
      ambient_(timeline.chamber, scenario.temperature.ambient_lag_s),
      played_degc_(scenario.temperature.start_degc),
      is_thermal_(
          std::any_of(triads.begin(),
                      triads.end(),
                      [&truth](Triad triad) { return truth.triads[triad]->thermal.has_value(); })),
      surroundings_(scenario, timeline.motion, timeline.rests),
      last_reported_ns_(std::numeric_limits<std::int64_t>::min()),
      rests_(timeline.rests),
      longest_interval_s_(1.0 / Rates(scenario, triads).first),
      tumbles_(std::any_of(
          scenario.motion.begin(),
          scenario.motion.end(),
          [](const MotionStep& step) { return std::holds_alternative<TumbleStep>(step); })),
      turns_{timeline.turns},
      rates_{timeline.rates} {
  // The rows of a turn must begin and end with readings at rest, but the first reading after the
  // turn may average over part of it. Likewise, the first reading of a held rate may average over
  // part of the ramp.
  for (auto& turn : turns_.motions) {
    turn.start_s -= longest_interval_s_;
    turn.end_s += 2.0 * longest_interval_s_;
  }
  for (auto& rate : rates_.motions) rate.start_s += longest_interval_s_;
  for (const Triad triad : triads) {
    const SimulatedTriad& sensor = *scenario.sensors[triad];
    const SensorSampling& sampling = sensor.sampling;
    const double ratio = rate_hz_ / sampling.rate_hz;
    Channel channel{
        .sensor = SimulatedSensor(
            sensor, *truth.triads[triad], format.decimals[triad], scenario.seed, unit, triad),
        .triad = triad,
        .gyroscope_output = sensor.gyroscope_output,
        .rows_per_sample = std::llround(ratio),
        .dropout = sampling.dropout,
        .dropout_random = TriadRandom(scenario.seed, unit, Purpose::kDropout, triad),
        .last_world_from_body = timeline.motion.phase(0).At(0.0).world_from_body,
        .last_ns = -std::llround(1e9 / sampling.rate_hz),
    };
    for (const Disturbance& disturbance : scenario.disturbances) {
      const auto* const stuck = std::get_if<StuckSamples>(&disturbance);
      if (stuck == nullptr || stuck->triad != triad) continue;
      channel.stuck.push_back(SpanOf(stuck->when, stuck->duration_s, timeline.rests));
    }
    channels_.push_back(std::move(channel));
  }
}

/// The true time of a row is rounded to whole nanoseconds, so that the intervals in a file are
/// exactly those simulated.
std::int64_t SampleClock::RowTime(std::int64_t index) const {
  return std::llround(static_cast<double>(index) * 1e9 / rate_hz_);
}

TemperatureState SampleClock::PlayedTemperature(double time_s) {
  TemperatureState state = element_.At(time_s);
  const double play = temperature_.hysteresis_degc;
  played_degc_ = std::clamp(played_degc_, state.degc - play, state.degc + play);
  state.degc = played_degc_;
  return state;
}

double SampleClock::ReadThermometer(double time_s) {
  return Shown(thermometer_.At(time_s).degc,
               temperature_.thermometer_noise_degc,
               temperature_.thermometer_resolution_degc,
               &thermometer_random_);
}

double SampleClock::ReadAmbient(double time_s) {
  return Shown(ambient_.At(time_s).degc,
               temperature_.ambient_noise_degc,
               temperature_.ambient_resolution_degc,
               &ambient_random_);
}

double SampleClock::Shown(double degc,
                          double noise_degc,
                          double resolution_degc,
                          FastRandom* random) const {
  if (noise_degc > 0.0) degc += noise_degc * random->Normal();
  if (resolution_degc > 0.0) degc = WrittenNumber(degc / resolution_degc, 0) * resolution_degc;
  return WrittenNumber(degc, temperature_decimals_);
}

Eigen::Vector3d SampleClock::Truth(Channel* channel) const {
  if (channel->triad == Triad::kAccelerometer) return surroundings_.ForceMps2();
  if (channel->triad == Triad::kMagnetometer) return surroundings_.FieldUt();
  if (channel->gyroscope_output == GyroscopeOutput::kInstantaneous) {
    return surroundings_.RateRadps();
  }
  Eigen::Vector3d rate_radps =
      surroundings_.MeanRateRadps(channel->last_ns, channel->last_world_from_body, now_ns_);
  channel->last_ns = now_ns_;
  channel->last_world_from_body = surroundings_.world_from_body();
  return rate_radps;
}

bool SampleClock::Sample(Channel* channel, const TemperatureState& temperature) {
  const double time_s = static_cast<double>(now_ns_) * 1e-9;
  const Eigen::Vector3d truth = Truth(channel);
  Eigen::Vector3d reading = channel->sensor.Read(truth, surroundings_.ForceMps2(), temperature);
  for (const TimeSpan& span : channel->stuck) {
    if (span.Contains(time_s)) reading = channel->last_reading.value_or(reading);
  }
  channel->last_reading = reading;
  if (channel->dropout > 0.0 && channel->dropout_random.Uniform() < channel->dropout) return false;
  channel->x.push_back(reading.x());
  channel->y.push_back(reading.y());
  channel->z.push_back(reading.z());
  return true;
}

void SampleClock::NoteRest(double time_s) {
  for (; rest_ < rests_.size() && time_s >= rests_[rest_].end_s; ++rest_) rest_began_ = false;
  if (rest_ == rests_.size() || time_s < rests_[rest_].start_s + longest_interval_s_) return;
  if (!rest_began_) {
    rest_began_ = true;
    std::string id = std::to_string(rests_[rest_].number);
    if (!rests_[rest_].label.empty()) id += ": " + rests_[rest_].label;
    rest_rows_.push_back({.first = rows_, .last = rows_, .id = std::move(id), .face_up = {}});
  }
  rest_rows_.back().last = rows_;
}

void SampleClock::NoteWander() {
  if (!tumbles_ && !rest_began_) return;
  for (Channel& channel : channels_) {
    if (channel.row.empty() || channel.row.back() != rows_) continue;
    channel.wander.Add(tumbles_ ? 0 : rest_, channel.sensor.wander());
  }
}

void SampleClock::Generate(std::vector<SampleBlock>* blocks) {
  for (Channel& channel : channels_) {
    channel.time_ns.clear();
    channel.x.clear();
    channel.y.clear();
    channel.z.clear();
    channel.temperature_degc.clear();
    channel.ambient_degc.clear();
    channel.row.clear();
  }
  for (int i = 0; i < kRowsPerBlock && !at_end(); ++i) {
    now_ns_ = next_ns_;
    const double time_s = static_cast<double>(now_ns_) * 1e-9;
    surroundings_.MoveTo(time_s);
    const TemperatureState temperature =
        is_thermal_ ? PlayedTemperature(time_s) : TemperatureState{};
    const double logged_degc = temperature_.logged ? ReadThermometer(time_s) : 0.0;
    const double ambient_degc = temperature_.ambient_logged ? ReadAmbient(time_s) : 0.0;
    std::int64_t reported_ns = now_ns_ + offset_ns_;
    if (jitter_ns_ > 0.0) {
      // Times in a log increase, however large the jitter is.
      reported_ns += std::llround(jitter_ns_ * jitter_random_.Normal());
      reported_ns = std::max(reported_ns, last_reported_ns_ + 1);
      last_reported_ns_ = reported_ns;
    }
    bool any = false;
    for (Channel& channel : channels_) {
      if (index_ % channel.rows_per_sample != 0 || !Sample(&channel, temperature)) continue;
      any = true;
      channel.time_ns.push_back(reported_ns);
      channel.row.push_back(rows_);
      if (temperature_.logged) channel.temperature_degc.push_back(logged_degc);
      if (temperature_.ambient_logged) channel.ambient_degc.push_back(ambient_degc);
      ++channel.samples;
    }
    if (any) {
      NoteRest(time_s);
      NoteWander();
      turns_.Note(time_s, rows_);
      rates_.Note(time_s, rows_);
      ++rows_;
    }
    next_ns_ = RowTime(++index_);
  }
  for (const Channel& channel : channels_) {
    if (channel.x.empty()) continue;
    SampleBlock block;
    block.triad = channel.triad;
    block.time_ns = channel.time_ns;
    block.x = channel.x;
    block.y = channel.y;
    block.z = channel.z;
    block.temperature_degc = channel.temperature_degc;
    block.ambient_degc = channel.ambient_degc;
    block.row = channel.row;
    blocks->push_back(block);
  }
}

std::optional<StreamCounts> SampleClock::counts(Triad triad) const {
  for (const Channel& channel : channels_) {
    if (channel.triad == triad) return StreamCounts{channel.samples, rows_ - channel.samples};
  }
  return std::nullopt;
}

std::optional<Eigen::Vector3d> SampleClock::mean_wander(Triad triad) const {
  for (const Channel& channel : channels_) {
    if (channel.triad == triad) return channel.wander.Mean();
  }
  return std::nullopt;
}

}  // namespace truetriad
