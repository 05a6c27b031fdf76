// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "report/charts.h"
#include "report/content.h"
#include "report/format.h"
#include "report/page.h"
#include "report/page_assets.h"
#include "report/svg.h"
#include "report/table.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace {

/// Beyond this the pose table is of no use to a reader and makes the page slow.
constexpr std::size_t kMostPoseRows = 500;

/// Whether the page lists every pose.
bool HasPoseRows(const Calibration& calibration) {
  const std::size_t count = calibration.quality.rests.pose_residuals.size();
  return count > 0 && count <= kMostPoseRows;
}

/// Marks of what a page shows of its sources, by which a later page finds it.
constexpr std::string_view kSourcesBegin = "<!-- sources --><div class=\"sources\">\n",
                           kSourcesEnd = "</div><!-- /sources -->\n";

std::string SourceSections(const Calibration& calibration, const ReportSources& sources) {
  const std::string_view page = sources.earlier_page;
  const std::size_t begin = page.find(kSourcesBegin), end = page.find(kSourcesEnd);
  if (begin < end && end != std::string_view::npos) {
    return std::string(page.substr(begin, end + kSourcesEnd.size() - begin));
  }
  std::vector<Section> sections;
  if (sources.poses != nullptr) {
    Drawing timeline = TimelineDrawing(
        *sources.poses, calibration.quality.rests.rejected_poses, HasPoseRows(calibration));
    if (!timeline.svg.empty()) {
      sections.push_back(
          {"The recording over time", {}, [timeline] { return std::vector{timeline}; }});
    }
  }
  if (!sources.noise.empty()) {
    sections.push_back({"Noise at rest", {}, [&sources] { return sources.noise; }});
  }
  if (sections.empty()) return "";
  return std::string(kSourcesBegin) + HtmlOf(sections) + std::string(kSourcesEnd);
}

/// Every triad at every pose.
Table TableOfPoses(const Quality& quality) {
  Table table =
      Headed("pose; sensor; before; after; Δx; Δy; Δz; unit; normalised; weight; direction",
             "rlrrrrrlrrr");
  for (const PoseResidual& pose : quality.rests.pose_residuals) {
    const std::string number = std::to_string(pose.pose), sensor(TriadName(pose.triad));
    table.ids.push_back("pose-" + number + '-' + sensor);
    table.Add() << number << sensor << Significant(pose.norm_error_before, 3)
                << Significant(pose.norm_error, 3) << Significant(pose.residual, 3)
                << TruthUnit(pose.triad) << Fixed(pose.normalized, 2) << Fixed(pose.weight, 2)
                << Joined(Fixed(pose.direction, 2));
  }
  return table;
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

Grade GradeOf(const Calibration& calibration) { return HeadlineOf(calibration).grade; }

std::string CalibrationText(const Calibration& calibration) {
  return TextOf(HeadlineOf(calibration)) + '\n' + TextOf(IdentityTable(calibration)) +
         TextOf(SectionsOf(calibration));
}

std::string CalibrationHtml(const Calibration& calibration,
                            const ReportLooks& looks,
                            const ReportSources& sources) {
  const bool turns = looks.assets.empty() && !looks.plots.text.empty();
  std::string html = HtmlOf(IdentityTable(calibration)) + HtmlOf(SectionsOf(calibration, turns)) +
                     SourceSections(calibration, sources);
  std::string details = PoseDetails(calibration);
  if (!calibration.config_yaml.empty()) {
    details += Details("Configuration, defaults included", Element("pre", calibration.config_yaml));
  }
  if (!details.empty()) {
    html += "<section class=\"screen\">\n<h2>Details</h2>\n" + details + "</section>\n";
  }
  std::vector<EmbeddedScript> scripts = {PageScript()};
  // 1.7 MB are worth it only where there is something to turn.
  if (html.find("<div class=\"sphere\">") != std::string::npos) {
    scripts = {PageScript(), looks.plots, SphereScript()};
  }
  return HtmlPage("Calibration of " + (calibration.serial.empty() ? "unit without serial number"
                                                                  : calibration.serial),
                  HeadlineOf(calibration),
                  html,
                  {.assets = looks.assets, .scripts = std::move(scripts)});
}

}  // namespace truetriad
