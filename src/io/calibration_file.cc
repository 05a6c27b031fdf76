// SPDX-License-Identifier: Apache-2.0
#include "truetriad/io/calibration_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <sstream>
#include <string_view>
#include <system_error>

#include <Eigen/Dense>

#include "io/whole_file.h"
#include "io/yaml_reader.h"
#include "io/yaml_text.h"

namespace truetriad {
namespace {

constexpr double kAbsoluteZeroDegc = -273.15;
constexpr std::string_view kFormat = "truetriad/calibration/1";
constexpr std::string_view kAxes = "xyz";
/// More rows of single poses than this help nobody and would dominate the file.
constexpr std::size_t kMaxPoseResiduals = 2000;

// ---------------------------------------------------------------------------------------- writing

void WriteItem(YamlText& out, std::string_view key, bool empty) {
  out << "  " << key << (empty ? ": []\n" : ":\n");
}

void WritePerTriad(YamlText& out, const PerTriad<std::optional<double>>& values) {
  out << "{";
  std::string_view separator = " ";
  for (const Triad triad : kTriads) {
    if (!values[triad]) continue;
    out << separator << TriadName(triad) << ": " << *values[triad];
    separator = ", ";
  }
  out << " }";
}

template <typename T>
void WriteList(YamlText& out, const std::vector<T>& items) {
  out << "[";
  for (std::size_t i = 0; i < items.size(); ++i) out << (i == 0 ? "" : ", ") << items[i];
  out << "]";
}

void WriteThermal(YamlText& out, const ThermalTerms& thermal) {
  out << "    thermal:\n      reference_degc: " << thermal.reference_degc
      << "\n      range_degc: " << thermal.range_degc << "\n      bias: ";
  WriteList(out, thermal.bias);
  out << "\n      sensitivity: ";
  WriteList(out, thermal.sensitivity);
  out << "\n      rate: {";
  std::string_view separator = " ";
  for (const auto& [key, value] : {std::pair("linear", &thermal.rate_linear),
                                   std::pair("quadratic", &thermal.rate_quadratic),
                                   std::pair("cross", &thermal.rate_cross)}) {
    if (!*value) continue;
    out << separator << key << ": " << **value;
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
    out << "        - { axis: " << kAxes.substr(static_cast<std::size_t>(knot.axis), 1)
        << ", degc: " << knot.degc << ", slope: " << knot.slope << ", curve: " << knot.curve
        << " }\n";
  }
}

void WriteSensor(YamlText& out, Triad triad, const TriadCalibration& sensor) {
  out << "  " << TriadName(triad) << ":\n"
      << "    input_unit: " << Quoted{sensor.input_unit} << "\n"
      << "    output_unit: " << Quoted{sensor.output_unit} << "\n"
      << "    bias: " << sensor.model.bias << "\n"
      << "    sensitivity: " << sensor.model.sensitivity << "\n"
      << "    correction: " << sensor.model.Correction() << "\n"
      << "    scale: " << sensor.Scale() << "\n"
      << "    misalignment_rad: " << sensor.MisalignmentRad() << "\n";
  if (sensor.quadratic_sigma) out << "    quadratic: " << sensor.model.quadratic << "\n";
  if (sensor.asymmetry_sigma) out << "    asymmetry: " << sensor.model.asymmetry << "\n";
  out << "    sigma:\n"
      << "      bias: " << sensor.bias_sigma << "\n"
      << "      sensitivity: " << sensor.sensitivity_sigma << "\n";
  if (sensor.quadratic_sigma) out << "      quadratic: " << *sensor.quadratic_sigma << "\n";
  if (sensor.asymmetry_sigma) out << "      asymmetry: " << *sensor.asymmetry_sigma << "\n";
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

void WriteCovariance(YamlText& out, const NamedCovariance& covariance) {
  out << "covariance:\n  parameters: ";
  WriteList(out, covariance.parameters);
  out << "\n";
  WriteItem(out, "matrix", covariance.matrix.rows() == 0);
  for (Eigen::Index row = 0; row < covariance.matrix.rows(); ++row) {
    out << "    - " << covariance.matrix.row(row).transpose() << "\n";
  }
}

void WriteReference(YamlText& out, const ReferenceValues& reference) {
  out << "reference:\n  gravity_mps2: " << reference.gravity_mps2 << "\n";
  if (reference.gravity_sigma_mps2) {
    out << "  gravity_sigma_mps2: " << *reference.gravity_sigma_mps2 << "\n";
  }
  if (reference.field_ut) out << "  field_ut: " << *reference.field_ut << "\n";
  if (reference.dip_rad) out << "  dip_rad: " << *reference.dip_rad << "\n";
  if (reference.fixture_from_world) {
    out << "  fixture_from_world: " << *reference.fixture_from_world << "\n";
  }
  out << "  field_estimated: " << reference.field_estimated << "\n"
      << "  field_nominal: " << reference.field_nominal << "\n"
      << "  temperature_degc: " << reference.temperature_degc << "\n";
  if (reference.recorded_degc) out << "  recorded_degc: " << *reference.recorded_degc << "\n";
}

void WritePoseResiduals(YamlText& out, const std::vector<PoseResidual>& residuals) {
  if (residuals.size() > kMaxPoseResiduals) {
    out << "  # Left out: " << residuals.size() << " rows, more than " << kMaxPoseResiduals
        << ".\n";
    out << "  pose_residuals: []\n";
    return;
  }
  out << "  # Rows: pose, sensor, residual x y z, norm error, norm error before, normalized, "
         "weight,"
         " direction x y z.\n";
  WriteItem(out, "pose_residuals", residuals.empty());
  for (const PoseResidual& row : residuals) {
    out << "    - [" << row.pose << ", " << TriadName(row.triad);
    for (const double value : row.residual) out << ", " << value;
    for (const double value : {row.norm_error, row.norm_error_before, row.normalized, row.weight}) {
      out << ", " << value;
    }
    for (const double value : row.direction) out << ", " << value;
    out << "]\n";
  }
}

void WriteHeldOutTurns(YamlText& out, const HeldOutTurns& turns) {
  out << "    turns:\n      median_rad: " << turns.median_rad
      << "\n      in_sample_median_rad: " << turns.in_sample_median_rad << "\n";
  if (turns.nominal_median_rad) {
    out << "      nominal_median_rad: " << *turns.nominal_median_rad << "\n";
  }
  out << "      errors_rad: ";
  WriteList(out, turns.errors_rad);
  out << "\n";
}

void WriteRegression(YamlText& out, const SweepRegression& regression) {
  out << "      regression:\n        factors: [";
  for (std::size_t i = 0; i < regression.factors.size(); ++i) {
    out << (i == 0 ? "" : ", ") << Quoted{regression.factors[i]};
  }
  out << "]\n        windows: " << regression.windows << "\n        enter_p: " << regression.enter_p
      << "\n        leave_p: " << regression.leave_p << "\n        rms: " << regression.rms
      << (regression.steps.empty() ? "\n        steps: []\n" : "\n        steps:\n");
  for (const RegressionStep& step : regression.steps) {
    out << "          - { step: " << Quoted{step.what} << ", terms: " << step.terms
        << ", f: " << step.f << ", p_value: " << step.p_value << ", r2: " << step.r2
        << ", adjusted_r2: " << step.adjusted_r2 << ", bic: " << step.bic
        << ", held_out: " << step.held_out << " }\n";
  }
  out << "        terms:\n";
  for (const RegressionTerm& term : regression.terms) {
    out << "          - { term: " << Quoted{term.name} << ", unit: " << Quoted{term.unit}
        << ", chosen: " << (term.chosen ? "true" : "false") << ", value: " << term.coefficient
        << ", sigma: " << term.sigma;
    if (std::isfinite(term.f)) out << ", f: " << term.f << ", p_value: " << term.p_value;
    if (!term.why.empty()) out << ", why: " << Quoted{term.why};
    out << " }\n";
  }
}

void WriteSweep(YamlText& out, const Quality& quality) {
  if (quality.sweep.empty()) return;
  out << "  sweep:\n";
  for (const SweepAxis& axis : quality.sweep) {
    out << "    - sensor: " << TriadName(axis.triad)
        << "\n      axis: " << kAxes.substr(static_cast<std::size_t>(axis.axis), 1)
        << "\n      chosen: " << Quoted{axis.chosen} << "\n      noise_sigma: " << axis.noise_sigma
        << "\n      rms: { before: " << axis.rms_before << ", after: " << axis.rms_after
        << ", held_out: " << axis.held_out << ", held_out_cubic: " << axis.held_out_cubic
        << ", folds: " << axis.folds << " }\n      branch_gap: { before: " << axis.branch_gap
        << ", after: " << axis.branch_gap_after << " }\n      correlation: " << axis.correlation
        << "\n      element_lag_s: { value: " << axis.element_lag_s
        << ", sigma: " << axis.element_lag_sigma_s
        << " }\n      rate_lag_s: { value: " << axis.rate_lag_s
        << ", sigma: " << axis.rate_lag_sigma_s << " }\n      left_out: [";
    for (std::size_t i = 0; i < axis.left_out.size(); ++i) {
      out << (i == 0 ? "" : ", ") << Quoted{axis.left_out[i]};
    }
    out << (axis.steps.empty() ? "]\n      steps: []\n" : "]\n      steps:\n");
    for (const SweepStep& step : axis.steps) {
      out << "        - { step: " << Quoted{step.what} << ", terms: " << Quoted{step.terms}
          << ", r2: " << step.r2 << ", adjusted_r2: " << step.adjusted_r2 << ", bic: " << step.bic
          << ", held_out: " << step.held_out << " }\n";
    }
    if (axis.regression) WriteRegression(out, *axis.regression);
  }
  out << "  # Rows: sensor, time s, temperature degC, rate degC/s, bias x y z, fit x y z, its "
         "sigma "
         "x y z.\n";
  WriteItem(out, "sweep_windows", quality.sweep_windows.empty());
  for (const SweepWindow& window : quality.sweep_windows) {
    out << "    - [" << TriadName(window.triad) << ", " << window.time_s << ", " << window.degc
        << ", " << window.rate_degcps;
    for (const auto* values : {&window.bias_raw, &window.fit_raw, &window.fit_sigma_raw}) {
      for (const double value : *values) out << ", " << value;
    }
    out << "]\n";
  }
}

void WriteModels(YamlText& out, const char* key, const std::vector<ModelAlternative>& models) {
  if (!models.empty()) WriteItem(out, key, false);
  for (const ModelAlternative& model : models) {
    out << "    - { model: " << Quoted{model.description} << ", chosen: " << model.chosen
        << ", parameters: " << model.parameters << ", minus_2_log_l: " << model.minus_2_log_l;
    if (model.p_value) out << ", p_value: " << *model.p_value;
    out << ", bic: " << model.bic;
    if (model.held_out) out << ", held_out: " << *model.held_out;
    out << " }\n";
  }
}

void WriteQuality(YamlText& out, const Quality& quality) {
  out << "quality:\n  poses: " << quality.poses << "\n  residual_rms: ";
  WritePerTriad(out, quality.residual_rms);
  out << "\n  residual_rms_before: ";
  WritePerTriad(out, quality.residual_rms_before);
  out << "\n  reduced_chi2: " << quality.reduced_chi2;
  // Where nothing but the residuals tells the noise, and for a unit followed through its motion,
  // there is none.
  if (std::isfinite(quality.reduced_chi2_before)) {
    out << "\n  reduced_chi2_before: " << quality.reduced_chi2_before;
  }
  out << "\n  effective_dof: " << quality.effective_dof << "\n  dof: " << quality.dof << "\n";
  WriteItem(out, "weak_directions", quality.weak_directions.empty());
  for (const WeakDirection& weak : quality.weak_directions) {
    out << "    - { description: " << Quoted{weak.description}
        << ", advice: " << Quoted{weak.advice} << ", sigma: " << weak.sigma << " }\n";
  }
  if (quality.held_out) {
    out << "  held_out:\n    folds: " << quality.held_out->folds << "\n    rms: ";
    WritePerTriad(out, quality.held_out->rms);
    out << "\n    in_sample_rms: ";
    WritePerTriad(out, quality.held_out->in_sample_rms);
    out << "\n";
    if (quality.held_out->turns) WriteHeldOutTurns(out, *quality.held_out->turns);
  } else {
    out << "  held_out: null\n";
  }
  WriteModels(out, "model_choice", quality.model_choice);
  WriteModels(out, "model_steps", quality.model_steps);
  if (!quality.temperature_settings.empty()) {
    out << "  # Of the poses at one temperature alone: bias x y z, its sigma and what it is beyond "
           "the "
           "terms, raw unit; RMS at "
           "the "
           "reference temperature's calibration and at their own.\n";
    WriteItem(out, "temperature_settings", false);
  }
  for (const TemperatureSetting& setting : quality.temperature_settings) {
    out << "    - { sensor: " << TriadName(setting.triad) << ", degc: " << setting.degc
        << ", poses: " << setting.poses << ", bias: " << setting.bias_raw
        << ", bias_sigma: " << setting.bias_sigma_raw
        << ", beyond_terms: " << setting.beyond_terms_raw << ", rms_before: " << setting.rms_before
        << ", rms_after: " << setting.rms_after << " }\n";
  }
  WriteItem(out, "rejected_poses", quality.rejected_poses.empty());
  for (const RejectedPose& rejected : quality.rejected_poses) {
    out << "    - { pose: " << rejected.pose << ", sensor: " << TriadName(rejected.triad)
        << ", reason: " << Quoted{rejected.reason} << " }\n";
  }
  if (!quality.turns.empty()) WriteItem(out, "turns", false);
  for (const TurnCheck& turn : quality.turns) {
    out << "    - { name: " << Quoted{turn.name} << ", axis: " << turn.axis
        << ", stated_rad: " << turn.stated_rad << ", stated_sigma_rad: " << turn.stated_sigma_rad
        << ", found_rad: " << turn.found_rad << ", found_sigma_rad: " << turn.found_sigma_rad
        << ", used: " << turn.used << ", fault: " << Quoted{turn.fault} << " }\n";
  }
  if (!quality.clock_offsets.empty()) WriteItem(out, "clock_offsets", false);
  for (const ClockOffset& offset : quality.clock_offsets) {
    out << "    - { sensor: " << TriadName(offset.triad) << ", later_s: " << offset.later_s
        << ", sigma_s: " << offset.sigma_s << ", moves: " << offset.moves
        << ", p_value: " << offset.p_value << " }\n";
  }
  WriteItem(out, "coverage", quality.coverage.empty());
  for (const Coverage& coverage : quality.coverage) {
    out << "    - { sensor: " << TriadName(coverage.triad)
        << ", eigenvalues: " << coverage.eigenvalues
        << ", largest_gap_deg: " << coverage.largest_gap_deg << " }\n";
  }
  WriteItem(out, "limits", quality.limits.empty());
  for (const LimitCheck& check : quality.limits) {
    out << "    - { name: " << Quoted{check.name} << ", limit: " << check.limit
        << ", worst: " << check.worst << ", sigma: " << check.sigma << ", pass: " << check.pass
        << " }\n";
  }
  WriteSweep(out, quality);
  WritePoseResiduals(out, quality.pose_residuals);
}

void WriteConfig(YamlText& out, const std::string& config_yaml) {
  if (config_yaml.empty()) {
    out << "config: {}\n";
    return;
  }
  out << "config:\n";
  std::istringstream lines(config_yaml);
  for (std::string line; std::getline(lines, line);) {
    out << (line.empty() ? "" : "  ") << line << "\n";
  }
}

// ---------------------------------------------------------------------------------------- reading

/// Any double that YamlText writes, so also those that a person may not write in a configuration.
bool ReadNumber(YamlReader reader, double* value) {
  std::string text;
  if (reader.IsScalar() && reader.Read(&text)) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const auto& [word, number] : {std::pair(".nan", std::numeric_limits<double>::quiet_NaN()),
                                       std::pair(".inf", kInfinity),
                                       std::pair("-.inf", -kInfinity)}) {
      if (text == word) {
        *value = number;
        return true;
      }
    }
  }
  return reader.Read(value);
}

bool IsNull(const YamlReader& reader) {
  return reader && !reader.IsScalar() && !reader.IsSequence() && !reader.IsMap();
}

/// A list of exactly as many numbers as `values` has room for.
bool ReadNumbers(YamlReader reader, std::span<double> values) {
  if (!reader) return false;
  std::vector<YamlReader> items = reader.Items();
  if (items.size() != values.size()) {
    if (reader.IsSequence()) {
      reader.Fail("has " + std::to_string(items.size()) + " numbers; " +
                  std::to_string(values.size()) + " are expected");
    }
    return false;
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!ReadNumber(items[i], &values[i])) return false;
  }
  return true;
}

