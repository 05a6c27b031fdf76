// SPDX-License-Identifier: Apache-2.0
#include "truetriad/model/finding.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "base/named_values.h"

namespace truetriad {
namespace {

constexpr NamedValues<Severity, 3> kSeverities = {{
    {Severity::kNote, "note"},
    {Severity::kWarning, "warning"},
    {Severity::kRefusal, "refusal"},
}};
constexpr NamedValues<Treatment, 3> kTreatments = {{
    {Treatment::kNone, "none"},
    {Treatment::kCorrected, "corrected"},
    {Treatment::kWidened, "widened"},
}};
constexpr const char* kEffect = "effect";

}  // namespace

std::string_view SeverityName(Severity severity) { return kSeverities.Name(severity); }
std::optional<Severity> SeverityFromName(std::string_view name) { return kSeverities.Find(name); }

std::string_view TreatmentName(Treatment treatment) { return kTreatments.Name(treatment); }
std::optional<Treatment> TreatmentFromName(std::string_view name) { return kTreatments.Find(name); }

std::string_view FindingCodeName(FindingCode code) { return FindingKindOf(code).name; }

std::optional<FindingCode> FindingCodeFromName(std::string_view name) {
  for (const FindingKind& kind : FindingKinds()) {
    if (kind.name == name) return kind.code;
  }
  // Older calibrations use these names for kFault.
  if (name == "magnetometer-changed" || name == "left-out-term" || name == "stretches-differ")
    return FindingCode::kFault;
  // The name of a finding in older calibrations that is made no more.
  if (name == "turn-stuck") return FindingCode::kMessage;
  return std::nullopt;
}

Finding::Finding(FindingCode c, std::string t, std::string r)
    : code(c), severity(FindingKindOf(c).severity), text(std::move(t)), remedy(std::move(r)) {
  if (remedy.empty()) remedy = FindingKindOf(c).remedy;
}

Finding& Finding::As(Severity s) {
  severity = s;
  return *this;
}

Finding& Finding::About(Triad triad) {
  sensor = triad;
  return *this;
}

Finding& Finding::About(Triad triad, int a) {
  axis = a;
  return About(triad);
}

Finding& Finding::AtPose(int number) {
  pose = number;
  return *this;
}

Finding& Finding::With(std::string name, double value, std::string unit) {
  values.push_back({std::move(name), value, std::nullopt, std::move(unit)});
  return *this;
}

Finding& Finding::With(std::string name, double value, double sigma, std::string unit) {
  values.push_back({std::move(name), value, sigma, std::move(unit)});
  return *this;
}

Finding& Finding::Shifting(double sigmas, Treatment t) {
  treatment = t;
  return With(kEffect, sigmas, "sigma");
}

bool Finding::IsLeftStanding() const {
  return treatment == Treatment::kNone && !IsRefusal() && Value(kEffect).value_or(0.0) > 1.0;
}

std::string Finding::Message() const { return remedy.empty() ? text : text + "; " + remedy; }

std::optional<double> Finding::Value(std::string_view name) const {
  for (const FindingValue& value : values) {
    if (value.name == name) return value.value;
  }
  return std::nullopt;
}

Outcome OutcomeOf(const Findings& findings) {
  const auto refusal = std::find_if(
      findings.begin(), findings.end(), [](const Finding& finding) { return finding.IsRefusal(); });
  if (refusal == findings.end()) return Outcome::kConverged;
  const Outcome outcome = FindingKindOf(refusal->code).outcome;
  // A refusal makes the result unusable, whatever its code is.
  return outcome == Outcome::kConverged ? Outcome::kNotConverged : outcome;
}

const Finding* Find(const Findings& findings, FindingCode code) {
  const auto found = std::find_if(findings.begin(), findings.end(), [code](const Finding& finding) {
    return finding.code == code;
  });
  return found == findings.end() ? nullptr : &*found;
}

const Finding* FirstRefusal(const Findings& findings) {
  const auto found = std::find_if(
      findings.begin(), findings.end(), [](const Finding& finding) { return finding.IsRefusal(); });
  return found == findings.end() ? nullptr : &*found;
}

Error NotEnoughError(Finding finding) {
  finding.severity = Severity::kRefusal;
  Error error(ErrorCode::kNotEnoughData, finding.Message());
  error.finding = std::make_shared<const Finding>(std::move(finding));
  return error;
}

std::optional<Finding> IgnoredColumns(const std::vector<std::string>& names) {
  if (names.empty()) return std::nullopt;
  std::string text;
  for (const std::string& name : names) {
    text += (text.empty() ? "" : ", ") + (name.empty() ? "(no name)" : name);
  }
  const bool has_faces = std::find(names.begin(), names.end(), "face") != names.end();
  return Finding(FindingCode::kColumnsIgnored,
                 "the column" + std::string(names.size() > 1 ? "s " : " ") + text +
                     (names.size() > 1 ? " are ignored" : " is ignored"),
                 has_faces ? "state `attitudes: { six_face: {} }`, which finds from the readings "
                             "on which face the unit stood at each rest"
                           : "");
}

Finding RefusalOf(const Error& error, FindingCode code) {
  Finding finding = error.finding ? *error.finding : Finding(code, error.message);
  finding.severity = Severity::kRefusal;
  return finding;
}

}  // namespace truetriad
