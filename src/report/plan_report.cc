// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <string>

#include "report/format.h"
#include "report/page.h"
#include "report/plan.h"
#include "report/plan_content.h"
#include "report/pose_picture.h"
#include "report/svg.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

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

/// Gravity alone does not see which way a unit faces.
bool HeadingMatters(const Plan& plan) {
  return std::any_of(plan.sigmas.begin(), plan.sigmas.end(), [](const PlannedSigma& sigma) {
    return sigma.group.rfind(TriadName(Triad::kMagnetometer), 0) == 0;
  });
}

}  // namespace

Grade GradeOf(const Plan& plan) { return HeadlineOf(plan).grade; }

std::string PlanText(const Plan& plan) {
  const Headline headline = HeadlineOf(plan);
  std::string text = headline.text + '\n' + Wrapped(headline.explanation, 0) +
                     SectionText("Poses, in this order", {RestText(plan), ProgramTable(plan)});
  for (const PageSection& section : SectionsOf(plan)) {
    text += SectionText(section.title, section.blocks);
  }
  return text;
}

std::string PlanHtml(const Plan& plan) {
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
  html += "</ol>\n</section>\n";
  for (const PageSection& section : SectionsOf(plan)) {
    html += "<section>\n" + Element("h2", section.title) + HtmlOf(section.blocks) + "</section>\n";
  }
  return HtmlPage("Pose program", HeadlineOf(plan), html, {.style = kCardStyle});
}

}  // namespace truetriad
