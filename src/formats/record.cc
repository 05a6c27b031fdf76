// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "formats/format.h"
#include "io/yaml_fields.h"
#include "math/distributions.h"
#include "report/content.h"
#include "report/page.h"
#include "report/table.h"
#include "tree/json.h"
#include "tree/to_tree.h"
#include "truetriad/base/triad.h"
#include "truetriad/formats/export.h"
#include "truetriad/model/calibration.h"

// Two formats of our own. "json" holds every term of a calibration. "record" is the calibration
// record for the quality department: values with expanded uncertainties (k = 2; JCGM 100:2008,
// 6.2), conditions, references, traceability. It is JSON, or one printable page with the same JSON
// inside.

namespace truetriad {
namespace {

constexpr int kAnyOrder = 99;  // More than the degree of any model.
constexpr TriadCapacity kHoldsAll = {.held = true,
                                     .bias_order = kAnyOrder,
                                     .matrix_thermal = true,
                                     .rate_thermal = true,
                                     .g_sensitivity = true,
                                     .axis_terms = true};

/// The temperature terms as these files state them: each term in the temperature rate has a name of
/// its own.
struct ThermalBlock {
  ThermalTerms terms;
};

template <class V>
void Fields(V& visit, Like<ThermalBlock> auto& block) {
  auto& terms = block.terms;
  visit("reference_degc", terms.reference_degc);
  visit("range_degc", terms.range_degc);
  visit("bias", terms.bias);
  visit("sensitivity", terms.sensitivity);
  for (const RateTermInfo& info : kRateTerms)
    visit("rate_" + std::string(info.name()), terms.rate[info.term]);
  visit("element_lag_s", terms.element_lag_s);
  visit("rate_lag_s", terms.rate_lag_s);
  visit.If(terms.smoothing_s > 0.0, "smoothing_s", terms.smoothing_s);
}

/// The fields of a sensor's block.
template <class V>
void SensorFields(V& visit, Like<TriadCalibration> auto& sensor) {
  visit("input_unit", sensor.input_unit);
  visit("output_unit", sensor.output_unit);
  visit("bias", sensor.model.bias);
  visit("sensitivity", sensor.model.sensitivity);
  Eigen::Matrix3d correction = sensor.model.Correction();
  visit("correction", correction);
  // A reader of the file only applies the correction, for which it does not need σ; σ may be
  // infinite.
  if constexpr (!V::kReads) {
    visit("bias_sigma", sensor.bias_sigma);
    visit("sensitivity_sigma", sensor.sensitivity_sigma);
  }
  for (const AxisTermInfo& info : kAxisTerms) {
    auto& sigma = sensor.axis_term_sigma[info.term];
    visit.If(sigma.has_value(), info.name, sensor.model.axis_terms[info.term]);
    if constexpr (!V::kReads) visit(std::string(info.name) + "_sigma", sigma);
  }
  visit("g_sensitivity", sensor.g_sensitivity);
  visit("si_per_count", sensor.si_per_count);
  std::optional<ThermalBlock> thermal;
  if (sensor.thermal) thermal.emplace(*sensor.thermal);
  visit("thermal", thermal);
  if constexpr (V::kReads) {
    if (thermal) sensor.thermal = thermal->terms;
  }
}

/// Units, bias, sensitivity, correction, σ and all other terms of a sensor.
Json SensorJson(const TriadCalibration& sensor) {
  TreeWriter fields(Json::object());
  SensorFields(fields, sensor);
  return fields.Take();
}

Json CovarianceJson(const NamedCovariance& covariance) {
  return {{"parameters", covariance.parameters}, {"matrix", RowsJson(covariance.matrix)}};
}

/// Reads the member `sensors` of a file. Its equation is
///
///   truth = C(T) u(raw - b(T) - G force),  C = S^-1,  T clamped to range_degc
///
/// with u of triad_model.h; without axis terms, u(x) = x.
Result<Carried> ReadSensorsJson(const std::string& text, const std::string& name) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root, YamlReader::FromText(text, name));
  YamlReader sensors = root.RequireChild("sensors");
  Carried carried;
  for (const Triad triad : kTriads) {
    YamlReader block = sensors.Child(TriadName(triad));
    if (!block) continue;
    TriadCalibration sensor;
    YamlFieldReader fields(block);
    SensorFields(fields, sensor);
    carried.equations[triad] = [sensor](const Eigen::Vector3d& reading,
                                        const Eigen::Vector3d& force_mps2,
                                        double temperature_degc) -> Eigen::Vector3d {
      TriadModel<double> model = sensor.model;
      if (sensor.thermal) {
        const Eigen::Vector2d& range = sensor.thermal->range_degc;
        model = ModelAtTemperature(
            model, *sensor.thermal, std::clamp(temperature_degc, range[0], range[1]));
      }
      Eigen::Vector3d raw = reading;
      if (sensor.g_sensitivity) raw -= *sensor.g_sensitivity * force_mps2;
      return model.TruthFromRaw(raw);
    };
  }
  TRUETRIAD_RETURN_IF_ERROR(root.status());
  return carried;
}

