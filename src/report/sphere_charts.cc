// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>

#include "model/corrected_error.h"
#include "model/directions.h"
#include "report/charts.h"
#include "report/content.h"
#include "report/svg.h"
#include "report/table.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

/// The magnitude of the field that a sensor reads, true unit; 0 if its readings form no sphere.
double StrengthOf(const ReferenceValues& reference, Triad triad) {
  if (triad == Triad::kAccelerometer) return reference.gravity_mps2;
  return triad == Triad::kMagnetometer ? reference.field_ut.value_or(0.0) : 0.0;
}

}  // namespace

std::vector<SpherePoint> SpherePoints(const Calibration& calibration, Triad triad) {
  std::vector<SpherePoint> points;
  const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
  const double strength = StrengthOf(calibration.reference, triad);
  if (!sensor || !(strength > 0.0) || !calibration.IsUsable()) return points;
  const Eigen::Matrix3d nominal = NominalCorrection(*sensor, triad)
                                      .value_or(sensor->mounting.transpose() /
                                                std::cbrt(sensor->BySensingAxes().determinant()));
  for (const PoseResidual& pose : calibration.quality.rests.pose_residuals) {
    if (pose.triad != triad || !(pose.direction.norm() > 0.5)) continue;
    SpherePoint point;
    point.pose = pose.pose;
    point.is_rejected = !(pose.weight > 0.0);
    point.truth = pose.direction.normalized();
    const Eigen::Vector3d corrected = strength * point.truth + pose.residual;
    point.corrected = corrected / strength;
    point.raw = nominal * sensor->model.RawFromTruth(corrected) / strength;
    if (point.raw.allFinite() && point.corrected.allFinite()) points.push_back(point);
  }
  return points;
}

std::optional<WeakAxis> WeakAxisOf(const Calibration& calibration, Triad triad) {
  constexpr double kClearly = 2.0;  // If the ratio is smaller, no axis is clearly worst.
  const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
  if (!sensor || !calibration.IsUsable()) return std::nullopt;
  const Eigen::Matrix3d correction = sensor->model.Correction();
  const Eigen::Matrix3d covariance =
      correction *
      BiasAndSensitivityCovariance(calibration.covariance, {triad}).topLeftCorner<3, 3>() *
      correction.transpose();
  if (!covariance.allFinite()) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance);
  const double sigma = std::sqrt(std::max(axes.eigenvalues()[2], 0.0));
  const double across = std::sqrt(std::max(axes.eigenvalues()[1], 0.0));
  if (!(across > 0.0) || sigma < kClearly * across) return std::nullopt;
  Eigen::Vector3d direction = axes.eigenvectors().col(2);
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  if (direction[largest] < 0.0) direction = -direction;
  return WeakAxis{direction, sigma, across};
}

double SphereMagnification(const std::vector<SpherePoint>& points) {
  // If errors are drawn with at most 0.4 radii, neighbouring poses stay apart. A factor beyond a
  // million would show only rounding.
  constexpr double kMost = 0.4, kLargest = 1e6;
  double greatest = 0.0;
  for (const SpherePoint& point : points) {
    if (!point.is_rejected) greatest = std::max(greatest, (point.raw - point.truth).norm());
  }
  double factor = 1.0;
  for (double decade = 1.0; decade < kLargest; decade *= 10.0) {
    for (const double digit : {1.0, 2.0, 5.0}) {
      if (digit * decade * greatest <= kMost) factor = digit * decade;
    }
  }
  return factor;
}

double SphereReach(const std::vector<SpherePoint>& points, double factor) {
  double reach = 1.0;
  for (const SpherePoint& point : points) {
    if (point.is_rejected) continue;
    reach = std::max(reach, Magnified(point.raw, point.truth, factor).norm());
  }
  return reach;
}

