// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_report.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "report/content.h"
#include "report/format.h"
#include "report/page.h"
#include "report/svg.h"
#include "report/table.h"
#include "truetriad/base/units.h"

namespace truetriad {

const std::array<AllanCoefficientKind, 4> kAllanCoefficientKinds = {{
    {'N',
     "noise density",
     "/√Hz",
     -0.5,
     1.0,
     "slope -1/2, read at 1 s",
     "N not visible: no part of the curve has the slope -1/2."},
    {'B',
     "bias instability",
     "",
     0.0,
     0.0,
     "line at 0.664 B",
     "B not visible: the log is too short to reach a minimum."},
    {'K',
     "rate random walk",
     "/s/√Hz",
     0.5,
     3.0,
     "slope +1/2, read at 3 s",
     "K not visible: the curve does not reach the slope +1/2; a longer log may show it."},
    {'Q',
     "quantisation",
     "·s",
     -1.0,
     std::numbers::sqrt3,
     "slope -1, read at √3 s",
     "Q not visible: no slope -1 at short tau, which is usual for rate readings."},
}};

namespace {

std::string AllanNumber(double value) { return Significant(value, 4); }

/// A row of the table below a coefficient.
struct Detail {
  std::string name;
  double number = 0.0;
  std::string unit;
};

/// N in the units that data sheets use, where the unit of the readings is known.
std::vector<Detail> DensityInCommonUnits(const AllanTriad& triad, double density_raw) {
  if (triad.unit.is_counts && !triad.si_per_count) return {};
  const double density = triad.si_per_count.value_or(triad.unit.truth_per_raw) * density_raw;
  const double per_root_hour = std::sqrt(3600.0);  // 1 / √Hz is the root of a second.
  switch (triad.triad) {
    case Triad::kGyroscope:
      return {{"angle random walk", density * kDegPerRad * per_root_hour, "deg/√h"}};
    case Triad::kAccelerometer:
      return {{"velocity random walk", density * per_root_hour, "m/s/√h"},
              {"noise density", density / kStandardGravityMps2 * 1e6, "µg/√Hz"}};
    case Triad::kMagnetometer:
      return {{"noise density", density * 1e3, "nT/√Hz"}};
  }
  return {};
}

/// Of any axis the same in the same order; only the last ones may be missing.
std::vector<Detail> DetailsOf(const AllanTriad& triad,
                              const AllanAxis& axis,
                              const AllanCoefficient& coefficient) {
  const auto [shown_per_raw, unit] = ShownScale(triad);
  const double value = coefficient.value.value;
  if (coefficient.symbol == 'B') {
    return {{"minimum, 0.664 B", coefficient.mark, unit}, {"at tau", coefficient.mark_tau_s, "s"}};
  }
  if (coefficient.symbol == 'K') {
    return {{"step of one sample", value / std::sqrt(triad.rate_hz), unit}};
  }
  if (coefficient.symbol == 'Q') return {{"in one sample", value * triad.rate_hz, unit}};
  std::vector<Detail> details = DensityInCommonUnits(triad, axis.white_density->value);
  details.insert(details.begin(), {"one sample", value * std::sqrt(triad.rate_hz), unit});
  if (axis.white_range_s) {
    details.push_back({"fitted from tau", axis.white_range_s->front(), "s"});
    details.push_back({"to tau", axis.white_range_s->back(), "s"});
  }
  return details;
}

/// Each coefficient and its interval, with details where an axis shows it.
Table TableOf(const AllanTriad& triad) {
  const AllanScale scale = ShownScale(triad);
  Table table{.header = {"", "x", "y", "z", "unit"}, .alignment = "lrrrl", .rows = {}};
  const auto row = [](const std::string& name, const std::string& unit) {
    return std::vector<std::string>{name, "", "", "", unit};
  };
  for (const AllanCoefficientKind& kind : kAllanCoefficientKinds) {
    const std::string unit = scale.unit + std::string(kind.per);
    std::vector<std::vector<std::string>> rows = {
        row(std::string(kind.name) + " " + kind.symbol, unit), row("  95 % interval", unit)};
    for (std::size_t i = 0; i < 3; ++i) {
      rows[0][i + 1] = "not visible";
      for (const AllanCoefficient& coefficient : Coefficients(triad.axes[i], scale)) {
        if (coefficient.symbol != kind.symbol) continue;
        rows[0][i + 1] = ValueText(coefficient);
        rows[1][i + 1] = IntervalText(coefficient);
        std::size_t below = 2;
        for (const Detail& detail : DetailsOf(triad, triad.axes[i], coefficient)) {
          if (rows.size() == below) rows.push_back(row("  " + detail.name, detail.unit));
          rows[below++][i + 1] = AllanNumber(detail.number);
        }
      }
    }
    if (rows.size() == 2) rows.pop_back();  // No axis shows it.
    table.rows.insert(table.rows.end(), rows.begin(), rows.end());
  }
  return table;
}

/// What is said of one triad: a sentence, and a table where it was at rest.
std::pair<std::string, Table> WordsOf(const AllanTriad& triad) {
  const AllanScale scale = ShownScale(triad);
  std::string title(TriadName(triad.triad));
  title += ": " + Significant(triad.rate_hz, 6) + " Hz, " +
           (triad.duration_s < 3600.0 ? Significant(triad.duration_s, 4) + " s, "
                                      : Significant(triad.duration_s / 3600.0, 4) + " h, ") +
           std::to_string(triad.samples) + " samples";
  if (triad.filled_samples > 0) {
    title += ", " + std::to_string(triad.filled_samples) + " missing ones interpolated";
  }
  if (triad.breaks > 0) title += ", " + std::to_string(triad.breaks) + " break(s)";
  if (scale.shown_per_raw != 1.0) {
    title += "; 1 count = " + Significant(scale.shown_per_raw, 6) + " " + scale.unit;
  }
  if (!triad.at_rest()) return {title + ": not at rest, no coefficients", {}};
  return {title, TableOf(triad)};
}

std::string TitleOf(const AllanResult& result) {
  return "Allan deviation of " + result.source +
         (result.serial.empty() ? "" : ", unit " + result.serial);
}

/// What was not at rest, and why; empty where all was.
std::vector<std::string> Disturbances(const AllanResult& result) {
  std::vector<std::string> disturbances;
  for (const AllanTriad& triad : result.triads) {
    if (triad.at_rest()) continue;
    disturbances.push_back(std::string(TriadName(triad.triad)) + ": " + triad.disturbance);
  }
  return disturbances;
}

constexpr std::string_view kNoCoefficients =
    "No coefficients are stated for sensors that were not at rest: they would describe the motion.";

/// What may spoil the coefficients, and what the words of the tables mean, where they stand.
struct Remarks {
  std::string title;
  std::vector<std::string> points;
};
std::vector<Remarks> RemarksOf(const AllanResult& result) {
  Remarks warnings{"Warnings", {}}, notes{"Notes", {}};
  std::string hidden;
  bool bound = false;
  for (const AllanTriad& triad : result.triads) {
    for (const std::string& warning : triad.warnings) warnings.points.push_back(warning);
    for (const AllanAxis& axis : triad.axes) {
      if (axis.points.empty() || !triad.at_rest()) continue;
      std::string shown;
      for (const AllanCoefficient& coefficient : Coefficients(axis, ShownScale(triad))) {
        shown += coefficient.symbol;
        bound = bound || coefficient.upper_bound;
      }
      for (const AllanCoefficientKind& kind : kAllanCoefficientKinds) {
        if (shown.find(kind.symbol) == std::string::npos) hidden += kind.symbol;
      }
    }
  }
  for (const AllanCoefficientKind& kind : kAllanCoefficientKinds) {
    if (hidden.find(kind.symbol) != std::string::npos) notes.points.emplace_back(kind.why_hidden);
  }
  if (bound) {
    notes.points.emplace_back(
        "B ≤: the curve is still falling, or has no floor above white noise; the bias may be more "
        "stable than this. A longer log may show it.");
  }
  return {warnings, notes};
}

void AddBullets(const std::string& title,
                const std::vector<std::string>& points,
                PageContent* content) {
  if (points.empty()) return;
  Section& section = content->sections.emplace_back(Section{title, {}});
  for (const std::string& point : points) section.blocks.emplace_back(Bullet{point});
}

/// The plot as a picture that has its own style.
std::string PictureOf(const AllanResult& result) {
  std::string source;
  for (const char c : AllanSvg(result)) {
    constexpr std::string_view kSpecial = "%#\"<>?\n", kDigits = "0123456789ABCDEF";
    const auto byte = static_cast<unsigned char>(c);
    if (kSpecial.find(c) == std::string_view::npos) {
      source += c;
    } else {
      source += {'%', kDigits[byte >> 4U], kDigits[byte & 15U]};
    }
  }
  return "<img alt=\"" + EscapeMarkup(TitleOf(result)) + "\" src=\"data:image/svg+xml," +
         EscapeMarkup(source) + "\">\n";
}

}  // namespace

AllanScale ShownScale(const AllanTriad& triad) {
  if (!triad.si_per_count) return {1.0, DisplayUnit(triad.unit.name)};
  if (triad.triad == Triad::kGyroscope) return {*triad.si_per_count * kDegPerRad, "deg/s"};
  return {*triad.si_per_count, DisplayUnit(TruthUnitName(triad.triad))};
}

std::vector<AllanCoefficient> Coefficients(const AllanAxis& axis, const AllanScale& scale) {
  std::vector<AllanCoefficient> coefficients;
  const auto add = [&](const AllanCoefficientKind& kind, const std::optional<Interval>& raw) {
    if (!raw) return;
    AllanCoefficient& added = coefficients.emplace_back();
    static_cast<AllanCoefficientKind&>(added) = kind;
    added.value = Scaled(*raw, scale.shown_per_raw);
    added.unit = scale.unit + std::string(kind.per);
    added.mark_tau_s = kind.read_at_s;
    added.mark = added.value.value;
  };
  const auto& [white, flicker, walk, quantisation] = kAllanCoefficientKinds;
  add(white, axis.white_density);
  if (axis.instability) {
    add(flicker, axis.instability->coefficient);
    coefficients.back().upper_bound = axis.instability->at_end;
    coefficients.back().mark_tau_s = axis.instability->tau_s;
    coefficients.back().mark = scale.shown_per_raw * axis.instability->minimum.value;
  }
  add(walk, axis.random_walk);
  add(quantisation, axis.quantisation);
  return coefficients;
}

std::string ValueText(const AllanCoefficient& coefficient) {
  return (coefficient.upper_bound ? "≤ " : "") + AllanNumber(coefficient.value.value);
}

std::string IntervalText(const AllanCoefficient& coefficient) {
  return AllanNumber(coefficient.value.low) + "…" + AllanNumber(coefficient.value.high);
}

std::string AllanText(const AllanResult& result) {
  std::string text;
  for (const std::string& disturbance : Disturbances(result)) {
    text += Wrapped("NOT AT REST: " + disturbance, 0);
  }
  if (!text.empty()) text += Wrapped(kNoCoefficients, 0) + "\n";
  text += Wrapped(TitleOf(result), 0);
  for (const AllanTriad& triad : result.triads) {
    const auto [head, table] = WordsOf(triad);
    text += "\n" + Wrapped(head, 0) + TextOf(table);
  }
  for (const auto& [title, points] : RemarksOf(result)) {
    if (!points.empty()) text += "\n" + title + ":\n";
    for (const std::string& point : points) text += Wrapped(point, 2, "- ");
  }
  return text;
}

Drawing AllanDrawing(const AllanResult& result) {
  return {PictureOf(result),
          "Deviation over averaging time with its 95 % band, and the line of each coefficient."};
}

std::string AllanHtml(const AllanResult& result) {
  PageContent content{
      TitleOf(result), {Grade::kGood, "AT REST", "Coefficients of all sensors are stated."}, {}};
  if (const std::vector<std::string> moved = Disturbances(result); !moved.empty()) {
    content.headline = {Grade::kBad, "NOT AT REST: " + moved.front(), std::string(kNoCoefficients)};
    AddBullets("", {moved.begin() + 1, moved.end()}, &content);
  }
  content.sections.push_back(
      {"Curves", {}, [&result] { return std::vector{AllanDrawing(result)}; }});
  for (const AllanTriad& triad : result.triads) {
    auto [head, table] = WordsOf(triad);
    content.sections.push_back({TriadTitle(triad.triad), {std::move(head)}});
    if (triad.at_rest()) content.sections.back().blocks.emplace_back(std::move(table));
  }
  for (const auto& [title, points] : RemarksOf(result)) AddBullets(title, points, &content);
  return ReportOf(content).html;
}

}  // namespace truetriad
