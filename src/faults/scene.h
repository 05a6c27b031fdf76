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

// What h adds to a sensor's readings, as a function of what the sensor felt: u = S x, x the truth
// in the body that the solution predicts, R the attitude. Functions of u are divided by the largest
// |u| of the run, so that h is in the units of the readings: what the fault amounts to there.
enum class FaultForm {
  kBias,    // I
  kGain,    // diag(u)                       h relative
  kMatrix,  // I ⊗ x^T                       h relative to the gains: a matrix of another shape
  kTurned,  // S [x]x                        h rad: the chip against the others
  kWorld,   // S R^T                         h true units: what it measures, in the world
  kSquare,  // diag(u^2)
  kCube,    // diag(u^3)
  kSize,    // diag(|u|)
  kGainByRate,  // diag(u |ω|), along turns
  kByForce,     // I ⊗ f^T                       h at 1 g
  kByField,     // I ⊗ m^T                       h at the field's strength
  kByAttitude,  // S R^T ⊗ f^T                   h true units
  kPlay,        // diag(sign of the last motion of u)
  kSettling,    // u of the pose before less u   h a share
  kReading,     // I of poses alone, no turns
  kTurn,        // I of turns alone              h rad
  kShortTurn,   // along the turn's angle        h rad
  kLowPass,     // 1/2 d^2 u / dt^2 at moments   h s^2: a time constant beyond its delay
  kLeverArm,    // S ([α]x + [ω]x^2)             h m, from the point that the unit is turned about
};
inline constexpr std::size_t kFaultForms = static_cast<std::size_t>(FaultForm::kLeverArm) + 1;

// Of a turn: Σ K_i e_i of readings that are off by e_i along a turn, for errors
// of several forms, with K_i = dt_i dR^T R_i C and R_i the rotation from the begin to reading i.
struct TurnColumns {
  std::array<Eigen::MatrixXd, kFaultForms> of;          // empty of forms that no turn has
  Eigen::Vector3d last_rate = Eigen::Vector3d::Zero();  // before it ends, rad/s
  double fastest = 0.0;                                 // rad/s
  // Σ (ω dt)(ω dt)^T, in the frame of the end.
  Eigen::Matrix3d squared_steps = Eigen::Matrix3d::Zero();
};

// What columns of faults are made of: the graph as it stands, looked at once.
class FaultScene {
 public:
  // Positions that a scan goes over at most: beyond as many, poses in a row are taken together.
  static constexpr std::size_t kMostStretches = 64;

  explicit FaultScene(const PoseGraph& graph);

  // Poses in a row that are one position of a scan; with up to 64 poses each is one.
  std::size_t stretches() const { return stretch_begin_.size() - 1; }
  std::size_t poses() const { return nodes_.size(); }
  std::size_t FirstPose(std::size_t stretch) const { return stretch_begin_[stretch]; }
  double PosesIn(std::size_t stretch) const {
    return static_cast<double>(stretch_begin_[stretch + 1] - stretch_begin_[stretch]);
  }
  // Mean over each stretch: time from -1 to 1 over the run, and temperature; unset where it is the
  // same throughout.
  const Eigen::VectorXd& tau() const { return tau_; }
  const std::optional<Eigen::VectorXd>& temperature() const { return temperature_; }

  // The largest |u| of a sensor, raw unit.
  double largest(Triad triad) const { return largest_[triad]; }

  // The column of each stretch: their sum is that of the whole run. A turn belongs half to the
  // stretch that it begins in and half to that where it ends. Empty: no pose and no turn can have
  // this form; a solution that fills it with nothing has columns without blocks.
  std::vector<FaultColumn> ColumnsOf(Triad triad, FaultForm form) const;

  // In the order of the increments; a turn that the operator states has no steps.
  const std::vector<TurnColumns>& turns() const;

 private:
  struct Seen {
    bool is_there = false;
    Eigen::Index row = 0;
    Eigen::Vector3d x, u;
    Eigen::Matrix3d S;
    Eigen::Matrix3d turn;  // from the body at the node to what was seen
  };
  // How the body turns at a moment that two turns meet at: rad/s, rad/s^2, in its frame. The
  // acceleration is zero where the gyroscope's noise would make much of it; what is along the field
  // needs the rate alone.
  struct Swing {
    Eigen::Vector3d rate, acceleration;
  };
  struct Node {
    PerTriad<Seen> seen;
    bool has_attitude = false;
    bool is_moment = false;  // of motion: it does not come to rest
    std::optional<Swing> swing;
    Eigen::Matrix3d body_from_world;
    Eigen::Vector3d up, field;  // unit vectors in the body
  };

  // The bend over one turn, whose noise has `of_variance` times the variance of a span's mean rate.
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
  mutable std::vector<TurnColumns> turns_;  // once they are asked for
  std::vector<int> turn_into_;              // of each node; -1: none
  std::vector<Eigen::Index> turn_rows_;
  std::vector<std::size_t> stretch_begin_, stretch_of_;
  PerTriad<double> largest_{{0.0, 0.0, 0.0}};  // |u|
  mutable double largest_rate_ = 0.0;          // with them
  struct Path {
    Eigen::Vector3d angle = Eigen::Vector3d::Zero();
    double time_s = 0.0;
    std::ptrdiff_t turns = 0;
  };
  std::vector<Path> path_;    // of each node, where there are turns
  std::ptrdiff_t apart_ = 1;  // moments
  double rate_variance_ = 0.0;
  Eigen::VectorXd tau_;
  std::optional<Eigen::VectorXd> temperature_;
};

}  // namespace truetriad
