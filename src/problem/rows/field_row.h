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

// A triad that senses a vector of the world, v, in a pose of attitude R:
//
//   rows   h(S x) + b - y,   x = M R^T v        h: higher terms, triad_model.h
//
// y is a mean of readings over which the body turned by a little: M is the mean of R_i^T R over
// them, Identity at rest. S, b and h at the temperature of the pose. Of a pose of which only the
// direction d is known, x = |v| d.
//
// Parameters: the triad's (TriadBlocks), the reference block (6), the state.
class FieldRow : public Row {
 public:
  struct Reading {
    Eigen::Vector3d mean_raw = Eigen::Vector3d::Zero();
    Eigen::Matrix3d mean_turn = Eigen::Matrix3d::Identity();  // M
    ThermalFactors thermal;
  };

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

  template <typename T>
  bool operator()(T const* const* parameters, T* residuals) const {
    const std::size_t count = triad_blocks_.count();
    const TriadModel<T> model = triad_blocks_.ModelAt(parameters);
    const Eigen::Matrix<T, 3, 1> field =
        FieldInBody(WorldVectorOf(triad_, parameters[count]), parameters[count + 1]);
    Eigen::Map<Eigen::Matrix<T, 3, 1>>{residuals} =
        model.RawFromTruth(field) - reading_.mean_raw.cast<T>();
    return true;
  }

 protected:
  FieldRow(Triad triad, const SharedLayout& layout, PoseKind state, const Reading& reading);

 private:
  template <typename T>
  Eigen::Matrix<T, 3, 1> FieldInBody(const Eigen::Matrix<T, 3, 1>& world, const T* state) const {
    if (state_ == PoseKind::kDirection) {
      return world.norm() * Eigen::Map<const Eigen::Matrix<T, 3, 1>>(state);
    }
    const Eigen::Map<const Eigen::Quaternion<T>> world_from_body(state);
    const Eigen::Matrix<T, 3, 1> in_body = world_from_body.conjugate() * world;
    return reading_.mean_turn.cast<T>() * in_body;
  }

  Triad triad_;
  PoseKind state_;
  Reading reading_;
  TriadBlocks triad_blocks_;
};

}  // namespace truetriad
