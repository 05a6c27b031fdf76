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

// How the unknowns h of a fault change a sensor's readings. x is the true vector in the body, u = S
// x, and R is the attitude of the solution. Powers of u are relative to the largest |u| of the run,
// so that h is the change at that |u|, in the units of the readings.
enum class FaultForm {
  kBias,        // I
  kGain,        // diag(u)                       h relative
  kMatrix,      // I ⊗ x^T                       h relative to the gains, 9 entries
  kTurned,      // S [x]x                        h rad: rotation of the chip
  kWorld,       // S R^T                         h true units: a vector in the world
  kSquare,      // diag(u^2)
  kCube,        // diag(u^3)
  kSize,        // diag(|u|)
  kGainByRate,  // diag(u |ω|), along turns
  kByForce,     // I ⊗ f^T                       h at 1 g
  kByField,     // I ⊗ m^T                       h at the field's strength
  kByAttitude,  // S R^T ⊗ f^T                   h true units
  kPlay,        // diag(sign of the last motion of u)
  kSettling,    // u of the pose before - u      h a share
  kStill,       // I of readings within half a step of the bias
  kReading,     // I of poses alone, not of turns
  kTurn,        // I of turns alone              h rad
  kShortTurn,   // along the turn's angle        h rad
  kLowPass,     // 1/2 d^2 u / dt^2 at moments   h s^2: time constant squared; no delay
  kLeverArm,    // S ([α]x + [ω]x^2)             h m, from the point that the unit is turned about
};
// The number of values of FaultForm.
inline constexpr std::size_t kFaultForms = static_cast<std::size_t>(FaultForm::kLeverArm) + 1;

// Sums over the readings i of a turn: Σ K_i e_i for the reading errors e_i of each form, with K_i =
// dt_i dR^T R_i C and the rotation R_i from the turn's begin to reading i.
struct TurnColumns {
  std::array<Eigen::MatrixXd, kFaultForms> of;          // empty for forms that no turn has
  Eigen::Vector3d last_rate = Eigen::Vector3d::Zero();  // before the turn stops, rad/s
  double fastest = 0.0;                                 // rad/s
  // Σ (ω dt)(ω dt)^T, in the frame of the end.
  Eigen::Matrix3d squared_steps = Eigen::Matrix3d::Zero();
};

// The data for columns of faults: the graph at its present state, evaluated once.
class FaultScene {
 public:
  // Largest number of groups; a scan of as many has 1426 windows. If there are more poses, a group
  // has several.
  static constexpr std::size_t kMostStretches = 64;

  explicit FaultScene(const PoseGraph& graph);

  // Number of groups of consecutive poses, which are the positions of a scan. In runs of up to 64
  // poses, each pose is a group.
  std::size_t stretches() const { return stretch_begin_.size() - 1; }
  std::size_t poses() const { return nodes_.size(); }
  std::size_t FirstPose(std::size_t stretch) const { return stretch_begin_[stretch]; }
  double PosesIn(std::size_t stretch) const {
    return static_cast<double>(stretch_begin_[stretch + 1] - stretch_begin_[stretch]);
  }
  // Means over each group: time from -1 to 1 over the run, and temperature, unset if constant.
  const Eigen::VectorXd& tau() const { return tau_; }
  const std::optional<Eigen::VectorXd>& temperature() const { return temperature_; }

  // The largest |u| of a sensor, raw unit.
  double largest(Triad triad) const { return largest_[triad]; }

  // A form's columns, by group: their sum is the column of the whole run. A turn belongs half to
  // the group in which it begins and half to that in which it ends. The result is empty if no pose
  // or turn can have this form; if only the values are zero, there are columns without blocks.
  std::vector<FaultColumn> ColumnsOf(Triad triad, FaultForm form) const;

  // Of all turns, in the order of the increments; the squared steps of a stated turn are zero.
  const std::vector<TurnColumns>& turns() const;

 private:
  struct Seen {
    bool is_there = false;
    Eigen::Index row = 0;
    Eigen::Vector3d x, u;
    Eigen::Matrix3d S;
    Eigen::Matrix3d turn;  // rotates vectors into the body at the readings
  };
  // Rotation of the body at a moment where two turns meet: rad/s, rad/s^2, in its frame. The
  // acceleration is zero if the gyroscope's noise dominates it; columns then keep the part that the
  // rate alone determines.
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

  // The curvature of a turn's rate. The variance of its noise is `of_variance` times that of the
  // mean rate over a span.
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
  std::vector<int> turn_into_;              // of each node; -1: none
  std::vector<Eigen::Index> turn_rows_;
  std::vector<std::size_t> stretch_begin_, stretch_of_;
  PerTriad<double> largest_{{0.0, 0.0, 0.0}};          // |u|
  mutable double largest_rate_ = 0.0;                  // computed with turns_
  Eigen::Array3d half_step_ = Eigen::Array3d::Zero();  // of the gyroscope, raw unit
  struct Path {
    Eigen::Vector3d angle = Eigen::Vector3d::Zero();
    double time_s = 0.0;
    std::ptrdiff_t turns = 0;
  };
  std::vector<Path> path_;    // of each node; empty without turns
  std::ptrdiff_t apart_ = 1;  // length of a rate's span, in moments
  double rate_variance_ = 0.0;
  Eigen::VectorXd tau_;
  std::optional<Eigen::VectorXd> temperature_;
};

}  // namespace truetriad
