// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "io/yaml_reader.h"

namespace truetriad {

class FieldSchema;

/// The correction that firmware applied to a triad's readings before logging, and its inverse:
///
///   logged = matrix * (scale ∘ (raw - offset - P(T) + P(T_cal)))
///   raw    = (matrix * diag(scale))^-1 * logged + offset + P(T) - P(T_cal)
///
/// P(T) = Σ_k coefficients_k ∘ τ^k, k = 1, 2, …, with τ = clamp(T, range) - reference. T_cal, which
/// is clamped likewise, is the temperature at which the firmware's own calibration was made; if it
/// is not stated, P(T_cal) = 0. Offsets and P are in the unit of the log, T is in degC.
/// docs/recordings.md.
struct AppliedCorrection {
  struct Thermal {
    double reference_degc = 0.0;
    double low_degc = 0.0, high_degc = 0.0;
    std::vector<Eigen::Vector3d> coefficients;
    Eigen::Vector3d at_calibration = Eigen::Vector3d::Zero();  ///< P(T_cal).

    Eigen::Vector3d At(double temperature_degc) const;
  };

  Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  std::optional<Thermal> thermal;

  Eigen::Vector3d RawFromLogged(const Eigen::Vector3d& logged) const {
    return inverse * logged + offset;
  }
};

/// Reads one triad's entry of `applied:`: `none` (nullopt) or a map of offset, scale, matrix and
/// thermal. Errors, including the word `unknown`, are recorded in `yaml`.
std::optional<AppliedCorrection> ReadAppliedCorrection(YamlReader yaml);

/// Adds the schema of a triad's entry of `applied:` to `visit`, under `key`.
void AppliedSchema(std::string_view key, FieldSchema& visit);

}  // namespace truetriad
