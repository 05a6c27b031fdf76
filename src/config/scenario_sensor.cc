// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>
#include <vector>

#include "config/scenario_fields.h"

namespace truetriad {
namespace {

constexpr double kSqrtSecondsPerSqrtHour = 60.0;  // sqrt(3600 s/h).
constexpr std::array<std::string_view, 3> kOrders = {"_degc", "_degc2", "_degc3"};
constexpr Entries kEachNotNegative{kNotNegative, true};

constexpr NamedValues<GyroscopeOutput, 2> kGyroscopeOutputs = {{
    {GyroscopeOutput::kMeanRate, "mean_rate"},
    {GyroscopeOutput::kInstantaneous, "instantaneous"},
}};

void UnitFields(auto& visit, Triad triad, ScenarioSensor& sensor) {
  visit("unit", sensor.unit, ReadingsUnit{triad});
  const bool has_size = visit("si_per_count", sensor.si_per_count, kPositive);
  // Data sheets state the inverse of si_per_count, such as 16384 LSB/g.
  for (const auto& [key, scale] : TriadKeys("counts_per", triad)) {
    double counts = 0.0;
    if (!visit(key, counts, kPositive)) continue;
    visit.Expect(!has_size, "says the same as `si_per_count`; keep one", key);
    sensor.si_per_count = scale / counts;
  }
  visit("zero_raw", sensor.zero_raw, kEach);
}

void MatrixFields(auto& visit, ScenarioSensor& sensor) {
  visit("sensitivity", sensor.sensitivity, kNumbers);
  const bool has_scale = visit(ShareKeys("scale_error"), sensor.scale_error, kEach);
  const bool has_angles = visit(AngleKeys("misalignment"), sensor.misalignment_rad, kNumbers);
  visit.Expect(!has_angles || sensor.misalignment_rad.diagonal().isZero(0.0),
               "misalignment: expected zeros on the diagonal; put gains into `scale_error`");
  if (!has_scale && !has_angles) return;
  visit.Expect(
      false, "says the same as scale_error and misalignment; keep one of the two", "sensitivity");
  if (!visit.Has("sensitivity")) sensor.sensitivity.reset();
}

template <typename Term>
Term& TermOf(std::vector<Term>& terms, std::size_t order) {
  while (terms.size() <= order) terms.push_back(Term::Zero());
  return terms[order];
}

void ThermalFields(auto& visit, Triad triad, ThermalTerms& terms) {
  visit("reference_degc", terms.reference_degc, kAnyNumber);
  for (std::size_t i = 0; i < kOrders.size(); ++i) {
    Eigen::Vector3d bias = Eigen::Vector3d::Zero(), scale = bias;
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    if (visit(TriadKeys("bias", triad, kOrders[i]), bias, kEach)) TermOf(terms.bias, i) = bias;
    const bool has_scale = visit(ShareKeys("scale", kOrders[i]), scale, kEach);
    const bool has_matrix = visit(ShareKeys("matrix", kOrders[i]), matrix, kNumbers);
    visit.Expect(!(has_scale && has_matrix),
                 "a scale and a matrix of the same order are stated; keep one");
    if (has_scale) matrix = scale.asDiagonal();
    if (has_scale || has_matrix) TermOf(terms.sensitivity, i) = matrix;
  }
  visit(TriadKeys("rate", triad, "_degcps"), terms.rate[RateTerm::kLinear], kEach);
  visit(TriadKeys("rate", triad, "_degcps2"), terms.rate[RateTerm::kQuadratic], kEach);
  visit(TriadKeys("rate_cross", triad, "_degc_degcps"), terms.rate[RateTerm::kCross], kEach);
}

QuantityKeys GSensitivityKeys() {
  return {{"g_sensitivity_radps_mps2", 1.0},
          {"g_sensitivity_degps_g", kRadPerDeg / kStandardGravityMps2}};
}

/// Keys of an axis term, each with its unit. For example, a term of 1 µg/g² adds 1e-6 g at 1 g.
QuantityKeys AxisTermKeys(const AxisTermInfo& info) {
  const std::string name(info.name);
  if (info.power == 0) return ShareKeys(name);
  const std::string power = std::to_string(info.power), twice = std::to_string(2 * info.power);
  return {
      {name + (info.power == 1 ? "_per_mps2" : "_per_m" + power + "ps" + twice), 1.0},
      {name + "_ug_g" + std::to_string(1 + info.power), 1e-6 / info.PowerOf(kStandardGravityMps2)}};
}

void SpreadFields(auto& visit, Triad triad, UnitSpread& spread) {
  visit(TriadKeys("bias", triad), spread.bias, kNotNegative);
  visit(ShareKeys("scale"), spread.scale, kNotNegative);
  visit(AngleKeys("misalignment"), spread.misalignment_rad, kNotNegative);
  if (triad == Triad::kGyroscope) visit(GSensitivityKeys(), spread.g_sensitivity, kNotNegative);
  for (const AxisTermInfo& info : kAxisTerms) {
    if (info.triad == triad) visit(AxisTermKeys(info), spread.axis_terms[info.term], kNotNegative);
  }
  visit(TriadKeys("thermal_bias", triad, "_degc"), spread.thermal_bias, kNotNegative);
  visit(ShareKeys("thermal_scale", "_degc"), spread.thermal_scale, kNotNegative);
  visit(TriadKeys("turn_on_bias", triad), spread.turn_on_bias, kNotNegative);
}

QuantityKeys DensityKeys(Triad triad) {
  QuantityKeys keys = TriadKeys("noise_density", triad, "_rthz");
  if (triad == Triad::kAccelerometer) {
    keys.push_back({"velocity_random_walk_mps_rth", 1.0 / kSqrtSecondsPerSqrtHour});
  }
  if (triad == Triad::kGyroscope) {
    keys.push_back({"angle_random_walk_deg_rth", kRadPerDeg / kSqrtSecondsPerSqrtHour});
  }
  return keys;
}

QuantityKeys RandomWalkKeys(Triad triad) {
  QuantityKeys keys = TriadKeys("bias_random_walk", triad, "_rts");
  for (QuantityKey& key : TriadKeys("bias_random_walk", triad, "_rth")) {
    keys.push_back({std::move(key.key), key.scale / kSqrtSecondsPerSqrtHour});
  }
  return keys;
}

void NoiseFields(auto& visit, Triad triad, ScenarioSensor& sensor) {
  SensorNoise& noise = sensor.settled.noise;
  const bool has_density = visit(DensityKeys(triad), noise.density, kEachNotNegative);
  if (has_density) sensor.sample_sigma.reset();
  const bool has_sigma =
      visit(TriadKeys("sample_sigma", triad), sensor.sample_sigma, kEachNotNegative);
  visit.Expect(!(has_density && has_sigma),
               "a density and a sample_sigma both state the white noise; keep one");
  visit(TriadKeys("bias_instability", triad), noise.instability_sigma, kEachNotNegative);
  visit("correlation_time_s", noise.correlation_time_s, kPositive);
  visit(RandomWalkKeys(triad), noise.random_walk, kEachNotNegative);
}

void SamplingFields(auto& visit, SensorSampling& sampling) {
  visit("rate_hz", sampling.rate_hz, kPositive);
  visit(TimeKeys("jitter"), sampling.jitter_s, kNotNegative);
  visit("dropout",
        sampling.dropout,
        Range{0.0, std::nextafter(1.0, 0.0), "a probability from 0 to less than 1"});
  visit(TimeKeys("clock_offset"), sampling.clock_offset_s, kAnyNumber);
}

void OutputFields(auto& visit, Triad triad, ScenarioSensor& sensor) {
  if (visit(TriadKeys("resolution", triad), sensor.resolution, kNotNegative)) {
    sensor.resolution_raw.reset();
  }
  visit("resolution_raw", sensor.resolution_raw, kNotNegative);
  if (visit(TriadKeys("range", triad), sensor.range, kPositive)) sensor.range_raw.reset();
  if (std::vector<double> ends; visit("range_raw", ends, NumberList())) {
    const bool is_range = ends.size() == 2 && ends[0] < ends[1];
    visit.Expect(is_range, "expected two readings [lowest, highest]", "range_raw");
    if (is_range) sensor.range_raw = Eigen::Vector2d(ends[0], ends[1]);
  }
}

void SensorFields(auto& visit, Triad triad, ScenarioSensor& sensor) {
  UnitFields(visit, triad, sensor);
  visit(TriadKeys("bias", triad), sensor.bias, kEach);
  MatrixFields(visit, sensor);
  const auto thermal = [&](auto& in) {
    if (!sensor.thermal) sensor.thermal.emplace();
    ThermalFields(in, triad, *sensor.thermal);
  };
  visit.Map("thermal", thermal, {.words = {{"none", false, [&] { sensor.thermal.reset(); }}}});
  UnitSpread& spread = sensor.settled.spread;
  visit.Map("spread",
            [&](auto& in) { SpreadFields(in, triad, spread); },
            {.words = {{"none", false, [&] { spread = {}; }}}});
  const auto no_noise = [&] {
    sensor.settled.noise = {};
    sensor.sample_sigma.reset();
  };
  visit.Map("noise",
            [&](auto& in) { NoiseFields(in, triad, sensor); },
            {.words = {{"none", false, no_noise}}});
  visit.Map("sampling", [&](auto& in) { SamplingFields(in, sensor.settled.sampling); });
  OutputFields(visit, triad, sensor);
  if (triad == Triad::kAccelerometer) {
    visit("lever_arm_m", sensor.settled.lever_arm_m, kNumbers);
  }
  if (triad == Triad::kGyroscope) {
    visit(GSensitivityKeys(), sensor.g_sensitivity, kNumbers);
    visit("output", sensor.settled.gyroscope_output, kGyroscopeOutputs);
  }
  for (const AxisTermInfo& info : kAxisTerms) {
    if (info.triad == triad) visit(AxisTermKeys(info), sensor.axis_terms[info.term], kEach);
  }
}

}  // namespace

void ScenarioSensorMap(auto& visit, Triad triad, std::optional<ScenarioSensor>* sensor) {
  const auto fields = [&](auto& in) {
    if (!*sensor) {
      sensor->emplace();
      (*sensor)->unit = *ParseTriadUnit(triad, TruthUnitName(triad));
    }
    SensorFields(in, triad, **sensor);
  };
  visit.Map(TriadName(triad), fields, {.words = {{"none", false, [&] { sensor->reset(); }}}});
}
template void ScenarioSensorMap(FieldReader&, Triad, std::optional<ScenarioSensor>*);
template void ScenarioSensorMap(FieldSchema&, Triad, std::optional<ScenarioSensor>*);

SimulatedTriad SettledSensor(const ScenarioSensor& sensor,
                             const std::function<void(const std::string&)>& fail) {
  SimulatedTriad triad = sensor.settled;
  if (sensor.unit.is_counts && !sensor.si_per_count) {
    fail("readings are in counts; add `si_per_count` or `counts_per_…`");
  } else if (!sensor.unit.is_counts && sensor.si_per_count) {
    fail("a count size is stated, but the readings are in " + sensor.unit.name +
         "; state `unit: counts`, or remove the size");
  }
  triad.unit = sensor.unit;
  triad.si_per_count = sensor.si_per_count;
  const double gain = 1.0 / sensor.si_per_count.value_or(sensor.unit.truth_per_raw);

  const Eigen::Vector3d scale = Eigen::Vector3d::Ones() + sensor.scale_error;
  triad.nominal.sensitivity =
      gain * sensor.sensitivity.value_or(scale.asDiagonal() *
                                         (Eigen::Matrix3d::Identity() + sensor.misalignment_rad));
  triad.nominal.bias = sensor.zero_raw + gain * sensor.bias;
  if (sensor.g_sensitivity) triad.g_sensitivity = gain * *sensor.g_sensitivity;
  for (const AxisTermInfo& info : kAxisTerms) {
    triad.nominal.axis_terms[info.term] = sensor.axis_terms[info.term] / info.PowerOf(gain);
  }
  triad.thermal = sensor.thermal;
  if (triad.thermal) {
    for (Eigen::Vector3d& term : triad.thermal->bias) term *= gain;
    for (Eigen::Matrix3d& term : triad.thermal->sensitivity) term *= gain;
    for (std::optional<Eigen::Vector3d>& term : triad.thermal->rate) {
      if (term) *term *= gain;
    }
  }

  if (sensor.sample_sigma) {
    triad.noise.density = *sensor.sample_sigma / std::sqrt(triad.sampling.rate_hz);
  }
  const double counts = sensor.resolution ? gain * *sensor.resolution : 1.0;
  if (sensor.unit.is_counts && !sensor.resolution_raw &&
      (std::abs(counts - std::round(counts)) > 1e-6 * counts || counts < 0.5)) {
    fail("the resolution is " + std::to_string(counts) +
         " counts, but counts are whole numbers; state `resolution_raw: 1`, or no "
         "resolution in the base");
  }
  // Readings in counts are whole numbers.
  const double finest_raw = sensor.unit.is_counts ? 1.0 : 0.0;
  triad.resolution_raw =
      sensor.resolution_raw.value_or(sensor.resolution ? gain * *sensor.resolution : finest_raw);
  triad.range_raw = sensor.range_raw;
  if (!triad.range_raw && sensor.range) {
    if ((sensor.zero_raw.array() != sensor.zero_raw[0]).any()) {
      fail("the range is ambiguous, because `zero_raw` differs between axes; give `range_raw`");
    }
    const double zero = sensor.zero_raw[0];
    triad.range_raw = Eigen::Vector2d(zero - gain * *sensor.range, zero + gain * *sensor.range);
  }
  return triad;
}

}  // namespace truetriad
