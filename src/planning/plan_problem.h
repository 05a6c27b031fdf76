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

// What one pose says: its information is rows^T rows.
using InformationRows = Eigen::MatrixXd;

// A quantity whose σ is predicted.
struct PlanQuantity {
  std::string name, group, unit;
  double typical = 1.0;  // as large as the signal
};

// σ / wanted that counts as reached: four poses of noise σ make σ / 2 but for the rounding.
inline constexpr double kReached = 1.0 + 1e-9;

// The estimator's graph for poses that nobody has taken yet: exact readings of the nominal unit,
// linearised there. All information is in typical units of the free coordinates.
class PlanProblem {
 public:
  // Error: noise or gain that is not stated.
  static Result<PlanProblem> Create(const PoseSet& measured, const PlanOptions& options);

  // What each pose says by itself. Without a gyroscope that is all; what the turns between poses
  // say, Information has.
  std::vector<InformationRows> Rows(const std::vector<ProgramPose>& poses) const;

  // What priors and measured poses say.
  const Eigen::MatrixXd& known() const { return known_; }
  // What these, the program's poses and the turns between them say, in this order.
  Eigen::MatrixXd Information(const std::vector<ProgramPose>& poses) const;

  const std::vector<PlanQuantity>& quantities() const { return quantities_; }
  // Each as a linear function of the free coordinates.
  const Eigen::MatrixXd& quantity_rows() const { return quantity_rows_; }

  // σ of every quantity; infinite where it is not determined.
  Eigen::VectorXd Sigmas(const Eigen::MatrixXd& information) const;

  // What is taken for the noise of a planned pose's mean, and for how long it is to rest (0: not
  // known).
  std::vector<PlannedNoise> Noise(const std::vector<ProgramPose>& poses) const;
  double RestSeconds() const;

  // The graph of the measured poses and the program, as the estimator would have it.
  PoseGraph GraphWith(const std::vector<ProgramPose>& poses) const;

  // The nominal unit in the wanted gauge, with the covariance of the free coordinates.
  PresentedSolution Present(const Eigen::MatrixXd& free_covariance) const;

  // How many poses the model needs beyond the measured; at least one.
  int LeastPoses() const;

  // Calibrates from these poses' exact readings. Error: fewer poses than the model needs, or the
  // estimator does not find its way.
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

  // What is measured, without its poses and turns.
  PoseSet NoReadings() const;
  // `set`, and what the nominal unit would read in `poses` and from one to the next.
  PoseSet WithReadings(PoseSet set, const std::vector<ProgramPose>& poses) const;
  // Of all poses of the set.
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
  // False: what the unit reads is the same whichever way it faces. A magnetometer alone sees one
  // direction too, but that is the field's, which is not vertical.
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

// Poses that would do if σ of this group were all that is wanted; unset: more than max_poses. Not
// of a gyroscope.
std::optional<int> FewestPoses(const PlanProblem& problem,
                               PlanOptions options,
                               const std::string& group);

}  // namespace truetriad
