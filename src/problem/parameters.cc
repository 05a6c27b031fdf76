// SPDX-License-Identifier: Apache-2.0
#include "problem/parameters.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "model/world.h"
#include "problem/parameter_name.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// Typical rate of a unit that is turned by hand, rad/s; about 60 degrees per second.
constexpr double kTypicalRateRadps = 1.0;

}  // namespace

ThermalFactors SharedLayout::FactorsOf(Triad triad,
                                       double temperature_degc,
                                       double temperature_rate_degcps,
                                       int session) const {
  ThermalFactors factors;
  if (thermal[triad].size() > 0) {
    factors = thermal_scale.FactorsAt(temperature_degc, temperature_rate_degcps);
  }
  factors.session = session;
  return factors;
}

TriadModel<double> SharedLayout::ModelOf(Triad triad,
                                         const double* shared,
                                         const ThermalFactors& factors) const {
  TriadModel<double> model{Eigen::Map<const Eigen::Matrix3d>(shared + sensitivity[triad]),
                           Eigen::Map<const Eigen::Vector3d>(shared + bias[triad])};
  thermal[triad].AddTerms(factors, shared, &model);
  sessions[triad].AddTo(factors.session, shared, &model);
  for (const auto& [term, at] : axis_terms[triad]) {
    model.axis_terms[term] = Eigen::Map<const Eigen::Vector3d>(shared + at);
  }
  return model;
}

std::vector<Eigen::Index> SharedLayout::ColumnsOf(int offset, int block_size) const {
  std::vector<Eigen::Index> columns;
  for (Eigen::Index column = 0; column < basis.cols(); ++column) {
    if (!basis.col(column).segment(offset, block_size).isZero(0.0)) columns.push_back(column);
  }
  return columns;
}

Eigen::MatrixXd SharedLayout::BlockBasis(int offset, int block_size) const {
  return basis(Eigen::seqN(offset, block_size), ColumnsOf(offset, block_size));
}

std::vector<Eigen::Matrix3d> SensitivityBasis(MatrixModel model,
                                              bool leading_triangular,
                                              const Eigen::Matrix3d& axis_map) {
  std::vector<Eigen::Matrix3d> basis;
  const auto add = [&basis](const Eigen::Matrix3d& matrix) {
    basis.push_back(matrix / matrix.norm());
  };
  if (model == MatrixModel::kBias) return basis;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      Eigen::Matrix3d entry = Eigen::Matrix3d::Zero();
      entry(row, col) = 1.0;
      if (model == MatrixModel::kDiagonal) {
        if (row == col) add(entry * axis_map);
      } else if (leading_triangular) {
        // For a leading triad, a symmetric matrix is a full matrix in another frame convention.
        if (row >= col) add(entry * axis_map);
      } else if (model == MatrixModel::kSymmetric) {
        if (row == col) add(entry * axis_map);
        if (row > col) add((entry + entry.transpose()) * axis_map);
      } else {
        add(entry);
      }
    }
  }
  return basis;
}

Eigen::VectorXd TypicalSizes(const SharedLayout& layout, const Eigen::VectorXd& shared) {
  Eigen::VectorXd sizes = Eigen::VectorXd::Ones(layout.size);
  const ReferenceVector reference = shared.segment<kReferenceSize>(layout.reference);
  for (const Triad triad : kTriads) {
    if (!layout.Has(triad)) continue;
    const Eigen::Map<const Eigen::Matrix3d> sensitivity(&shared[layout.sensitivity[triad]]);
    const Eigen::Vector3d gain = sensitivity.rowwise().norm();
    const double strength =
        triad == Triad::kGyroscope ? kTypicalRateRadps : WorldVector(triad, reference).norm();
    sizes.segment<3>(layout.bias[triad]) = gain * strength;
    sizes.segment<9>(layout.sensitivity[triad]) = gain.replicate<3, 1>();
    const ThermalBlock& thermal = layout.thermal[triad];
    for (int i = 0; i < thermal.vector_count(); ++i) {
      sizes.segment<3>(thermal.vector_at(i)) = gain * strength;
    }
    for (int i = 0; i < thermal.terms.matrix_order; ++i) {
      sizes.segment<9>(thermal.matrix_at(i)) = gain.replicate<3, 1>();
    }
    for (int i = 0; i < layout.sessions[triad].block_count(); ++i) {
      sizes.segment<3>(layout.sessions[triad].block_at(i)) = gain * strength;
    }
    for (const auto& [term, at] : layout.axis_terms[triad]) {
      for (int i = 0; i < 3; ++i) sizes[at + i] = 1.0 / InfoOf(term).PowerOf(gain[i] * strength);
    }
  }
  if (layout.g_sensitivity >= 0) {
    // The G by which gravity changes readings as much as the typical rate does.
    sizes.segment<9>(layout.g_sensitivity) =
        sizes.segment<3>(layout.bias[Triad::kGyroscope]).replicate<3, 1>() / reference[kGravity];
  }
  sizes[layout.reference + kGravity] = reference[kGravity];
  sizes[layout.reference + kField] = reference[kField];
  return sizes;
}

