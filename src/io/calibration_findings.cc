// SPDX-License-Identifier: Apache-2.0
#include "io/calibration_findings.h"

#include <string>

#include "io/calibration_values.h"

namespace truetriad {
namespace {

void WriteFinding(YamlText& out, const Finding& finding) {
  out << "    - code: " << FindingCodeName(finding.code)
      << "\n      severity: " << SeverityName(finding.severity) << "\n";
  if (finding.sensor) out << "      sensor: " << TriadName(*finding.sensor) << "\n";
  if (finding.axis) {
    out << "      axis: " << kAxisLetters.substr(static_cast<std::size_t>(*finding.axis), 1)
        << "\n";
  }
  if (finding.pose) out << "      pose: " << *finding.pose << "\n";
  if (!finding.values.empty()) out << "      values:\n";
  for (const FindingValue& value : finding.values) {
    out << "        " << value.name << ": { value: " << value.value;
    if (value.sigma) out << ", sigma: " << *value.sigma;
    if (!value.unit.empty()) out << ", unit: " << Quoted{value.unit};
    out << " }\n";
  }
  if (finding.treatment != Treatment::kNone) {
    out << "      treatment: " << TreatmentName(finding.treatment) << "\n";
  }
  out << "      text: " << Quoted{finding.text} << "\n";
  if (!finding.remedy.empty()) out << "      remedy: " << Quoted{finding.remedy} << "\n";
}

void ReadFinding(YamlReader reader, Finding* finding) {
  ReadWord(reader.RequireChild("code"), FindingCodeFromName, &finding->code);
  ReadWord(reader.RequireChild("severity"), SeverityFromName, &finding->severity);
  if (YamlReader sensor = reader.Child("sensor")) {
    ReadWord(sensor, TriadFromName, &finding->sensor.emplace());
  }
  if (YamlReader axis = reader.Child("axis")) ReadAxis(axis, &finding->axis.emplace());
  if (YamlReader pose = reader.Child("pose")) pose.Read(&finding->pose.emplace());
  if (YamlReader values = reader.Child("values")) {
    for (const std::string& name : values.Keys()) {
      YamlReader item = values.Child(name);
      FindingValue& value = finding->values.emplace_back();
      value.name = name;
      ReadNumber(item.RequireChild("value"), &value.value);
      if (YamlReader sigma = item.Child("sigma")) ReadNumber(sigma, &value.sigma.emplace());
      item.Optional("unit", &value.unit);
      item.RejectUnknown();
    }
  }
  if (YamlReader treatment = reader.Child("treatment")) {
    ReadWord(treatment, TreatmentFromName, &finding->treatment);
  }
  reader.Require("text", &finding->text);
  reader.Optional("remedy", &finding->remedy);
  reader.RejectUnknown();
}

}  // namespace

void WriteFindings(YamlText& out, const Findings& findings) {
  WriteItem(out, "findings", findings.empty());
  for (const Finding& finding : findings) WriteFinding(out, finding);
  WriteItem(out, "messages", findings.empty());
  for (const Finding& finding : findings) out << "    - " << Quoted{finding.Message()} << "\n";
}

void ReadFindings(YamlReader* status, Outcome outcome, Findings* findings) {
  Findings messages;
  const Severity severity = outcome == Outcome::kConverged ? Severity::kNote : Severity::kRefusal;
  for (YamlReader& item : status->RequireChild("messages").Items()) {
    item.Read(&messages.emplace_back(FindingCode::kMessage, "").As(severity).text);
  }
  YamlReader listed = status->Child("findings");
  if (!listed) {
    *findings = std::move(messages);
    return;
  }
  for (const YamlReader& item : listed.Items()) ReadFinding(item, &findings->emplace_back());
}

}  // namespace truetriad
