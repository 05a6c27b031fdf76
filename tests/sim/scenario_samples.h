// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "model/attitude_sets.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {

/// A nine-axis unit in true units without noise, set down in 24 attitudes.
inline Scenario QuietScenario() {
  Scenario scenario;
  for (const Triad triad : kTriads) {
    SimulatedTriad& sensor = scenario.sensors[triad].emplace();
    sensor.unit = *ParseTriadUnit(triad, TruthUnitName(triad));
  }
  scenario.sensors[Triad::kAccelerometer]->nominal.sensitivity << 1.02, 0.0, 0.0, 0.01, 0.98, 0.0,
      -0.005, 0.02, 1.01;
  scenario.sensors[Triad::kAccelerometer]->nominal.bias << 0.1, -0.2, 0.3;
  scenario.sensors[Triad::kMagnetometer]->nominal.sensitivity << 1.05, 0.02, -0.01, 0.03, 0.95,
      0.02, 0.0, -0.02, 1.04;
  scenario.sensors[Triad::kMagnetometer]->nominal.bias << 5.0, -8.0, 12.0;
  PosesStep poses;
  for (const Eigen::Quaterniond& attitude : SpreadAttitudes(24)) {
    poses.poses.push_back({attitude, {}, {}});
  }
  scenario.motion = {poses};
  return scenario;
}

/// A unit that lies still for `duration_s`.
inline Scenario StillScenario(double duration_s) {
  Scenario scenario = QuietScenario();
  PosesStep rest;
  rest.poses.resize(1);
  rest.rest_s = duration_s;
  scenario.motion = {rest};
  return scenario;
}

/// All samples of one triad.
struct Samples {
  std::vector<std::int64_t> time_ns;
  std::vector<Eigen::Vector3d> readings;
  std::vector<double> temperature_degc;
};

inline std::unique_ptr<Simulation> Simulate(const Scenario& scenario, int index = 0) {
  Result<std::unique_ptr<Simulation>> simulation = Simulation::Create(scenario, index);
  EXPECT_TRUE(simulation) << simulation.error().message;
  return std::move(*simulation);
}

inline Samples SamplesOf(const Scenario& scenario, Triad triad, int index = 0) {
  const std::unique_ptr<Simulation> simulation = Simulate(scenario, index);
  Samples samples;
  std::vector<SampleBlock> blocks;
  while (*simulation->Next(&blocks)) {
    for (const SampleBlock& block : blocks) {
      if (block.triad != triad) continue;
      for (std::size_t i = 0; i < block.x.size(); ++i) {
        samples.time_ns.push_back(block.time_ns[i]);
        samples.readings.emplace_back(block.x[i], block.y[i], block.z[i]);
        samples.temperature_degc.push_back(
            block.temperature_degc.empty() ? 0.0 : block.temperature_degc[i]);
      }
    }
  }
  return samples;
}

}  // namespace truetriad
