// SPDX-License-Identifier: Apache-2.0
#include "truetriad/calibrate/repeatability.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "problem/parameter_name.h"

namespace truetriad {
Calibration WithRepeatability(const Repeatability& repeatability, Calibration calibration) {
  NamedCovariance& covariance = calibration.covariance;
  const std::vector<std::string>& names = covariance.parameters;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto one = ParameterName::Parse(names[i]);
    if (!one || one->power != 0 || !calibration.sensors[one->triad]) continue;
    // Raw units: S takes a bias of true units there.
    const Eigen::Matrix3d& S = calibration.sensors[one->triad]->model.sensitivity;
    for (std::size_t j = 0; j < names.size(); ++j) {
      const auto other = ParameterName::Parse(names[j]);
      if (!other || other->triad != one->triad || other->kind != one->kind || other->power != 0) {
        continue;
      }
      double& entry = covariance.matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      if (one->kind == ParameterKind::kBias) {
        entry +=
            std::pow(repeatability.bias[one->triad], 2) * S.row(one->row).dot(S.row(other->row));
      } else if (one->kind == ParameterKind::kSensitivity && i == j && one->row == one->col) {
        entry += std::pow(repeatability.scale[one->triad] * S(one->row, one->row), 2);
      }
    }
  }
  return calibration;
}

Calibration AtGravity(double gravity_mps2, Calibration calibration) {
  NamedCovariance& covariance = calibration.covariance;
  const std::vector<std::string>& names = covariance.parameters;
  const auto found = std::find(names.begin(), names.end(), "reference.gravity_mps2");
  if (found == names.end()) return calibration;
  const auto at = static_cast<Eigen::Index>(found - names.begin());
  const double variance = covariance.matrix(at, at);
  if (!(variance > 0.0)) return calibration;
  const Eigen::VectorXd by_gravity = covariance.matrix.col(at) / variance;
  const double shift = gravity_mps2 - calibration.reference.gravity_mps2;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto name = ParameterName::Parse(names[i]);
    if (!name || name->power != 0 || !calibration.sensors[name->triad]) continue;
    TriadModel<double>& model = calibration.sensors[name->triad]->model;
    const double change = by_gravity[static_cast<Eigen::Index>(i)] * shift;
    if (name->kind == ParameterKind::kBias) model.bias[name->row] += change;
    if (name->kind == ParameterKind::kSensitivity) {
      model.sensitivity(name->row, name->col) += change;
    }
  }
  covariance.matrix -= by_gravity * covariance.matrix.row(at).eval();
  calibration.reference.gravity_mps2 = gravity_mps2;
  return calibration;
}

}  // namespace truetriad
