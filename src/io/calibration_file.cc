// SPDX-License-Identifier: Apache-2.0
#include "truetriad/io/calibration_file.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <limits>
#include <sstream>
#include <string_view>
#include <system_error>

#include <Eigen/Core>

#include "io/calibration_tree.h"
#include "io/whole_file.h"
#include "io/yaml_fields.h"
#include "io/yaml_reader.h"
#include "model/calibration_fields.h"
#include "model/quality_fields.h"
#include "tree/to_tree.h"

namespace truetriad {
namespace {

constexpr std::string_view kFormat = "truetriad/calibration/1";
constexpr int kDigits = std::numeric_limits<double>::max_digits10;  ///< Doubles read back exactly.

template <class V>
void CovarianceFields(V& visit, const NamedCovariance& covariance) {
  std::vector<Word<const std::string>> parameters;
  for (const std::string& name : covariance.parameters) parameters.push_back({name});
  visit("parameters", parameters);
  std::vector<Eigen::VectorXd> rows;
  for (const auto& row : covariance.matrix.rowwise()) rows.emplace_back(row.transpose());
  visit("matrix", rows, Style::kBlocks);
}

// Early files of version 1 have messages but no `findings:`. Each message becomes a finding of code
// `message`; in an unusable calibration it becomes a refusal, since any of them may be the reason.
Findings FindingsOf(const std::vector<std::string>& messages, Outcome outcome) {
  const Severity severity = outcome == Outcome::kConverged ? Severity::kNote : Severity::kRefusal;
  Findings findings;
  for (const std::string& text : messages) {
    findings.emplace_back(FindingCode::kMessage, "").As(severity).text = text;
  }
  return findings;
}

template <class V>
void StatusFields(V& visit, Like<Calibration> auto& calibration) {
  visit("outcome", calibration.outcome);
  visit.OrNull("within_limits", calibration.within_limits);
  const bool has_findings = visit.If(kNewer, "findings", calibration.findings, Style::kBlocks);
  std::vector<std::string> messages;
  if (!V::kReads) {
    for (const Finding& finding : calibration.findings) messages.push_back(finding.Message());
  }
  visit("messages", messages, Style::kBlocks);
  if constexpr (V::kReads) {
    if (!has_findings) calibration.findings = FindingsOf(messages, calibration.outcome);
  }
  visit.Check("", [&calibration]() -> std::string {
    const Finding* const refusal = FirstRefusal(calibration.findings);
    if (calibration.outcome != Outcome::kConverged || refusal == nullptr) return "";
    return "outcome " + std::string(OutcomeName(calibration.outcome)) +
           " contradicts this refusal: " + refusal->text;
  });
}

/// The origin of a calibration: device, run, software, time and inputs.
template <class V>
void OriginFields(V& visit, Like<Calibration> auto& calibration) {
  visit.Group("device", Style::kFlow, [&calibration](V& device) {
    device("serial", calibration.serial);
    device("model", calibration.model);
    TagFields(device, kDeviceTags, calibration.tags);
    FirmwareFields(device, calibration.tags);
  });
  visit.If(HasRunTags(calibration.tags),
           "run",
           Part{[&tags = calibration.tags](auto& run) { TagFields(run, kRunTags, tags); }},
           Style::kFlow);
  visit.Group("software", Style::kFlow, [&calibration](V& software) {
    std::string program = "truetriad";
    software("name", Word{program});
    software("version", calibration.software_version);
  });
  visit("created", Word{calibration.created});
  visit("inputs", calibration.inputs);
}

/// All keys of a calibration except its experiment, which follows them.
template <class V>
void CalibrationFields(V& visit, Like<Calibration> auto& calibration) {
  std::string format(kFormat);
  visit("format", Word{format});
  Verdict verdict = calibration.verdict();
  const bool has_verdict = visit.If(kNewer, "verdict", verdict);
  visit.If(!calibration.decisions.empty(), "decisions", calibration.decisions);
  OriginFields(visit, calibration);
  visit.If(kNewer, "mode", calibration.mode);
  visit.Group(
      "status", Style::kUsual, [&calibration](V& status) { StatusFields(status, calibration); });
  visit.Check("verdict", [&]() -> std::string {
    if (!has_verdict || verdict == calibration.verdict()) return "";
    return "contradicts `status:` and `decisions:`, which give the verdict " +
           std::string(VerdictName(calibration.verdict())) + "; remove this line";
  });
  visit("reference", calibration.reference);
  visit("gauge", calibration.gauge);
  visit("gauge_sensor", calibration.gauge_sensor);
  if (calibration.IsUsable()) {
    visit("sensors", calibration.sensors);
    if constexpr (!V::kReads) {
      visit.Group("covariance", Style::kUsual, [&calibration](V& covariance) {
        CovarianceFields(covariance, calibration.covariance);
      });
    }
  }
  visit("quality", calibration.quality);
}

std::string ConfigBlock(const std::string& config_yaml) {
  if (config_yaml.empty()) return "config: {}\n";
  std::string block = "config:\n";
  std::istringstream lines(config_yaml);
  for (std::string line; std::getline(lines, line);) {
    block.append(line.empty() ? "" : "  ").append(line) += '\n';
  }
  return block;
}

// Whether variances and correlations are valid up to rounding.
bool IsCovariance(const Eigen::MatrixXd& matrix) {
  constexpr double kRounding = 1e-6;  // Rounding, 1e-16, times a condition number of 1e10.
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
        "is not a covariance: a number is not finite, a variance is negative, a correlation is "
        "above one, or the matrix is not symmetric; calibrate again");
  }
  reader.RejectUnknown();
}

