// SPDX-License-Identifier: Apache-2.0
#include "report/sphere_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "model/corrected_error.h"
#include "model/directions.h"
#include "report/content.h"
#include "report/format.h"
#include "report/sphere_points.h"
#include "report/svg.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

constexpr std::size_t kMostDirections = 600;
constexpr double kRadius = 120.0;
constexpr double kCentreY = 150.0;
constexpr std::array<double, 2> kCentres = {150.0, 450.0};

/// Unit vectors of one sensor's poses, and which count.
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

/// Of very many, one in each small patch of the sphere, about 3 degrees wide.
std::vector<PoseDirection> OfPatches(const std::vector<PoseDirection>& directions) {
  constexpr std::size_t kMany = 1000;
  constexpr double kPatch = 0.05;
  if (directions.size() <= kMany) return directions;
  std::set<std::array<int, 3>> seen;
  std::vector<PoseDirection> kept;
  for (const PoseDirection& direction : directions) {
    std::array<int, 3> patch;
    for (int i = 0; i < 3; ++i) {
      patch[static_cast<std::size_t>(i)] =
          static_cast<int>(std::lround(direction.unit[i] / kPatch));
    }
    if (direction.counts && seen.insert(patch).second) kept.push_back(direction);
  }
  return kept;
}

/// Cosine of the angle to the nearest pose that counts.
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

/// Lambert: equal areas of the sphere are equal areas of the disc, so crowding is real.
double DiscRadius(double height) { return kRadius * std::sqrt(1.0 - height); }

std::pair<double, double> OnDisc(const Eigen::Vector3d& unit) {
  const double across = std::hypot(unit.x(), unit.y());
  const double scale = across > 0.0 ? DiscRadius(std::abs(unit.z())) / across : 0.0;
  return {kCentres[unit.z() >= 0.0 ? 0 : 1] + scale * unit.x(), kCentreY - scale * unit.y()};
}

