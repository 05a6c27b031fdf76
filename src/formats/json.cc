// SPDX-License-Identifier: Apache-2.0
#include "formats/format.h"
#include "formats/sensor_json.h"

// Everything that calibration.yaml says of the sensors, in JSON, in the calibration's units.

namespace truetriad {
namespace {

constexpr std::string_view kExportFormat = "truetriad/export/1";
constexpr int kAnyJsonOrder = 99;  // More than any model has.

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

Result<Carried> ReadJsonExport(const ReadRequest& request) {
  return ReadSensorsJson(request.files[0].text, request.files[0].suffix);
}

}  // namespace

Format JsonFormat() {
  Format format;
  format.info = {"json", "everything, as JSON", "export.json", Arithmetic::kFloat64};
  for (const Triad triad : kTriads) {
    format.capacity[triad] = {.held = true,
                              .bias_order = kAnyJsonOrder,
                              .matrix_thermal = true,
                              .rate_thermal = true,
                              .g_sensitivity = true,
                              .axis_terms = true};
  }
  format.write = WriteJsonExport;
  format.read = ReadJsonExport;
  return format;
}

}  // namespace truetriad
