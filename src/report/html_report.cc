// SPDX-License-Identifier: Apache-2.0
#include <cmath>
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
#include "report/page.h"
#include "report/page_assets.h"
#include "report/soak_content.h"
#include "report/sphere_scene.h"
#include "report/svg.h"
#include "report/sweep_charts.h"
#include "report/table.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace {

/// Beyond this the pose table is of no use to a reader and makes the page slow.
constexpr std::size_t kMostPoseRows = 500;

/// σ of a pose's norm error from the noise that weighted it, averaged over the directions:
/// sqrt(tr(C Σ C^T) / 3 + excess^2), true unit.
double NormErrorSigma(const std::optional<TriadCalibration>& sensor) {
  if (!sensor) return 0.0;
  const Eigen::Matrix3d sigma = sensor->model.Correction() * sensor->noise.sigma.asDiagonal();
  const double variance =
      sigma.squaredNorm() / 3.0 + sensor->noise.excess_sigma * sensor->noise.excess_sigma;
  return std::isfinite(variance) ? std::sqrt(variance) : 0.0;
}

/// `turns`: what is seen better from all sides has data for that.
std::string FiguresOf(const Calibration& calibration, SectionKind kind, bool turns) {
  const Quality& quality = calibration.quality;
  std::string html;
  switch (kind) {
    case SectionKind::kCorrectedError:
      for (const Triad triad : kTriads) {
        if (turns) html += SphereScene(calibration, triad, "");
      }
      return html;
    case SectionKind::kLimits:
      return Figure(LimitChart(calibration.IsUsable() ? quality.limits : std::vector<LimitCheck>()),
                    "Worst value for each limit (bar) with ±2σ (line), compared with the limit.");
    case SectionKind::kParameters:
      return Figure(CorrelationChart(calibration.covariance),
                    "Correlation of the estimated parameters: blue +1, white 0, red -1.");
    case SectionKind::kResiduals:
      for (const Triad triad : kTriads) {
        html += Figure(
            ResidualChart(quality, triad, NormErrorSigma(calibration.sensors[triad])),
            TriadTitle(triad) +
                ": |C(y - b)| - reference for each pose. Shaded: ±2σ of the noise used for the "
                "weights. Crosses: rejected poses, drawn at the edge if beyond the scale.");
      }
      return html;
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
        html += Figure(SweepFitChart(calibration, axis.triad, axis.axis),
                       "Left: windows (dots) and the fit (line) with ±2σ (shaded) against the "
                       "thermometer. Right: residual over time.");
        html += Figure(
            SweepSurfaceChart(calibration, axis.triad, axis.axis),
            "Bias from the thermal terms at the temperatures and rates that the sweep covered.");
      }
      return html;
    case SectionKind::kCoverage:
      for (const Triad triad : kTriads) {
        html += Figure(CoverageChart(quality, triad),
                       TriadTitle(triad) +
                           ": directions of the poses in the body frame, equal-area discs; rings "
                           "at 30 and 60 deg above the equator.");
      }
      return html;
    default:
      return "";
  }
}

std::string PoseDetails(const Quality& quality) {
  const std::size_t count = quality.rests.pose_residuals.size();
  if (count == 0) return "";
  if (count > kMostPoseRows) {
    return Element(
        "p", "The table of poses is omitted: it would have " + std::to_string(count) + " rows.");
  }
  return Details("Every pose (" + std::to_string(count) + " rows)", HtmlOf(PoseTable(quality)));
}

}  // namespace

std::string CalibrationHtml(const Calibration& calibration, const ReportLooks& looks) {
  const Verdict verdict = VerdictOf(calibration);
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
  html += "<section class=\"screen\">\n<h2>Details</h2>\n" + PoseDetails(calibration.quality);
  if (!calibration.config_yaml.empty()) {
    html += Details("Configuration, defaults included", Element("pre", calibration.config_yaml));
  }
  std::vector<EmbeddedScript> scripts = {PageScript()};
  // 1.7 MB are worth it only where there is something to turn.
  if (html.find("<div class=\"sphere\">") != std::string::npos) {
    scripts = {PageScript(), looks.plots, SphereScript()};
  }
  return HtmlPage(title,
                  verdict,
                  html + "</section>\n",
                  {.assets = looks.assets, .scripts = std::move(scripts)});
}

}  // namespace truetriad
