// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "allan/allan_display.h"
#include "allan/allan_report.h"
#include "report/content.h"
#include "report/format.h"
#include "report/page.h"
#include "report/svg.h"
#include "report/table.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

/// Square roots of an hour: a density in unit/s/√Hz is √3600 times as much in unit/√h.
constexpr double kSecondsRootPerHourRoot = 60.0;

using AxisNumber = std::function<std::optional<double>(const AllanAxis&)>;

/// The table of one triad, row by row.
class CoefficientTable {
 public:
  explicit CoefficientTable(const AllanTriad& triad) : triad_(triad), scale_(ShownScale(triad)) {
    table_ = {.header = {"", "x", "y", "z", "unit"}, .alignment = "lrrrl", .rows = {}};
  }

  /// A coefficient and its interval; the row stays out when no axis shows it.
  void AddCoefficient(char symbol, const std::string& name, const std::string& unit) {
    std::vector<std::string> values = {name + " " + symbol};
    std::vector<std::string> intervals = {"  95 % interval"};
    for (const AllanAxis& axis : triad_.axes) {
      std::string value = "not visible";
      std::string interval;
      for (const AllanCoefficient& coefficient : Coefficients(axis, scale_)) {
        if (coefficient.symbol != symbol) continue;
        value = ValueText(coefficient);
        interval = AllanNumber(coefficient.value.low) + "…" + AllanNumber(coefficient.value.high);
      }
      values.push_back(value);
      intervals.push_back(interval);
    }
    values.push_back(unit);
    intervals.push_back(unit);
    seen_ = intervals[1] + intervals[2] + intervals[3] != "";
    table_.rows.push_back(values);
    if (seen_) table_.rows.push_back(intervals);
  }

  /// A row below the last coefficient, unless no axis shows it; `number` in raw units.
  void Add(const std::string& name,
           double scale,
           const std::string& unit,
           const AxisNumber& number) {
    if (!seen_) return;
    std::vector<std::string> row = {"  " + name};
    for (const AllanAxis& axis : triad_.axes) {
      const std::optional<double> value = number(axis);
      row.push_back(value ? AllanNumber(scale * *value) : "");
    }
    row.push_back(unit);
    table_.rows.push_back(row);
  }

  const AllanScale& scale() const { return scale_; }
  const Table& table() const { return table_; }

 private:
  const AllanTriad& triad_;
  AllanScale scale_;
  Table table_;
  bool seen_ = false;
};

/// The units that data sheets use, where the unit of the readings is known.
void AddDensityInCommonUnits(const AllanTriad& triad, CoefficientTable* table) {
  const AxisNumber density = [](const AllanAxis& axis) {
    return axis.white_density ? std::optional(axis.white_density->value) : std::nullopt;
  };
  if (triad.unit.is_counts && !triad.si_per_count) return;
  const double si = triad.si_per_count.value_or(triad.unit.truth_per_raw);
  switch (triad.triad) {
    case Triad::kGyroscope:
      table->Add("angle random walk", si * kDegPerRad * kSecondsRootPerHourRoot, "deg/√h", density);
      break;
    case Triad::kAccelerometer:
      table->Add("velocity random walk", si * kSecondsRootPerHourRoot, "m/s/√h", density);
      table->Add("noise density", si / kStandardGravityMps2 * 1e6, "µg/√Hz", density);
      break;
    case Triad::kMagnetometer:
      table->Add("noise density", si * 1e3, "nT/√Hz", density);
      break;
  }
}

/// What is said of one triad: a sentence, and a table where it was at rest.
struct TriadWords {
  std::string head;
  Table table;
};

TriadWords WordsOf(const AllanTriad& triad) {
  std::string title(TriadName(triad.triad));
  title += ": " + Significant(triad.rate_hz, 6) + " Hz, " +
           (triad.duration_s < 3600.0 ? Significant(triad.duration_s, 4) + " s, "
                                      : Significant(triad.duration_s / 3600.0, 4) + " h, ") +
           std::to_string(triad.samples) + " samples";
  if (triad.filled_samples > 0) {
    title += ", " + std::to_string(triad.filled_samples) + " missing ones interpolated";
  }
  if (triad.breaks > 0) title += ", " + std::to_string(triad.breaks) + " break(s)";
  CoefficientTable table(triad);
  const AllanScale& scale = table.scale();
  if (scale.shown_per_raw != 1.0) {
    title += "; 1 count = " + Significant(scale.shown_per_raw, 6) + " " + scale.unit;
  }
  if (!triad.at_rest()) return {title + ": not at rest, no coefficients", {}};

  table.AddCoefficient('N', "noise density", scale.unit + "/√Hz");
  table.Add("one sample", scale.shown_per_raw, scale.unit, [](const AllanAxis& axis) {
    return axis.white_sigma_sample;
  });
  AddDensityInCommonUnits(triad, &table);
  table.Add("fitted from tau", 1.0, "s", [](const AllanAxis& axis) {
    return axis.white_range_s ? std::optional(axis.white_range_s->front()) : std::nullopt;
  });
  table.Add("to tau", 1.0, "s", [](const AllanAxis& axis) {
    return axis.white_range_s ? std::optional(axis.white_range_s->back()) : std::nullopt;
  });
  table.AddCoefficient('B', "bias instability", scale.unit);
  table.Add("minimum, 0.664 B", scale.shown_per_raw, scale.unit, [](const AllanAxis& axis) {
    return axis.instability ? std::optional(axis.instability->minimum.value) : std::nullopt;
  });
  table.Add("at tau", 1.0, "s", [](const AllanAxis& axis) {
    return axis.instability ? std::optional(axis.instability->tau_s) : std::nullopt;
  });
  table.AddCoefficient('K', "rate random walk", scale.unit + "/s/√Hz");
  table.Add("step of one sample",
            scale.shown_per_raw / std::sqrt(triad.rate_hz),
            scale.unit,
            [](const AllanAxis& axis) {
              return axis.random_walk ? std::optional(axis.random_walk->value) : std::nullopt;
            });
  table.AddCoefficient('Q', "quantisation", scale.unit + "·s");
  table.Add(
      "in one sample", scale.shown_per_raw * triad.rate_hz, scale.unit, [](const AllanAxis& axis) {
        return axis.quantisation ? std::optional(axis.quantisation->value) : std::nullopt;
      });
  return {title, table.table()};
}

