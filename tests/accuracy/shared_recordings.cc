// SPDX-License-Identifier: Apache-2.0
#include "accuracy/shared_recordings.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <utility>

#include <Eigen/LU>
#include <yaml-cpp/yaml.h>

#include "cli/command_line_run.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace {

const std::string kSource = TRUETRIAD_SOURCE_DIR;

void ReplaceAll(const std::string& from, const std::string& to, std::string* text) {
  for (std::size_t at = text->find(from); at != std::string::npos; at = text->find(from, at)) {
    text->replace(at, from.size(), to);
    at += to.size();
  }
}

/// Index of a parameter of the calibration's covariance.
Eigen::Index IndexOf(const Calibration& calibration, const std::string& parameter) {
  const std::vector<std::string>& names = calibration.covariance.parameters;
  const auto found = std::find(names.begin(), names.end(), parameter);
  EXPECT_NE(found, names.end()) << parameter;
  return found - names.begin();
}

}  // namespace

void SharedRecordings::SetUp() {
  if (!std::filesystem::is_directory(TRUETRIAD_SHARED_DATASETS)) {
    GTEST_SKIP() << "no shared recordings at " << TRUETRIAD_SHARED_DATASETS
                 << "; set TRUETRIAD_SHARED_DATASETS";
  }
}

bool SharedRecordings::MakeTables() {
  const std::string python = TRUETRIAD_PYTHON;
  if (python.empty()) return false;
  const Finished made = RunShell("'" + python + "' -B tools/scripts/shared_tables.py --datasets='" +
                                 TRUETRIAD_SHARED_DATASETS + "' --output='" + work_.Path("") + "'");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  return made.exit_code == 0;
}

std::string SharedRecordings::Manifest(const std::string& name, const std::string& datasets) const {
  const std::string folder = kSource + "/configs/recordings/";
  std::string text = TemporaryFolder::Read(folder + name + ".yaml");
  ReplaceAll("../../../shared/datasets", datasets, &text);
  ReplaceAll("../../out/recordings", work_.Path(""), &text);
  ReplaceAll("{ file: ", "{ file: " + folder, &text);
  return work_.Write(name + ".yaml", text);
}

Outcomes SharedRecordings::Run(const std::string& experiment,
                               const std::string& input,
                               const std::string& set) {
  const std::string output = work_.Path("result_" + std::to_string(++runs_));
  std::vector<std::string> arguments = {
      "calibrate",
      "--config=" + kSource + "/configs/experiments/recordings/" + experiment + ".yaml",
      "--input=" + input,
      "--output=" + output,
      "--report=false"};
  if (!set.empty()) arguments.push_back("--set=" + set);
  const Finished run = RunTruetriad(arguments);
  Outcomes outcomes;
  outcomes.exit_code = run.exit_code;
  outcomes.text = run.out + run.err;
  Result<Calibration> calibration = ReadCalibration(output + "/calibration.yaml");
  if (calibration) {
    outcomes.calibration = *std::move(calibration);
  } else {
    ADD_FAILURE() << outcomes.text << calibration.error().message;
  }
  return outcomes;
}

ReferenceFit ReadReferenceFit(const std::string& file, const std::vector<std::string>& keys) {
  YAML::Node node = YAML::LoadFile(file);
  for (const std::string& key : keys) node.reset(node[key]);
  ReferenceFit fit;
  for (int i = 0; i < 3; ++i) {
    fit.bias[i] = node["bias"][i].as<double>();
    for (int j = 0; j < 3; ++j) {
      fit.matrix(i, j) = node["matrix_lower_triangular"][i][j].as<double>();
    }
  }
  fit.target_norm = node["target_norm"].as<double>();
  fit.rms_after = node["rms_after"].as<double>();
  return fit;
}

CorrectionEstimate CorrectionOf(const Calibration& calibration, Triad triad) {
  const TriadModel<double>& model = calibration.sensors[triad]->model;
  const Eigen::Matrix3d C = model.sensitivity.inverse();
  const std::string name = std::string(TriadName(triad)) + ".";
  const std::string axes = "xyz";
  CorrectionEstimate estimate;
  estimate.values << model.bias, C.reshaped();
  std::vector<Eigen::Index> index;
  Eigen::Matrix<double, 12, 12> J = Eigen::Matrix<double, 12, 12>::Identity();
  for (const char axis : axes) index.push_back(IndexOf(calibration, name + "bias." + axis));
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) {
      index.push_back(IndexOf(calibration,
                              name + "sensitivity." + axes[static_cast<std::size_t>(row)] +
                                  axes[static_cast<std::size_t>(column)]));
      // dC = -C dS C.
      const Eigen::Matrix3d change = -C.col(row) * C.row(column);
      J.block<9, 1>(3, 3 + 3 * column + row) = change.reshaped();
    }
  }
  estimate.covariance = J * calibration.covariance.matrix(index, index) * J.transpose();
  return estimate;
}

::testing::AssertionResult Agrees(const Calibration& calibration,
                                  Triad triad,
                                  const ReferenceFit& fit,
                                  double norm) {
  const CorrectionEstimate estimate = CorrectionOf(calibration, triad);
  Eigen::Matrix<double, 12, 1> expected;
  expected << fit.bias, (fit.matrix * (norm / fit.target_norm)).eval().reshaped();
  // The reference corrects no faults: it is off by as much as a correction moves a parameter.
  double corrected_sigmas = 0.0;
  for (const Finding& finding : calibration.findings) {
    if (finding.code != FindingCode::kFault) continue;
    corrected_sigmas = std::max(corrected_sigmas, finding.Value("effect").value_or(0.0));
  }
  ::testing::AssertionResult result = ::testing::AssertionSuccess();
  for (int i = 0; i < 12; ++i) {
    const double sigma = std::sqrt(std::max(estimate.covariance(i, i), 0.0));
    const double difference = estimate.values[i] - expected[i];
    const double rounding = 1e-12 * std::abs(estimate.values[i]);
    const double most_sigmas = 3.0 * std::numbers::sqrt2 + corrected_sigmas;
    if (std::abs(difference) <= most_sigmas * sigma + rounding) continue;
    if (result) result = ::testing::AssertionFailure();
    result << (i < 3 ? "bias " : "correction ") << (i < 3 ? i : i - 3) << " is "
           << estimate.values[i] << " ± " << sigma << ", reference " << expected[i] << " ("
           << difference / sigma << " σ)\n";
  }
  return result;
}

}  // namespace truetriad