std::vector<SpherePoint> GreatestOfRuns(const std::vector<SpherePoint>& points, std::size_t most) {
  if (points.size() <= most) return points;
  std::vector<SpherePoint> kept;
  const auto error = [](const SpherePoint& point) {
    return (point.corrected - point.truth).norm();
  };
  for (std::size_t run = 0; run < most; ++run) {
    const std::size_t begin = run * points.size() / most, end = (run + 1) * points.size() / most;
    std::optional<std::size_t> greatest;
    for (std::size_t i = begin; i < end; ++i) {
      if (points[i].is_rejected) {
        kept.push_back(points[i]);
      } else if (!greatest || error(points[i]) > error(points[*greatest])) {
        greatest = i;
      }
    }
    if (greatest) kept.push_back(points[*greatest]);
  }
  return kept;
}

namespace {

/// The sizes of two discs side by side in user units.
struct DiscLayout {
  double width = 620.0, height = 300.0;
  double radius = 120.0;
  double centre_y = 150.0;
  std::array<double, 2> centres = {150.0, 450.0};
  double cell = 6.0;     ///< A cell of a shaded area: radius / 20.
  double patch = 0.05;   ///< Width of a patch of the unit sphere, see OfPatches.
  double sphere = 85.0;  ///< The largest radius of a sphere.
  double reach = 118.0;  ///< Readings further from the centre are drawn at this distance.
};
constexpr DiscLayout kDiscs;

/// The direction of one sensor's reading at a pose. `counts`: whether the fit used the pose.
struct PoseDirection {
  Eigen::Vector3d unit;
  bool counts;
  int pose;
};

std::vector<PoseDirection> DirectionsOf(const Quality& quality, Triad triad) {
  std::vector<PoseDirection> directions;
  for (const PoseResidual& pose : quality.rests.pose_residuals) {
    if (pose.triad == triad && pose.direction.allFinite() && pose.direction.norm() > 0.5) {
      directions.push_back({pose.direction.normalized(), pose.weight > 0.0, pose.pose});
    }
  }
  return directions;
}

/// All directions, or, if there are more than kMostPoints, only the first direction of a pose used
/// in each patch of the sphere. A patch is about 3° (0.05 rad) wide.
std::vector<PoseDirection> OfPatches(const std::vector<PoseDirection>& directions) {
  if (directions.size() <= kMostPoints) return directions;
  std::set<std::array<int, 3>> seen;
  std::vector<PoseDirection> kept;
  for (const PoseDirection& direction : directions) {
    std::array<int, 3> patch;
    for (int i = 0; i < 3; ++i) {
      patch[static_cast<std::size_t>(i)] =
          static_cast<int>(std::lround(direction.unit[i] / kDiscs.patch));
    }
    if (direction.counts && seen.insert(patch).second) kept.push_back(direction);
  }
  return kept;
}

/// Cosine of the angle to the nearest pose used.
double NearestCosine(const std::vector<PoseDirection>& directions, const Eigen::Vector3d& to) {
  double nearest = -1.0;
  for (const PoseDirection& direction : directions) {
    if (direction.counts) nearest = std::max(nearest, direction.unit.dot(to));
  }
  return nearest;
}

DirectionGap GapBetween(const std::vector<PoseDirection>& directions) {
  std::vector<Eigen::Vector3d> unit;
  for (const PoseDirection& direction : directions) {
    if (direction.counts) unit.push_back(direction.unit);
  }
  return LargestGap(unit);
}

/// Lambert's projection keeps areas, so the density of points on the disc is that on the sphere.
double DiscRadius(double height) { return kDiscs.radius * std::sqrt(1.0 - height); }

std::pair<double, double> OnDisc(const Eigen::Vector3d& unit) {
  const double across = std::hypot(unit.x(), unit.y());
  const double scale = across > 0.0 ? DiscRadius(std::abs(unit.z())) / across : 0.0;
  return {kDiscs.centres[unit.z() >= 0.0 ? 0 : 1] + scale * unit.x(),
          kDiscs.centre_y - scale * unit.y()};
}

/// Shades cells whose centres are further than kHoleDeg from every pose, row by row.
void ShadeHoles(const std::vector<PoseDirection>& directions, Svg* svg) {
  const double limit = std::cos(kHoleDeg / kDegPerRad);
  for (std::size_t disc = 0; disc < 2; ++disc) {
    for (double y = -kDiscs.radius; y < kDiscs.radius; y += kDiscs.cell) {
      double begin = 0.0, end = 0.0;
      const auto flush = [&] {
        if (end > begin) {
          svg->Rectangle(
              kDiscs.centres[disc] + begin, kDiscs.centre_y + y, end - begin, kDiscs.cell, "hole");
        }
        begin = end = 0.0;
      };
      for (double x = -kDiscs.radius; x < kDiscs.radius; x += kDiscs.cell) {
        const double u = (x + 0.5 * kDiscs.cell) / kDiscs.radius,
                     v = -(y + 0.5 * kDiscs.cell) / kDiscs.radius;
        const double square = u * u + v * v;
        // On the disc r² = 1 - |z|.
        const double height = 1.0 - square;
        const double stretch =
            square > 0.0 ? std::sqrt(std::max(1.0 - height * height, 0.0) / square) : 0.0;
        const Eigen::Vector3d point(u * stretch, v * stretch, disc == 0 ? height : -height);
        if (square <= 1.0 && NearestCosine(directions, point) < limit) {
          if (!(end > begin)) begin = x;
          end = x + kDiscs.cell;
        } else {
          flush();
        }
      }
      flush();
    }
  }
}

void DrawDiscs(const std::array<std::string_view, 2>& titles, std::string_view up, Svg* svg) {
  for (std::size_t disc = 0; disc < 2; ++disc) {
    const double centre = kDiscs.centres[disc];
    svg->Line(
        centre - kDiscs.radius, kDiscs.centre_y, centre + kDiscs.radius, kDiscs.centre_y, "ring");
    svg->Line(
        centre, kDiscs.centre_y - kDiscs.radius, centre, kDiscs.centre_y + kDiscs.radius, "ring");
    svg->Text(centre, kDiscs.centre_y + kDiscs.radius + 20.0, titles[disc], "middle title");
    svg->Text(centre + kDiscs.radius + 5.0, kDiscs.centre_y + 4.0, "+x", "start");
    svg->Text(centre, kDiscs.centre_y - kDiscs.radius - 5.0, disc == 0 ? "+y" : up, "middle");
  }
}

/// Draws an arrow with two heads through the centre of both views.
void DrawWeakAxis(const Eigen::Vector3d& axis, Svg* svg) {
  for (std::size_t disc = 0; disc < 2; ++disc) {
    const double x = kDiscs.centres[disc], y = kDiscs.centre_y;
    const Eigen::Vector2d tip(axis.x(), disc == 0 ? -axis.y() : -axis.z());
    if (tip.norm() < 2.0 * kLayout.line) {  // The axis points at the viewer.
      svg->Circle(x, y, kLayout.dot, "weak");
      continue;
    }
    for (const double side : {-1.0, 1.0})
      svg->Arrow({x, y}, {x + side * tip.x(), y + side * tip.y()}, "weak");
  }
}

Drawing DrawCoverage(const std::vector<PoseDirection>& directions, Triad triad) {
  if (directions.empty()) return {};
  Svg svg(620.0, 300.0, TriadTitle(triad) + " pose directions on two hemispheres");
  for (const double centre : kDiscs.centres)
    svg.Circle(centre, kDiscs.centre_y, kDiscs.radius, "disc");
  const std::vector<PoseDirection> patches = OfPatches(directions);
  ShadeHoles(patches, &svg);
  for (const double centre : kDiscs.centres) {
    svg.Circle(centre, kDiscs.centre_y, kDiscs.radius, "ring");
    for (const double height : {0.5, std::sqrt(0.75)}) {
      svg.Circle(centre, kDiscs.centre_y, DiscRadius(height), "ring");
    }
  }
  DrawDiscs({"z up", "z down (seen from above)"}, "+y", &svg);
  const std::size_t stride = (directions.size() + kMostPoints - 1) / kMostPoints;
  Points dots;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const auto [x, y] = OnDisc(directions[i].unit);
    if (!directions[i].counts) {
      svg.Cross(x, y, "rejected");
    } else if (stride == 1) {
      const int pose = directions[i].pose;
      svg.Circle(x, y, kLayout.dot, "after", {"pose " + std::to_string(pose), pose});
    } else if (i % stride == 0) {
      dots.emplace_back(x, y);
    }
  }
  svg.Dots(dots, "dots");
  if (const auto [middle, gap_deg] = GapBetween(patches); gap_deg > kHoleDeg) {
    const auto [x, y] = OnDisc(middle);
    svg.Circle(x, y, 7.0, "next");
    svg.Text(x, y + 18.0, "next", "middle small");
  }
  return {svg.Finish(),
          TriadTitle(triad) +
              ": directions of the poses in the body frame, equal-area discs; rings at 30 and 60° "
              "above the equator. Shaded: further than " +
              Significant(kHoleDeg, 2) + "° from every pose.",
          std::string(TriadName(triad))};
}

