// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "report/charts.h"
#include "report/content.h"
#include "report/format.h"
#include "report/heading_chart.h"
#include "report/page.h"
#include "report/page_assets.h"
#include "report/pose_picture.h"
#include "report/residual_charts.h"
#include "report/soak_content.h"
#include "report/sphere_charts.h"
#include "report/sphere_scene.h"
#include "report/svg.h"
#include "report/sweep_charts.h"
#include "report/table.h"
#include "report/timeline_chart.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace {

/// Beyond this the pose table is of no use to a reader and makes the page slow.
constexpr std::size_t kMostPoseRows = 500;

/// A figure of each sensor that has one; report.js goes from its marks to the sensor's rows.
template <typename Draw, typename Caption>
std::string FigureOfEach(const Draw& draw, const Caption& caption) {
  std::string html;
  for (const Triad triad : kTriads) {
    const std::string figure = Figure(draw(triad), caption(triad));
    if (figure.empty()) continue;
    html += "<div data-sensor=\"" + std::string(TriadName(triad)) + "\">\n" + figure + "</div>\n";
  }
  return html;
}

/// `turns`: the spheres have data from which scripts draw them to be turned.
std::string CorrectedErrorFigures(const Calibration& calibration, bool turns) {
  std::string html;
  for (const Triad triad : kTriads) {
    const std::string figure =
        Figure(SphereChart(calibration, triad), SphereCaption(calibration, triad));
    html += turns ? SphereScene(calibration, triad, figure) : figure;
  }
  return html +
         Figure(HeadingChart(calibration),
                "Heading of the unit held level, round the compass, its tilt by the accelerometer: "
                "error of raw readings, and what the parameters' σ leave.");
}

/// Whether the page lists every pose.
bool HasPoseRows(const Calibration& calibration) {
  const std::size_t count = calibration.quality.rests.pose_residuals.size();
  return count > 0 && count <= kMostPoseRows;
}

std::string RecordingSection(const Calibration& calibration, const PoseSet& poses) {
  const Drawing drawing =
      TimelineDrawing(poses, calibration.quality.rests.rejected_poses, HasPoseRows(calibration));
  if (drawing.svg.empty()) return "";
  return "<section>\n" + Element("h2", "The recording over time") +
         Figure(drawing.svg, drawing.caption) + "</section>\n";
}

/// Marks of what a page shows of its sources, by which a later page finds it.
constexpr std::string_view kSourcesBegin = "<!-- sources -->\n",
                           kSourcesEnd = "<!-- /sources -->\n";

std::string SourceSections(const Calibration& calibration, const ReportSources& sources) {
  const std::string_view page = sources.earlier_page;
  const std::size_t begin = page.find(kSourcesBegin), end = page.find(kSourcesEnd);
  if (begin < end && end != std::string_view::npos) {
    return std::string(page.substr(begin, end + kSourcesEnd.size() - begin));
  }
  std::string html;
  if (sources.poses != nullptr) html += RecordingSection(calibration, *sources.poses);
  if (!sources.noise.empty()) {
    html += "<section>\n" + Element("h2", "Noise at rest") + HtmlOf(sources.noise) + "</section>\n";
  }
  if (html.empty()) return html;
  return std::string(kSourcesBegin) + html + std::string(kSourcesEnd);
}

std::string ResidualFigures(const Calibration& calibration) {
  return FigureOfEach(
             [&](Triad triad) {
               return ResidualChart(
                   calibration.quality.rests.pose_residuals, calibration.sensors[triad], triad);
             },
             ResidualCaption) +
         Figure(TurnChart(calibration.quality.rests), TurnCaption(calibration.quality.rests));
}

std::string CoverageFigures(const Calibration& calibration) {
  std::string html = FigureOfEach(
      [&](Triad triad) { return CoverageChart(calibration.quality, triad); }, CoverageCaption);
  if (const std::optional<NextPose> next = NextPoseFor(calibration)) {
    const Eigen::Vector3d& u = next->direction;
    html += Figure(
        PosePicture(next->world_from_body, "the next pose"),
        "The pose that would close the largest gap of the " + std::string(TriadName(next->triad)) +
            ": " + (next->triad == Triad::kAccelerometer ? "up" : "the field") + " along (" +
            Fixed(u.x(), 2) + ", " + Fixed(u.y(), 2) + ", " + Fixed(u.z(), 2) + ") of the body.");
  }
  return html;
}

