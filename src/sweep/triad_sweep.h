// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "sweep/sweep_choice.h"
#include "sweep/sweep_problem.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The calibration of one triad from a sweep.
class TriadSweep {
 public:
  TriadSweep(const PoseSet& poses, const CalibrateOptions& options, Triad triad, double reference);

  const SweepProblem& problem() const { return problem_; }
  Eigen::Vector2d range_degc() const;

  // Chooses and fits the terms of every axis; states the sensor, its quality, and its parameters in
  // the covariance. Error (bad input): the static calibration does not fit the recording.
  Status Run(Calibration* calibration);

  const std::vector<SweepChoice>& choices() const { return choices_; }

 private:
  void TakeTerms(int axis, TriadCalibration* sensor);
  void StateNoise(const Quality& quality, TriadCalibration* sensor) const;
  // Lists bias, sensitivity, temperature terms and lags with their covariance, zero if held fixed.
  void List(TriadCalibration* sensor, NamedCovariance* covariance) const;

  const CalibrateOptions& options_;
  Triad triad_;
  const PoseSet& poses_;
  SweepProblem problem_;
  std::vector<SweepChoice> choices_;
  // The terms of an axis, by their names in the covariance.
  struct ListedTerms {
    std::vector<std::string> names;
    Eigen::MatrixXd covariance;
  };
  std::vector<ListedTerms> listed_;
};

}  // namespace truetriad
