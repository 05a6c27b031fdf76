// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "model/finding_fields.h"
#include "tree/fields.h"
#include "truetriad/calibrate/evaluate.h"

namespace truetriad {

// The fields of the results of `compare` and `evaluate` (tree/fields.h).

template <class V>
void Fields(V& visit, Like<ComparisonEntry> auto& entry) {
  visit("parameter", entry.parameter);
  visit("a", entry.a);
  visit("b", entry.b);
  visit("difference", entry.difference);
  visit("sigma", entry.sigma);
}

template <class V>
void Fields(V& visit, Like<Comparison> auto& comparison) {
  const ComparisonEntry* const largest = LargestOf(comparison);
  visit("agreement", AgreementName(AgreementOf(comparison)));
  visit("chi2", comparison.chi2);
  visit("dof", comparison.dof);
  visit("p_value", comparison.p_value);
  visit("largest_in_sigmas", comparison.largest_in_sigmas);
  visit.OrNull("largest_parameter",
               largest == nullptr ? std::nullopt : std::optional(largest->parameter));
  visit("field_scale_taken_out", comparison.field_scale_taken_out);
  visit("frames_differ", comparison.frames_differ);
  visit("not_compared", comparison.not_compared);
  visit("parameters", comparison.entries);
}

template <class V>
void Fields(V& visit, Like<EvaluatedTurns> auto& turns) {
  visit("against", turns.against);
  visit("count", turns.count);
  visit("rms_rad", turns.rms_rad);
  visit("median_rad", turns.median_rad);
  visit.OrNull("nominal_rms_rad", turns.nominal_rms_rad);
  visit.OrNull("nominal_median_rad", turns.nominal_median_rad);
  visit("predicted_rms_rad", turns.predicted_rms_rad);
}

template <class V>
void Fields(V& visit, Like<EvaluationSummary> auto& evaluation) {
  visit("verdict", PredictionVerdictName(VerdictOf(evaluation)));
  visit.OrNull("worst_ratio", WorstErrorRatio(evaluation));
  visit("is_own", evaluation.is_own);
  visit("poses", evaluation.poses);
  visit("clamped_poses", evaluation.clamped_poses);
  visit("norm_rms", evaluation.norm_rms);
  visit("norm_rms_before", evaluation.norm_rms_before);
  visit("predicted_rms", evaluation.predicted_rms);
  visit("error_ratio", evaluation.error_ratio);
  visit.OrNull("angle_std_deg", evaluation.angle_std_deg);
  visit.OrNull("predicted_angle_std_deg", evaluation.predicted_angle_std_deg);
  visit.OrNull("angle_ratio", evaluation.angle_ratio);
  visit("not_tested", evaluation.not_tested);
  std::vector<Triad> about_mean;
  for (const Triad triad : kTriads) {
    if (evaluation.about_mean[triad]) about_mean.push_back(triad);
  }
  visit("about_mean", about_mean);
  visit.OrNull("turns", evaluation.turns);
}

template <class V>
void Fields(V& visit, Like<ErrorOfTwo> auto& error) {
  visit("error", error.name);
  visit("unit", error.unit);
  visit("count", error.count);
  visit("a", error.a);
  visit("b", error.b);
  visit("better", BetterName(error.better));
}

template <class V>
void Fields(V& visit, Like<SideBySide> auto& both) {
  visit("better", BetterName(BetterOf(both)));
  visit("gravity_mps2", both.gravity_mps2);
  visit.OrNull("field_ut", both.field_ut);
  visit("errors", both.errors);
  visit("a", both.a);
  visit("b", both.b);
}

}  // namespace truetriad