/// Rows of small cells whose middles are further than kHoleDeg from every pose.
void ShadeHoles(const std::vector<PoseDirection>& directions, Svg* svg) {
  constexpr double kCell = 6.0;
  const double limit = std::cos(kHoleDeg / kDegPerRad);
  for (std::size_t disc = 0; disc < 2; ++disc) {
    for (double y = -kRadius; y < kRadius; y += kCell) {
      double begin = 0.0, end = 0.0;
      const auto flush = [&] {
        if (end > begin) {
          svg->Rectangle(kCentres[disc] + begin, kCentreY + y, end - begin, kCell, "hole");
        }
        begin = end = 0.0;
      };
      for (double x = -kRadius; x < kRadius; x += kCell) {
        const double u = (x + 0.5 * kCell) / kRadius, v = -(y + 0.5 * kCell) / kRadius;
        const double square = u * u + v * v;
        // r^2 = 1 - |z| on the disc.
        const double height = 1.0 - square;
        const double stretch =
            square > 0.0 ? std::sqrt(std::max(1.0 - height * height, 0.0) / square) : 0.0;
        const Eigen::Vector3d point(u * stretch, v * stretch, disc == 0 ? height : -height);
        if (square <= 1.0 && NearestCosine(directions, point) < limit) {
          if (!(end > begin)) begin = x;
          end = x + kCell;
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
    const double centre = kCentres[disc];
    svg->Line(centre - kRadius, kCentreY, centre + kRadius, kCentreY, "ring");
    svg->Line(centre, kCentreY - kRadius, centre, kCentreY + kRadius, "ring");
    svg->Text(centre, kCentreY + kRadius + 20.0, titles[disc], "middle title");
    svg->Text(centre + kRadius + 5.0, kCentreY + 4.0, "+x", "start");
    svg->Text(centre, kCentreY - kRadius - 5.0, disc == 0 ? "+y" : up, "middle");
  }
}

/// An arrow with two heads through the middle of both views.
void DrawWeakAxis(const Eigen::Vector3d& axis, Svg* svg) {
  constexpr double kHead = 9.0, kHalfWidth = 4.0;
  for (std::size_t disc = 0; disc < 2; ++disc) {
    const Eigen::Vector2d tip(axis.x(), disc == 0 ? -axis.y() : -axis.z());
    const Eigen::Vector2d centre(kCentres[disc], kCentreY);
    if (tip.norm() < 2.0 * kHead) {  // It points at the reader.
      svg->Circle(centre.x(), centre.y(), kHalfWidth, "weak");
      continue;
    }
    svg->Line(centre.x() - tip.x(),
              centre.y() - tip.y(),
              centre.x() + tip.x(),
              centre.y() + tip.y(),
              "weak");
    const Eigen::Vector2d along = tip.normalized(), across(-along.y(), along.x());
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector2d end = centre + side * tip, base = end - side * kHead * along;
      const Eigen::Vector2d left = base + kHalfWidth * across, right = base - kHalfWidth * across;
      svg->Polyline({{left.x(), left.y()}, {end.x(), end.y()}, {right.x(), right.y()}}, "weak");
    }
  }
}

std::string DrawCoverage(const std::vector<PoseDirection>& directions, Triad triad) {
  if (directions.empty()) return "";
  Svg svg(620.0, 300.0, TriadTitle(triad) + " pose directions on two hemispheres");
  for (const double centre : kCentres) svg.Circle(centre, kCentreY, kRadius, "disc");
  const std::vector<PoseDirection> patches = OfPatches(directions);
  ShadeHoles(patches, &svg);
  for (const double centre : kCentres) {
    svg.Circle(centre, kCentreY, kRadius, "ring");
    for (const double height : {0.5, std::sqrt(0.75)}) {
      svg.Circle(centre, kCentreY, DiscRadius(height), "ring");
    }
  }
  DrawDiscs({"z up", "z down (seen from above)"}, "+y", &svg);
  const std::size_t stride = (directions.size() + kMostDirections - 1) / kMostDirections;
  std::vector<std::pair<double, double>> dots;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const auto [x, y] = OnDisc(directions[i].unit);
    if (!directions[i].counts) {
      svg.Cross(x, y, 4.0, "rejected");
    } else if (stride == 1) {
      svg.Mark(x, y, "after", directions[i].pose, "pose " + std::to_string(directions[i].pose));
    } else if (i % stride == 0) {
      dots.emplace_back(x, y);
    }
  }
  if (!dots.empty()) svg.Dots(dots, "dots");
  if (const auto [middle, gap_deg] = GapBetween(patches); gap_deg > kHoleDeg) {
    const auto [x, y] = OnDisc(middle);
    svg.Circle(x, y, 7.0, "next");
    svg.Text(x, y + 18.0, "next", "middle small");
  }
  return svg.Finish();
}

}  // namespace

std::string CoverageChart(const Quality& quality, Triad triad) {
  return DrawCoverage(DirectionsOf(quality, triad), triad);
}

std::string CoverageChart(const std::vector<Eigen::Vector3d>& unit, Triad triad) {
  std::vector<PoseDirection> directions;
  for (const Eigen::Vector3d& u : unit) {
    directions.push_back({u, true, static_cast<int>(directions.size()) + 1});
  }
  return DrawCoverage(directions, triad);
}

std::string CoverageCaption(Triad triad) {
  return TriadTitle(triad) +
         ": directions of the poses in the body frame, equal-area discs; rings at 30 and 60° above "
         "the equator. Shaded: further than " +
         Significant(kHoleDeg, 2) + "° from every pose.";
}

