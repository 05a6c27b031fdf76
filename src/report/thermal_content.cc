// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "report/charts.h"
#include "report/content.h"
#include "report/table.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

/// A table of data has a row for each eighth of the temperature range. A table of the model, which
/// is smooth, has rows at the ends of each quarter of the range (4 + 1).
constexpr int kTemperatureRows = 8, kSurfaceRows = 5;

std::string AxisTitle(const SweepAxis& axis) {
  return TriadTitle(axis.triad) + " " + AxisLetter(axis.axis);
}

std::string LagText(double lag_s, double sigma_s) {
  return lag_s > 0.0 ? WithSigma(lag_s, sigma_s) : "–";
}

Table ErrorTable(const Calibration& calibration) {
  Table table = Headed(
      "error; noise; no terms; after; held out; held out, cubic; heating - cooling; after; unit",
      "lrrrrrrrl");
  for (const SweepAxis& axis : calibration.quality.sweep.axes) {
    table.Add() << AxisTitle(axis) << Significant(axis.noise_sigma, 3)
                << Significant(axis.rms_before, 3) << Significant(axis.rms_after, 3)
                << Significant(axis.held_out, 3) << Significant(axis.held_out_cubic, 3)
                << Significant(axis.branch_gap, 2) << Significant(axis.branch_gap_after, 2)
                << DisplayUnit(calibration.sensors[axis.triad]->input_unit);
  }
  return table;
}

Table TermsTable(const Quality& quality) {
  Table table = Headed("terms; chosen; lag of T, s; lag of T', s", "llrr");
  for (const SweepAxis& axis : quality.sweep.axes) {
    table.Add() << AxisTitle(axis) << axis.chosen
                << LagText(axis.element_lag_s, axis.element_lag_sigma_s)
                << LagText(axis.rate_lag_s, axis.rate_lag_sigma_s);
  }
  return table;
}

Table StepsTable(const SweepAxis& axis) {
  Table table = Headed("step; terms; R²; adjusted R²; BIC; held out", "llrrrr");
  for (const SweepStep& step : axis.steps) {
    table.Add() << step.what << step.terms << Fixed(step.r2, 5) << Fixed(step.adjusted_r2, 5)
                << Fixed(step.bic, 1) << Significant(step.held_out, 3);
  }
  return table;
}

Table RegressionSteps(const SweepRegression& regression) {
  Table table = Headed("step; terms; F; p; R²; adjusted R²; BIC; held out", "lrrrrrrr");
  for (const RegressionStep& step : regression.steps) {
    const bool is_start = std::isnan(step.f);
    table.Add() << step.what << step.terms << (is_start ? "–" : Significant(step.f, 3))
                << (is_start ? "–" : Probability(step.p_value)) << Fixed(step.r2, 5)
                << Fixed(step.adjusted_r2, 5) << Fixed(step.bic, 1)
                << Significant(step.held_out, 3);
  }
  return table;
}

Table RegressionTerms(const SweepRegression& regression) {
  Table table = Headed("term; ; value; unit; F; p", "llrlrr");
  for (const RegressionTerm& term : regression.terms) {
    if (!term.why.empty()) continue;
    table.Add() << term.name << (term.chosen ? "chosen" : "rejected")
                << (term.chosen ? WithSigma(term.coefficient, term.sigma) : "–")
                << (term.chosen ? term.unit : "") << Significant(term.f, 3)
                << Probability(term.p_value);
  }
  return table;
}

// Adds the terms that were not tested, grouped by reason.
void AddUntested(const SweepRegression& regression, Section* section) {
  std::vector<std::pair<std::string, std::string>> said;  // The reason and the terms.
  for (const RegressionTerm& term : regression.terms) {
    if (term.why.empty()) continue;
    const auto same = std::find_if(
        said.begin(), said.end(), [&](const auto& entry) { return entry.first == term.why; });
    if (same == said.end()) {
      said.emplace_back(term.why, term.name);
    } else {
      same->second += ", " + term.name;
    }
  }
  for (const auto& [why, names] : said) section->Add(Bullet{names + ": " + why});
}