template <int kSize>
bool ReadVector(const YamlReader& reader, Eigen::Matrix<double, kSize, 1>* vector) {
  return ReadNumbers(reader, std::span<double>(vector->data(), kSize));
}

template <typename Matrix>
bool ReadMatrix(YamlReader reader, Eigen::Index size, Matrix* matrix) {
  if (!reader) return false;
  std::vector<YamlReader> rows = reader.Items();
  if (rows.size() != static_cast<std::size_t>(size)) {
    if (reader.IsSequence()) {
      reader.Fail("has " + std::to_string(rows.size()) + " rows; " + std::to_string(size) +
                  " are expected");
    }
    return false;
  }
  matrix->resize(size, size);
  Eigen::VectorXd row(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    if (!ReadNumbers(rows[static_cast<std::size_t>(i)], {row.data(), rows.size()})) return false;
    matrix->row(i) = row.transpose();
  }
  return true;
}

bool ReadMatrix3(const YamlReader& reader, Eigen::Matrix3d* matrix) {
  return ReadMatrix(reader, 3, matrix);
}

/// A word that `from_name` knows.
template <typename T>
bool ReadWord(YamlReader reader, std::optional<T> (*from_name)(std::string_view), T* value) {
  std::string word;
  if (!reader.Read(&word)) return false;
  const std::optional<T> known = from_name(word);
  if (!known) {
    reader.Fail("`" + word + "` is not one of the words that stand here");
    return false;
  }
  *value = *known;
  return true;
}

