// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "truetriad/sim/scenario.h"

namespace truetriad {

/// Attitude and motion of the unit at one time.
struct Kinematics {
  Eigen::Quaterniond world_from_body = Eigen::Quaterniond::Identity();
  Eigen::Vector3d rate_radps = Eigen::Vector3d::Zero();                   ///< Body frame.
  Eigen::Vector3d angular_acceleration_radps2 = Eigen::Vector3d::Zero();  ///< Body frame.
  Eigen::Vector3d acceleration_mps2 = Eigen::Vector3d::Zero();  ///< Acceleration of the centre,
                                                                ///< world frame.
};

/// A function of time with its first two derivatives.
struct Motion1d {
  double value = 0.0;
  double rate = 0.0;
  double acceleration = 0.0;
};

/// Minimum-jerk motion from 0 to 1 in `duration_s`, at rest at both ends; clamped outside.
Motion1d MinimumJerk(double time_s, double duration_s);

/// An interval in which one formula holds for the attitude,
///
///   R(t) = R(begin) Exp(angle(t) axis)    or, when tumbling,    R(begin) Rz(a) Ry(b) Rx(c).
///
/// The angles are functions of the time since `begin_s` alone.
struct MotionPhase {
  struct Still {};
  /// A turn by `angle_rad` with minimum jerk, while the centre travels by `travel_m` (world frame).
  struct Turn {
    double angle_rad = 0.0;
    Eigen::Vector3d travel_m = Eigen::Vector3d::Zero();
  };
  /// A rotation that reaches `rate_radps` within `ramp_s`, and stops in the same way.
  struct Spin {
    double rate_radps = 0.0;
    double ramp_s = 1.0;
  };
  /// The angle is tilt (1 + s) e^-s - tilt, s = t / decay_s: a tilt that decays.
  struct Settling {
    double tilt_rad = 0.0;
    double decay_s = 1.0;
  };
  /// Angle k: amplitude_k (sin(omega_k w + phase_k) - sin(phase_k)), k = a, b, c; w is the time,
  /// slowed so that dw/dt is zero at start and end.
  struct Tumbling {
    Eigen::Vector3d amplitude_rad = Eigen::Vector3d::Zero();
    Eigen::Vector3d omega_radps = Eigen::Vector3d::Zero();
    Eigen::Vector3d phase_rad = Eigen::Vector3d::Zero();
    double ramp_s = 1.0;
    /// Acceleration that the hand adds while it turns the unit at full speed, in the world frame.
    /// On each axis it is a sum of this many sines of equal amplitude, so that it does not repeat.
    static constexpr std::size_t kHandTerms = 32;
    double hand_amplitude_mps2 = 0.0;
    std::array<Eigen::Vector3d, kHandTerms> hand_omega_radps{}, hand_phase_rad{};
  };

  double begin_s = 0.0;
  double duration_s = 0.0;
  Eigen::Quaterniond world_from_body = Eigen::Quaterniond::Identity();  ///< At `begin_s`.
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();                      ///< Body frame, unit.
  std::variant<Still, Turn, Spin, Settling, Tumbling> form;

  double end_s() const { return begin_s + duration_s; }
  bool is_still() const { return std::holds_alternative<Still>(form); }
  /// `time_s` is clamped to the phase.
  Kinematics At(double time_s) const;
};

/// Attitude over time: phases that follow each other from time 0 on; at rest before and after.
class Motion {
 public:
  /// `phases`: at least one phase. Each phase begins where the previous phase ends.
  explicit Motion(std::vector<MotionPhase> phases) : phases_(std::move(phases)) {}

  double duration_s() const { return phases_.back().end_s(); }

  /// The index of the phase at `time_s`; the search begins at phase `from`. If two phases meet at
  /// this time, it is the later phase.
  std::size_t PhaseAt(double time_s, std::size_t from = 0) const;
  const MotionPhase& phase(std::size_t index) const { return phases_[index]; }

 private:
  std::vector<MotionPhase> phases_;
};

}  // namespace truetriad
