// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <Eigen/Core>

#include "model/finding_fields.h"
#include "tree/fields.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"
#include "truetriad/model/tags.h"

namespace truetriad {

// The fields of calibration.yaml (tree/fields.h), except those of Quality (quality_fields.h).

inline auto WordsOf(NoiseSource) { return std::pair(&NoiseSourceName, &NoiseSourceFromName); }
inline auto WordsOf(Mode) { return std::pair(&ModeName, &ModeFromName); }
inline auto WordsOf(Outcome) { return std::pair(&OutcomeName, &OutcomeFromName); }
inline auto WordsOf(Verdict) { return std::pair(&VerdictName, &VerdictFromName); }
inline auto WordsOf(Gauge) { return std::pair(&GaugeName, &GaugeFromName); }

template <class V>
void TagFields(V& visit, std::span<const TagKey> keys, Like<Tags> auto& tags) {
  for (const TagKey& tag : keys) {
    visit.If(!(tags.*tag.value).empty(), tag.key, tags.*tag.value);
  }
}

/// The keys of `device:` that its firmware uses to identify sensors.
template <class V>
void FirmwareFields(V& visit, Like<Tags> auto& tags) {
  const PerTriad<std::optional<std::int64_t>> none;
  visit.If(!tags.firmware.empty(), "firmware", tags.firmware);
  const auto numbers = [&](std::string_view key, auto& of, std::int64_t least, auto wrong) {
    const Part of_sensors{[&, least, wrong](auto& map) {
      for (const Triad triad : kTriads) {
        auto& number = of[triad];
        if (!map(TriadName(triad), number)) continue;
        map.Check(TriadName(triad),
                  [&] { return *number >= least ? std::string_view() : std::string_view(wrong); });
      }
    }};
    visit.If(of != none, key, of_sensors, Style::kFlow);
  };
  numbers("ids", tags.device_ids, 1, "must be above zero: to firmware, 0 means no sensor");
  const char* const no_slot = "must be 0 or more, or -1 if no slot is free";
  numbers("slots", tags.device_slots, Tags::kNoSlot, no_slot);
  numbers("thermal_slots", tags.thermal_slots, Tags::kNoSlot, no_slot);
  auto& idle = tags.idle_thermal_slots;
  const Part lists{[&idle](auto& map) {
    for (const Triad triad : kTriads) map.If(!idle[triad].empty(), TriadName(triad), idle[triad]);
  }};
  visit.If(idle != Tags().idle_thermal_slots, "idle_thermal_slots", lists, Style::kFlow);
  visit("magnetometer_turn_deg", tags.magnetometer_turn_deg);
  visit("magnetometer_mount_deg", tags.magnetometer_mount_deg);
}
inline bool HasRunTags(const Tags& tags) {
  return std::any_of(kRunTags.begin(), kRunTags.end(), [&tags](const TagKey& tag) {
    return !(tags.*tag.value).empty();
  });
}

template <typename Derived>
std::string_view WrongSigma(const Eigen::MatrixBase<Derived>& sigma) {
  return sigma.minCoeff() < 0.0 ? "contains a negative standard deviation" : "";
}

template <class V>
void SigmaField(V& visit, std::string_view key, auto& sigma) {
  if (visit(key, sigma)) visit.Check(key, [&sigma] { return WrongSigma(sigma); });
}

inline std::string_view WrongThermal(const ThermalTerms& thermal) {
  bool finite = std::isfinite(thermal.reference_degc) && thermal.range_degc.allFinite();
  for (const Eigen::Vector3d& term : thermal.bias) finite = finite && term.allFinite();
  for (const Eigen::Matrix3d& term : thermal.sensitivity) finite = finite && term.allFinite();
  for (const std::optional<Eigen::Vector3d>& rate : thermal.rate) {
    finite = finite && (!rate || rate->allFinite());
  }
  for (const ThermalKnot& knot : thermal.knots) {
    finite = finite && std::isfinite(knot.degc) && std::isfinite(knot.slope) &&
             std::isfinite(knot.curve);
  }
  if (!finite) return "contains a number that is not finite";
  if (thermal.range_degc[0] > thermal.range_degc[1] ||
      std::min(thermal.range_degc[0], thermal.reference_degc) < kAbsoluteZeroDegc) {
    return "expected `range_degc` as [lowest, highest] temperature, not below -273.15 degC";
  }
  return thermal.smoothing_s >= 0.0 ? "" : "expected `smoothing_s` of at least zero";
}

/// The correction is written for programs that only apply it. If it does not match the sensitivity,
/// one of the two was edited, and it is not known which is right.
inline std::string_view WrongCorrection(const Eigen::Matrix3d& correction,
                                        const TriadModel<double>& model) {
  // With condition number c, correction times sensitivity equals the identity to c epsilon. A
  // tolerance of 1e-6 allows c = 1e9, far more than that of any sensor, and is far below any change
  // made on purpose.
  constexpr double kTolerance = 1e-6;
  if (!model.sensitivity.allFinite() || !model.bias.allFinite()) {
    return "belongs to a sensor with a bias or sensitivity that is not finite";
  }
  const Eigen::Matrix3d error = correction * model.sensitivity - Eigen::Matrix3d::Identity();
  if (error.cwiseAbs().maxCoeff() < kTolerance) return "";
  return "is not the inverse of `sensitivity`: one of the two was edited; undo that, or make them "
         "match";
}

template <class V>
void Fields(V& visit, Like<ThermalKnot> auto& knot) {
  visit("axis", AxisLetterOf{knot.axis});
  visit("degc", knot.degc);
  visit("slope", knot.slope);
  visit("curve", knot.curve);
}

template <class V>
void LagField(V& visit, std::string_view key, auto& lag) {
  if (!visit(key, lag)) return;
  visit.Check(key, [&lag]() -> std::string_view {
    return lag->allFinite() && lag->minCoeff() >= 0.0 ? ""
                                                      : "expected lags of at least zero seconds";
  });
}

template <class V>
void Fields(V& visit, Like<ThermalTerms> auto& thermal) {
  visit("reference_degc", thermal.reference_degc);
  visit("range_degc", thermal.range_degc);
  visit("bias", thermal.bias);
  visit("sensitivity", thermal.sensitivity);
  visit.Group("rate", Style::kFlow, [&thermal](V& rate) {
    for (const RateTermInfo& info : kRateTerms) rate(info.name(), thermal.rate[info.term]);
  });
  LagField(visit, "element_lag_s", thermal.element_lag_s);
  LagField(visit, "rate_lag_s", thermal.rate_lag_s);
  visit.If(thermal.smoothing_s > 0.0, "smoothing_s", thermal.smoothing_s);
  if (visit("rate_range_degcps", thermal.rate_range_degcps)) {
    visit.Check("rate_range_degcps", [&range = *thermal.rate_range_degcps]() -> std::string_view {
      return range[0] <= range[1] ? "" : "expected [lowest, highest] rate";
    });
  }
  visit.If(!thermal.knots.empty(), "knots", thermal.knots);
  visit.Check("", [&thermal] { return WrongThermal(thermal); });
}

template <class V>
void Fields(V& visit, Like<TriadNoise> auto& noise) {
  SigmaField(visit, "sigma", noise.sigma);
  visit("source", noise.source);
  visit("excess_sigma", noise.excess_sigma);
  // If the excess was not estimated, its degrees of freedom are infinite and the key is missing.
  if constexpr (V::kReads) noise.excess_dof = std::numeric_limits<double>::infinity();
  visit.If(std::isfinite(noise.excess_dof), "excess_dof", noise.excess_dof);
  visit.If(noise.turn_excess_sigma_rad > 0.0, "turn_excess_sigma_rad", noise.turn_excess_sigma_rad);
}

template <class V>
void MountingField(V& visit, auto& mounting) {
  std::string name = AxisMapName(mounting);
  if (!visit.If(!mounting.isIdentity(0.0), "mounting", Word{name})) return;
  if constexpr (V::kReads) {
    const std::optional<Eigen::Matrix3d> map = AxisMapFromName(name);
    if (map) mounting = *map;
    visit.Check("mounting", [&] {
      return map ? "" : "expected three signed axes such as +y+x-z, not `" + name + "`";
    });
  }
}

template <class V>
void Fields(V& visit, Like<TriadCalibration> auto& sensor) {
  visit("input_unit", sensor.input_unit);
  visit("output_unit", sensor.output_unit);
  visit("bias", sensor.model.bias);
  const bool has_sensitivity = visit("sensitivity", sensor.model.sensitivity);
  // The correction follows from the sensitivity. It is written for people and for programs that
  // only apply it.
  Eigen::Matrix3d correction = sensor.model.Correction();
  if (has_sensitivity && visit("correction", correction)) {
    visit.Check("correction", [&] { return WrongCorrection(correction, sensor.model); });
  }
  MountingField(visit, sensor.mounting);
  Eigen::Vector3d scale = sensor.Scale();
  Eigen::Matrix3d misalignment_rad = sensor.MisalignmentRad();
  visit.If(kNewer, "scale", scale);
  visit.If(kNewer, "misalignment_rad", misalignment_rad);
  for (const AxisTermInfo& info : kAxisTerms) {
    auto& sigma = sensor.axis_term_sigma[info.term];
    const bool has_term =
        visit.If(sigma.has_value(), info.name, sensor.model.axis_terms[info.term]);
    if constexpr (V::kReads) {
      if (has_term) sigma.emplace();
    }
  }
  visit.Group("sigma", Style::kUsual, [&sensor](V& sigma) {
    SigmaField(sigma, "bias", sensor.bias_sigma);
    SigmaField(sigma, "sensitivity", sensor.sensitivity_sigma);
    for (const AxisTermInfo& info : kAxisTerms) {
      auto& term = sensor.axis_term_sigma[info.term];
      if (term) SigmaField(sigma, info.name, *term);
    }
  });
  visit("g_sensitivity", sensor.g_sensitivity);
  visit("thermal", sensor.thermal);
  visit("si_per_count", sensor.si_per_count);
  visit("noise", sensor.noise, Style::kFlow);
}

template <class V>
void Fields(V& visit, Like<ReferenceValues> auto& reference) {
  if (visit("gravity_mps2", reference.gravity_mps2)) {
    visit.Check("gravity_mps2", [&]() -> std::string_view {
      return reference.gravity_mps2 > 0.0 ? "" : "expected a positive number";
    });
  }
  visit("gravity_sigma_mps2", reference.gravity_sigma_mps2);
  visit("field_ut", reference.field_ut);
  visit("dip_rad", reference.dip_rad);
  visit("fixture_from_world", reference.fixture_from_world);
  visit("field_estimated", reference.field_estimated);
  visit.If(kNewer, "field_nominal", reference.field_nominal);
  visit("temperature_degc", reference.temperature_degc);
  if (visit("recorded_degc", reference.recorded_degc)) {
    visit.Check("recorded_degc", [&degc = *reference.recorded_degc]() -> std::string_view {
      return degc[0] <= degc[1] && degc[1] <= degc[2] && degc[0] >= kAbsoluteZeroDegc
                 ? ""
                 : "expected the lowest, the mean and the highest temperature in degC";
    });
  }
}

template <class V>
void Fields(V& visit, Like<Decision> auto& decision) {
  if (visit("verdict", decision.verdict)) {
    visit.Check("verdict", [&decision]() -> std::string {
      if (decision.verdict == Verdict::kPass || decision.verdict == Verdict::kFail) return "";
      return "`" + std::string(VerdictName(decision.verdict)) +
             "` is not a decision; expected PASS or FAIL";
    });
  }
  visit("who", decision.who);
  visit("why", decision.why);
  visit("created", decision.created);
  visit.If(decision.is_automatic, "automatic", decision.is_automatic);
}

}  // namespace truetriad