void AddRegression(const SweepAxis& axis, Section* section) {
  const SweepRegression& regression = *axis.regression;
  section->Add(Subtitle{"Second-order regression: " + AxisTitle(axis)});
  section->Add(
      std::to_string(regression.windows) + " windows have values of all factors; RMS residual " +
      Significant(regression.rms, 3) +
      ". r: reading in the attitude; tau: temperature minus reference temperature; T': its rate; "
      "A, A': the same for the ambient temperature. A term enters below p = " +
      Significant(regression.enter_p, 2) + " and leaves above " +
      Significant(regression.leave_p, 2) + ". The regression is reported, not applied.");
  section->Add(RegressionSteps(regression));
  section->Add(RegressionTerms(regression));
  AddUntested(regression, section);
}

// Mean bias of the windows of one branch, heating or cooling.
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
  Table table = Headed("T, °C", "r");
  for (const char axis : kAxisLetters) {
    for (const char* what : {" heating", " cooling", " fit"}) {
      table.header.push_back(std::string(1, axis) + what);
      table.alignment += 'r';
    }
  }
  const Eigen::Vector2d range = calibration.sensors[triad]->thermal->range_degc;
  const double step = (range[1] - range[0]) / kTemperatureRows;
  std::array<std::vector<const SweepWindow*>, kTemperatureRows> rows;
  for (const SweepWindow& window : calibration.quality.sweep.windows) {
    const int at =
        std::clamp(static_cast<int>((window.degc - range[0]) / step), 0, kTemperatureRows - 1);
    if (window.triad == triad) rows[static_cast<std::size_t>(at)].push_back(&window);
  }
  for (std::size_t at = 0; at < rows.size(); ++at) {
    if (rows[at].empty()) continue;
    TableRow row = table.Add();
    row << Fixed(range[0] + (static_cast<double>(at) + 0.5) * step, 1);
    for (int axis = 0; axis < 3; ++axis) {
      double fit = 0.0, variance = 0.0;
      for (const SweepWindow* window : rows[at]) {
        fit += window->fit_raw[axis];
        variance += std::pow(window->fit_sigma_raw[axis], 2);
      }
      const auto count = static_cast<double>(rows[at].size());
      row << MeanText(rows[at], axis, true) << MeanText(rows[at], axis, false)
          << WithSigma(fit / count, std::sqrt(variance / count));
    }
  }
  return table;
}

// The upper quartile of the sweep's temperature rates, rounded to one digit.
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

// Whether the sweep has a window near `degc` whose rate has the sign of `rate` and more than half
// its size.
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

// A table of the bias by temperature and rate. It leaves out axes whose bias also depends on past
// temperatures.
Table SurfaceTable(const Calibration& calibration, Triad triad) {
  const TriadCalibration& sensor = *calibration.sensors[triad];
  const ThermalTerms& thermal = *sensor.thermal;
  const double rate = ShownRate(calibration.quality, triad);
  const std::array<double, 3> rates = {-rate, 0.0, rate};
  Table table = Headed("bias at T, °C", "r");
  std::vector<int> axes;
  for (int axis = 0; axis < 3; ++axis) {
    if (FollowsThePast(calibration, triad, axis)) continue;
    axes.push_back(axis);
    for (const double shown : rates) {
      table.header.push_back(std::string(1, AxisLetter(axis)) + ", " + Significant(shown, 2) +
                             " °C/s");
      table.alignment += 'r';
    }
  }
  for (int at = 0; at < (axes.empty() ? 0 : kSurfaceRows); ++at) {
    const double degc = thermal.range_degc[0] +
                        (thermal.range_degc[1] - thermal.range_degc[0]) * at / (kSurfaceRows - 1.0);
    TableRow row = table.Add();
    row << Fixed(degc, 1);
    for (const int axis : axes) {
      for (const double shown : rates) {
        const double bias = ModelAtTemperature(sensor.model, thermal, degc, shown).bias[axis];
        const bool was_reached = WasReached(calibration, triad, degc, shown);
        row << (was_reached ? Significant(bias, 4) : "–");
      }
    }
  }
  return table;
}