void ReadPerTriad(YamlReader reader, PerTriad<std::optional<double>>* values) {
  if (!reader) return;
  for (const Triad triad : kTriads) {
    double value = 0.0;
    if (ReadNumber(reader.Child(TriadName(triad)), &value)) (*values)[triad] = value;
  }
  reader.RejectUnknown();
}

/// x, y or z.
void ReadAxis(YamlReader reader, int* axis) {
  std::string text;
  if (!reader.Read(&text)) return;
  const std::size_t place = text.size() == 1 ? kAxes.find(text) : std::string_view::npos;
  if (place == std::string_view::npos) {
    reader.Fail("x, y or z is expected");
  } else {
    *axis = static_cast<int>(place);
  }
}

/// Numbers that no calibration writes.
void CheckThermal(YamlReader& reader, const ThermalTerms& thermal) {
  bool finite = std::isfinite(thermal.reference_degc) && thermal.range_degc.allFinite();
  for (const Eigen::Vector3d& term : thermal.bias) finite = finite && term.allFinite();
  for (const Eigen::Matrix3d& term : thermal.sensitivity) finite = finite && term.allFinite();
  for (const auto* rate : {&thermal.rate_linear, &thermal.rate_quadratic, &thermal.rate_cross}) {
    finite = finite && (!*rate || (*rate)->allFinite());
  }
  for (const ThermalKnot& knot : thermal.knots) {
    finite = finite && std::isfinite(knot.degc) && std::isfinite(knot.slope) &&
             std::isfinite(knot.curve);
  }
  if (!finite) {
    reader.Fail("holds a number that is not finite");
  } else if (thermal.range_degc[0] > thermal.range_degc[1] ||
             std::min(thermal.range_degc[0], thermal.reference_degc) < kAbsoluteZeroDegc) {
    reader.Fail(
        "`range_degc` goes from the lowest to the highest temperature, and nothing is below "
        "-273.15 degC");
  } else if (!(thermal.smoothing_s >= 0.0)) {
    reader.Fail("`smoothing_s` is a time of at least zero");
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
    for (const auto& [key, value] : {std::pair("linear", &thermal->rate_linear),
                                     std::pair("quadratic", &thermal->rate_quadratic),
                                     std::pair("cross", &thermal->rate_cross)}) {
      Eigen::Vector3d vector;
      if (ReadVector(rate.Child(key), &vector)) *value = vector;
    }
    rate.RejectUnknown();
  }
  for (const auto& [key, value] : {std::pair("element_lag_s", &thermal->element_lag_s),
                                   std::pair("rate_lag_s", &thermal->rate_lag_s)}) {
    YamlReader lag = reader.Child(key);
    Eigen::Vector3d lags;
    if (!ReadVector(lag, &lags)) continue;
    if (!lags.allFinite() || lags.minCoeff() < 0.0) lag.Fail("lags are seconds of at least zero");
    *value = lags;
  }
  if (YamlReader smoothing = reader.Child("smoothing_s")) {
    ReadNumber(smoothing, &thermal->smoothing_s);
  }
  YamlReader rates = reader.Child("rate_range_degcps");
  if (Eigen::Vector2d range; ReadVector(rates, &range)) {
    if (!(range[0] <= range[1])) rates.Fail("goes from the lowest to the highest rate");
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

void ReadNoise(YamlReader reader, TriadNoise* noise) {
  ReadVector(reader.RequireChild("sigma"), &noise->sigma);
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
    reader.Fail("belongs to a sensor whose bias or sensitivity is not finite");
    return;
  }
  const Eigen::Matrix3d error = correction * model.sensitivity - Eigen::Matrix3d::Identity();
  if (!(error.cwiseAbs().maxCoeff() < kTolerance)) {
    reader.Fail("is not the inverse of `sensitivity`; correct the one that was changed");
  }
}

/// A term that need not be there: its values and their σ.
void ReadTerm(YamlReader& sensor,
              YamlReader& sigmas,
              std::string_view key,
              Eigen::Vector3d* values,
              std::optional<Eigen::Vector3d>* sigma) {
  if (!ReadVector(sensor.Child(key), values)) return;
  ReadVector(sigmas.RequireChild(key), &sigma->emplace());
}

void ReadSensor(YamlReader reader, TriadCalibration* sensor) {
  reader.Require("input_unit", &sensor->input_unit);
  reader.Require("output_unit", &sensor->output_unit);
  ReadVector(reader.RequireChild("bias"), &sensor->model.bias);
  if (ReadMatrix3(reader.RequireChild("sensitivity"), &sensor->model.sensitivity)) {
    CheckCorrection(reader.RequireChild("correction"), sensor->model);
  }
  // Derived from the sensitivity, for people.
  Eigen::Vector3d scale;
  Eigen::Matrix3d misalignment;
  ReadVector(reader.Child("scale"), &scale);
  ReadMatrix3(reader.Child("misalignment_rad"), &misalignment);
  if (YamlReader sigma = reader.RequireChild("sigma")) {
    ReadVector(sigma.RequireChild("bias"), &sensor->bias_sigma);
    ReadMatrix3(sigma.RequireChild("sensitivity"), &sensor->sensitivity_sigma);
    ReadTerm(reader, sigma, "quadratic", &sensor->model.quadratic, &sensor->quadratic_sigma);
    ReadTerm(reader, sigma, "asymmetry", &sensor->model.asymmetry, &sensor->asymmetry_sigma);
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

void ReadCovariance(YamlReader reader, NamedCovariance* covariance) {
  if (!reader) return;
  for (YamlReader& item : reader.RequireChild("parameters").Items()) {
    item.Read(&covariance->parameters.emplace_back());
  }
  ReadMatrix(reader.RequireChild("matrix"),
             static_cast<Eigen::Index>(covariance->parameters.size()),
             &covariance->matrix);
  const Eigen::MatrixXd& matrix = covariance->matrix;
  if (matrix.size() > 0 && (!matrix.allFinite() || matrix.diagonal().minCoeff() < 0.0)) {
    reader.Fail("holds a number that is not finite or a negative variance");
  }
  reader.RejectUnknown();
}

void ReadReference(YamlReader reader, ReferenceValues* reference) {
  if (!reader) return;
  if (YamlReader gravity = reader.RequireChild("gravity_mps2");
      ReadNumber(gravity, &reference->gravity_mps2) && !(reference->gravity_mps2 > 0.0)) {
    gravity.Fail("a positive number is expected");
  }
  for (const auto& [key, value] : {std::pair("gravity_sigma_mps2", &reference->gravity_sigma_mps2),
                                   std::pair("field_ut", &reference->field_ut),
                                   std::pair("dip_rad", &reference->dip_rad)}) {
    double number = 0.0;
    if (ReadNumber(reader.Child(key), &number)) *value = number;
  }
  if (Eigen::Vector4d rotation; ReadVector(reader.Child("fixture_from_world"), &rotation)) {
    reference->fixture_from_world = rotation;
  }
  reader.Require("field_estimated", &reference->field_estimated);
  reader.Optional("field_nominal", &reference->field_nominal);
  ReadNumber(reader.RequireChild("temperature_degc"), &reference->temperature_degc);
  YamlReader recorded = reader.Child("recorded_degc");
  if (Eigen::Vector3d degc; ReadVector(recorded, &degc)) {
    if (!(degc[0] <= degc[1] && degc[1] <= degc[2] && degc[0] >= kAbsoluteZeroDegc)) {
      recorded.Fail("expected the lowest, the mean and the highest temperature, degC");
    }
    reference->recorded_degc = degc;
  }
  reader.RejectUnknown();
}

void ReadPoseResidual(YamlReader reader, PoseResidual* row) {
  std::vector<YamlReader> items = reader.Items();
  constexpr std::size_t kFirstNumber = 2;
  std::array<double, 10> numbers;
  if (items.size() != kFirstNumber + numbers.size()) {
    reader.Fail("has " + std::to_string(items.size()) + " entries; " +
                std::to_string(kFirstNumber + numbers.size()) + " are expected");
    return;
  }
  items[0].Read(&row->pose);
  ReadWord(items[1], TriadFromName, &row->triad);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!ReadNumber(items[kFirstNumber + i], &numbers[i])) return;
  }
  row->residual = {numbers[0], numbers[1], numbers[2]};
  row->norm_error = numbers[3];
  row->norm_error_before = numbers[4];
  row->normalized = numbers[5];
  row->weight = numbers[6];
  row->direction = {numbers[7], numbers[8], numbers[9]};
}

void ReadSweepStep(YamlReader reader, SweepStep* step) {
  reader.Require("step", &step->what);
  reader.Require("terms", &step->terms);
  ReadNumber(reader.RequireChild("r2"), &step->r2);
  ReadNumber(reader.RequireChild("adjusted_r2"), &step->adjusted_r2);
  ReadNumber(reader.RequireChild("bic"), &step->bic);
  ReadNumber(reader.RequireChild("held_out"), &step->held_out);
  reader.RejectUnknown();
}

void ReadRegression(YamlReader reader, SweepRegression* regression) {
  for (YamlReader& item : reader.RequireChild("factors").Items()) {
    item.Read(&regression->factors.emplace_back());
  }
  reader.Require("windows", &regression->windows);
  ReadNumber(reader.RequireChild("enter_p"), &regression->enter_p);
  ReadNumber(reader.RequireChild("leave_p"), &regression->leave_p);
  ReadNumber(reader.RequireChild("rms"), &regression->rms);
  for (YamlReader& item : reader.RequireChild("steps").Items()) {
    RegressionStep& step = regression->steps.emplace_back();
    item.Require("step", &step.what);
    item.Require("terms", &step.terms);
    ReadNumber(item.RequireChild("f"), &step.f);
    ReadNumber(item.RequireChild("p_value"), &step.p_value);
    ReadNumber(item.RequireChild("r2"), &step.r2);
    ReadNumber(item.RequireChild("adjusted_r2"), &step.adjusted_r2);
    ReadNumber(item.RequireChild("bic"), &step.bic);
    ReadNumber(item.RequireChild("held_out"), &step.held_out);
    item.RejectUnknown();
  }
  for (YamlReader& item : reader.RequireChild("terms").Items()) {
    RegressionTerm& term = regression->terms.emplace_back();
    item.Require("term", &term.name);
    item.Require("unit", &term.unit);
    item.Require("chosen", &term.chosen);
    ReadNumber(item.RequireChild("value"), &term.coefficient);
    ReadNumber(item.RequireChild("sigma"), &term.sigma);
    term.f = term.p_value = std::numeric_limits<double>::quiet_NaN();
    if (YamlReader f = item.Child("f")) {
      ReadNumber(f, &term.f);
      ReadNumber(item.RequireChild("p_value"), &term.p_value);
    }
    item.Optional("why", &term.why);
    item.RejectUnknown();
  }
  reader.RejectUnknown();
}

void ReadSweepAxis(YamlReader reader, SweepAxis* axis) {
  ReadWord(reader.RequireChild("sensor"), TriadFromName, &axis->triad);
  ReadAxis(reader.RequireChild("axis"), &axis->axis);
  reader.Require("chosen", &axis->chosen);
  ReadNumber(reader.RequireChild("noise_sigma"), &axis->noise_sigma);
  if (YamlReader rms = reader.RequireChild("rms")) {
    ReadNumber(rms.RequireChild("before"), &axis->rms_before);
    ReadNumber(rms.RequireChild("after"), &axis->rms_after);
    ReadNumber(rms.RequireChild("held_out"), &axis->held_out);
    ReadNumber(rms.RequireChild("held_out_cubic"), &axis->held_out_cubic);
    rms.Require("folds", &axis->folds);
    rms.RejectUnknown();
  }
  if (YamlReader gap = reader.RequireChild("branch_gap")) {
    ReadNumber(gap.RequireChild("before"), &axis->branch_gap);
    ReadNumber(gap.RequireChild("after"), &axis->branch_gap_after);
    gap.RejectUnknown();
  }
  ReadNumber(reader.RequireChild("correlation"), &axis->correlation);
  const auto read_lag = [&reader](std::string_view key, double* value, double* sigma) {
    YamlReader lag = reader.RequireChild(key);
    if (!lag) return;
    ReadNumber(lag.RequireChild("value"), value);
    ReadNumber(lag.RequireChild("sigma"), sigma);
    lag.RejectUnknown();
  };
  read_lag("element_lag_s", &axis->element_lag_s, &axis->element_lag_sigma_s);
  read_lag("rate_lag_s", &axis->rate_lag_s, &axis->rate_lag_sigma_s);
  for (YamlReader& item : reader.RequireChild("left_out").Items()) {
    item.Read(&axis->left_out.emplace_back());
  }
  for (const YamlReader& item : reader.RequireChild("steps").Items()) {
    ReadSweepStep(item, &axis->steps.emplace_back());
  }
  if (YamlReader regression = reader.Child("regression")) {
    ReadRegression(regression, &axis->regression.emplace());
  }
  reader.RejectUnknown();
}

void ReadSweepWindow(YamlReader reader, SweepWindow* window) {
  std::vector<YamlReader> items = reader.Items();
  std::array<double, 12> numbers;
  if (items.size() != 1 + numbers.size()) {
    reader.Fail("has " + std::to_string(items.size()) + " entries; " +
                std::to_string(1 + numbers.size()) + " are expected");
    return;
  }
  ReadWord(items[0], TriadFromName, &window->triad);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!ReadNumber(items[1 + i], &numbers[i])) return;
  }
  window->time_s = numbers[0];
  window->degc = numbers[1];
  window->rate_degcps = numbers[2];
  window->bias_raw = Eigen::Vector3d(&numbers[3]);
  window->fit_raw = Eigen::Vector3d(&numbers[6]);
  window->fit_sigma_raw = Eigen::Vector3d(&numbers[9]);
}

