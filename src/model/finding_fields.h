// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "tree/fields.h"
#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/finding.h"

namespace truetriad {

// The fields of findings and errors (tree/fields.h), in every file and output.

// WordsOf(a value): the function from a value to its name in files, and its inverse.
inline auto WordsOf(Triad) { return std::pair(&TriadName, &TriadFromName); }
inline auto WordsOf(FindingCode) { return std::pair(&FindingCodeName, &FindingCodeFromName); }
inline auto WordsOf(Severity) { return std::pair(&SeverityName, &SeverityFromName); }
inline auto WordsOf(Treatment) { return std::pair(&TreatmentName, &TreatmentFromName); }

template <class V>
void Fields(V& visit, Like<FindingValue> auto& value) {
  visit("value", value.value);
  visit("sigma", value.sigma);
  visit.If(!value.unit.empty(), "unit", value.unit);
}

template <class V>
void Fields(V& visit, Like<Finding> auto& finding) {
  visit("code", finding.code);
  visit("severity", finding.severity);
  visit("sensor", finding.sensor);
  int axis = finding.axis.value_or(0);
  const bool has_axis = visit.If(finding.axis.has_value(), "axis", AxisLetterOf{axis});
  if constexpr (V::kReads) {
    if (has_axis) finding.axis = axis;
  }
  visit("pose", finding.pose);
  visit.Named(!finding.values.empty(), "values", finding.values);
  visit.If(finding.treatment != Treatment::kNone, "treatment", finding.treatment);
  visit("text", finding.text);
  visit.If(!finding.remedy.empty(), "remedy", finding.remedy);
}

/// Code, message and, if it is known, the place in a file.
template <class V>
void Fields(V& visit, Like<Error> auto& error) {
  visit("code",
        error.finding != nullptr ? FindingCodeName(error.finding->code) : InfoOf(error.code).name);
  visit("message", error.message);
  visit.If(!error.place.file.empty(), "file", error.place.file);
  visit.If(error.place.line > 0, "line", error.place.line);
  visit.If(error.place.column > 0, "column", error.place.column);
  if (error.finding != nullptr) visit("finding", *error.finding);
}

}  // namespace truetriad
