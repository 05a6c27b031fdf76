// SPDX-License-Identifier: Apache-2.0
#include "formats/format.h"
#include "formats/sensor_json.h"

// Everything that calibration.yaml says of the sensors, in JSON, in the calibration's units.

namespace truetriad {
namespace {

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
