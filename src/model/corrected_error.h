// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// An error of readings over all directions of what is measured, true unit and rad.
struct DirectionalError {
  double rms = 0.0, worst = 0.0;              ///< Length of the error; the worst direction's.
  double angle_rms = 0.0, angle_worst = 0.0;  ///< Of the direction that is read; 0 without length.
};

/// What a unit's readings are off by, raw in nominal units, and corrected.
struct CorrectedError {
  std::optional<DirectionalError> before;  ///< Unset for counts of unknown size.
  /// σ that the parameters' covariance predicts; a reading's own noise comes on top.
  DirectionalError after;
};

/// Readings of a quantity of `magnitude` (true unit; 0: the bias alone), in whichever direction it
/// lies, at the reference temperature. Without `has_bias` the bias is left out on both sides. The
/// worst is over 1000 even directions, below the true one by less than 1 %.
CorrectedError CorrectedErrorOf(const Calibration& calibration,
                                Triad triad,
                                double magnitude,
                                bool has_bias = true);

/// 12 n x 12 n: of each triad the bias (raw) and the columns of the sensitivity (raw per true
/// unit); zero where an entry is fixed.
Eigen::MatrixXd BiasAndSensitivityCovariance(const NamedCovariance& covariance,
                                             const std::vector<Triad>& triads);

/// What a unit without a calibration takes for its correction: the nominal gain along the nominal
/// axes, body <- raw, true unit per raw; nullopt for counts of unknown size.
std::optional<Eigen::Matrix3d> NominalCorrection(const TriadCalibration& sensor, Triad triad);

/// True units in one raw unit by the unit's definition or the recording's word; nullopt for counts.
std::optional<double> NominalTruthPerRaw(const TriadCalibration& sensor, Triad triad);

/// Readings in `unit`, a count of which is `si_per_count` true units, in one raw unit of the
/// sensor. Error (bad input): one of both is in counts of unknown size.
Result<double> ReadingPerRaw(const TriadCalibration& sensor,
                             Triad triad,
                             const Unit& unit,
                             const std::optional<double>& si_per_count);

}  // namespace truetriad
