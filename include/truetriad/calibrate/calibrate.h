// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/triad_model.h"
#include "truetriad/problem/options.h"
#include "truetriad/verdict/summary.h"

namespace ceres {
class Problem;
}

namespace truetriad {

/// Estimates all parameters that `options` asks for from the poses. Errors (usage or bad input):
/// options that contradict each other or the poses. Too little data is not an error but an outcome.
Result<CalibrationSummary> Calibrate(const PoseSet& poses, const CalibrateOptions& options);

/// A calibration from rests as an ordinary ceres::Problem, to which you can add what you know:
///
///   problem->ceres_problem().AddResidualBlock(yours, nullptr, problem->Attitude(0), ...);
///   ceres::Solve(options, &problem->ceres_problem(), &summary);
///   problem->Model(Triad::kAccelerometer);
///
/// Residuals are whitened (unit variance); yours should be, too. The problem starts at the solution
/// without your addition. Its outliers have lost their weight and its noise is estimated; both do
/// not change any more. See examples/known_angle.cc.
class PoseProblem {
 public:
  /// Calibrates as Calibrate does. Errors: as Calibrate; "not enough" if the calibration is not
  /// usable, or if the options ask for a motion, a sweep, a choice of the model or only start
  /// values.
  static Result<PoseProblem> Create(const PoseSet& poses, const CalibrateOptions& options);

  PoseProblem(PoseProblem&&) noexcept;
  PoseProblem& operator=(PoseProblem&&) noexcept;
  ~PoseProblem();

  ceres::Problem& ceres_problem();

  /// Parameter blocks of the problem; null if the problem has no such block.
  double* Bias(Triad triad);         ///< 3, raw unit.
  double* Sensitivity(Triad triad);  ///< 9, raw per true unit, column by column.
  /// Attitude at PoseSet::poses[pose]: quaternion x y z w, world <- body. Also null if only one
  /// vector sensor has readings of the pose: they show a direction but no attitude.
  double* Attitude(std::size_t pose);

  /// The triad's model according to the present values of the blocks, in the frame of the solution
  /// (gauge accel-x, or the fixture's), at the reference temperature. Range: a triad that is
  /// calibrated.
  TriadModel<double> Model(Triad triad) const;

 private:
  struct State;
  explicit PoseProblem(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace truetriad
