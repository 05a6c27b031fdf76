// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "sim/motion.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {

/// An interval, which includes its beginning but not its end.
struct TimeSpan {
  double begin_s = 0.0;
  double end_s = 0.0;
  bool Contains(double time_s) const { return begin_s <= time_s && time_s < end_s; }
};

/// The interval in which a disturbance acts.
TimeSpan SpanOf(const DisturbanceTime& when, double duration_s, const std::vector<TrueRest>& rests);

/// The true quantities at the unit's sensors along its motion. Times must not decrease from call to
/// call.
class Surroundings {
 public:
  /// `motion` must outlive this.
  Surroundings(const Scenario& scenario, const Motion& motion, const std::vector<TrueRest>& rests);

  void MoveTo(double time_s);

  const Eigen::Quaterniond& world_from_body() const { return state_.world_from_body; }
  /// Specific force at the accelerometer, and magnetic field, body frame.
  Eigen::Vector3d ForceMps2() const;
  Eigen::Vector3d FieldUt() const;
  /// Inertial rate, body frame: now, and the mean since an earlier time and attitude.
  Eigen::Vector3d RateRadps() const;
  Eigen::Vector3d MeanRateRadps(std::int64_t since_ns,
                                const Eigen::Quaterniond& since_world_from_body,
                                std::int64_t now_ns) const;

 private:
  template <typename T>
  struct Timed {
    TimeSpan span;
    T what;
  };

  const Motion& motion_;
  Eigen::Vector3d force_in_world_mps2_;
  Eigen::Vector3d field_in_world_ut_;
  Eigen::Vector3d earth_rate_in_world_radps_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d lever_arm_m_ = Eigen::Vector3d::Zero();
  std::vector<Timed<Knock>> knocks_;
  std::vector<Timed<MagnetPassing>> magnets_;
  std::vector<Timed<HardIronStep>> hard_iron_steps_;
  std::vector<Timed<FieldStep>> field_steps_;

  double time_s_ = 0.0;
  std::size_t phase_ = 0;
  bool in_still_phase_ = false;
  Kinematics state_;
  Eigen::Matrix3d body_from_world_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d force_mps2_ = Eigen::Vector3d::Zero();  ///< Without knocks.
};

}  // namespace truetriad