void ReadModels(YamlReader reader, std::vector<ModelAlternative>* models) {
  for (YamlReader& item : reader.Items()) {
    ModelAlternative& model = models->emplace_back();
    item.Require("model", &model.description);
    item.Require("chosen", &model.chosen);
    item.Require("parameters", &model.parameters);
    ReadNumber(item.RequireChild("minus_2_log_l"), &model.minus_2_log_l);
    ReadNumber(item.RequireChild("bic"), &model.bic);
    for (const auto& [key, value] :
         {std::pair("p_value", &model.p_value), std::pair("held_out", &model.held_out)}) {
      if (double number = 0.0; ReadNumber(item.Child(key), &number)) *value = number;
    }
    item.RejectUnknown();
  }
}

void ReadQuality(YamlReader reader, Quality* quality) {
  if (!reader) return;
  reader.Require("poses", &quality->poses);
  ReadPerTriad(reader.RequireChild("residual_rms"), &quality->residual_rms);
  ReadPerTriad(reader.Child("residual_rms_before"), &quality->residual_rms_before);
  ReadNumber(reader.RequireChild("reduced_chi2"), &quality->reduced_chi2);
  quality->reduced_chi2_before = std::numeric_limits<double>::quiet_NaN();
  ReadNumber(reader.Child("reduced_chi2_before"), &quality->reduced_chi2_before);
  ReadNumber(reader.RequireChild("effective_dof"), &quality->effective_dof);
  ReadNumber(reader.RequireChild("dof"), &quality->dof);
  for (YamlReader& item : reader.RequireChild("weak_directions").Items()) {
    WeakDirection& weak = quality->weak_directions.emplace_back();
    item.Require("description", &weak.description);
    item.Require("advice", &weak.advice);
    ReadNumber(item.RequireChild("sigma"), &weak.sigma);
    item.RejectUnknown();
  }
  if (YamlReader held_out = reader.Child("held_out"); held_out && !IsNull(held_out)) {
    HeldOut& result = quality->held_out.emplace();
    held_out.Require("folds", &result.folds);
    ReadPerTriad(held_out.RequireChild("rms"), &result.rms);
    ReadPerTriad(held_out.Child("in_sample_rms"), &result.in_sample_rms);
    if (YamlReader turns = held_out.Child("turns")) {
      HeldOutTurns& read = result.turns.emplace();
      ReadNumber(turns.RequireChild("median_rad"), &read.median_rad);
      ReadNumber(turns.RequireChild("in_sample_median_rad"), &read.in_sample_median_rad);
      if (YamlReader nominal = turns.Child("nominal_median_rad")) {
        ReadNumber(nominal, &read.nominal_median_rad.emplace());
      }
      for (YamlReader& item : turns.RequireChild("errors_rad").Items()) {
        ReadNumber(item, &read.errors_rad.emplace_back());
      }
      turns.RejectUnknown();
    }
    held_out.RejectUnknown();
  }
  ReadModels(reader.Child("model_choice"), &quality->model_choice);
  ReadModels(reader.Child("model_steps"), &quality->model_steps);
  for (YamlReader& item : reader.Child("temperature_settings").Items()) {
    TemperatureSetting& setting = quality->temperature_settings.emplace_back();
    ReadWord(item.RequireChild("sensor"), TriadFromName, &setting.triad);
    ReadNumber(item.RequireChild("degc"), &setting.degc);
    item.Require("poses", &setting.poses);
    ReadVector(item.RequireChild("bias"), &setting.bias_raw);
    ReadVector(item.RequireChild("bias_sigma"), &setting.bias_sigma_raw);
    ReadVector(item.RequireChild("beyond_terms"), &setting.beyond_terms_raw);
    ReadNumber(item.RequireChild("rms_before"), &setting.rms_before);
    ReadNumber(item.RequireChild("rms_after"), &setting.rms_after);
    item.RejectUnknown();
  }
  for (YamlReader& item : reader.RequireChild("rejected_poses").Items()) {
    RejectedPose& rejected = quality->rejected_poses.emplace_back();
    item.Require("pose", &rejected.pose);
    ReadWord(item.RequireChild("sensor"), TriadFromName, &rejected.triad);
    item.Require("reason", &rejected.reason);
    item.RejectUnknown();
  }
  for (YamlReader& item : reader.Child("turns").Items()) {
    TurnCheck& turn = quality->turns.emplace_back();
    item.Require("name", &turn.name);
    ReadVector(item.RequireChild("axis"), &turn.axis);
    ReadNumber(item.RequireChild("stated_rad"), &turn.stated_rad);
    ReadNumber(item.RequireChild("stated_sigma_rad"), &turn.stated_sigma_rad);
    ReadNumber(item.RequireChild("found_rad"), &turn.found_rad);
    ReadNumber(item.RequireChild("found_sigma_rad"), &turn.found_sigma_rad);
    item.Require("used", &turn.used);
    item.Require("fault", &turn.fault);
    item.RejectUnknown();
  }
  for (YamlReader& item : reader.Child("clock_offsets").Items()) {
    ClockOffset& offset = quality->clock_offsets.emplace_back();
    ReadWord(item.RequireChild("sensor"), TriadFromName, &offset.triad);
    ReadNumber(item.RequireChild("later_s"), &offset.later_s);
    ReadNumber(item.RequireChild("sigma_s"), &offset.sigma_s);
    item.Require("moves", &offset.moves);
    ReadNumber(item.RequireChild("p_value"), &offset.p_value);
    item.RejectUnknown();
  }
  for (YamlReader& item : reader.Child("coverage").Items()) {
    Coverage& coverage = quality->coverage.emplace_back();
    ReadWord(item.RequireChild("sensor"), TriadFromName, &coverage.triad);
    ReadVector(item.RequireChild("eigenvalues"), &coverage.eigenvalues);
    ReadNumber(item.RequireChild("largest_gap_deg"), &coverage.largest_gap_deg);
    item.RejectUnknown();
  }
  for (YamlReader& item : reader.Child("limits").Items()) {
    LimitCheck& check = quality->limits.emplace_back();
    item.Require("name", &check.name);
    ReadNumber(item.RequireChild("limit"), &check.limit);
    ReadNumber(item.RequireChild("worst"), &check.worst);
    ReadNumber(item.RequireChild("sigma"), &check.sigma);
    item.Require("pass", &check.pass);
    item.RejectUnknown();
  }
  for (const YamlReader& item : reader.Child("sweep").Items()) {
    ReadSweepAxis(item, &quality->sweep.emplace_back());
  }
  for (const YamlReader& item : reader.Child("sweep_windows").Items()) {
    ReadSweepWindow(item, &quality->sweep_windows.emplace_back());
  }
  for (const YamlReader& item : reader.Child("pose_residuals").Items()) {
    ReadPoseResidual(item, &quality->pose_residuals.emplace_back());
  }
  reader.RejectUnknown();
}

