// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "formats/format.h"

namespace truetriad {

// Continuous-time noise of a triad, true units: what visual-inertial programs ask for.
struct NoiseDensities {
  Eigen::Vector3d white = Eigen::Vector3d::Zero();  // unit / sqrt(Hz)
  // unit / s / sqrt(Hz); unset where a rest was too short to tell it of every axis.
  std::optional<Eigen::Vector3d> random_walk;
  double rate_hz = 0.0;
};

// One number for three axes: their RMS.
double RmsOfAxes(const Eigen::Vector3d& density);

// From --allan; unset when there is none, it does not hold the triad, or does not tell white noise
// of every axis. Error (bad input): it is in counts of unknown size.
Result<std::optional<NoiseDensities>> NoiseOf(const ExportOptions& options, Triad triad);

}  // namespace truetriad
