// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "math/random.h"
#include "truetriad/model/calibration.h"

namespace truetriad::formats_test {

/// Directions that cover the sphere; other ones than the program takes.
inline std::vector<Eigen::Vector3d> Sphere() {
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < 12; ++i) {
    const double latitude = std::numbers::pi * (i + 0.5) / 12.0 - 0.5 * std::numbers::pi;
    for (int j = 0; j < 24; ++j) {
      const double longitude = 2.0 * std::numbers::pi * j / 24.0;
      directions.emplace_back(std::cos(latitude) * std::cos(longitude),
                              std::cos(latitude) * std::sin(longitude),
                              std::sin(latitude));
    }
  }
  return directions;
}

inline double Signal(Triad triad) {
  return triad == Triad::kAccelerometer ? 9.80665 : triad == Triad::kMagnetometer ? 48.0 : 2.0;
}

/// What the random units have.
struct UnitKind {
  bool misaligned = true;      ///< Off-diagonal entries; the accelerometer's are lower triangular.
  bool symmetric_mag = false;  ///< The magnetometer's matrix is symmetric.
  bool gyro_matrix = true;     ///< Else the identity.
  int bias_order = 0;          ///< Of temperature terms.
  int matrix_order = 0;
  bool g_sensitivity = false;
  bool axis_terms = false;  ///< All that the sensor may have.
  bool counts = false;      ///< Readings in counts, else in true units.
};

inline Eigen::Matrix3d RandomMatrix(Random* random) {
  Eigen::Matrix3d matrix;
  for (double& entry : matrix.reshaped()) entry = random->Normal();
  return matrix;
}

/// A unit such as MEMS makers sell: offsets of some percent of the range, gains to 3 %, axes to 1
/// %.
inline Calibration RandomUnitCalibration(const UnitKind& kind, std::uint64_t seed) {
  Random random(seed);
  Calibration calibration;
  calibration.serial = "T" + std::to_string(seed);
  calibration.model = "random";
  calibration.software_version = "0.1.0";
  calibration.created = "2026-01-31T12:00:00Z";
  calibration.outcome = Outcome::kConverged;
  calibration.reference.field_ut = 48.0;
  calibration.reference.dip_rad = 1.1;
  calibration.reference.temperature_degc = 25.0;
  for (const Triad triad : kTriads) {
    TriadCalibration& sensor = calibration.sensors[triad].emplace();
    sensor.output_unit = TruthUnitName(triad);
    sensor.input_unit = kind.counts ? "counts" : sensor.output_unit;
    Eigen::Matrix3d E = 0.03 * Eigen::Vector3d(random.Normal3()).asDiagonal().toDenseMatrix();
    if (kind.misaligned) E += 0.01 * RandomMatrix(&random);
    if (triad == Triad::kAccelerometer) E = E.triangularView<Eigen::Lower>().toDenseMatrix();
    if (triad == Triad::kMagnetometer && kind.symmetric_mag) E = (E + E.transpose()).eval();
    if (triad == Triad::kGyroscope && !kind.gyro_matrix) E.setZero();
    sensor.model.sensitivity = Eigen::Matrix3d::Identity() + E;
    if (triad == Triad::kMagnetometer && kind.symmetric_mag) {
      // The inverse is symmetric as well, but for rounding.
      sensor.model.sensitivity = sensor.model.sensitivity.selfadjointView<Eigen::Upper>();
    }
    sensor.model.bias = 0.1 * Signal(triad) * random.Normal3();
    if (kind.bias_order > 0 || kind.matrix_order > 0) {
      ThermalTerms& thermal = sensor.thermal.emplace();
      thermal.reference_degc = 25.0;
      thermal.range_degc = {-20.0, 70.0};
      constexpr double kSpanDegc = 45.0;
      for (int k = 1; k <= kind.bias_order; ++k) {
        thermal.bias.emplace_back(0.02 * Signal(triad) / std::pow(kSpanDegc, k) * random.Normal3());
      }
      for (int k = 1; k <= kind.matrix_order; ++k) {
        Eigen::Matrix3d term = 0.005 / std::pow(kSpanDegc, k) * RandomMatrix(&random);
        if (triad == Triad::kAccelerometer)
          term = term.triangularView<Eigen::Lower>().toDenseMatrix();
        thermal.sensitivity.push_back(term);
      }
    }
    if (triad == Triad::kGyroscope && kind.g_sensitivity) {
      sensor.g_sensitivity = 1e-3 * RandomMatrix(&random);
    }
    for (const AxisTermInfo& info : kAxisTerms) {
      if (!kind.axis_terms || info.triad != triad) continue;
      const double typical = 1e-3 / info.PowerOf(Signal(triad));
      sensor.model.axis_terms[info.term] = typical * random.Normal3();
      sensor.axis_term_sigma[info.term] = Eigen::Vector3d::Constant(0.01 * typical);
    }
    if (kind.counts) {
      const double per_si = triad == Triad::kAccelerometer ? 2048.0 / 9.80665
                            : triad == Triad::kGyroscope   ? 16.4 * 180.0 / std::numbers::pi
                                                           : 1.0 / 0.15;
      sensor.si_per_count = 1.0 / per_si;
      sensor.model.sensitivity *= per_si;
      sensor.model.bias *= per_si;
      for (const AxisTermInfo& info : kAxisTerms) {
        sensor.model.axis_terms[info.term] /= info.PowerOf(per_si);
      }
      if (sensor.g_sensitivity) *sensor.g_sensitivity *= per_si;
      if (sensor.thermal) {
        for (Eigen::Vector3d& term : sensor.thermal->bias) term *= per_si;
        for (Eigen::Matrix3d& term : sensor.thermal->sensitivity) term *= per_si;
      }
    }
  }
  return calibration;
}

/// What the target's equation, written in a test, makes of a reading, in true units. The reading is
/// in the calibration's unit.
using TestEquation = std::function<Eigen::Vector3d(
    const Eigen::Vector3d& raw, const Eigen::Vector3d& force_mps2, double temperature_degc)>;

/// Worst |equation(y) - C(T) (y - b(T) - G f)| over a sphere and the calibrated temperatures, as a
/// share of the signal. `frame`: the target's body frame in that of the calibration.
inline double WorstDisagreement(const Calibration& calibration,
                                Triad triad,
                                const TestEquation& equation,
                                const Eigen::Matrix3d& frame = Eigen::Matrix3d::Identity()) {
  const TriadCalibration& sensor = *calibration.sensors[triad];
  std::vector<double> temperatures = {25.0};
  if (sensor.thermal) temperatures = {-20.0, -7.3, 11.0, 25.0, 38.9, 55.0, 70.0};
  double worst = 0.0;
  for (const double temperature : temperatures) {
    const TriadModel<double> model =
        sensor.thermal ? ModelAtTemperature(sensor.model, *sensor.thermal, temperature)
                       : sensor.model;
    const std::vector<Eigen::Vector3d> sphere = Sphere();
    for (std::size_t i = 0; i < sphere.size(); ++i) {
      const Eigen::Vector3d truth = Signal(triad) * sphere[i];
      const Eigen::Vector3d force = 9.80665 * sphere[(5 * i + 3) % sphere.size()];
      Eigen::Vector3d raw = model.RawFromTruth(truth);
      if (sensor.g_sensitivity) raw += *sensor.g_sensitivity * force;
      const Eigen::Vector3d result = equation(raw, frame.transpose() * force, temperature);
      worst = std::max(worst, (result - frame.transpose() * truth).norm() / Signal(triad));
    }
  }
  return worst;
}

}  // namespace truetriad::formats_test
