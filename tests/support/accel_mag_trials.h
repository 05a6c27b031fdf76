// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "math/dense/eigenvalues.h"
#include "math/distributions.h"
#include "support/synthetic_poses.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/model/calibration.h"

namespace truetriad::trials {

// How simulated units with accelerometer and magnetometer differ.
struct UnitSpread {
  double gain_low = 0.9, gain_high = 1.1;  // raw per true unit, before `counts_per_unit`
  double cross_axis = 0.03;                // of the row's gain
  double offset = 0.3;                     // of the signal
  bool permute_magnetometer = false;       // signed axis permutations, mirrored ones included
  double counts_per_unit = 1.0;            // gains of a log in counts
};

// A field that dips by 60 degrees, and a usual noise.
inline constexpr double kDip = std::numbers::pi / 3.0;
inline SyntheticNoise ModelNoise() {
  SyntheticNoise noise;
  noise.rest_sigma[Triad::kAccelerometer] = 0.003;
  noise.rest_sigma[Triad::kMagnetometer] = 0.05;
  return noise;
}

inline Eigen::Matrix3d RandomAxisMap(Random* random) {
  std::array<int, 3> order = {0, 1, 2};
  for (int i = 2; i > 0; --i) {
    std::swap(order[static_cast<std::size_t>(i)],
              order[static_cast<std::size_t>(random->Below(i + 1))]);
  }
  Eigen::Matrix3d map = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    map(i, order[static_cast<std::size_t>(i)]) = random->Uniform() < 0.5 ? -1.0 : 1.0;
  }
  return map;
}

inline TriadModel<double> RandomModel(const UnitSpread& spread, double strength, Random* random) {
  TriadModel<double> model;
  for (int row = 0; row < 3; ++row) {
    const double gain =
        spread.counts_per_unit *
        std::exp(random->Uniform(std::log(spread.gain_low), std::log(spread.gain_high)));
    for (int col = 0; col < 3; ++col) {
      model.sensitivity(row, col) =
          gain * (row == col ? 1.0 : random->Uniform(-spread.cross_axis, spread.cross_axis));
    }
    model.bias[row] = gain * strength * random->Uniform(-spread.offset, spread.offset);
  }
  return model;
}

inline Unit UnitOf(Triad triad, bool counts) {
  if (counts) return {"counts", 1.0, true};
  return {std::string(TruthUnitName(triad)), 1.0, false};
}

// A unit whose accelerometer is in the gauge accel-x, so that truth and estimate share a frame.
inline SyntheticUnit RandomUnit(const UnitSpread& spread, Random* random) {
  SyntheticUnit unit;
  unit.dip_rad = kDip;
  const bool counts = spread.counts_per_unit != 1.0 || spread.gain_high > 3.0;
  TriadModel<double> accel = RandomModel(spread, unit.gravity_mps2, random);
  accel.sensitivity *= GaugeRotation(Gauge::kAccelX, accel.sensitivity);
  TriadModel<double> mag = RandomModel(spread, unit.field_ut, random);
  if (spread.permute_magnetometer) mag.sensitivity *= RandomAxisMap(random);
  unit.models[Triad::kAccelerometer] = accel;
  unit.models[Triad::kMagnetometer] = mag;
  unit.units[Triad::kAccelerometer] = UnitOf(Triad::kAccelerometer, counts);
  unit.units[Triad::kMagnetometer] = UnitOf(Triad::kMagnetometer, counts);
  return unit;
}

inline CalibrateOptions JointOptions(const SyntheticUnit& unit) {
  CalibrateOptions options;
  options.triads[Triad::kAccelerometer].enabled = true;
  options.triads[Triad::kMagnetometer].enabled = true;
  options.reference.gravity_mps2 = {unit.gravity_mps2, 0.0};
  options.reference.field_ut = {unit.field_ut, 0.0};
  options.reference.is_hemisphere_stated = true;
  options.cross_validation_folds = 0;
  return options;
}

// Estimate minus truth in the order of the covariance; NaN for a parameter of which the calibration
// has no value (the heading of the field on a fixture).
inline Eigen::VectorXd Errors(const Calibration& calibration, const SyntheticUnit& unit) {
  std::vector<double> errors;
  for (const Triad triad : kTriads) {
    if (!calibration.sensors[triad]) continue;
    const TriadModel<double>& estimate = calibration.sensors[triad]->model;
    const TriadModel<double>& truth = *unit.models[triad];
    for (int i = 0; i < 3; ++i) errors.push_back(estimate.bias[i] - truth.bias[i]);
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col) {
        errors.push_back(estimate.sensitivity(row, col) - truth.sensitivity(row, col));
      }
    }
    for (const AxisTermInfo& info : kAxisTerms) {
      if (!calibration.sensors[triad]->axis_term_sigma[info.term]) continue;
      const Eigen::Vector3d error = estimate.axis_terms[info.term] - truth.axis_terms[info.term];
      errors.insert(errors.end(), error.begin(), error.end());
    }
  }
  for (const std::string& name : calibration.covariance.parameters) {
    if (name.rfind("reference.", 0) != 0) continue;
    if (name == "reference.gravity_mps2") {
      errors.push_back(calibration.reference.gravity_mps2 - unit.gravity_mps2);
    } else if (name == "reference.field_ut") {
      errors.push_back(*calibration.reference.field_ut - unit.field_ut);
    } else if (name == "reference.dip_rad") {
      errors.push_back(*calibration.reference.dip_rad - unit.dip_rad);
    } else {
      errors.push_back(std::numeric_limits<double>::quiet_NaN());
    }
  }
  return Eigen::Map<Eigen::VectorXd>(errors.data(), static_cast<Eigen::Index>(errors.size()));
}

// Normalised estimation error squared with the pseudo-inverse of a covariance that is singular by
// design; `dimension` receives its rank.
inline double Nees(const Eigen::VectorXd& error,
                   const Eigen::MatrixXd& covariance,
                   int* dimension) {
  std::vector<Eigen::Index> seen;
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    if (covariance(i, i) > 0.0 && std::isfinite(error[i])) seen.push_back(i);
  }
  const auto n = static_cast<Eigen::Index>(seen.size());
  Eigen::MatrixXd scaled(n, n);
  Eigen::VectorXd e(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index a = seen[static_cast<std::size_t>(i)];
    e[i] = error[a] / std::sqrt(covariance(a, a));
    for (Eigen::Index j = 0; j < n; ++j) {
      const Eigen::Index b = seen[static_cast<std::size_t>(j)];
      scaled(i, j) = covariance(a, b) / std::sqrt(covariance(a, a) * covariance(b, b));
    }
  }
  const SymmetricEigen eigen = EigenOfSymmetric(scaled);
  const Eigen::VectorXd turned = eigen.vectors.transpose() * e;
  double nees = 0.0;
  *dimension = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (eigen.values[i] < 1e-9) continue;
    nees += turned[i] * turned[i] / eigen.values[i];
    ++*dimension;
  }
  return nees;
}

}  // namespace truetriad::trials