/// The mode, derived from the experiment: older files do not state the mode itself.
Mode ModeOfConfig(YamlReader config) {
  if (!config.IsMap()) return Mode::kPoses;
  YamlReader poses = config.Child("poses");
  if (!poses.IsMap()) return Mode::kPoses;
  if (poses.Child("motion")) return Mode::kMotion;
  return poses.Child("sweep") ? Mode::kSweep : Mode::kPoses;
}

/// The text below the top-level key `config:`, moved to the left margin. The text is kept instead
/// of the parsed value, since comments in it mark the defaults, and numbers keep their form.
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

}  // namespace

std::string CalibrationToYaml(const Calibration& calibration) {
  YamlFieldWriter root(kDigits);
  CalibrationFields(root, calibration);
  return root.text() + ConfigBlock(calibration.config_yaml);
}

Json CalibrationTree(const Calibration& calibration) {
  TreeWriter root(Json::object());
  CalibrationFields(root, calibration);
  Json tree = AsInYaml(root.Take());
  const std::string& config = calibration.config_yaml;
  tree["config"] = config.empty() ? Json::object() : TreeOfYaml(config);
  return tree;
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
  // If the file is of another kind or version, all further errors would be meaningless.
  TRUETRIAD_RETURN_IF_ERROR(reader.status());

  Calibration calibration;
  YamlFieldReader fields(reader);
  CalibrationFields(fields, calibration);
  reader.Child("status").RequireChild("within_limits");
  if (calibration.IsUsable()) {
    ReadCovariance(reader.RequireChild("covariance"), &calibration.covariance);
  }
  if (!reader.Child("mode")) {
    calibration.mode = calibration.quality.sweep.axes.empty() ? ModeOfConfig(reader.Child("config"))
                                                              : Mode::kSweep;
  }
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
  // The file may be an output that this run replaces, so it must not become a guarded input.
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
  // A trial is the only reliable test: permissions do not show read-only disks.
  const WholeFile probe((std::filesystem::path(directory) / ".probe").string());
  if (probe.failure() != 0) {
    return Error(ErrorCode::kCannotWrite,
                 {directory},
                 std::string("cannot be written to: ") + std::strerror(probe.failure()));
  }
  return {};
}

}  // namespace truetriad
