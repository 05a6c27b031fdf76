// SPDX-License-Identifier: Apache-2.0
#include "formats/sensor_json.h"

#include <algorithm>
#include <cmath>

#include "formats/list_text.h"
#include "truetriad/model/thermal.h"

namespace truetriad {

namespace {

Json ThermalJson(const ThermalTerms& thermal) {
  Json json = {{"reference_degc", thermal.reference_degc},
               {"range_degc", ListJson(thermal.range_degc)},
               {"bias", Json::array()},
               {"sensitivity", Json::array()}};
  for (const Eigen::Vector3d& term : thermal.bias) json["bias"].push_back(ListJson(term));
  for (const Eigen::Matrix3d& term : thermal.sensitivity) {
    json["sensitivity"].push_back(RowsJson(term));
  }
  for (const RateTermInfo& info : kRateTerms) {
    const auto& rate = thermal.rate[info.term];
    if (rate) json["rate_" + std::string(info.name())] = ListJson(*rate);
  }
  if (thermal.element_lag_s) json["element_lag_s"] = ListJson(*thermal.element_lag_s);
  if (thermal.rate_lag_s) json["rate_lag_s"] = ListJson(*thermal.rate_lag_s);
  if (thermal.smoothing_s > 0.0) json["smoothing_s"] = thermal.smoothing_s;
  return json;
}

/// What a consumer needs of a sensor's block.
TriadCalibration ReadSensor(YamlReader* sensor) {
  TriadCalibration read;
  const std::vector<double> bias = ReadList(sensor->RequireChild("bias"), 3);
  if (!bias.empty()) read.model.bias = Eigen::Map<const Eigen::Vector3d>(bias.data());
  read.model.sensitivity = ReadRows(sensor->RequireChild("sensitivity"));
  for (const AxisTermInfo& info : kAxisTerms) {
    YamlReader term = sensor->Child(info.name);
    if (!term) continue;
    const std::vector<double> numbers = ReadList(term, 3);
    if (numbers.empty()) continue;
    read.model.axis_terms[info.term] = Eigen::Map<const Eigen::Vector3d>(numbers.data());
  }
  if (YamlReader G = sensor->Child("g_sensitivity")) read.g_sensitivity = ReadRows(G);
  if (YamlReader block = sensor->Child("thermal")) {
    ThermalTerms& thermal = read.thermal.emplace();
    block.Require("reference_degc", &thermal.reference_degc);
    const std::vector<double> range = ReadList(block.RequireChild("range_degc"), 2);
    if (!range.empty()) thermal.range_degc = {range[0], range[1]};
    for (YamlReader& item : block.RequireChild("bias").Items()) {
      const std::vector<double> term = ReadList(item, 3);
      if (!term.empty()) thermal.bias.emplace_back(term[0], term[1], term[2]);
    }
    for (YamlReader& item : block.RequireChild("sensitivity").Items()) {
      thermal.sensitivity.push_back(ReadRows(item));
    }
  }
  return read;
}

}  // namespace

Json SensorJson(const TriadCalibration& sensor) {
  Json json = {{"input_unit", sensor.input_unit},
               {"output_unit", sensor.output_unit},
               {"bias", ListJson(sensor.model.bias)},
               {"sensitivity", RowsJson(sensor.model.sensitivity)},
               {"correction", RowsJson(sensor.model.Correction())},
               {"bias_sigma", ListJson(sensor.bias_sigma)},
               {"sensitivity_sigma", RowsJson(sensor.sensitivity_sigma)}};
  for (const AxisTermInfo& info : kAxisTerms) {
    const auto& sigma = sensor.axis_term_sigma[info.term];
    if (!sigma) continue;
    const std::string name(info.name);
    json[name] = ListJson(sensor.model.axis_terms[info.term]);
    json[name + "_sigma"] = ListJson(*sigma);
  }
  if (sensor.g_sensitivity) json["g_sensitivity"] = RowsJson(*sensor.g_sensitivity);
  if (sensor.si_per_count) json["si_per_count"] = *sensor.si_per_count;
  if (sensor.thermal) json["thermal"] = ThermalJson(*sensor.thermal);
  return json;
}

Json CovarianceJson(const NamedCovariance& covariance) {
  return {{"parameters", covariance.parameters}, {"matrix", RowsJson(covariance.matrix)}};
}

Result<Carried> ReadSensorsJson(const std::string& text, const std::string& name) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root, YamlReader::FromText(text, name));
  YamlReader sensors = root.RequireChild("sensors");
  Carried carried;
  for (const Triad triad : kTriads) {
    YamlReader block = sensors.Child(TriadName(triad));
    if (!block) continue;
    const TriadCalibration sensor = ReadSensor(&block);
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

namespace {

// Everything that calibration.yaml says of the sensors, in JSON, in the calibration's units.
constexpr std::string_view kExportFormat = "truetriad/export/1";

Result<std::vector<ExportedFile>> WriteJsonExport(const WriteRequest& request,
                                                  std::vector<std::string>* /*warnings*/) {
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
  return std::vector<ExportedFile>{{"", TextOf(json)}};
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

}  // namespace truetriad
