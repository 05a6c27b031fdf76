// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "problem/parameter_name.h"
#include "truetriad/base/result.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// Probability that a good calibration counts as worse than predicted, or that two equally good ones
// count as different.
inline constexpr double kByChance = 1e-3;

// A sensor's model at a temperature that is clamped to the calibrated range, and the quantities on
// which the factors of its terms depend.
struct ModelAtPose {
  TriadModel<double> model;
  Eigen::Vector3d tau_degc = Eigen::Vector3d::Zero();  // temperature minus reference, per axis
  Eigen::Vector3d rate_degcps = Eigen::Vector3d::Zero();
  bool is_clamped = false;

  // The factor of a named term in the bias or sensitivity at the pose: a power of τ, or the factor
  // of a rate term.
  double FactorOf(const ParameterName& name) const;
};
ModelAtPose ModelAtTemperatureOf(const TriadCalibration& sensor, const ThermalState& state);

// The names of a covariance's parameters, in their order; an entry is unset if the parameter
// belongs to another triad.
using NamesOfTriad = std::vector<std::optional<ParameterName>>;
NamesOfTriad NamesOf(const NamedCovariance& covariance, Triad triad);

// The derivatives of the truth by these parameters: dx = -C D^-1 (D dS x + f(u) da + db + dG
// force), u = S x, with D the slope of the readings by u.
Eigen::Matrix3Xd TruthByParameters(const NamesOfTriad& names,
                                   const ModelAtPose& at,
                                   const Eigen::Vector3d& truth,
                                   const Eigen::Vector3d& force_mps2);

// The temperature of each axis at the windows of a sweep, one per pose, filtered as `apply` does;
// empty if the calibration has no lags. Error (bad input): the calibration has lags, but `poses`
// have no temperature track.
Result<std::vector<ThermalState>> FeltAtPoses(const TriadCalibration& sensor, const PoseSet& poses);

// One sensor's mean at one pose in true units, with the parts of its error.
struct EvaluatedReading {
  Eigen::Vector3d truth = Eigen::Vector3d::Zero();
  // Covariance of the mean's noise and the pose-to-pose excess.
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
  // The derivatives of the truth by the parameters that the covariance lists.
  Eigen::Matrix3Xd by_parameters;
  bool is_clamped = false;

  // The covariance of `truth` from noise and parameters together.
  Eigen::Matrix3d Covariance(const Calibration& calibration) const;
};

// `felt`: the filtered temperatures at the pose; if null, the pose's own temperature is used.
// `force_mps2`: specific force in the body, for a gyroscope with g-sensitivity. Unset if the pose
// has no reading of the sensor, or the force is needed but missing.
Result<std::optional<EvaluatedReading>> EvaluateReading(
    const Calibration& calibration,
    Triad triad,
    const StaticPose& pose,
    const ThermalState* felt,
    const std::optional<Eigen::Vector3d>& force_mps2,
    const std::string& source);

// The RMS of the errors, of which there must be at least one.
double RootMeanSquareOf(const std::vector<double>& errors);

// Predicts gravity at each rest from gravity at the previous rest and the turn between both.
// Without an accelerometer in the calibration, the field is predicted. `vectors`: the calibrated
// accelerometer, or magnetometer, at each pose of `poses`. `left_out`: numbers of the poses; a turn
// into one of these poses is left out. Unset without a gyroscope, or without a turn between two
// poses that have such vectors.
//
// An error lies in the plane across gravity. Its predicted variance sums the noise of both
// accelerometer means and of the gyroscope's readings, the excess of turns, and the parameters of
// both sensors with their correlation.
std::optional<EvaluatedTurns> EvaluateTurns(
    const Calibration& calibration,
    const PoseSet& poses,
    const std::vector<std::optional<EvaluatedReading>>& vectors,
    const std::set<int>& left_out);

// Numbers of the poses that are left out of each sensor's evaluation.
using PosesLeftOut = PerTriad<std::set<int>>;

// Lists what the calibration left out of the poses that it was made from. The list is empty if
// `poses` are others, or if their number differs.
PosesLeftOut LeftOut(const Calibration& calibration, const PoseSet& poses, bool is_own);

Result<EvaluationSummary> EvaluateWithout(const PosesLeftOut& left_out,
                                          const Calibration& calibration,
                                          const PoseSet& poses,
                                          bool is_own,
                                          const CountSizes& si_per_count);

}  // namespace truetriad
