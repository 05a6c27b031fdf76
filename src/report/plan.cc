// SPDX-License-Identifier: Apache-2.0
#include "truetriad/planning/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "model/attitude_sets.h"
#include "report/charts.h"
#include "report/content.h"
#include "report/page.h"
#include "report/svg.h"
#include "report/table.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

/// The sizes of a picture in user units, and the position of the viewer.
struct PictureLayout {
  double width = 200.0;
  double height = 214.0;    ///< The cube and its arrows, and below them the compass.
  double half_edge = 44.0;  ///< Half an edge of the cube, with room for the arrows.
  double arrow = 1.85;      ///< Length of an axis from the centre, in half edges.
  double flat = 0.25;       ///< A face whose cosine to the viewer is smaller has no name.
  double azimuth = 28.0 * kRadPerDeg;    ///< The view from north towards west, to see three faces.
  double elevation = 24.0 * kRadPerDeg;  ///< The viewer looks down by this angle.
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
    // Axes that point away from the viewer are drawn first, behind the cube.
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

  // Draws the directions of north and up in a corner of the picture.
  void Compass() {
    const Point centre = camera_.On(Eigen::Vector3d::Zero());
    const auto at = [&](const Eigen::Vector3d& world) {
      const Point point = camera_.On(world);
      return Point(point.first - centre.first + 16.0, point.second - centre.second + 200.0);
    };
    for (const auto& [to, name] : {std::pair(Eigen::Vector3d(1.0, 0.0, 0.0), "N"),
                                   std::pair(Eigen::Vector3d(0.0, 0.0, 0.6), "up")}) {
      svg_.Arrow(at(Eigen::Vector3d::Zero()), at(to), "world");
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
    // The light comes from above.
    const int shade = std::clamp(static_cast<int>(std::lround(normal.z() + 1.0)), 0, 2);
    svg_.Polyline(corners, "face shade" + std::to_string(shade));
    const auto [x, y] = camera_.On(normal);
    if (sign < 0.0 && camera_.Depth(normal) < -kPicture.flat) {
      svg_.Text(x, y + 4.0, std::string("−") + Name(axis), "middle back");
    }
  }

  void Axis(int axis) {
    const Eigen::Vector3d direction = rotation_.col(axis);
    svg_.Arrow(camera_.On(direction),
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

namespace {

/// "magnetometer.misalignment_rad.xy" -> "magnetometer misalignment xy",
/// "accelerometer.thermal.bias.2.x" -> "accelerometer bias τ² x".
std::string Spoken(std::string name) {
  for (const auto& [from, to] : {std::pair(".thermal.bias.", ".bias.τ^"),
                                 std::pair(".thermal.sensitivity.", ".sensitivity.τ^"),
                                 std::pair(".thermal.rate.", ".bias.rate.")}) {
    if (const std::size_t at = name.find(from); at != std::string::npos) {
      name.replace(at, std::string_view(from).size(), to);
    }
  }
  for (const char* unit : {"_rad", "_ut", "_mps2", "_error"}) {
    if (const std::size_t at = name.find(unit); at != std::string::npos) {
      name.erase(at, std::string(unit).size());
    }
  }
  std::replace(name.begin(), name.end(), '.', ' ');
  return DisplayUnit(name);
}

/// σ in customary units: shares in per cent, angles in milliradians.
std::string SigmaText(double sigma, const std::string& unit) {
  if (!std::isfinite(sigma)) return "unobservable";
  if (unit.empty()) return Significant(100.0 * sigma, 3);
  if (unit == "rad") return Significant(1000.0 * sigma, 3);
  return Significant(sigma, 3);
}

std::string ShownUnit(const std::string& unit) {
  if (unit.empty()) return "%";
  return unit == "rad" ? "mrad" : DisplayUnit(unit);
}

std::string UnitOf(const Plan& plan, const std::string& group) {
  for (const PlannedSigma& sigma : plan.sigmas) {
    if (sigma.group == group) return sigma.unit;
  }
  return "";
}

Table WantedTable(const Plan& plan) {
  Table table =
      Headed("wanted; result; at most; reached; unit; poses needed for this alone", "llrrlr");
  for (const WantedSigma& item : plan.wanted) {
    const std::string unit = UnitOf(plan, item.group);
    table.Add() << Spoken(item.group) << (item.met ? "pass" : "FAIL")
                << SigmaText(item.wanted, unit) << SigmaText(item.reached, unit) << ShownUnit(unit)
                << (item.poses_needed ? std::to_string(*item.poses_needed) : "–");
  }
  return table;
}

Table SigmaTable(const Plan& plan) {
  const bool has_before = plan.measured_poses > 0;
  Table table = has_before ? Headed("σ of; before; after; unit", "lrrl")
                           : Headed("σ of; predicted; unit", "lrl");
  for (const PlannedSigma& sigma : plan.sigmas) {
    TableRow row = table.Add();
    row << Spoken(sigma.name);
    if (has_before) row << SigmaText(sigma.before, sigma.unit);
    row << SigmaText(sigma.after, sigma.unit) << ShownUnit(sigma.unit);
  }
  return table;
}

std::vector<Block> NoiseBlocks(const Plan& plan) {
  Table table = Headed("σ of a pose's mean; x; y; z; unit; ", "lrrrll");
  for (const PlannedNoise& planned : plan.noise) {
    const std::string sensor(TriadName(planned.triad));
    const TriadNoise& noise = planned.noise;
    table.Add() << sensor << Significant(noise.sigma, 3) << DisplayUnit(planned.unit)
                << NoiseSourceWords(noise.source);
    if (!(noise.excess_sigma > 0.0)) continue;
    const std::string excess = Significant(noise.excess_sigma, 3);
    table.Add() << sensor + ", plus pose-to-pose noise" << excess << excess << excess
                << TruthUnit(planned.triad) << "";
  }
  return {"The σ above assume this noise.", table};
}

std::string RandomText(const Plan& plan) {
  const RandomComparison& random = *plan.random;
  const std::string count = std::to_string(plan.program.poses.size());
  std::string text = count + " random poses would give σ " + Significant(random.gain, 3) +
                     " times as large (geometric mean over all " +
                     std::to_string(plan.sigmas.size()) + " quantities; median of " +
                     std::to_string(random.draws) + " random sets, half of them between " +
                     Significant(random.gain_low, 3) + " and " + Significant(random.gain_high, 3) +
                     ").";
  if (random.equal_poses) {
    text += " " + std::to_string(*random.equal_poses) + " random poses would give the same σ.";
  }
  return text;
}

Headline HeadlineOf(const Plan& plan) {
  Headline headline;
  const std::size_t count = plan.program.poses.size();
  const std::string poses =
      std::to_string(count) + (count == 1 ? " pose" : " poses") +
      (plan.measured_poses > 0
           ? " in addition to the " + std::to_string(plan.measured_poses) + " measured ones"
           : "");
  // The number of poses with the verb in the singular or the plural.
  const auto does = [&](const std::string& plural, const std::string& singular) {
    return poses + ' ' + (count == 1 ? singular : plural);
  };
  if (!plan.determined) {
    headline.text = "NOT ENOUGH";
    headline.explanation = does("do", "does") + " not make every enabled parameter observable.";
  } else if (!plan.rehearsed) {
    headline.text = "CANNOT BE CALIBRATED";
    headline.explanation =
        does("have", "has") + " enough information, but the calibration finds no start values.";
  } else if (!plan.IsMet()) {
    headline.text = "NOT AS GOOD AS WANTED";
    headline.explanation = does("do", "does") + " not reach every wanted σ.";
  } else {
    headline.grade = Grade::kGood;
    headline.text = plan.wanted.empty() ? "GOOD PLAN" : "GOOD PLAN, as wanted";
    headline.explanation = plan.wanted.empty()
                               ? does("determine", "determines") + " every parameter."
                               : does("reach", "reaches") + " every wanted σ.";
  }
  return headline;
}

/// The label of a pose, or its attitude in words if the program gives no label.
std::string LabelOf(const ProgramPose& pose) {
  return pose.label.empty() ? AttitudeInWords(pose.world_from_body) : pose.label;
}

std::string RestText(const Plan& plan) {
  if (plan.rest_s > 0.0) {
    return "Let the unit rest for " + Significant(plan.rest_s, 3) + " s in each pose.";
  }
  return "Let the unit rest in each pose until its mean has the noise assumed below; state "
         "plan.rest_s to get a time.";
}

/// The parameter whose σ grows most without pose `k` (counted from zero): "magnetometer scale x, σ
/// × 1.50".
std::string PurposeText(const Plan& plan, std::size_t k) {
  const PosePurpose& purpose = plan.purposes[k];
  // If some parameter is unobservable anyway, no pose can be called redundant.
  if (purpose.name.empty()) return plan.determined ? "nothing: the other poses suffice" : "–";
  // Non-breaking spaces keep "σ × 1.50" on one line.
  return Spoken(purpose.name) + ", " +
         (std::isfinite(purpose.sigma_ratio) ? "σ\u00a0×\u00a0" + Fixed(purpose.sigma_ratio, 2)
                                             : "unobservable");
}

Table ProgramTable(const Plan& plan) {
  const bool has_temperatures = std::any_of(
      plan.program.poses.begin(), plan.program.poses.end(), [](const ProgramPose& pose) {
        return pose.temperature_degc.has_value();
      });
  Table table = has_temperatures ? Headed("pose; attitude; degC; most affected if skipped", "rlrl")
                                 : Headed("pose; attitude; most affected if skipped", "rll");
  for (std::size_t k = 0; k < plan.program.poses.size(); ++k) {
    const ProgramPose& pose = plan.program.poses[k];
    TableRow row = table.Add();
    row << k + 1 << LabelOf(pose);
    if (has_temperatures) {
      row << (pose.temperature_degc ? Significant(*pose.temperature_degc, 4) : "");
    }
    row << PurposeText(plan, k);
  }
  return table;
}

/// All sections except that of the poses. An empty section is left out.
std::vector<Section> SectionsOf(const Plan& plan) {
  std::vector<Section> sections;
  if (!plan.wanted.empty()) sections.push_back({"Wanted", {WantedTable(plan)}});
  Section weak{"Weakly observable with these poses", {}}, messages{"Messages", {}};
  for (const auto& [description, advice, sigma] : plan.weak_directions) {
    weak.Add(Bullet{description + (advice.empty() ? "" : ": " + advice)});
  }
  for (const std::string& message : plan.messages) messages.Add(Bullet{message});
  for (Section& section : std::vector{weak, messages}) {
    if (!section.blocks.empty()) sections.push_back(std::move(section));
  }
  sections.push_back({"Predicted uncertainty, one sigma", {SigmaTable(plan)}});
  sections.push_back({"Assumed noise", NoiseBlocks(plan)});
  if (plan.random && std::isfinite(plan.random->gain)) {
    sections.push_back({"Compared with random poses", {RandomText(plan)}});
  }
  return sections;
}

constexpr std::string_view kCardStyle = R"css(
ol.poses{display:grid;grid-template-columns:repeat(auto-fill,minmax(12rem,1fr));gap:1rem;padding:0;list-style:none}
ol.poses li{margin:0;padding:.7rem;border:1px solid var(--line);border-radius:6px;break-inside:avoid}
ol.poses b{font-size:1.4rem}.poses svg{min-width:0}ol.poses .done{float:right;width:1.2rem;height:1.2rem;border:1.5px solid var(--zero);border-radius:3px}
ol.poses .heat{float:right;margin-right:.6rem;font-weight:600;color:var(--bad)}ol.poses small{display:block;white-space:normal;color:var(--soft);overflow-wrap:anywhere}
)css";

std::string Card(const Plan& plan, std::size_t k) {
  const ProgramPose& pose = plan.program.poses[k];
  const std::string number = std::to_string(k + 1);
  std::string card = "<li><span class=\"done\"></span>";
  if (pose.temperature_degc) {
    card += "<span class=\"heat\">" + EscapeMarkup(Significant(*pose.temperature_degc, 4) + " °C") +
            "</span>";
  }
  card += Element("b", number) + PosePicture(pose.world_from_body, "pose " + number) +
          Element("div", LabelOf(pose));
  return card + Element("small", "Most affected if skipped: " + PurposeText(plan, k)) + "</li>\n";
}

/// Whether the heading matters: gravity does not depend on the heading, but a magnetometer does.
bool HeadingMatters(const Plan& plan) {
  return std::any_of(plan.sigmas.begin(), plan.sigmas.end(), [](const PlannedSigma& sigma) {
    return sigma.group.rfind(TriadName(Triad::kMagnetometer), 0) == 0;
  });
}

}  // namespace

VerbReport ReportOf(const Plan& plan) {
  const Headline headline = HeadlineOf(plan);
  const std::vector<Section> others = SectionsOf(plan);
  const Section poses{"Poses, in this order", {RestText(plan), ProgramTable(plan)}};
  std::string html =
      "<section>\n<h2>Take these poses, in this order</h2>\n"
      "<p>Each picture shows the unit from slightly above; " +
      std::string(HeadingMatters(plan) ? "the arrow N points to magnetic north"
                                       : "the heading (N) does not matter") +
      ". x, y and z are the unit's axes; the face marked −x is opposite x. Place the unit as "
      "drawn, take your hands off, let it rest, tick the box, continue. " +
      EscapeMarkup(RestText(plan)) +
      "</p>\n"
      "<ol class=\"poses\">\n";
  for (std::size_t k = 0; k < plan.program.poses.size(); ++k) html += Card(plan, k);
  html += "</ol>\n</section>\n" + HtmlOf(others);
  return {headline.grade,
          TextOf(headline) + TextOf(std::vector{poses}) + TextOf(others),
          HtmlPage("Pose program", headline, html, {.style = kCardStyle})};
}

}  // namespace truetriad
