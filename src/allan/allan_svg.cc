// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "allan/allan_display.h"
#include "allan/allan_report.h"
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

constexpr double kPanelWidth = 330.0, kPanelHeight = 300.0;
constexpr double kLeft = 78.0, kGap = 24.0, kRight = 16.0;
constexpr double kHead = 58.0;        // Above the first row: title and legend.
constexpr double kRowTop = 34.0;      // Above a row's panels.
constexpr double kRowBottom = 130.0;  // Below them: ticks, and a line for each coefficient.
/// A mark further below the curve than this many decades stays outside.
constexpr double kMostBelow = 2.5;

struct Bounds {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void Include(double value) { low = std::min(low, value), high = std::max(high, value); }
};

/// The exponent of the power of ten at or below the low end.
int FirstDecade(const Bounds& bounds) { return static_cast<int>(std::floor(bounds.low)); }

/// A log-log panel. Decades are log10 of the shown numbers.
class LogPanel {
 public:
  LogPanel(Svg& svg, double left, double top, Bounds tau, Bounds deviation)
      : svg_(svg), left_(left), top_(top), tau_(tau), deviation_(deviation) {}

  double X(double tau_s) const {
    return left_ + kPanelWidth * (std::log10(tau_s) - tau_.low) / (tau_.high - tau_.low);
  }
  double Y(double deviation) const {
    return top_ + kPanelHeight * (deviation_.high - std::log10(deviation)) /
                      (deviation_.high - deviation_.low);
  }

  void DrawGrid(bool with_numbers) {
    for (int decade = FirstDecade(tau_); decade <= tau_.high; ++decade) {
      for (int digit = 1; digit < 10; ++digit) {
        const double tau_s = digit * std::pow(10.0, decade);
        if (!Holds(tau_, tau_s)) continue;
        svg_.Line(X(tau_s), top_, X(tau_s), top_ + kPanelHeight, digit == 1 ? "grid" : "minor");
        if (digit != 1) continue;
        svg_.Text(X(tau_s), top_ + kPanelHeight + 16.0, PowerOfTen(decade), "middle");
      }
    }
    for (int decade = FirstDecade(deviation_); decade <= deviation_.high; ++decade) {
      for (int digit = 1; digit < 10; ++digit) {
        const double value = digit * std::pow(10.0, decade);
        if (!Holds(deviation_, value)) continue;
        svg_.Line(left_, Y(value), left_ + kPanelWidth, Y(value), digit == 1 ? "grid" : "minor");
        if (digit == 1 && with_numbers) {
          svg_.Text(left_ - 6.0, Y(value) + 4.0, PowerOfTen(decade), "end");
        }
      }
    }
  }

  void DrawCurve(const std::vector<AllanPoint>& points, double scale) {
    std::vector<std::pair<double, double>> band, curve;
    for (const AllanPoint& point : points) {
      curve.emplace_back(X(point.tau_s), Y(scale * point.deviation.value));
      band.emplace_back(X(point.tau_s), Clamped(scale * point.deviation.high));
    }
    for (auto point = points.rbegin(); point != points.rend(); ++point) {
      band.emplace_back(X(point->tau_s), Clamped(scale * point->deviation.low));
    }
    svg_.Polyline(band, "band");
    svg_.Polyline(curve, "curve");
    for (const auto& [x, y] : curve) svg_.Circle(x, y, 1.8, "point");
  }

  /// The line of a coefficient through its mark, over `reach` as far as it is inside the panel.
  void DrawSlope(const AllanCoefficient& coefficient, Bounds reach) {
    const std::string symbol(1, coefficient.symbol);
    const auto at = [&](double log_tau) {
      return std::log10(coefficient.mark) +
             coefficient.slope * (log_tau - std::log10(coefficient.mark_tau_s));
    };
    double from = std::max(reach.low, tau_.low), to = std::min(reach.high, tau_.high);
    if (coefficient.slope != 0.0) {
      // Where the line leaves the panel at the bottom or top.
      const auto crossing = [&](double level) {
        return std::log10(coefficient.mark_tau_s) +
               (level - std::log10(coefficient.mark)) / coefficient.slope;
      };
      const auto [first, second] =
          std::minmax({crossing(deviation_.low), crossing(deviation_.high)});
      from = std::max(from, first), to = std::min(to, second);
    }
    if (from < to) {
      svg_.Line(X(std::pow(10.0, from)),
                Y(std::pow(10.0, at(from))),
                X(std::pow(10.0, to)),
                Y(std::pow(10.0, at(to))),
                "slope " + symbol);
    }
    if (!Holds(tau_, coefficient.mark_tau_s) || !Holds(deviation_, coefficient.mark)) return;
    const double x = X(coefficient.mark_tau_s), y = Y(coefficient.mark);
    svg_.Circle(x, y, 4.4, "mark fill" + symbol);
    svg_.Text(x + 7.0, y - 7.0, symbol, "start bold fill" + symbol);
  }

  void DrawFrame(const std::string& title) {
    svg_.Rectangle(left_, top_, kPanelWidth, kPanelHeight, "frame");
    svg_.Text(left_, top_ - 8.0, title, "start title");
  }

  /// A line for each coefficient below the panel.
  void DrawLegend(const std::vector<AllanCoefficient>& coefficients) {
    double y = top_ + kPanelHeight + 56.0;
    for (const AllanCoefficient& coefficient : coefficients) {
      const std::string symbol(1, coefficient.symbol);
      svg_.Text(left_, y, symbol, "start bold fill" + symbol);
      svg_.Text(left_ + 16.0,
                y,
                ValueText(coefficient) + " " + coefficient.unit + "  (" +
                    AllanNumber(coefficient.value.low) + "…" + AllanNumber(coefficient.value.high) +
                    ")",
                "start");
      y += 17.0;
    }
  }

