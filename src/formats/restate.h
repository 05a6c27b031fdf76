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
  // The whole calibration, in the body frame of the format and in the calibration's own units.
  Calibration whole;
  // The part that the format can hold, in the format's units. Each output_unit is the unit of the
  // target's result.
  Calibration held;
  PerTriad<double> reading_per_raw;   // the format's reading units in one raw unit
  PerTriad<double> truth_per_result;  // true units in one unit of the target's result
  // For each sensor: the rotation from the body frame of `whole` to that of the original.
  PerTriad<Eigen::Matrix3d> rotation = {
      {Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity()}};
  // The angle between a sensor's axes and the body frame, if the format cannot hold it.
  PerTriad<double> dropped_turn_deg = {};
  PerTriad<bool> is_turned = {};   ///< Export::is_turned.
  std::vector<std::string> notes;  // what was dropped or turned
  std::vector<std::string> warnings;
};

// Converts gauge and units exactly. If the format has one of the limits on the left, the
// calibration is reduced as stated on the right:
//   lower order of the bias            polynomial through Chebyshev points of the calibrated range
//   no temperature terms               values at options.temperature_degc
//   diagonal matrix                    diag(C)
//   symmetric matrix                   P, where C = R P and R is a rotation
//   no matrix                          offsets only
//   no axis terms                      axis terms are dropped
// Errors (bad input): the calibration is not usable; the format supports none of its sensors;
// counts of unknown size would need another unit, or another unit counts; the format cannot hold
// mirrored or swapped axes. Error (usage): an option does not fit the format or the calibration.
Result<Restated> Restate(const Calibration& calibration,
                         const Format& format,
                         const ExportOptions& options);

// Rotates a sensor's readings and its results by the same rotation: both are multiplied by `turn`.
void TurnReadingsToo(const Eigen::Matrix3d& turn, TriadCalibration* sensor);

// The polynomial of degree `degree` in x that equals `function` at the Chebyshev points of [low,
// high]. Returns its coefficients, ascending. Range: low < high.
std::vector<double> ChebyshevFit(const std::function<double(double)>& function,
                                 double low,
                                 double high,
                                 int degree);

// By how much the results of `equation` differ from the truth: true vectors on a sphere (its radius
// is gravity, field strength or pi rad/s), at the calibrated temperatures. `restated.whole`
// predicts the readings for these vectors. `calibration` is the original; its covariance gives the
// σ of each corrected reading. If the format drops terms in the rate of temperature, only at_rates
// contains their effect.
ExportLoss LossOf(Triad triad,
                  const Equation& equation,
                  const Restated& restated,
                  const Calibration& calibration);

// Variances of a corrected reading by axis, from the calibration's covariance, true unit squared.
// Each is a mean over a sphere of truths at the reference temperature.
Eigen::Vector3d ReadingVariances(Triad triad, const Calibration& calibration);

}  // namespace truetriad
