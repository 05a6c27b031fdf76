// SPDX-License-Identifier: Apache-2.0
#include "report/page.h"

#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "base/utf8.h"
#include "report/charts.h"
#include "report/content.h"
#include "report/svg.h"
#include "report/table.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace {

std::string TextOfBlock(const Block& block) {
  if (const auto* table = std::get_if<Table>(&block)) return TextOf(*table);
  if (const auto* words = std::get_if<std::string>(&block)) return Wrapped(*words);
  if (const auto* subtitle = std::get_if<Subtitle>(&block)) return "\n  " + subtitle->text + '\n';
  const auto& [text, tag] = std::get<Bullet>(block);
  return Wrapped(text + (tag.empty() ? "" : " [" + tag + "]"), 2, "- ");
}

/// A sentence in which `backticks` mark text to type.
std::string Sentence(std::string_view text) {
  std::string html;
  bool in_code = false;
  for (;;) {
    const std::size_t tick = text.find('`');
    html += EscapeMarkup(text.substr(0, tick));
    if (tick == std::string_view::npos) return html;
    text.remove_prefix(tick + 1);
    // A backtick without a closing backtick is printed as it is.
    if (!in_code && text.find('`') == std::string_view::npos)
      return html + '`' + EscapeMarkup(text);
    html += in_code ? "</code>" : "<code>";
    in_code = !in_code;
  }
}

std::string HtmlOfBlock(const Block& block) {
  if (const auto* table = std::get_if<Table>(&block)) return HtmlOf(*table);
  if (const auto* words = std::get_if<std::string>(&block))
    return "<p>" + Sentence(*words) + "</p>\n";
  if (const auto* subtitle = std::get_if<Subtitle>(&block)) return Element("h3", subtitle->text);
  const auto& [text, tag] = std::get<Bullet>(block);
  return "<li>" + Sentence(text) +
         (tag.empty() ? "" : " <small>" + EscapeMarkup(tag) + "</small>") + "</li>\n";
}

std::string_view CssClass(Grade grade) {
  switch (grade) {
    case Grade::kGood:
      return "good";
    case Grade::kNeutral:
      return "neutral";
    case Grade::kCaution:
      return "caution";
    case Grade::kBad:
      break;
  }
  return "bad";
}

/// A style rule that prints the title and the page number at the foot of each printed page.
std::string PageFoot(std::string_view title) {
  // Within a style rule, characters other than letters and digits are escaped by their number.
  std::string text;
  for (const char c : Printable(title)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x80 || std::isalnum(byte) != 0 || c == ' ') {
      text += c;
      continue;
    }
    constexpr std::string_view kDigits = "0123456789abcdef";
    text += {'\\', '0', '0', '0', '0', kDigits[byte >> 4U], kDigits[byte & 15U]};
  }
  return "@page{@bottom-left{content:\"" + text +
         "\";font:9px sans-serif}@bottom-right{content:counter(page) \" / \" counter(pages);"
         "font:9px sans-serif}}\n";
}

/// The content security policy of a page: only its own style and scripts, and no network.
std::string PolicyOf(const PageLooks& looks) {
  const bool is_alone = looks.assets.empty();
  // Drawings state their width in a style attribute, which needs 'unsafe-inline'.
  std::string policy = "default-src 'none'; base-uri 'none'; form-action 'none'; style-src " +
                       std::string(is_alone ? "" : "'self' ") + "'unsafe-inline'; img-src data:";
  if (!looks.scripts.empty()) policy += "; script-src";
  for (const EmbeddedScript& script : looks.scripts) {
    policy += is_alone ? " '" + std::string(script.hash) + '\'' : " 'self'";
  }
  return "<meta http-equiv=\"Content-Security-Policy\" content=\"" + policy + "\">\n";
}

/// Opens an element that can be scrolled, also by keys, if its content is wider than the page.
std::string Scrolling(std::string_view label) {
  return "<div class=\"scroll\" tabindex=\"0\" role=\"group\" aria-label=\"" + EscapeMarkup(label) +
         "\">";
}

/// The accessible name of a table: its header or, without a header, the first cells of its rows.
std::string NameOf(const Table& table) {
  std::string name;
  const auto add = [&name](const std::string& words) {
    if (!words.empty()) name += (name.empty() ? "" : ", ") + words;
  };
  for (const std::string& words : table.header) add(words);
  if (!name.empty()) return name;
  for (const auto& row : table.rows) add(row.front());
  return name;
}