// The name of the JSON format, which holds all that calibration.yaml states about the sensors, in
// the calibration's units.
constexpr std::string_view kExportFormat = "truetriad/export/1";

Result<Files> WriteJsonExport(const WriteRequest& request) {
  const Calibration& calibration = request.calibration;
  Json json = {{"format", kExportFormat},
               {"comment", request.comment},
               {"serial", calibration.serial},
               {"model", calibration.model},
               {"created", calibration.created},
               {"gauge", GaugeName(calibration.gauge)},
               {"gauge_sensor", TriadName(calibration.gauge_sensor)},
               {"gravity_mps2", calibration.reference.gravity_mps2},
               {"temperature_degc", calibration.reference.temperature_degc},
               {"sensors", Json::object()}};
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
    if (sensor) json["sensors"][std::string(TriadName(triad))] = SensorJson(*sensor);
  }
  json["covariance"] = CovarianceJson(calibration.covariance);
  return Files{{"", TextOf(json)}};
}

constexpr std::string_view kRecordFormat = "truetriad/record/1";
constexpr double kCoverageFactor = 2.0;  // Covers 95.4 % of a normal distribution.
constexpr std::string_view kEmbedded = "<script type=\"application/json\" id=\"record\">";

/// Probability that the true value lies within k standard uncertainties of the stated one.
double CoverageProbability(const Quality& quality) {
  const double dof =
      quality.effective_dof > 0.0 ? quality.effective_dof : std::numeric_limits<double>::infinity();
  return FisherCdf(kCoverageFactor * kCoverageFactor, 1.0, dof);
}

/// A reference of the calibration: its name, its value and its source.
struct Reference {
  std::string name, value, source;
};

std::vector<Reference> References(const Calibration& calibration) {
  const ReferenceValues& reference = calibration.reference;
  std::vector<Reference> references;
  const auto add = [&](const std::string& name,
                       const std::string& parameter,
                       double value,
                       const std::string& unit,
                       bool nominal) {
    const double sigma = calibration.covariance.Sigma(parameter);
    references.push_back(
        {name,
         (sigma > 0.0 ? WithSigma(value, kCoverageFactor * sigma) : Significant(value, 7)) + " " +
             unit,
         nominal ? "nominal value, not measured: the gains are known only relative to it"
         : sigma > 0.0
             ? "known with this uncertainty, which the uncertainties of the results include"
             : "stated in the experiment, assumed exact"});
  };
  add("gravity", "reference.gravity_mps2", reference.gravity_mps2, "m/s²", false);
  if (reference.field_ut) {
    add("field strength", "reference.field_ut", *reference.field_ut, "µT", reference.field_nominal);
  }
  return references;
}

std::string Temperatures(const Calibration& calibration) {
  std::string text;
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
    if (!sensor || !sensor->thermal) continue;
    const ThermalTerms& thermal = *sensor->thermal;
    text += (text.empty() ? "" : "; ") + std::string(TriadName(triad)) + " " +
            Significant(thermal.range_degc[0], 4) + " to " + Significant(thermal.range_degc[1], 4) +
            " °C, values at " + Significant(thermal.reference_degc, 4) + " °C";
  }
  if (!text.empty()) return text;
  const std::optional<Eigen::Vector3d>& recorded = calibration.reference.recorded_degc;
  text = recorded ? Significant(recorded->x(), 4) + " to " + Significant(recorded->z(), 4) +
                        " °C; no temperature terms"
                  : "not recorded; no temperature terms";
  return text;
}

