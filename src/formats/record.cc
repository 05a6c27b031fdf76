// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "formats/format.h"
#include "formats/sensor_json.h"
#include "math/distributions.h"
#include "problem/parameter_name.h"
#include "report/content.h"
#include "report/format.h"
#include "report/page.h"
#include "report/table.h"
#include "tree/json.h"
#include "truetriad/base/triad.h"
#include "truetriad/formats/laboratory.h"

// The digital calibration record for the quality department: values with expanded uncertainties
// (k = 2; JCGM 100:2008, 6.2), conditions, references, traceability. JSON, or one printable page
// that carries the same JSON inside.

namespace truetriad {
namespace {

constexpr std::string_view kRecordFormat = "truetriad/record/1";
constexpr double kCoverageFactor = 2.0;  // 95 % of a normal distribution, rounded up.
constexpr std::string_view kEmbedded = "<script type=\"application/json\" id=\"record\">";

/// Probability that a value lies within k of its standard uncertainties.
double CoverageProbability(const Quality& quality) {
  const double dof =
      quality.effective_dof > 0.0 ? quality.effective_dof : std::numeric_limits<double>::infinity();
  return FisherCdf(kCoverageFactor * kCoverageFactor, 1.0, dof);
}

/// What the values rest on: each reference, its value, and how it came into the calibration.
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
         nominal       ? "nominal: gains based on it are relative"
         : sigma > 0.0 ? "known with this uncertainty, which is included in that of the results"
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
      "Values are traceable as far as their references are: gravity and field as stated above, and "
      "for angles the geometry of free rotations. ";
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

/// A sensor's block with U beside σ.
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

/// The tags that are stated.
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

/// Rows of values with expanded uncertainties, one column an axis.
class ResultRows {
 public:
  ResultRows(Triad triad, const TriadCalibration& sensor, const NamedCovariance& covariance)
      : triad_(triad),
        covariance_(covariance),
        raw_(DisplayUnit(sensor.input_unit)),
        truth_(DisplayUnit(sensor.output_unit)),
        table_(Headed(TriadTitle(triad) + "; x; y; z; unit", "lrrrl")) {
    Add("bias b", sensor.model.bias, sensor.bias_sigma, raw_);
    AddMatrix("sensitivity S",
              sensor.model.sensitivity,
              sensor.sensitivity_sigma,
              raw_ == truth_ ? "" : raw_ + " per " + truth_);
    for (const AxisTermInfo& info : kAxisTerms) {
      const auto& sigma = sensor.axis_term_sigma[info.term];
      if (!sigma) continue;
      const std::string power = info.power > 1 ? "^" + std::to_string(info.power) : "";
      Add(std::string(info.name),
          sensor.model.axis_terms[info.term],
          *sigma,
          info.power > 0 ? DisplayUnit("1/(" + raw_ + ")" + power) : "");
    }
    if (sensor.g_sensitivity) {
      AddMatrix("g-sensitivity G",
                *sensor.g_sensitivity,
                MatrixSigma(ParameterKind::kGSensitivity, 0),
                raw_ + " per m/s²");
    }
    if (sensor.thermal) AddThermal(*sensor.thermal);
  }

  const Table& table() const { return table_; }

 private:
  void Add(const std::string& label,
           const Eigen::Vector3d& values,
           const Eigen::Vector3d& sigmas,
           const std::string& unit) {
    table_.Add() << label << WithSigma(values, kCoverageFactor * sigmas) << unit;
  }
  void AddMatrix(const std::string& label,
                 const Eigen::Matrix3d& matrix,
                 const Eigen::Matrix3d& sigmas,
                 const std::string& unit) {
    for (int i = 0; i < 3; ++i)
      Add(label + " " + AxisLetter(i), matrix.row(i).transpose(), sigmas.row(i).transpose(), unit);
  }

