// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "problem/rows/row.h"
#include "problem/session_block.h"
#include "problem/thermal_block.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/triad_model.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The six faces of a block in the order +x, -x, +y, -y, +z, -z.
inline constexpr int kFaceCount = 6;

// Indices of the reference block.
enum ReferenceIndex {
  kGravity = 0,
  kField = 1,
  kDip = 2,
  kHeading = 3,
  kFixtureTilt = 4,  // two entries
  kReferenceSize = 6
};
using ReferenceVector = Eigen::Matrix<double, kReferenceSize, 1>;

// Where each parameter block stands in the one vector of shared (not per-pose) parameters:
//
//   <triad>.bias         3   raw unit
//   <triad>.sensitivity  9   raw per true unit, column-major
//   <triad>.thermal          temperature terms that are wanted, thermal_block.h
//   <triad>.session      3 for each session but the last, if sessions have biases of their own:
//                            raw unit, session_block.h
//   <triad>.<axis term>  3   raw^-power, each that is wanted: terms.h
//   g_sensitivity        9   raw of the gyroscope per m/s^2, column-major
//   reference            6   g (m/s^2), B (uT), dip (rad), heading of the field (rad), tilt of the
//                            fixture about its two level axes (rad)
//   face_tilt            2 a face of the six-face block, rad about its two tangent axes
//
// Blocks that are not wanted have offset -1. Free coordinates t change the vector by basis * t. An
// entry that is not estimated is held: its row of `basis` is zero. A basis, unlike a list of free
// entries, can tie entries of a symmetric matrix.
struct SharedLayout {
  PerTriad<int> bias{{-1, -1, -1}};
  PerTriad<int> sensitivity{{-1, -1, -1}};
  PerTriad<ThermalBlock> thermal;
  ThermalScale thermal_scale;
  PerTriad<SessionBlock> sessions;
  // The axis terms that are wanted, and their offsets, in the order of kAxisTerms.
  struct AxisTermBlock {
    AxisTerm term = AxisTerm::kQuadratic;
    int at = -1;
  };
  PerTriad<std::vector<AxisTermBlock>> axis_terms;
  int g_sensitivity = -1;
  int reference = 0;
  std::array<int, kFaceCount> face_tilt{-1, -1, -1, -1, -1, -1};
  int size = 0;

  // The earth's rate along magnetic north, west and up; held. Zero: it is neglected.
  Eigen::Vector3d earth_rate_radps = Eigen::Vector3d::Zero();

  Eigen::MatrixXd basis;  // size x free coordinates, columns orthonormal
  int free_size() const { return static_cast<int>(basis.cols()); }

  bool Has(Triad triad) const { return sensitivity[triad] >= 0; }
  bool CountsEarthRate() const { return !earth_rate_radps.isZero(0.0); }
  bool IsFree(int index) const { return !basis.row(index).isZero(0.0); }

  // The factors that multiply the terms of `triad`. If it has no temperature terms, their factors
  // are zero.
  ThermalFactors FactorsOf(Triad triad,
                           double temperature_degc,
                           double temperature_rate_degcps,
                           int session) const;
  // The triad's model at `shared`, its terms multiplied by `factors`.
  TriadModel<double> ModelOf(Triad triad,
                             const double* shared,
                             const ThermalFactors& factors) const;

  // The free coordinates that change entries of one block.
  std::vector<Eigen::Index> ColumnsOf(int offset, int block_size) const;
  // The basis restricted to one block: its rows, and the columns that are not zero in it.
  Eigen::MatrixXd BlockBasis(int offset, int block_size) const;
};

// Basis matrices of the free entries of a triad's sensitivity.
//
//   `axis_map`  nearest signed permutation of the start value; for a leading triad that defines the
//               body frame, the stated mounting. Models without rotation thus keep the axis order
//               of the mounting, and a triangular matrix is triangular in the order of the sensing
//               axes.
std::vector<Eigen::Matrix3d> SensitivityBasis(MatrixModel model,
                                              bool leading_triangular,
                                              const Eigen::Matrix3d& axis_map);

// Typical size of every entry of the shared vector, with which the σ of directions is compared;
// sizes of biases and gains follow from the triad's own gain and the field that it measures.
//
//   bias         gain_i * reference     raw unit       (a bias as large as the signal)
//   sensitivity  gain_i                 raw/true unit  (a gain error of 100 %)
//   thermal      as of both above       (as large a change over half the temperature range)
//   axis terms   (gain_i * reference)^-power   raw^-power (a term as large as the signal)
//   gravity, B   their value            true unit
//   dip, heading, tilts  1              rad
Eigen::VectorXd TypicalSizes(const SharedLayout& layout, const Eigen::VectorXd& shared);

// The name of each entry: "accelerometer.bias.x", "magnetometer.sensitivity.zz",
// "reference.dip_rad". Temperature terms are named after the terms in tau that they replace
// (parameter_name.h).
std::vector<std::string> ParameterNames(const SharedLayout& layout);

// The vector of the world that a triad senses, true unit: specific force at rest, or the magnetic
// field; zero for the gyroscope, see EarthRate. docs/conventions.md, "Frames". It is in the frame
// of the attitudes: a fixture's tilt t turns a level vector v into Exp(-t) v.
Eigen::Vector3d WorldVector(Triad triad, const Eigen::Ref<const ReferenceVector>& reference);

// d WorldVector / d (g, B, dip, heading, tilt).
Eigen::Matrix<double, 3, kReferenceSize> WorldVectorJacobian(
    Triad triad, const Eigen::Ref<const ReferenceVector>& reference);

// The earth's rate (rad/s; SharedLayout) in the frame of the attitudes: turned about the vertical
// by the heading of magnetic north, then by the fixture's tilt, as the field is.
Eigen::Vector3d EarthRate(const Eigen::Vector3d& earth_rate_radps,
                          const Eigen::Ref<const ReferenceVector>& reference);

// d EarthRate / d (g, B, dip, heading, tilt).
Eigen::Matrix<double, 3, kReferenceSize> EarthRateJacobian(
    const Eigen::Vector3d& earth_rate_radps, const Eigen::Ref<const ReferenceVector>& reference);

}  // namespace truetriad