std::string Traceability(const Calibration& calibration) {
  std::string text =
      "Values are as traceable as their references: gravity and field as stated above; angles "
      "follow from the geometry of rotations alone. ";
  if (calibration.reference.field_nominal) {
    text += "The field strength was unknown, so the magnetometer's gains are relative. ";
  }
  return text +
         "The recordings are identified by their SHA-256; the covariance of all values and the "
         "resolved experiment are part of the calibration file that this record was made from.";
}

std::string UncertaintyStatement(const Calibration& calibration) {
  std::string text =
      "U: expanded uncertainty, k = 2, standard uncertainties from the posterior "
      "covariance of the adjustment (JCGM 100:2008)";
  const double dof = calibration.quality.effective_dof;
  if (dof > 0.0 && std::isfinite(dof)) {
    text += "; effective degrees of freedom " + Significant(dof, 3);
  }
  return text + ": coverage probability " + Percent(CoverageProbability(calibration.quality)) + ".";
}

// ------------------------------------------------------------------------------------------- JSON

/// A sensor's block with the expanded uncertainty U beside each σ.
Json SensorRecord(const TriadCalibration& sensor, const std::optional<double>& residual_rms) {
  Json json = SensorJson(sensor);
  const auto add = [&](std::string_view name, Json values) {
    json[std::string(name) + "_expanded_uncertainty"] = std::move(values);
  };
  add("bias", ListJson(kCoverageFactor * sensor.bias_sigma));
  add("sensitivity", RowsJson(kCoverageFactor * sensor.sensitivity_sigma));
  for (const AxisTermInfo& info : kAxisTerms) {
    if (const auto& sigma = sensor.axis_term_sigma[info.term]) {
      add(info.name, ListJson(kCoverageFactor * *sigma));
    }
  }
  if (residual_rms) json["residual_rms"] = *residual_rms;
  return json;
}

/// Adds each of the tags named by `keys` that the calibration states.
void AddTags(std::span<const TagKey> keys, const Tags& tags, Json* json) {
  for (const TagKey& tag : keys) {
    if (!(tags.*tag.value).empty()) (*json)[std::string(tag.key)] = tags.*tag.value;
  }
}

template <typename Of, std::size_t kCount>
Json StatedJson(const Of& of, const std::array<LaboratoryKey<Of>, kCount>& keys) {
  Json json = Json::object();
  for (const LaboratoryKey<Of>& key : keys) {
    if (!(of.*key.value).empty()) json[std::string(key.key)] = of.*key.value;
  }
  return json;
}

Json LimitJson(const LimitCheck& check) {
  return {{"name", check.name},
          {"component", check.component},
          {"lower", check.limit.lower},
          {"upper", check.limit.upper},
          {"worst", check.worst},
          {"expanded_uncertainty", kCoverageFactor * check.sigma},
          {"probability_outside", check.outside},
          {"pass", check.pass}};
}

