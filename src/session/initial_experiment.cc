// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/companion.h"
#include "io/yaml_text.h"
#include "truetriad/io/recording.h"
#include "truetriad/session/session.h"

namespace truetriad {
namespace {

PerTriad<bool> SeenIn(const PoseSet& poses) {
  PerTriad<bool> seen;
  for (const StreamSummary& stream : poses.streams) seen[stream.triad] = stream.samples > 0;
  return seen;
}

std::string RelativeTo(const std::string& folder, const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path from = fs::absolute(folder.empty() ? "." : folder).lexically_normal();
  return fs::absolute(path).lexically_normal().lexically_proximate(from).string();
}

/// The line from which editors know the schema of the file; empty if they cannot find it.
std::string SchemaLine() {
  const Result<std::string> found = FindSharedFile("schema/experiment.schema.json");
  if (!found) return "";
  const std::string path = std::filesystem::absolute(*found).lexically_normal().string();
  const bool ends_early = path.find_first_of(" \t\r\n") != std::string::npos;
  return ends_early ? "" : "# yaml-language-server: $schema=" + path + '\n';
}

Result<std::string> ExperimentFor(const LoadedPoses& loaded,
                                  const PerTriad<bool>& seen,
                                  const std::vector<std::string>& inputs,
                                  const std::string& folder) {
  const PoseSet& poses = loaded.poses;
  const bool has_accelerometer = seen[Triad::kAccelerometer];
  const bool has_magnetometer = seen[Triad::kMagnetometer];
  if (!has_accelerometer && !has_magnetometer) {
    return Error(ErrorCode::kNotEnoughData,
                 {inputs.front()},
                 "has only a gyroscope, which is calibrated from known turns or rates; state these "
                 "in an experiment (`turns:` or `rates:`)");
  }
  YamlText list;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    list << (i > 0 ? ", " : "") << Quoted{RelativeTo(folder, inputs[i])};
  }
  std::string text = SchemaLine() +
                     "# All keys and their defaults: docs/experiments.md\n"
                     "experiment: 1\n"
                     "input: " +
                     (inputs.size() == 1 ? list.str() : "[" + list.str() + "]") + "  # " +
                     std::to_string(poses.poses.size()) + " poses by " + poses.how + "\n";
  if (poses.serial.empty()) text += "# device: { serial: A0001 }\n";
  text +=
      "reference:\n"
      "  # Gravity anywhere on Earth; its sigma limits all gains. State yours without sigma, or\n"
      "  # `position: { latitude_deg: 47, longitude_deg: 8, height_m: 400, date: 2026-01-31 }`\n"
      "  gravity_mps2: { value: 9.80665, sigma: 0.02 }\n";
  if (has_magnetometer) {
    text +=
        "  # Without a strength the magnetometer's gains have no common scale.\n"
        "  # Add `hemisphere: south` south of the magnetic equator, or `north`.\n"
        "  field: { strength_ut: unknown, dip_deg: unknown }\n";
  }
  text += "sensors:\n";
  for (const Triad triad : kTriads) {
    if (seen[triad]) text += "  " + std::string(TriadName(triad)) + ": { model: full }\n";
  }
  const bool has_faces = std::all_of(poses.poses.begin(), poses.poses.end(), [](const auto& pose) {
    return !pose.face_up.empty();
  });
  if (has_faces && has_accelerometer && !poses.poses.empty()) {
    text +=
        "# Each pose states which face is up. State tilt_sigma_deg, how far faces may be off "
        "level,\n"
        "# and seat_sigma_deg, how well the unit sits on a face, unless the defaults fit.\n"
        "attitudes: { six_face: {} }\n";
  }
  return text +
         "# Limits of a good unit. With limits, sensors whose axes are not x, y and z need "
         "`mounting:`.\n"
         "# limits: { accelerometer.bias: 0.5, accelerometer.residual_rms: 0.02 }\n";
}

}  // namespace

Result<FirstLook> InitialExperiment(const std::vector<std::string>& inputs,
                                    const std::string& folder,
                                    const ProgressCallback& progress,
                                    const RecordingOpener& opener) {
  PosesConfig config;
  config.moves = true;  // With a gyroscope the experiment needs the readings between poses.
  FirstLook look;
  TRUETRIAD_ASSIGN_OR_RETURN(look.loaded, LoadPoses(inputs.front(), config, progress, opener));
  PerTriad<bool> seen = SeenIn(look.loaded.poses);
  for (const std::string& input : std::span(inputs).subspan(1)) {
    const auto source = opener ? opener(input, {}) : OpenRecording(input);
    if (!source) continue;  // A later attempt to read it reports the reason.
    for (const StreamInfo& stream : (*source)->info().streams) seen[stream.triad] = true;
  }
  TRUETRIAD_ASSIGN_OR_RETURN(look.experiment_yaml,
                             ExperimentFor(look.loaded, seen, inputs, folder));
  return look;
}

Result<Calibration> TryCalibration(const std::string& input,
                                   const LoadedPoses& loaded,
                                   const PosesConfig& config,
                                   const ProgressCallback& progress) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string text,
                             ExperimentFor(loaded, SeenIn(loaded.poses), {input}, ""));
  const bool is_sweep = config.kind == PoseSelectionKind::kSweep;
  std::vector<std::string> overrides;
  if (is_sweep) overrides.emplace_back("poses={ sweep: auto }");
  TRUETRIAD_ASSIGN_OR_RETURN(Experiment experiment,
                             ReadExperimentText(text, "experiment.yaml", overrides));
  if (config.given && !is_sweep) {
    const bool moves = experiment.poses.moves;
    experiment.poses = config;
    experiment.poses.moves = moves;
  }
  experiment.inputs = {input};
  return CalibrateExperiment(std::move(experiment), progress, loaded);
}

}  // namespace truetriad
