// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "faults/fault_system.h"
#include "problem/graph.h"
#include "truetriad/base/triad.h"

namespace truetriad {

// A form is the matrix that, times the unknowns h of a fault, gives the change of a sensor's
// readings. x is the true vector in the body, S the sensitivity matrix, u = S x, R the attitude; f
// and m are the unit vectors of force and field, ω and α angular rate and acceleration. u^2, u^3
// and |u| are divided by that power of the run's largest |u|, so that h is the change at this |u|,
// in raw units.
enum class FaultForm {
  kBias,        // I
  kGain,        // diag(u)                       h relative
  kMatrix,      // I ⊗ x^T                       h relative to the gains, 9 entries
  kTurned,      // S [x]x                        h rad: rotation of the chip
  kWorld,       // S R^T                         h true units: a vector added in the world
  kSquare,      // diag(u^2)
  kCube,        // diag(u^3)
  kSize,        // diag(|u|)
  kGainByRate,  // diag(u |ω|), along turns
  kByForce,     // I ⊗ f^T                       h at 1 g
  kByField,     // I ⊗ m^T                       h at the field's strength
  kByAttitude,  // S R^T ⊗ f^T                   h true units
  kPlay,        // diag(sign of the change of u before the rest)
  kSettling,    // u of the previous pose - u    h: share that is not settled
  kStill,       // I for readings within half a resolution step of the bias, else 0
  kReading,     // I for poses only, not for turns
  kTurn,        // I for turns only              h rad
  kShortTurn,   // unit vector of the turn       h rad: added to its angle
  kLowPass,     // 1/2 d^2 u / dt^2 at moments   h s^2: time constant squared; without the delay
  kLeverArm,    // S ([α]x + [ω]x^2)             h m: from the centre of rotation to the sensor
};
// The number of values of FaultForm.
inline constexpr std::size_t kFaultForms = static_cast<std::size_t>(FaultForm::kLeverArm) + 1;

// How a fault of each form changes a turn: Σ K_i e_i, summed over the turn's readings i, where e_i
// is the reading's error for h = 1. K_i = dt_i dR^T R_i C, with the whole rotation dR, the rotation
// R_i from the turn's begin to reading i, and the matrix C that corrects readings.
struct TurnColumns {
  std::array<Eigen::MatrixXd, kFaultForms> of;          // by form; empty if a turn cannot have it
  Eigen::Vector3d last_rate = Eigen::Vector3d::Zero();  // rate before the turn stops, rad/s
  double fastest = 0.0;                                 // largest rate, rad/s
  // Σ (ω dt)(ω dt)^T over the readings, in the body frame at the end of the turn.
  Eigen::Matrix3d squared_steps = Eigen::Matrix3d::Zero();
};

// Computes the columns of faults, which are the derivatives of a graph's predictions with respect
// to the unknowns of a fault. They hold at the state that the graph had when the scene was made.
class FaultScene {
 public:
  // The largest number of groups of poses; a scan of 64 groups tests 1426 windows. If there are
  // more than 64 poses, a group contains several.
  static constexpr std::size_t kMostStretches = 64;

  explicit FaultScene(const PoseGraph& graph);

  // Number of groups of consecutive poses; a scan tests a fault at one group after another. Each of
  // up to 64 poses is a group of its own.
  std::size_t stretches() const { return stretch_begin_.size() - 1; }
  std::size_t poses() const { return nodes_.size(); }
  std::size_t FirstPose(std::size_t stretch) const { return stretch_begin_[stretch]; }
  double PosesIn(std::size_t stretch) const {
    return static_cast<double>(stretch_begin_[stretch + 1] - stretch_begin_[stretch]);
  }
  // Means of each group. tau: time, from -1 to 1 over the run; temperature: unset if constant.
  const Eigen::VectorXd& tau() const { return tau_; }
  const std::optional<Eigen::VectorXd>& temperature() const { return temperature_; }

  // The largest |u| of a sensor (see FaultForm), raw unit.
  double largest(Triad triad) const { return largest_[triad]; }

  // The columns of a form, one per group; their sum is the column of the whole run. A turn belongs
  // half to the group in which it begins and half to that in which it ends; with kTurn, wholly to
  // the former. If no pose or turn can have the form, the result is empty. If all values of a
  // column are zero, it has no blocks.
  std::vector<FaultColumn> ColumnsOf(Triad triad, FaultForm form) const;

  // Of all turns, in the graph's order. If a turn's angle is stated, its `squared_steps` are zero.
  const std::vector<TurnColumns>& turns() const;

 private:
  struct Seen {
    bool is_there = false;
    Eigen::Index row = 0;
    Eigen::Vector3d x, u;
    Eigen::Matrix3d S;
    Eigen::Matrix3d turn;  // from the pose's body frame to that during the readings
  };
  // The body's angular rate and acceleration at a moment where two turns meet, in the body frame,
  // rad/s and rad/s^2. If the gyroscope's noise dominates the accelerations of the run, all of them
  // are zero; columns then contain only the part that the rate determines.
  struct Swing {
    Eigen::Vector3d rate, acceleration;
  };
  struct Node {
    PerTriad<Seen> seen;
    bool has_attitude = false;
    bool is_moment = false;  // a moment of motion, not a rest
    std::optional<Swing> swing;
    Eigen::Matrix3d body_from_world;
    Eigen::Vector3d up, field;  // unit vectors in the body
  };

  // Half the integral of the rate's second derivative over a turn. The noise of `value` has
  // `of_variance` times the variance of a mean rate over one span (see apart_).
  struct RateBend {
    Eigen::Vector3d value;
    double of_variance = 0.0;
  };

  void PlaceNodes();
  void PlaceTurns();
  void SumTurns() const;
  void PlaceSwings();
  void PlaceStretches();
  TurnColumns SumsOf(const IncrementEdge& edge) const;
  void StateInRows(const IncrementEdge& edge, TurnColumns* sums) const;
  std::optional<Eigen::Vector3d> RateOver(std::ptrdiff_t begin, std::ptrdiff_t end) const;
  std::optional<RateBend> RateBendAt(std::size_t turn) const;
  double RateVariance() const;
  Eigen::MatrixXd AtPose(Triad triad, FaultForm form, std::size_t node) const;
  double ScaleOf(Triad triad, FaultForm form) const;
  Eigen::Vector3d MotionInto(Triad triad, std::size_t node) const;

  const PoseGraph* graph_;
  std::vector<Node> nodes_;
  mutable std::vector<TurnColumns> turns_;  // computed at the first call of turns()
  std::vector<int> turn_into_;              // by node: the turn that ends there; -1: none
  std::vector<Eigen::Index> turn_rows_;
  std::vector<std::size_t> stretch_begin_, stretch_of_;
  PerTriad<double> largest_{{0.0, 0.0, 0.0}};          // largest |u|, raw unit
  mutable double largest_rate_ = 0.0;                  // computed with turns_
  Eigen::Array3d half_step_ = Eigen::Array3d::Zero();  // half a step of the gyroscope, raw unit
  struct Path {
    Eigen::Vector3d angle = Eigen::Vector3d::Zero();
    double time_s = 0.0;
    std::ptrdiff_t turns = 0;
  };
  std::vector<Path> path_;    // from the chain's begin to each node; empty without turns
  std::ptrdiff_t apart_ = 1;  // span of a mean rate: this many consecutive turns
  double rate_variance_ = 0.0;
  Eigen::VectorXd tau_;
  std::optional<Eigen::VectorXd> temperature_;
};

}  // namespace truetriad