std::string SphereCaption(const Calibration& calibration, Triad triad, double factor) {
  std::string text = TriadTitle(triad) + ": readings of each pose before (orange) and after (blue)";
  text += factor > 1.0 ? ", errors drawn " + Significant(factor, 7) + " times as large" : "";
  const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
  if (sensor && !NominalTruthPerRaw(*sensor, triad)) text += "; counts scaled by their mean gain";
  text += ". Circle: readings without errors.";
  if (const std::optional<WeakAxis> weak = WeakAxisOf(calibration, triad)) {
    text += " Arrow: along (" + Joined(Fixed(weak->direction, 2)) + ") the bias is known to " +
            Significant(weak->sigma, 2) + ' ' + TruthUnit(triad) + ", across it to " +
            Significant(weak->across, 2) + " or better; poses with this axis " +
            (triad == Triad::kAccelerometer ? "up and down" : "along and against the field") +
            " would determine the bias along the arrow better.";
  }
  return text;
}

/// "0.1,0.2,0.3,4.56": the drawn position of a reading, and its error in the scene's unit.
std::string SceneReading(const Eigen::Vector3d& reading,
                         const SpherePoint& point,
                         double factor,
                         double strength) {
  return Joined(Fixed(Magnified(reading, point.truth, factor), 4), ",") + ',' +
         Significant(strength * (reading - point.truth).norm(), 3);
}

