// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "problem/parameters.h"
#include "problem/pose_state.h"
#include "problem/rows/row.h"
#include "problem/rows/triad_blocks.h"
#include "problem/rows/world_vector.h"

namespace truetriad {

// A triad that senses a vector of the world, v, in a pose of attitude R:
//
//   rows   h(S x) + b - y,   x = M R^T v        h: higher terms, triad_model.h
//
// y is a mean of readings during which the body turned slightly. M is the mean of R_i^T R over
// these readings, the identity at rest. S, b and h are those at the temperature of the pose. If the
// pose's unknown is only the direction d of v in the body, x = |v| d.
//
// The turns R^T R_i = Exp(t_i w) are measured by the gyroscope and depend on its parameters: a
// change e of the rate w changes M by
//
//   dM = -<t> [e] + <t^2> ([e] [w] + [w x e] / 2)        [.]: skew; third order of t w left out
//
// A constant M would pull the gyroscope's axes towards the axes with which M was computed.
//
// Parameters: the triad's (TriadBlocks), the reference block (6), the gyroscope's bias (3) and
// sensitivity (9, column by column) if M depends on them, the state.
class FieldRow : public Row {
 public:
  struct Reading {
    Eigen::Vector3d mean_raw = Eigen::Vector3d::Zero();
    Eigen::Matrix3d mean_turn = Eigen::Matrix3d::Identity();  // M
    ThermalFactors thermal;
    std::shared_ptr<const Turning> turning = nullptr;  // M is computed from it; null: M is constant
  };

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

  template <typename T>
  bool operator()(T const* const* parameters, T* residuals) const {
    const std::size_t count = triad_blocks_.count();
    const TriadModel<T> model = triad_blocks_.ModelAt(parameters);
    const Eigen::Matrix<T, 3, 1> field = FieldInBody(WorldVectorOf(triad_, parameters[count]),
                                                     RateChange(parameters + count + 1),
                                                     StateOf(parameters));
    Eigen::Map<Eigen::Matrix<T, 3, 1>>{residuals} =
        model.RawFromTruth(field) - reading_.mean_raw.cast<T>();
    return true;
  }

 protected:
  FieldRow(Triad triad, const SharedLayout& layout, PoseKind state, const Reading& reading);

 private:
  template <typename T>
  T const* StateOf(T const* const* parameters) const {
    return parameters[shared_blocks().size()];
  }

  // The rate according to the gyroscope's present parameters minus the rate with which M was
  // computed. `gyroscope`: the present bias and sensitivity.
  template <typename T>
  Eigen::Matrix<T, 3, 1> RateChange(T const* const* gyroscope) const {
    if (reading_.turning == nullptr) return Eigen::Matrix<T, 3, 1>::Zero();
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> bias(gyroscope[0]);
    const Eigen::Map<const Eigen::Matrix<T, 3, 3>> sensitivity(gyroscope[1]);
    return sensitivity.inverse() * (reading_.turning->rate_raw.cast<T>() - bias) -
           reading_.turning->rate_radps.cast<T>();
  }

  // The product dM u. It is linear in u and in the change of the rate.
  template <typename T>
  Eigen::Matrix<T, 3, 1> Followed(const Eigen::Matrix<T, 3, 1>& u,
                                  const Eigen::Matrix<T, 3, 1>& rate_change) const {
    const Turning& turning = *reading_.turning;
    const Eigen::Matrix<T, 3, 1> rate = turning.rate_radps.cast<T>();
    return T(turning.mean_s) * u.cross(rate_change) -
           T(turning.mean_square_s2) *
               (rate.cross(u).cross(rate_change) + T(0.5) * u.cross(rate.cross(rate_change)));
  }

  template <typename T>
  Eigen::Matrix<T, 3, 1> FieldInBody(const Eigen::Matrix<T, 3, 1>& world,
                                     const Eigen::Matrix<T, 3, 1>& rate_change,
                                     const T* state) const {
    if (state_ == PoseKind::kDirection) {
      return world.norm() * Eigen::Map<const Eigen::Matrix<T, 3, 1>>(state);
    }
    const Eigen::Map<const Eigen::Quaternion<T>> world_from_body(state);
    const Eigen::Matrix<T, 3, 1> in_body = world_from_body.conjugate() * world;
    const Eigen::Matrix<T, 3, 1> field = reading_.mean_turn.cast<T>() * in_body;
    if (reading_.turning == nullptr) return field;
    return field + Followed(in_body, rate_change);
  }

  // M after a change of the gyroscope's rate.
  Eigen::Matrix3d TurnAt(const Eigen::Vector3d& rate_change) const;
  // Derivatives by the gyroscope's bias and sensitivity; `in_body`: the world's vector in the body.
  void SetGyroscopeJacobians(const Eigen::Matrix3d& by_field,
                             const Eigen::Vector3d& in_body,
                             const Eigen::Vector3d& rate_change,
                             const double* sensitivity,
                             double** jacobians) const;

  Triad triad_;
  PoseKind state_;
  Reading reading_;
  TriadBlocks triad_blocks_;
};

}  // namespace truetriad
