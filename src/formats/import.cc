// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include <Eigen/Core>

#include "base/spelling.h"
#include "calibrate/reading_units.h"
#include "formats/format.h"
#include "formats/restate.h"
#include "formats/text.h"
#include "io/text_file.h"
#include "io/yaml_reader.h"
#include "model/board_rotation.h"
#include "problem/parameter_name.h"
#include "truetriad/base/triad.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {

const std::vector<Format>& AllFormats() {
  static const auto& formats = *[] {
    auto* const all = new std::vector<Format>();
    for (const std::vector<Format>& some :
         {AutopilotFormats(), CountsFormats(), KalibrFormats(), ListedFormats()}) {
      all->insert(all->end(), some.begin(), some.end());
    }
    all->insert(all->end(), {MatlabFormat(), JsonFormat(), CHeaderFormat(), RecordFormat()});
    return all;
  }();
  return formats;
}

std::vector<FormatInfo> Formats() {
  std::vector<FormatInfo> infos;
  for (const Format& format : AllFormats()) infos.push_back(format.info);
  return infos;
}

Result<const Format*> FindFormat(std::string_view name, bool to_import) {
  // Some projects write their names with underscores, like imu_tk; these are accepted as well.
  std::string wanted(name);
  std::replace(wanted.begin(), wanted.end(), '_', '-');
  std::vector<std::string_view> names;
  std::string list, why = "is not a format";
  for (const Format& format : AllFormats()) {
    const bool is_it = format.info.name == wanted;
    if (to_import && !format.info.can_import) {
      if (is_it) why = "cannot be imported";
      continue;
    }
    if (is_it) return &format;
    names.push_back(format.info.name);
    list.append(list.empty() ? "" : ", ").append(format.info.name);
  }
  return Error(ErrorCode::kUnknownName,
               "`" + std::string(name) + "` " + why + DidYouMean(wanted, names) +
                   "; expected one of " + list);
}

Result<FormatInfo> InfoOfFormat(std::string_view name) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Format* const format, FindFormat(name));
  return format->info;
}

namespace {

/// A sensor of the file, converted to the units of the calibration to be made. `wanted`: the unit
/// of its readings.
Result<TriadCalibration> InWantedUnits(Triad triad,
                                       const Carried& file,
                                       const Format& format,
                                       const std::optional<std::string>& wanted) {
  const std::string name(TriadName(triad));
  const TriadCapacity& capacity = format.capacity[triad];
  TriadCalibration carried =
      TriadOf(*file.parts[triad],
              capacity.reading_unit,
              capacity.result_in_reading_unit ? capacity.reading_unit : TruthUnitName(triad));
  // If a magnetometer is corrected in axes of its own, rotates the correction into the board's
  // axes.
  const auto& turn_deg = file.device.magnetometer_turn_deg;
  if (triad == Triad::kMagnetometer && turn_deg) {
    TurnReadingsToo(TurnOf(*turn_deg).transpose(), &carried);
  }
  TriadCalibration sensor = carried;
  if (carried.input_unit.empty()) {
    if (!wanted) {
      return Error(ErrorCode::kMissingArgument,
                   "the file does not state the unit of the " + name +
                       "'s readings; state it, as in --units=g,deg/s,uT or --units=counts");
    }
    sensor.input_unit = *wanted;
    return sensor;
  }
  // If no unit is wanted: readings in a unit that the format fixes are converted to the true unit;
  // a unit that the file itself states is kept.
  const bool fixed = !capacity.reading_unit.empty();
  const std::string unit_name =
      wanted.value_or(fixed ? std::string(TruthUnitName(triad)) : carried.input_unit);
  TRUETRIAD_ASSIGN_OR_RETURN(const Unit from, ParseTriadUnit(triad, carried.input_unit));
  TRUETRIAD_ASSIGN_OR_RETURN(const Unit result, ParseTriadUnit(triad, carried.output_unit));
  TRUETRIAD_ASSIGN_OR_RETURN(const Unit to, ParseTriadUnit(triad, unit_name));
  if (from.is_counts != to.is_counts) {
    return Error(ErrorCode::kInvalidArgument,
                 "--units: the " + name + " in the file is in " + carried.input_unit +
                     ", which cannot be converted to " + unit_name);
  }
  sensor = InUnits(carried, from.truth_per_raw / to.truth_per_raw, result.truth_per_raw);
  sensor.input_unit = unit_name;
  sensor.output_unit = TruthUnitName(triad);
  return sensor;
}

/// Appends the names that the sensor's parameters have in a calibration's covariance.
void AppendNames(Triad triad, const TriadCalibration& sensor, std::vector<std::string>* names) {
  const auto vector = [&](ParameterKind kind, int power) {
    for (int row = 0; row < 3; ++row) {
      names->push_back(ParameterName{triad, kind, power, row, 0}.str());
    }
  };
  const auto matrix = [&](ParameterKind kind) {
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col) {
        names->push_back(ParameterName{triad, kind, 0, row, col}.str());
      }
    }
  };
  vector(ParameterKind::kBias, 0);
  matrix(ParameterKind::kSensitivity);
  const int terms = sensor.thermal ? static_cast<int>(sensor.thermal->bias.size()) : 0;
  for (int power = 1; power <= terms; ++power) vector(ParameterKind::kBias, power);
  if (sensor.g_sensitivity) matrix(ParameterKind::kGSensitivity);
}

