// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "fleet/line_summary.h"
#include "fleet/rows.h"

namespace truetriad::fleet {
namespace {

/// A column and what a quantity has in it; NaN and infinite: nothing.
struct NumberColumn {
  std::string_view name;
  double (*of)(const QuantitySummary& quantity);
};

using Quantity = const QuantitySummary&;

constexpr std::array<NumberColumn, 36> kNumberColumns = {{
    {"units", [](Quantity q) { return static_cast<double>(q.capability.units); }},
    {"mean", [](Quantity q) { return q.capability.mean; }},
    {"lowest", [](Quantity q) { return q.capability.lowest; }},
    {"highest", [](Quantity q) { return q.capability.highest; }},
    {"sigma_within", [](Quantity q) { return q.capability.observed.within.sigma.value; }},
    {"sigma_overall", [](Quantity q) { return q.capability.observed.overall.sigma.value; }},
    {"sigma_calibration", [](Quantity q) { return q.capability.calibration_sigma; }},
    {"process_sigma_within", [](Quantity q) { return q.capability.process.within.sigma.value; }},
    {"process_sigma_overall", [](Quantity q) { return q.capability.process.overall.sigma.value; }},
    {"normality_p", [](Quantity q) { return q.capability.normality_p; }},
    {"lower", [](Quantity q) { return q.lower; }},
    {"target", [](Quantity q) { return q.target; }},
    {"upper", [](Quantity q) { return q.upper; }},
    {"missed", [](Quantity q) { return q.has_limits ? q.missed : line::kNotKnown; }},
    {"expected_outside", [](Quantity q) { return q.capability.observed.overall.expected_outside; }},
    {"cp", [](Quantity q) { return q.capability.observed.within.cp.value; }},
    {"cp_lower", [](Quantity q) { return q.capability.observed.within.cp.interval.lower; }},
    {"cp_upper", [](Quantity q) { return q.capability.observed.within.cp.interval.upper; }},
    {"cpk", [](Quantity q) { return q.capability.observed.within.cpk.value; }},
    {"cpk_lower", [](Quantity q) { return q.capability.observed.within.cpk.interval.lower; }},
    {"cpk_upper", [](Quantity q) { return q.capability.observed.within.cpk.interval.upper; }},
    {"pp", [](Quantity q) { return q.capability.observed.overall.cp.value; }},
    {"pp_lower", [](Quantity q) { return q.capability.observed.overall.cp.interval.lower; }},
    {"pp_upper", [](Quantity q) { return q.capability.observed.overall.cp.interval.upper; }},
    {"ppk", [](Quantity q) { return q.capability.observed.overall.cpk.value; }},
    {"ppk_lower", [](Quantity q) { return q.capability.observed.overall.cpk.interval.lower; }},
    {"ppk_upper", [](Quantity q) { return q.capability.observed.overall.cpk.interval.upper; }},
    {"process_cpk", [](Quantity q) { return q.capability.process.within.cpk.value; }},
    {"process_cpk_lower",
     [](Quantity q) { return q.capability.process.within.cpk.interval.lower; }},
    {"process_cpk_upper",
     [](Quantity q) { return q.capability.process.within.cpk.interval.upper; }},
    {"process_pp", [](Quantity q) { return q.capability.process.overall.cp.value; }},
    {"process_pp_lower", [](Quantity q) { return q.capability.process.overall.cp.interval.lower; }},
    {"process_pp_upper", [](Quantity q) { return q.capability.process.overall.cp.interval.upper; }},
    {"process_ppk", [](Quantity q) { return q.capability.process.overall.cpk.value; }},
    {"process_ppk_lower",
     [](Quantity q) { return q.capability.process.overall.cpk.interval.lower; }},
    {"process_ppk_upper",
     [](Quantity q) { return q.capability.process.overall.cpk.interval.upper; }},
}};

}  // namespace

std::string SummaryCsv(const LineSummary& summary) {
  // Names are this program's own, without commas and quotes.
  std::string text = "name,kind,unit";
  for (const NumberColumn& column : kNumberColumns) text.append(",").append(column.name);
  text += '\n';
  for (const auto& [kind, quantities] :
       {std::pair("limit", &summary.limits), {"parameter", &summary.parameters}}) {
    for (const QuantitySummary& quantity : *quantities) {
      text.append(quantity.name).append(",").append(kind).append(",").append(quantity.unit);
      for (const NumberColumn& column : kNumberColumns) {
        const double number = column.of(quantity);
        text.append(",").append(std::isfinite(number) ? ShortestText(number) : "");
      }
      text += '\n';
    }
  }
  return text;
}

}  // namespace truetriad::fleet
