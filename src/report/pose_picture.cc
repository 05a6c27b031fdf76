// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "report/charts.h"
#include "report/format.h"
#include "report/svg.h"
#include "truetriad/base/triad.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

/// The sizes of a picture, user units, and where the looker stands.
struct PictureLayout {
  double width = 200.0;
  double height = 214.0;    ///< Below the cube and its arrows is the compass.
  double half_edge = 44.0;  ///< Of the cube: it leaves room for its arrows.
  double arrow = 1.85;      ///< Length of an axis from the centre, in half edges.
  double flat = 0.25;       ///< Faces seen flatter than this (cosine) have no room for their name.
  double azimuth = 28.0 * kRadPerDeg;    ///< From north to the west: three faces are seen.
  double elevation = 24.0 * kRadPerDeg;  ///< How far the looker looks down.
};
constexpr PictureLayout kPicture;

/// Parallel projection of the world (x north, y west, z up).
class Camera {
 public:
  Camera() {
    const Eigen::Vector3d ahead(std::cos(kPicture.azimuth), std::sin(kPicture.azimuth), 0.0);
    right_ = ahead.cross(Eigen::Vector3d::UnitZ());
    depth_ = std::cos(kPicture.elevation) * ahead -
             std::sin(kPicture.elevation) * Eigen::Vector3d::UnitZ();
    up_ = right_.cross(depth_);
  }

  std::pair<double, double> On(const Eigen::Vector3d& world) const {
    return {0.5 * kPicture.width + kPicture.half_edge * right_.dot(world),
            0.48 * kPicture.width - kPicture.half_edge * up_.dot(world)};
  }

  bool Faces(const Eigen::Vector3d& normal) const { return depth_.dot(normal) < -1e-9; }
  double Depth(const Eigen::Vector3d& world) const { return depth_.dot(world); }

 private:
  Eigen::Vector3d right_, depth_, up_;
};

class Picture {
 public:
  Picture(const Eigen::Matrix3d& world_from_body, std::string_view label)
      : rotation_(world_from_body), svg_(kPicture.width, kPicture.height, label) {}

  std::string Draw() {
    Compass();
    // What points away is behind the cube.
    for (const bool front : {false, true}) {
      if (front) {
        for (int axis = 0; axis < 3; ++axis) {
          for (const double sign : {-1.0, 1.0}) Face(axis, sign);
        }
      }
      for (int axis = 0; axis < 3; ++axis) {
        if (camera_.Faces(rotation_.col(axis)) == front) Axis(axis);
      }
    }
    return svg_.Finish();
  }

 private:
  using Point = std::pair<double, double>;

  void Arrow(const Point& from, const Point& to, const std::string& style) {
    const auto [x1, y1] = from;
    const auto [x2, y2] = to;
    svg_.Line(x1, y1, x2, y2, style);
    const double length = std::hypot(x2 - x1, y2 - y1);
    if (length < 1.0) return;
    const double u = (x2 - x1) / length;
    const double v = (y2 - y1) / length;
    svg_.Polyline({{x2 + 3.0 * u, y2 + 3.0 * v},
                   {x2 - 7.0 * u - 4.5 * v, y2 - 7.0 * v + 4.5 * u},
                   {x2 - 7.0 * u + 4.5 * v, y2 - 7.0 * v - 4.5 * u},
                   {x2 + 3.0 * u, y2 + 3.0 * v}},
                  style + " head");
  }

  // Where north and up are, in a corner of the picture.
  void Compass() {
    const Point centre = camera_.On(Eigen::Vector3d::Zero());
    const auto at = [&](const Eigen::Vector3d& world) {
      const Point point = camera_.On(world);
      return Point(point.first - centre.first + 16.0, point.second - centre.second + 200.0);
    };
    for (const auto& [to, name] : {std::pair(Eigen::Vector3d(1.0, 0.0, 0.0), "N"),
                                   std::pair(Eigen::Vector3d(0.0, 0.0, 0.6), "up")}) {
      Arrow(at(Eigen::Vector3d::Zero()), at(to), "world");
      const auto [x, y] = at(1.4 * to);
      svg_.Text(x, y + 4.0, name, "middle world");
    }
  }

  void Face(int axis, double sign) {
    const Eigen::Vector3d normal = sign * rotation_.col(axis);
    if (!camera_.Faces(normal)) return;
    const Eigen::Vector3d a = rotation_.col((axis + 1) % 3);
    const Eigen::Vector3d b = rotation_.col((axis + 2) % 3);
    std::vector<std::pair<double, double>> corners;
    for (const auto& [s, t] : {std::pair(1.0, 1.0),
                               std::pair(-1.0, 1.0),
                               std::pair(-1.0, -1.0),
                               std::pair(1.0, -1.0),
                               std::pair(1.0, 1.0)}) {
      corners.push_back(camera_.On(normal + s * a + t * b));
    }
    // Light from above.
    const int shade = std::clamp(static_cast<int>(std::lround(normal.z() + 1.0)), 0, 2);
    svg_.Polyline(corners, "face shade" + std::to_string(shade));
    const auto [x, y] = camera_.On(normal);
    if (sign < 0.0 && camera_.Depth(normal) < -kPicture.flat) {
      svg_.Text(x, y + 4.0, std::string("−") + Name(axis), "middle back");
    }
  }

  void Axis(int axis) {
    const Eigen::Vector3d direction = rotation_.col(axis);
    Arrow(camera_.On(direction),
          camera_.On(kPicture.arrow * direction),
          std::string("axis ") + Name(axis));
    const auto [x, y] = camera_.On((kPicture.arrow + 0.27) * direction);
    svg_.Text(x, y + 4.5, Name(axis), std::string("middle axis ") + Name(axis));
  }

  static std::string Name(int axis) { return std::string(1, AxisLetter(axis)); }

  Eigen::Matrix3d rotation_;
  Camera camera_;
  Svg svg_;
};

}  // namespace

std::string PosePicture(const Eigen::Quaterniond& world_from_body, std::string_view label) {
  return Picture(world_from_body.toRotationMatrix(), label).Draw();
}

}  // namespace truetriad
