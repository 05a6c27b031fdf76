// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// Corrects the readings of one triad: truth = S(T)^-1 Felt(raw - b(T) - G f), with the terms of
/// triad_model.h. docs/method.md, "Temperature".
class ReadingCorrector {
 public:
  /// Error: the calibration does not apply to readings in this unit, or to readings without
  /// temperature.
  static Result<ReadingCorrector> Create(const TriadCalibration& calibration,
                                         const StreamInfo& stream);

  bool needs_force() const { return calibration_.g_sensitivity.has_value(); }
  bool is_thermal() const { return calibration_.thermal.has_value(); }
  /// Whether truth = correction * (raw - bias), with the same correction and bias for all readings.
  bool is_linear() const {
    return !is_thermal() && !needs_force() &&
           std::none_of(calibration_.model.axis_terms.begin(),
                        calibration_.model.axis_terms.end(),
                        [](const Eigen::Vector3d& term) { return !term.isZero(0.0); });
  }

  /// Corrects `count` readings, stored as x y z x y z …, if is_linear(). `truth` may be `raw`.
  void CorrectAll(const double* raw, std::size_t count, double* truth) const {
    const Eigen::Matrix3d correction = correction_;
    const Eigen::Vector3d bias = bias_;
    for (std::size_t i = 0; i < 3 * count; i += 3) {
      const Eigen::Vector3d reading =
          raw_scale_ * Eigen::Map<const Eigen::Vector3d>(raw + i) - bias;
      Eigen::Map<Eigen::Vector3d>(truth + i).noalias() = correction * reading;
    }
  }

  /// Readings must be in time order. `force_mps2` is the corrected specific force, used only when
  /// needs_force().
  Eigen::Vector3d Correct(std::int64_t time_ns,
                          const Eigen::Vector3d& raw,
                          double temperature_degc,
                          const Eigen::Vector3d& force_mps2) {
    if (follows_time_) {
      FollowTemperature(time_ns, temperature_degc);
    } else if (is_thermal()) {
      SetTemperature(temperature_degc);
    }
    Eigen::Vector3d reading = raw_scale_ * raw - bias_;
    if (needs_force()) reading -= *calibration_.g_sensitivity * force_mps2;
    return correction_ * calibration_.model.Felt(reading);
  }

  /// Whether the temperature of the last correction was outside the calibrated range, so that its
  /// limit was used.
  bool clamped() const { return clamped_; }

 private:
  ReadingCorrector(const TriadCalibration& calibration, double raw_scale)
      : calibration_(calibration),
        raw_scale_(raw_scale),
        filter_(calibration.thermal.value_or(ThermalTerms())),
        bias_(calibration.model.bias),
        correction_(calibration.model.Correction()) {
    if (!calibration.thermal) return;
    const ThermalTerms& thermal = *calibration.thermal;
    follows_time_ = thermal.element_lag_s || thermal.rate.any();
  }

  // With lags or rate terms, the model changes with every reading.
  void FollowTemperature(std::int64_t time_ns, double temperature_degc) {
    if (!start_ns_) {
      if (std::isnan(temperature_degc)) {
        bias_.setConstant(std::numeric_limits<double>::quiet_NaN());
        return;
      }
      start_ns_ = time_ns;
    }
    ThermalState state =
        filter_.Next(static_cast<double>(time_ns - *start_ns_) * 1e-9, temperature_degc);
    const Eigen::Vector2d& range = calibration_.thermal->range_degc;
    const Eigen::Vector3d held = state.degc.cwiseMax(range[0]).cwiseMin(range[1]);
    clamped_ = held != state.degc;
    state.degc = held;
    const TriadModel<double> model =
        ModelAtTemperature(calibration_.model, *calibration_.thermal, state);
    bias_ = model.bias;
    if (!calibration_.thermal->sensitivity.empty()) correction_ = model.Correction();
  }

  void SetTemperature(double temperature_degc) {
    if (temperature_degc == temperature_degc_) return;  // Usual, since logs repeat temperatures.
    temperature_degc_ = temperature_degc;
    const ThermalTerms& thermal = *calibration_.thermal;
    const double used = std::clamp(temperature_degc, thermal.range_degc[0], thermal.range_degc[1]);
    clamped_ = !std::isnan(temperature_degc) && used != temperature_degc;
    const TriadModel<double> model = ModelAtTemperature(calibration_.model, thermal, used);
    bias_ = model.bias;
    correction_ = model.Correction();
  }

  TriadCalibration calibration_;
  double raw_scale_;  ///< Raw units of the calibration in one raw unit of the log.
  double temperature_degc_ = std::numeric_limits<double>::quiet_NaN();
  TemperatureFilter filter_;
  bool follows_time_ = false;
  std::optional<std::int64_t> start_ns_;
  Eigen::Vector3d bias_;
  Eigen::Matrix3d correction_;
  bool clamped_ = false;
};

}  // namespace truetriad
