// SPDX-License-Identifier: Apache-2.0
#include "report/sphere_scene.h"

#include <cstddef>
#include <vector>

#include "report/content.h"
#include "report/format.h"
#include "report/sphere_points.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

/// "0.1,0.2,0.3,4.56": where a reading is drawn, and how far it is off in the scene's unit.
std::string Reading(const Eigen::Vector3d& reading,
                    const SpherePoint& point,
                    double magnification,
                    double strength) {
  const Eigen::Vector3d drawn = Magnified(reading, point.truth, magnification);
  std::string text;
  for (int i = 0; i < 3; ++i) text += Fixed(drawn[i], 4) + ',';
  return text + Significant(strength * (reading - point.truth).norm(), 3);
}

}  // namespace

std::string SphereScene(const Calibration& calibration, Triad triad, const std::string& figure) {
  const std::vector<SpherePoint> points = SpherePoints(calibration, triad);
  if (points.empty()) return figure;
  const bool is_force = triad == Triad::kAccelerometer;
  const double strength = is_force ? 1e3 * calibration.reference.gravity_mps2 / kStandardGravityMps2
                                   : calibration.reference.field_ut.value_or(0.0);
  const double magnification = SphereMagnification(points);
  std::string json = "{\"sensor\":\"" + TriadTitle(triad) + "\",\"unit\":\"" +
                     (is_force ? "mg" : "µT") +
                     "\",\"magnification\":" + Significant(magnification, 3) +
                     ",\"reach\":" + Fixed(SphereReach(points, magnification), 3) + ",\"poses\":[";
  constexpr std::size_t kMost = 1000;
  const std::vector<SpherePoint> shown = GreatestOfRuns(points, kMost);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const SpherePoint& point = shown[i];
    json += (i == 0 ? "\n[" : ",\n[") + std::to_string(point.pose) + ',' +
            (point.is_rejected ? "1," : "0,") + Reading(point.raw, point, magnification, strength) +
            ',' + Reading(point.corrected, point, magnification, strength) + ']';
  }
  return "<div class=\"sphere\">\n" + figure + "<script type=\"application/json\">" + json +
         "]}</script>\n</div>\n";
}

}  // namespace truetriad
