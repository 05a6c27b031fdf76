// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "faults/kinds.h"
#include "noise/noise_settling.h"
#include "problem/graph.h"

namespace truetriad {

// A fault that is in the model from the start and never becomes a finding: nonlinearities stated by
// a data sheet, and face curvatures. Its unknowns have a prior mean and σ.
struct StatedFault {
  FaultColumn column;
  Eigen::VectorXd sigma;
  Eigen::VectorXd mean = {};  // empty: zero
};

// A kind of fault and its place. `first_pose` and `last_pose` are numbers of poses; `last_pose` is
// set only for windows. Both are 0 if the fault is in the whole run.
struct FaultPlace {
  const FaultKind* kind = nullptr;
  Triad triad = Triad::kAccelerometer;
  int first_pose = 0;
  int last_pose = 0;
};

// A significant fault. It is in the model if `is_corrected`.
struct TakenFault {
  // If κ is larger, one σ of h shifts some parameter by more than that parameter's σ: the assumed
  // form of the fault, not the readings, then determines the correction.
  static constexpr double kTrusted = 1.0;
  bool is_trusted() const { return is_corrected && kappa <= kTrusted && !place.kind->is_truncated; }

  FaultPlace place;
  bool is_corrected = true;  // if not, only the σ of parameters include it
  double log_p = 0.0;
  Eigen::VectorXd h;  // of all unknowns; FaultForm states their meaning
  Eigen::VectorXd sigma;
  double shift_sigmas = 0.0;  // largest shift of a parameter by h, in σ of the parameter
  double kappa = 0.0;         // κ: the same for one σ of h instead of h
  // Faults that explain the readings nearly as well: at most 1000 times less likely.
  std::vector<FaultPlace> rivals;
  // Poses whose rejection explains the readings nearly as well: they stay rejected, and h is stated
  // but not corrected.
  std::vector<int> left_out_instead;
};

// A fault over the whole run that was not accepted: it is only reported.
struct FaultNote {
  FaultPlace place;
  double log_p = 0.0;
  double kappa = 0.0;
  // Neither significant nor excluded, and with a large effect: p below 1 % and κ above 1.
  bool is_doubtful = false;
};

// Rows that the log lost during turns. If a share s of all rows is lost, measured turns scatter
// along their angle with the variance s (1 - s) Σ (ω dt)(ω dt)^T.
struct LostRowsFound {
  double share = 0.0;
  double log_p = 0.0;
};

// The final test: whether the noise at rest alone explains the χ² of the corrected readings.
struct OverallMisfit {
  double excess_ratio = 0.0;  // largest ratio of an excess's σ to the σ at rest
  // p < 1e-6, the σ of an excess is above three times the σ at rest, and no fault explains this.
  bool is_unexplained = false;
  bool has_more_faults = false;  // more faults are significant than the eight accepted
  // The residuals are not white, so that some unknown effect is in them. An effect that poses have
  // in common does not average out: the σ of parameters include all of it.
  bool is_systematic = false;
};

struct FaultFindings {
  std::vector<TakenFault> faults;
  std::vector<FaultNote> notes;  // doubtful faults, and all nonlinearities that were not accepted
  std::optional<LostRowsFound> lost_rows;
  OverallMisfit misfit;
  // What faults add to the covariance of the graph's free coordinates: the part due to the faults'
  // own σ, the spread of values that vary, and d d^T for each possible shift d (by an untrusted
  // correction, a rival or lost rows).
  Eigen::MatrixXd beyond;
  // For each stated fault: the largest factor by which it widens the σ of a parameter.
  std::vector<double> widening;
  int looked_for = 0;  // number of tests: faults that the poses determine, and lost rows
};

// Tests all kinds of FaultKinds() in a solved graph and adds the significant faults to the model.
// On return, the graph is at its solution with them: its readings are corrected for the faults, and
// `noise` is that of the result. If no fault is found, the graph does not change. The significance
// level of 1 % per run is divided equally among all faults, and the part of a fault among its
// positions. If readings were rejected as outliers, faults may explain them instead: if the model
// with faults is over 1000 times more likely, the outliers are readmitted; if the odds are between
// 1000 and 1 / 1000, outliers stay rejected, and the σ of parameters include the faults. `system`:
// the linear system of `graph`; it follows the changes of `graph`.
FaultFindings FindFaults(const std::vector<StatedFault>& stated,
                         PoseGraph* graph,
                         NoiseState* noise,
                         ReducedSystem* system);

}  // namespace truetriad
