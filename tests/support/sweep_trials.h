// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "data/memory_source.h"
#include "math/random.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/model/calibration.h"

namespace truetriad::trials {

// A setting of a chamber: a ramp to a temperature, or, if the rate is zero, a hold of `to_degc` s.
struct SweepLeg {
  double to_degc = 0.0;  // of a hold: seconds
  double rate_degcps = 0.0;
};

// A unit in one attitude in a chamber.
struct Sweep {
  double start_degc = -10.0;
  std::vector<SweepLeg> legs;
  double sample_s = 0.5;
  double air_lag_s = 0.0;      // of the chamber's air behind its setting
  double unit_lag_s = 30.0;    // of thermometer and element behind the chamber
  double element_lag_s = 0.0;  // of the element behind the thermometer
  double thermometer_sigma_degc = 0.01;
  double thermometer_step_degc = 0.0;  // 0: fine
  double noise_sigma = 0.001;          // of one reading, raw unit
  ThermalTerms terms;                  // of the gyroscope
  Eigen::Vector3d bias = {0.3, -0.2, 0.1};
  // In place of the terms: bias of all axes at a temperature.
  std::function<double(double)> curve;
};

// Up and down between -10 and 60 degC at two rates.
inline std::vector<SweepLeg> TwoRates() {
  return {{60.0, 0.03}, {-10.0, 0.03}, {60.0, 0.06}, {-10.0, 0.06}};
}

inline ThermalTerms CubicWithRates() {
  ThermalTerms terms;
  terms.reference_degc = 25.0;
  terms.bias = {{1e-3, -2e-3, 5e-4}, {1e-5, 2e-5, -3e-5}, {-2e-7, 3e-7, 1e-7}};
  terms.rate[RateTerm::kLinear] = Eigen::Vector3d(0.2, -0.1, 0.3);
  terms.rate[RateTerm::kQuadratic] = Eigen::Vector3d(3.0, 2.0, -4.0);
  terms.rate[RateTerm::kCross] = Eigen::Vector3d(4e-3, -3e-3, 2e-3);
  return terms;
}

// The recording of the sweep: a gyroscope at rest in deg/s.
inline MemorySource RecordingOf(const Sweep& sweep, Random* random) {
  MemoryStream stream(Triad::kGyroscope);
  stream.info.unit = {"deg/s", std::numbers::pi / 180.0, false};
  double chamber = sweep.start_degc;
  FirstOrderLag air(sweep.air_lag_s), unit(sweep.unit_lag_s), element(sweep.element_lag_s);
  double time_s = 0.0;
  const auto sample = [&] {
    const double outside = air.Next(time_s, chamber);
    const double thermometer = unit.Next(time_s, outside);
    const double felt = element.Next(time_s, thermometer);
    const double rate = sweep.element_lag_s > 0.0 ? (thermometer - felt) / sweep.element_lag_s
                                                  : (outside - thermometer) / sweep.unit_lag_s;
    TriadModel<double> model;
    model.bias = sweep.bias;
    if (sweep.curve) {
      model.bias = Eigen::Vector3d::Constant(sweep.curve(felt));
    } else {
      model = ModelAtTemperature(model, sweep.terms, felt, rate);
    }
    stream.Add(static_cast<std::int64_t>(std::llround(time_s * 1e9)),
               model.bias + sweep.noise_sigma * random->Normal3());
    double shown = thermometer + sweep.thermometer_sigma_degc * random->Normal();
    if (sweep.thermometer_step_degc > 0.0) {
      shown = std::round(shown / sweep.thermometer_step_degc) * sweep.thermometer_step_degc;
    }
    stream.temperature_degc.push_back(shown);
    time_s += sweep.sample_s;
  };
  for (const SweepLeg& leg : sweep.legs) {
    const bool is_hold = leg.rate_degcps == 0.0;
    const double duration =
        is_hold ? leg.to_degc : std::abs(leg.to_degc - chamber) / leg.rate_degcps;
    const double step =
        is_hold ? 0.0 : std::copysign(leg.rate_degcps, leg.to_degc - chamber) * sweep.sample_s;
    for (int i = 0; i < static_cast<int>(duration / sweep.sample_s); ++i) {
      sample();
      chamber += step;
    }
    if (!is_hold) chamber = leg.to_degc;
  }
  return MemorySource({std::move(stream)});
}

inline PoseSet WindowsOf(SampleSource& source, const SweepWindows& windows = {}) {
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kSweep;
  selection.sweep = windows;
  Result<PoseSet> set = CollectPoses(source, selection);
  EXPECT_TRUE(set) << set.error().message;
  return set ? *std::move(set) : PoseSet();
}

inline PoseSet WindowsOf(const Sweep& sweep, Random* random) {
  MemorySource source = RecordingOf(sweep, random);
  return WindowsOf(source);
}

inline CalibrateOptions SweepOptionsFor(const ThermalOptions& terms) {
  CalibrateOptions options;
  options.triads[Triad::kGyroscope].enabled = true;
  options.triads[Triad::kGyroscope].thermal = terms;
  options.sweep.emplace();
  options.cross_validation_folds = 14;
  return options;
}

}  // namespace truetriad::trials