std::vector<std::string> ParameterNames(const SharedLayout& layout) {
  static constexpr std::array<const char*, kFaceCount> kFaces = {
      "x_up", "x_down", "y_up", "y_down", "z_up", "z_down"};
  std::vector<std::string> names(static_cast<std::size_t>(layout.size));
  const auto name = [&names](int index) -> std::string& {
    return names[static_cast<std::size_t>(index)];
  };
  for (const Triad triad : kTriads) {
    if (!layout.Has(triad)) continue;
    const auto name_vector = [&](int at, ParameterKind kind, int power) {
      for (int row = 0; row < 3; ++row) {
        name(at + row) = ParameterName{triad, kind, power, row, 0}.str();
      }
    };
    const auto name_matrix = [&](int at, int power) {
      for (int row = 0; row < 3; ++row) {
        for (int col = 0; col < 3; ++col) {
          name(at + 3 * col + row) =
              ParameterName{triad, ParameterKind::kSensitivity, power, row, col}.str();
        }
      }
    };
    name_vector(layout.bias[triad], ParameterKind::kBias, 0);
    name_matrix(layout.sensitivity[triad], 0);
    const ThermalBlock& thermal = layout.thermal[triad];
    int i = 0;
    while (i < thermal.terms.bias_order) {
      name_vector(thermal.vector_at(i), ParameterKind::kBias, i + 1);
      ++i;
    }
    for (const RateTermInfo& info : kRateTerms) {
      if (thermal.terms.rate[info.term]) name_vector(thermal.vector_at(i++), info.kind, 0);
    }
    for (int m = 0; m < thermal.terms.matrix_order; ++m) name_matrix(thermal.matrix_at(m), m + 1);
    for (int block = 0; block < layout.sessions[triad].block_count(); ++block) {
      const int at = layout.sessions[triad].block_at(block);
      name_vector(at, ParameterKind::kBias, 0);
      for (int row = 0; row < 3; ++row) {
        name(at + row).insert(0, "session_" + std::to_string(block + 1) + ".");
      }
    }
    for (const auto& [term, at] : layout.axis_terms[triad]) name_vector(at, InfoOf(term).kind, 0);
  }
  if (layout.g_sensitivity >= 0) {
    for (int i = 0; i < 9; ++i) {
      name(layout.g_sensitivity + i) =
          ParameterName{Triad::kGyroscope, ParameterKind::kGSensitivity, 0, i % 3, i / 3}.str();
    }
  }
  name(layout.reference + kGravity) = "reference.gravity_mps2";
  name(layout.reference + kField) = "reference.field_ut";
  name(layout.reference + kDip) = "reference.dip_rad";
  name(layout.reference + kHeading) = "reference.heading_rad";
  name(layout.reference + kFixtureTilt) = "reference.fixture_tilt_rad.x";
  name(layout.reference + kFixtureTilt + 1) = "reference.fixture_tilt_rad.y";
  for (std::size_t face = 0; face < kFaces.size(); ++face) {
    if (layout.face_tilt[face] < 0) continue;
    name(layout.face_tilt[face]) = std::string("face_tilt.") + kFaces[face] + ".first";
    name(layout.face_tilt[face] + 1) = std::string("face_tilt.") + kFaces[face] + ".second";
  }
  return names;
}