/// The classes of a table: its own class, "long" if its two halves fit side by side on paper, and
/// "wide" if it needs narrow columns.
std::string ClassesOf(const Table& table) {
  // Half of an A4 page holds five columns. A table of fewer than twelve rows needs no less room in
  // two halves. Ten columns of the usual width are wider than the page.
  constexpr std::size_t kFewColumns = 5, kManyRows = 12, kManyColumns = 10;
  const std::size_t columns = table.alignment.size();
  return table.style + (columns <= kFewColumns && table.rows.size() >= kManyRows ? " long" : "") +
         (columns >= kManyColumns ? " wide" : "");
}

std::string ClassAttribute(std::string_view name) {
  return name.empty() ? "" : " class=\"" + std::string(name) + '"';
}

std::string_view AlignmentClass(const Table& table, std::size_t column) {
  return table.alignment[column] == 'r' ? "r" : "";
}

/// Appends a header cell. If the cell is empty, as above a column of row names, it is not marked as
/// a header.
void AppendHeader(const Table& table, std::size_t column, std::string* html) {
  const std::string& words = table.header[column];
  if (words.empty()) {
    *html += "<td></td>";
    return;
  }
  *html += "<th scope=\"col\"" + ClassAttribute(AlignmentClass(table, column)) + '>' +
           EscapeMarkup(words) + "</th>";
}

/// A line break is allowed before a "±", but not after it.
std::string WithSigmaWhole(std::string cell) {
  constexpr std::string_view kSpaced = " ± ", kWhole = " ±\u00a0";
  if (const std::size_t at = cell.find(kSpaced); at != std::string::npos) {
    cell.replace(at, kSpaced.size(), kWhole);
  }
  return cell;
}

void AppendRow(const Table& table, std::size_t row, std::string* html) {
  *html += "<tr";
  if (!table.ids.empty()) *html += " id=\"" + EscapeMarkup(table.ids[row]) + '"';
  *html += '>';
  const std::vector<std::string>& cells = table.rows[row];
  for (std::size_t c = 0; c < cells.size(); ++c) {
    std::string_view style = AlignmentClass(table, c);
    if (cells[c] == "FAIL") style = "fail";
    if (cells[c] == "pass") style = "pass";
    // The first cell of a row names the row.
    const bool is_name = c == 0 && !cells[c].empty();
    *html += (is_name ? "<th scope=\"row\"" : "<td") + ClassAttribute(style) + '>' +
             EscapeMarkup(WithSigmaWhole(cells[c])) + (is_name ? "</th>" : "</td>");
  }
  *html += "</tr>\n";
}

/// The figure of a drawing, which scrolls on a narrow screen; empty without a drawing.
std::string HtmlOf(const Drawing& drawing) {
  if (drawing.svg.empty()) return "";
  std::string html = "<figure>\n" + Scrolling(drawing.caption) + '\n' + drawing.svg + "</div>\n" +
                     Element("figcaption", drawing.caption) + "</figure>\n";
  if (!drawing.scene.empty()) {
    return "<div class=\"sphere\">\n" + html + "<script type=\"application/json\">" +
           drawing.scene + "</script>\n</div>\n";
  }
  if (drawing.sensor.empty()) return html;
  return "<div data-sensor=\"" + drawing.sensor + "\">\n" + html + "</div>\n";
}

/// The drawings that are not empty, side by side where there is room.
std::string HtmlOf(const std::vector<Drawing>& drawings) {
  std::string html;
  for (const Drawing& drawing : drawings) html += HtmlOf(drawing);
  return html.empty() ? html : "<div class=\"drawings\">\n" + html + "</div>\n";
}

}  // namespace

std::string ReportStyleSheet() { return std::string(PageStyle()); }
std::string ReportScript() { return std::string(PageScript().text); }

std::string TextOf(const Headline& headline) {
  return headline.text + '\n' + Wrapped(headline.explanation, 0);
}

std::string TextOf(const std::vector<Section>& sections) {
  std::string text;
  for (const auto& [title, blocks, draw] : sections) {
    if (!title.empty()) text += '\n' + title + '\n' + std::string(DisplayWidth(title), '-') + '\n';
    for (const Block& block : blocks) text += TextOfBlock(block);
  }
  return text;
}

