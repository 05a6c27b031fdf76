// SPDX-License-Identifier: Apache-2.0
//
// The classical six-position solutions: every axis once up and once down, so that
//
//   y_{±j} = ±g S e_j + b     b = (y_{+j} + y_{-j}) / 2     S e_j = (y_{+j} - y_{-j}) / (2 g)
//
// Least squares over six faces of equal weight gives the same S and the mean of the three b.
#include "init/six_position.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>

#include <glog/logging.h>

#include "init/ellipsoid_fit.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/finding.h"

namespace truetriad {
namespace {

using Eigen::Vector3d;

// If a block is tilted, its reading is nearer to its face than to the next face by 90 deg minus
// twice the tilt. A block that is tilted by up to 35 deg thus still determines its face.
constexpr double kMinFaceMarginRad = 20.0 * kRadPerDeg;

std::string NameOf(int face) { return kFaceNames[static_cast<std::size_t>(face)]; }

int FaceOf(int axis, double up) { return 2 * axis + (up > 0.0 ? 0 : 1); }

// Error: a face without a reading.
Status CheckFaces(const std::vector<int>& faces) {
  std::string missing;
  for (int face = 0; face < static_cast<int>(kFaceNames.size()); ++face) {
    if (std::find(faces.begin(), faces.end(), face) != faces.end()) continue;
    missing += (missing.empty() ? "" : ", ") + NameOf(face);
  }
  if (missing.empty()) return {};
  return NotEnoughError(
      Finding(FindingCode::kMissingFaces,
              "no rest with these axes up: " + missing,
              "a six-face calibration needs a rest with each axis up and one with it down; record "
              "the missing ones"));
}

}  // namespace

Result<TriadModel<double>> SixFaceExtremes(const std::vector<Vector3d>& readings,
                                           double gravity_mps2) {
  CHECK_GT(gravity_mps2, 0.0);
  if (readings.empty()) return CheckFaces({}).error();
  Vector3d smallest = readings.front();
  Vector3d largest = readings.front();
  for (const Vector3d& reading : readings) {
    smallest = smallest.cwiseMin(reading);
    largest = largest.cwiseMax(reading);
  }
  TriadModel<double> model;
  model.bias = 0.5 * (largest + smallest);
  const Vector3d half_range = 0.5 * (largest - smallest);
  model.sensitivity = (half_range / gravity_mps2).asDiagonal();

  // If an axis was never up, the extreme reading of this axis was taken with another axis up, and
  // the face is missing.
  std::vector<int> faces;
  for (const Vector3d& reading : readings) {
    const Vector3d direction = (reading - model.bias).cwiseQuotient(half_range);
    int axis = 0;
    const double along = direction.cwiseAbs().maxCoeff(&axis);
    if (along > direction.norm() * std::numbers::sqrt2 / 2.0) {
      faces.push_back(FaceOf(axis, direction(axis)));
    }
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckFaces(faces));
  return model;
}

Result<std::vector<int>> AssignFaces(const std::vector<Vector3d>& readings) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Ellipsoid ellipsoid, FitAxisAlignedEllipsoid(readings));
  std::vector<int> faces;
  for (const Vector3d& reading : readings) {
    const Vector3d direction =
        (reading - ellipsoid.centre).cwiseQuotient(ellipsoid.AxisRadii()).normalized();
    int axis = 0;
    direction.cwiseAbs().maxCoeff(&axis);
    faces.push_back(FaceOf(axis, direction(axis)));
    Vector3d others = direction.cwiseAbs();
    others(axis) = 0.0;
    int next = 0;
    const double angle_rad = std::acos(std::min(1.0, std::abs(direction(axis))));
    const double next_angle_rad = std::acos(std::min(1.0, others.maxCoeff(&next)));
    if (next_angle_rad - angle_rad < kMinFaceMarginRad) {
      return Error(ErrorCode::kDoesNotMatch,
                   "reading " + std::to_string(faces.size()) + " of " +
                       std::to_string(readings.size()) + " lies between the faces " +
                       NameOf(faces.back()) + " and " + NameOf(FaceOf(next, direction(next))) +
                       "; state the face of each pose, or place the unit on its faces");
    }
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckFaces(faces));
  return faces;
}

Result<TriadModel<double>> SixPosition(const std::vector<Vector3d>& readings,
                                       const std::vector<int>& faces,
                                       double gravity_mps2) {
  CHECK_GT(gravity_mps2, 0.0);
  CHECK_EQ(readings.size(), faces.size());
  TRUETRIAD_RETURN_IF_ERROR(CheckFaces(faces));
  // First averages the rests of each face, so that a face with more rests has no more weight than
  // the opposite face.
  std::array<Vector3d, 6> sum;
  sum.fill(Vector3d::Zero());
  std::array<double, 6> count{};
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto face = static_cast<std::size_t>(faces[k]);
    sum[face] += readings[k];
    count[face] += 1.0;
  }
  TriadModel<double> model;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Vector3d mean_up = sum[2 * axis] / count[2 * axis];
    const Vector3d mean_down = sum[2 * axis + 1] / count[2 * axis + 1];
    model.bias += (mean_up + mean_down) / 6.0;
    model.sensitivity.col(static_cast<Eigen::Index>(axis)) =
        (mean_up - mean_down) / (2.0 * gravity_mps2);
  }
  return model;
}

TriadModel<double> SixPositionKnownForce(const std::array<Vector3d, 6>& readings,
                                         const std::array<Vector3d, 6>& forces,
                                         double gravity) {
  CHECK_GT(gravity, 0.0);
  std::array<Vector3d, 6> delta;
  for (std::size_t k = 0; k < delta.size(); ++k) delta[k] = readings[k] - forces[k];
  TriadModel<double> model;
  model.bias = 0.5 * (delta[0] + delta[1]);
  model.sensitivity.col(0) += (delta[4] - model.bias) / gravity;
  model.sensitivity.col(1) += (model.bias - delta[2]) / gravity;
  model.sensitivity.col(2) += (model.bias - delta[0]) / gravity;
  return model;
}

}  // namespace truetriad
