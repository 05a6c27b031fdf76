// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "base/messages.h"
#include "base/sensor_line.h"
#include "problem/hemisphere.h"
#include "problem/lay_out.h"
#include "solve/field_side.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"
#include "verdict/checks/check.h"

namespace truetriad {
namespace {

// One interpretation of the sensors' axes: the body frame as solved, or with renamed axes.
struct MountingView {
  PerTriad<std::optional<Eigen::Matrix3d>> maps;
  std::vector<Triad> against;   // sensors whose stated mounting it contradicts
  std::vector<Triad> mirrored;  // left-handed, with no stated mounting
  bool blames_attitudes = false;
  int axes = 0;   // number of axes that differ from the stated mountings
  int other = 0;  // number of axes unlike the body's, of sensors with no stated mounting

  std::size_t faults() const { return against.size() + mirrored.size() + blames_attitudes; }
  bool Contradicts() const { return blames_attitudes || !against.empty(); }
};

// The fit with the axes of the body frame renamed by T: S' = S T. Rates are axial vectors, which a
// mirror reverses: for a gyroscope, S' = det(T) S T.
MountingView ViewOf(const CalibrateOptions& options,
                    const PoseGraph& graph,
                    const Eigen::Matrix3d& T) {
  MountingView view;
  view.blames_attitudes = options.IsBodyKnown() && !T.isIdentity(0.0);
  if (view.blames_attitudes) view.axes = 3;
  for (const Triad triad : kTriads) {
    if (!options.triads[triad].enabled) continue;
    Eigen::Matrix3d map = NearestAxisMap(graph.sensitivity(triad)) * T;
    if (triad == Triad::kGyroscope) map *= T.determinant();
    if (triad == Triad::kAccelerometer) map *= LeadingAxisSign(options);
    view.maps[triad] = map;
    const std::optional<Eigen::Matrix3d>& stated = options.triads[triad].mounting;
    if (stated && map != *stated) {
      view.against.push_back(triad);
      view.axes += AxesThatDiffer(map, *stated);
    }
    if (!stated && map.determinant() < 0.0) view.mirrored.push_back(triad);
    if (!stated) view.other += AxesThatDiffer(map, Eigen::Matrix3d::Identity());
  }
  return view;
}

// The interpretations with the fewest contradictions, the simplest first. If several contradict the
// same sensors, only the one that changes the fewest axes is listed.
std::vector<MountingView> LikeliestViews(const CalibrateOptions& options, const PoseGraph& graph) {
  std::vector<MountingView> views;
  for (const Eigen::Matrix3d& T : AllAxisMaps()) views.push_back(ViewOf(options, graph, T));
  std::stable_sort(views.begin(), views.end(), [](const MountingView& a, const MountingView& b) {
    return std::tuple(a.faults(), a.axes, a.other) < std::tuple(b.faults(), b.axes, b.other);
  });
  std::vector<MountingView> likeliest;
  for (const MountingView& view : views) {
    if (view.faults() > views.front().faults()) break;
    const bool is_new =
        std::none_of(likeliest.begin(), likeliest.end(), [&](const MountingView& other) {
          return view.against == other.against && view.mirrored == other.mirrored &&
                 view.blames_attitudes == other.blames_attitudes;
        });
    if (is_new) likeliest.push_back(view);
  }
  return likeliest;
}

// "mounting: { accelerometer: -x+y+z }", for the experiment.
std::string MountingLine(const MountingView& view, const std::vector<Triad>& triads) {
  std::string line;
  for (const Triad triad : triads) {
    line += line.empty() ? "`mounting: { " : ", ";
    line += std::string(TriadName(triad)) + ": " + AxisMapName(*view.maps[triad]);
  }
  return line + " }`";
}

std::string NamesOf(const std::vector<Triad>& triads) {
  std::vector<std::string> names;
  for (const Triad triad : triads) names.emplace_back(TriadName(triad));
  return Listed(names);
}

Finding Contradiction(const CalibrateOptions& options, const std::vector<MountingView>& views) {
  const std::string outside =
      options.HasGyroscopeAlone() ? "the stated turns and rates" : "the stated attitudes or faces";
  std::string who, lines;
  for (const MountingView& view : views) {
    const std::string blamed = view.against.empty() ? outside : NamesOf(view.against);
    who += (who.empty() ? "" : ", or ") + blamed;
    if (view.against.empty()) continue;
    lines += (lines.empty() ? "" : " or ") + MountingLine(view, view.against);
  }
  Finding finding(FindingCode::kMountingContradicted,
                  who + ": axes are swapped or reversed relative to " +
                      (options.IsBodyKnown() ? "what is stated" : "those of the other sensors"),
                  lines.empty() ? "correct the labels or attitudes"
                                : "correct columns or labels, or state the mounting: " + lines);
  const MountingView& first = views.front();
  const bool is_certain = views.size() == 1 || first.axes < views[1].axes || options.IsBodyKnown();
  if (is_certain && first.against.size() == 1) finding.About(first.against.front());
  return finding;
}

// Whether all axes of a magnetometer are reversed relative to an accelerometer. A wrong `sign` of
// the accelerometer causes this, since every attitude is then upside down, which a gyroscope does
// not show. A wrong `hemisphere` causes it, too.
bool IsReversedAgainst(const CalibrateOptions& options, Triad triad, const Eigen::Matrix3d& map) {
  return triad == Triad::kMagnetometer && options.triads[Triad::kAccelerometer].enabled &&
         !options.IsBodyKnown() && map == -Eigen::Matrix3d::Identity();
}
constexpr const char* kReversed =
    ": the accelerometer's `sign` or the `hemisphere` is stated wrongly, or one of the two logs "
    "reverses all axes";

// Findings for sensors whose axes differ from the body's and whose mounting was not stated.
Findings FoundMountings(const CalibrateOptions& options, const MountingView& view) {
  Findings findings;
  for (const Triad triad : kTriads) {
    const TriadOptions& sensor = options.triads[triad];
    if (!view.maps[triad] || (sensor.mounting && !sensor.is_mounting_found)) continue;
    const Eigen::Matrix3d& map = *view.maps[triad];
    if (map.isIdentity(0.0)) continue;
    const bool is_judged = !options.limits.limits.empty();
    const bool is_reversed = IsReversedAgainst(options, triad, map);
    const std::string text =
        std::string(TriadName(triad)) + ": its sensing axes x, y, z lie along " + AxisMapName(map) +
        " of the body" + (is_judged ? ", which must be stated if limits are to be judged" : "") +
        (is_reversed ? kReversed : "");
    Finding& finding = findings.emplace_back(
        is_judged ? FindingCode::kMountingNotStated : FindingCode::kMountingFound,
        text,
        "if it is mounted so, state " + MountingLine(view, {triad}));
    if (!is_reversed) finding.About(triad);
  }
  return findings;
}

// The finding if a sensor came out left-handed and its mounting is not stated.
Finding LeftHanded(const CalibrateOptions& options, const MountingView& view) {
  const Triad triad = view.mirrored.front();
  // Whether the hemisphere is neither stated nor known from a dip.
  const bool is_side_guessed =
      !options.reference.is_hemisphere_stated && !options.reference.dip_rad.known();
  const std::string remedy =
      "south of the magnetic equator state `reference: { field: { "
      "hemisphere: south } }`, north of it `north`; if the accelerometer "
      "reads -g on the axis that points up, state " +
      SensorLine(Triad::kAccelerometer, "sign: gravity");
  if (IsReversedAgainst(options, triad, *view.maps[triad])) {
    Finding finding(
        FindingCode::kLeftHanded,
        "magnetometer: all of its axes came out reversed against the accelerometer's, -x-y-z" +
            std::string(is_side_guessed ? ", and the side of the magnetic equator is neither "
                                          "stated nor known from a dip"
                                        : kReversed),
        is_side_guessed ? remedy : "");
    return is_side_guessed ? finding.As(Severity::kRefusal) : finding;
  }
  const bool is_relative = !options.IsBodyKnown() && triad == Triad::kMagnetometer;
  const std::string against = is_relative ? " against the accelerometer's" : "";
  Finding finding(
      FindingCode::kLeftHanded,
      std::string(TriadName(triad)) + ": its axes came out left-handed" + against + ", " +
          AxisMapName(*view.maps[triad]) + ": one log swaps two axes or reverses one" +
          (is_relative ? ", or `sign` or `hemisphere` is wrong" : ""),
      is_relative && is_side_guessed ? "look for swapped or reversed axes; " + remedy : "");
  // Without a gyroscope, the accelerometer may be the left-handed one.
  if (!is_relative || options.triads[Triad::kGyroscope].enabled) finding.About(triad);
  return finding;
}

}  // namespace

Findings CheckMounting(const SettledRun& run, const SolvedRun&) {
  const CalibrateOptions& options = run.options;
  const std::vector<MountingView> views = LikeliestViews(options, run.graph);
  const auto good = std::find_if(
      views.begin(), views.end(), [](const MountingView& view) { return !view.Contradicts(); });
  if (good == views.end()) return {Contradiction(options, views)};
  Findings findings = FoundMountings(options, *good);
  if (!good->mirrored.empty() && OutcomeOf(findings) == Outcome::kConverged) {
    // A left-handed sensor is more specific than axes that differ from the body's.
    findings = {LeftHanded(options, *good)};
  }
  return findings;
}

Findings CheckHand(const SettledRun& run, const SolvedRun& solved) {
  const CalibrateOptions& options = run.options;
  const PoseGraph& graph = run.graph;
  if (options.triads[Triad::kMagnetometer].mounting) return {};
  const double dip_rad = graph.reference()[kDip];
  const double sigma_rad = solved.solution.covariance.Sigma("reference.dip_rad");
  if (MayReverse(options, graph.layout)) {
    if (IsSideOfEquatorTold(dip_rad, sigma_rad)) return {};
  } else {
    const auto other = OtherSideOfField(options, graph);
    if (!other || other->IsTold(solved.stated.quality.effective_dof)) return {};
  }
  const bool is_right = graph.sensitivity(Triad::kMagnetometer).determinant() > 0.0;
  return {Finding(FindingCode::kHandAssumed,
                  Format("magnetometer: a dip of %.2g", dip_rad / kRadPerDeg) +
                      (sigma_rad > 0.0 ? Format(" ± %.1g", sigma_rad / kRadPerDeg) : "") +
                      " deg leaves the sensor's sign open: with all axes reversed (" +
                      (is_right ? "left" : "right") + "-handed), it fits the readings equally well",
                  "state its `mounting`, or check a heading that is known")
              .About(Triad::kMagnetometer)
              .With("dip", dip_rad / kRadPerDeg, "deg")};
}

}  // namespace truetriad
