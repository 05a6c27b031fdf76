// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "truetriad/allan/allan.h"
#include "truetriad/report/report.h"

namespace truetriad {

/// How text, page and plot name a coefficient and draw it.
struct AllanCoefficientKind {
  char symbol = 'N';
  std::string_view name;        ///< "noise density".
  std::string_view per;         ///< What follows the unit of the readings: "/√Hz".
  double slope = 0.0;           ///< The slope of its line in the plot.
  double read_at_s = 0.0;       ///< The tau at which its line is read; unused for B.
  std::string_view line;        ///< "slope -1/2, read at 1 s".
  std::string_view why_hidden;  ///< A note for axes that do not show the coefficient.
};
extern const std::array<AllanCoefficientKind, 4> kAllanCoefficientKinds;  ///< N, B, K, Q.

/// Unit in text and plot: that of the recording or, for counts of known size, the usual true unit.
struct AllanScale {
  double shown_per_raw = 1.0;
  std::string unit;  ///< "deg/s", "m/s²", "µT", "counts".
};
AllanScale ShownScale(const AllanTriad& triad);

/// A coefficient of one axis in shown units.
struct AllanCoefficient : AllanCoefficientKind {
  Interval value;
  std::string unit;          ///< "deg/s/√Hz".
  bool upper_bound = false;  ///< The value is a bound, printed as "≤ 0.1".
  double mark_tau_s = 1.0;   ///< The tau at which its line is marked.
  double mark = 0.0;         ///< Deviation of the line at that tau.
};
/// The coefficients that the data show, in the order N, B, K, Q.
std::vector<AllanCoefficient> Coefficients(const AllanAxis& axis, const AllanScale& scale);

/// Value and interval with four significant digits.
std::string ValueText(const AllanCoefficient& coefficient);
std::string IntervalText(const AllanCoefficient& coefficient);

/// The report of `allan`: first the triads that were not at rest, which have no coefficients; then,
/// for each of the other triads, a table of the coefficients with 95 % intervals and units, then
/// the warnings. Counts are shown in true units when the recording states their scale. The page has
/// the curves.
VerbReport ReportOf(const AllanResult& result);

/// The curves as a figure for other pages.
Drawing AllanDrawing(const AllanResult& result);

/// One self-contained SVG with a log-log panel for each axis: the deviation, its 95 % band and the
/// line of each coefficient. If the triad was not at rest, the panel shows only the curve, marked
/// as such. The numbers are those of ReportOf. Same input, same bytes.
std::string AllanSvg(const AllanResult& result);

}  // namespace truetriad