 private:
  static bool Holds(const Bounds& bounds, double value) {
    // A decade drawn at the very edge must not fall out by rounding.
    constexpr double kSlack = 1e-9;
    return std::log10(value) >= bounds.low - kSlack && std::log10(value) <= bounds.high + kSlack;
  }
  double Clamped(double deviation) const {
    return std::clamp(
        deviation > 0.0 ? Y(deviation) : top_ + kPanelHeight, top_, top_ + kPanelHeight);
  }
  static std::string PowerOfTen(double decade) {
    if (decade >= -3.0 && decade <= 4.0) return Significant(std::pow(10.0, decade), 6);
    std::string text = "10";
    constexpr std::array<std::string_view, 10> kRaised = {
        "⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    for (const char c : Fixed(decade, 0)) {
      text += c == '-' ? "⁻" : kRaised[static_cast<std::size_t>(c - '0')];
    }
    return text;
  }

  Svg& svg_;
  double left_, top_;
  Bounds tau_, deviation_;
};

/// What a row's panels show, in decades: all of the curves and marks, on one scale, so that the
/// axes can be compared.
std::pair<Bounds, Bounds> RowBounds(const AllanTriad& triad, const AllanScale& scale) {
  Bounds tau, curve;
  tau.Include(0.0);  // N is marked at 1 s, K at 3 s.
  tau.Include(std::log10(3.0));
  for (const AllanAxis& axis : triad.axes) {
    for (const AllanPoint& point : axis.points) {
      tau.Include(std::log10(point.tau_s));
      curve.Include(std::log10(scale.shown_per_raw * point.deviation.value));
    }
  }
  Bounds deviation = curve;
  for (const AllanAxis& axis : triad.axes) {
    for (const AllanCoefficient& coefficient : Coefficients(axis, scale)) {
      const double mark = std::log10(coefficient.mark);
      if (mark > curve.low - kMostBelow && mark < curve.high + kMostBelow) deviation.Include(mark);
    }
  }
  constexpr double kMargin = 0.12;
  return {{tau.low - kMargin, tau.high + kMargin}, {deviation.low - 0.2, deviation.high + 0.2}};
}

/// How far the line of a coefficient is drawn, in log10 of tau: past its mark and the part of the
/// curve that it explains.
Bounds Reach(const AllanCoefficient& coefficient, const AllanAxis& axis) {
  Bounds reach;
  reach.Include(std::log10(coefficient.mark_tau_s) - 0.6);
  reach.Include(std::log10(coefficient.mark_tau_s) + 0.6);
  switch (coefficient.symbol) {
    case 'N':
      if (axis.white_range_s) {
        reach.Include(std::log10(axis.white_range_s->front()));
        reach.Include(std::log10(axis.white_range_s->back()) + 0.3);
      }
      break;
    case 'K':
      reach.Include(std::log10(axis.points.back().tau_s));
      break;
    case 'Q':
      reach.Include(std::log10(axis.points.front().tau_s));
      break;
    default:
      break;
  }
  return reach;
}

void DrawHead(const AllanResult& result, double width, Svg* svg) {
  svg->Text(kLeft,
            24.0,
            "Allan deviation" + (result.serial.empty() ? "" : ", unit " + result.serial),
            "start head");
  // The end of a long path says which recording it is.
  constexpr std::size_t kMostSource = 80;
  const std::string source = result.source.size() <= kMostSource
                                 ? result.source
                                 : "…" + result.source.substr(result.source.size() - kMostSource);
  svg->Text(width - kRight, 24.0, source, "end");
  constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kLegend = {{
      {"N", "slope -1/2, read at 1 s"},
      {"B", "line at 0.664 B"},
      {"K", "slope +1/2, read at 3 s"},
      {"Q", "slope -1, read at √3 s"},
  }};
  constexpr double kStep = 207.0;
  const double y = 45.0;
  double x = kLeft;
  svg->Line(x, y - 4.0, x + 22.0, y - 4.0, "curve");
  svg->Text(x + 28.0, y, "deviation, 95 % band", "start");
  for (const auto& [symbol, meaning] : kLegend) {
    x += kStep;
    svg->Line(x, y - 4.0, x + 22.0, y - 4.0, "slope " + std::string(symbol));
    svg->Text(x + 28.0, y, symbol, "start bold fill" + std::string(symbol));
    svg->Text(x + 42.0, y, meaning, "start");
  }
}

}  // namespace

std::string AllanSvg(const AllanResult& result) {
  const double width = kLeft + 3.0 * kPanelWidth + 2.0 * kGap + kRight;
  const double row = kRowTop + kPanelHeight + kRowBottom;
  const double height = kHead + row * static_cast<double>(result.triads.size());
  Svg svg(width, height, "Allan deviation of " + result.source);
  DrawHead(result, width, &svg);
  double top = kHead + kRowTop;
  for (const AllanTriad& triad : result.triads) {
    const AllanScale scale = ShownScale(triad);
    const auto [tau, deviation] = RowBounds(triad, scale);
    for (std::size_t i = 0; i < 3; ++i) {
      const AllanAxis& axis = triad.axes[i];
      const double left = kLeft + static_cast<double>(i) * (kPanelWidth + kGap);
      LogPanel panel(svg, left, top, tau, deviation);
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
      svg.Text(left + kPanelWidth / 2.0, top + kPanelHeight + 33.0, "tau [s]", "middle");
    }
    svg.RotatedText(
        18.0, top + kPanelHeight / 2.0, -90.0, "Allan deviation [" + scale.unit + "]", "middle");
    top += row;
  }
  return svg.FinishAlone(kStyle);
}

}  // namespace truetriad
