// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "base/messages.h"
#include "noise/components.h"
#include "planning/pose_order.h"
#include "problem/graph.h"
#include "problem/start_values.h"
#include "truetriad/base/result.h"
#include "truetriad/planning/plan.h"
#include "verdict/presentation.h"

namespace truetriad {

// The rows of one pose: its information is rows^T rows.
using InformationRows = Eigen::MatrixXd;

// A quantity whose σ is predicted.
struct PlanQuantity {
  std::string name, group, unit;
  double typical = 1.0;  // as large as the signal
};

// σ / wanted that counts as reached: rounding must not keep four poses of noise σ from σ / 2.
inline constexpr double kReached = 1.0 + 1e-9;

// The estimator's graph for poses to come, linearised at exact readings of the nominal unit. All
// information is in typical units of the free coordinates.
class PlanProblem {
 public:
  // Error: noise or gain that is not stated.
  static Result<PlanProblem> Create(const PoseSet& measured, const PlanOptions& options);

  // The rows of each pose by itself; only Information contains the turns between poses, which a
  // gyroscope measures.
  std::vector<InformationRows> Rows(const std::vector<ProgramPose>& poses) const;

  // The information of priors and measured poses.
  const Eigen::MatrixXd& known() const { return known_; }
  // That of these, of the program's poses and of the turns between them, in this order.
  Eigen::MatrixXd Information(const std::vector<ProgramPose>& poses) const;

  const std::vector<PlanQuantity>& quantities() const { return quantities_; }
  // Each as a linear function of the free coordinates.
  const Eigen::MatrixXd& quantity_rows() const { return quantity_rows_; }

  // σ of every quantity; infinite where it is not determined.
  Eigen::VectorXd Sigmas(const Eigen::MatrixXd& information) const;

  // The noise that is assumed for a planned pose's mean, and the length of its rest (0: not known).
  std::vector<PlannedNoise> Noise(const std::vector<ProgramPose>& poses) const;
  double RestSeconds() const;

  // The graph of the measured poses and the program, as the estimator would have it.
  PoseGraph GraphWith(const std::vector<ProgramPose>& poses) const;

  // The nominal unit in the wanted gauge, with the covariance of the free coordinates.
  PresentedSolution Present(const Eigen::MatrixXd& free_covariance) const;

  // How many poses the model needs beyond the measured; at least one.
  int LeastPoses() const;

  // Calibrates from these poses' exact readings. Error: fewer poses than the model needs, or no
  // usable calibration.
  Status Rehearse(const std::vector<ProgramPose>& poses) const;

  bool has_heading() const { return has_heading_; }
  bool has_gyroscope() const { return calibrate().triads[Triad::kGyroscope].enabled; }

  const PlannedTurns& turns() const { return turns_; }

  const Messages& messages() const { return messages_; }

 private:
  PlanProblem() = default;

  Status ChooseNominal();
  void ChooseReference();
  Status ChooseNoise();
  Status ChooseTurns();
  Status ChooseLayout();
  void FindQuantities();

  // The measured set without its poses and turns.
  PoseSet NoReadings() const;
  // `set`, with the nominal unit's readings in `poses` and in the turns between them.
  PoseSet WithReadings(PoseSet set, const std::vector<ProgramPose>& poses) const;
  // The graph of all poses of the set.
  PoseGraph GraphOf(const PoseSet& poses) const;
  double AttitudeSigma() const;

  CalibrateOptions& calibrate() { return options_.calibrate; }
  const CalibrateOptions& calibrate() const { return options_.calibrate; }

  PlanOptions options_;
  std::optional<Calibration> calibrated_;  // of the measured poses, if they are enough for one
  StartValues nominal_;
  PerTriad<NoiseSource> source_{};
  PerTriad<Eigen::Matrix3d> rest_covariance_;  // of a planned pose, raw
  ExcessVariance excess_{};
  std::map<std::pair<int, Triad>, double> weights_;  // robust ones of measured poses
  PlannedTurns turns_;
  // False: no reading depends on the heading. A magnetometer alone measures one direction too, but
  // the field is not vertical.
  bool has_heading_ = true;
  PoseSet measured_;
  PoseGraph graph_;  // measured poses; layout and priors of the whole
  Eigen::VectorXd scale_;
  Eigen::MatrixXd known_;
  std::vector<PlanQuantity> quantities_;
  Eigen::MatrixXd quantity_rows_;
  Messages messages_;
};

// The poses that the options ask for, in the order in which they are to be taken.
// Error: as PlanProblem::Create, of the problem without the gyroscope.
Result<std::vector<ProgramPose>> FindPoses(const PoseSet& measured,
                                           const PlanOptions& options,
                                           const PlanProblem& problem);

// The fewest poses that reach the wanted σ of this group alone; unset: more than max_poses. Not for
// a gyroscope.
std::optional<int> FewestPoses(const PlanProblem& problem,
                               PlanOptions options,
                               const std::string& group);

}  // namespace truetriad