void ReadStatus(YamlReader reader, Calibration* calibration) {
  if (!reader) return;
  ReadWord(reader.RequireChild("outcome"), OutcomeFromName, &calibration->outcome);
  bool within_limits = false;
  if (YamlReader limits = reader.RequireChild("within_limits");
      !IsNull(limits) && limits.Read(&within_limits)) {
    calibration->within_limits = within_limits;
  }
  for (YamlReader& item : reader.RequireChild("messages").Items()) {
    item.Read(&calibration->messages.emplace_back());
  }
  reader.RejectUnknown();
}

/// The text below the top-level key `config:`, moved to the left margin. The text and not the
/// parsed value, so that comments (which mark the defaults) and the spelling of numbers stay.
std::string ConfigText(const std::string& text) {
  constexpr std::string_view kKey = "config:";
  std::istringstream lines(text);
  std::string line;
  while (std::getline(lines, line) && !line.starts_with(kKey)) {
  }
  if (line.starts_with("config: {}")) return "";
  std::string config = line.substr(std::min(line.size(), kKey.size()));
  config.erase(0, config.find_first_not_of(' '));
  if (!config.empty()) config += '\n';
  std::size_t indent = 0;
  while (std::getline(lines, line)) {
    const std::size_t content = line.find_first_not_of(' ');
    if (content == 0 && line[0] != '#') break;  // The next top-level key.
    if (indent == 0 && content != std::string::npos) indent = content;
    config += line.substr(std::min({indent, content, line.size()})) + '\n';
  }
  return config;
}

}  // namespace

