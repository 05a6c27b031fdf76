// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "formats/format.h"
#include "truetriad/base/result.h"
#include "truetriad/formats/export.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// A calibration as a format can hold it.
struct Restated {
  // The whole calibration in the body frame of the format and the units of the calibration.
  Calibration whole;
  // The part that the format can hold, in its units. Each output_unit is that of the result.
  Calibration held;
  PerTriad<double> reading_per_raw;   // the format's reading units in one raw unit
  PerTriad<double> truth_per_result;  // true units in one unit of the consumer's result
  // For each sensor the rotation from the body frame of `whole` to that of the calibration.
  PerTriad<Eigen::Matrix3d> rotation = {
      {Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity()}};
  // The angle between a sensor's axes and the body frame, if the format cannot hold it.
  PerTriad<double> dropped_turn_deg = {};
  PerTriad<bool> is_turned = {};   ///< Export::is_turned.
  std::vector<std::string> notes;  // what was dropped or turned
  std::vector<std::string> warnings;
};

// Gauge and units are restated exactly; what the format cannot hold (left) is replaced (right):
//   bias order above the format's      cubic through Chebyshev points over the calibrated range
//   no temperature terms               values at options.temperature_degc
//   diagonal matrix                    diag(C)
//   symmetric matrix                   P of C = R P
//   no matrix                          offsets only
//   no axis terms                      nothing
// Errors (bad input): a calibration that is not usable, counts of unknown size into another unit,
// another unit into counts, a mirrored triad into a format that cannot mirror; (usage) options that
// do not fit.
Result<Restated> Restate(const Calibration& calibration,
                         const Format& format,
                         const ExportOptions& options);

// Rotates the axes of a sensor's readings and of its results: `turn` times both.
void TurnReadingsToo(const Eigen::Matrix3d& turn, TriadCalibration* sensor);

// The polynomial in x of degree `degree` through `function` at the Chebyshev points of [low, high],
// coefficients ascending. Range: low < high.
std::vector<double> ChebyshevFit(const std::function<double(double)>& function,
                                 double low,
                                 double high,
                                 int degree);

// The errors of `equation` for the readings that `restated.whole` predicts for truths on a sphere
// (of radius gravity, field strength or pi rad/s) over the calibrated temperatures. `calibration`
// is the one before it was restated; its covariance gives the σ of its own predictions. Terms in
// the rate of temperature that the format does not hold enter at_rates alone.
ExportLoss LossOf(Triad triad,
                  const Equation& equation,
                  const Restated& restated,
                  const Calibration& calibration);

// Variances of a corrected reading by axis from the calibration's covariance, true unit squared:
// the mean over a sphere of truths at the reference temperature.
Eigen::Vector3d ReadingVariances(Triad triad, const Calibration& calibration);

}  // namespace truetriad
