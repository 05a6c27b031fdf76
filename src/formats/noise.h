// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "formats/format.h"

namespace truetriad {

// Continuous-time noise of a triad, true units: what visual-inertial programs ask for.
struct NoiseDensities {
  Eigen::Vector3d white = Eigen::Vector3d::Zero();        // unit / sqrt(Hz)
  Eigen::Vector3d random_walk = Eigen::Vector3d::Zero();  // unit / s / sqrt(Hz)
  double rate_hz = 0.0;

  // One number for the three axes: their RMS.
  double white_rms() const;
  double random_walk_rms() const;
};

// White noise of a triad, true unit / sqrt(Hz), and the rate at which it was seen.
struct WhiteNoise {
  Eigen::Vector3d density = Eigen::Vector3d::Zero();
  double rate_hz = 0.0;
};

// From --allan, whether or not a random walk was seen; unset when there is none, it does not hold
// the triad, or some axis has no coefficient. Error (bad input): it is in counts of unknown size.
Result<std::optional<WhiteNoise>> WhiteNoiseOf(const ExportOptions& options, Triad triad);

// From --allan; unset when there is none, it does not hold the triad, or some axis has no
// coefficient. Error (bad input): it is in counts of unknown size.
Result<std::optional<NoiseDensities>> NoiseOf(const ExportOptions& options, Triad triad);

}  // namespace truetriad
