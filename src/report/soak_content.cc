// SPDX-License-Identifier: Apache-2.0
#include "report/soak_content.h"

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "report/chart_frame.h"
#include "report/format.h"
#include "report/parameter_table.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/thermal.h"

namespace truetriad {
namespace {

// Points of a curve.
constexpr int kCurve = 80;

// What the temperature terms say of the bias of one axis at a settled temperature.
struct BiasAt {
  double value = 0.0;
  double sigma = 0.0;
};

class BiasCurve {
 public:
  BiasCurve(const Calibration& calibration, Triad triad, int axis)
      : sensor_(*calibration.sensors[triad]),
        propagation_(calibration.covariance),
        name_(TriadName(triad)),
        axis_(axis) {}

  BiasAt operator()(double degc) const {
    const ThermalTerms& thermal = *sensor_.thermal;
    const double tau = degc - thermal.reference_degc;
    const std::string axis(1, AxisLetter(axis_));
    std::vector<Propagation::Term> terms = {{name_ + ".bias." + axis, 1.0}};
    for (std::size_t i = 1; i <= thermal.bias.size(); ++i) {
      terms.emplace_back(name_ + ".thermal.bias." + std::to_string(i) + "." + axis,
                         std::pow(tau, static_cast<double>(i)));
    }
    return {ModelAtTemperature(sensor_.model, thermal, degc, 0.0).bias[axis_],
            propagation_.Sigma(terms).value_or(0.0)};
  }

 private:
  const TriadCalibration& sensor_;
  Propagation propagation_;
  std::string name_;
  int axis_ = 0;
};

std::vector<TemperatureSetting> SettingsOf(const Calibration& calibration, Triad triad) {
  std::vector<TemperatureSetting> settings;
  if (!calibration.sensors[triad] || !calibration.sensors[triad]->thermal) return settings;
  for (const TemperatureSetting& setting : calibration.quality.rests.temperature_settings) {
    if (setting.triad == triad) settings.push_back(setting);
  }
  return settings;
}

}  // namespace

Section SoakSection(const Calibration& calibration) {
  Section section{SectionKind::kSoak, "Over temperature", {}};
  for (const Triad triad : kTriads) {
    const std::vector<TemperatureSetting> settings = SettingsOf(calibration, triad);
    if (settings.empty()) continue;
    const std::string unit = DisplayUnit(calibration.sensors[triad]->input_unit);
    if (section.blocks.empty()) {
      section.blocks.emplace_back(std::string(
          "Bias from the poses at each temperature alone, all else fixed, minus the bias from the "
          "thermal terms: differences well beyond their σ call for a higher order. Before and "
          "after: RMS of |C(y - b)| - reference (for a gyroscope at rest, of its rate) with the "
          "calibration at the reference temperature and at each pose's own."));
    }
    Table table{{TriadTitle(triad),
                 "poses",
                 "x, " + unit,
                 "y, " + unit,
                 "z, " + unit,
                 "before, " + TruthUnit(triad),
                 "after"},
                "lrrrrrr",
                {}};
    for (const TemperatureSetting& setting : settings) {
      std::vector<std::string> row = {Fixed(setting.degc, 1) + " °C",
                                      std::to_string(setting.poses)};
      for (int axis = 0; axis < 3; ++axis) {
        row.push_back(WithSigma(setting.beyond_terms_raw[axis], setting.bias_sigma_raw[axis]));
      }
      row.push_back(Significant(setting.rms_before, 3));
      row.push_back(Significant(setting.rms_after, 3));
      table.rows.push_back(std::move(row));
    }
    section.blocks.emplace_back(std::move(table));
  }
  return section;
}

std::string SoakChart(const Calibration& calibration, Triad triad, int axis) {
  const std::vector<TemperatureSetting> settings = SettingsOf(calibration, triad);
  if (settings.size() < 2) return "";
  const BiasCurve curve(calibration, triad, axis);
  const std::string unit = DisplayUnit(calibration.sensors[triad]->input_unit);
  const std::string name = TriadTitle(triad) + " " + AxisLetter(axis);
  const Eigen::Vector2d& span = calibration.sensors[triad]->thermal->range_degc;
  std::vector<std::pair<double, BiasAt>> fit;
  Range degc, bias, rest;
  for (int i = 0; i <= kCurve; ++i) {
    const double at = span[0] + (span[1] - span[0]) * i / kCurve;
    fit.emplace_back(at, curve(at));
    degc.Add(at);
    bias.Add(fit.back().second.value + 2.0 * fit.back().second.sigma);
    bias.Add(fit.back().second.value - 2.0 * fit.back().second.sigma);
    rest.Add(2.0 * fit.back().second.sigma), rest.Add(-2.0 * fit.back().second.sigma);
  }
  for (const TemperatureSetting& setting : settings) {
    const double own = setting.bias_raw[axis], sigma = setting.bias_sigma_raw[axis];
    const double difference = setting.beyond_terms_raw[axis];
    degc.Add(setting.degc), bias.Add(own);
    rest.Add(difference + 2.0 * sigma), rest.Add(difference - 2.0 * sigma);
  }
  Svg svg(760.0, 260.0, name + ": bias over temperature");
  Frame left(svg, {}, degc, bias);
  left.Draw(name + ", bias, " + unit, "°C");
  Frame right(svg, {446.0}, degc, rest);
  right.Draw("residual", "°C");
  // A band of ±2σ about `centre` of each point of the fit, and the line.
  const auto draw_fit = [&](const Frame& frame, const auto& centre) {
    std::vector<std::pair<double, double>> line, outline;
    for (const auto& [at, value] : fit) {
      line.emplace_back(frame.X(at), frame.Y(centre(value)));
      outline.emplace_back(frame.X(at), frame.Y(centre(value) + 2.0 * value.sigma));
    }
    for (auto point = fit.rbegin(); point != fit.rend(); ++point) {
      outline.emplace_back(frame.X(point->first),
                           frame.Y(centre(point->second) - 2.0 * point->second.sigma));
    }
    svg.Polyline(outline, "band");
    svg.Polyline(line, "fit");
  };
  draw_fit(left, [](const BiasAt& value) { return value.value; });
  draw_fit(right, [](const BiasAt&) { return 0.0; });
  for (const TemperatureSetting& setting : settings) {
    const double own = setting.bias_raw[axis], sigma = setting.bias_sigma_raw[axis];
    const double difference = setting.beyond_terms_raw[axis];
    svg.Circle(left.X(setting.degc), left.Y(own), 2.5, "dot");
    svg.Line(right.X(setting.degc),
             right.Y(difference - 2.0 * sigma),
             right.X(setting.degc),
             right.Y(difference + 2.0 * sigma),
             "bar");
    svg.Circle(right.X(setting.degc), right.Y(difference), 2.5, "dot");
  }
  return svg.Finish();
}

}  // namespace truetriad
