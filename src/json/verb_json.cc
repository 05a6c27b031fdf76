// SPDX-License-Identifier: Apache-2.0
#include "json/verb_json.h"

#include <optional>
#include <string>

#include "allan/allan_file.h"
#include "io/pose_program_file.h"
#include "json/plain_yaml.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

template <typename T>
Json OrNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

template <typename T>
Json OfEachTriad(const PerTriad<std::optional<T>>& values) {
  Json map = Json::object();
  for (const Triad triad : kTriads) {
    if (values[triad]) map[std::string(TriadName(triad))] = *values[triad];
  }
  return map;
}

Json StreamJson(const StreamSummary& stream, bool has_time) {
  Json json = {{"sensor", TriadName(stream.triad)},
               {"unit", stream.unit.name},
               {"samples", stream.samples},
               {"dropped_rows", stream.dropped_empty}};
  if (has_time) {
    json["rate_hz"] = stream.rate_hz;
    json["jitter_s"] = stream.jitter_s;
    json["time_stamps"] = StampKindName(stream.stamps);
    json["gaps"] = stream.gaps;
    json["longest_gap_s"] = stream.longest_gap_s;
  }
  json["smallest"] = ListJson(stream.minimum_raw);
  json["largest"] = ListJson(stream.maximum_raw);
  if (stream.noise_sigma_raw.maxCoeff() > 0.0) {
    json["noise_sigma"] = ListJson(stream.noise_sigma_raw);
    json["correlation"] = ListJson(stream.correlation_inflation);
  }
  return json;
}

Json PoseJson(const StaticPose& pose, bool has_time) {
  Json json = {{"pose", pose.number}};
  if (!pose.id.empty()) json["id"] = pose.id;
  if (has_time) {
    json["start_s"] = 1e-9 * static_cast<double>(pose.start_ns);
    json["duration_s"] = pose.duration_s();
  }
  json["temperature_degc"] = OrNull(pose.temperature_degc);
  json["means"] = Json::object();
  for (const Triad triad : kTriads) {
    if (!pose.triads[triad]) continue;
    json["means"][std::string(TriadName(triad))] = {
        {"samples", pose.triads[triad]->samples}, {"mean", ListJson(pose.triads[triad]->mean_raw)}};
  }
  return json;
}

}  // namespace

Json ToJson(const Finding& finding) {
  Json json = {{"code", FindingCodeName(finding.code)},
               {"severity", SeverityName(finding.severity)}};
  if (finding.sensor) json["sensor"] = TriadName(*finding.sensor);
  if (finding.axis) {
    json["axis"] = kAxisLetters.substr(static_cast<std::size_t>(*finding.axis), 1);
  }
  if (finding.pose) json["pose"] = *finding.pose;
  for (const FindingValue& value : finding.values) {
    Json& item = json["values"][value.name];
    item["value"] = value.value;
    if (value.sigma) item["sigma"] = *value.sigma;
    if (!value.unit.empty()) item["unit"] = value.unit;
  }
  if (finding.treatment != Treatment::kNone) json["treatment"] = TreatmentName(finding.treatment);
  json["text"] = finding.text;
  if (!finding.remedy.empty()) json["remedy"] = finding.remedy;
  return json;
}

Json ToJson(const Findings& findings) {
  Json list = Json::array();
  for (const Finding& finding : findings) list.push_back(ToJson(finding));
  return list;
}

Json ToJson(const Error& error) {
  const std::string_view code =
      error.finding != nullptr ? FindingCodeName(error.finding->code) : InfoOf(error.code).name;
  Json json = {{"code", code}, {"message", error.message}};
  if (!error.place.file.empty()) json["file"] = error.place.file;
  if (error.place.line > 0) json["line"] = error.place.line;
  if (error.place.column > 0) json["column"] = error.place.column;
  if (error.finding != nullptr) json["finding"] = ToJson(*error.finding);
  return json;
}

Json ToJson(const PoseSet& poses) {
  Json json = {{"source", poses.source},
               {"serial", poses.serial},
               {"how", poses.how},
               {"duration_s", poses.has_time ? Json(poses.duration_s) : Json(nullptr)},
               {"static_share", poses.static_share}};
  json["temperature_range_degc"] =
      poses.temperature_range_degc ? ListJson(*poses.temperature_range_degc) : Json(nullptr);
  json["streams"] = Json::array();
  for (const StreamSummary& stream : poses.streams) {
    json["streams"].push_back(StreamJson(stream, poses.has_time));
  }
  json["poses"] = Json::array();
  for (const StaticPose& pose : poses.poses) {
    json["poses"].push_back(PoseJson(pose, poses.has_time));
  }
  return json;
}