/// The FAIL decision for a file whose comment says that its unit must not be delivered. `said`: the
/// text after kMustNotLeave.
Decision HeldBack(const std::string& path, std::string said) {
  const auto ends = [](char c) { return static_cast<unsigned char>(c) < ' '; };
  said.erase(std::find_if(said.begin(), said.end(), ends), said.end());
  const std::size_t begin = said.find_first_not_of(": "), end = said.rfind('.');
  if (begin >= end) return {Verdict::kFail, path, "it may not be delivered", TimestampUtc(), true};
  return {Verdict::kFail, path, said.substr(begin, end - begin), TimestampUtc(), true};
}

/// The gauge implied by the form of the leading sensor's sensitivity.
Gauge GaugeOf(const Eigen::Matrix3d& sensitivity) {
  // The elements above the diagonal of a triangular matrix stay below this after it was inverted
  // and written.
  constexpr double kTriangularRounding = 1e-12;
  if (sensitivity.isLowerTriangular(kTriangularRounding)) return Gauge::kAccelX;
  if (sensitivity.isUpperTriangular(kTriangularRounding)) return Gauge::kAccelZ;
  if (sensitivity.isApprox(sensitivity.transpose(), kTriangularRounding)) return Gauge::kSymmetric;
  return Gauge::kFixture;
}

}  // namespace

Result<Import> ImportCalibration(std::string_view format_name,
                                 const std::vector<std::string>& paths,
                                 const ImportOptions& options) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Format* const found, FindFormat(format_name, true));
  const Format& format = *found;
  Import import;
  Calibration& calibration = import.calibration;
  ReadRequest request;
  request.instance = options.instance;
  request.device_ids = options.device_ids;
  for (const std::string& path : paths) {
    TRUETRIAD_ASSIGN_OR_RETURN(std::string text, ReadSmallFile(path));
    calibration.inputs.push_back({path, Sha256Hex(text), 0});
    if (const std::size_t mark = text.find(kMustNotLeave); mark != std::string::npos) {
      calibration.within_limits = false;
      calibration.decisions = {HeldBack(path, text.substr(mark + kMustNotLeave.size()))};
    }
    request.files.push_back({path, std::move(text)});
  }
  if (request.files.empty())
    return Error(ErrorCode::kMissingArgument, "no file to import; give --input");
  TRUETRIAD_ASSIGN_OR_RETURN(const Carried carried, format.read(request));
  import.notes = carried.notes;
  calibration.tags = carried.device;

  std::optional<Triad> leading;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer, Triad::kGyroscope}) {
    if (!carried.parts[triad]) continue;
    TRUETRIAD_ASSIGN_OR_RETURN(TriadCalibration sensor,
                               InWantedUnits(triad, carried, format, options.units[triad]));
    if (!sensor.model.sensitivity.allFinite() || !sensor.model.bias.allFinite()) {
      return Error(ErrorCode::kSingularMatrix,
                   {paths[0]},
                   "the matrix of the " + std::string(TriadName(triad)) + " is singular");
    }
    calibration.sensors[triad] = std::move(sensor);
    if (!leading) leading = triad;
  }
  if (!leading) {
    const bool is_by_id = options.device_ids != ImportOptions().device_ids;
    return Error(ErrorCode::kWrongFormat,
                 {paths[0]},
                 "contains no sensor calibration in the format " + std::string(format.info.name) +
                     (options.instance ? " with that --instance"
                      : is_by_id       ? " with that --id"
                                       : ""));
  }
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
    if (!sensor) continue;
    AppendNames(triad, *sensor, &calibration.covariance.parameters);
    if (sensor->thermal) calibration.reference.temperature_degc = sensor->thermal->reference_degc;
  }
  const auto size = static_cast<Eigen::Index>(calibration.covariance.parameters.size());
  calibration.covariance.matrix = Eigen::MatrixXd::Zero(size, size);
  calibration.gauge_sensor = *leading;
  calibration.gauge = GaugeOf(calibration.sensors[*leading]->model.sensitivity);
  calibration.reference.field_ut = carried.field_ut;
  calibration.outcome = Outcome::kConverged;
  calibration.software_version = options.software_version;
  calibration.created = TimestampUtc();
  calibration.findings = {{FindingCode::kImported,
                           "imported from " + std::string(format.info.name) +
                               " as the unit's present calibration; its uncertainties are unknown, "
                               "so every sigma is zero"}};
  for (const std::string& note : import.notes) {
    calibration.findings.emplace_back(FindingCode::kImported, note);
  }
  return import;
}

}  // namespace truetriad
