// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// Statistics of a reading's error over all directions of the measured quantity; true unit and rad.
struct DirectionalError {
  double rms = 0.0, worst = 0.0;              ///< Length of the error: RMS and maximum.
  double angle_rms = 0.0, angle_worst = 0.0;  ///< Angle off the true direction; 0 if there is none.
};

/// The error of a unit's readings before their correction (scaled by the nominal gain only) and
/// after it.
struct CorrectedError {
  std::optional<DirectionalError> before;  ///< Unset for counts of unknown size.
  /// The error after the correction that the covariance of the parameters predicts (1 σ), without
  /// the noise of a reading.
  DirectionalError after;
};

/// The error of readings over all directions of a quantity of `magnitude` (true unit; 0: error of
/// the bias alone), at the reference temperature. If `has_bias` is false, the bias and its σ are
/// left out. The worst error is the largest in 1000 directions, less than 1 % below the true
/// maximum.
CorrectedError CorrectedErrorOf(const Calibration& calibration,
                                Triad triad,
                                double magnitude,
                                bool has_bias = true);

/// Joint covariance (12 n x 12 n) of n triads' parameters: for each triad the bias (raw) and the
/// columns of the sensitivity (raw per true unit). Rows and columns of fixed entries are zero.
Eigen::MatrixXd BiasAndSensitivityCovariance(const NamedCovariance& covariance,
                                             const std::vector<Triad>& triads);

/// The correction matrix of an uncalibrated unit: the nominal gain on the axes of `mounting`, body
/// <- raw, true unit per raw; nullopt for counts of unknown size.
std::optional<Eigen::Matrix3d> NominalCorrection(const TriadCalibration& sensor, Triad triad);

/// True units in one raw unit, by definition or as the recording states; nullopt for counts of
/// unknown size.
std::optional<double> NominalTruthPerRaw(const TriadCalibration& sensor, Triad triad);

/// How many of `unit` are one raw unit of the sensor. If `unit` is counts, one count is
/// `si_per_count` true units. Error (bad input): one of the two units is counts of unknown size.
Result<double> ReadingPerRaw(const TriadCalibration& sensor,
                             Triad triad,
                             const Unit& unit,
                             const std::optional<double>& si_per_count);

}  // namespace truetriad
