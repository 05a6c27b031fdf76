// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// The error of readings over all directions of the measured quantity, true unit and rad.
struct DirectionalError {
  double rms = 0.0, worst = 0.0;              ///< Length of the error; worst: of any direction.
  double angle_rms = 0.0, angle_worst = 0.0;  ///< Angle off the true direction; 0 for magnitude 0.
};

/// The error of a unit's readings before correction, in nominal units, and after it.
struct CorrectedError {
  std::optional<DirectionalError> before;  ///< Unset for counts of unknown size.
  /// σ that the parameters' covariance predicts; the noise of a reading is not included.
  DirectionalError after;
};

/// The error of readings of a quantity of `magnitude` (true unit; 0: the bias alone) over all
/// directions, at the reference temperature. Without `has_bias` the bias and its σ are left out.
/// The worst is that of 1000 even directions, which is below the true maximum by less than 1 %.
CorrectedError CorrectedErrorOf(const Calibration& calibration,
                                Triad triad,
                                double magnitude,
                                bool has_bias = true);

/// The covariance, 12 n x 12 n, of each of n triads' bias (raw) and sensitivity columns (raw per
/// true unit); zero where an entry is fixed.
Eigen::MatrixXd BiasAndSensitivityCovariance(const NamedCovariance& covariance,
                                             const std::vector<Triad>& triads);

/// The correction of a unit without a calibration: the nominal gain along the nominal axes,
/// body <- raw, true unit per raw; nullopt for counts of unknown size.
std::optional<Eigen::Matrix3d> NominalCorrection(const TriadCalibration& sensor, Triad triad);

/// True units in one raw unit, by definition or as the recording states it; nullopt for counts.
std::optional<double> NominalTruthPerRaw(const TriadCalibration& sensor, Triad triad);

/// The size of one raw unit of the sensor in `unit`, of which a count is `si_per_count` true units.
/// Error (bad input): one of the two units is counts of unknown size.
Result<double> ReadingPerRaw(const TriadCalibration& sensor,
                             Triad triad,
                             const Unit& unit,
                             const std::optional<double>& si_per_count);

}  // namespace truetriad