std::string SphereChart(const Calibration& calibration, Triad triad) {
  const std::vector<SpherePoint> all = SpherePoints(calibration, triad);
  if (all.empty()) return "";
  const double factor = SphereMagnification(all);
  // The sphere is as large as raw readings beside it leave room for.
  constexpr double kLargest = 85.0, kMost = 118.0;
  const double unit = std::min(kLargest, kMost / SphereReach(all, factor));
  Svg svg(620.0, 300.0, TriadTitle(triad) + ": readings before and after on the sphere");
  for (const double centre : kCentres) svg.Circle(centre, kCentreY, unit, "disc");
  DrawDiscs({"seen from +z", "seen from −y"}, "+z", &svg);
  if (const std::optional<WeakAxis> weak = WeakAxisOf(calibration, triad)) {
    DrawWeakAxis(unit * weak->direction, &svg);
  }
  const std::vector<SpherePoint> points = GreatestOfRuns(all, kMostDirections);
  for (std::size_t disc = 0; disc < 2; ++disc) {
    // What is rejected may be anywhere.
    const auto at = [&](const Eigen::Vector3d& reading, const Eigen::Vector3d& truth) {
      const Eigen::Vector3d v = unit * Magnified(reading, truth, factor);
      return std::pair(kCentres[disc] + std::clamp(v.x(), -kMost, kMost),
                       kCentreY - std::clamp(disc == 0 ? v.y() : v.z(), -kMost, kMost));
    };
    std::vector<std::pair<double, double>> raw, corrected, left_out;
    for (const SpherePoint& point : points) {
      const auto before = at(point.raw, point.truth), after = at(point.corrected, point.truth);
      if (points.size() <= kMostDirections / 4) {
        svg.Line(before.first, before.second, after.first, after.second, "grid");
      }
      raw.push_back(before);
      (point.is_rejected ? left_out : corrected).push_back(after);
    }
    svg.Dots(raw, "dots raw");
    if (!corrected.empty()) svg.Dots(corrected, "dots");
    for (const auto& [x, y] : left_out) svg.Cross(x, y, 3.5, "rejected");
  }
  return svg.Finish();
}

std::string SphereCaption(const Calibration& calibration, Triad triad) {
  const double factor = SphereMagnification(SpherePoints(calibration, triad));
  std::string text = TriadTitle(triad) + ": readings of each pose before (orange) and after (blue)";
  text += factor > 1.0 ? ", errors drawn " + Significant(factor, 7) + " times as large" : "";
  const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
  if (sensor && !NominalTruthPerRaw(*sensor, triad)) text += "; counts taken by their mean gain";
  text += ". Circle: what there is to read.";
  if (const std::optional<WeakAxis> weak = WeakAxisOf(calibration, triad)) {
    const Eigen::Vector3d& u = weak->direction;
    text += " Arrow: along (" + Fixed(u.x(), 2) + ", " + Fixed(u.y(), 2) + ", " + Fixed(u.z(), 2) +
            ") the bias is known to " + Significant(weak->sigma, 2) + ' ' + TruthUnit(triad) +
            ", across it to " + Significant(weak->across, 2) + " or better; poses with this axis " +
            (triad == Triad::kAccelerometer ? "up and down" : "along and against the field") +
            " tell more of it.";
  }
  return text;
}

std::optional<NextPose> NextPoseFor(const Calibration& calibration) {
  std::optional<NextPose> next;
  double largest = kHoleDeg;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const std::vector<PoseDirection> directions =
        OfPatches(DirectionsOf(calibration.quality, triad));
    if (directions.empty()) continue;
    const auto [middle, gap_deg] = GapBetween(directions);
    if (!(gap_deg > largest + 1.0)) continue;  // of two alike, the first
    largest = gap_deg;
    // What the sensor reads points up, or along the field: north and down by the dip.
    const double dip = calibration.reference.dip_rad.value_or(0.0);
    const Eigen::Vector3d world = triad == Triad::kAccelerometer
                                      ? Eigen::Vector3d(0.0, 0.0, 1.0)
                                      : Eigen::Vector3d(std::cos(dip), 0.0, -std::sin(dip));
    next = NextPose{triad, middle, Eigen::Quaterniond::FromTwoVectors(middle, world)};
  }
  return next;
}

}  // namespace truetriad