/// Adds the tables of one sensor over temperature and its rate.
void AddOverTemperature(const Calibration& calibration, Triad triad, Section* section) {
  const std::string title = TriadTitle(triad);
  const std::string unit = ", " + DisplayUnit(calibration.sensors[triad]->input_unit);
  section->Add(Subtitle{title + ": bias and fit" + unit});
  section->Add(DataTable(calibration, triad));
  section->Add(Subtitle{title + ": bias by temperature and its rate" + unit});
  section->Add(SurfaceTable(calibration, triad));
  for (int axis = 0; axis < 3; ++axis) {
    if (!FollowsThePast(calibration, triad, axis)) continue;
    section->Add(
        title + " " + AxisLetter(axis) +
        ": the lag is long, so the bias depends on past temperatures; no table or map over the "
        "present temperature can show it.");
  }
}

}  // namespace

Section SweepSection(const Calibration& calibration) {
  const Quality& quality = calibration.quality;
  const std::vector<SweepAxis>& axes = quality.sweep.axes;
  Section section{"Temperature sweep", {}};
  if (axes.empty() || !calibration.IsUsable()) return section;
  section.Add(std::to_string(quality.poses) + " windows of time. Held out: error of each of " +
              std::to_string(axes.front().folds) +
              " blocks of time, predicted from the other blocks with lags estimated anew; held "
              "out, cubic: the same error of a plain cubic in temperature. Heating - cooling: the "
              "mean difference of the residuals at equal temperature, first with a polynomial in "
              "temperature alone, then with the terms below.");
  section.Add(ErrorTable(calibration));
  section.Add(TermsTable(quality));
  for (const SweepAxis& axis : axes) {
    for (const std::string& words : axis.left_out) {
      section.Add(Bullet{AxisTitle(axis) + ": dropped " + words});
    }
  }
  for (const Triad triad : kTriads) {
    const auto& sensor = calibration.sensors[triad];
    if (sensor && sensor->thermal) AddOverTemperature(calibration, triad, &section);
  }
  for (const SweepAxis& axis : axes) {
    if (axis.steps.empty()) continue;
    section.Add(Subtitle{"Choice of terms: " + AxisTitle(axis)});
    section.Add(StepsTable(axis));
  }
  for (const SweepAxis& axis : axes) {
    if (axis.regression) AddRegression(axis, &section);
  }
  section.draw = [&calibration, &axes] {
    std::vector<Drawing> drawings;
    for (const SweepAxis& axis : axes) {
      drawings.push_back(SweepFitDrawing(calibration, axis.triad, axis.axis));
      drawings.push_back(SweepSurfaceDrawing(calibration, axis.triad, axis.axis));
    }
    return drawings;
  };
  return section;
}

Section SoakSection(const Calibration& calibration) {
  Section section{"Over temperature", {}};
  for (const Triad triad : kTriads) {
    const std::vector<TemperatureSetting> settings = SettingsOf(calibration, triad);
    if (settings.empty()) continue;
    if (section.blocks.empty()) {
      section.Add(
          "Bias from the poses at each temperature alone, all else fixed, minus the bias from the "
          "thermal terms. If differences are well beyond their σ, choose a higher order. Before: "
          "RMS of (|C(y - b)| - reference) (for a gyroscope at rest, of its rate) with the "
          "calibration at the reference temperature; after: with the calibration at each pose's "
          "temperature.");
    }
    Table table = Headed(TriadTitle(triad) + "; poses", "lrrrrrr");
    for (const char axis : kAxisLetters) {
      table.header.push_back(std::string(1, axis) + ", " +
                             DisplayUnit(calibration.sensors[triad]->input_unit));
    }
    table.header.insert(table.header.end(), {"before, " + TruthUnit(triad), "after"});
    for (const TemperatureSetting& setting : settings) {
      table.Add() << Fixed(setting.degc, 1) + " °C" << setting.poses
                  << WithSigma(setting.beyond_terms_raw, setting.bias_sigma_raw)
                  << Significant(setting.rms_before, 3) << Significant(setting.rms_after, 3);
    }
    section.Add(std::move(table));
  }
  section.draw = [&calibration] {
    std::vector<Drawing> drawings;
    for (const Triad triad : kTriads) {
      for (int axis = 0; axis < 3; ++axis) {
        drawings.push_back(SoakDrawing(calibration, triad, axis));
      }
    }
    return drawings;
  };
  return section;
}

}  // namespace truetriad
