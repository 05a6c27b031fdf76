// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"
#include "truetriad/sim/scenario.h"

namespace truetriad::trust {

struct Sample {
  std::int64_t time_ns = 0;
  Eigen::Vector3d raw = Eigen::Vector3d::Zero();
  double degc = 0.0;

  double time_s() const { return 1e-9 * static_cast<double>(time_ns); }
};

// A simulated recording in memory, to be tampered with, and what a right calibration says of it.
struct Recording {
  PerTriad<std::vector<Sample>> samples;  // empty: no such sensor
  PerTriad<Unit> units;
  bool has_temperature = true;
  Calibration truth;
  std::vector<TrueRest> rests;
  std::vector<PoseRange> rest_rows;
  std::vector<StatedRate> rates;
  double duration_s = 0.0;
  // Times at which the clock was set to zero again; if any, all sensors are in one file.
  std::vector<double> clock_restarts_s;
  // The errors of the bias that were added, averaged over each rest.
  PerTriad<std::vector<Eigen::Vector3d>> rest_errors;

  // `truth` with the biases as they were on average over the rests that a calibration used.
  Calibration TruthFor(const Calibration& calibration) const;

  // RMS of the readings over the recording, raw unit.
  double Signal(Triad triad) const;
  // Adds an error of the bias to the readings, raw unit; the truth gets its mean over the rests, or
  // over the recording if there are no rests.
  void AddToBias(Triad triad, const std::function<Eigen::Vector3d(double time_s)>& error);
};

Result<Recording> Play(const Scenario& scenario, int unit);

// Writes a recording as `simulate` does: a manifest with its tables, attitudes.csv, rates.yaml.
// Returns the manifest's path.
Result<std::string> Write(const Recording& recording, const std::string& folder);

}  // namespace truetriad::trust
