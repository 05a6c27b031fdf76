// SPDX-License-Identifier: Apache-2.0
#include "formats/format.h"
#include "formats/list_text.h"
#include "formats/sensor_json.h"

// Everything that calibration.yaml says of the sensors, in JSON, in the calibration's units.

namespace truetriad {
namespace {

constexpr std::string_view kExportFormat = "truetriad/export/1";
constexpr int kAnyJsonOrder = 99;

Result<std::vector<ExportedFile>> WriteJsonExport(const WriteRequest& request,
                                                  std::vector<std::string>* /*warnings*/) {
  const Calibration& calibration = request.calibration;
  std::string sensors;
  for (const Triad triad : kTriads) {
    if (!calibration.sensors[triad]) continue;
    sensors += Member(
        "    ", TriadName(triad), Object(SensorMembers(*calibration.sensors[triad]), "    "));
  }
  const std::string text =
      Member("  ", "format", JsonText(kExportFormat)) +
      Member("  ", "comment", JsonText(request.comment)) +
      Member("  ", "serial", JsonText(calibration.serial)) +
      Member("  ", "model", JsonText(calibration.model)) +
      Member("  ", "created", JsonText(calibration.created)) +
      Member("  ", "gauge", JsonText(GaugeName(calibration.gauge))) +
      Member("  ", "gauge_sensor", JsonText(TriadName(calibration.gauge_sensor))) +
      Member("  ", "gravity_mps2", NumberText(calibration.reference.gravity_mps2)) +
      Member("  ", "temperature_degc", NumberText(calibration.reference.temperature_degc)) +
      Member("  ", "sensors", Object(sensors, "  ")) +
      Member("  ", "covariance", CovarianceText(calibration.covariance));
  return std::vector<ExportedFile>{{"", Object(text, "") + "\n"}};
}

Result<Carried> ReadJsonExport(const ReadRequest& request) {
  return ReadSensorsJson(request.files[0].text, request.files[0].suffix);
}

}  // namespace

Format JsonFormat() {
  Format format;
  format.info = {"json", "everything, as JSON", Arithmetic::kFloat64};
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