  void AddThermal(const ThermalTerms& thermal) {
    for (std::size_t k = 0; k < thermal.bias.size(); ++k) {
      const int power = static_cast<int>(k) + 1;
      Eigen::Vector3d sigmas;
      for (int i = 0; i < 3; ++i) {
        sigmas[i] =
            covariance_.Sigma(ParameterName{triad_, ParameterKind::kBias, power, i, 0}.str());
      }
      const std::string order = std::to_string(power);
      Add("b, τ^" + order, thermal.bias[k], sigmas, raw_ + "/°C^" + order);
    }
    for (std::size_t k = 0; k < thermal.sensitivity.size(); ++k) {
      const int power = static_cast<int>(k) + 1;
      const std::string order = std::to_string(power);
      AddMatrix("S, τ^" + order,
                thermal.sensitivity[k],
                MatrixSigma(ParameterKind::kSensitivity, power),
                (raw_ == truth_ ? "1" : raw_ + " per " + truth_) + "/°C^" + order);
    }
    const auto add = [this](const std::optional<Eigen::Vector3d>& values,
                            const std::string& label,
                            const std::string& name,
                            const std::string& unit) {
      if (!values) return;
      Eigen::Vector3d sigmas;
      for (int i = 0; i < 3; ++i) {
        sigmas[i] = covariance_.Sigma(std::string(TriadName(triad_)) + ".thermal." + name + "." +
                                      AxisLetter(i));
      }
      Add(label, *values, sigmas, unit);
    };
    for (const RateTermInfo& info : kRateTerms) {
      add(thermal.rate[info.term],
          "b, " + DisplayUnit(info.words),
          std::string(info.path),
          raw_ + " " + DisplayUnit(info.unit));
    }
    add(thermal.element_lag_s, "lag of T", "element_lag", "s");
    add(thermal.rate_lag_s, "lag of dT/dt", "rate_lag", "s");
  }

  /// As the covariance lists them.
  Eigen::Matrix3d MatrixSigma(ParameterKind kind, int power) const {
    Eigen::Matrix3d sigmas;
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col) {
        sigmas(row, col) = covariance_.Sigma(ParameterName{triad_, kind, power, row, col}.str());
      }
    }
    return sigmas;
  }

  Triad triad_;
  const NamedCovariance& covariance_;
  std::string raw_, truth_;
  Table table_;
};

constexpr std::string_view kPrintStyle = R"css(
@page{size:A4;margin:12mm}
main{padding:1.2rem 1.6rem}h1{font-size:1.3rem}h2{margin:.8rem 0 .2rem;font-size:1rem}p{margin:.2rem 0;font-size:.82rem;max-width:none}
table{font-size:.78rem;margin:.2rem 0}th,td{padding:.08rem .6rem .08rem 0}.verdict{padding:.4rem .8rem;margin:.5rem 0}.verdict b{font-size:1rem}.verdict span{font-size:.85rem}
.signatures{display:flex;gap:2rem;margin-top:1.6rem}.signatures div{flex:1;border-top:1px solid var(--ink);font-size:.75rem;color:var(--soft)}
@media print{body{font-size:9.5px}.verdict{padding:.3rem .6rem}}
)css";

std::string LaboratoryHtml(const Laboratory& laboratory, const std::string& created) {
  Table table{{}, "ll", {}};
  for (const auto& key : kLaboratoryKeys) {
    const std::string& value = laboratory.*key.value;
    if (!value.empty()) table.Add() << key.key << value;
  }
  std::string html = Element("h2", "Laboratory and equipment") + HtmlOf(table);
  if (laboratory.equipment.empty()) return html;
  Table equipment{{}, std::string(kEquipmentKeys.size(), 'l'), {}};
  for (const auto& key : kEquipmentKeys) equipment.header.emplace_back(key.key);
  for (const Equipment& item : laboratory.equipment) {
    std::vector<std::string>& row = equipment.rows.emplace_back();
    for (const auto& key : kEquipmentKeys) row.push_back(item.*key.value);
    const std::optional<bool> is_overdue = IsOverdue(item, created);
    if (!is_overdue) row.back() += " (not known to be valid)";
    if (is_overdue.value_or(false)) row.back() += " (overdue)";
  }
  return html + HtmlOf(equipment);
}

