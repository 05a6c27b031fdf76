// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "fleet/database.h"
#include "fleet/line_summary.h"
#include "line/control_chart.h"
#include "report/table.h"

namespace truetriad::fleet {
namespace {

/// At most so many rows of a table are shown in a terminal; JSON and CSV have all rows.
constexpr std::size_t kMostRows = 12;
/// If the p of a test for normality is below this, a note states it.
constexpr double kDoubt = 0.01;

/// A heading, a table and sentences below it.
struct Section {
  std::string heading;
  truetriad::Table table = {};
  std::vector<std::string> notes = {};
};

/// A column of a table: the path of its value in a row's tree, and its format.
struct TextColumn {
  std::string header;
  char alignment;
  std::string place;
  std::function<std::string(const Json& value)> text;
};

using Trees = Json::array_t;
const Trees& ListIn(const Json& json) { return json.get_ref<const Trees&>(); }

/// A table with a row for each item of `list`.
truetriad::Table TableOf(const Trees& list, const std::vector<TextColumn>& columns) {
  truetriad::Table table;
  for (const TextColumn& column : columns) {
    table.header.push_back(column.header);
    table.alignment += column.alignment;
  }
  for (const Json& item : list) {
    std::vector<std::string>& row = table.rows.emplace_back();
    for (const TextColumn& column : columns) {
      row.push_back(column.text(item.at(Json::json_pointer(column.place))));  // Throws if absent.
    }
  }
  return table;
}

/// The number in `value`; NaN if it is unknown.
double Number(const Json& value) {
  return value.is_number() ? value.get<double>() : line::kNotKnown;
}

std::string Words(const Json& value) { return value.get<std::string>(); }
std::string Whole(const Json& value) { return value.dump(); }
std::string Share(const Json& value) { return Percent(Number(value)); }
std::string Chance(const Json& value) { return Probability(Number(value)); }
std::string Unit(const Json& value) { return DisplayUnit(Words(value)); }

template <int kDigits>
std::string Digits(const Json& value) {
  return Significant(Number(value), kDigits);
}

/// The text of a value if it is known and finite; otherwise empty.
template <std::string (*text)(const Json&)>
std::string Known(const Json& value) {
  return std::isfinite(Number(value)) ? text(value) : "";
}

std::string Index(const Json& value) {
  const double index = Number(value);
  return std::isnan(index) ? "" : index > 99.0 ? "> 99" : Fixed(index, 2);
}

/// An interval, "1.21…1.45".
std::string Range(const Json& estimate) {
  const Json& lower = estimate["lower"];
  return std::isnan(Number(lower)) ? "" : Index(lower) + "…" + Index(estimate["upper"]);
}

/// A share and its interval, "97.3 % (96.5 to 97.9 %)".
std::string ShareAndRange(const Json& estimate) {
  if (std::isnan(Number(estimate["value"]))) return "n/a";
  return Share(estimate["value"]) + " (" + Significant(100.0 * Number(estimate["lower"]), 3) +
         " to " + Share(estimate["upper"]) + ")";
}

/// A share below 1 % as "9819 ppm", others as "35.9 %".
std::string Expected(const Json& value) {
  const double share = Number(value);
  if (std::isnan(share)) return "";
  if (share >= 0.01) return Percent(share);
  return share < 1e-6 ? "< 1 ppm" : Significant(std::round(1e6 * share), 4) + " ppm";
}

/// An age, stated in hours, as "12 min", "5.3 h" or "9.1 days".
std::string Age(const Json& value) {
  const double hours = Number(value);
  if (hours < 0.0) return "in the future";  // A clock is wrong.
  if (hours < 1.0) return Fixed(60.0 * hours, 0) + " min";
  return hours < 72.0 ? Significant(hours, 2) + " h" : Significant(hours / 24.0, 3) + " days";
}

std::string Or(const Json& name, const std::string& none) {
  return name.is_null() || name == "" ? none : Words(name);
}

/// "measured 2026-11-24T06:00:00Z to …, 12 units an hour; 30 units dated by the list".
std::string MeasuredText(const Json& yield) {
  const std::string first = Words(yield["first"]);
  std::string text = first.empty() ? "" : "measured " + first + " to " + Words(yield["last"]);
  const double rate = Number(yield["units_per_hour"]);
  if (!std::isnan(rate)) {
    text += ", " + (rate < 1000.0 ? Significant(rate, 3) : Fixed(rate, 0)) + " units an hour";
  }
  for (const auto& [by, what] : {std::pair("list", " dated by the list"),
                                 {"recording", " dated by the recording itself"},
                                 {"file", " dated by the time of the file"},
                                 {"nothing", " at an unknown time"}}) {
    const auto units = yield["recorded_by"].find(by);
    if (units == yield["recorded_by"].end()) continue;
    text += (text.empty() ? "" : "; ") + Counted(units->get<int>(), "unit") + what;
  }
  return text;
}

std::vector<Section> YieldSections(const Json& yield) {
  if (yield["units"] == 0) return {{.heading = "NO UNITS"}};
  std::string of_these;
  for (const auto& [part, what] : {std::pair("good_without_limits", " without limits"),
                                   {"good_by_decision", " by a person's decision"}}) {
    if (yield[part] == 0) continue;
    of_these += (of_these.empty() ? ", of these " : ", ") + Whole(yield[part]) + what;
  }
  std::vector<Section> sections = {
      {.heading = Whole(yield["good"]) + " OF " + Whole(yield["units"]) +
                  " GOOD: " + ShareAndRange(yield["good_share"]) + of_these,
       .notes = {"good at the first run: " + ShareAndRange(yield["good_at_first_share"]) + "; " +
                     Counted(yield["retested"].get<int>(), "unit") + " measured again, " +
                     Counted(yield["runs"].get<int>(), "recording") + " in all",
                 MeasuredText(yield)}}};
  const auto share_of = [](const char* part) {
    return [part](const Json& count) {
      return count["units"] == 0 ? "" : Percent(Number(count[part]) / Number(count["units"]));
    };
  };
  for (const auto& [tag, counts] : yield["by_tag"].items()) {
    sections.push_back(
        {"Yield by " + tag,
         TableOf(ListIn(counts),
                 {{tag, 'l', "/value", [](const Json& value) { return Or(value, "(none)"); }},
                  {"units", 'r', "/units", Whole},
                  {"at first", 'r', "", share_of("good_at_first")},
                  {"good", 'r', "", share_of("good")},
                  {"recordings", 'r', "/runs", Whole}})});
  }
  return sections;
}

Section ReasonsSection(const Json& reasons) {
  return {"Why units are not good",
          TableOf(ListIn(reasons),
                  {{"units", 'r', "/units", Whole},
                   {"share", 'r', "/share", Share},
                   {"cumulative", 'r', "/cumulative", Share},
                   {"reason", 'l', "/code", Words}})};
}

/// The quantity with the least Ppk comes first.
std::vector<Section> LimitsSections(Trees limits) {
  const auto ppk_of = [](const Json& quantity) {
    return Number(quantity["observed"]["overall"]["ppk"]["value"]);
  };
  std::stable_sort(limits.begin(), limits.end(), [&](const Json& one, const Json& other) {
    return ppk_of(one) < ppk_of(other) || (std::isnan(ppk_of(other)) && !std::isnan(ppk_of(one)));
  });
  Section spread{"Distributions against limits",
                 TableOf(limits,
                         {{"quantity", 'l', "/name", Words},
                          {"lower", 'r', "/lower", Known<Digits<4>>},
                          {"mean", 'r', "/mean", Digits<4>},
                          {"σ", 'r', "/observed/overall/sigma/value", Digits<3>},
                          {"of calibration", 'r', "/calibration_sigma", Digits<2>},
                          {"upper", 'r', "/upper", Known<Digits<4>>},
                          {"unit", 'l', "/unit", Unit}})};
  // Quantities without a Ppk, such as those of a single unit, are left out below.
  limits.erase(std::find_if(limits.begin(),
                            limits.end(),
                            [&](const Json& quantity) { return std::isnan(ppk_of(quantity)); }),
               limits.end());
  Section capability{"Capability (process: without the variance of calibration)",
                     TableOf(limits,
                             {{"quantity", 'l', "/name", Words},
                              {"missed", 'r', "/missed", Whole},
                              {"Cpk", 'r', "/observed/within/cpk/value", Index},
                              {"Ppk", 'r', "/observed/overall/ppk/value", Index},
                              {"95 %", 'r', "/observed/overall/ppk", Range},
                              {"process", 'r', "/process/overall/ppk/value", Index},
                              {"95 %", 'r', "/process/overall/ppk", Range},
                              {"outside", 'r', "/observed/overall/expected_outside", Expected}})};
  std::string doubted, changed;
  const auto add = [](const Json& quantity, std::string* list) {
    *list += (list->empty() ? "" : ", ") + Words(quantity["name"]);
  };
  for (const Json& quantity : limits) {
    if (Number(quantity["normality_p"]) < kDoubt) add(quantity, &doubted);
    if (quantity["other_limits"] > 0) add(quantity, &changed);
  }
  if (!doubted.empty()) {
    capability.notes.push_back(
        "The share outside and the intervals assume a normal distribution, but these quantities "
        "are not normally distributed (p < 0.01): " +
        doubted);
  }
  if (!changed.empty()) {
    capability.notes.push_back(
        "The limits of these quantities have changed, and the table uses those of the last unit: " +
        changed);
  }
  return {std::move(spread), std::move(capability)};
}

/// "a, b, c, d and 3 more (--json)".
std::string ListOf(const Json& names) {
  constexpr std::size_t kMostItems = 4;  // Keeps the list on one line.
  std::string list;
  for (std::size_t k = 0; k < std::min(names.size(), kMostItems); ++k) {
    list += (k == 0 ? "" : ", ") + Words(names[k]);
  }
  if (names.size() <= kMostItems) return list;
  return list + " and " + std::to_string(names.size() - kMostItems) + " more (--json)";
}

/// The last alarms come first, since they need action now.
Section ChartsSection(const Json& stations) {
  Section section{"Control charts"};
  Trees alarms;
  for (const Json& station : stations) {
    const std::string name = Or(station["station"], "(no station)");
    const auto note = [&](const std::string& what) { section.notes.push_back(name + ": " + what); };
    for (Json alarm : station["alarms"]) {
      alarm["station"] = name;
      alarms.push_back(std::move(alarm));
    }
    if (station["charts"].empty()) {
      note(Or(station["note"], "no charts"));
      continue;
    }
    if (station["alarms"].empty()) {
      note("in control, " + Whole(station["units"]) + " units, " +
           std::to_string(station["charts"].size()) + " charts");
    }
    if (!station["sparse"].empty()) {
      note("no charts of " + ListOf(station["sparse"]) + ": fewer than " +
           std::to_string(line::kLeastBaselineUnits) + " units have a value");
    }
    if (station["note"] != "") note(Words(station["note"]));
  }
  std::ranges::stable_sort(alarms, std::greater(), [](const Json& alarm) {
    return std::pair(Words(alarm["recorded"]), Words(alarm["serial"]));
  });
  const auto parameter_of = [](const Json& alarm) {
    const std::string most = Or(alarm["most"], "");
    return Or(alarm["parameter"], most.empty() ? "all" : "all, most " + most);
  };
  section.table = TableOf(alarms,
                          {{"station", 'l', "/station", Words},
                           {"chart", 'l', "/kind", Words},
                           {"parameter", 'l', "", parameter_of},
                           {"from unit", 'l', "/serial", Words},
                           {"to unit", 'r', "/last_serial", Words},
                           {"value", 'r', "/value", Digits<3>},
                           {"limit", 'r', "/limit", Digits<3>}});
  return section;
}

Section GoldenSection(Trees stations) {
  for (Json& station : stations) {
    Json last = station["checks"].back();
    station["last"] = std::move(last);
  }
  return {"Golden units",
          TableOf(stations,
                  {{"station", 'l', "/station", Words},
                   {"golden unit", 'l', "/last/serial", Words},
                   {"state", 'l', "/state", Words},
                   {"recorded", 'r', "/last/recorded", Words},
                   {"age", 'r', "/age_h", Age},
                   {"p", 'r', "/last/p", Chance},
                   {"largest", 'r', "/last/largest", [](const Json& largest) {
                      return Digits<3>(largest) + " σ";
                    }}})};
}

Section GaugeSection(const Trees& quantities, const std::string& by) {
  const auto share = [](const Json& value) {
    const double number = Number(value);
    return std::isnan(number) ? "" : number < 5e-5 ? "< 0.01 %" : Percent(number);
  };
  const Json& gauge = quantities[0]["gauge"];
  std::string heading =
      "Gauge study, " + Words(gauge["design"]) + ": " + Whole(gauge["parts"]) + " parts, ";
  if (gauge["appraisers"] > 1) heading += Counted(gauge["appraisers"].get<int>(), by) + ", ";
  return {heading + Whole(gauge["repeats"]) + " runs each",
          TableOf(quantities,
                  {{"quantity", 'l', "/name", Words},
                   {"of study", 'r', "/gauge/components/gauge/study_share", share},
                   {"of tolerance", 'r', "/gauge/components/gauge/tolerance_share", share},
                   {"repeat", 'r', "/gauge/components/repeatability/study_share", share},
                   {"reproduce", 'r', "/gauge/components/reproducibility/study_share", share},
                   {"categories", 'r', "/gauge/distinct_categories", Whole},
                   {"parts p", 'r', "/gauge/anova/part/p", Chance},
                   {by + " p", 'r', "/gauge/anova/appraiser/p", Known<Chance>}})};
}

Section Type1Section(const Trees& quantities, int runs) {
  return {"Type-1 study: " + Counted(runs, "run") + " of one unit",
          TableOf(quantities,
                  {{"quantity", 'l', "/name", Words},
                   {"mean", 'r', "/type1/mean", Digits<5>},
                   {"σ", 'r', "/type1/sigma/value", Digits<3>},
                   {"reference", 'r', "/type1/reference", Known<Digits<5>>},
                   {"bias", 'r', "/type1/bias/value", Known<Digits<3>>},
                   {"p", 'r', "/type1/bias_p", Known<Chance>},
                   {"Cg", 'r', "/type1/cg", Index},
                   {"Cgk", 'r', "/type1/cgk", Index},
                   {"unit", 'l', "", [](const Json& study) {
                      return study["has_limits"] == true ? Unit(study["unit"]) : "of the log";
                    }}})};
}

/// If there are quantities with limits, shows only these: parameters mostly repeat them.
Section StudySection(const Json& study) {
  Trees gauges, type1s;
  const Json& quantities = study["quantities"];
  const bool has_limits = quantities[0]["has_limits"];  // Quantities with limits come first.
  Section section;
  for (const Json& quantity : quantities) {
    const bool is_shown = quantity["has_limits"] == has_limits;
    if (is_shown && quantity.contains("gauge")) gauges.push_back(quantity);
    if (is_shown && quantity.contains("type1")) type1s.push_back(quantity);
    if (quantity.contains("refused")) {
      section.notes.push_back(Words(quantity["name"]) + ": " + Words(quantity["refused"]));
    }
  }
  std::vector<std::string> refused = std::move(section.notes);
  if (!gauges.empty()) section = GaugeSection(gauges, Words(study["by"]));
  if (!type1s.empty()) section = Type1Section(type1s, study["runs"].get<int>());
  section.notes = std::move(refused);
  return section;
}

std::string TextOf(const Section& section) {
  std::string text = section.heading.empty() ? "" : '\n' + section.heading + '\n';
  const std::size_t count = section.table.rows.size();
  truetriad::Table shown = section.table;
  shown.rows.resize(std::min(count, kMostRows));
  text += truetriad::TextOf(shown);
  if (count > kMostRows) text += "  and " + std::to_string(count - kMostRows) + " more (--json)\n";
  for (const std::string& note : section.notes) text += Wrapped(note);
  return text;
}

/// The text of all sections that have contents.
std::string TextOfAll(const std::vector<Section>& sections) {
  std::string text;
  for (const Section& section : sections) {
    if (!section.table.rows.empty() || !section.notes.empty()) text += TextOf(section);
  }
  return text;
}

/// The numeric columns of the CSV with their paths in a quantity's tree. A path that ends in / is
/// an estimate with three columns: value, lower and upper end.
std::vector<std::pair<std::string, Json::json_pointer>> CsvColumns() {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 22> kColumns = {{
      {"units", "/units"},
      {"mean", "/mean"},
      {"lowest", "/lowest"},
      {"highest", "/highest"},
      {"sigma_within", "/observed/within/sigma/value"},
      {"sigma_overall", "/observed/overall/sigma/value"},
      {"sigma_calibration", "/calibration_sigma"},
      {"process_sigma_within", "/process/within/sigma/value"},
      {"process_sigma_overall", "/process/overall/sigma/value"},
      {"normality_p", "/normality_p"},
      {"lower", "/lower"},
      {"target", "/target"},
      {"upper", "/upper"},
      {"missed", "/missed"},
      {"expected_outside", "/observed/overall/expected_outside"},
      {"cp", "/observed/within/cp/"},
      {"cpk", "/observed/within/cpk/"},
      {"pp", "/observed/overall/pp/"},
      {"ppk", "/observed/overall/ppk/"},
      {"process_cpk", "/process/within/cpk/"},
      {"process_pp", "/process/overall/pp/"},
      {"process_ppk", "/process/overall/ppk/"},
  }};
  std::vector<std::pair<std::string, Json::json_pointer>> columns;
  for (const auto& [name, place] : kColumns) {
    const std::string column(name), at(place);
    if (at.ends_with('/')) {
      columns.emplace_back(column, at + "value");
      columns.emplace_back(column + "_lower", at + "lower");
      columns.emplace_back(column + "_upper", at + "upper");
    } else {
      columns.emplace_back(column, at);
    }
  }
  return columns;
}

}  // namespace

std::string SummaryText(const Json& summary) {
  const std::vector<Section> yield = YieldSections(summary["yield"]);
  std::string text = TextOf(yield.front()).substr(1);
  text += TextOfAll({yield.begin() + 1, yield.end()});
  text += TextOfAll({ReasonsSection(summary["reasons"])});
  text += TextOfAll(LimitsSections(ListIn(summary["limits"])));
  text += TextOfAll({ChartsSection(summary["charts"]), GoldenSection(ListIn(summary["golden"]))});
  return summary.contains("study") ? text + TextOfAll({StudySection(summary["study"])}) : text;
}

Json SummaryTables(const Json& summary) {
  std::vector<Section> sections = YieldSections(summary["yield"]);
  std::ranges::move(LimitsSections(ListIn(summary["limits"])), std::back_inserter(sections));
  sections.push_back(GoldenSection(ListIn(summary["golden"])));
  Json tables = Json::array();
  for (const Section& section : sections) {
    if (section.table.rows.empty() && section.notes.empty()) continue;
    tables.push_back({{"heading", section.heading},
                      {"header", section.table.header},
                      {"alignment", section.table.alignment},
                      {"rows", section.table.rows},
                      {"notes", section.notes}});
  }
  return tables;
}

std::string SummaryCsv(const Json& summary) {
  // Names come from this program and have no commas or quotes.
  const auto columns = CsvColumns();
  std::string text = "name,kind,unit";
  for (const auto& [name, place] : columns) text += ',' + name;
  text += '\n';
  for (const auto& [kind, list] : {std::pair("limit", "limits"), {"parameter", "parameters"}}) {
    for (const Json& quantity : summary[list]) {
      text += Words(quantity["name"]) + "," + kind + "," + quantity.value("unit", "");
      for (const auto& [name, place] : columns) {
        const double number = Number(quantity.value(place, Json()));
        text += std::isfinite(number) ? ',' + NumberText(number) : ",";
      }
      text += '\n';
    }
  }
  return text;
}

}  // namespace truetriad::fleet
