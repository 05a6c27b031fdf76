// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "model/gyro_increment.h"
#include "problem/parameters.h"
#include "problem/rows/attitude.h"
#include "problem/rows/row.h"
#include "problem/rows/triad_blocks.h"
#include "problem/rows/world_vector.h"

namespace truetriad {

// The gyroscope's rotation from one pose to the next, or a stated turn between held attitudes:
//
//   rows   Log(dR(b, S, G, a)^T R_k^T Exp(e dt) R_k+1)      rad, in the body frame of the second
//
// dR: the rotation that is integrated from the readings at one point of the gyroscope's parameters
// and linearised about that point: dR = dR_0 Exp(J d), Forster et al. 2017. e: the earth's rate, if
// modelled; from the first pose to the second the world turns by e dt in inertial space. A stated
// turn is relative to the table, so that the earth's rate is not added.
//
// Parameters: the gyroscope's (TriadBlocks); g-sensitivity (9), if modelled; the reference block
// (6), if the earth's rate is modelled; both attitudes.
class TurnRow final : public Row {
 public:
  // `increment` was integrated at the parameters `at`; both must outlive the row.
  TurnRow(const SharedLayout& layout,
          const ThermalFactors& factors,
          bool counts_earth_rate,
          const GyroModel* at,
          const GyroIncrement* increment);

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

  template <typename T>
  bool operator()(T const* const* parameters, T* residuals) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    const Parts<T> parts = PartsOf(parameters);
    const Eigen::Quaternion<T> turned =
        increment_->rotation.cast<T>() * ExpOf<T>(ChangeOf(parameters));
    const Eigen::Map<const Eigen::Quaternion<T>> first(parts.first), second(parts.second);
    Eigen::Quaternion<T> between = first.conjugate() * second;
    if (parts.reference != nullptr) {
      const Vector3 earth_turn = EarthTurnOf(parts.reference);
      between = first.conjugate() * (ExpOf<T>(earth_turn) * second);
    }
    Eigen::Map<Vector3>{residuals} = LogOf<T>(turned.conjugate() * between);
    return true;
  }

 private:
  template <typename T>
  struct Parts {
    const T* g_sensitivity = nullptr;
    const T* reference = nullptr;
    const T* first = nullptr;
    const T* second = nullptr;
  };
  template <typename T>
  Parts<T> PartsOf(T const* const* parameters) const {
    std::size_t at = triad_blocks_.count();
    Parts<T> parts;
    if (has_g_sensitivity_) parts.g_sensitivity = parameters[at++];
    if (counts_earth_rate_) parts.reference = parameters[at++];
    parts.first = parameters[at];
    parts.second = parameters[at + 1];
    return parts;
  }
  // J d, d being the change of the gyroscope's parameters.
  template <typename T>
  Eigen::Matrix<T, 3, 1> ChangeOf(T const* const* parameters) const {
    using Matrix3 = Eigen::Matrix<T, 3, 3>;
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    using Vector9 = Eigen::Matrix<T, 9, 1>;
    const TriadModel<T> model = triad_blocks_.ModelAt(parameters);
    const Vector3 bias = model.bias - at_->triad.bias.template cast<T>();
    const Matrix3 sensitivity = model.sensitivity - at_->triad.sensitivity.template cast<T>();
    Vector3 change =
        increment_->by_bias.cast<T>() * bias +
        increment_->by_sensitivity.cast<T>() * Eigen::Map<const Vector9>(sensitivity.data());
    for (const AxisTermInfo& info : kAxisTerms) {
      if (!at_->is_bent) break;
      const Vector3 term =
          model.axis_terms[info.term] - at_->triad.axis_terms[info.term].template cast<T>();
      change += increment_->by_axis_term[info.term].cast<T>() * term;
    }
    if (has_g_sensitivity_) {
      const Matrix3 g = Eigen::Map<const Matrix3>(PartsOf(parameters).g_sensitivity) -
                        at_->g_sensitivity.template cast<T>();
      change += increment_->by_g_sensitivity.cast<T>() * Eigen::Map<const Vector9>(g.data());
    }
    return change;
  }
  template <typename T>
  Eigen::Matrix<T, 3, 1> EarthTurnOf(const T* reference) const {
    return T(increment_->duration_s) * EarthRateOf(earth_rate_radps_, reference);
  }

  const GyroModel* at_;
  const GyroIncrement* increment_;
  Eigen::Vector3d earth_rate_radps_;
  bool counts_earth_rate_ = false;
  bool has_g_sensitivity_ = false;
  TriadBlocks triad_blocks_;
};

}  // namespace truetriad