std::string CalibrationToYaml(const Calibration& calibration) {
  constexpr int kDigits = std::numeric_limits<double>::max_digits10;
  YamlText out(kDigits);
  out << "format: " << kFormat << "\n"
      << "device: { serial: " << Quoted{calibration.serial}
      << ", model: " << Quoted{calibration.model} << " }\n"
      << "software: { name: truetriad, version: " << Quoted{calibration.software_version} << " }\n"
      << "created: " << calibration.created << "\n"
      << (calibration.inputs.empty() ? "inputs: []\n" : "inputs:\n");
  for (const InputFile& input : calibration.inputs) {
    out << "  - { file: " << Quoted{input.file} << ", sha256: " << Quoted{input.sha256}
        << ", samples: " << input.samples << " }\n";
  }
  out << "status:\n  outcome: " << OutcomeName(calibration.outcome) << "\n  within_limits: ";
  if (calibration.within_limits) {
    out << *calibration.within_limits << "\n";
  } else {
    out << "null\n";
  }
  WriteItem(out, "messages", calibration.messages.empty());
  for (const std::string& message : calibration.messages) {
    out << "    - " << Quoted{message} << "\n";
  }
  WriteReference(out, calibration.reference);
  out << "gauge: " << GaugeName(calibration.gauge) << "\n"
      << "gauge_sensor: " << TriadName(calibration.gauge_sensor) << "\n";
  if (calibration.IsUsable()) {
    out << "sensors:\n";
    for (const Triad triad : kTriads) {
      if (calibration.sensors[triad]) WriteSensor(out, triad, *calibration.sensors[triad]);
    }
    WriteCovariance(out, calibration.covariance);
  }
  WriteQuality(out, calibration.quality);
  WriteConfig(out, calibration.config_yaml);
  return out.str();
}

