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
  // Everything that the calibration says, turned into the body frame of the format; in the units of
  // the calibration.
  Calibration whole;
  // What the format holds of it, in the format's units. Each output_unit is that of the result.
  Calibration held;
  PerTriad<double> reading_per_raw;   // the format's reading units in one raw unit
  PerTriad<double> truth_per_result;  // true units in one unit of the consumer's result
  // The body frame of each sensor of `whole` in that of the calibration.
  PerTriad<Eigen::Matrix3d> rotation = {
      {Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity()}};
  // By how much a sensor is turned against the body frame where the format does not hold it.
  PerTriad<double> dropped_turn_deg = {};
  PerTriad<bool> is_turned = {};   ///< Export::is_turned.
  std::vector<std::string> notes;  // what was dropped or turned
  std::vector<std::string> warnings;
};

// Exact as far as the format allows: gauge and units are; what the format cannot hold is dropped:
//   bias order above the format's      cubic through Chebyshev points over the calibrated range
//   no temperature terms               values at options.temperature_degc
//   diagonal matrix                    diag(C)
//   symmetric matrix                   P of C = R P
//   no matrix                          offsets only
//   no axis terms                      nothing
// Errors (bad input): not usable, counts of unknown size into another unit, another unit into
// counts, a mirrored triad into a format that cannot mirror; (usage) options that do not fit.
Result<Restated> Restate(const Calibration& calibration,
                         const Format& format,
                         const ExportOptions& options);

// The sensor with its readings and its results in other axes: turn * both.
void TurnReadingsToo(const Eigen::Matrix3d& turn, TriadCalibration* sensor);

// The polynomial in x of degree `degree` through `function` at the Chebyshev points of [low, high],
// coefficients ascending. Range: low < high.
std::vector<double> ChebyshevFit(const std::function<double(double)>& function,
                                 double low,
                                 double high,
                                 int degree);

// What `equation` makes of the readings that `restated.whole` says a triad gives for truths on a
// sphere (gravity, the field's strength or pi rad/s in radius), over the calibrated temperatures,
// against those truths. `calibration` is the one before it was restated: its covariance tells how
// well it predicts itself. Terms in the rate of temperature that the format does not hold are in
// at_rates alone.
ExportLoss LossOf(Triad triad,
                  const Equation& equation,
                  const Restated& restated,
                  const Calibration& calibration);

// By how much a corrected reading is uncertain from the calibration's own covariance, by axis, true
// unit squared: the mean over a sphere of truths, at the reference temperature.
Eigen::Vector3d ReadingVariances(Triad triad, const Calibration& calibration);

}  // namespace truetriad
