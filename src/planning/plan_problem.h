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

// The whitened rows of one pose; the pose's information is rows^T rows.
using InformationRows = Eigen::MatrixXd;

// A quantity whose σ is predicted.
struct PlanQuantity {
  std::string name, group, unit;
  double typical = 1.0;  // value whose effect is as large as the signal
};

// If σ / wanted σ is at most this, the wanted σ counts as reached. It is above 1 because of
// rounding: four poses, which halve σ, could just miss σ / 2.
inline constexpr double kReached = 1.0 + 1e-9;

// The estimator's graph for planned poses, linearised at exact readings of the nominal unit. All
// information is in scaled free coordinates.
class PlanProblem {
 public:
  // Error: a noise or a gain is not stated.
  static Result<PlanProblem> Create(const PoseSet& measured, const PlanOptions& options);

  // The information rows of each pose by itself. The information of turns between poses, which a
  // gyroscope measures, is contained only in Information().
  std::vector<InformationRows> Rows(const std::vector<ProgramPose>& poses) const;

  // The information of priors and measured poses.
  const Eigen::MatrixXd& known() const { return known_; }
  // Information of priors, measured poses, `poses` and the turns between `poses` in their order.
  Eigen::MatrixXd Information(const std::vector<ProgramPose>& poses) const;

  const std::vector<PlanQuantity>& quantities() const { return quantities_; }
  // Each quantity as a linear function of the scaled free coordinates.
  const Eigen::MatrixXd& quantity_rows() const { return quantity_rows_; }

  // σ of every quantity; infinite if it is not determined.
  Eigen::VectorXd Sigmas(const Eigen::MatrixXd& information) const;

  // The noise assumed for the mean of a planned pose, and the length of its rest in s (0: unknown).
  std::vector<PlannedNoise> Noise(const std::vector<ProgramPose>& poses) const;
  double RestSeconds() const;

  // The graph of the measured poses and the program, as the estimator would build it.
  PoseGraph GraphWith(const std::vector<ProgramPose>& poses) const;

  // The nominal unit in the wanted gauge, with the covariance that follows from `free_covariance`.
  PresentedSolution Present(const Eigen::MatrixXd& free_covariance) const;

  // The number of poses that the model needs beyond the measured ones; at least one.
  int LeastPoses() const;

  // Calibrates from exact readings in the measured poses and in `poses`. Error: fewer poses than
  // the model needs, or no usable calibration.
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

  // A copy of the measured set without poses and turns.
  PoseSet NoReadings() const;
  // `set` plus `poses` and the turns between them, with the nominal unit's readings.
  PoseSet WithReadings(PoseSet set, const std::vector<ProgramPose>& poses) const;
  // The graph of all poses of the set.
  PoseGraph GraphOf(const PoseSet& poses) const;
  double AttitudeSigma() const;

  CalibrateOptions& calibrate() { return options_.calibrate; }
  const CalibrateOptions& calibrate() const { return options_.calibrate; }

  PlanOptions options_;
  std::optional<Calibration> calibrated_;  // from the measured poses, if these suffice
  StartValues nominal_;
  PerTriad<NoiseSource> source_{};
  PerTriad<Eigen::Matrix3d> rest_covariance_;  // of a planned pose's mean, raw
  ExcessVariance excess_{};
  std::map<std::pair<int, Triad>, double> weights_;  // robust weights of measured poses
  PlannedTurns turns_;
  // False if no reading depends on the heading. A magnetometer's readings depend on it, even
  // without another sensor, because the field is not vertical.
  bool has_heading_ = true;
  PoseSet measured_;
  PoseGraph graph_;  // nodes of measured poses; layout and priors of all poses
  Eigen::VectorXd scale_;
  Eigen::MatrixXd known_;
  std::vector<PlanQuantity> quantities_;
  Eigen::MatrixXd quantity_rows_;
  Messages messages_;
};

// The poses that the options ask for, in the order in which they are to be taken. Error:
// PlanProblem::Create fails for the problem without the gyroscope.
Result<std::vector<ProgramPose>> FindPoses(const PoseSet& measured,
                                           const PlanOptions& options,
                                           const PlanProblem& problem);

// The fewest poses that reach the wanted σ of this group of quantities alone; unset if more than
// max_poses are needed. Must not be called for the groups of a gyroscope.
std::optional<int> FewestPoses(const PlanProblem& problem,
                               PlanOptions options,
                               const std::string& group);

}  // namespace truetriad