std::string RecordPage(const WriteRequest& request, std::string json) {
  const Calibration& calibration = request.calibration;
  Table conditions{{}, "ll", {}};
  conditions.Add() << "poses"
                   << std::to_string(calibration.quality.poses) + ", " +
                          std::to_string(calibration.quality.rests.rejected_poses.size()) +
                          " rejected";
  conditions.Add() << "temperature" << Temperatures(calibration);
  Table references = Headed("reference; value ± U, k = 2; how known", "lll");
  for (const auto& [name, value, source] : References(calibration)) {
    references.Add() << name << value << source;
  }
  std::string body;
  for (const Decision& decision : calibration.decisions) {
    body += Element("p", "Decided: " + DecisionText(decision) + ".");
  }
  body += HtmlOf(IdentityTable(calibration));
  if (request.options.laboratory) {
    body += LaboratoryHtml(*request.options.laboratory, calibration.created);
  }
  body += Element("h2", "Conditions and references") + HtmlOf(conditions) + HtmlOf(references) +
          Element("p", Traceability(calibration)) +
          Element("h2", "Results: truth = S⁻¹ (raw − b), value ± U, k = 2");
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
    if (sensor) body += HtmlOf(ResultRows(triad, *sensor, calibration.covariance).table());
  }
  body += Element("p",
                  UncertaintyStatement(calibration) +
                      " Values without U are fixed by the gauge or by the experiment.");
  const Section limits = LimitsSection(calibration, kCoverageFactor);
  body += Element("h2", limits.title) + HtmlOf(limits.blocks);
  Table inputs = Headed("recording; SHA-256", "ll");
  for (const InputFile& input : calibration.inputs) inputs.Add() << input.file << input.sha256;
  body += Element("h2", "Recordings") + HtmlOf(inputs);
  body +=
      "<div class=\"signatures\"><div>Date</div><div>Calibrated by</div><div>Approved "
      "by</div></div>\n";
  // Nothing in the data may end the element.
  for (std::size_t at = json.find('<'); at != std::string::npos; at = json.find('<', at)) {
    json.replace(at, 1, "\\u003c");
  }
  body += std::string(kEmbedded) + "\n" + json + "</script>\n";
  return HtmlPage("Calibration record " + calibration.serial,
                  HeadlineOf(calibration),
                  body,
                  {.style = kPrintStyle});
}

bool IsPage(std::string_view name) { return name.ends_with(".html") || name.ends_with(".htm"); }

Result<std::vector<ExportedFile>> WriteRecord(const WriteRequest& request,
                                              std::vector<std::string>* warnings) {
  if (const std::optional<Laboratory>& laboratory = request.options.laboratory) {
    for (const Equipment& equipment : laboratory->equipment) {
      const std::string& created = request.calibration.created;
      const std::string name = "`" + equipment.name + "`";
      const std::optional<bool> is_overdue = IsOverdue(equipment, created);
      if (!is_overdue) {
        warnings->push_back(
            name + " is not known to have been valid: " +
            (created.empty() ? "this calibration has no date" : "it has no `due:` date") +
            "; the record says so");
      } else if (*is_overdue) {
        warnings->push_back(name + " was due for calibration on " + equipment.due +
                            ", before this calibration; the record says so");
      }
      if (!created.empty() && equipment.calibrated > created.substr(0, 10)) {
        warnings->push_back(name + " was calibrated on " + equipment.calibrated +
                            ", after this calibration");
      }
    }
  }
  std::string json = TextOf(RecordJson(request));
  if (IsPage(request.options.file_name)) json = RecordPage(request, std::move(json));
  return std::vector<ExportedFile>{{"", std::move(json)}};
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
