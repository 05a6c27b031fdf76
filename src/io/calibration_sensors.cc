// SPDX-License-Identifier: Apache-2.0
#include "io/calibration_sensors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include "io/calibration_values.h"
#include "truetriad/model/mounting.h"

namespace truetriad {
namespace {

void WriteThermal(YamlText& out, const ThermalTerms& thermal) {
  out << "    thermal:\n      reference_degc: " << thermal.reference_degc
      << "\n      range_degc: " << thermal.range_degc << "\n      bias: ";
  WriteList(out, thermal.bias);
  out << "\n      sensitivity: ";
  WriteList(out, thermal.sensitivity);
  out << "\n      rate: {";
  std::string_view separator = " ";
  for (const RateTermInfo& info : kRateTerms) {
    const std::optional<Eigen::Vector3d>& value = thermal.rate[info.term];
    if (!value) continue;
    out << separator << info.name() << ": " << *value;
    separator = ", ";
  }
  out << " }\n";
  if (thermal.element_lag_s) out << "      element_lag_s: " << *thermal.element_lag_s << "\n";
  if (thermal.rate_lag_s) out << "      rate_lag_s: " << *thermal.rate_lag_s << "\n";
  if (thermal.smoothing_s > 0.0) out << "      smoothing_s: " << thermal.smoothing_s << "\n";
  if (thermal.rate_range_degcps) {
    out << "      rate_range_degcps: " << *thermal.rate_range_degcps << "\n";
  }
  if (!thermal.knots.empty()) out << "      knots:\n";
  for (const ThermalKnot& knot : thermal.knots) {
    out << "        - { axis: " << kAxisLetters.substr(static_cast<std::size_t>(knot.axis), 1)
        << ", degc: " << knot.degc << ", slope: " << knot.slope << ", curve: " << knot.curve
        << " }\n";
  }
}

/// Numbers that no calibration writes.
void CheckThermal(YamlReader& reader, const ThermalTerms& thermal) {
  bool finite = std::isfinite(thermal.reference_degc) && thermal.range_degc.allFinite();
  for (const Eigen::Vector3d& term : thermal.bias) finite = finite && term.allFinite();
  for (const Eigen::Matrix3d& term : thermal.sensitivity) finite = finite && term.allFinite();
  for (const std::optional<Eigen::Vector3d>& rate : thermal.rate) {
    finite = finite && (!rate || rate->allFinite());
  }
  for (const ThermalKnot& knot : thermal.knots) {
    finite = finite && std::isfinite(knot.degc) && std::isfinite(knot.slope) &&
             std::isfinite(knot.curve);
  }
  if (!finite) {
    reader.Fail("contains a number that is not finite");
  } else if (thermal.range_degc[0] > thermal.range_degc[1] ||
             std::min(thermal.range_degc[0], thermal.reference_degc) < kAbsoluteZeroDegc) {
    reader.Fail("expected `range_degc` as [lowest, highest] temperature, not below -273.15 degC");
  } else if (!(thermal.smoothing_s >= 0.0)) {
    reader.Fail("expected `smoothing_s` of at least zero");
  }
}

void ReadThermal(YamlReader reader, ThermalTerms* thermal) {
  ReadNumber(reader.RequireChild("reference_degc"), &thermal->reference_degc);
  ReadVector(reader.RequireChild("range_degc"), &thermal->range_degc);
  for (const YamlReader& item : reader.RequireChild("bias").Items()) {
    ReadVector(item, &thermal->bias.emplace_back());
  }
  for (const YamlReader& item : reader.RequireChild("sensitivity").Items()) {
    ReadMatrix3(item, &thermal->sensitivity.emplace_back());
  }
  if (YamlReader rate = reader.RequireChild("rate")) {
    for (const RateTermInfo& info : kRateTerms) {
      Eigen::Vector3d vector;
      if (ReadVector(rate.Child(info.name()), &vector)) thermal->rate[info.term] = vector;
    }
    rate.RejectUnknown();
  }
  for (const auto& [key, value] : {std::pair("element_lag_s", &thermal->element_lag_s),
                                   std::pair("rate_lag_s", &thermal->rate_lag_s)}) {
    YamlReader lag = reader.Child(key);
    Eigen::Vector3d lags;
    if (!ReadVector(lag, &lags)) continue;
    if (!lags.allFinite() || lags.minCoeff() < 0.0)
      lag.Fail("expected lags of at least zero seconds");
    *value = lags;
  }
  if (YamlReader smoothing = reader.Child("smoothing_s")) {
    ReadNumber(smoothing, &thermal->smoothing_s);
  }
  YamlReader rates = reader.Child("rate_range_degcps");
  if (Eigen::Vector2d range; ReadVector(rates, &range)) {
    if (!(range[0] <= range[1])) rates.Fail("expected [lowest, highest] rate");
    thermal->rate_range_degcps = range;
  }
  for (YamlReader& item : reader.Child("knots").Items()) {
    ThermalKnot& knot = thermal->knots.emplace_back();
    ReadAxis(item.RequireChild("axis"), &knot.axis);
    ReadNumber(item.RequireChild("degc"), &knot.degc);
    ReadNumber(item.RequireChild("slope"), &knot.slope);
    ReadNumber(item.RequireChild("curve"), &knot.curve);
    item.RejectUnknown();
  }
  CheckThermal(reader, *thermal);
  reader.RejectUnknown();
}

void RejectNegative(double least_sigma, YamlReader* reader) {
  if (least_sigma < 0.0) reader->Fail("contains a negative standard deviation");
}

void ReadSigma(YamlReader reader, Eigen::Vector3d* sigma) {
  if (ReadVector(reader, sigma)) RejectNegative(sigma->minCoeff(), &reader);
}

void ReadSigma(YamlReader reader, Eigen::Matrix3d* sigma) {
  if (ReadMatrix3(reader, sigma)) RejectNegative(sigma->minCoeff(), &reader);
}

void ReadNoise(YamlReader reader, TriadNoise* noise) {
  ReadSigma(reader.RequireChild("sigma"), &noise->sigma);
  ReadWord(reader.RequireChild("source"), NoiseSourceFromName, &noise->source);
  ReadNumber(reader.RequireChild("excess_sigma"), &noise->excess_sigma);
  noise->excess_dof = std::numeric_limits<double>::infinity();
  if (YamlReader dof = reader.Child("excess_dof")) ReadNumber(dof, &noise->excess_dof);
  if (YamlReader turns = reader.Child("turn_excess_sigma_rad")) {
    ReadNumber(turns, &noise->turn_excess_sigma_rad);
  }
  reader.RejectUnknown();
}

/// The correction is written for those who only apply it; if it does not match the sensitivity,
/// somebody changed one of the two and it is not known which to believe.
void CheckCorrection(YamlReader reader, const TriadModel<double>& model) {
  Eigen::Matrix3d correction;
  if (!ReadMatrix3(reader, &correction)) return;
  // The inverse of a matrix with condition number c reproduces the identity to c epsilon; 1e-6
  // allows c = 1e9, far beyond any sensor, and is far below any change made on purpose.
  constexpr double kTolerance = 1e-6;
  if (!model.sensitivity.allFinite() || !model.bias.allFinite()) {
    reader.Fail("belongs to a sensor with a bias or sensitivity that is not finite");
    return;
  }
  const Eigen::Matrix3d error = correction * model.sensitivity - Eigen::Matrix3d::Identity();
  if (!(error.cwiseAbs().maxCoeff() < kTolerance)) {
    reader.Fail("is not the inverse of `sensitivity`; correct the one that was changed");
  }
}

}  // namespace

void WriteSensor(YamlText& out, Triad triad, const TriadCalibration& sensor) {
  out << "  " << TriadName(triad) << ":\n"
      << "    input_unit: " << Quoted{sensor.input_unit} << "\n"
      << "    output_unit: " << Quoted{sensor.output_unit} << "\n"
      << "    bias: " << sensor.model.bias << "\n"
      << "    sensitivity: " << sensor.model.sensitivity << "\n"
      << "    correction: " << sensor.model.Correction() << "\n";
  if (!sensor.mounting.isIdentity(0.0)) {
    out << "    mounting: " << AxisMapName(sensor.mounting) << "\n";
  }
  out << "    scale: " << sensor.Scale() << "\n"
      << "    misalignment_rad: " << sensor.MisalignmentRad() << "\n";
  for (const AxisTermInfo& info : kAxisTerms) {
    if (!sensor.axis_term_sigma[info.term]) continue;
    out << "    " << info.name << ": " << sensor.model.axis_terms[info.term] << "\n";
  }
  out << "    sigma:\n"
      << "      bias: " << sensor.bias_sigma << "\n"
      << "      sensitivity: " << sensor.sensitivity_sigma << "\n";
  for (const AxisTermInfo& info : kAxisTerms) {
    if (const auto& sigma = sensor.axis_term_sigma[info.term]) {
      out << "      " << info.name << ": " << *sigma << "\n";
    }
  }
  if (sensor.g_sensitivity) out << "    g_sensitivity: " << *sensor.g_sensitivity << "\n";
  if (sensor.thermal) WriteThermal(out, *sensor.thermal);
  if (sensor.si_per_count) out << "    si_per_count: " << *sensor.si_per_count << "\n";
  out << "    noise: { sigma: " << sensor.noise.sigma
      << ", source: " << NoiseSourceName(sensor.noise.source)
      << ", excess_sigma: " << sensor.noise.excess_sigma;
  // Not estimated: there are none.
  if (std::isfinite(sensor.noise.excess_dof)) out << ", excess_dof: " << sensor.noise.excess_dof;
  if (sensor.noise.turn_excess_sigma_rad > 0.0) {
    out << ", turn_excess_sigma_rad: " << sensor.noise.turn_excess_sigma_rad;
  }
  out << " }\n";
}

void ReadSensor(YamlReader reader, TriadCalibration* sensor) {
  reader.Require("input_unit", &sensor->input_unit);
  reader.Require("output_unit", &sensor->output_unit);
  ReadVector(reader.RequireChild("bias"), &sensor->model.bias);
  if (ReadMatrix3(reader.RequireChild("sensitivity"), &sensor->model.sensitivity)) {
    CheckCorrection(reader.RequireChild("correction"), sensor->model);
  }
  if (YamlReader mounting = reader.Child("mounting")) {
    std::string name;
    if (mounting.Read(&name)) {
      const std::optional<Eigen::Matrix3d> map = AxisMapFromName(name);
      if (map) sensor->mounting = *map;
      if (!map) mounting.Fail("expected signed axes such as +y+x-z, but `" + name + "` is none");
    }
  }
  // Derived from the sensitivity, for people.
  Eigen::Vector3d scale;
  Eigen::Matrix3d misalignment;
  ReadVector(reader.Child("scale"), &scale);
  ReadMatrix3(reader.Child("misalignment_rad"), &misalignment);
  if (YamlReader sigma = reader.RequireChild("sigma")) {
    ReadSigma(sigma.RequireChild("bias"), &sensor->bias_sigma);
    ReadSigma(sigma.RequireChild("sensitivity"), &sensor->sensitivity_sigma);
    for (const AxisTermInfo& info : kAxisTerms) {
      if (!ReadVector(reader.Child(info.name), &sensor->model.axis_terms[info.term])) continue;
      ReadSigma(sigma.RequireChild(info.name), &sensor->axis_term_sigma[info.term].emplace());
    }
    sigma.RejectUnknown();
  }
  Eigen::Matrix3d g_sensitivity;
  if (ReadMatrix3(reader.Child("g_sensitivity"), &g_sensitivity)) {
    sensor->g_sensitivity = g_sensitivity;
  }
  if (YamlReader thermal = reader.Child("thermal")) {
    ReadThermal(thermal, &sensor->thermal.emplace());
  }
  double si_per_count = 0.0;
  if (ReadNumber(reader.Child("si_per_count"), &si_per_count)) sensor->si_per_count = si_per_count;
  if (YamlReader noise = reader.RequireChild("noise")) ReadNoise(noise, &sensor->noise);
  reader.RejectUnknown();
}

}  // namespace truetriad
