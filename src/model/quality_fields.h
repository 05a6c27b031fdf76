// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tree/fields.h"
#include "truetriad/model/quality.h"

namespace truetriad {

// The fields of a Quality, as calibration.yaml has them (tree/fields.h).

template <class V>
void Fields(V& visit, Like<WeakDirection> auto& weak) {
  visit("description", weak.description);
  visit("advice", weak.advice);
  visit("sigma", weak.sigma);
}

template <class V>
void Fields(V& visit, Like<LeftOutTest> auto& test) {
  visit("sensor", test.triad);
  visit("term", test.term);
  visit("p_value", test.p_value);
  visit("shown", test.is_shown);
  visit("kappa", test.kappa);
}

template <class V>
void Fields(V& visit, Like<HeldOutTurns> auto& turns) {
  visit("median_rad", turns.median_rad);
  visit("in_sample_median_rad", turns.in_sample_median_rad);
  visit("nominal_median_rad", turns.nominal_median_rad);
  visit("errors_rad", turns.errors_rad);
}

template <class V>
void Fields(V& visit, Like<HeldOut> auto& held_out) {
  visit("folds", held_out.folds);
  visit("rms", held_out.rms, Style::kFlow);
  visit.If(kNewer, "in_sample_rms", held_out.in_sample_rms, Style::kFlow);
  visit("turns", held_out.turns);
}

template <class V>
void Fields(V& visit, Like<ModelAlternative> auto& model) {
  visit("model", model.description);
  visit("chosen", model.chosen);
  visit("parameters", model.parameters);
  visit("minus_2_log_l", model.minus_2_log_l);
  visit("p_value", model.p_value);
  visit("bic", model.bic);
  visit("held_out", model.held_out);
}

template <class V>
void Fields(V& visit, Like<TemperatureSetting> auto& setting) {
  visit("sensor", setting.triad);
  visit("degc", setting.degc);
  visit("poses", setting.poses);
  visit("bias", setting.bias_raw);
  visit("bias_sigma", setting.bias_sigma_raw);
  visit("beyond_terms", setting.beyond_terms_raw);
  visit("rms_before", setting.rms_before);
  visit("rms_after", setting.rms_after);
}

template <class V>
void Fields(V& visit, Like<RejectedPose> auto& rejected) {
  visit("pose", rejected.pose);
  visit("sensor", rejected.triad);
  visit("reason", rejected.reason);
}

template <class V>
void Fields(V& visit, Like<TurnCheck> auto& turn) {
  visit("name", turn.name);
  visit("axis", turn.axis);
  visit("stated_rad", turn.stated_rad);
  visit("stated_sigma_rad", turn.stated_sigma_rad);
  visit("found_rad", turn.found_rad);
  visit("found_sigma_rad", turn.found_sigma_rad);
  visit("used", turn.used);
  visit("fault", turn.fault);
}

template <class V>
void Fields(V& visit, Like<ClockOffset> auto& offset) {
  visit("sensor", offset.triad);
  visit("later_s", offset.later_s);
  visit("sigma_s", offset.sigma_s);
  visit("moves", offset.moves);
  visit("p_value", offset.p_value);
}

template <class V>
void Fields(V& visit, Like<SessionBias> auto& session) {
  visit("session", session.session);
  visit("file", session.file);
  visit("sensor", session.triad);
  visit("poses", session.poses);
  visit("bias", session.bias_raw);
  visit("sigma", session.sigma_raw);
}

template <class V>
void Fields(V& visit, Like<BiasRepeatability> auto& scatter) {
  visit("sensor", scatter.triad);
  visit("sessions", scatter.sessions);
  visit("value", scatter.value_raw);
  visit("sigma", scatter.sigma_raw);
  visit("next_session", scatter.next_session_raw);
}

template <class V>
void Fields(V& visit, Like<Coverage> auto& coverage) {
  visit("sensor", coverage.triad);
  visit("eigenvalues", coverage.eigenvalues);
  visit("largest_gap_deg", coverage.largest_gap_deg);
}

template <class V>
void Fields(V& visit, Like<LimitCheck> auto& check) {
  visit("name", check.name);
  visit.If(!check.component.empty(), "component", Word{check.component});
  // A symmetric limit is written as one number. Older files had only such limits.
  double most = check.limit.upper;
  if (visit.If(check.limit.IsAboutZero(), "limit", most)) {
    if constexpr (V::kReads) check.limit = Limit::Within(most);
  } else {
    visit.If(std::isfinite(check.limit.lower), "lower", check.limit.lower);
    visit("target", check.limit.target);
    visit.If(std::isfinite(check.limit.upper), "upper", check.limit.upper);
  }
  visit("worst", check.worst);
  visit("sigma", check.sigma);
  visit.If(kNewer, "outside", check.outside);
  visit("pass", check.pass);
  visit.If(check.guard_band_k > 0.0, "guard_band_k", check.guard_band_k);
}

template <>
inline constexpr bool kIsRow<PoseResidual> = true;
template <class V>
void Fields(V& visit, Like<PoseResidual> auto& row) {
  visit("pose", row.pose);
  visit("sensor", row.triad);
  visit("residual", row.residual);
  visit("norm_error", row.norm_error);
  visit("norm_error_before", row.norm_error_before);
  visit("normalized", row.normalized);
  visit("weight", row.weight);
  visit("direction", row.direction);
}

template <class V>
void Fields(V& visit, Like<SweepStep> auto& step) {
  visit("step", step.what);
  visit("terms", step.terms);
  visit("r2", step.r2);
  visit("adjusted_r2", step.adjusted_r2);
  visit("bic", step.bic);
  visit("held_out", step.held_out);
}

template <class V>
void Fields(V& visit, Like<RegressionStep> auto& step) {
  visit("step", step.what);
  visit("terms", step.terms);
  visit("f", step.f);
  visit("p_value", step.p_value);
  visit("r2", step.r2);
  visit("adjusted_r2", step.adjusted_r2);
  visit("bic", step.bic);
  visit("held_out", step.held_out);
}

template <class V>
void Fields(V& visit, Like<RegressionTerm> auto& term) {
  visit("term", term.name);
  visit("unit", term.unit);
  visit("chosen", term.chosen);
  visit("value", term.coefficient);
  visit("sigma", term.sigma);
  if constexpr (V::kReads) term.f = term.p_value = std::numeric_limits<double>::quiet_NaN();
  if (visit.If(std::isfinite(term.f), "f", term.f)) visit("p_value", term.p_value);
  visit.If(!term.why.empty(), "why", term.why);
}

template <class V>
void Fields(V& visit, Like<SweepRegression> auto& regression) {
  visit("factors", regression.factors);
  visit("windows", regression.windows);
  visit("enter_p", regression.enter_p);
  visit("leave_p", regression.leave_p);
  visit("rms", regression.rms);
  visit("steps", regression.steps);
  visit("terms", regression.terms);
}

template <class V>
void Fields(V& visit, Like<SweepAxis> auto& axis) {
  visit("sensor", axis.triad);
  visit("axis", AxisLetterOf{axis.axis});
  visit("chosen", axis.chosen);
  visit("noise_sigma", axis.noise_sigma);
  visit.Group("rms", Style::kFlow, [&axis](V& rms) {
    rms("before", axis.rms_before);
    rms("after", axis.rms_after);
    rms("held_out", axis.held_out);
    rms("held_out_cubic", axis.held_out_cubic);
    rms("folds", axis.folds);
  });
  visit.Group("branch_gap", Style::kFlow, [&axis](V& gap) {
    gap("before", axis.branch_gap);
    gap("after", axis.branch_gap_after);
  });
  visit("correlation", axis.correlation);
  visit.Group("element_lag_s", Style::kFlow, [&axis](V& lag) {
    lag("value", axis.element_lag_s);
    lag("sigma", axis.element_lag_sigma_s);
  });
  visit.Group("rate_lag_s", Style::kFlow, [&axis](V& lag) {
    lag("value", axis.rate_lag_s);
    lag("sigma", axis.rate_lag_sigma_s);
  });
  visit("left_out", axis.left_out);
  visit("steps", axis.steps);
  visit("regression", axis.regression);
}

template <>
inline constexpr bool kIsRow<SweepWindow> = true;
template <class V>
void Fields(V& visit, Like<SweepWindow> auto& window) {
  visit("sensor", window.triad);
  visit("time_s", window.time_s);
  visit("degc", window.degc);
  visit("rate_degcps", window.rate_degcps);
  visit("bias", window.bias_raw);
  visit("fit", window.fit_raw);
  visit("fit_sigma", window.fit_sigma_raw);
}

template <class V>
void Fields(V& visit, Like<SweepQuality> auto& sweep) {
  const bool has_axes = !sweep.axes.empty();
  visit.If(has_axes, "sweep", sweep.axes, Style::kBlocks);
  if (has_axes) {
    visit.Comment(
        "Rows: sensor, time s, temperature degC, rate degC/s, bias x y z, fit x y z, its sigma x y "
        "z.");
  }
  visit.If(has_axes, "sweep_windows", sweep.windows);
}

template <class V>
void ResidualFields(V& visit, Like<std::vector<PoseResidual>> auto& residuals) {
  // A larger table of single poses would be unreadable and most of the file.
  constexpr std::size_t kMaxPoseResiduals = 2000;
  const std::size_t rows = residuals.size();
  if (rows > kMaxPoseResiduals) {
    visit.Comment("Omitted: " + std::to_string(rows) + " rows, more than " +
                  std::to_string(kMaxPoseResiduals) + ".");
    const std::vector<PoseResidual> none;
    if constexpr (!V::kReads) visit("pose_residuals", none);
    return;
  }
  visit.Comment(
      "Rows: pose, sensor, residual x y z, norm error, norm error before, normalized, weight, "
      "direction x y z.");
  visit.If(kNewer, "pose_residuals", residuals);
}

template <class V>
void Fields(V& visit, Like<Quality> auto& quality) {
  auto& rests = quality.rests;
  visit("poses", quality.poses);
  visit("residual_rms", quality.residual_rms, Style::kFlow);
  visit.If(kNewer, "residual_rms_before", quality.residual_rms_before, Style::kFlow);
  visit("reduced_chi2", quality.reduced_chi2);
  // The key is missing if the noise was estimated from the residuals alone, and if the unit was in
  // motion.
  auto& before = quality.reduced_chi2_before;
  if constexpr (V::kReads) before = std::numeric_limits<double>::quiet_NaN();
  visit.If(std::isfinite(before), "reduced_chi2_before", before);
  visit("effective_dof", quality.effective_dof);
  visit("dof", quality.dof);
  visit("weak_directions", quality.weak_directions);
  visit.If(!quality.left_out_tests.empty(), "left_out_tests", quality.left_out_tests);
  visit.OrNull("held_out", rests.held_out);
  visit.If(!rests.model_choice.empty(), "model_choice", rests.model_choice);
  visit.If(!rests.model_steps.empty(), "model_steps", rests.model_steps);
  if (!rests.temperature_settings.empty()) {
    visit.Comment(
        "From the poses at one temperature: bias x y z, its sigma and its difference from the "
        "thermal terms, raw unit; RMS with the calibration at the reference temperature and "
        "with the thermal terms.");
  }
  visit.If(!rests.temperature_settings.empty(), "temperature_settings", rests.temperature_settings);
  visit("rejected_poses", rests.rejected_poses);
  visit.If(!rests.turns.empty(), "turns", rests.turns);
  visit.If(!rests.clock_offsets.empty(), "clock_offsets", rests.clock_offsets);
  if (!rests.sessions.empty()) {
    visit.Comment(
        "Bias x y z of each session and its sigma; a sensor's bias is their mean over its "
        "sessions.");
  }
  visit.If(!rests.sessions.empty(), "sessions", rests.sessions);
  visit.If(!rests.repeatability.empty(), "bias_repeatability", rests.repeatability);
  visit.If(kNewer, "coverage", quality.coverage);
  visit.If(kNewer, "limits", quality.limits);
  Fields(visit, quality.sweep);
  ResidualFields(visit, rests.pose_residuals);
}

}  // namespace truetriad
