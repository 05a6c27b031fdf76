// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>
#include <utility>

#include "report/charts.h"
#include "report/content.h"
#include "report/format.h"
#include "report/page.h"
#include "report/table.h"
#include "truetriad/calibrate/compare.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace {

Headline HeadlineFor(const Comparison& comparison) {
  const Agreement agreement = AgreementOf(comparison);
  if (agreement == Agreement::kNotCompared) {
    return {
        Grade::kBad, "NOT COMPARED: the two calibrations have no common parameter with a σ", ""};
  }
  const ComparisonEntry* const largest = LargestOf(comparison);
  const std::string p = Probability(comparison.p_value);  // "0.3", "< 1e-6"
  const std::string numbers = "χ² " + Significant(comparison.chi2, 4) + " for " +
                              std::to_string(comparison.dof) + " degrees of freedom, p " +
                              (p.front() == '<' ? "" : "= ") + p + " (they agree if at least " +
                              Significant(kAgreementProbability, 1) + "); largest difference " +
                              Significant(comparison.largest_in_sigmas, 3) + " σ" +
                              (largest == nullptr ? "" : " (" + largest->parameter + ")") + ".";
  if (agreement == Agreement::kAgree) {
    const std::string where = comparison.not_compared.empty() ? "" : " in common parameters";
    return {
        Grade::kGood, "AGREE" + where + ": the differences are within their uncertainty", numbers};
  }
  return {Grade::kBad, "DIFFER: the differences are larger than their uncertainty", numbers};
}

PageContent ContentOf(const Comparison& comparison, const std::vector<std::string>& about) {
  PageContent content{"Comparison of two calibrations", HeadlineFor(comparison), {}};
  Section head;
  for (const std::string& line : about) head.Add(line);
  if (!comparison.not_compared.empty()) {
    std::string names;
    for (const std::string& name : comparison.not_compared) {
      names += (names.empty() ? "" : ", ") + name;
    }
    head.Add("NOT COMPARED: " + names + ".");
  }
  if (comparison.field_scale_taken_out) {
    head.Add(
        "The field strength was nominal in at least one of them, so the magnetometer's common "
        "scale was removed before comparing.");
  }
  if (!head.blocks.empty()) content.sections.push_back(std::move(head));
  Table table = Headed("parameter; a; b; difference a - b; in σ", "lrrrr");
  for (const ComparisonEntry& entry : comparison.entries) {
    const double size = std::abs(entry.difference) / entry.sigma;
    table.Add() << entry.parameter << Significant(entry.a, 6) << Significant(entry.b, 6)
                << WithSigma(entry.difference, entry.sigma)
                << (entry.sigma > 0.0 ? Fixed(size, 1) : "–");
  }
  if (table.rows.empty()) return content;
  content.sections.push_back(
      {"Differences",
       {std::move(table),
        comparison.frames_differ
            ? "Different sensors fix the body frames, so what no frame changes is compared: biases "
              "and C^T C (gram); the two are assumed to be independent."
            : "The body frames are aligned before comparing; the two are assumed to be "
              "independent."},
       [&comparison] { return std::vector{DifferenceDrawing(comparison.entries)}; }});
  return content;
}

}  // namespace

VerbReport ReportOf(const Comparison& comparison, const std::vector<std::string>& about) {
  return ReportOf(ContentOf(comparison, about));
}

}  // namespace truetriad
