// SPDX-License-Identifier: Apache-2.0
#include "formats/sensor_json.h"

#include <algorithm>
#include <cmath>

#include "formats/list_text.h"
#include "truetriad/model/thermal.h"

namespace truetriad {

std::string Member(std::string_view indent, std::string_view name, const std::string& value) {
  return std::string(indent) + JsonText(name) + ": " + value + ",\n";
}

std::string Object(std::string members, std::string_view indent) {
  // Members end with a comma; the last one of an object must not.
  if (!members.empty()) members.erase(members.rfind(','), 1);
  return "{\n" + members.append(indent) + "}";
}

namespace {

std::string ThermalText(const ThermalTerms& thermal) {
  constexpr std::string_view kIndent = "        ";
  std::string bias;
  for (const Eigen::Vector3d& term : thermal.bias) {
    bias += (bias.empty() ? "" : ", ") + ListText(term);
  }
  std::string sensitivity;
  for (const Eigen::Matrix3d& term : thermal.sensitivity) {
    sensitivity += (sensitivity.empty() ? "" : ", ") + RowsText(term);
  }
  std::string text = Member(kIndent, "reference_degc", NumberText(thermal.reference_degc)) +
                     Member(kIndent,
                            "range_degc",
                            "[" + NumberText(thermal.range_degc[0]) + ", " +
                                NumberText(thermal.range_degc[1]) + "]") +
                     Member(kIndent, "bias", "[" + bias + "]") +
                     Member(kIndent, "sensitivity", "[" + sensitivity + "]");
  for (const RateTermInfo& info : kRateTerms) {
    if (const auto& rate = thermal.rate[info.term]) {
      text += Member(kIndent, "rate_" + std::string(info.name()), ListText(*rate));
    }
  }
  if (thermal.element_lag_s) {
    text += Member(kIndent, "element_lag_s", ListText(*thermal.element_lag_s));
  }
  if (thermal.rate_lag_s) text += Member(kIndent, "rate_lag_s", ListText(*thermal.rate_lag_s));
  if (thermal.smoothing_s > 0.0) {
    text += Member(kIndent, "smoothing_s", NumberText(thermal.smoothing_s));
  }
  return Object(text, "      ");
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

std::string SensorMembers(const TriadCalibration& sensor) {
  constexpr std::string_view kIndent = "      ";
  std::string text = Member(kIndent, "input_unit", JsonText(sensor.input_unit)) +
                     Member(kIndent, "output_unit", JsonText(sensor.output_unit)) +
                     Member(kIndent, "bias", ListText(sensor.model.bias)) +
                     Member(kIndent, "sensitivity", RowsText(sensor.model.sensitivity)) +
                     Member(kIndent, "correction", RowsText(sensor.model.Correction())) +
                     Member(kIndent, "bias_sigma", ListText(sensor.bias_sigma)) +
                     Member(kIndent, "sensitivity_sigma", RowsText(sensor.sensitivity_sigma));
  for (const AxisTermInfo& info : kAxisTerms) {
    const auto& sigma = sensor.axis_term_sigma[info.term];
    if (!sigma) continue;
    const std::string name(info.name);
    text += Member(kIndent, name, ListText(sensor.model.axis_terms[info.term])) +
            Member(kIndent, name + "_sigma", ListText(*sigma));
  }
  if (sensor.g_sensitivity) {
    text += Member(kIndent, "g_sensitivity", RowsText(*sensor.g_sensitivity));
  }
  if (sensor.si_per_count) {
    text += Member(kIndent, "si_per_count", NumberText(*sensor.si_per_count));
  }
  if (sensor.thermal) text += Member(kIndent, "thermal", ThermalText(*sensor.thermal));
  return text;
}

std::string CovarianceText(const NamedCovariance& covariance) {
  std::string names;
  for (const std::string& name : covariance.parameters) {
    names += (names.empty() ? "" : ", ") + JsonText(name);
  }
  return Object(Member("    ", "parameters", "[" + names + "]") +
                    Member("    ", "matrix", RowsText(covariance.matrix)),
                "  ");
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

}  // namespace truetriad