/// The data of sphere.js as JSON.
std::string SceneOf(const Calibration& calibration,
                    Triad triad,
                    const std::vector<SpherePoint>& points,
                    double factor) {
  const bool is_force = triad == Triad::kAccelerometer;
  const double strength = is_force ? 1e3 * calibration.reference.gravity_mps2 / kStandardGravityMps2
                                   : calibration.reference.field_ut.value_or(0.0);
  std::string json = "{\"sensor\":\"" + TriadTitle(triad) + "\",\"unit\":\"" +
                     (is_force ? "mg" : "µT") + "\",\"magnification\":" + Significant(factor, 3) +
                     ",\"reach\":" + Fixed(SphereReach(points, factor), 3) + ",\"poses\":[";
  std::string_view between = "\n[";
  for (const SpherePoint& point : GreatestOfRuns(points, kMostPoints)) {
    json += std::string(between) + std::to_string(point.pose) +
            (point.is_rejected ? ",1," : ",0,") + SceneReading(point.raw, point, factor, strength) +
            ',' + SceneReading(point.corrected, point, factor, strength) + ']';
    between = ",\n[";
  }
  return json + "]}";
}

}  // namespace

Drawing CoverageDrawing(const Quality& quality, Triad triad) {
  return DrawCoverage(DirectionsOf(quality, triad), triad);
}

Drawing CoverageDrawing(const std::vector<Eigen::Vector3d>& unit, Triad triad) {
  std::vector<PoseDirection> directions;
  for (const Eigen::Vector3d& u : unit) {
    directions.push_back({u, true, static_cast<int>(directions.size()) + 1});
  }
  return DrawCoverage(directions, triad);
}