Json ToJson(const Comparison& comparison) {
  const ComparisonEntry* const largest = LargestOf(comparison);
  Json json = {{"agreement", AgreementName(AgreementOf(comparison))},
               {"chi2", comparison.chi2},
               {"dof", comparison.dof},
               {"p_value", comparison.p_value},
               {"largest_in_sigmas", comparison.largest_in_sigmas},
               {"largest_parameter", largest == nullptr ? Json(nullptr) : Json(largest->parameter)},
               {"field_scale_taken_out", comparison.field_scale_taken_out},
               {"frames_differ", comparison.frames_differ},
               {"not_compared", comparison.not_compared}};
  json["parameters"] = Json::array();
  for (const ComparisonEntry& entry : comparison.entries) {
    json["parameters"].push_back({{"parameter", entry.parameter},
                                  {"a", entry.a},
                                  {"b", entry.b},
                                  {"difference", entry.difference},
                                  {"sigma", entry.sigma}});
  }
  return json;
}

Json ToJson(const EvaluationSummary& evaluation) {
  Json json = {{"verdict", PredictionVerdictName(VerdictOf(evaluation))},
               {"worst_ratio", OrNull(WorstErrorRatio(evaluation))},
               {"is_own", evaluation.is_own},
               {"poses", evaluation.poses},
               {"clamped_poses", evaluation.clamped_poses},
               {"norm_rms", OfEachTriad(evaluation.norm_rms)},
               {"norm_rms_before", OfEachTriad(evaluation.norm_rms_before)},
               {"predicted_rms", OfEachTriad(evaluation.predicted_rms)},
               {"error_ratio", OfEachTriad(evaluation.error_ratio)},
               {"angle_std_deg", OrNull(evaluation.angle_std_deg)},
               {"predicted_angle_std_deg", OrNull(evaluation.predicted_angle_std_deg)},
               {"angle_ratio", OrNull(evaluation.angle_ratio)},
               {"not_tested", Json::array()},
               {"about_mean", Json::array()},
               {"turns", nullptr}};
  for (const Triad triad : kTriads) {
    if (evaluation.about_mean[triad]) json["about_mean"].push_back(TriadName(triad));
  }
  for (const Triad triad : evaluation.not_tested) json["not_tested"].push_back(TriadName(triad));
  if (const auto& turns = evaluation.turns) {
    json["turns"] = {{"against", TriadName(turns->against)},
                     {"count", turns->count},
                     {"rms_rad", turns->rms_rad},
                     {"median_rad", turns->median_rad},
                     {"nominal_rms_rad", OrNull(turns->nominal_rms_rad)},
                     {"nominal_median_rad", OrNull(turns->nominal_median_rad)},
                     {"predicted_rms_rad", turns->predicted_rms_rad}};
  }
  return json;
}

Json ToJson(const SideBySide& both) {
  Json json = {{"better", BetterName(BetterOf(both))},
               {"gravity_mps2", both.gravity_mps2},
               {"field_ut", OrNull(both.field_ut)},
               {"errors", Json::array()},
               {"a", ToJson(both.a)},
               {"b", ToJson(both.b)}};
  for (const ErrorOfTwo& error : both.errors) {
    json["errors"].push_back({{"error", error.name},
                              {"unit", error.unit},
                              {"count", error.count},
                              {"a", error.a},
                              {"b", error.b},
                              {"better", BetterName(error.better)}});
  }
  return json;
}

Json ToJson(const Plan& plan) {
  Json json = {{"met", plan.IsMet()},
               {"determined", plan.determined},
               {"rehearsed", plan.rehearsed},
               {"measured_poses", plan.measured_poses},
               {"rest_s", plan.rest_s},
               {"program", JsonOfPlainYaml(PoseProgramToYaml(plan.program))}};
  json["sigmas"] = Json::array();
  for (const PlannedSigma& sigma : plan.sigmas) {
    json["sigmas"].push_back({{"parameter", sigma.name},
                              {"unit", sigma.unit},
                              {"before", sigma.before},
                              {"after", sigma.after}});
  }
  json["wanted"] = Json::array();
  for (const WantedSigma& wanted : plan.wanted) {
    json["wanted"].push_back({{"group", wanted.group},
                              {"wanted", wanted.wanted},
                              {"reached", wanted.reached},
                              {"met", wanted.met},
                              {"poses_needed", OrNull(wanted.poses_needed)}});
  }
  json["messages"] = plan.messages;
  return json;
}

Json ToJson(const AllanResult& result) { return JsonOfPlainYaml(AllanToYaml(result)); }

}  // namespace truetriad