Result<Calibration> CalibrationFromYaml(const std::string& text, const std::string& name) {
  Result<YamlReader> root = YamlReader::FromText(text, name);
  TRUETRIAD_RETURN_IF_ERROR(root);
  YamlReader& reader = *root;
  std::string format;
  if (reader.Require("format", &format) && format != kFormat) {
    reader.Child("format").Fail("`" + format + "` cannot be read by this version, which reads " +
                                std::string(kFormat));
  }
  // A file of another kind or version would only add errors that say nothing.
  TRUETRIAD_RETURN_IF_ERROR(reader.status());

  Calibration calibration;
  if (YamlReader device = reader.RequireChild("device")) {
    device.Require("serial", &calibration.serial);
    device.Require("model", &calibration.model);
    device.RejectUnknown();
  }
  if (YamlReader software = reader.RequireChild("software")) {
    std::string program;
    software.Require("name", &program);
    software.Require("version", &calibration.software_version);
    software.RejectUnknown();
  }
  if (YamlReader created = reader.RequireChild("created"); !IsNull(created)) {
    created.Read(&calibration.created);
  }
  for (YamlReader& item : reader.RequireChild("inputs").Items()) {
    InputFile& input = calibration.inputs.emplace_back();
    item.Require("file", &input.file);
    item.Require("sha256", &input.sha256);
    item.Require("samples", &input.samples);
    item.RejectUnknown();
  }
  ReadStatus(reader.RequireChild("status"), &calibration);
  ReadReference(reader.RequireChild("reference"), &calibration.reference);
  ReadWord(reader.RequireChild("gauge"), GaugeFromName, &calibration.gauge);
  ReadWord(reader.RequireChild("gauge_sensor"), TriadFromName, &calibration.gauge_sensor);
  if (calibration.IsUsable()) {
    if (YamlReader sensors = reader.RequireChild("sensors")) {
      for (const Triad triad : kTriads) {
        if (YamlReader sensor = sensors.Child(TriadName(triad))) {
          ReadSensor(sensor, &calibration.sensors[triad].emplace());
        }
      }
      sensors.RejectUnknown();
    }
    ReadCovariance(reader.RequireChild("covariance"), &calibration.covariance);
  }
  ReadQuality(reader.RequireChild("quality"), &calibration.quality);
  if (reader.RequireChild("config")) calibration.config_yaml = ConfigText(text);
  reader.RejectUnknown();
  TRUETRIAD_RETURN_IF_ERROR(reader.status());
  return calibration;
}

