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
#include "truetriad/base/units.h"
#include "truetriad/model/finding.h"

namespace truetriad {
namespace {

using Eigen::Vector3d;

// A face is nearer than its neighbours by 90 deg less twice the tilt: a block that stands askew by
// 35 deg still tells its face.
constexpr double kMinFaceMarginRad = 20.0 * kRadPerDeg;

std::string FaceName(const FacePose& face) {
  return std::string(face.sign > 0 ? "+" : "-") + AxisLetter(face.axis);
}

std::size_t FaceIndex(const FacePose& face) {
  CHECK(face.axis >= 0 && face.axis < 3 && std::abs(face.sign) == 1);
  return static_cast<std::size_t>(2 * face.axis + (face.sign > 0 ? 0 : 1));
}

// "+x, -z"; empty when every face has a reading.
std::string MissingFaces(const std::vector<FacePose>& faces) {
  std::array<bool, 6> seen{};
  for (const FacePose& face : faces) seen[FaceIndex(face)] = true;
  std::string missing;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int sign : {1, -1}) {
      const FacePose face{axis, sign};
      if (!seen[FaceIndex(face)]) missing += (missing.empty() ? "" : ", ") + FaceName(face);
    }
  }
  return missing;
}

Error MissingFacesError(const std::string& missing) {
  return NotEnoughError(
      Finding(FindingCode::kMissingFaces,
              "no rest with these axes up: " + missing,
              "a six-face calibration needs every axis up and down, so record these"));
}

}  // namespace

Result<TriadModel<double>> SixFaceExtremes(const std::vector<Vector3d>& readings,
                                           double gravity_mps2) {
  CHECK_GT(gravity_mps2, 0.0);
  if (readings.empty()) return MissingFacesError("+x, -x, +y, -y, +z, -z");
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

  // The extreme of an axis that was never up is a reading in which another axis was.
  std::vector<FacePose> faces;
  for (const Vector3d& reading : readings) {
    const Vector3d direction = (reading - model.bias).cwiseQuotient(half_range);
    int axis = 0;
    const double along = direction.cwiseAbs().maxCoeff(&axis);
    if (along > direction.norm() * std::numbers::sqrt2 / 2.0) {
      faces.push_back({axis, direction(axis) > 0.0 ? 1 : -1});
    }
  }
  if (const std::string missing = MissingFaces(faces); !missing.empty()) {
    return MissingFacesError(missing);
  }
  return model;
}

Result<std::vector<FacePose>> AssignFaces(const std::vector<Vector3d>& readings) {
  const Result<Ellipsoid> ellipsoid = FitAxisAlignedEllipsoid(readings);
  if (!ellipsoid) return ellipsoid.error();
  std::vector<FacePose> faces;
  for (const Vector3d& reading : readings) {
    const Vector3d direction =
        (reading - ellipsoid->centre).cwiseQuotient(ellipsoid->AxisRadii()).normalized();
    int axis = 0;
    direction.cwiseAbs().maxCoeff(&axis);
    faces.push_back({axis, direction(axis) > 0.0 ? 1 : -1});
    Vector3d others = direction.cwiseAbs();
    others(axis) = 0.0;
    int next = 0;
    const double angle_rad = std::acos(std::min(1.0, std::abs(direction(axis))));
    const double next_angle_rad = std::acos(std::min(1.0, others.maxCoeff(&next)));
    if (next_angle_rad - angle_rad < kMinFaceMarginRad) {
      return Error(ErrorCode::kDoesNotMatch,
                   "reading " + std::to_string(faces.size()) + " of " +
                       std::to_string(readings.size()) + " lies between the faces " +
                       FaceName(faces.back()) + " and " +
                       FaceName({next, direction(next) > 0.0 ? 1 : -1}) +
                       "; state the face of each pose, or place the unit on its faces");
    }
  }
  if (const std::string missing = MissingFaces(faces); !missing.empty()) {
    return MissingFacesError(missing);
  }
  return faces;
}

Result<TriadModel<double>> SixPosition(const std::vector<Vector3d>& readings,
                                       const std::vector<FacePose>& faces,
                                       double gravity_mps2) {
  CHECK_GT(gravity_mps2, 0.0);
  CHECK_EQ(readings.size(), faces.size());
  if (const std::string missing = MissingFaces(faces); !missing.empty()) {
    return MissingFacesError(missing);
  }
  // Face by face, so that a face with more rests weighs no more than its opposite.
  std::array<Vector3d, 6> sum;
  sum.fill(Vector3d::Zero());
  std::array<double, 6> count{};
  for (std::size_t k = 0; k < readings.size(); ++k) {
    sum[FaceIndex(faces[k])] += readings[k];
    count[FaceIndex(faces[k])] += 1.0;
  }
  TriadModel<double> model;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t up = FaceIndex({axis, 1});
    const std::size_t down = FaceIndex({axis, -1});
    const Vector3d mean_up = sum[up] / count[up];
    const Vector3d mean_down = sum[down] / count[down];
    model.bias += (mean_up + mean_down) / 6.0;
    model.sensitivity.col(axis) = (mean_up - mean_down) / (2.0 * gravity_mps2);
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
