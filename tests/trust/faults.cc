// SPDX-License-Identifier: Apache-2.0
#include "trust/faults.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "truetriad/base/triad.h"
#include "trust/joined.h"

namespace truetriad::trust {
namespace {

constexpr Triad kA = Triad::kAccelerometer, kG = Triad::kGyroscope, kM = Triad::kMagnetometer;
const std::vector<Triad> kEach = {kA, kG, kM};
const std::vector<Regime> kTurning = {Regime::kHand, Regime::kMotion};
const std::vector<Regime> kStamped = {
    Regime::kHand, Regime::kMotion, Regime::kAccelerometer, Regime::kFaces, Regime::kRates};
const std::vector<Regime> kResting = {
    Regime::kHand, Regime::kAccelerometer, Regime::kFaces, Regime::kAttitudes};

std::int64_t Nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

Eigen::Vector3d Direction(Random* random) { return random->Normal3().normalized(); }

double Full(Triad triad) { return triad == kA ? 9.8 : triad == kM ? 48.0 : 1.0; }

// Calls change(samples) for each sensor that was recorded.
template <typename Change>
void Each(Recording* recording, const Change& change) {
  for (const Triad triad : kTriads) {
    if (!recording->samples[triad].empty()) change(&recording->samples[triad]);
  }
}

double SpacingS(const std::vector<Sample>& samples) {
  if (samples.size() < 2) return 0.01;
  return (samples.back().time_s() - samples.front().time_s()) /
         static_cast<double>(samples.size() - 1);
}

// Readings that the sensor did not make.

void ZeroRows(const Strike& strike, Recording* recording) {
  for (Sample& sample : recording->samples[strike.triad]) {
    if (strike.random->Uniform() < strike.severity) sample.raw.setZero();
  }
}

void Sentinels(const Strike& strike, Recording* recording) {
  const double value = strike.random->Uniform() < 0.5 ? -32768.0 : 9999.0;
  for (Sample& sample : recording->samples[strike.triad]) {
    if (strike.random->Uniform() < strike.severity) sample.raw.setConstant(value);
  }
}

void Spikes(const Strike& strike, Recording* recording) {
  const double size = recording->Signal(strike.triad);
  for (Sample& sample : recording->samples[strike.triad]) {
    if (strike.random->Uniform() < strike.severity) sample.raw += size * strike.random->Normal3();
  }
}

void OneSidedSpikes(const Strike& strike, Recording* recording) {
  const Eigen::Vector3d spike = strike.random->Uniform(0.02, 1.0) *
                                recording->Signal(strike.triad) * Direction(strike.random);
  for (Sample& sample : recording->samples[strike.triad]) {
    if (strike.random->Uniform() < strike.severity) sample.raw += spike;
  }
}

// Severity: seconds of each stretch.
void StuckStretches(const Strike& strike, Recording* recording) {
  std::vector<Sample>& samples = recording->samples[strike.triad];
  for (int i = 0; i < 3; ++i) {
    const double begin_s = strike.random->Uniform(0.0, recording->duration_s);
    const Sample* held = nullptr;
    for (Sample& sample : samples) {
      if (sample.time_s() < begin_s || sample.time_s() > begin_s + strike.severity) continue;
      if (held == nullptr) held = &sample;
      sample.raw = held->raw;
    }
  }
}

// Severity: the share of the recording, at its end.
void StuckAxis(const Strike& strike, Recording* recording) {
  std::vector<Sample>& samples = recording->samples[strike.triad];
  const int axis = strike.random->Below(3);
  const auto from =
      static_cast<std::size_t>((1.0 - strike.severity) * static_cast<double>(samples.size() - 1));
  for (std::size_t i = from; i < samples.size(); ++i)
    samples[i].raw[axis] = samples[from].raw[axis];
}

void WrapAround(const Strike& strike, Recording* recording) {
  const double range = (1.0 - strike.severity) * recording->Signal(strike.triad) * 1.4;
  for (Sample& sample : recording->samples[strike.triad]) {
    for (double& value : sample.raw) value -= 2.0 * range * std::round(value / (2.0 * range));
  }
}

// Samples and their times.

void Lose(const std::function<bool(std::size_t)>& lost, std::vector<Sample>* samples) {
  std::size_t i = 0;
  std::erase_if(*samples, [&](const Sample&) { return lost(i++); });
}

void MakeRegular(double spacing_s, std::vector<Sample>* samples) {
  for (std::size_t i = 0; i < samples->size(); ++i) {
    (*samples)[i].time_ns = Nanoseconds(spacing_s * static_cast<double>(i));
  }
}

void LostStamped(const Strike& strike, Recording* recording) {
  Each(recording, [&](std::vector<Sample>* samples) {
    Lose([&](std::size_t) { return strike.random->Uniform() < strike.severity; }, samples);
  });
}

void LostRegular(const Strike& strike, Recording* recording) {
  // Rows of one log: all sensors lose the same rows.
  std::size_t rows = 0;
  Each(recording, [&](std::vector<Sample>* samples) { rows = std::max(rows, samples->size()); });
  std::vector<bool> lost(rows);
  for (std::size_t i = 0; i < rows; ++i) lost[i] = strike.random->Uniform() < strike.severity;
  Each(recording, [&](std::vector<Sample>* samples) {
    const double spacing_s = SpacingS(*samples);
    Lose([&](std::size_t i) { return lost[i]; }, samples);
    MakeRegular(spacing_s, samples);
  });
}

// Severity: the number of samples of which one is lost.
void LostPeriodically(const Strike& strike, Recording* recording) {
  const auto every = static_cast<std::size_t>(std::lround(strike.severity));
  Each(recording, [&](std::vector<Sample>* samples) {
    const double spacing_s = SpacingS(*samples);
    Lose([&](std::size_t i) { return i % every == 0; }, samples);
    MakeRegular(spacing_s, samples);
  });
}

// Severity: share of the spacing.
void Jitter(const Strike& strike, Recording* recording) {
  Each(recording, [&](std::vector<Sample>* samples) {
    const double spacing_s = SpacingS(*samples);
    std::int64_t last = std::numeric_limits<std::int64_t>::min();
    for (Sample& sample : *samples) {
      sample.time_ns +=
          Nanoseconds(strike.severity * spacing_s * std::abs(strike.random->Normal()));
      last = sample.time_ns = std::max(sample.time_ns, last + 1);
    }
  });
}

// Severity: the number of samples in a burst, which arrive together.
void Bursts(const Strike& strike, Recording* recording) {
  const auto burst = static_cast<std::size_t>(std::lround(strike.severity));
  Each(recording, [&](std::vector<Sample>* samples) {
    for (std::size_t i = 0; i < samples->size(); i += burst) {
      const std::size_t end = std::min(i + burst, samples->size());
      const std::int64_t arrived = (*samples)[end - 1].time_ns;
      for (std::size_t k = i; k < end; ++k) {
        (*samples)[k].time_ns = arrived + 20'000 * static_cast<std::int64_t>(k - i);
      }
    }
  });
}

// Severity: the tick of the clock, s.
void Ticks(const Strike& strike, Recording* recording) {
  const std::int64_t tick = Nanoseconds(strike.severity);
  Each(recording, [&](std::vector<Sample>* samples) {
    for (Sample& sample : *samples) sample.time_ns = sample.time_ns / tick * tick;
  });
}

// A logger that reads the sensor when it gets to it, and records when that was: the stamps are
// true. Severity: the delay as a share of the spacing.
constexpr int kFiner = 20;
void SampledFinely(const Strike&, Scenario* scenario) {
  for (std::optional<SimulatedTriad>& sensor : scenario->sensors) {
    if (!sensor) continue;
    sensor->sampling.rate_hz *= kFiner;
    sensor->noise.density /= std::sqrt(kFiner);  // The noise of a sample stays the same.
  }
}
void PickUnevenly(const Strike& strike, Recording* recording) {
  // Each delay stands alone, or delays add up, as each wait begins when the last one is over.
  const bool adds_up = strike.random->Uniform() < 0.5;
  Each(recording, [&](std::vector<Sample>* samples) {
    std::vector<Sample> picked;
    double due = 0.0;
    for (std::size_t next = 0; next < samples->size();) {
      picked.push_back((*samples)[next]);
      const double late = kFiner * strike.severity * std::abs(strike.random->Normal());
      due += kFiner + (adds_up ? late : 0.0);
      const double at = std::round(due + (adds_up ? 0.0 : late));
      next = std::max(next + 1, static_cast<std::size_t>(at));
    }
    *samples = std::move(picked);
  });
}

void ClockOffset(const Strike& strike, Recording* recording) {
  const double sign = strike.random->Uniform() < 0.5 ? -1.0 : 1.0;
  for (Sample& sample : recording->samples[strike.triad]) {
    sample.time_ns += Nanoseconds(10.0 + sign * strike.severity);
  }
  for (const Triad triad : kTriads) {
    if (triad == strike.triad) continue;
    for (Sample& sample : recording->samples[triad]) sample.time_ns += Nanoseconds(10.0);
  }
}

void ClockRate(const Strike& strike, Recording* recording) {
  for (Sample& sample : recording->samples[strike.triad]) {
    sample.time_ns += Nanoseconds(strike.severity * sample.time_s());
  }
}

void TimeBase(const Strike& strike, Recording* recording) {
  Each(recording, [&](std::vector<Sample>* samples) {
    for (Sample& sample : *samples) {
      sample.time_ns = Nanoseconds((1.0 + strike.severity) * sample.time_s());
    }
  });
}

void MillisecondsAsSeconds(const Strike&, Recording* recording) {
  Each(recording, [&](std::vector<Sample>* samples) {
    for (Sample& sample : *samples) sample.time_ns *= 1000;
  });
}

// Severity: seconds that are cut out; returns where, s.
double CutOut(const Strike& strike, Recording* recording) {
  const double begin_s = strike.random->Uniform(0.1, 0.7) * recording->duration_s;
  Each(recording, [&](std::vector<Sample>* samples) {
    std::erase_if(*samples, [&](const Sample& sample) {
      return sample.time_s() >= begin_s && sample.time_s() < begin_s + strike.severity;
    });
  });
  return begin_s;
}

void CutAndClosed(const Strike& strike, Recording* recording) {
  const double begin_s = CutOut(strike, recording);
  Each(recording, [&](std::vector<Sample>* samples) {
    for (Sample& sample : *samples) {
      if (sample.time_s() > begin_s) sample.time_ns -= Nanoseconds(strike.severity);
    }
  });
}

void Gap(const Strike& strike, Recording* recording) { CutOut(strike, recording); }

// Severity: seconds that come twice.
void Repeated(const Strike& strike, Recording* recording) {
  const double begin_s = strike.random->Uniform(0.1, 0.5) * recording->duration_s;
  Each(recording, [&](std::vector<Sample>* samples) {
    std::vector<Sample> twice;
    for (const Sample& sample : *samples) {
      if (sample.time_s() < begin_s + strike.severity) twice.push_back(sample);
    }
    for (Sample sample : *samples) {
      if (sample.time_s() < begin_s) continue;
      sample.time_ns += Nanoseconds(strike.severity);
      twice.push_back(sample);
    }
    *samples = std::move(twice);
  });
}

void HalvesExchanged(const Strike&, Recording* recording) {
  const double middle_s = 0.5 * recording->duration_s;
  Each(recording, [&](std::vector<Sample>* samples) {
    for (Sample& sample : *samples) {
      sample.time_ns += Nanoseconds(sample.time_s() < middle_s ? middle_s : -middle_s);
    }
    std::sort(samples->begin(), samples->end(), [](const Sample& a, const Sample& b) {
      return a.time_ns < b.time_ns;
    });
  });
}

// The response of the sensor.

template <typename Bend>
void BendReadings(const Strike& strike, Recording* recording, const Bend& bend) {
  const TriadModel<double> model = recording->truth.sensors[strike.triad]
                                       ? recording->truth.sensors[strike.triad]->model
                                       : TriadModel<double>{};
  const double full = strike.triad == kA   ? 9.8
                      : strike.triad == kM ? 48.0
                                           : 2.0 * recording->Signal(strike.triad);
  for (Sample& sample : recording->samples[strike.triad]) {
    for (int axis = 0; axis < 3; ++axis) {
      const double u = (sample.raw[axis] - model.bias[axis]) / full;
      sample.raw[axis] += full * bend(u);
    }
  }
}
void Quadratic(const Strike& strike, Recording* recording) {
  BendReadings(strike, recording, [&](double u) { return strike.severity * u * u; });
}
void Cubic(const Strike& strike, Recording* recording) {
  BendReadings(strike, recording, [&](double u) { return strike.severity * u * u * u; });
}
void Compressed(const Strike& strike, Recording* recording) {
  const double k = std::sqrt(3.0 * strike.severity);
  BendReadings(strike, recording, [&](double u) { return std::tanh(k * u) / k - u; });
}
void Asymmetric(const Strike& strike, Recording* recording) {
  BendReadings(strike, recording, [&](double u) { return strike.severity * std::abs(u); });
}
// Severity: the share of the largest reading that is cut off.
void Clipped(const Strike& strike, Recording* recording) {
  double largest = 0.0;
  for (const Sample& sample : recording->samples[strike.triad]) {
    largest = std::max(largest, sample.raw.cwiseAbs().maxCoeff());
  }
  const double range = (1.0 - strike.severity) * largest;
  for (Sample& sample : recording->samples[strike.triad]) {
    sample.raw = sample.raw.cwiseMin(range).cwiseMax(-range);
  }
}
// Severity: the time constant, s.
void LowPass(const Strike& strike, Recording* recording) {
  std::vector<Sample>& samples = recording->samples[strike.triad];
  if (samples.empty()) return;
  const double share = -std::expm1(-SpacingS(samples) / strike.severity);
  Eigen::Vector3d state = samples.front().raw;
  for (Sample& sample : samples) {
    state += share * (sample.raw - state);
    sample.raw = state;
  }
}
// Severity: the step as a share of the signal.
void Coarse(const Strike& strike, Recording* recording) {
  const double step = strike.severity * Full(strike.triad);
  for (Sample& sample : recording->samples[strike.triad]) {
    for (double& value : sample.raw) value = step * std::round(value / step);
  }
}
void GSensitivity(const Strike& strike, Scenario* scenario) {
  Eigen::Matrix3d matrix;
  for (double& entry : matrix.reshaped()) entry = strike.severity * strike.random->Normal();
  scenario->sensors[kG]->g_sensitivity = matrix;
}

// Errors that change with time.

void Drift(const Strike& strike, Recording* recording) {
  const Eigen::Vector3d whole = strike.severity * Full(strike.triad) * Direction(strike.random);
  const double duration_s = recording->duration_s;
  recording->AddToBias(
      strike.triad, [=](double time_s) -> Eigen::Vector3d { return time_s / duration_s * whole; });
}
void BiasStep(const Strike& strike, Recording* recording) {
  const Eigen::Vector3d whole = strike.severity * Full(strike.triad) * Direction(strike.random);
  const double at_s = strike.random->Uniform(0.1, 0.9) * recording->duration_s;
  recording->AddToBias(strike.triad, [=](double time_s) -> Eigen::Vector3d {
    return time_s < at_s ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : whole;
  });
}
// Severity: uT.
void HardIronMoved(const Strike& strike, Recording* recording) {
  Strike share = strike;
  share.severity /= Full(strike.triad);
  BiasStep(share, recording);
}
void Wandering(const Strike& strike, Recording* recording) {
  // A random walk from knot to knot, straight in between.
  constexpr int kKnots = 100;
  std::vector<Eigen::Vector3d> knots = {Eigen::Vector3d::Zero()};
  const double step = strike.severity * Full(strike.triad) / std::sqrt(kKnots);
  for (int i = 0; i < kKnots + 1; ++i) {
    knots.push_back(knots.back() + step * strike.random->Normal3());
  }
  const double duration_s = recording->duration_s;
  recording->AddToBias(strike.triad, [=](double time_s) -> Eigen::Vector3d {
    const double at = std::clamp(time_s / duration_s, 0.0, 1.0) * kKnots;
    const auto knot = static_cast<std::size_t>(at);
    const double share = at - static_cast<double>(knot);
    return (1.0 - share) * knots[knot] + share * knots[knot + 1];
  });
}
void Humming(const Strike& strike, Recording* recording) {
  const Eigen::Vector3d size = strike.severity * Full(strike.triad) * Direction(strike.random);
  const double omega = 2.0 * std::numbers::pi * strike.random->Uniform(0.3, 20.0);
  for (Sample& sample : recording->samples[strike.triad]) {
    sample.raw += std::sin(omega * sample.time_s()) * size;
  }
}
void GainDrift(const Strike& strike, Recording* recording) {
  if (!recording->truth.sensors[strike.triad]) return;
  TriadModel<double>& model = recording->truth.sensors[strike.triad]->model;
  const Eigen::Vector3d whole = strike.severity * strike.random->Normal3();
  for (Sample& sample : recording->samples[strike.triad]) {
    const double share = sample.time_s() / recording->duration_s - 0.5;
    sample.raw += share * whole.cwiseProduct(sample.raw - model.bias);
  }
}
void HeavyTails(const Strike& strike, Recording* recording) {
  for (Sample& sample : recording->samples[strike.triad]) {
    const double chi = std::sqrt(-std::log(1.0 - strike.random->Uniform()));  // Student's t, 2 dof
    sample.raw += strike.severity * Full(strike.triad) / chi * strike.random->Normal3();
  }
}
void NoisyAxis(const Strike& strike, Recording* recording) {
  const int axis = strike.random->Below(3);
  for (Sample& sample : recording->samples[strike.triad]) {
    sample.raw[axis] += strike.severity * Full(strike.triad) * strike.random->Normal();
  }
}

// Mounting, units, and readings that are not raw.

// Maps the axes of the readings and of the truth.
void Remap(const Eigen::Matrix3d& map, Triad triad, Recording* recording) {
  for (Sample& sample : recording->samples[triad]) sample.raw = map * sample.raw;
  if (!recording->truth.sensors[triad]) return;
  TriadModel<double>& model = recording->truth.sensors[triad]->model;
  model.bias = map * model.bias;
  model.sensitivity = map * model.sensitivity;
}
void AxisFlipped(const Strike& strike, Recording* recording) {
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs[strike.random->Below(3)] = -1.0;
  Remap(signs.asDiagonal(), strike.triad, recording);
}
void AxesSwapped(const Strike& strike, Recording* recording) {
  Eigen::Matrix3d map = Eigen::Matrix3d::Identity();
  const int axis = strike.random->Below(3);
  map.row(axis).swap(map.row((axis + 1) % 3));
  Remap(map, strike.triad, recording);
}
void AxesCycled(const Strike& strike, Recording* recording) {
  Eigen::Matrix3d map;
  map << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  Remap(map, strike.triad, recording);
}
void ScaleReadings(double factor, Triad triad, Recording* recording) {
  for (Sample& sample : recording->samples[triad]) sample.raw *= factor;
}
void Tenfold(const Strike& strike, Recording* recording) {
  ScaleReadings(strike.random->Uniform() < 0.5 ? 10.0 : 0.1, strike.triad, recording);
}
void Thousandfold(const Strike& strike, Recording* recording) {
  ScaleReadings(strike.random->Uniform() < 0.5 ? 1000.0 : 0.001, strike.triad, recording);
}
void DegreesAsRadians(const Strike&, Recording* recording) {
  ScaleReadings(1.0 / kRadPerDeg, kG, recording);
}
void RadiansAsDegrees(const Strike&, Recording* recording) {
  ScaleReadings(kRadPerDeg, kG, recording);
}
void GravitiesAsMps2(const Strike&, Recording* recording) {
  ScaleReadings(1.0 / kStandardGravityMps2, kA, recording);
}
void Normalised(const Strike& strike, Recording* recording) {
  const double norm = Full(strike.triad);
  for (Sample& sample : recording->samples[strike.triad]) sample.raw *= norm / sample.raw.norm();
}
void Kelvins(const Strike&, Recording* recording) {
  Each(recording, [](std::vector<Sample>* samples) {
    for (Sample& sample : *samples) sample.degc += 273.15;
  });
}
void RowsExchanged(const Strike& strike, Recording* recording) {
  const int count = static_cast<int>(recording->rests.size());
  const int row = strike.random->Below(count - 1);
  std::swap(recording->rests[static_cast<std::size_t>(row)],
            recording->rests[static_cast<std::size_t>(row + 1)]);
}
void Conjugated(const Strike&, Recording* recording) {
  for (TrueRest& rest : recording->rests) rest.world_from_body = rest.world_from_body.conjugate();
}
void AttitudeNoise(const Strike& strike, Recording* recording) {
  for (TrueRest& rest : recording->rests) {
    const Eigen::Vector3d off = strike.severity * strike.random->Normal3();
    rest.world_from_body =
        rest.world_from_body * Eigen::Quaterniond(Eigen::AngleAxisd(off.norm(), off.normalized()));
  }
}
void RateOff(const Strike& strike, Recording* recording) {
  const int which = strike.random->Below(static_cast<int>(recording->rates.size()));
  recording->rates[static_cast<std::size_t>(which)].rate_radps *= 1.0 + strike.severity;
}

// The world and how the unit is held in it.

PosesStep* PosesOf(Scenario* scenario) {
  for (MotionStep& step : scenario->motion) {
    if (PosesStep* poses = std::get_if<PosesStep>(&step)) return poses;
  }
  return nullptr;
}
TumbleStep* TumbleOf(Scenario* scenario) {
  for (MotionStep& step : scenario->motion) {
    if (TumbleStep* tumble = std::get_if<TumbleStep>(&step)) return tumble;
  }
  return nullptr;
}
int RestsOf(Scenario* scenario) {
  const PosesStep* poses = PosesOf(scenario);
  return poses == nullptr ? 1 : static_cast<int>(poses->poses.size());
}
DisturbanceTime Sometime(const Strike& strike, Scenario* scenario) {
  if (PosesOf(scenario) != nullptr) {
    return {.rest = 1 + strike.random->Below(RestsOf(scenario)),
            .offset_s = strike.random->Uniform(0.0, 3.0)};
  }
  return {.rest = {},
          .offset_s = strike.random->Uniform(0.1, 0.9) * TumbleOf(scenario)->duration_s};
}
// A time after the first two rests: a change in them would be there throughout.
DisturbanceTime Midway(const Strike& strike, Scenario* scenario) {
  DisturbanceTime when = Sometime(strike, scenario);
  if (when.rest) when.rest = std::min(std::max(*when.rest, 3), RestsOf(scenario));
  return when;
}
void FieldMoved(const Strike& strike, Scenario* scenario) {
  scenario->disturbances.push_back(FieldStep{
      .when = Midway(strike, scenario), .change_ut = strike.severity * Direction(strike.random)});
}
void FieldUneven(const Strike& strike, Scenario* scenario) {
  Eigen::Vector3d now = Eigen::Vector3d::Zero();
  const bool is_tumble = PosesOf(scenario) == nullptr;
  const int places = is_tumble ? 24 : RestsOf(scenario);
  for (int i = 1; i < places; ++i) {
    const Eigen::Vector3d next = strike.severity * strike.random->Normal3();
    DisturbanceTime when;
    if (is_tumble) {
      when.offset_s = TumbleOf(scenario)->duration_s * i / places;
    } else {
      when.rest = i + 1;
    }
    scenario->disturbances.push_back(FieldStep{.when = when, .change_ut = next - now});
    now = next;
  }
}
void MagnetPasses(const Strike& strike, Scenario* scenario) {
  scenario->disturbances.push_back(
      MagnetPassing{.when = Sometime(strike, scenario),
                    .duration_s = strike.random->Uniform(0.5, 20.0),
                    .peak_ut = strike.severity * Direction(strike.random)});
}
void Knocks(const Strike& strike, Scenario* scenario) {
  for (int i = 0; i < 8; ++i) {
    scenario->disturbances.push_back(
        Knock{.when = Sometime(strike, scenario),
              .duration_s = strike.random->Uniform(0.02, 0.3),
              .peak_mps2 = strike.severity * Direction(strike.random)});
  }
}
// Severity: rad.
void Unsettled(const Strike& strike, Scenario* scenario) {
  for (int rest = 2; rest <= RestsOf(scenario); rest += 3) {
    scenario->disturbances.push_back(
        UnsettledPose{.rest = rest,
                      .tilt_rad = strike.severity * Direction(strike.random),
                      .decay_s = strike.random->Uniform(0.1, 2.0)});
  }
}
void FewPoses(const Strike& strike, Scenario* scenario) {
  if (PosesStep* poses = PosesOf(scenario)) {
    poses->poses.resize(
        std::min(poses->poses.size(), static_cast<std::size_t>(std::lround(strike.severity))));
  }
}
// Keeps only attitudes whose up direction is within an angle of a random direction.
void OneSided(const Strike& strike, Scenario* scenario) {
  PosesStep* poses = PosesOf(scenario);
  const Eigen::Vector3d middle = Direction(strike.random);
  std::vector<ProgramPose> kept;
  for (const ProgramPose& pose : poses->poses) {
    const Eigen::Vector3d up = pose.world_from_body.conjugate() * Eigen::Vector3d::UnitZ();
    if (up.dot(middle) > std::cos(strike.severity)) kept.push_back(pose);
  }
  if (kept.size() >= 2) poses->poses = kept;
}
void ShortRests(const Strike& strike, Scenario* scenario) {
  PosesOf(scenario)->rest_s = strike.severity;
}
void SlowMoves(const Strike& strike, Scenario* scenario) {
  PosesOf(scenario)->move_s = strike.severity;
}
void LeverArm(const Strike& strike, Scenario* scenario) {
  scenario->sensors[kA]->lever_arm_m = strike.severity * Direction(strike.random);
}
void Shaken(const Strike& strike, Scenario* scenario) {
  TumbleOf(scenario)->hand_acceleration_mps2 = strike.severity;
}
void Slowly(const Strike& strike, Scenario* scenario) {
  TumbleOf(scenario)->rms_rate_radps = strike.severity;
}
void GravityMisstated(const Strike& strike, Scenario* scenario) {
  scenario->world.gravity_mps2 *= 1.0 + strike.severity;
}
void FieldMisstated(const Strike& strike, Scenario* scenario) {
  scenario->world.field_ut *= 1.0 + strike.severity;
}

}  // namespace

std::string_view RegimeName(Regime regime) {
  constexpr std::string_view kNames[] = {
      "hand", "accelerometer", "rows", "motion", "faces", "attitudes", "rates"};
  return kNames[static_cast<std::size_t>(regime)];
}

std::vector<Triad> SensorsOf(Regime regime) {
  switch (regime) {
    case Regime::kHand:
    case Regime::kMotion:
      return {kA, kG, kM};
    case Regime::kAccelerometer:
    case Regime::kFaces:
      return {kA};
    case Regime::kRows:
      return {kM};
    case Regime::kAttitudes:
      return {kA, kM};
    case Regime::kRates:
      return {kG};
  }
  return {};
}

namespace {

// The faults of the log.
std::vector<Fault> FaultsOfLogs() {
  using enum Expected;
  using enum Regime;
  return {
      {"zero rows", 1e-3, 0.1, kEach, {}, kEither, nullptr, ZeroRows},
      {"sentinel values", 1e-3, 0.05, kEach, {}, kEither, nullptr, Sentinels},
      {"spikes", 1e-3, 0.1, kEach, {}, kEither, nullptr, Spikes},
      {"one-sided spikes", 1e-3, 0.1, kEach, {}, kEither, nullptr, OneSidedSpikes},
      {"stuck for a while", 0.1, 20, kEach, {}, kEither, nullptr, StuckStretches},
      {"stuck axis", 0.02, 1, kEach, {}, kEither, nullptr, StuckAxis},
      {"wrap-around", 0.02, 0.5, kEach, {}, kEither, nullptr, WrapAround},
      {"rows lost",
       1e-3,
       0.3,
       {},
       {kHand, kAccelerometer, kRows, kMotion, kFaces},
       kEither,
       nullptr,
       LostStamped},
      {"rows lost, times regular", 1e-3, 0.3, {}, {kHand}, kEither, nullptr, LostRegular},
      {"many rows lost, times regular", 0.05, 0.3, {}, {kMotion}, kEither, nullptr, LostRegular},
      {"few rows lost, times regular", 1e-3, 0.05, {}, {kMotion}, kEither, nullptr, LostRegular},
      {"every nth row lost, times regular",
       3,
       20,
       {},
       kTurning,
       kEither,
       nullptr,
       LostPeriodically},
      {"jitter", 0.01, 2, {}, kStamped, kEither, nullptr, Jitter},
      {"bursts", 2, 64, {}, kStamped, kEither, nullptr, Bursts},
      {"ticks", 1e-3, 0.1, {}, kStamped, kEither, nullptr, Ticks},
      {"sampled unevenly", 0.01, 2, {}, kTurning, kEither, SampledFinely, PickUnevenly},
      {"clock offset", 1e-3, 2, {kG, kM}, kTurning, kEither, nullptr, ClockOffset},
      {"clock rate", 1e-5, 1e-2, {kA, kM}, kTurning, kEither, nullptr, ClockRate},
      {"gyroscope clock rate", 1e-5, 1e-2, {kG}, kTurning, kUnseen, nullptr, ClockRate},
      {"time base", 1e-4, 0.1, {}, kTurning, kUnseen, nullptr, TimeBase},
      {"ms as s",
       1,
       1,
       {},
       {kHand, kMotion, kAccelerometer},
       kRefusal,
       nullptr,
       MillisecondsAsSeconds},
      {"cut and closed",
       0.3,
       20,
       {},
       {kHand, kAccelerometer, kMotion},
       kEither,
       nullptr,
       CutAndClosed},
      {"gap", 0.1, 20, {}, {kHand, kAccelerometer, kMotion}, kEither, nullptr, Gap},
      {"repeated stretch",
       1,
       30,
       {},
       {kHand, kAccelerometer, kMotion, kRows},
       kEither,
       nullptr,
       Repeated},
      {"halves exchanged",
       1,
       1,
       {},
       {kHand, kAccelerometer, kMotion},
       kEither,
       nullptr,
       HalvesExchanged},
      {"pieces exchanged",
       2,
       40,
       {},
       {kHand, kAccelerometer, kMotion},
       kEither,
       nullptr,
       PiecesExchanged},
      {"pieces cut out",
       2,
       40,
       {},
       {kHand, kAccelerometer, kMotion},
       kEither,
       nullptr,
       PiecesCutOut},
      {"moves cut out", 0.03, 1, {}, {kHand, kAccelerometer}, kEither, nullptr, MovesCutOut},
      {"clock set back",
       2,
       10,
       {},
       {kHand, kAccelerometer, kMotion},
       kEither,
       nullptr,
       ClockSetBack},
      {"repeated elsewhere",
       1,
       30,
       {},
       {kHand, kAccelerometer, kMotion, kRows},
       kEither,
       nullptr,
       RepeatedElsewhere},
  };
}

// The faults of the unit, its surroundings and its firmware, in the order in which they happen.
std::vector<Fault> FaultsOfUnits() {
  using enum Expected;
  using enum Regime;
  return {
      {"few poses", 3, 12, {}, kResting, kEither, FewPoses, nullptr},
      {"one-sided", 0.6, 2, {}, {kHand, kAccelerometer, kAttitudes}, kEither, OneSided, nullptr},
      {"short rests", 0.4, 1.5, {}, {kHand, kAccelerometer}, kEither, ShortRests, nullptr},
      {"moves of another pace", 0.3, 6, {}, {kHand, kAccelerometer}, kEither, SlowMoves, nullptr},
      {"quadratic", 1e-5, 1e-2, {kA, kM}, {}, kEither, nullptr, Quadratic, {kFaces}},
      {"cubic", 1e-5, 1e-2, kEach, {}, kEither, nullptr, Cubic, {kFaces}},
      {"compressed", 1e-5, 3e-2, {kG}, {}, kEither, nullptr, Compressed},
      {"asymmetric", 1e-5, 1e-2, {kG}, {}, kEither, nullptr, Asymmetric},
      {"clipped", 0.01, 0.5, kEach, {}, kEither, nullptr, Clipped},
      {"low-pass", 0.02, 1, kEach, {}, kEither, nullptr, LowPass},
      {"coarse", 1e-4, 0.05, kEach, {}, kEither, nullptr, Coarse},
      {"g-sensitivity", 1e-6, 1e-3, {kG}, kTurning, kEither, GSensitivity, nullptr},
      {"drift", 1e-5, 3e-2, kEach, {}, kEither, nullptr, Drift, {kFaces}},
      {"bias step", 1e-5, 3e-2, kEach, {}, kEither, nullptr, BiasStep, {kFaces}},
      {"wandering", 1e-5, 3e-2, kEach, {}, kEither, nullptr, Wandering, {kFaces}},
      {"humming", 1e-4, 0.1, kEach, {}, kEither, nullptr, Humming},
      {"gain drift", 1e-5, 3e-2, kEach, {}, kEither, nullptr, GainDrift, {kFaces}},
      {"heavy tails", 1e-5, 1e-2, kEach, {}, kEither, nullptr, HeavyTails},
      {"noisy axis", 1e-4, 0.1, kEach, {}, kEither, nullptr, NoisyAxis},
      {"axis flipped",
       1,
       1,
       {kA, kG},
       {kHand, kMotion, kAttitudes, kRates},
       kRefusal,
       nullptr,
       AxisFlipped},
      {"axes swapped",
       1,
       1,
       {kA, kG},
       {kHand, kMotion, kAttitudes, kRates},
       kRefusal,
       nullptr,
       AxesSwapped},
      {"axes cycled",
       1,
       1,
       {kA, kG},
       {kHand, kMotion, kAttitudes, kRates},
       kRefusal,
       nullptr,
       AxesCycled},
      {"axis flipped, magnetometer",
       1,
       1,
       {kM},
       {kHand, kMotion, kAttitudes},
       kEither,
       nullptr,
       AxisFlipped},
      {"axes swapped, magnetometer",
       1,
       1,
       {kM},
       {kHand, kMotion, kAttitudes},
       kEither,
       nullptr,
       AxesSwapped},
      {"tenfold", 1, 1, kEach, {}, kRefusal, nullptr, Tenfold},
      {"thousandfold", 1, 1, kEach, {}, kRefusal, nullptr, Thousandfold},
      {"deg/s as rad/s", 1, 1, {kG}, {}, kRefusal, nullptr, DegreesAsRadians},
      {"rad/s as deg/s", 1, 1, {kG}, {}, kRefusal, nullptr, RadiansAsDegrees},
      {"g as m/s^2", 1, 1, {kA}, {}, kRefusal, nullptr, GravitiesAsMps2},
      {"normalised", 1, 1, {kA, kM}, {}, kRefusal, nullptr, Normalised},
      {"kelvins", 1, 1, {}, {kHand}, kRefusal, nullptr, Kelvins},
      {"rows exchanged", 1, 1, {}, {kAttitudes}, kEither, nullptr, RowsExchanged},
      {"conjugated", 1, 1, {}, {kAttitudes}, kRefusal, nullptr, Conjugated},
      {"attitudes off", 1e-4, 0.1, {}, {kAttitudes}, kEither, nullptr, AttitudeNoise},
      {"one rate off", 1e-4, 0.3, {}, {kRates}, kEither, nullptr, RateOff},
      {"hard iron moved",
       0.01,
       30,
       {kM},
       {kHand, kMotion, kRows, kAttitudes},
       kEither,
       nullptr,
       HardIronMoved},
      {"field moved",
       0.01,
       30,
       {kM},
       {kHand, kMotion, kRows, kAttitudes},
       kEither,
       FieldMoved,
       nullptr},
      {"uneven field",
       0.01,
       10,
       {kM},
       {kHand, kMotion, kRows, kAttitudes},
       kEither,
       FieldUneven,
       nullptr},
      {"magnet passing",
       0.1,
       100,
       {kM},
       {kHand, kMotion, kRows, kAttitudes},
       kEither,
       MagnetPasses,
       nullptr},
      {"knocks",
       0.3,
       100,
       {kA},
       {kHand, kAccelerometer, kFaces, kMotion},
       kEither,
       Knocks,
       nullptr},
      {"unsettled",
       1e-3,
       0.3,
       {},
       {kHand, kAccelerometer, kFaces, kAttitudes},
       kEither,
       Unsettled,
       nullptr},
      {"lever arm", 0.01, 0.3, {kA}, {kMotion}, kEither, LeverArm, nullptr},
      {"shaken", 0.5, 10, {kA}, {kMotion}, kEither, Shaken, nullptr},
      {"turned slowly or fast", 0.2, 6, {}, {kMotion}, kEither, Slowly, nullptr},
      {"gravity misstated",
       1e-4,
       1e-2,
       {kA},
       {kHand, kAccelerometer, kMotion},
       kUnseen,
       GravityMisstated,
       nullptr},
      {"field misstated", 1e-3, 0.1, {kM}, {kHand, kMotion}, kUnseen, FieldMisstated, nullptr},
  };
}

}  // namespace

std::span<const Fault> Faults() {
  static const std::vector<Fault> kFaults = [] {
    std::vector<Fault> faults = FaultsOfUnits();
    std::ranges::copy(FaultsOfLogs(), std::back_inserter(faults));
    return faults;
  }();
  return kFaults;
}

}  // namespace truetriad::trust