Json RecordJson(const WriteRequest& request) {
  const Calibration& calibration = request.calibration;
  const Quality& quality = calibration.quality;
  Json json = {{"format", kRecordFormat},
               {"verdict", VerdictName(calibration.verdict())},
               {"comment", request.comment},
               {"device", {{"serial", calibration.serial}, {"model", calibration.model}}}};
  AddTags(kDeviceTags, calibration.tags, &json["device"]);
  Json run = Json::object();
  AddTags(kRunTags, calibration.tags, &run);
  if (!run.empty()) json["run"] = std::move(run);
  if (const std::optional<Laboratory>& laboratory = request.options.laboratory) {
    json["laboratory"] = StatedJson(*laboratory, kLaboratoryKeys);
    json["equipment"] = Json::array();
    for (const Equipment& equipment : laboratory->equipment) {
      Json& item = json["equipment"].emplace_back(StatedJson(equipment, kEquipmentKeys));
      const std::optional<bool> is_overdue = IsOverdue(equipment, calibration.created);
      item["overdue"] = is_overdue ? Json(*is_overdue) : Json(nullptr);
    }
  }
  json["decisions"] = Json::array();
  for (const Decision& decision : calibration.decisions) {
    json["decisions"].push_back({{"verdict", VerdictName(decision.verdict)},
                                 {"who", decision.who},
                                 {"why", decision.why},
                                 {"created", decision.created}});
  }
  json["calibrated"] = calibration.created;
  json["software"] = "truetriad " + calibration.software_version;
  json["conditions"] = {{"poses", quality.poses},
                        {"rejected_poses", quality.rests.rejected_poses.size()},
                        {"temperature", Temperatures(calibration)},
                        {"gauge", GaugeName(calibration.gauge)},
                        {"gauge_sensor", TriadName(calibration.gauge_sensor)}};
  for (const Reference& reference : References(calibration)) {
    json["references"][reference.name] = {{"value", reference.value}, {"source", reference.source}};
  }
  json["traceability"] = Traceability(calibration);
  json["inputs"] = Json::array();
  for (const InputFile& input : calibration.inputs) {
    json["inputs"].push_back({{"file", input.file}, {"sha256", input.sha256}});
  }
  json["uncertainty"] = {{"coverage_factor", kCoverageFactor},
                         {"coverage_probability", CoverageProbability(quality)},
                         {"effective_dof", quality.effective_dof},
                         {"statement", UncertaintyStatement(calibration)}};
  json["sensors"] = Json::object();
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
    if (!sensor) continue;
    json["sensors"][std::string(TriadName(triad))] =
        SensorRecord(*sensor, quality.residual_rms[triad]);
  }
  json["limits"] = Json::array();
  for (const LimitCheck& check : quality.limits) json["limits"].push_back(LimitJson(check));
  json["covariance"] = CovarianceJson(calibration.covariance);
  return json;
}

// ------------------------------------------------------------------------------------------- page

constexpr std::string_view kPrintStyle = R"css(
@page{size:A4;margin:12mm}
main{padding:1.2rem 1.6rem}h1{font-size:1.3rem}h2{margin:.8rem 0 .2rem;font-size:1rem}p{margin:.2rem 0;font-size:.82rem;max-width:none}
table{font-size:.78rem;margin:.2rem 0}th,td{padding:.08rem .6rem .08rem 0}.verdict{padding:.4rem .8rem;margin:.5rem 0}.verdict b{font-size:1rem}.verdict span{font-size:.85rem}
.signatures{display:flex;gap:2rem;margin-top:1.6rem}.signatures div{flex:1;border-top:1px solid var(--ink);font-size:.75rem;color:var(--soft)}
@media print{body{font-size:9.5px}.verdict{padding:.3rem .6rem}}
)css";

Section LaboratorySection(const Laboratory& laboratory, const std::string& created) {
  Table table{{}, "ll", {}};
  for (const auto& key : kLaboratoryKeys) {
    const std::string& value = laboratory.*key.value;
    if (!value.empty()) table.Add() << key.key << value;
  }
  Table equipment{{}, std::string(kEquipmentKeys.size(), 'l'), {}};
  for (const auto& key : kEquipmentKeys) equipment.header.emplace_back(key.key);
  for (const Equipment& item : laboratory.equipment) {
    TableRow row = equipment.Add();
    for (const auto& key : kEquipmentKeys) row << item.*key.value;
    const std::optional<bool> is_overdue = IsOverdue(item, created);
    if (!is_overdue) equipment.rows.back().back() += " (not known to be valid)";
    if (is_overdue.value_or(false)) equipment.rows.back().back() += " (overdue)";
  }
  return {"Laboratory and equipment", {std::move(table), std::move(equipment)}};
}

