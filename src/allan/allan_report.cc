// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_report.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "report/content.h"
#include "report/page.h"
#include "report/svg.h"
#include "report/table.h"
#include "truetriad/base/triad.h"

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
     "level line at 0.664 B",
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
     "Q not visible, as usual for rate readings: no slope -1 at short tau."},
}};

namespace {

std::string AllanNumber(double value) { return Significant(value, 4); }

/// A row of the table below a coefficient.
struct Detail {
  std::string name;
  double number = 0.0;
  std::string unit;
};

/// N in the units that data sheets use, if the unit of the readings is known.
std::vector<Detail> DensityInCommonUnits(const AllanTriad& triad, double density_raw) {
  if (triad.unit.is_counts && !triad.si_per_count) return {};
  const double density = triad.si_per_count.value_or(triad.unit.truth_per_raw) * density_raw;
  const double per_root_hour = std::sqrt(3600.0);  // 1 / √Hz is √s.
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

/// A coefficient has the same details for every axis, in the same order; only the last may be
/// missing.
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
  if (coefficient.symbol == 'Q') return {{"Q times sample rate", value * triad.rate_hz, unit}};
  std::vector<Detail> details = DensityInCommonUnits(triad, axis.white_density->value);
  details.insert(details.begin(), {"σ of one sample", value * std::sqrt(triad.rate_hz), unit});
  if (axis.white_range_s) {
    details.push_back({"fitted from tau", axis.white_range_s->front(), "s"});
    details.push_back({"to tau", axis.white_range_s->back(), "s"});
  }
  return details;
}

/// For each coefficient a row of values and a row of intervals, followed by rows of details if an
/// axis shows the coefficient.
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
    if (rows.size() == 2) rows.pop_back();  // No axis shows the coefficient.
    table.rows.insert(table.rows.end(), rows.begin(), rows.end());
  }
  return table;
}

/// The text on one triad: a sentence, and a table if it was at rest.
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

/// The triads that were not at rest, each with the reason; empty if all of them were at rest.
std::vector<std::string> Disturbances(const AllanResult& result) {
  std::vector<std::string> disturbances;
  for (const AllanTriad& triad : result.triads) {
    if (triad.at_rest()) continue;
    disturbances.push_back(std::string(TriadName(triad.triad)) + ": " + triad.disturbance);
  }
  return disturbances;
}

/// The warnings about the coefficients, and notes that explain words of the tables.
std::vector<Section> RemarksOf(const AllanResult& result) {
  Section warnings{"Warnings", {}}, notes{"Notes", {}};
  std::string hidden;
  bool bound = false;
  for (const AllanTriad& triad : result.triads) {
    for (const std::string& warning : triad.warnings) warnings.Add(Bullet{warning});
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
    if (hidden.find(kind.symbol) == std::string::npos) continue;
    notes.Add(Bullet{std::string(kind.why_hidden)});
  }
  if (bound) {
    notes.Add(Bullet{
        "B ≤ is an upper bound: the curve still falls at its end, or shows nothing above white "
        "noise. The bias may be more stable; a longer log may show it."});
  }
  return {warnings, notes};
}

// --------------------------------------------------------------------------------------- plot

