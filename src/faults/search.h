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

// A kind of fault and its place: the number of its first pose, and for a window of its last pose;
// 0: the whole run.
struct FaultPlace {
  const FaultKind* kind = nullptr;
  Triad triad = Triad::kAccelerometer;
  int first_pose = 0;
  int last_pose = 0;
};

// A significant fault. It is in the model if `is_corrected`.
struct TakenFault {
  // Above this κ, one σ of h shifts some parameter by more than that parameter's σ: the fault's
  // form, not the readings, then determines the correction.
  static constexpr double kTrusted = 1.0;
  bool is_trusted() const { return is_corrected && kappa <= kTrusted && !place.kind->is_truncated; }

  FaultPlace place;
  bool is_corrected = true;  // if not, only the σ include it
  double log_p = 0.0;
  Eigen::VectorXd h;  // of all unknowns; FaultForm states their meaning
  Eigen::VectorXd sigma;
  double shift_sigmas = 0.0;  // largest shift of a parameter by h, in its σ
  double kappa = 0.0;         // largest shift of a parameter by one σ of h
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

// Rows that the log lost during turns. The measured turn then scatters along its angle: if a share
// s of all rows is lost, with the variance s (1 - s) Σ (ω dt)(ω dt)^T.
struct LostRowsFound {
  double share = 0.0;
  double log_p = 0.0;
};

// The final test of χ² with the noise at rest alone.
struct OverallMisfit {
  double excess_ratio = 0.0;  // largest ratio of an excess's σ to the σ at rest
  // p < 1e-6, an excess above three times the noise at rest, and no fault that explains it.
  bool is_unexplained = false;
  bool has_more_faults = false;  // more significant faults than the eight accepted ones
  // The residuals are not white: they contain some unknown effect. What poses have in common does
  // not average out, so that σ include it in full.
  bool is_systematic = false;
};

struct FaultFindings {
  std::vector<TakenFault> faults;
  std::vector<FaultNote> notes;  // doubtful faults, and all nonlinearities of an axis
  std::optional<LostRowsFound> lost_rows;
  OverallMisfit misfit;
  // What faults add to the covariance of the graph's free coordinates: by the faults' σ, by the
  // spread of varying values, and d d^T for each shift d by an untrusted correction.
  Eigen::MatrixXd beyond;
  // For each stated fault: the largest factor by which it widens the σ of a parameter.
  std::vector<double> widening;
  int looked_for = 0;  // number of tests: faults that the poses determine, and lost rows
};

// Tests all kinds of FaultKinds() in a solved graph and adds the significant faults to the model.
// The graph is left at its solution with them: its readings are corrected for the faults, and
// `noise` is that of the result. Without faults the graph does not change. The significance level
// of 1 % per run is divided among all faults, and a fault's part among its positions. If faults
// make all readings over 1000 times more likely than rejected outliers do, the outliers return; if
// the odds are between 1000 and 1 / 1000, outliers stay rejected and σ include the faults.
// `system`: of the graph, before and after.
FaultFindings FindFaults(const std::vector<StatedFault>& stated,
                         PoseGraph* graph,
                         NoiseState* noise,
                         ReducedSystem* system);

}  // namespace truetriad