std::vector<Section> RecordSections(const WriteRequest& request) {
  const Calibration& calibration = request.calibration;
  std::vector<Section> sections(1);
  for (const Decision& decision : calibration.decisions)
    sections[0].Add("Decided: " + DecisionText(decision) + ".");
  sections[0].Add(IdentityTable(calibration));
  if (request.options.laboratory)
    sections.push_back(LaboratorySection(*request.options.laboratory, calibration.created));
  const Quality& quality = calibration.quality;
  Table conditions{{}, "ll", {}};
  conditions.Add() << "poses"
                   << std::to_string(quality.poses) + ", " +
                          std::to_string(quality.rests.rejected_poses.size()) + " rejected";
  conditions.Add() << "temperature" << Temperatures(calibration);
  Table references = Headed("reference; value ± U, k = 2; how known", "lll");
  for (const auto& [name, value, source] : References(calibration))
    references.Add() << name << value << source;
  sections.push_back({"Conditions and references",
                      {std::move(conditions), std::move(references), Traceability(calibration)}});
  Section results{"Results: truth = S⁻¹ (raw − b), value ± U, k = 2", {}};
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
    if (sensor) results.Add(ResultTable(*sensor, triad, calibration.covariance, kCoverageFactor));
  }
  results.Add(UncertaintyStatement(calibration) +
              " Values without U are fixed by the frame convention or by the experiment.");
  sections.push_back(std::move(results));
  Section& limits = sections.emplace_back(LimitsSection(calibration, kCoverageFactor));
  limits.draw = {};
  Table inputs = Headed("recording; SHA-256", "ll");
  for (const InputFile& input : calibration.inputs) inputs.Add() << input.file << input.sha256;
  sections.push_back({"Recordings", {std::move(inputs)}});
  return sections;
}

std::string RecordPage(const WriteRequest& request, std::string json) {
  // `<` is escaped, so that no text in the data ends the script element.
  for (std::size_t at = json.find('<'); at != std::string::npos; at = json.find('<', at)) {
    json.replace(at, 1, "\\u003c");
  }
  return HtmlPage("Calibration record " + request.calibration.serial,
                  HeadlineOf(request.calibration),
                  HtmlOf(RecordSections(request)) +
                      "<div class=\"signatures\"><div>Date</div><div>Calibrated by</div>"
                      "<div>Approved by</div></div>\n" +
                      std::string(kEmbedded) + "\n" + json + "</script>\n",
                  {.style = kPrintStyle});
}

bool IsPage(std::string_view name) { return name.ends_with(".html") || name.ends_with(".htm"); }

Result<Files> WriteRecord(const WriteRequest& request) {
  if (const std::optional<Laboratory>& laboratory = request.options.laboratory) {
    for (const Equipment& equipment : laboratory->equipment) {
      const std::string& created = request.calibration.created;
      const std::string name = "`" + equipment.name + "`";
      const std::optional<bool> is_overdue = IsOverdue(equipment, created);
      if (!is_overdue) {
        request.warnings.push_back(name + ": its own calibration may have expired: " +
                                   (created.empty() ? "the calibration in this record has no date"
                                                    : "it has no `due:` date") +
                                   "; the record states this");
      } else if (*is_overdue) {
        request.warnings.push_back(name + " was due for calibration on " + equipment.due +
                                   ", before this calibration was made; the record states this");
      }
      if (!created.empty() && equipment.calibrated > created.substr(0, 10)) {
        request.warnings.push_back(name + " was calibrated on " + equipment.calibrated +
                                   ", after this calibration was made; check the date");
      }
    }
  }
  std::string json = TextOf(RecordJson(request));
  if (IsPage(request.options.file_name)) json = RecordPage(request, std::move(json));
  return Files{{"", std::move(json)}};
}

Result<Carried> ReadRecord(const ReadRequest& request) {
  const ExportedFile& file = request.files[0];
  const std::size_t embedded = file.text.find(kEmbedded);
  if (embedded == std::string::npos) return ReadSensorsJson(file.text, file.suffix);
  const std::size_t begin = embedded + kEmbedded.size();
  return ReadSensorsJson(file.text.substr(begin, file.text.find("</script>", begin) - begin),
                         file.suffix);
}

}  // namespace

Format JsonFormat() {
  return {.info = {"json", "everything, as JSON", "export.json", Arithmetic::kFloat64},
          .capacity = {{kHoldsAll, kHoldsAll, kHoldsAll}},
          .write = WriteJsonExport,
          .read = [](const ReadRequest& request) {
            return ReadSensorsJson(request.files[0].text, request.files[0].suffix);
          }};
}

Format RecordFormat() {
  return {.info = {"record",
                   "calibration record with uncertainties, .html page or JSON",
                   "record.html",
                   Arithmetic::kFloat64,
                   /*can_import=*/false},
          .capacity = {{kHoldsAll, kHoldsAll, kHoldsAll}},
          .write = WriteRecord,
          .read = ReadRecord};
}

}  // namespace truetriad
