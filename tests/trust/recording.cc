// SPDX-License-Identifier: Apache-2.0
#include "trust/recording.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <utility>

#include "data/memory_source.h"
#include "io/known_motion_file.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"

namespace truetriad::trust {
namespace {

std::string AttitudesOf(const std::vector<TrueRest>& rests) {
  std::string text = "qw,qx,qy,qz\n";
  for (const TrueRest& rest : rests) {
    const Eigen::Quaterniond& q = rest.world_from_body;
    char line[120];
    std::snprintf(line, sizeof line, "%.12f,%.12f,%.12f,%.12f\n", q.w(), q.x(), q.y(), q.z());
    text += line;
  }
  return text;
}

// Rewrites a table so that its times begin at zero at each restart.
Status RestartClock(const std::vector<double>& restarts_s, const std::string& path) {
  std::ifstream file(path);
  std::string text, line;
  while (std::getline(file, line)) {
    const bool is_data = !line.empty() && std::isdigit(static_cast<unsigned char>(line[0])) != 0;
    if (is_data) {
      const double time_s = std::stod(line);
      double restart_s = 0.0;
      for (const double at_s : restarts_s) restart_s = at_s <= time_s ? at_s : restart_s;
      char time[40];
      std::snprintf(time, sizeof time, "%.9f", time_s - restart_s);
      line = time + line.substr(line.find(','));
    }
    text += line + '\n';
  }
  return WriteFileAtomically(path, text);
}

}  // namespace

double Recording::Signal(Triad triad) const {
  double squares = 0.0;
  for (const Sample& sample : samples[triad]) squares += sample.raw.squaredNorm();
  return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(samples[triad].size(), 1)));
}

void Recording::AddToBias(Triad triad, const std::function<Eigen::Vector3d(double time_s)>& error) {
  for (Sample& sample : samples[triad]) sample.raw += error(sample.time_s());
  std::vector<std::pair<double, double>> spans;
  for (const TrueRest& rest : rests) spans.emplace_back(rest.start_s, rest.end_s);
  if (spans.size() < 3) spans = {{0.0, duration_s}};
  constexpr int kSteps = 200;
  std::vector<Eigen::Vector3d>& errors = rest_errors[triad];
  errors.resize(spans.size(), Eigen::Vector3d::Zero());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t rest = 0; rest < spans.size(); ++rest) {
    const auto& [begin, end] = spans[rest];
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (int i = 0; i < kSteps; ++i) {
      mean += error(begin + (i + 0.5) / kSteps * (end - begin)) / kSteps;
    }
    errors[rest] += mean;
    sum += mean;
  }
  if (truth.sensors[triad]) {
    truth.sensors[triad]->model.bias += sum / static_cast<double>(spans.size());
  }
}

Calibration Recording::TruthFor(const Calibration& calibration) const {
  Calibration used = truth;
  for (const Triad triad : kTriads) {
    const std::vector<Eigen::Vector3d>& errors = rest_errors[triad];
    const auto poses = static_cast<std::size_t>(calibration.quality.poses);
    if (!used.sensors[triad] || errors.size() != poses || poses < 3) continue;
    Eigen::Vector3d all = Eigen::Vector3d::Zero(), kept = all;
    double count = 0.0;
    for (std::size_t rest = 0; rest < poses; ++rest) {
      all += errors[rest] / static_cast<double>(poses);
      const auto& rejected = calibration.quality.rests.rejected_poses;
      const bool is_rejected =
          std::any_of(rejected.begin(), rejected.end(), [&](const RejectedPose& pose) {
            return pose.triad == triad && pose.pose == static_cast<int>(rest) + 1;
          });
      if (is_rejected) continue;
      kept += errors[rest];
      count += 1.0;
    }
    if (count > 0.0) used.sensors[triad]->model.bias += kept / count - all;
  }
  return used;
}

Result<Recording> Play(const Scenario& scenario, int unit) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Simulation> simulation,
                             Simulation::Create(scenario, unit));
  Recording recording;
  for (const StreamInfo& stream : simulation->info().streams) {
    recording.units[stream.triad] = stream.unit;
    recording.has_temperature = stream.has_temperature;
  }
  for (std::vector<SampleBlock> blocks;;) {
    TRUETRIAD_ASSIGN_OR_RETURN(const bool more, simulation->Next(&blocks));
    if (!more) break;
    for (const SampleBlock& block : blocks) {
      for (std::size_t i = 0; i < block.x.size(); ++i) {
        recording.samples[block.triad].push_back(
            {block.time_ns[i],
             {block.x[i], block.y[i], block.z[i]},
             block.temperature_degc.empty() ? 0.0 : block.temperature_degc[i]});
      }
    }
  }
  recording.truth = TruthOf(scenario, unit, *simulation);
  recording.rests = simulation->rests();
  recording.rest_rows = simulation->rest_rows();
  recording.rates = simulation->rates();
  recording.duration_s = simulation->duration_s();
  return recording;
}

Result<std::string> Write(const Recording& recording, const std::string& folder) {
  std::vector<MemoryStream> streams;
  RecordingFormat format;
  format.one_file = !recording.clock_restarts_s.empty();
  for (const Triad triad : kTriads) {
    if (recording.samples[triad].empty()) continue;
    MemoryStream& stream = streams.emplace_back(triad);
    stream.info.unit = recording.units[triad];
    for (const Sample& sample : recording.samples[triad]) {
      stream.Add(sample.time_ns, sample.raw);
      if (recording.has_temperature) stream.temperature_degc.push_back(sample.degc);
    }
    format.decimals[triad] = 7;
  }
  format.temperature_decimals = 2;
  MemorySource source(std::move(streams));
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(folder));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string manifest, WriteRecording(source, format, folder));
  if (format.one_file) {
    TRUETRIAD_RETURN_IF_ERROR(RestartClock(recording.clock_restarts_s, folder + "/recording.csv"));
  }
  TRUETRIAD_RETURN_IF_ERROR(
      WriteFileAtomically(folder + "/attitudes.csv", AttitudesOf(recording.rests)));
  TRUETRIAD_RETURN_IF_ERROR(
      WriteFileAtomically(folder + "/poses.yaml", PoseRangesToYaml(recording.rest_rows)));
  if (!recording.rates.empty()) {
    TRUETRIAD_RETURN_IF_ERROR(
        WriteFileAtomically(folder + "/rates.yaml", StatedRatesToYaml(recording.rates)));
  }
  return manifest;
}

}  // namespace truetriad::trust
