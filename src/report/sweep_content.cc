// SPDX-License-Identifier: Apache-2.0
#include "report/sweep_content.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "report/format.h"
#include "report/sweep_charts.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/thermal.h"

namespace truetriad {
namespace {

constexpr int kTemperatureRows = 8;
constexpr int kSurfaceRows = 5;

std::string AxisTitle(const SweepAxis& axis) {
  return TriadTitle(axis.triad) + " " + AxisLetter(axis.axis);
}

std::string LagText(double lag_s, double sigma_s) {
  return lag_s > 0.0 ? WithSigma(lag_s, sigma_s) : "–";
}

Table ErrorTable(const Calibration& calibration) {
  Table table{{"error",
               "noise",
               "no terms",
               "after",
               "held out",
               "held out, cubic",
               "heating - cooling",
               "after",
               "unit"},
              "lrrrrrrrl",
              {}};
  for (const SweepAxis& axis : calibration.quality.sweep.axes) {
    table.rows.push_back({AxisTitle(axis),
                          Significant(axis.noise_sigma, 3),
                          Significant(axis.rms_before, 3),
                          Significant(axis.rms_after, 3),
                          Significant(axis.held_out, 3),
                          Significant(axis.held_out_cubic, 3),
                          Significant(axis.branch_gap, 2),
                          Significant(axis.branch_gap_after, 2),
                          DisplayUnit(calibration.sensors[axis.triad]->input_unit)});
  }
  return table;
}

Table TermsTable(const Quality& quality) {
  Table table{{"terms", "chosen", "lag of T, s", "lag of T', s"}, "llrr", {}};
  for (const SweepAxis& axis : quality.sweep.axes) {
    table.rows.push_back({AxisTitle(axis),
                          axis.chosen,
                          LagText(axis.element_lag_s, axis.element_lag_sigma_s),
                          LagText(axis.rate_lag_s, axis.rate_lag_sigma_s)});
  }
  return table;
}

Table StepsTable(const SweepAxis& axis) {
  Table table{{"step", "terms", "R²", "adjusted R²", "BIC", "held out"}, "llrrrr", {}};
  for (const SweepStep& step : axis.steps) {
    table.rows.push_back({step.what,
                          step.terms,
                          Fixed(step.r2, 5),
                          Fixed(step.adjusted_r2, 5),
                          Fixed(step.bic, 1),
                          Significant(step.held_out, 3)});
  }
  return table;
}

// A small probability as people write it.

Table RegressionSteps(const SweepRegression& regression) {
  Table table{{"step", "terms", "F", "p", "R²", "adjusted R²", "BIC", "held out"}, "lrrrrrrr", {}};
  for (const RegressionStep& step : regression.steps) {
    const bool is_start = std::isnan(step.f);
    table.rows.push_back({step.what,
                          std::to_string(step.terms),
                          is_start ? "–" : Significant(step.f, 3),
                          is_start ? "–" : Probability(step.p_value),
                          Fixed(step.r2, 5),
                          Fixed(step.adjusted_r2, 5),
                          Fixed(step.bic, 1),
                          Significant(step.held_out, 3)});
  }
  return table;
}

Table RegressionTerms(const SweepRegression& regression) {
  Table table{{"term", "", "value", "unit", "F", "p"}, "llrlrr", {}};
  for (const RegressionTerm& term : regression.terms) {
    if (!term.why.empty()) continue;
    table.rows.push_back({term.name,
                          term.chosen ? "chosen" : "rejected",
                          term.chosen ? WithSigma(term.coefficient, term.sigma) : "–",
                          term.chosen ? term.unit : "",
                          Significant(term.f, 3),
                          Probability(term.p_value)});
  }
  return table;
}

// Terms that were not tested, those of one reason together.
void AddUntested(const SweepRegression& regression, Section* section) {
  std::vector<std::pair<std::string, std::string>> said;
  for (const RegressionTerm& term : regression.terms) {
    if (term.why.empty()) continue;
    const auto same = std::find_if(
        said.begin(), said.end(), [&](const auto& entry) { return entry.second == term.why; });
    if (same == said.end()) {
      said.emplace_back(term.name, term.why);
    } else {
      same->first += ", " + term.name;
    }
  }
  for (const auto& [names, why] : said) {
    section->blocks.emplace_back(Bullet{names + ": " + why});
  }
}

void AddRegression(const SweepAxis& axis, Section* section) {
  const SweepRegression& regression = *axis.regression;
  section->blocks.emplace_back(Subtitle{"Second-order regression: " + AxisTitle(axis)});
  section->blocks.emplace_back(
      std::to_string(regression.windows) + " windows have all factors; RMS residual " +
      Significant(regression.rms, 3) +
      ". r: reading in the attitude; tau: temperature minus reference temperature; T': its rate; "
      "A, A': the same for the ambient temperature. A term enters below p = " +
      Significant(regression.enter_p, 2) + " and leaves above " +
      Significant(regression.leave_p, 2) + ". The regression is reported, not applied.");
  section->blocks.emplace_back(RegressionSteps(regression));
  section->blocks.emplace_back(RegressionTerms(regression));
  AddUntested(regression, section);
}

// Means over a share of the temperatures, of one branch.
std::string MeanText(const std::vector<const SweepWindow*>& windows, int axis, bool heating) {
  double sum = 0.0;
  int count = 0;
  for (const SweepWindow* window : windows) {
    if ((window->rate_degcps > 0.0) != heating) continue;
    sum += window->bias_raw[axis], ++count;
  }
  return count > 0 ? Significant(sum / count, 4) : "–";
}

Table DataTable(const Calibration& calibration, Triad triad) {
  Table table{{"T, °C"}, "r", {}};
  for (const char axis : kAxisLetters) {
    for (const char* what : {" heating", " cooling", " fit"}) {
      table.header.push_back(std::string(1, axis) + what);
      table.alignment += 'r';
    }
  }
  const Eigen::Vector2d range = calibration.sensors[triad]->thermal->range_degc;
  const double step = (range[1] - range[0]) / kTemperatureRows;
  for (int row = 0; row < kTemperatureRows; ++row) {
    std::vector<const SweepWindow*> inside;
    for (const SweepWindow& window : calibration.quality.sweep.windows) {
      const int at =
          std::clamp(static_cast<int>((window.degc - range[0]) / step), 0, kTemperatureRows - 1);
      if (window.triad == triad && at == row) inside.push_back(&window);
    }
    if (inside.empty()) continue;
    std::vector<std::string> cells = {Fixed(range[0] + (row + 0.5) * step, 1)};
    for (int axis = 0; axis < 3; ++axis) {
      double fit = 0.0, variance = 0.0;
      for (const SweepWindow* window : inside) {
        fit += window->fit_raw[axis];
        variance += std::pow(window->fit_sigma_raw[axis], 2);
      }
      const auto count = static_cast<double>(inside.size());
      cells.push_back(MeanText(inside, axis, true));
      cells.push_back(MeanText(inside, axis, false));
      cells.push_back(WithSigma(fit / count, std::sqrt(variance / count)));
    }
    table.rows.push_back(std::move(cells));
  }
  return table;
}

// A round rate that the sweep reached both up and down, or nearly.
double ShownRate(const Quality& quality, Triad triad) {
  std::vector<double> rates;
  for (const SweepWindow& window : quality.sweep.windows) {
    if (window.triad == triad) rates.push_back(std::abs(window.rate_degcps));
  }
  if (rates.empty()) return 0.0;
  const auto place = rates.begin() + static_cast<std::ptrdiff_t>(rates.size() * 3 / 4);
  std::nth_element(rates.begin(), place, rates.end());
  const double power = std::pow(10.0, std::floor(std::log10(std::max(*place, 1e-9))));
  return std::round(*place / power) * power;
}

// Whether the sweep passed the temperature while it changed about so.
bool WasReached(const Calibration& calibration, Triad triad, double degc, double rate) {
  if (rate == 0.0) return true;
  const Eigen::Vector2d range = calibration.sensors[triad]->thermal->range_degc;
  const double near = (range[1] - range[0]) / 10.0;
  const auto& windows = calibration.quality.sweep.windows;
  return std::any_of(windows.begin(), windows.end(), [&](const SweepWindow& window) {
    return window.triad == triad && std::abs(window.degc - degc) < near &&
           window.rate_degcps / rate > 0.5;
  });
}

// `follows_past`: axes that are left out.
Table SurfaceTable(const Calibration& calibration,
                   Triad triad,
                   const std::array<bool, 3>& follows_past) {
  const TriadCalibration& sensor = *calibration.sensors[triad];
  const ThermalTerms& thermal = *sensor.thermal;
  const double rate = ShownRate(calibration.quality, triad);
  const std::array<double, 3> rates = {-rate, 0.0, rate};
  Table table{{"bias at T, °C"}, "r", {}};
  for (int axis = 0; axis < 3; ++axis) {
    if (follows_past[static_cast<std::size_t>(axis)]) continue;
    for (const double shown : rates) {
      table.header.push_back(std::string(1, AxisLetter(axis)) + ", " + Significant(shown, 2) +
                             " °C/s");
      table.alignment += 'r';
    }
  }
  for (int row = 0; row < kSurfaceRows; ++row) {
    const double degc = thermal.range_degc[0] + (thermal.range_degc[1] - thermal.range_degc[0]) *
                                                    row / (kSurfaceRows - 1.0);
    std::vector<std::string> cells = {Fixed(degc, 1)};
    for (int axis = 0; axis < 3; ++axis) {
      if (follows_past[static_cast<std::size_t>(axis)]) continue;
      for (const double shown : rates) {
        const double bias = ModelAtTemperature(sensor.model, thermal, degc, shown).bias[axis];
        const bool was_reached = WasReached(calibration, triad, degc, shown);
        cells.push_back(was_reached ? Significant(bias, 4) : "–");
      }
    }
    table.rows.push_back(std::move(cells));
  }
  return table;
}

}  // namespace

Section SweepSection(const Calibration& calibration) {
  const Quality& quality = calibration.quality;
  Section section{SectionKind::kSweep, "Temperature sweep", {}};
  if (quality.sweep.axes.empty() || !calibration.IsUsable()) return section;
  section.blocks.emplace_back(
      std::to_string(quality.poses) + " windows of time. Held out: each of " +
      std::to_string(quality.sweep.axes.front().folds) +
      " blocks of time predicted from the others, with lags estimated each time; for comparison, a "
      "plain cubic in temperature. Heating minus cooling: the difference between the two that "
      "remains with a polynomial in temperature alone, and with the terms below.");
  section.blocks.emplace_back(ErrorTable(calibration));
  section.blocks.emplace_back(TermsTable(quality));
  for (const SweepAxis& axis : quality.sweep.axes) {
    for (const std::string& words : axis.left_out) {
      section.blocks.emplace_back(Bullet{AxisTitle(axis) + ": dropped " + words});
    }
  }
  for (const Triad triad : kTriads) {
    const auto& sensor = calibration.sensors[triad];
    if (!sensor || !sensor->thermal) continue;
    const std::string unit = ", " + DisplayUnit(sensor->input_unit);
    section.blocks.emplace_back(Subtitle{TriadTitle(triad) + ": bias and fit" + unit});
    section.blocks.emplace_back(DataTable(calibration, triad));
    section.blocks.emplace_back(
        Subtitle{TriadTitle(triad) + ": bias by temperature and its rate" + unit});
    std::array<bool, 3> follows_past;
    for (int axis = 0; axis < 3; ++axis) {
      follows_past[static_cast<std::size_t>(axis)] = FollowsThePast(calibration, triad, axis);
    }
    if (!std::all_of(follows_past.begin(), follows_past.end(), std::identity())) {
      section.blocks.emplace_back(SurfaceTable(calibration, triad, follows_past));
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (!follows_past[static_cast<std::size_t>(axis)]) continue;
      section.blocks.emplace_back(TriadTitle(triad) + " " + AxisLetter(axis) +
                                  ": its lag is long, so the bias depends on past temperatures and "
                                  "no table or map over present ones can show it.");
    }
  }
  for (const SweepAxis& axis : quality.sweep.axes) {
    if (axis.steps.empty()) continue;
    section.blocks.emplace_back(Subtitle{"Choice of terms: " + AxisTitle(axis)});
    section.blocks.emplace_back(StepsTable(axis));
  }
  for (const SweepAxis& axis : quality.sweep.axes) {
    if (axis.regression) AddRegression(axis, &section);
  }
  return section;
}

}  // namespace truetriad