std::string HtmlOf(const std::vector<Section>& sections) {
  std::string html;
  for (const auto& [title, blocks, draw] : sections) {
    html += "<section>\n" + (title.empty() ? "" : Element("h2", title)) + HtmlOf(blocks) +
            (draw ? HtmlOf(draw()) : "") + "</section>\n";
  }
  return html;
}

VerbReport ReportOf(const PageContent& content) {
  const auto& [title, headline, sections] = content;
  return {headline.grade,
          TextOf(headline) + TextOf(sections),
          HtmlPage(title, headline, HtmlOf(sections))};
}

std::string Element(std::string_view tag, std::string_view content) {
  return '<' + std::string(tag) + '>' + EscapeMarkup(content) + "</" + std::string(tag) + ">\n";
}

std::string HtmlOf(const Table& table) {
  if (table.rows.empty()) return "";
  std::string html =
      Scrolling("Table: " + NameOf(table)) + "<table class=\"" + ClassesOf(table) + "\">\n";
  if (!table.header.empty()) {
    html += "<thead><tr>";
    for (std::size_t c = 0; c < table.header.size(); ++c) AppendHeader(table, c, &html);
    html += "</tr>\n</thead>\n";
  }
  html += "<tbody>\n";
  for (std::size_t r = 0; r < table.rows.size(); ++r) AppendRow(table, r, &html);
  html += "</tbody></table></div>\n";
  if (table.copy.empty()) return html;
  return "<div data-copy=\"" + EscapeMarkup(table.copy) + "\">" + html + "</div>\n";
}

std::string HtmlOf(const std::vector<Block>& blocks) {
  std::string html;
  bool in_list = false;
  for (const Block& block : blocks) {
    const bool is_point = std::holds_alternative<Bullet>(block);
    if (is_point != in_list) html += is_point ? "<ul>\n" : "</ul>\n";
    in_list = is_point;
    html += HtmlOfBlock(block);
  }
  return in_list ? html + "</ul>\n" : html;
}

std::string Details(std::string_view summary, const std::string& html) {
  return "<details>\n" + Element("summary", summary) + html + "</details>\n";
}

std::string HtmlPage(std::string_view title,
                     const Headline& headline,
                     const std::string& body,
                     const PageLooks& looks) {
  const bool is_alone = looks.assets.empty();
  std::string page =
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n" +
      Element("title", std::string(title) + ": " + headline.text) + PolicyOf(looks);
  if (!is_alone) {
    page += "<link rel=\"icon\" href=\"data:,\">\n<link rel=\"stylesheet\" href=\"" +
            EscapeMarkup(looks.assets) + "/report.css\">\n";
  }
  page += "<style>\n";
  if (is_alone) page.append(PageStyle()).append(looks.style);
  page += PageFoot(title) + "</style>\n</head>\n<body>\n<main>\n" + Element("h1", title) +
          "<div class=\"verdict " + std::string(CssClass(headline.grade)) + "\">" +
          Element("b", headline.text) + "<span>" + Sentence(headline.explanation) +
          "</span>\n</div>\n";
  page.append(body).append("</main>\n");
  for (const EmbeddedScript& script : looks.scripts) {
    if (is_alone) {
      page.append("<script>").append(script.text).append("</script>\n");
    } else {
      page += "<script src=\"" + EscapeMarkup(looks.assets) + "/report.js\"></script>\n";
    }
  }
  return page += "</body>\n</html>\n";
}

namespace {

/// A table of poses has at most this many rows: a longer one is unreadable and makes a page slow.
constexpr std::size_t kMostPoseRows = 500;

/// Whether the page lists every pose.
bool HasPoseRows(const Calibration& calibration) {
  const std::size_t count = calibration.quality.rests.pose_residuals.size();
  return count > 0 && count <= kMostPoseRows;
}

/// Markers around the part of a page that shows its sources, so that a later page can copy it.
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

/// The residuals of every triad at every pose.
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
                               "This calibration file lists no residuals of single poses, so "
                               "there is no table of poses.")
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
  // Plotly adds 1.7 MB to the page, so it is included only if there is a sphere to turn.
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
