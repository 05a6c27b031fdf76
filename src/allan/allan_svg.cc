// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "allan/allan_report.h"
#include "report/chart_frame.h"
#include "report/format.h"
#include "report/svg.h"

namespace truetriad {
namespace {

constexpr std::string_view kStyle = R"css(
svg{background:#fff;font:12px system-ui,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif}
text{fill:#5b6675}.start{text-anchor:start}.middle{text-anchor:middle}.end{text-anchor:end}
.head{font-size:17px;font-weight:600;fill:#1c2430}.title{font-size:13px;font-weight:600;fill:#1c2430}
.frame{fill:none;stroke:#aeb7c2}.grid{stroke:#dde2e8}.minor{stroke:#f0f2f5}
.band{fill:#1f5fbf;fill-opacity:.16}.curve{fill:none;stroke:#1f5fbf;stroke-width:1.6}.point{fill:#1f5fbf}
.slope{fill:none;stroke-width:1.3;stroke-dasharray:6 4}.mark{stroke:#fff;stroke-width:1.2}
.N{stroke:#d1690e}.B{stroke:#1a7f37}.K{stroke:#b3261e}.Q{stroke:#7a3fb0}
.fillN{fill:#d1690e}.fillB{fill:#1a7f37}.fillK{fill:#b3261e}.fillQ{fill:#7a3fb0}.bold{font-weight:600}
)css";

// User units, of which text is 12 high: three panels and the numbers on their left.
constexpr double kPanelWidth = 330.0, kPanelHeight = 300.0, kLeft = 78.0, kGap = 24.0,
                 kRight = 16.0;
// Title and legend stand above the first row; a row has a title above its panels, and below them
// its ticks and a line for each of four coefficients.
constexpr double kHead = 58.0, kRowTop = 34.0, kRowBottom = 130.0;

std::string PowerOfTen(int decade) {
  if (decade >= -3 && decade <= 4) return Significant(std::pow(10.0, decade), 6);
  std::string text = "10";
  constexpr std::array<std::string_view, 10> kRaised = {
      "⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  for (const char c : std::to_string(decade)) {
    text += c == '-' ? "⁻" : kRaised[static_cast<std::size_t>(c - '0')];
  }
  return text;
}

/// A logarithmic axis from one edge of a panel to the other.
struct LogAxis {
  Range decades;
  double from = 0.0, to = 0.0;  ///< User units.

  double At(double value) const { return AtDecade(std::log10(value)); }
  double AtDecade(double decade) const {
    return from + (to - from) * (decade - decades.low) / (decades.high - decades.low);
  }
  bool Holds(double value) const {
    // A decade at the very edge must not fall out by rounding.
    return std::log10(value) >= decades.low - 1e-9 && std::log10(value) <= decades.high + 1e-9;
  }
  /// Calls `draw(place, decade, is_whole)` for each digit of each decade.
  template <typename Draw>
  void EachLine(const Draw& draw) const {
    for (int decade = static_cast<int>(std::floor(decades.low)); decade <= decades.high; ++decade) {
      for (int digit = 1; digit < 10; ++digit) {
        const double value = digit * std::pow(10.0, decade);
        if (Holds(value)) draw(At(value), decade, digit == 1);
      }
    }
  }
};

/// A log-log panel.
class LogPanel {
 public:
  LogPanel(Svg& svg, double left, double top, const Range& tau, const Range& deviation)
      : svg_(svg), x_{tau, left, left + kPanelWidth}, y_{deviation, top + kPanelHeight, top} {}

  void DrawGrid(bool with_numbers) {
    x_.EachLine([&](double x, int decade, bool is_whole) {
      svg_.Line(x, y_.to, x, y_.from, is_whole ? "grid" : "minor");
      if (is_whole) svg_.Text(x, y_.from + 16.0, PowerOfTen(decade), "middle");
    });
    y_.EachLine([&](double y, int decade, bool is_whole) {
      svg_.Line(x_.from, y, x_.to, y, is_whole ? "grid" : "minor");
      if (is_whole && with_numbers) svg_.Text(x_.from - 6.0, y + 4.0, PowerOfTen(decade), "end");
    });
  }

  void DrawCurve(const std::vector<AllanPoint>& points, double scale) {
    const auto clamped = [&](double deviation) {
      return deviation > 0.0 ? std::clamp(y_.At(scale * deviation), y_.to, y_.from) : y_.from;
    };
    std::vector<std::pair<double, double>> band, curve;
    for (const AllanPoint& point : points) {
      curve.emplace_back(x_.At(point.tau_s), y_.At(scale * point.deviation.value));
      band.emplace_back(curve.back().first, clamped(point.deviation.high));
    }
    for (std::size_t i = points.size(); i-- > 0;) {
      band.emplace_back(curve[i].first, clamped(points[i].deviation.low));
    }
    svg_.Polyline(band, "band");
    svg_.Polyline(curve, "curve");
    for (const auto& [x, y] : curve) svg_.Circle(x, y, 1.8, "point");
  }

  /// The line of a coefficient through its mark, over `reach` as far as it is inside the panel.
  void DrawSlope(const AllanCoefficient& coefficient, const Range& reach) {
    const std::string symbol(1, coefficient.symbol);
    const double mark_tau = std::log10(coefficient.mark_tau_s), mark = std::log10(coefficient.mark);
    double from = std::max(reach.low, x_.decades.low), to = std::min(reach.high, x_.decades.high);
    if (coefficient.slope != 0.0) {
      // Where the line leaves the panel at the bottom or top.
      const double low = mark_tau + (y_.decades.low - mark) / coefficient.slope;
      const double high = mark_tau + (y_.decades.high - mark) / coefficient.slope;
      from = std::max(from, std::min(low, high)), to = std::min(to, std::max(low, high));
    }
    const auto y_at = [&](double tau) {
      return y_.AtDecade(mark + coefficient.slope * (tau - mark_tau));
    };
    if (from < to) {
      svg_.Line(x_.AtDecade(from), y_at(from), x_.AtDecade(to), y_at(to), "slope " + symbol);
    }
    if (!x_.Holds(coefficient.mark_tau_s) || !y_.Holds(coefficient.mark)) return;
    const double x = x_.AtDecade(mark_tau), y = y_.AtDecade(mark);
    svg_.Circle(x, y, 4.4, "mark fill" + symbol);
    svg_.Text(x + 7.0, y - 7.0, symbol, "start bold fill" + symbol);
  }

  void DrawFrame(const std::string& title) {
    svg_.Rectangle(x_.from, y_.to, kPanelWidth, kPanelHeight, "frame");
    svg_.Text(x_.from, y_.to - 8.0, title, "start title");
  }

  /// A line for each coefficient below the panel.
  void DrawLegend(const std::vector<AllanCoefficient>& coefficients) {
    double y = y_.from + 56.0;
    for (const AllanCoefficient& coefficient : coefficients) {
      const std::string symbol(1, coefficient.symbol);
      svg_.Text(x_.from, y, symbol, "start bold fill" + symbol);
      svg_.Text(
          x_.from + 16.0,
          y,
          ValueText(coefficient) + " " + coefficient.unit + "  (" + IntervalText(coefficient) + ")",
          "start");
      y += 17.0;
    }
    svg_.Text((x_.from + x_.to) / 2.0, y_.from + 33.0, "tau [s]", "middle");
  }

 private:
  Svg& svg_;
  LogAxis x_, y_;
};

/// What a row's panels show, in decades: all of the curves and marks, on one scale, so that the
/// axes can be compared.
std::pair<Range, Range> RowRanges(const AllanTriad& triad, const AllanScale& scale) {
  Range tau, curve;
  tau.Add(0.0);  // N is marked at 1 s, K at 3 s.
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
      // A mark that is further from the curve than 2.5 decades would flatten it, and stays outside.
      const double mark = std::log10(coefficient.mark);
      if (mark > curve.low - 2.5 && mark < curve.high + 2.5) deviation.Add(mark);
    }
  }
  return {{tau.low - 0.12, tau.high + 0.12}, {deviation.low - 0.2, deviation.high + 0.2}};
}

/// How far the line of a coefficient is drawn, in log10 of tau: past its mark and the part of the
/// curve that it explains.
Range Reach(const AllanCoefficient& coefficient, const AllanAxis& axis) {
  const double mark = std::log10(coefficient.mark_tau_s);
  Range reach{mark - 0.6, mark + 0.6};
  if (coefficient.symbol == 'N' && axis.white_range_s) {
    reach.Add(std::log10(axis.white_range_s->front()));
    reach.Add(std::log10(axis.white_range_s->back()) + 0.3);
  }
  if (coefficient.symbol == 'K') reach.Add(std::log10(axis.points.back().tau_s));
  if (coefficient.symbol == 'Q') reach.Add(std::log10(axis.points.front().tau_s));
  return reach;
}

void DrawHead(const AllanResult& result, double width, Svg* svg) {
  svg->Text(kLeft,
            24.0,
            "Allan deviation" + (result.serial.empty() ? "" : ", unit " + result.serial),
            "start head");
  // The end of a long path says which recording it is; so much has room beside the title.
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

void DrawRow(const AllanTriad& triad, double top, Svg* svg) {
  const AllanScale scale = ShownScale(triad);
  const auto [tau, deviation] = RowRanges(triad, scale);
  for (std::size_t i = 0; i < 3; ++i) {
    const AllanAxis& axis = triad.axes[i];
    LogPanel panel(
        *svg, kLeft + static_cast<double>(i) * (kPanelWidth + kGap), top, tau, deviation);
    const std::string name = std::string(TriadName(triad.triad)) + " " + AxisLetter(i);
    if (axis.points.empty()) {
      panel.DrawFrame(name + ": constant");
      continue;
    }
    panel.DrawGrid(i == 0);
    panel.DrawCurve(axis.points, scale.shown_per_raw);
    const std::vector<AllanCoefficient> coefficients = Coefficients(axis, scale);
    for (const AllanCoefficient& coefficient : coefficients) {
      panel.DrawSlope(coefficient, Reach(coefficient, axis));
    }
    panel.DrawFrame(triad.at_rest() ? name : name + ": NOT AT REST");
    panel.DrawLegend(coefficients);
  }
  svg->RotatedText(
      18.0, top + kPanelHeight / 2.0, -90.0, "Allan deviation [" + scale.unit + "]", "middle");
}

}  // namespace

std::string AllanSvg(const AllanResult& result) {
  const double width = kLeft + 3.0 * kPanelWidth + 2.0 * kGap + kRight;
  const double row = kRowTop + kPanelHeight + kRowBottom;
  Svg svg(width,
          kHead + row * static_cast<double>(result.triads.size()),
          "Allan deviation of " + result.source);
  DrawHead(result, width, &svg);
  for (std::size_t i = 0; i < result.triads.size(); ++i) {
    DrawRow(result.triads[i], kHead + kRowTop + row * static_cast<double>(i), &svg);
  }
  return svg.FinishAlone(kStyle);
}

}  // namespace truetriad
