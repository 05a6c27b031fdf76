// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "sim/seeds.h"
#include "sim/timeline.h"
#include "truetriad/base/triad.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {
namespace {

/// Every random number is drawn even if its spread is zero, so that the other numbers do not depend
/// on the spreads.
TrueTriad DrawTriad(const SimulatedTriad& nominal, FastRandom random) {
  const UnitSpread& spread = nominal.spread;
  const Eigen::Vector3d gain = nominal.nominal.sensitivity.diagonal();
  const Eigen::Vector3d size = gain.cwiseAbs();
  TrueTriad triad{nominal.nominal, nominal.g_sensitivity, nominal.thermal};

  triad.model.bias += size.cwiseProduct(spread.bias * random.Normal3());
  const Eigen::Vector3d scale = Eigen::Vector3d::Ones() + spread.scale * random.Normal3();
  // S = K (I + M): the misalignment adds to the nominal one, then the gains stretch the rows.
  for (int row = 0; row < 3; ++row) {
    const Eigen::Vector3d misalignment = spread.misalignment_rad * random.Normal3();
    for (int col = 0; col < 3; ++col) {
      if (col != row) triad.model.sensitivity(row, col) += gain[row] * misalignment[col];
    }
    triad.model.sensitivity.row(row) *= scale[row];
  }
  Eigen::Matrix3d g_sensitivity;
  for (int col = 0; col < 3; ++col) g_sensitivity.col(col) = random.Normal3();
  if (spread.g_sensitivity > 0.0) {
    triad.g_sensitivity = triad.g_sensitivity.value_or(Eigen::Matrix3d::Zero()) +
                          size.asDiagonal() * (spread.g_sensitivity * g_sensitivity);
  }
  const Eigen::Vector3d thermal_bias = size.cwiseProduct(spread.thermal_bias * random.Normal3());
  const Eigen::Vector3d thermal_scale = gain.cwiseProduct(spread.thermal_scale * random.Normal3());
  if (spread.thermal_bias > 0.0 || spread.thermal_scale > 0.0) {
    if (!triad.thermal) triad.thermal.emplace();
    if (triad.thermal->bias.empty()) triad.thermal->bias.emplace_back(Eigen::Vector3d::Zero());
    triad.thermal->bias[0] += thermal_bias;
    if (spread.thermal_scale > 0.0) {
      if (triad.thermal->sensitivity.empty()) {
        triad.thermal->sensitivity.emplace_back(Eigen::Matrix3d::Zero());
      }
      triad.thermal->sensitivity[0].diagonal() += thermal_scale;
    }
  }
  for (const AxisTermInfo& info : kAxisTerms) {
    const Eigen::Vector3d value = spread.axis_terms[info.term] * random.Normal3();
    triad.model.axis_terms[info.term] +=
        value.cwiseQuotient(size.unaryExpr([&](double raw) { return info.PowerOf(raw); }));
  }
  return triad;
}

/// Adds the names of one triad's parameters, in the order of a calibration's covariance.
void NameParameters(Triad triad, const TriadCalibration& sensor, std::vector<std::string>* names) {
  const auto vector = [&](const std::string& name) {
    for (const char axis : kAxisLetters) names->push_back(name + "." + axis);
  };
  const auto matrix = [&](const std::string& name) {
    for (const char row : kAxisLetters) {
      for (const char col : kAxisLetters) names->push_back(name + "." + row + col);
    }
  };
  const std::string name(TriadName(triad));
  vector(name + ".bias");
  matrix(name + ".sensitivity");
  if (const auto& thermal = sensor.thermal) {
    const std::string term = name + ".thermal";
    for (std::size_t power = 1; power <= thermal->bias.size(); ++power) {
      vector(term + ".bias." + std::to_string(power));
    }
    for (const RateTermInfo& info : kRateTerms) {
      if (thermal->rate[info.term]) vector(term + "." + std::string(info.path));
    }
    for (std::size_t power = 1; power <= thermal->sensitivity.size(); ++power) {
      matrix(term + ".sensitivity." + std::to_string(power));
    }
  }
  for (const AxisTermInfo& info : kAxisTerms) {
    if (sensor.axis_term_sigma[info.term]) vector(name + "." + std::string(info.name));
  }
  if (sensor.g_sensitivity) matrix(name + ".g_sensitivity");
}

bool IsLowerTriangular(const Eigen::Matrix3d& matrix) {
  return matrix(0, 1) == 0.0 && matrix(0, 2) == 0.0 && matrix(1, 2) == 0.0;
}

}  // namespace

