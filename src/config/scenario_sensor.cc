// SPDX-License-Identifier: Apache-2.0
#include "config/scenario_sensor.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>

#include "config/quantities.h"
#include "config/yaml_values.h"

namespace truetriad {
namespace {

constexpr double kSqrtSecondsPerSqrtHour = 60.0;
constexpr std::array<std::string_view, 3> kOrders = {"_degc", "_degc2", "_degc3"};

constexpr NamedValues<GyroscopeOutput, 2> kGyroscopeOutputs = {{
    {GyroscopeOutput::kMeanRate, "mean_rate"},
    {GyroscopeOutput::kInstantaneous, "instantaneous"},
}};

void ReadUnit(YamlReader& sensor, Triad triad, ScenarioSensor* draft) {
  std::string name;
  if (YamlReader unit = sensor.Child("unit"); unit.Read(&name)) {
    Result<Unit> parsed = ParseTriadUnit(triad, name);
    if (parsed) {
      draft->unit = *parsed;
    } else {
      unit.Fail(parsed.error().message, parsed.error().code);
    }
  }
  double value = 0.0;
  const bool has_size = ReadNumber(sensor.Child("si_per_count"), kPositive, &value);
  if (has_size) draft->si_per_count = value;
  // Data sheets state it the other way round: 16384 LSB/g.
  QuantityKeys inverse = TriadKeys("counts_per", triad);
  for (const QuantityKey& key : inverse) {
    YamlReader counts = sensor.Child(key.key);
    if (!ReadNumber(counts, kPositive, &value)) continue;
    if (has_size) counts.Fail("says the same as `si_per_count`; keep one");
    draft->si_per_count = key.scale / value;
  }
  ReadQuantity(sensor, {{"zero_raw"}}, kAnyNumber, &draft->zero_raw);
}

void ReadMatrix(YamlReader& sensor, ScenarioSensor* draft) {
  YamlReader whole = sensor.Child("sensitivity");
  Eigen::Matrix3d matrix;
  if (ReadNumbers(whole, &matrix)) draft->sensitivity = matrix;
  const bool has_scale =
      ReadQuantity(sensor, ShareKeys("scale_error"), kAnyNumber, &draft->scale_error);
  const QuantityKeys angles = AngleKeys("misalignment");
  const bool has_misalignment = ReadQuantity(sensor, angles, &draft->misalignment_rad);
  if (has_misalignment && !draft->misalignment_rad.diagonal().isZero(0.0)) {
    sensor.Fail("misalignment: expected zeros on the diagonal; put gains into `scale_error`");
  }
  if (!has_scale && !has_misalignment) return;
  if (whole) {
    whole.Fail("says the same as scale_error and misalignment; keep one of the two");
  } else {
    draft->sensitivity.reset();
  }
}

void ReadThermal(YamlReader reader, Triad triad, std::optional<ThermalTerms>* thermal) {
  if (!reader) return;
  if (IsWord(reader, "none")) {
    thermal->reset();
    return;
  }
  if (!*thermal) thermal->emplace();
  ThermalTerms& terms = **thermal;
  ReadNumber(reader.Child("reference_degc"), kAnyNumber, &terms.reference_degc);
  for (std::size_t i = 0; i < kOrders.size(); ++i) {
    if (Eigen::Vector3d bias;
        ReadQuantity(reader, TriadKeys("bias", triad, kOrders[i]), kAnyNumber, &bias)) {
      while (terms.bias.size() <= i) terms.bias.push_back(Eigen::Vector3d::Zero());
      terms.bias[i] = bias;
    }
    Eigen::Vector3d scale;
    Eigen::Matrix3d matrix;
    const bool has_scale = ReadQuantity(reader, ShareKeys("scale", kOrders[i]), kAnyNumber, &scale);
    const bool has_matrix = ReadQuantity(reader, ShareKeys("matrix", kOrders[i]), &matrix);
    if (has_scale && has_matrix) {
      reader.Fail("scale and matrix of one order say the same; keep one");
    }
    if (!has_scale && !has_matrix) continue;
    while (terms.sensitivity.size() <= i) terms.sensitivity.push_back(Eigen::Matrix3d::Zero());
    terms.sensitivity[i] = has_matrix ? matrix : Eigen::Matrix3d(scale.asDiagonal());
  }
  for (const auto& [keys, term] :
       {std::pair(TriadKeys("rate", triad, "_degcps"), &terms.rate[RateTerm::kLinear]),
        std::pair(TriadKeys("rate", triad, "_degcps2"), &terms.rate[RateTerm::kQuadratic]),
        std::pair(TriadKeys("rate_cross", triad, "_degc_degcps"), &terms.rate[RateTerm::kCross])}) {
    if (Eigen::Vector3d value; ReadQuantity(reader, keys, kAnyNumber, &value)) *term = value;
  }
  reader.RejectUnknown();
}

QuantityKeys GSensitivityKeys() {
  return {{"g_sensitivity_radps_mps2", 1.0},
          {"g_sensitivity_degps_g", kRadPerDeg / kStandardGravityMps2}};
}

/// Of the signal to the power of the term; one µg/g² adds 1e-6 g at 1 g.
QuantityKeys AxisTermKeys(const AxisTermInfo& info) {
  const std::string name(info.name);
  if (info.power == 0) return ShareKeys(name);
  const std::string power = std::to_string(info.power), twice = std::to_string(2 * info.power);
  return {
      {name + (info.power == 1 ? "_per_mps2" : "_per_m" + power + "ps" + twice), 1.0},
      {name + "_ug_g" + std::to_string(1 + info.power), 1e-6 / info.PowerOf(kStandardGravityMps2)}};
}

void ReadSpread(YamlReader reader, Triad triad, UnitSpread* spread) {
  if (!reader) return;
  if (IsWord(reader, "none")) {
    *spread = {};
    return;
  }
  ReadQuantity(reader, TriadKeys("bias", triad), kNotNegative, &spread->bias);
  ReadQuantity(reader, ShareKeys("scale"), kNotNegative, &spread->scale);
  ReadQuantity(reader, AngleKeys("misalignment"), kNotNegative, &spread->misalignment_rad);
  if (triad == Triad::kGyroscope) {
    ReadQuantity(reader, GSensitivityKeys(), kNotNegative, &spread->g_sensitivity);
  }
  for (const AxisTermInfo& info : kAxisTerms) {
    if (info.triad != triad) continue;
    ReadQuantity(reader, AxisTermKeys(info), kNotNegative, &spread->axis_terms[info.term]);
  }
  ReadQuantity(
      reader, TriadKeys("thermal_bias", triad, "_degc"), kNotNegative, &spread->thermal_bias);
  ReadQuantity(reader, ShareKeys("thermal_scale", "_degc"), kNotNegative, &spread->thermal_scale);
  ReadQuantity(reader, TriadKeys("turn_on_bias", triad), kNotNegative, &spread->turn_on_bias);
  reader.RejectUnknown();
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

void ReadSensorNoise(YamlReader reader, Triad triad, ScenarioSensor* draft) {
  if (!reader) return;
  SensorNoise& noise = draft->settled.noise;
  if (IsWord(reader, "none")) {
    noise = {};
    draft->sample_sigma.reset();
    return;
  }
  const bool has_density = ReadQuantity(reader, DensityKeys(triad), kNotNegative, &noise.density);
  if (has_density) draft->sample_sigma.reset();
  if (Eigen::Vector3d sigma;
      ReadQuantity(reader, TriadKeys("sample_sigma", triad), kNotNegative, &sigma)) {
    draft->sample_sigma = sigma;
    if (has_density) reader.Fail("a density and a sample_sigma say the same; keep one");
  }
  ReadQuantity(
      reader, TriadKeys("bias_instability", triad), kNotNegative, &noise.instability_sigma);
  ReadNumber(reader.Child("correlation_time_s"), kPositive, &noise.correlation_time_s);
  ReadQuantity(reader, RandomWalkKeys(triad), kNotNegative, &noise.random_walk);
  reader.RejectUnknown();
}

void ReadSampling(YamlReader reader, SensorSampling* sampling) {
  if (!reader) return;
  ReadNumber(reader.Child("rate_hz"), kPositive, &sampling->rate_hz);
  ReadQuantity(reader, TimeKeys("jitter"), kNotNegative, &sampling->jitter_s);
  ReadNumber(reader.Child("dropout"),
             {0.0, std::nextafter(1.0, 0.0), "a probability from 0 to less than 1"},
             &sampling->dropout);
  ReadQuantity(reader, TimeKeys("clock_offset"), kAnyNumber, &sampling->clock_offset_s);
  reader.RejectUnknown();
}

void ReadOutput(YamlReader& sensor, Triad triad, ScenarioSensor* draft) {
  double value = 0.0;
  QuantityKeys resolution = TriadKeys("resolution", triad);
  if (ReadQuantity(sensor, resolution, kNotNegative, &value)) {
    draft->resolution = value;
    draft->resolution_raw.reset();
  }
  if (YamlReader raw = sensor.Child("resolution_raw"); ReadNumber(raw, kNotNegative, &value)) {
    draft->resolution_raw = value;
  }
  if (ReadQuantity(sensor, TriadKeys("range", triad), kPositive, &value)) {
    draft->range = value;
    draft->range_raw.reset();
  }
  std::vector<double> ends;
  if (YamlReader raw = sensor.Child("range_raw"); raw.Read(&ends)) {
    if (ends.size() == 2 && ends[0] < ends[1]) {
      draft->range_raw = Eigen::Vector2d(ends[0], ends[1]);
    } else {
      raw.Fail("expected two readings [lowest, highest]");
    }
  }
}

}  // namespace

void ReadScenarioSensor(YamlReader reader, Triad triad, std::optional<ScenarioSensor>* sensor) {
  if (!reader) return;
  if (IsWord(reader, "none")) {
    sensor->reset();
    return;
  }
  if (!*sensor) {
    sensor->emplace();
    (*sensor)->unit = *ParseTriadUnit(triad, TruthUnitName(triad));
  }
  ScenarioSensor& draft = **sensor;
  ReadUnit(reader, triad, &draft);
  ReadQuantity(reader, TriadKeys("bias", triad), kAnyNumber, &draft.bias);
  ReadMatrix(reader, &draft);
  ReadThermal(reader.Child("thermal"), triad, &draft.thermal);
  ReadSpread(reader.Child("spread"), triad, &draft.settled.spread);
  ReadSensorNoise(reader.Child("noise"), triad, &draft);
  ReadSampling(reader.Child("sampling"), &draft.settled.sampling);
  ReadOutput(reader, triad, &draft);
  if (triad == Triad::kAccelerometer) {
    reader.Optional("lever_arm_m", &draft.settled.lever_arm_m);
  }
  if (triad == Triad::kGyroscope) {
    if (Eigen::Matrix3d value; ReadQuantity(reader, GSensitivityKeys(), &value)) {
      draft.g_sensitivity = value;
    }
    ReadChoice(reader.Child("output"), kGyroscopeOutputs, &draft.settled.gyroscope_output);
  }
  for (const AxisTermInfo& info : kAxisTerms) {
    if (info.triad != triad) continue;
    ReadQuantity(reader, AxisTermKeys(info), kAnyNumber, &draft.axis_terms[info.term]);
  }
  reader.RejectUnknown();
}

SimulatedTriad SettledSensor(const ScenarioSensor& sensor,
                             const std::function<void(const std::string&)>& fail) {
  SimulatedTriad triad = sensor.settled;
  if (sensor.unit.is_counts && !sensor.si_per_count) {
    fail("readings are in counts; add `si_per_count` or `counts_per_…`");
  } else if (!sensor.unit.is_counts && sensor.si_per_count) {
    fail("a count size is stated, but the readings are in " + sensor.unit.name +
         "; add `unit: counts` or remove it");
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
  // Counts are whole numbers.
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