Drawing SphereDrawing(const Calibration& calibration, Triad triad, bool turns) {
  const std::vector<SpherePoint> all = SpherePoints(calibration, triad);
  if (all.empty()) return {};
  const double factor = SphereMagnification(all);
  // The radius of the sphere leaves room for the raw readings outside it.
  const double unit = std::min(kDiscs.sphere, kDiscs.reach / SphereReach(all, factor));
  Svg svg(620.0, 300.0, TriadTitle(triad) + ": readings before and after on the sphere");
  for (const double centre : kDiscs.centres) svg.Circle(centre, kDiscs.centre_y, unit, "disc");
  DrawDiscs({"seen from +z", "seen from −y"}, "+z", &svg);
  if (const std::optional<WeakAxis> weak = WeakAxisOf(calibration, triad)) {
    DrawWeakAxis(unit * weak->direction, &svg);
  }
  const std::vector<SpherePoint> points = GreatestOfRuns(all, kMostPoints);
  for (std::size_t disc = 0; disc < 2; ++disc) {
    // Rejected readings may be anywhere, so positions are clamped.
    const auto at = [&](const Eigen::Vector3d& reading, const Eigen::Vector3d& truth) {
      const Eigen::Vector3d v = unit * Magnified(reading, truth, factor);
      return std::pair(
          kDiscs.centres[disc] + std::clamp(v.x(), -kDiscs.reach, kDiscs.reach),
          kDiscs.centre_y - std::clamp(disc == 0 ? v.y() : v.z(), -kDiscs.reach, kDiscs.reach));
    };
    Points raw, corrected, left_out;
    for (const SpherePoint& point : points) {
      const auto before = at(point.raw, point.truth), after = at(point.corrected, point.truth);
      if (points.size() <= kMostPoints / 4) {
        svg.Line(before.first, before.second, after.first, after.second, "grid");
      }
      raw.push_back(before);
      (point.is_rejected ? left_out : corrected).push_back(after);
    }
    svg.Dots(raw, "dots raw");
    svg.Dots(corrected, "dots");
    for (const auto& [x, y] : left_out) svg.Cross(x, y, "rejected");
  }
  return {.svg = svg.Finish(),
          .caption = SphereCaption(calibration, triad, factor),
          .scene = turns ? SceneOf(calibration, triad, all, factor) : ""};
}

std::optional<NextPose> NextPoseFor(const Calibration& calibration) {
  std::optional<NextPose> next;
  double largest = kHoleDeg;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const std::vector<PoseDirection> directions =
        OfPatches(DirectionsOf(calibration.quality, triad));
    if (directions.empty()) continue;
    const auto [middle, gap_deg] = GapBetween(directions);
    if (!(gap_deg > largest + 1.0)) continue;  // Of two equal gaps the first is kept.
    largest = gap_deg;
    // An accelerometer reads up; a magnetometer reads the field: north and down by the dip.
    const double dip = calibration.reference.dip_rad.value_or(0.0);
    const Eigen::Vector3d world = triad == Triad::kAccelerometer
                                      ? Eigen::Vector3d(0.0, 0.0, 1.0)
                                      : Eigen::Vector3d(std::cos(dip), 0.0, -std::sin(dip));
    next = NextPose{triad, middle, Eigen::Quaterniond::FromTwoVectors(middle, world)};
  }
  return next;
}

Drawing NextPoseDrawing(const Calibration& calibration) {
  const std::optional<NextPose> next = NextPoseFor(calibration);
  if (!next) return {};
  return {PosePicture(next->world_from_body, "the next pose"),
          "The pose that would close the largest gap of the " +
              std::string(TriadName(next->triad)) + ": " +
              (next->triad == Triad::kAccelerometer ? "up" : "the field") + " is along (" +
              Joined(Fixed(next->direction, 2)) + ") in the body frame."};
}

}  // namespace truetriad