SimulatedUnit DrawUnit(const Scenario& scenario, int index) {
  SimulatedUnit unit;
  unit.serial = scenario.serial;
  if (scenario.count > 1) {
    char number[16];
    std::snprintf(number, sizeof number, "%04d", index + 1);
    unit.serial += number;
  }
  for (const Triad triad : kTriads) {
    if (!scenario.sensors[triad]) continue;
    unit.triads[triad] = DrawTriad(*scenario.sensors[triad],
                                   TriadRandom(scenario.seed, index, Purpose::kUnit, triad));
  }
  return unit;
}

Scenario SessionOf(const Scenario& scenario, int index, int session) {
  Scenario one = scenario;
  const SimulatedUnit unit = DrawUnit(scenario, index);
  const auto key = [&](Purpose purpose, std::uint64_t what) {
    return FastRandom({scenario.seed,
                       static_cast<std::uint64_t>(index),
                       static_cast<std::uint64_t>(purpose),
                       static_cast<std::uint64_t>(session),
                       what});
  };
  one.serial = unit.serial;
  one.count = 1;
  one.sessions = 1;
  if (index > 0 || session > 0) one.seed = key(Purpose::kSession, 0).Bits();
  for (const Triad triad : kTriads) {
    if (!unit.triads[triad]) continue;
    SimulatedTriad& sensor = *one.sensors[triad];
    const TrueTriad& truth = *unit.triads[triad];
    const Eigen::Vector3d size = sensor.nominal.sensitivity.diagonal().cwiseAbs();
    sensor.nominal = truth.model;
    sensor.nominal.bias +=
        size.cwiseProduct(sensor.spread.turn_on_bias *
                          key(Purpose::kTurnOn, static_cast<std::uint64_t>(triad)).Normal3());
    sensor.g_sensitivity = truth.g_sensitivity;
    sensor.thermal = truth.thermal;
    sensor.spread = {};
  }
  return one;
}

Calibration TruthOf(const Scenario& scenario, int index) {
  const SimulatedUnit unit = DrawUnit(scenario, index);
  Calibration truth;
  truth.serial = unit.serial;
  truth.model = scenario.model;
  truth.outcome = Outcome::kConverged;
  truth.findings = {
      {FindingCode::kSimulatedTruth, "the truth of a simulated recording: every sigma is zero"}};
  truth.reference.gravity_mps2 = scenario.world.gravity_mps2;
  truth.reference.temperature_degc = scenario.temperature.start_degc;
  std::optional<Triad> leading;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer, Triad::kGyroscope}) {
    if (!leading && unit.triads[triad]) leading = triad;
  }
  truth.gauge_sensor = leading.value_or(Triad::kAccelerometer);
  truth.gauge = IsLowerTriangular(unit.triads[truth.gauge_sensor]->model.sensitivity)
                    ? Gauge::kAccelX
                    : Gauge::kFixture;
  for (const Triad triad : kTriads) {
    if (!unit.triads[triad]) continue;
    TriadCalibration& sensor = truth.sensors[triad].emplace();
    const SimulatedTriad& simulated = *scenario.sensors[triad];
    sensor.input_unit = simulated.unit.name;
    sensor.output_unit = TruthUnitName(triad);
    sensor.model = unit.triads[triad]->model;
    sensor.g_sensitivity = unit.triads[triad]->g_sensitivity;
    sensor.thermal = unit.triads[triad]->thermal;
    for (const AxisTermInfo& info : kAxisTerms) {
      if (sensor.model.axis_terms[info.term].isZero(0.0)) continue;
      sensor.axis_term_sigma[info.term] = Eigen::Vector3d::Zero();
    }
    sensor.si_per_count = simulated.si_per_count;
    sensor.noise.source = NoiseSource::kConfig;
    if (sensor.thermal) {
      sensor.thermal->range_degc = ElementRange(scenario, MakeTimeline(scenario, index));
      truth.reference.temperature_degc = sensor.thermal->reference_degc;
    }
    NameParameters(triad, sensor, &truth.covariance.parameters);
  }
  if (unit.triads[Triad::kMagnetometer]) {
    truth.reference.field_ut = scenario.world.field_ut;
    truth.reference.dip_rad = scenario.world.dip_rad;
    truth.covariance.parameters.emplace_back("reference.field_ut");
    truth.covariance.parameters.emplace_back("reference.dip_rad");
  }
  const auto size = static_cast<Eigen::Index>(truth.covariance.parameters.size());
  truth.covariance.matrix = Eigen::MatrixXd::Zero(size, size);
  return truth;
}

Calibration TruthOf(const Scenario& scenario, int index, const Simulation& simulation) {
  Calibration truth = TruthOf(scenario, index);
  for (const Triad triad : kTriads) {
    if (truth.sensors[triad]) truth.sensors[triad]->model.bias += simulation.mean_wander(triad);
  }
  return truth;
}

}  // namespace truetriad
