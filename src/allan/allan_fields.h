// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/finding_fields.h"
#include "tree/fields.h"
#include "truetriad/allan/allan.h"

namespace truetriad {

// The fields of allan.yaml as it is written (tree/fields.h).

inline constexpr std::string_view kAllanFormat = "truetriad/allan/1";
inline constexpr std::string_view kAtRest = "at_rest", kNotAtRest = "not_at_rest";

template <class V>
void Fields(V& visit, Like<Interval> auto& interval) {
  visit("value", interval.value);
  visit("low", interval.low);
  visit("high", interval.high);
}

template <>
inline constexpr bool kIsRow<AllanPoint> = true;
template <class V>
void Fields(V& visit, Like<AllanPoint> auto& point) {
  visit("tau_s", point.tau_s);
  Fields(visit, point.deviation);
  visit("degrees_of_freedom", point.degrees_of_freedom);
  visit("terms", point.terms);
}

/// A coefficient in its unit, and what `more` says of it.
template <class V, typename More>
void CoefficientField(V& visit,
                      std::string_view key,
                      const Interval& interval,
                      const std::string& unit,
                      const More& more) {
  visit.Group(key, Style::kFlow, [&](V& coefficient) {
    Fields(coefficient, interval);
    coefficient("unit", unit);
    more(coefficient);
  });
}

/// Values of one sample are for those who simulate or filter in steps of one; they are not read.
template <class V>
void SampleField(V& visit, std::string_view key, double value, const std::string& unit) {
  visit.Group(key, Style::kFlow, [&](V& sample) {
    sample("value", value);
    sample("unit", unit);
  });
}

struct AxisOfTriad {
  const AllanAxis& axis;
  const std::string& unit;
  double rate_hz;
};

template <class V>
void Fields(V& visit, Like<AxisOfTriad> auto& of_triad) {
  const auto& [axis, unit, rate_hz] = of_triad;
  const auto nothing = [](V&) {};
  if (axis.white_density) {
    const auto& range_s = axis.white_range_s;
    CoefficientField(
        visit, "noise_density", *axis.white_density, unit + "/sqrt(Hz)", [&range_s](V& density) {
          if (range_s) density("range_s", std::vector<double>(range_s->begin(), range_s->end()));
        });
    SampleField(visit, "noise_sigma_sample", axis.white_density->value * std::sqrt(rate_hz), unit);
  }
  if (axis.instability) {
    const BiasInstability& instability = *axis.instability;
    CoefficientField(
        visit, "bias_instability", instability.coefficient, unit, [&instability](V& more) {
          more("minimum", instability.minimum);
          more("tau_s", instability.tau_s);
          more("at_end", instability.at_end);
        });
  }
  if (axis.random_walk) {
    CoefficientField(visit, "random_walk", *axis.random_walk, unit + "/s/sqrt(Hz)", nothing);
    SampleField(visit, "random_walk_sample", axis.random_walk->value / std::sqrt(rate_hz), unit);
  }
  if (axis.quantisation) {
    CoefficientField(visit, "quantisation", *axis.quantisation, unit + "*s", nothing);
    SampleField(visit, "quantisation_sample", axis.quantisation->value * rate_hz, unit);
  }
  visit("points", axis.points);
}

template <class V>
void Fields(V& visit, Like<AllanTriad> auto& triad) {
  visit("unit", triad.unit.name);
  visit("si_per_count", triad.si_per_count);
  visit("status", Word{triad.at_rest() ? kAtRest : kNotAtRest});
  visit.If(!triad.at_rest(), "disturbance", triad.disturbance);
  visit("rate_hz", triad.rate_hz);
  visit("samples", triad.samples);
  visit("duration_s", triad.duration_s);
  visit("filled_samples", triad.filled_samples);
  visit("breaks", triad.breaks);
  visit("warnings", triad.warnings, Style::kBlocks);
  visit.Group("axes", Style::kUsual, [&triad](V& axes) {
    for (std::size_t axis = 0; axis < kAxisLetters.size(); ++axis) {
      axes(kAxisLetters.substr(axis, 1),
           AxisOfTriad{triad.axes[axis], triad.unit.name, triad.rate_hz});
    }
  });
}

template <class V>
void Fields(V& visit, Like<AllanResult> auto& result) {
  visit("format", Word{kAllanFormat});
  visit("source", result.source);
  visit("serial", result.serial);
  visit("inputs", result.inputs);
  visit.Group("sensors", Style::kUsual, [&result](V& sensors) {
    for (const AllanTriad& triad : result.triads) sensors(TriadName(triad.triad), triad);
  });
}

}  // namespace truetriad
