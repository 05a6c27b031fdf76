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

// A fault that is known beforehand to be zero, or a mean, but for a σ: it is in the model from the
// start and never a finding: bends that a data sheet allows, and face curvatures.
struct StatedFault {
  FaultColumn column;
  Eigen::VectorXd sigma;
  Eigen::VectorXd mean = {};  // empty: zero
};

// A kind at its place: poses by their numbers, of a window the last one too; 0: the whole run.
struct FaultPlace {
  const FaultKind* kind = nullptr;
  Triad triad = Triad::kAccelerometer;
  int first_pose = 0;
  int last_pose = 0;
};

// One that chance does not make, and that is in the model now if a correction leads anywhere.
struct TakenFault {
  // Above it a parameter moves by more of its σ than h by its own: the form, and not the readings,
  // then decides the correction.
  static constexpr double kTrusted = 1.0;
  bool is_trusted() const { return is_corrected && kappa <= kTrusted && !place.kind->is_truncated; }

  FaultPlace place;
  bool is_corrected = true;  // else σ alone allow for it
  double log_p = 0.0;
  Eigen::VectorXd h;  // all unknowns; FaultForm says of what
  Eigen::VectorXd sigma;
  double shift_sigmas = 0.0;  // of the parameter that it moved the furthest
  double kappa = 0.0;         // the same for h of one of its own σ
  // Others that explain the same nearly as well: 1000 to 1 is no proof.
  std::vector<FaultPlace> rivals;
  // Poses that are off explain it nearly as well: they stay left out, and it is not corrected.
  std::vector<int> left_out_instead;
};

// One that is there throughout or not at all, and was not taken in: said, no more.
struct FaultNote {
  FaultPlace place;
  double log_p = 0.0;
  double kappa = 0.0;
  // Neither shown nor to be ruled out, and moving much: p below 1 % and κ above 1.
  bool is_doubtful = false;
};

// Rows that the log lost while the unit was turned scatter the turns along what they turn by: a
// share s of all makes a variance component s (1 - s) Σ (ω dt)(ω dt)^T.
struct LostRowsFound {
  double share = 0.0;
  double log_p = 0.0;
};

// χ² against the noise at rest alone says this when all is done.
struct OverallMisfit {
  double excess_ratio = 0.0;  // largest σ of an excess over that at rest
  // p < 1e-6, an excess above three times the noise at rest, and no fault that explains it.
  bool is_unexplained = false;
  bool has_more_faults = false;  // than the eight that were taken in
  // And it is not white: something that is none of the faults shows in it. What poses share does
  // not average out, so that the σ that it makes count it whole.
  bool is_systematic = false;
};

struct FaultFindings {
  std::vector<TakenFault> faults;
  std::vector<FaultNote> notes;  // doubtful ones, and all bends of an axis
  std::optional<LostRowsFound> lost_rows;
  OverallMisfit misfit;
  // What the graph's free coordinates are less certain by than the graph alone says: by the faults'
  // own σ, the spread of what was not constant, and d d^T of corrections that are not to be
  // trusted.
  Eigen::MatrixXd beyond;
  // Of each that was stated: how many times larger it makes the σ that it makes the largest.
  std::vector<double> widening;
  int looked_for = 0;  // faults that the poses show at all, lost rows among them
};

// Looks for all declared faults in a solved graph, takes in those that are there, and leaves the
// graph at its solution with them: its readings are less what the faults added to them, and
// `noise` is what it is then. One budget of 1 % a run is shared by all faults, and a
// fault's share by its positions. Without faults the graph stays as it is. Where readings were left
// out as outliers, they count again if faults are by 1000 to 1 the likelier explanation of all;
// from 1 to 1000 on σ allow for these.
FaultFindings FindFaults(const std::vector<StatedFault>& stated,
                         PoseGraph* graph,
                         NoiseState* noise);

}  // namespace truetriad
