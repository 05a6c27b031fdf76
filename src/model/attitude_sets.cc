// SPDX-License-Identifier: Apache-2.0
#include "model/attitude_sets.h"

#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Core>

#include "truetriad/base/triad.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

/// The smallest rotation, world <- body, that points the signed body axis up.
Eigen::Matrix3d FaceUp(int axis, double sign) {
  if (axis == 2) {
    return Eigen::Vector3d(1.0, sign, sign).asDiagonal();  // -z up: half a turn about x.
  }
  // A quarter turn about n = (face x z): R v = n (n . v) + n x v.
  const Eigen::Vector3d n = (sign * Eigen::Vector3d::Unit(axis)).cross(Eigen::Vector3d::UnitZ());
  Eigen::Matrix3d cross;
  cross << 0.0, -n.z(), n.y(), n.z(), 0.0, -n.x(), -n.y(), n.x(), 0.0;
  return n * n.transpose() + cross;
}

/// Whole degrees; -180 is written as 180.
int Degrees(double angle_rad) {
  const int degrees = static_cast<int>(std::lround(angle_rad * kDegPerRad));
  return degrees == -180 ? 180 : degrees;
}

/// "to the north", "45 deg west of north", …; `degrees` is the azimuth from north, positive to the
/// west.
std::string HeadingInWords(int degrees) {
  const int size = std::abs(degrees);
  const std::string side = degrees > 0 ? "west" : "east";
  if (size == 0) return "to the north";
  if (size == 90) return "to the " + side;
  if (size == 180) return "to the south";
  if (size < 90) return std::to_string(size) + " deg " + side + " of north";
  return std::to_string(180 - size) + " deg " + side + " of south";
}

}  // namespace

std::vector<Eigen::Quaterniond> SixFaceAttitudes() {
  std::vector<Eigen::Quaterniond> attitudes;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) attitudes.emplace_back(FaceUp(axis, sign));
  }
  return attitudes;
}

std::vector<Eigen::Quaterniond> CubeAttitudes() {
  Eigen::Matrix3d quarter_turn;  // About the vertical: north to west.
  quarter_turn << 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  std::vector<Eigen::Quaterniond> attitudes;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      Eigen::Matrix3d world_from_body = FaceUp(axis, sign);
      for (int heading = 0; heading < 4; ++heading) {
        attitudes.emplace_back(world_from_body);
        world_from_body = quarter_turn * world_from_body;
      }
    }
  }
  return attitudes;
}

std::vector<Eigen::Quaterniond> HandAttitudes() {
  std::vector<Eigen::Quaterniond> attitudes;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        const auto upright =
            RotationBetween(Eigen::Vector3d(x, y, z).normalized(), Eigen::Vector3d::UnitZ());
        for (int heading = 0; heading < 4; ++heading) {
          attitudes.push_back(
              Eigen::AngleAxisd(0.5 * std::numbers::pi * heading, Eigen::Vector3d::UnitZ()) *
              upright);
        }
      }
    }
  }
  return attitudes;
}

std::vector<Eigen::Quaterniond> SpreadAttitudes(int count) {
  constexpr double kPhi = std::numbers::sqrt2;         // Alexa's phi.
  constexpr double kPsi = 1.533751168755204288118041;  // The root of psi^4 = psi + 4.
  std::vector<Eigen::Quaterniond> attitudes;
  for (int i = 0; i < count; ++i) {
    const double s = i + 0.5;
    const double inner = std::sqrt(s / count);
    const double outer = std::sqrt(1.0 - s / count);
    const double alpha = 2.0 * std::numbers::pi * s / kPhi;
    const double beta = 2.0 * std::numbers::pi * s / kPsi;
    attitudes.emplace_back(outer * std::cos(beta),
                           inner * std::sin(alpha),
                           inner * std::cos(alpha),
                           outer * std::sin(beta));
  }
  return attitudes;
}

std::string AttitudeInWords(const Eigen::Quaterniond& world_from_body) {
  const Eigen::Matrix3d rotation = world_from_body.normalized().toRotationMatrix();
  constexpr double kTie = 1e-6;  // If axes are equally steep except for rounding, the first one is
                                 // named.
  int up = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (std::abs(rotation(2, axis)) > std::abs(rotation(2, up)) + kTie) up = axis;
  }
  std::string words = std::string(rotation(2, up) < 0.0 ? "-" : "") + AxisLetter(up) + " up";
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == up) continue;
    const int elevation = Degrees(std::asin(rotation(2, axis)));
    if (elevation == 0) continue;
    words += std::string(", ") + AxisLetter(axis) + " " + std::to_string(std::abs(elevation)) +
             (elevation > 0 ? " deg above level" : " deg below level");
  }
  const int first = up == 0 ? 1 : 0;
  return words + ", " + AxisLetter(first) + " " +
         HeadingInWords(Degrees(std::atan2(rotation(1, first), rotation(0, first))));
}

}  // namespace truetriad
