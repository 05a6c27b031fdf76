// SPDX-License-Identifier: Apache-2.0
#include "io/calibration_quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include "io/calibration_values.h"

namespace truetriad {
namespace {

/// More rows of single poses than this help nobody and would dominate the file.
constexpr std::size_t kMaxPoseResiduals = 2000;

void WritePoseResiduals(YamlText& out, const std::vector<PoseResidual>& residuals) {
  if (residuals.size() > kMaxPoseResiduals) {
    out << "  # Omitted: " << residuals.size() << " rows, more than " << kMaxPoseResiduals << ".\n";
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
  if (quality.sweep.axes.empty()) return;
  out << "  sweep:\n";
  for (const SweepAxis& axis : quality.sweep.axes) {
    out << "    - sensor: " << TriadName(axis.triad)
        << "\n      axis: " << kAxisLetters.substr(static_cast<std::size_t>(axis.axis), 1)
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
  WriteItem(out, "sweep_windows", quality.sweep.windows.empty());
  for (const SweepWindow& window : quality.sweep.windows) {
    out << "    - [" << TriadName(window.triad) << ", " << window.time_s << ", " << window.degc
        << ", " << window.rate_degcps;
    for (const auto* values : {&window.bias_raw, &window.fit_raw, &window.fit_sigma_raw}) {
      for (const double value : *values) out << ", " << value;
    }
    out << "]\n";
  }
}

void WriteFields(YamlText& out, const ModelAlternative& model) {
  out << "model: " << Quoted{model.description} << ", chosen: " << model.chosen
      << ", parameters: " << model.parameters << ", minus_2_log_l: " << model.minus_2_log_l;
  if (model.p_value) out << ", p_value: " << *model.p_value;
  out << ", bic: " << model.bic;
  if (model.held_out) out << ", held_out: " << *model.held_out;
}

void WriteFields(YamlText& out, const WeakDirection& weak) {
  out << "description: " << Quoted{weak.description} << ", advice: " << Quoted{weak.advice}
      << ", sigma: " << weak.sigma;
}

void WriteFields(YamlText& out, const LeftOutTest& test) {
  out << "sensor: " << TriadName(test.triad) << ", term: " << Quoted{test.term}
      << ", p_value: " << test.p_value << ", shown: " << test.is_shown;
  if (test.kappa) out << ", kappa: " << *test.kappa;
}

void WriteFields(YamlText& out, const TemperatureSetting& setting) {
  out << "sensor: " << TriadName(setting.triad) << ", degc: " << setting.degc
      << ", poses: " << setting.poses << ", bias: " << setting.bias_raw
      << ", bias_sigma: " << setting.bias_sigma_raw
      << ", beyond_terms: " << setting.beyond_terms_raw << ", rms_before: " << setting.rms_before
      << ", rms_after: " << setting.rms_after;
}

void WriteFields(YamlText& out, const RejectedPose& rejected) {
  out << "pose: " << rejected.pose << ", sensor: " << TriadName(rejected.triad)
      << ", reason: " << Quoted{rejected.reason};
}

void WriteFields(YamlText& out, const TurnCheck& turn) {
  out << "name: " << Quoted{turn.name} << ", axis: " << turn.axis
      << ", stated_rad: " << turn.stated_rad << ", stated_sigma_rad: " << turn.stated_sigma_rad
      << ", found_rad: " << turn.found_rad << ", found_sigma_rad: " << turn.found_sigma_rad
      << ", used: " << turn.used << ", fault: " << Quoted{turn.fault};
}

void WriteFields(YamlText& out, const ClockOffset& offset) {
  out << "sensor: " << TriadName(offset.triad) << ", later_s: " << offset.later_s
      << ", sigma_s: " << offset.sigma_s << ", moves: " << offset.moves
      << ", p_value: " << offset.p_value;
}

void WriteFields(YamlText& out, const SessionBias& session) {
  out << "session: " << session.session << ", file: " << Quoted{session.file}
      << ", sensor: " << TriadName(session.triad) << ", poses: " << session.poses
      << ", bias: " << session.bias_raw << ", sigma: " << session.sigma_raw;
}

void WriteFields(YamlText& out, const BiasRepeatability& scatter) {
  out << "sensor: " << TriadName(scatter.triad) << ", sessions: " << scatter.sessions
      << ", value: " << scatter.value_raw << ", sigma: " << scatter.sigma_raw
      << ", next_session: " << scatter.next_session_raw;
}

void WriteFields(YamlText& out, const Coverage& coverage) {
  out << "sensor: " << TriadName(coverage.triad) << ", eigenvalues: " << coverage.eigenvalues
      << ", largest_gap_deg: " << coverage.largest_gap_deg;
}

void WriteFields(YamlText& out, const LimitCheck& check) {
  out << "name: " << Quoted{check.name};
  if (!check.component.empty()) out << ", component: " << check.component;
  // One number where it says all, as before limits had two sides.
  if (check.limit.IsAboutZero()) {
    out << ", limit: " << check.limit.upper;
  } else {
    if (std::isfinite(check.limit.lower)) out << ", lower: " << check.limit.lower;
    if (check.limit.target) out << ", target: " << *check.limit.target;
    if (std::isfinite(check.limit.upper)) out << ", upper: " << check.limit.upper;
  }
  out << ", worst: " << check.worst << ", sigma: " << check.sigma << ", outside: " << check.outside
      << ", pass: " << check.pass;
  if (check.guard_band_k > 0.0) out << ", guard_band_k: " << check.guard_band_k;
}

// A list of what WriteFields writes.
template <typename T>
void WriteItems(YamlText& out, std::string_view key, const std::vector<T>& items) {
  WriteItem(out, key, items.empty());
  for (const T& item : items) {
    out << "    - { ";
    WriteFields(out, item);
    out << " }\n";
  }
}

// The same, left out where there is none.
template <typename T>
void WriteAnyItems(YamlText& out, std::string_view key, const std::vector<T>& items) {
  if (!items.empty()) WriteItems(out, key, items);
}

void ReadPoseResidual(YamlReader reader, PoseResidual* row) {
  std::vector<YamlReader> items = reader.Items();
  constexpr std::size_t kFirstNumber = 2;
  std::array<double, 10> numbers;
  if (items.size() != kFirstNumber + numbers.size()) {
    reader.Fail("has " + std::to_string(items.size()) + " entries; expected " +
                std::to_string(kFirstNumber + numbers.size()));
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
    reader.Fail("has " + std::to_string(items.size()) + " entries; expected " +
                std::to_string(1 + numbers.size()));
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

void ReadItem(YamlReader& item, WeakDirection* weak) {
  item.Require("description", &weak->description);
  item.Require("advice", &weak->advice);
  ReadNumber(item.RequireChild("sigma"), &weak->sigma);
}

void ReadItem(YamlReader& item, TemperatureSetting* setting) {
  ReadWord(item.RequireChild("sensor"), TriadFromName, &setting->triad);
  ReadNumber(item.RequireChild("degc"), &setting->degc);
  item.Require("poses", &setting->poses);
  ReadVector(item.RequireChild("bias"), &setting->bias_raw);
  ReadVector(item.RequireChild("bias_sigma"), &setting->bias_sigma_raw);
  ReadVector(item.RequireChild("beyond_terms"), &setting->beyond_terms_raw);
  ReadNumber(item.RequireChild("rms_before"), &setting->rms_before);
  ReadNumber(item.RequireChild("rms_after"), &setting->rms_after);
}

void ReadItem(YamlReader& item, RejectedPose* rejected) {
  item.Require("pose", &rejected->pose);
  ReadWord(item.RequireChild("sensor"), TriadFromName, &rejected->triad);
  item.Require("reason", &rejected->reason);
}

void ReadItem(YamlReader& item, TurnCheck* turn) {
  item.Require("name", &turn->name);
  ReadVector(item.RequireChild("axis"), &turn->axis);
  ReadNumber(item.RequireChild("stated_rad"), &turn->stated_rad);
  ReadNumber(item.RequireChild("stated_sigma_rad"), &turn->stated_sigma_rad);
  ReadNumber(item.RequireChild("found_rad"), &turn->found_rad);
  ReadNumber(item.RequireChild("found_sigma_rad"), &turn->found_sigma_rad);
  item.Require("used", &turn->used);
  item.Require("fault", &turn->fault);
}

void ReadItem(YamlReader& item, ClockOffset* offset) {
  ReadWord(item.RequireChild("sensor"), TriadFromName, &offset->triad);
  ReadNumber(item.RequireChild("later_s"), &offset->later_s);
  ReadNumber(item.RequireChild("sigma_s"), &offset->sigma_s);
  item.Require("moves", &offset->moves);
  ReadNumber(item.RequireChild("p_value"), &offset->p_value);
}

void ReadItem(YamlReader& item, LeftOutTest* test) {
  ReadWord(item.RequireChild("sensor"), TriadFromName, &test->triad);
  item.Require("term", &test->term);
  ReadNumber(item.RequireChild("p_value"), &test->p_value);
  item.Require("shown", &test->is_shown);
  if (YamlReader kappa = item.Child("kappa")) {
    ReadNumber(kappa, &test->kappa.emplace());
  }
}

void ReadItem(YamlReader& item, SessionBias* session) {
  item.Require("session", &session->session);
  item.Require("file", &session->file);
  ReadWord(item.RequireChild("sensor"), TriadFromName, &session->triad);
  item.Require("poses", &session->poses);
  ReadVector(item.RequireChild("bias"), &session->bias_raw);
  ReadVector(item.RequireChild("sigma"), &session->sigma_raw);
}

void ReadItem(YamlReader& item, BiasRepeatability* scatter) {
  ReadWord(item.RequireChild("sensor"), TriadFromName, &scatter->triad);
  item.Require("sessions", &scatter->sessions);
  ReadVector(item.RequireChild("value"), &scatter->value_raw);
  ReadVector(item.RequireChild("sigma"), &scatter->sigma_raw);
  ReadVector(item.RequireChild("next_session"), &scatter->next_session_raw);
}

void ReadItem(YamlReader& item, Coverage* coverage) {
  ReadWord(item.RequireChild("sensor"), TriadFromName, &coverage->triad);
  ReadVector(item.RequireChild("eigenvalues"), &coverage->eigenvalues);
  ReadNumber(item.RequireChild("largest_gap_deg"), &coverage->largest_gap_deg);
}

void ReadItem(YamlReader& item, LimitCheck* check) {
  item.Require("name", &check->name);
  item.Optional("component", &check->component);
  double most = 0.0;
  if (YamlReader limit = item.Child("limit")) {
    if (ReadNumber(limit, &most)) check->limit = Limit::Within(most);
  } else {
    ReadNumber(item.Child("lower"), &check->limit.lower);
    ReadNumber(item.Child("upper"), &check->limit.upper);
    double target = 0.0;
    if (ReadNumber(item.Child("target"), &target)) check->limit.target = target;
  }
  ReadNumber(item.Child("outside"), &check->outside);  // Not in files of before.
  ReadNumber(item.RequireChild("worst"), &check->worst);
  ReadNumber(item.RequireChild("sigma"), &check->sigma);
  item.Require("pass", &check->pass);
  ReadNumber(item.Child("guard_band_k"), &check->guard_band_k);
}

void ReadHeldOut(YamlReader& held_out, HeldOut* result) {
  held_out.Require("folds", &result->folds);
  ReadPerTriad(held_out.RequireChild("rms"), &result->rms);
  ReadPerTriad(held_out.Child("in_sample_rms"), &result->in_sample_rms);
  if (YamlReader turns = held_out.Child("turns")) {
    HeldOutTurns& read = result->turns.emplace();
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

// A list of what ReadItem reads.
template <typename T>
void ReadList(YamlReader list, std::vector<T>* into) {
  for (YamlReader& item : list.Items()) {
    ReadItem(item, &into->emplace_back());
    item.RejectUnknown();
  }
}

}  // namespace

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
  WriteItems(out, "weak_directions", quality.weak_directions);
  WriteAnyItems(out, "left_out_tests", quality.left_out_tests);
  if (quality.rests.held_out) {
    out << "  held_out:\n    folds: " << quality.rests.held_out->folds << "\n    rms: ";
    WritePerTriad(out, quality.rests.held_out->rms);
    out << "\n    in_sample_rms: ";
    WritePerTriad(out, quality.rests.held_out->in_sample_rms);
    out << "\n";
    if (quality.rests.held_out->turns) WriteHeldOutTurns(out, *quality.rests.held_out->turns);
  } else {
    out << "  held_out: null\n";
  }
  WriteAnyItems(out, "model_choice", quality.rests.model_choice);
  WriteAnyItems(out, "model_steps", quality.rests.model_steps);
  if (!quality.rests.temperature_settings.empty()) {
    out << "  # From the poses at one temperature: bias x y z, its sigma and its residual beyond "
           "the terms, raw unit; RMS with the calibration at the reference temperature and with "
           "the thermal terms.\n";
  }
  WriteAnyItems(out, "temperature_settings", quality.rests.temperature_settings);
  WriteItems(out, "rejected_poses", quality.rests.rejected_poses);
  WriteAnyItems(out, "turns", quality.rests.turns);
  WriteAnyItems(out, "clock_offsets", quality.rests.clock_offsets);
  if (!quality.rests.sessions.empty()) {
    out << "  # Bias x y z of each session and its sigma; of which each sensor's bias is the "
           "mean.\n";
  }
  WriteAnyItems(out, "sessions", quality.rests.sessions);
  WriteAnyItems(out, "bias_repeatability", quality.rests.repeatability);
  WriteItems(out, "coverage", quality.coverage);
  WriteItems(out, "limits", quality.limits);
  WriteSweep(out, quality);
  WritePoseResiduals(out, quality.rests.pose_residuals);
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
  ReadList(reader.RequireChild("weak_directions"), &quality->weak_directions);
  if (YamlReader held_out = reader.Child("held_out"); held_out && !IsNull(held_out)) {
    ReadHeldOut(held_out, &quality->rests.held_out.emplace());
  }
  ReadModels(reader.Child("model_choice"), &quality->rests.model_choice);
  ReadModels(reader.Child("model_steps"), &quality->rests.model_steps);
  ReadList(reader.Child("temperature_settings"), &quality->rests.temperature_settings);
  ReadList(reader.RequireChild("rejected_poses"), &quality->rests.rejected_poses);
  ReadList(reader.Child("turns"), &quality->rests.turns);
  ReadList(reader.Child("left_out_tests"), &quality->left_out_tests);
  ReadList(reader.Child("clock_offsets"), &quality->rests.clock_offsets);
  ReadList(reader.Child("sessions"), &quality->rests.sessions);
  ReadList(reader.Child("bias_repeatability"), &quality->rests.repeatability);
  ReadList(reader.Child("coverage"), &quality->coverage);
  ReadList(reader.Child("limits"), &quality->limits);
  for (const YamlReader& item : reader.Child("sweep").Items()) {
    ReadSweepAxis(item, &quality->sweep.axes.emplace_back());
  }
  for (const YamlReader& item : reader.Child("sweep_windows").Items()) {
    ReadSweepWindow(item, &quality->sweep.windows.emplace_back());
  }
  for (const YamlReader& item : reader.Child("pose_residuals").Items()) {
    ReadPoseResidual(item, &quality->rests.pose_residuals.emplace_back());
  }
  reader.RejectUnknown();
}

}  // namespace truetriad
