// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "problem/parameters.h"
#include "problem/pose_state.h"
#include "problem/rows/row.h"
#include "problem/rows/triad_blocks.h"
#include "problem/rows/world_vector.h"

namespace truetriad {

// The gyroscope at a rest:
//
//   rows   h(S w) + b + G f - y        raw unit of the gyroscope
//
// w = R^T (earth's rate), or zero if the earth's rate is neglected; f = R^T (0, 0, g), or g d if
// the pose's unknown is only the direction d of gravity; G: g-sensitivity, if it is modelled.
//
// Parameters: the triad's (TriadBlocks); g-sensitivity (9, column by column); if g-sensitivity or
// the earth's rate is modelled, the reference block (6) and the state. The earth's rate needs an
// attitude.
class GyroscopeRow final : public Row {
 public:
  GyroscopeRow(const SharedLayout& layout,
               PoseKind state,
               const ThermalFactors& factors,
               const Eigen::Vector3d& mean_raw);

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

  template <typename T>
  bool operator()(T const* const* parameters, T* residuals) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    const TriadModel<T> model = triad_blocks_.ModelAt(parameters);
    std::size_t at = triad_blocks_.count();
    const T* g_sensitivity = has_g_sensitivity_ ? parameters[at++] : nullptr;
    Vector3 rate = Vector3::Zero(), pull = Vector3::Zero();
    if (sees_world()) {
      const T* reference = parameters[at];
      const T* state = parameters[at + 1];
      if (counts_earth_rate()) rate = InBody(EarthRateOf(earth_rate_radps_, reference), state);
      if (has_g_sensitivity_) {
        pull = Eigen::Map<const Eigen::Matrix<T, 3, 3>>(g_sensitivity) *
               InBody(WorldVectorOf(Triad::kAccelerometer, reference), state);
      }
    }
    Eigen::Map<Vector3>{residuals} = model.RawFromTruth(rate) + pull - mean_raw_.cast<T>();
    return true;
  }

 private:
  bool counts_earth_rate() const { return !earth_rate_radps_.isZero(0.0); }
  bool sees_world() const { return has_g_sensitivity_ || counts_earth_rate(); }

  template <typename T>
  Eigen::Matrix<T, 3, 1> InBody(const Eigen::Matrix<T, 3, 1>& world, const T* state) const {
    if (state_ == PoseKind::kDirection) {
      return world.norm() * Eigen::Map<const Eigen::Matrix<T, 3, 1>>(state);
    }
    return Eigen::Map<const Eigen::Quaternion<T>>(state).conjugate() * world;
  }
  void AddEarthRateJacobians(const double* reference,
                             const double* state,
                             const Eigen::Matrix3d& by_rate,
                             double* by_reference,
                             double* by_state) const;
  void AddPullJacobians(const double* g_sensitivity,
                        const double* reference,
                        const double* state,
                        double* by_g_sensitivity,
                        double* by_reference,
                        double* by_state) const;

  PoseKind state_;
  Eigen::Vector3d mean_raw_;
  Eigen::Vector3d earth_rate_radps_;
  bool has_g_sensitivity_ = false;
  TriadBlocks triad_blocks_;
};

}  // namespace truetriad