/// `turns`: what is seen better from all sides has data for that.
std::string FiguresOf(const Calibration& calibration, SectionKind kind, bool turns) {
  const Quality& quality = calibration.quality;
  std::string html;
  switch (kind) {
    case SectionKind::kCorrectedError:
      return CorrectedErrorFigures(calibration, turns);
    case SectionKind::kLimits:
      return Figure(LimitChart(calibration.IsUsable() ? quality.limits : std::vector<LimitCheck>()),
                    "Worst value for each limit (bar) with ±2σ (line), compared with the limit; in "
                    "another colour its guard band, where one is set.");
    case SectionKind::kParameters:
      return Figure(CorrelationChart(calibration.covariance),
                    "Correlation of the estimated parameters: blue +1, orange −1, pale 0. A "
                    "column's name is at "
                    "its upper end.");
    case SectionKind::kResiduals:
      return ResidualFigures(calibration);
    case SectionKind::kSoak:
      for (const Triad triad : kTriads) {
        for (int axis = 0; axis < 3; ++axis) {
          html += Figure(SoakChart(calibration, triad, axis),
                         "Left: bias from the poses at each temperature alone (dots, ±2σ) and from "
                         "the thermal terms (line, ±2σ shaded). Right: residual.");
        }
      }
      return html;
    case SectionKind::kSweep:
      for (const SweepAxis& axis : quality.sweep.axes) {
        html +=
            Figure(SweepFitChart(calibration, axis.triad, axis.axis),
                   "Left: windows (dots; orange: warming, blue: cooling) and the fit (line) with "
                   "±2σ (shaded) against the thermometer. Right: residual over time.");
        html += Figure(
            SweepSurfaceChart(calibration, axis.triad, axis.axis),
            "Bias from the thermal terms at the temperatures and rates that the sweep covered.");
      }
      return html;
    case SectionKind::kCoverage:
      return CoverageFigures(calibration);
    default:
      return "";
  }
}

std::string PoseDetails(const Calibration& calibration) {
  const Quality& quality = calibration.quality;
  const std::size_t count = quality.rests.pose_residuals.size();
  if (count == 0) {
    const bool has_rests =
        calibration.IsUsable() && calibration.mode == Mode::kPoses && quality.poses > 0;
    return has_rests ? Element("p",
                               "This calibration file has so many poses that it does not hold "
                               "each: they are in the page that `calibrate` wrote.")
                     : "";
  }
  if (!HasPoseRows(calibration)) {
    return Element(
        "p", "The table of poses is omitted: it would have " + std::to_string(count) + " rows.");
  }
  return Details("Every pose (" + std::to_string(count) + " rows)", HtmlOf(TableOfPoses(quality)));
}

}  // namespace

std::string CalibrationHtml(const Calibration& calibration,
                            const ReportLooks& looks,
                            const ReportSources& sources) {
  const Headline headline = HeadlineOf(calibration);
  const std::string device =
      calibration.serial.empty() ? "unit without serial number" : calibration.serial;
  const std::string title = "Calibration of " + device;
  std::string html = HtmlOf(IdentityTable(calibration), "identity");
  const bool turns = looks.assets.empty() && !looks.plots.text.empty();
  for (const Section& section : SectionsOf(calibration)) {
    html += "<section>\n" + Element("h2", section.title) + HtmlOf(section.blocks) +
            "<div class=\"drawings\">\n" + FiguresOf(calibration, section.kind, turns) +
            "</div>\n</section>\n";
  }
  html += SourceSections(calibration, sources);
  html += "<section class=\"screen\">\n<h2>Details</h2>\n" + PoseDetails(calibration);
  if (!calibration.config_yaml.empty()) {
    html += Details("Configuration, defaults included", Element("pre", calibration.config_yaml));
  }
  std::vector<EmbeddedScript> scripts = {PageScript()};
  // 1.7 MB are worth it only where there is something to turn.
  if (html.find("<div class=\"sphere\">") != std::string::npos) {
    scripts = {PageScript(), looks.plots, SphereScript()};
  }
  return HtmlPage(title,
                  headline,
                  html + "</section>\n",
                  {.assets = looks.assets, .scripts = std::move(scripts)});
}

}  // namespace truetriad
