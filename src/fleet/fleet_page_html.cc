// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_page_html.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "fleet/fleet_page_assets.h"
#include "fleet/fleet_page_script.h"
#include "fleet/unit_run.h"
#include "fleet/unit_work.h"
#include "report/format.h"
#include "report/page.h"
#include "report/svg.h"
#include "truetriad/base/version.h"

namespace truetriad::fleet {
namespace {

std::string Share(std::size_t part, std::size_t whole) {
  if (whole == 0) return "–";
  return Fixed(100.0 * static_cast<double>(part) / static_cast<double>(whole), 1) + " %";
}

/// Words of the scope's units with their counts, the most frequent first.
template <typename IsMeant>
std::vector<std::pair<std::string, std::size_t>> CountsOf(const PageWords& words,
                                                          const PageScope& scope,
                                                          const IsMeant& is_meant) {
  std::vector<std::pair<std::string, std::size_t>> counts;
  for (const std::string& word : words.words) counts.emplace_back(word, 0);
  for (const std::size_t unit : scope.units) {
    if (is_meant(unit)) ++counts[words.of[unit]].second;
  }
  std::erase_if(counts, [](const auto& count) { return count.second == 0; });
  std::stable_sort(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
    return a.second > b.second;
  });
  return counts;
}

std::size_t GoodOf(const PageWords& verdict, const PageScope& scope) {
  return static_cast<std::size_t>(
      std::count_if(scope.units.begin(), scope.units.end(), [&](std::size_t unit) {
        return IsGood(verdict, unit);
      }));
}

std::string VerdictsHtml(const PageUnits& units, const PageScope& scope) {
  truetriad::Table table{{"verdict", "units", "share"}, "lrr", {}};
  for (const auto& [verdict, count] :
       CountsOf(units.verdict, scope, [](std::size_t) { return true; })) {
    table.rows.push_back({verdict, std::to_string(count), Share(count, scope.units.size())});
  }
  return HtmlOf(table);
}

std::string ReasonsHtml(const PageUnits& units, const PageScope& scope) {
  const auto counts =
      CountsOf(units.code, scope, [&](std::size_t unit) { return !IsGood(units.verdict, unit); });
  if (counts.empty()) return Element("p", "All of these units are good.");
  const std::size_t all = scope.units.size() - GoodOf(units.verdict, scope);
  std::size_t sum = 0;
  truetriad::Table table{{"reason", "units", "up to here"}, "lrr", {}};
  for (const auto& [code, count] : counts) {
    sum += count;
    table.rows.push_back({code, std::to_string(count), Share(sum, all)});
  }
  return HtmlOf(table);
}

/// Links to the lots' pages, where there are any.
std::string LotsHtml(const PageUnits& units, const PageScope& scope) {
  const auto lots = std::find_if(
      units.tags.begin(), units.tags.end(), [](const PageWords& tag) { return tag.name == "lot"; });
  if (lots == units.tags.end() || !scope.lot.empty()) return "";
  struct Count {
    std::size_t units = 0, good = 0, good_at_first = 0;
  };
  std::vector<Count> counts(lots->words.size());
  for (std::size_t unit = 0; unit < units.size(); ++unit) {
    Count& count = counts[lots->of[unit]];
    ++count.units;
    count.good += IsGood(units.verdict, unit) ? 1 : 0;
    count.good_at_first += IsGood(units.first_verdict, unit) ? 1 : 0;
  }
  std::string html =
      "<section aria-labelledby=\"lots-title\">\n<h2 id=\"lots-title\">Lots</h2>\n"
      "<div class=\"scroll\"><table>\n<thead><tr><th scope=\"col\">lot</th><th scope=\"col\" "
      "class=\"r\">units</th><th scope=\"col\" class=\"r\">good</th><th scope=\"col\" "
      "class=\"r\">at the first run</th></tr></thead>\n<tbody>\n";
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const std::string& lot = lots->words[i];
    const std::string name = lot.empty() ? "no lot"
                                         : "<a href=\"" + EscapeMarkup(LinkOf(FileOfLot(lot))) +
                                               "\">" + EscapeMarkup(lot) + "</a>";
    html += "<tr><th scope=\"row\">" + name + "</th><td class=\"r\">" +
            std::to_string(counts[i].units) + "</td><td class=\"r\">" +
            Share(counts[i].good, counts[i].units) + "</td><td class=\"r\">" +
            Share(counts[i].good_at_first, counts[i].units) + "</td></tr>\n";
  }
  return html + "</tbody></table></div>\n</section>\n";
}

/// "From 2026-01-31T12:00:00Z to …": when the units were calibrated.
std::string OriginText(const PageUnits& units, const PageScope& scope) {
  std::size_t runs = 0;
  for (const std::size_t unit : scope.units) runs += units.run_count[unit];
  return std::to_string(scope.units.size()) + " units, " + std::to_string(runs) +
         " runs; of each unit the run that counts. Times are UTC. Written by truetriad " +
         std::string(Version()) +
         (scope.draws_charts ? "; charts by uPlot (assets/uplot-license.txt)." : ".");
}

}  // namespace

bool IsGood(const PageWords& verdict, std::size_t unit) {
  const std::optional<Verdict> known = VerdictFromName(verdict.words[verdict.of[unit]]);
  return known && !IsRed(*known);
}

std::string FileOfLot(const std::string& lot) { return "lots/" + FolderNameOf(lot) + ".html"; }

std::string FleetPageHtml(const PageUnits& units, const PageScope& scope) {
  const std::size_t count = scope.units.size();
  const std::size_t good = GoodOf(units.verdict, scope);
  const std::size_t first = GoodOf(units.first_verdict, scope);
  const std::string root = EscapeMarkup(scope.root);
  const std::map<std::string_view, std::string> parts = {
      {"title", EscapeMarkup(scope.title)},
      {"root", root},
      {"lot", EscapeMarkup(scope.lot)},
      {"chart_style",
       scope.draws_charts ? "<link rel=\"stylesheet\" href=\"" + root + "assets/uplot.css\">\n"
                          : ""},
      {"chart_script",
       scope.draws_charts ? "<script defer src=\"" + root + "assets/uplot.js\"></script>\n" : ""},
      {"trail",
       scope.lot.empty() ? ""
                         : "<nav class=\"trail\" aria-label=\"Pages\"><a href=\"" + root +
                               "index.html\">All lots</a></nav>\n"},
      {"grade", good == count ? "good" : "caution"},
      {"headline", Share(good, count) + " good"},
      {"explanation",
       std::to_string(good) + " of " + std::to_string(count) + " units; " + Share(first, count) +
           " at the first run."},
      {"reasons", ReasonsHtml(units, scope)},
      {"verdicts", VerdictsHtml(units, scope)},
      {"lots", LotsHtml(units, scope)},
      {"origin", EscapeMarkup(OriginText(units, scope))}};
  // What is put in is not looked at again, whatever braces it has.
  const std::string_view frame = FleetPageFrame();
  std::string html;
  for (std::size_t at = 0; at < frame.size();) {
    const std::size_t open = std::min(frame.find('{', at), frame.size());
    html += frame.substr(at, open - at);
    if (open == frame.size()) break;
    const std::size_t close = frame.find('}', open);
    html += parts.at(frame.substr(open + 1, close - open - 1));
    at = close + 1;
  }
  return html;
}

}  // namespace truetriad::fleet