namespace {

// The vector that a triad senses, in the level frame. The x axis of this frame has the heading of
// the fixture's x axis.
Eigen::Vector3d LevelVector(Triad triad, const Eigen::Ref<const ReferenceVector>& reference) {
  if (triad == Triad::kAccelerometer) return ForceInWorld(reference[kGravity]);
  if (triad == Triad::kGyroscope) return Eigen::Vector3d::Zero();
  return FieldInWorld(reference[kField], reference[kDip], reference[kHeading]);
}

Eigen::Vector3d FixtureTilt(const Eigen::Ref<const ReferenceVector>& reference) {
  return {reference[kFixtureTilt], reference[kFixtureTilt + 1], 0.0};
}

// The derivative of Exp(-t) v by the reference block. `by_reference` is the derivative of v, the
// vector in the level frame.
Eigen::Matrix<double, 3, kReferenceSize> TiltedJacobian(
    const Eigen::Vector3d& level,
    Eigen::Matrix<double, 3, kReferenceSize> by_reference,
    const Eigen::Ref<const ReferenceVector>& reference) {
  // Exp(-t - d) v = Exp(-t) Exp(-J d) v = Exp(-t) (v + [v]_x J d), J the right Jacobian at -t.
  const Eigen::Vector3d tilt = FixtureTilt(reference);
  const Eigen::Matrix3d turn = Skew(level) * RightJacobian(-tilt);
  by_reference.middleCols<2>(kFixtureTilt) = turn.leftCols<2>();
  return RotationExp(-tilt).toRotationMatrix() * by_reference;
}

Eigen::Vector3d LevelEarthRate(const Eigen::Vector3d& earth_rate_radps,
                               const Eigen::Ref<const ReferenceVector>& reference) {
  return Eigen::AngleAxisd(reference[kHeading], Eigen::Vector3d::UnitZ()) * earth_rate_radps;
}

}  // namespace

Eigen::Vector3d WorldVector(Triad triad, const Eigen::Ref<const ReferenceVector>& reference) {
  return RotationExp(-FixtureTilt(reference)) * LevelVector(triad, reference);
}

Eigen::Matrix<double, 3, kReferenceSize> WorldVectorJacobian(
    Triad triad, const Eigen::Ref<const ReferenceVector>& reference) {
  Eigen::Matrix<double, 3, kReferenceSize> jacobian;
  jacobian.setZero();
  if (triad == Triad::kGyroscope) return jacobian;
  if (triad == Triad::kAccelerometer) {
    jacobian(2, kGravity) = 1.0;
  } else {
    const double field = reference[kField];
    const double dip = reference[kDip];
    const double heading = reference[kHeading];
    jacobian.col(kField) = FieldInWorld(1.0, dip, heading);
    jacobian.col(kDip) = field * Eigen::Vector3d(-std::sin(dip) * std::cos(heading),
                                                 -std::sin(dip) * std::sin(heading),
                                                 -std::cos(dip));
    jacobian.col(kHeading) =
        field *
        Eigen::Vector3d(-std::cos(dip) * std::sin(heading), std::cos(dip) * std::cos(heading), 0.0);
  }
  return TiltedJacobian(LevelVector(triad, reference), jacobian, reference);
}

Eigen::Vector3d EarthRate(const Eigen::Vector3d& earth_rate_radps,
                          const Eigen::Ref<const ReferenceVector>& reference) {
  return RotationExp(-FixtureTilt(reference)) * LevelEarthRate(earth_rate_radps, reference);
}

Eigen::Matrix<double, 3, kReferenceSize> EarthRateJacobian(
    const Eigen::Vector3d& earth_rate_radps, const Eigen::Ref<const ReferenceVector>& reference) {
  const Eigen::Vector3d level = LevelEarthRate(earth_rate_radps, reference);
  Eigen::Matrix<double, 3, kReferenceSize> jacobian;
  jacobian.setZero();
  jacobian.col(kHeading) = Eigen::Vector3d::UnitZ().cross(level);
  return TiltedJacobian(level, jacobian, reference);
}

}  // namespace truetriad