Result<Calibration> ReadCalibration(const std::string& path) {
  const Result<std::string> text = ReadSmallFile(path);
  TRUETRIAD_RETURN_IF_ERROR(text);
  return CalibrationFromYaml(*text, path);
}

std::string TimestampUtc() {
  std::time_t seconds = std::time(nullptr);
  if (const char* const epoch = std::getenv("SOURCE_DATE_EPOCH")) {
    std::int64_t stated = 0;
    const char* const end = epoch + std::strlen(epoch);
    const auto [parsed_to, failure] = std::from_chars(epoch, end, stated);
    if (failure == std::errc() && parsed_to == end) seconds = stated;
  }
  std::tm utc{};
  if (gmtime_r(&seconds, &utc) == nullptr) return "";
  char text[64];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

Status WriteFileAtomically(const std::string& path, const std::string& text) {
  WholeFile file(path);
  file.Write(text);
  return file.Commit();
}

Status EnsureWritableDirectory(const std::string& directory) {
  std::error_code failure;
  std::filesystem::create_directories(directory, failure);
  if (failure) {
    return BadInputError(directory + ": cannot be created: " + failure.message());
  }
  if (!std::filesystem::is_directory(directory, failure)) {
    return BadInputError(directory + ": is not a directory");
  }
  // Trying is the only sure way: permissions alone do not know about read-only disks.
  const WholeFile probe((std::filesystem::path(directory) / ".probe").string());
  if (probe.failure() != 0) {
    return BadInputError(directory +
                         ": files cannot be written there: " + std::strerror(probe.failure()));
  }
  return {};
}

}  // namespace truetriad