constexpr std::string_view kStyle = R"css(
svg{background:#fff;font:12px system-ui,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif}
text{fill:#5b6675}.start{text-anchor:start}.middle{text-anchor:middle}.end{text-anchor:end}
.head{font-size:17px;font-weight:600;fill:#1c2430}.title{font-size:13px;font-weight:600;fill:#1c2430}
.frame{fill:none;stroke:#aeb7c2}.grid{stroke:#dde2e8}.minor{stroke:#f0f2f5}
.band{fill:#1f5fbf;fill-opacity:.16}.curve{fill:none;stroke:#1f5fbf;stroke-width:1.6}.dots{fill:none;stroke:#1f5fbf;stroke-width:3.6;stroke-linecap:round}
.slope{fill:none;stroke-width:1.3;stroke-dasharray:6 4}.mark{stroke:#fff;stroke-width:1.2}
.N{stroke:#d1690e}.B{stroke:#1a7f37}.K{stroke:#b3261e}.Q{stroke:#7a3fb0}
.fillN{fill:#d1690e}.fillB{fill:#1a7f37}.fillK{fill:#b3261e}.fillQ{fill:#7a3fb0}.bold{font-weight:600}
)css";

// User units (text is 12 high): a panel, and the space beside and between panels.
constexpr double kPanelWidth = 330.0, kPanelHeight = 300.0, kLeft = 78.0, kGap = 24.0,
                 kRight = 16.0;
// Title and legend are above the first row of panels. A row has titles above its panels; below, it
// has ticks and a line of text for each of four coefficients.
constexpr double kHead = 58.0, kRowTop = 34.0, kRowBottom = 130.0;

void DrawCurve(const std::vector<AllanPoint>& points, double scale, Frame* frame) {
  Points curve, high, low;
  for (const auto& [tau_s, deviation, dof, terms] : points) {
    curve.emplace_back(tau_s, scale * deviation.value);
    high.emplace_back(tau_s, scale * deviation.high);
    low.emplace_back(tau_s, scale * deviation.low);
  }
  frame->DrawBand(high, low);
  frame->DrawLine(curve, "curve");
  frame->DrawDots(curve, "dots");
}

/// The range over which the line of a coefficient is drawn, in decades of tau. It includes the mark
/// and the part of the curve that the coefficient explains, and is clipped to the panel.
Range Reach(const AllanCoefficient& coefficient,
            const AllanAxis& axis,
            const Range& tau,
            const Range& deviation) {
  const double mark = std::log10(coefficient.mark_tau_s);
  Range reach{mark - 0.6, mark + 0.6};
  if (coefficient.symbol == 'N' && axis.white_range_s) {
    reach.Add(std::log10(axis.white_range_s->front()));
    reach.Add(std::log10(axis.white_range_s->back()) + 0.3);
  }
  if (coefficient.symbol == 'K') reach.Add(std::log10(axis.points.back().tau_s));
  if (coefficient.symbol == 'Q') reach.Add(std::log10(axis.points.front().tau_s));
  double from = std::max(reach.low, tau.low), to = std::min(reach.high, tau.high);
  if (coefficient.slope != 0.0) {
    // Where the line leaves the panel at its bottom or top, the line ends.
    const double height = std::log10(coefficient.mark);
    const double low = mark + (deviation.low - height) / coefficient.slope;
    const double high = mark + (deviation.high - height) / coefficient.slope;
    from = std::max(from, std::min(low, high)), to = std::min(to, std::max(low, high));
  }
  return {from, to};
}

/// The line of a coefficient through its mark.
void DrawSlope(const AllanCoefficient& coefficient,
               const AllanAxis& axis,
               const Range& tau,
               const Range& deviation,
               Frame* frame,
               Svg* svg) {
  const Range reach = Reach(coefficient, axis, tau, deviation);
  const std::string symbol(1, coefficient.symbol);
  const auto at = [&](double decade) {
    const double tau_s = std::pow(10.0, decade);
    return std::pair(
        tau_s, coefficient.mark * std::pow(tau_s / coefficient.mark_tau_s, coefficient.slope));
  };
  if (reach.low < reach.high) frame->DrawLine({at(reach.low), at(reach.high)}, "slope " + symbol);
  const double mark = std::log10(coefficient.mark);
  if (mark < deviation.low || mark > deviation.high) return;
  const double x = frame->X(coefficient.mark_tau_s), y = frame->Y(coefficient.mark);
  svg->Circle(x, y, 4.4, "mark fill" + symbol);
  svg->Text(x + 7.0, y - 7.0, symbol, "start bold fill" + symbol);
}

/// The ranges of a row's panels, in decades: all curves and marks on one scale, so that the axes
/// can be compared.
std::pair<Range, Range> RowRanges(const AllanTriad& triad, const AllanScale& scale) {
  Range tau{.is_log = true}, curve{.is_log = true};
  tau.Add(0.0);  // The mark of N is at 1 s, that of K at 3 s: 1 s is always shown.
  tau.Add(std::log10(3.0));
  for (const AllanAxis& axis : triad.axes) {
    for (const AllanPoint& point : axis.points) {
      tau.Add(std::log10(point.tau_s));
      curve.Add(std::log10(scale.shown_per_raw * point.deviation.value));
    }
  }
  Range deviation = curve;
  for (const AllanAxis& axis : triad.axes) {
    for (const AllanCoefficient& coefficient : Coefficients(axis, scale)) {
      // A mark more than 2.5 decades from the curve stays outside: it would flatten the curve.
      const double mark = std::log10(coefficient.mark);
      if (mark > curve.low - 2.5 && mark < curve.high + 2.5) deviation.Add(mark);
    }
  }
  return {tau, deviation};
}

void DrawHead(const AllanResult& result, double width, Svg* svg) {
  svg->Text(kLeft,
            24.0,
            "Allan deviation" + (result.serial.empty() ? "" : ", unit " + result.serial),
            "start head");
  // Of a long path only the end is shown, which identifies the recording; 80 characters fit beside
  // the title.
  constexpr std::size_t kMostSource = 80;
  const std::string source = result.source.size() <= kMostSource
                                 ? result.source
                                 : "…" + result.source.substr(result.source.size() - kMostSource);
  svg->Text(width - kRight, 24.0, source, "end");
  const double y = 45.0;
  double x = kLeft;
  svg->Line(x, y - 4.0, x + 22.0, y - 4.0, "curve");
  svg->Text(x + 28.0, y, "deviation, 95 % band", "start");
  for (const AllanCoefficientKind& kind : kAllanCoefficientKinds) {
    const std::string symbol(1, kind.symbol);
    x += 207.0;
    svg->Line(x, y - 4.0, x + 22.0, y - 4.0, "slope " + symbol);
    svg->Text(x + 28.0, y, symbol, "start bold fill" + symbol);
    svg->Text(x + 42.0, y, kind.line, "start");
  }
}

/// The panel of an axis, and a line for each coefficient below it.
void DrawPanel(const AllanTriad& triad,
               std::size_t i,
               double top,
               const std::pair<Range, Range>& ranges,
               Svg* svg) {
  const AllanAxis& axis = triad.axes[i];
  const AllanScale scale = ShownScale(triad);
  const auto& [tau, deviation] = ranges;
  const Frame::Box box{
      kLeft + static_cast<double>(i) * (kPanelWidth + kGap), top, kPanelWidth, kPanelHeight};
  const std::string name = std::string(TriadName(triad.triad)) + ' ' + AxisLetter(i);
  if (axis.points.empty()) {
    svg->Rectangle(box.left, box.top, box.width, box.height, "frame");
    svg->Text(box.left, box.top - 8.0, name + ": constant", "start title");
    return;
  }
  Frame frame(*svg, box, tau, deviation);
  frame.Draw(triad.at_rest() ? name : name + ": NOT AT REST", "tau [s]", /*has_y=*/i == 0);
  DrawCurve(axis.points, scale.shown_per_raw, &frame);
  double y = top + kPanelHeight + 56.0;
  for (const AllanCoefficient& coefficient : Coefficients(axis, scale)) {
    DrawSlope(coefficient, axis, tau, deviation, &frame, svg);
    const std::string symbol(1, coefficient.symbol);
    svg->Text(box.left, y, symbol, "start bold fill" + symbol);
    svg->Text(
        box.left + 16.0,
        y,
        ValueText(coefficient) + " " + coefficient.unit + "  (" + IntervalText(coefficient) + ")",
        "start");
    y += 17.0;
  }
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

std::string AllanSvg(const AllanResult& result) {
  const double width = kLeft + 3.0 * kPanelWidth + 2.0 * kGap + kRight;
  const double row = kRowTop + kPanelHeight + kRowBottom;
  Svg svg(width,
          kHead + row * static_cast<double>(result.triads.size()),
          "Allan deviation of " + result.source);
  DrawHead(result, width, &svg);
  double top = kHead + kRowTop;
  for (const AllanTriad& triad : result.triads) {
    const AllanScale scale = ShownScale(triad);
    const std::pair<Range, Range> ranges = RowRanges(triad, scale);
    for (std::size_t i = 0; i < triad.axes.size(); ++i) DrawPanel(triad, i, top, ranges, &svg);
    svg.RotatedText(
        18.0, top + kPanelHeight / 2.0, -90.0, "Allan deviation [" + scale.unit + "]", "middle");
    top += row;
  }
  return svg.FinishAlone(kStyle);
}

Drawing AllanDrawing(const AllanResult& result) {
  return {PictureOf(result),
          "Deviation over averaging time with its 95 % band, and the line of each coefficient."};
}

VerbReport ReportOf(const AllanResult& result) {
  PageContent content{
      TitleOf(result),
      {Grade::kGood, "AT REST", TitleOf(result) + ": the coefficients of all sensors are given."},
      {{"", {}, [&result] { return std::vector{AllanDrawing(result)}; }}}};
  if (const std::vector<std::string> moved = Disturbances(result); !moved.empty()) {
    content.headline = {Grade::kBad,
                        "NOT AT REST: " + moved.front(),
                        TitleOf(result) +
                            ": sensors that were not at rest have no coefficients, since these "
                            "would describe the motion."};
    for (std::size_t i = 1; i < moved.size(); ++i) {
      content.sections.front().Add(Bullet{"NOT AT REST: " + moved[i]});
    }
  }
  for (const AllanTriad& triad : result.triads) {
    auto [head, table] = WordsOf(triad);
    content.sections.push_back({TriadTitle(triad.triad), {std::move(head)}});
    if (triad.at_rest()) content.sections.back().Add(std::move(table));
  }
  for (Section& remarks : RemarksOf(result)) {
    if (!remarks.blocks.empty()) content.sections.push_back(std::move(remarks));
  }
  return ReportOf(content);
}

}  // namespace truetriad
