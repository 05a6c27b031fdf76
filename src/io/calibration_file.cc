// SPDX-License-Identifier: Apache-2.0
#include "truetriad/io/calibration_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <sstream>
#include <string_view>
#include <system_error>

#include <Eigen/Core>

#include "io/calibration_findings.h"
#include "io/calibration_quality.h"
#include "io/calibration_sensors.h"
#include "io/calibration_values.h"
#include "io/tags_text.h"
#include "io/tags_yaml.h"
#include "io/whole_file.h"
#include "io/yaml_reader.h"
#include "io/yaml_text.h"

namespace truetriad {
namespace {

constexpr std::string_view kFormat = "truetriad/calibration/1";

void WriteCovariance(YamlText& out, const NamedCovariance& covariance) {
  out << "covariance:\n  parameters: ";
  WriteList(out, covariance.parameters);
  out << "\n";
  WriteItem(out, "matrix", covariance.matrix.rows() == 0);
  for (Eigen::Index row = 0; row < covariance.matrix.rows(); ++row) {
    out << "    - " << covariance.matrix.row(row).transpose() << "\n";
  }
}

void WriteReference(YamlText& out, const ReferenceValues& reference) {
  out << "reference:\n  gravity_mps2: " << reference.gravity_mps2 << "\n";
  if (reference.gravity_sigma_mps2) {
    out << "  gravity_sigma_mps2: " << *reference.gravity_sigma_mps2 << "\n";
  }
  if (reference.field_ut) out << "  field_ut: " << *reference.field_ut << "\n";
  if (reference.dip_rad) out << "  dip_rad: " << *reference.dip_rad << "\n";
  if (reference.fixture_from_world) {
    out << "  fixture_from_world: " << *reference.fixture_from_world << "\n";
  }
  out << "  field_estimated: " << reference.field_estimated << "\n"
      << "  field_nominal: " << reference.field_nominal << "\n"
      << "  temperature_degc: " << reference.temperature_degc << "\n";
  if (reference.recorded_degc) out << "  recorded_degc: " << *reference.recorded_degc << "\n";
}

void WriteConfig(YamlText& out, const std::string& config_yaml) {
  if (config_yaml.empty()) {
    out << "config: {}\n";
    return;
  }
  out << "config:\n";
  std::istringstream lines(config_yaml);
  for (std::string line; std::getline(lines, line);) {
    out << (line.empty() ? "" : "  ") << line << "\n";
  }
}

// Whether variances and correlations can be those of parameters; rounding leaves a little.
bool IsCovariance(const Eigen::MatrixXd& matrix) {
  constexpr double kRounding = 1e-6;
  if (matrix.size() == 0) return true;
  if (!matrix.allFinite() || matrix.diagonal().minCoeff() < 0.0) return false;
  const Eigen::VectorXd sigma = matrix.diagonal().cwiseSqrt();
  const Eigen::ArrayXXd most = (sigma * sigma.transpose()).array();
  return (matrix.array().abs() <= (1.0 + kRounding) * most).all() &&
         ((matrix - matrix.transpose()).array().abs() <= kRounding * most).all();
}

void ReadCovariance(YamlReader reader, NamedCovariance* covariance) {
  if (!reader) return;
  for (YamlReader& item : reader.RequireChild("parameters").Items()) {
    item.Read(&covariance->parameters.emplace_back());
  }
  ReadMatrix(reader.RequireChild("matrix"),
             static_cast<Eigen::Index>(covariance->parameters.size()),
             &covariance->matrix);
  if (!IsCovariance(covariance->matrix)) {
    reader.Fail(
        "is no covariance: a number is not finite, a variance negative, a correlation above "
        "one, or the matrix not symmetric; write the calibration anew");
  }
  reader.RejectUnknown();
}

void ReadReference(YamlReader reader, ReferenceValues* reference) {
  if (!reader) return;
  if (YamlReader gravity = reader.RequireChild("gravity_mps2");
      ReadNumber(gravity, &reference->gravity_mps2) && !(reference->gravity_mps2 > 0.0)) {
    gravity.Fail("expected a positive number");
  }
  for (const auto& [key, value] : {std::pair("gravity_sigma_mps2", &reference->gravity_sigma_mps2),
                                   std::pair("field_ut", &reference->field_ut),
                                   std::pair("dip_rad", &reference->dip_rad)}) {
    double number = 0.0;
    if (ReadNumber(reader.Child(key), &number)) *value = number;
  }
  if (Eigen::Vector4d rotation; ReadVector(reader.Child("fixture_from_world"), &rotation)) {
    reference->fixture_from_world = rotation;
  }
  reader.Require("field_estimated", &reference->field_estimated);
  reader.Optional("field_nominal", &reference->field_nominal);
  ReadNumber(reader.RequireChild("temperature_degc"), &reference->temperature_degc);
  YamlReader recorded = reader.Child("recorded_degc");
  if (Eigen::Vector3d degc; ReadVector(recorded, &degc)) {
    if (!(degc[0] <= degc[1] && degc[1] <= degc[2] && degc[0] >= kAbsoluteZeroDegc)) {
      recorded.Fail("expected the lowest, the mean and the highest temperature in degC");
    }
    reference->recorded_degc = degc;
  }
  reader.RejectUnknown();
}

void ReadStatus(YamlReader reader, Calibration* calibration) {
  if (!reader) return;
  ReadWord(reader.RequireChild("outcome"), OutcomeFromName, &calibration->outcome);
  bool within_limits = false;
  if (YamlReader limits = reader.RequireChild("within_limits");
      !IsNull(limits) && limits.Read(&within_limits)) {
    calibration->within_limits = within_limits;
  }
  ReadFindings(&reader, calibration->outcome, &calibration->findings);
  if (calibration->outcome == Outcome::kConverged) {
    for (const Finding& finding : calibration->findings) {
      if (!finding.IsRefusal()) continue;
      reader.Fail("outcome " + std::string(OutcomeName(calibration->outcome)) +
                  ", but a finding refuses: " + finding.text);
      break;
    }
  }
  reader.RejectUnknown();
}

/// Files of yesterday say only in their experiment what they were made from.
Mode ModeOfConfig(YamlReader config) {
  if (!config.IsMap()) return Mode::kPoses;
  YamlReader poses = config.Child("poses");
  if (!poses.IsMap()) return Mode::kPoses;
  if (poses.Child("motion")) return Mode::kMotion;
  return poses.Child("sweep") ? Mode::kSweep : Mode::kPoses;
}

void ReadMode(YamlReader* reader, Calibration* calibration) {
  if (YamlReader mode = reader->Child("mode")) {
    ReadWord(mode, ModeFromName, &calibration->mode);
    return;
  }
  calibration->mode = ModeOfConfig(reader->Child("config"));
  if (!calibration->quality.sweep.axes.empty()) calibration->mode = Mode::kSweep;
}

/// The text below the top-level key `config:`, moved to the left margin. The text and not the
/// parsed value, so that comments (which mark the defaults) and the spelling of numbers stay.
std::string ConfigText(const std::string& text) {
  constexpr std::string_view kKey = "config:";
  std::istringstream lines(text);
  std::string line;
  while (std::getline(lines, line) && !line.starts_with(kKey)) {
  }
  if (line.starts_with("config: {}")) return "";
  std::string config = line.substr(std::min(line.size(), kKey.size()));
  config.erase(0, config.find_first_not_of(' '));
  if (!config.empty()) config += '\n';
  std::size_t indent = 0;
  while (std::getline(lines, line)) {
    const std::size_t content = line.find_first_not_of(' ');
    if (content == 0 && line[0] != '#') break;  // The next top-level key.
    if (indent == 0 && content != std::string::npos) indent = content;
    config += line.substr(std::min({indent, content, line.size()})) + '\n';
  }
  return config;
}

void WriteDecisions(YamlText& out, const std::vector<Decision>& decisions) {
  if (!decisions.empty()) out << "decisions:\n";
  for (const Decision& decision : decisions) {
    out << "  - { verdict: " << VerdictName(decision.verdict) << ", who: " << Quoted{decision.who}
        << ", why: " << Quoted{decision.why} << ", created: " << Quoted{decision.created}
        << (decision.is_automatic ? ", automatic: true" : "") << " }\n";
  }
}

void ReadDecisions(YamlReader items, std::vector<Decision>* decisions) {
  for (YamlReader& item : items.Items()) {
    Decision& decision = decisions->emplace_back();
    YamlReader verdict = item.RequireChild("verdict");
    ReadWord(verdict, VerdictFromName, &decision.verdict);
    if (decision.verdict != Verdict::kPass && decision.verdict != Verdict::kFail) {
      verdict.Fail("`" + std::string(VerdictName(decision.verdict)) +
                   "` is not a decision; expected PASS or FAIL");
    }
    item.Require("who", &decision.who);
    item.Require("why", &decision.why);
    item.Require("created", &decision.created);
    item.Optional("automatic", &decision.is_automatic);
    item.RejectUnknown();
  }
}

}  // namespace

std::string CalibrationToYaml(const Calibration& calibration) {
  constexpr int kDigits = std::numeric_limits<double>::max_digits10;
  YamlText out(kDigits);
  out << "format: " << kFormat << "\n"
      << "verdict: " << VerdictName(calibration.verdict()) << "\n";
  WriteDecisions(out, calibration.decisions);
  out << "device: { serial: " << Quoted{calibration.serial}
      << ", model: " << Quoted{calibration.model} << DeviceTagsText(calibration.tags) << " }\n";
  if (const std::string run = TagsText(kRunTags, calibration.tags, false); !run.empty()) {
    out << "run: { " << run << " }\n";
  }
  out << "software: { name: truetriad, version: " << Quoted{calibration.software_version} << " }\n"
      << "created: " << calibration.created << "\n";
  WriteInputs(out, calibration.inputs);
  out << "mode: " << ModeName(calibration.mode)
      << "\nstatus:\n  outcome: " << OutcomeName(calibration.outcome) << "\n  within_limits: ";
  if (calibration.within_limits) {
    out << *calibration.within_limits << "\n";
  } else {
    out << "null\n";
  }
  WriteFindings(out, calibration.findings);
  WriteReference(out, calibration.reference);
  out << "gauge: " << GaugeName(calibration.gauge) << "\n"
      << "gauge_sensor: " << TriadName(calibration.gauge_sensor) << "\n";
  if (calibration.IsUsable()) {
    out << "sensors:\n";
    for (const Triad triad : kTriads) {
      if (calibration.sensors[triad]) WriteSensor(out, triad, *calibration.sensors[triad]);
    }
    WriteCovariance(out, calibration.covariance);
  }
  WriteQuality(out, calibration.quality);
  WriteConfig(out, calibration.config_yaml);
  return out.str();
}

Result<Calibration> CalibrationFromYaml(const std::string& text, const std::string& name) {
  Result<YamlReader> root = YamlReader::FromText(text, name);
  if (!root && text.find("format: ") == std::string::npos) {
    Error error = root.error();
    error.message +=
        " Expected a calibration.yaml that `calibrate` wrote; other files are brought in by "
        "`import`";
    return error;
  }
  TRUETRIAD_RETURN_IF_ERROR(root);
  YamlReader& reader = *root;
  if (reader.Child("experiment") || reader.Child("recording")) {
    return Error(
        ErrorCode::kWrongFormat,
        {name},
        "is an experiment or a recording; expected a calibration.yaml that `calibrate` wrote");
  }
  std::string format;
  if (reader.Require("format", &format) && format != kFormat) {
    reader.Child("format").Fail("`" + format + "` is not supported; this truetriad reads " +
                                std::string(kFormat));
  }
  // A file of another kind or version would only add errors that say nothing.
  TRUETRIAD_RETURN_IF_ERROR(reader.status());

  Calibration calibration;
  if (YamlReader device = reader.RequireChild("device")) {
    device.Require("serial", &calibration.serial);
    device.Require("model", &calibration.model);
    for (const TagKey& tag : kDeviceTags) device.Optional(tag.key, &(calibration.tags.*tag.value));
    ReadDeviceIds(device.Child("ids"), &calibration.tags);
    device.RejectUnknown();
  }
  if (YamlReader run = reader.Child("run")) {
    for (const TagKey& tag : kRunTags) run.Optional(tag.key, &(calibration.tags.*tag.value));
    run.RejectUnknown();
  }
  if (YamlReader software = reader.RequireChild("software")) {
    std::string program;
    software.Require("name", &program);
    software.Require("version", &calibration.software_version);
    software.RejectUnknown();
  }
  if (YamlReader created = reader.RequireChild("created"); !IsNull(created)) {
    created.Read(&calibration.created);
  }
  ReadInputs(reader.RequireChild("inputs"), &calibration.inputs);
  ReadStatus(reader.RequireChild("status"), &calibration);
  if (YamlReader decisions = reader.Child("decisions")) {
    ReadDecisions(std::move(decisions), &calibration.decisions);
  }
  if (YamlReader verdict = reader.Child("verdict")) {
    Verdict stated = calibration.verdict();
    ReadWord(verdict, VerdictFromName, &stated);
    if (stated != calibration.verdict()) {
      verdict.Fail("contradicts `status:` and `decisions:`, by which it is " +
                   std::string(VerdictName(calibration.verdict())) + "; take this line away");
    }
  }
  ReadReference(reader.RequireChild("reference"), &calibration.reference);
  ReadWord(reader.RequireChild("gauge"), GaugeFromName, &calibration.gauge);
  ReadWord(reader.RequireChild("gauge_sensor"), TriadFromName, &calibration.gauge_sensor);
  if (calibration.IsUsable()) {
    if (YamlReader sensors = reader.RequireChild("sensors")) {
      for (const Triad triad : kTriads) {
        if (YamlReader sensor = sensors.Child(TriadName(triad))) {
          ReadSensor(sensor, &calibration.sensors[triad].emplace());
        }
      }
      sensors.RejectUnknown();
    }
    ReadCovariance(reader.RequireChild("covariance"), &calibration.covariance);
  }
  ReadQuality(reader.RequireChild("quality"), &calibration.quality);
  ReadMode(&reader, &calibration);
  if (reader.RequireChild("config")) calibration.config_yaml = ConfigText(text);
  reader.RejectUnknown();
  TRUETRIAD_RETURN_IF_ERROR(reader.status());
  return calibration;
}

Result<Calibration> ReadCalibration(const std::string& path) {
  const Result<std::string> text = ReadSmallFile(path);
  TRUETRIAD_RETURN_IF_ERROR(text);
  return CalibrationFromYaml(*text, path);
}

Result<std::string> ReadSerial(const std::string& path) {
  // A file that is to be replaced is looked at, too: it is no input by that.
  Result<std::string> text = LookAtSmallFile(path);
  TRUETRIAD_RETURN_IF_ERROR(text);
  text->resize(std::min(text->find("\ninputs:"), text->size()));
  Result<YamlReader> reader = YamlReader::FromText(*text, path);
  TRUETRIAD_RETURN_IF_ERROR(reader);
  std::string serial;
  if (YamlReader device = reader->RequireChild("device")) device.Require("serial", &serial);
  TRUETRIAD_RETURN_IF_ERROR(reader->status());
  return serial;
}

std::string TimestampUtc() {
  std::time_t seconds = std::time(nullptr);
  if (const char* const epoch = std::getenv("SOURCE_DATE_EPOCH")) {
    std::int64_t stated = 0;
    const char* const end = epoch + std::strlen(epoch);
    const auto [parsed_to, failure] = std::from_chars(epoch, end, stated);
    if (failure == std::errc() && parsed_to == end) seconds = stated;
  }
  std::tm utc{};
  if (gmtime_r(&seconds, &utc) == nullptr) return "";
  char text[64];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

Status WriteFileAtomically(const std::string& path, const std::string& text) {
  WholeFile file(path);
  file.Write(text);
  return file.Commit();
}

Status EnsureWritableDirectory(const std::string& directory) {
  std::error_code failure;
  if (std::filesystem::exists(directory, failure) &&
      !std::filesystem::is_directory(directory, failure)) {
    return Error(ErrorCode::kOutputInTheWay, {directory}, "is a file; name a folder");
  }
  std::filesystem::create_directories(directory, failure);
  if (failure) {
    return Error(ErrorCode::kCannotWrite, {directory}, "cannot be created: " + failure.message());
  }
  // Trying is the only sure way: permissions alone do not know about read-only disks.
  const WholeFile probe((std::filesystem::path(directory) / ".probe").string());
  if (probe.failure() != 0) {
    return Error(ErrorCode::kCannotWrite,
                 {directory},
                 std::string("cannot be written to: ") + std::strerror(probe.failure()));
  }
  return {};
}

}  // namespace truetriad
