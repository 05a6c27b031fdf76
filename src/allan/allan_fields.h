// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/finding_fields.h"
#include "tree/fields.h"
#include "truetriad/allan/allan.h"
#include "truetriad/base/triad.h"

namespace truetriad {

// The fields of allan.yaml (tree/fields.h).

inline constexpr std::string_view kAllanFormat = "truetriad/allan/1";
inline constexpr std::string_view kAtRest = "at_rest", kNotAtRest = "not_at_rest";

template <class V>
void Fields(V& visit, Like<Interval> auto& interval) {
  visit("value", interval.value);
  visit("low", interval.low);
  visit("high", interval.high);
  visit.Check("", [&interval] {
    const auto& [value, low, high] = interval;
    return low >= 0.0 && low <= value && value <= high
               ? ""
               : "is not an interval; expected 0 <= low <= value <= high";
  });
}

template <>
inline constexpr bool kIsRow<AllanPoint> = true;
template <class V>
void Fields(V& visit, Like<AllanPoint> auto& point) {
  visit("tau_s", point.tau_s);
  visit("deviation", point.deviation.value);
  visit("low", point.deviation.low);
  visit("high", point.deviation.high);
  visit("degrees_of_freedom", point.degrees_of_freedom);
  visit("terms", point.terms);
}

/// A coefficient with its unit, which is derived from the unit of its sensor.
template <typename T>
struct InUnit {
  T of;
  std::string unit;
};

template <class V>
void UnitField(V& visit, const std::string& expected) {
  std::string unit = expected;
  visit("unit", unit);
  visit.Check("unit", [&] {
    return unit == expected ? ""
                            : "is `" + unit + "`; expected `" + expected +
                                  "`, which follows from the sensor's unit";
  });
}

template <class V>
void Fields(V& visit, Like<InUnit<Interval>> auto& coefficient) {
  Fields(visit, coefficient.of);
  UnitField(visit, coefficient.unit);
}

/// The noise density N, and the range of tau in which it was fitted.
struct StatedWhite {
  Interval density;
  std::optional<std::array<double, 2>> range_s;
};
template <class V>
void Fields(V& visit, Like<InUnit<StatedWhite>> auto& noise) {
  auto& [density, range_s] = noise.of;
  Fields(visit, density);
  UnitField(visit, noise.unit);
  std::vector<double> range;
  if (range_s) range.assign(range_s->begin(), range_s->end());
  const bool has_range = visit.If(range_s.has_value(), "range_s", range);
  const bool is_range = range.size() == 2 && range[0] <= range[1];
  if (!has_range) return;
  visit.Check("range_s", [=] { return is_range ? "" : "expected two numbers, the smaller first"; });
  if constexpr (V::kReads) {
    if (is_range) range_s = {range[0], range[1]};
  }
}

template <class V>
void Fields(V& visit, Like<InUnit<BiasInstability>> auto& instability) {
  Fields(visit, instability.of.coefficient);
  UnitField(visit, instability.unit);
  visit("minimum", instability.of.minimum);
  visit("tau_s", instability.of.tau_s);
  visit("at_end", instability.of.at_end);
}

/// The field of a coefficient; it is written if the data show the coefficient.
template <class V, typename Optional>
void CoefficientField(V& visit,
                      std::string_view key,
                      Optional& coefficient,
                      const std::string& unit) {
  using Value = typename Optional::value_type;
  InUnit<Value> stated{coefficient.value_or(Value()), unit};
  const bool is_there = visit.If(coefficient.has_value(), key, stated, Style::kFlow);
  if constexpr (V::kReads) {
    if (is_there) coefficient = stated.of;
  }
}

/// Writes a coefficient converted to steps of one sample, as simulations and filters need it.
template <class V, typename Scaling>
void SampleField(V& visit,
                 std::string_view key,
                 const std::optional<Interval>& coefficient,
                 Scaling scaling,
                 double scale,
                 const std::string& unit) {
  if constexpr (V::kReads) {
    visit.Skip(key);
  } else if (coefficient) {
    visit.Group(key, Style::kFlow, [&](V& sample) {
      sample("value", scaling(coefficient->value, scale));
      sample("unit", unit);
    });
  }
}

template <typename Axis>
struct AxisOfTriad {
  Axis& axis;
  const std::string& unit;
  double rate_hz;
};
template <typename Axis>
AxisOfTriad(Axis&, const std::string&, double) -> AxisOfTriad<Axis>;

template <class V, typename Axis>
void Fields(V& visit, const AxisOfTriad<Axis>& of_triad) {
  const auto& [axis, unit, rate_hz] = of_triad;
  std::optional<StatedWhite> white;
  if (axis.white_density) white = StatedWhite{*axis.white_density, axis.white_range_s};
  CoefficientField(visit, "noise_density", white, unit + "/sqrt(Hz)");
  if constexpr (V::kReads) {
    if (white) axis.white_density = white->density;
    if (white) axis.white_range_s = white->range_s;
  }
  const double root_hz = std::sqrt(rate_hz);
  SampleField(visit, "noise_sigma_sample", axis.white_density, std::multiplies<>(), root_hz, unit);
  CoefficientField(visit, "bias_instability", axis.instability, unit);
  CoefficientField(visit, "random_walk", axis.random_walk, unit + "/s/sqrt(Hz)");
  SampleField(visit, "random_walk_sample", axis.random_walk, std::divides<>(), root_hz, unit);
  CoefficientField(visit, "quantisation", axis.quantisation, unit + "*s");
  SampleField(visit, "quantisation_sample", axis.quantisation, std::multiplies<>(), rate_hz, unit);
  visit("points", axis.points);
}

inline bool HasCoefficients(const AllanAxis& axis) {
  return axis.white_density || axis.instability || axis.random_walk || axis.quantisation;
}

template <class V>
void StatusFields(V& visit, Like<AllanTriad> auto& triad) {
  std::string status(triad.at_rest() ? kAtRest : kNotAtRest);
  visit.If(kNewer, "status", Word{status});
  visit.Check("status", [&status] {
    return status == kAtRest || status == kNotAtRest
               ? ""
               : "is `" + status + "`; expected `at_rest` or `not_at_rest`";
  });
  if (status != kNotAtRest || !visit("disturbance", triad.disturbance)) return;
  visit.Check("disturbance", [&triad] {
    return triad.at_rest() ? "is empty; state what disturbed the unit" : "";
  });
}

template <class V>
void Fields(V& visit, Like<AllanTriad> auto& triad) {
  std::string unit = triad.unit.name;
  const bool has_unit = visit("unit", unit);
  if constexpr (V::kReads) {
    const Result<Unit> parsed = ParseTriadUnit(triad.triad, unit);
    if (parsed) triad.unit = *parsed;
    if (has_unit && !parsed) visit.Check("unit", [&] { return parsed.error().message; });
  }
  visit("si_per_count", triad.si_per_count);
  StatusFields(visit, triad);
  if (visit("rate_hz", triad.rate_hz)) {
    visit.Check("rate_hz", [&triad] { return triad.rate_hz > 0.0 ? "" : "must be above zero"; });
  }
  visit("samples", triad.samples);
  visit("duration_s", triad.duration_s);
  visit("filled_samples", triad.filled_samples);
  visit("breaks", triad.breaks);
  visit("warnings", triad.warnings, Style::kBlocks);
  visit.Group("axes", Style::kUsual, [&triad, &unit](V& axes) {
    for (std::size_t axis = 0; axis < kAxisLetters.size(); ++axis) {
      axes(kAxisLetters.substr(axis, 1), AxisOfTriad{triad.axes[axis], unit, triad.rate_hz});
    }
  });
  visit.Check("axes", [&triad] {
    return triad.at_rest() || std::none_of(triad.axes.begin(), triad.axes.end(), HasCoefficients)
               ? ""
               : "has coefficients for a sensor that was not at rest; expected none";
  });
}

template <class V>
void Fields(V& visit, Like<AllanResult> auto& result) {
  std::string format(kAllanFormat);
  visit("format", Word{format});
  visit("source", result.source);
  visit("serial", result.serial);
  const bool is_numbered = result.tags.device_ids != PerTriad<std::optional<std::int64_t>>();
  // The ids and numbers by which the firmware identifies the sensors of a recording.
  const Part device{[&tags = result.tags](auto& map) {
    map("firmware", tags.firmware);
    map.Group("ids", Style::kFlow, [&tags](auto& ids) {
      for (const Triad triad : kTriads) ids(TriadName(triad), tags.device_ids[triad]);
    });
  }};
  visit.If(is_numbered, "device", device);
  visit("inputs", result.inputs);
  visit.Group("sensors", Style::kUsual, [&result](V& sensors) {
    if constexpr (V::kReads) {
      for (const Triad triad : kTriads) {
        AllanTriad read;
        read.triad = triad;
        if (sensors.If(kNewer, TriadName(triad), read)) result.triads.push_back(read);
      }
    } else {
      for (const AllanTriad& triad : result.triads) sensors(TriadName(triad.triad), triad);
    }
  });
}

}  // namespace truetriad