/// What the words of the tables mean, where they stand.
std::vector<std::string> NotesOf(const AllanResult& result) {
  bool bound = false;
  std::string missing;
  for (const char symbol : {'N', 'B', 'K', 'Q'}) {
    for (const AllanTriad& triad : result.triads) {
      for (const AllanAxis& axis : triad.axes) {
        bool seen = axis.points.empty() || !triad.at_rest();
        for (const AllanCoefficient& coefficient : Coefficients(axis, ShownScale(triad))) {
          seen = seen || coefficient.symbol == symbol;
          bound = bound || coefficient.upper_bound;
        }
        if (!seen && missing.find(symbol) == std::string::npos) missing += symbol;
      }
    }
  }
  constexpr std::array<std::pair<char, std::string_view>, 4> kReasons = {{
      {'N', "N not visible: no part of the curve has the slope -1/2."},
      {'B', "B not visible: the log is too short to reach a minimum."},
      {'K', "K not visible: the curve does not reach the slope +1/2; a longer log may show it."},
      {'Q', "Q not visible: no slope -1 at short tau, which is usual for rate readings."},
  }};
  std::vector<std::string> notes;
  for (const auto& [symbol, reason] : kReasons) {
    if (missing.find(symbol) != std::string::npos) notes.emplace_back(reason);
  }
  if (bound) {
    notes.emplace_back(
        "B ≤: the curve is still falling, or has no floor above white noise; the bias may be more "
        "stable than this. A longer log may show it.");
  }
  return notes;
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

std::string Listed(const std::string& title, const std::vector<std::string>& points) {
  std::string text;
  for (const std::string& point : points) text += Wrapped(point, 2, "- ");
  return text.empty() ? text : "\n" + title + ":\n" + text;
}

std::vector<std::string> WarningsOf(const AllanResult& result) {
  std::vector<std::string> warnings;
  for (const AllanTriad& triad : result.triads) {
    warnings.insert(warnings.end(), triad.warnings.begin(), triad.warnings.end());
  }
  return warnings;
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

std::string AllanText(const AllanResult& result) {
  std::string text;
  for (const std::string& disturbance : Disturbances(result)) {
    text += Wrapped("NOT AT REST: " + disturbance, 0);
  }
  if (!text.empty()) text += Wrapped(kNoCoefficients, 0) + "\n";
  text += Wrapped(TitleOf(result), 0);
  for (const AllanTriad& triad : result.triads) {
    const TriadWords words = WordsOf(triad);
    text += "\n" + Wrapped(words.head, 0) + TextOf(words.table);
  }
  return text + Listed("Warnings", WarningsOf(result)) + Listed("Notes", NotesOf(result));
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
    PageSection others;
    for (std::size_t i = 1; i < moved.size(); ++i) others.blocks.emplace_back(Bullet{moved[i]});
    if (!others.blocks.empty()) content.sections.push_back(std::move(others));
  }
  content.sections.push_back({"Curves", {}, {AllanDrawing(result)}});
  for (const AllanTriad& triad : result.triads) {
    TriadWords words = WordsOf(triad);
    content.sections.push_back({TriadTitle(triad.triad), {std::move(words.head)}});
    if (triad.at_rest()) content.sections.back().blocks.emplace_back(std::move(words.table));
  }
  for (const auto& [title, points] :
       {std::pair("Warnings", WarningsOf(result)), std::pair("Notes", NotesOf(result))}) {
    PageSection section{title, {}};
    for (const std::string& point : points) section.blocks.emplace_back(Bullet{point});
    if (!section.blocks.empty()) content.sections.push_back(std::move(section));
  }
  return HtmlOf(content);
}

}  // namespace truetriad
