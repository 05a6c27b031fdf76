// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/input_file.h"
#include "truetriad/base/triad.h"
#include "truetriad/base/units.h"
#include "truetriad/model/finding.h"
#include "truetriad/model/gauge.h"
#include "truetriad/model/outcome.h"
#include "truetriad/model/quality.h"
#include "truetriad/model/tags.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

/// The origin of the noise by which a triad was weighted.
enum class NoiseSource { kStatic, kAllan, kDatasheet, kConfig, kResidual };
std::string_view NoiseSourceName(NoiseSource source);
std::optional<NoiseSource> NoiseSourceFromName(std::string_view name);

/// Noise of one triad, as used for its weights.
struct TriadNoise {
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();  ///< σ of a rest's mean, RMS over the rests,
                                                    ///< raw.
  NoiseSource source = NoiseSource::kStatic;
  double excess_sigma = 0.0;  ///< Pose-to-pose excess σ, isotropic, true unit.
  double excess_dof = 0.0;    ///< Degrees of freedom of excess_sigma.
  /// Gyroscope: excess σ of a turn about each axis, beyond the noise of the readings, rad.
  double turn_excess_sigma_rad = 0.0;
};

/// A kink in the bias of one axis over temperature: above `degc`, slope (T - degc) + curve (T -
/// degc)^2 is added. The sum's value at the reference temperature is subtracted at all
/// temperatures.
struct ThermalKnot {
  int axis = 0;
  double degc = 0.0;
  double slope = 0.0, curve = 0.0;  ///< raw / degC, raw / degC^2; slope 0: no kink.
};

/// Temperature terms of one triad, in tau = T - reference. docs/method.md, "Temperature".
struct ThermalTerms {
  double reference_degc = 25.0;
  Eigen::Vector2d range_degc = Eigen::Vector2d::Zero();
  std::vector<Eigen::Vector3d> bias;                 ///< Of tau^1, tau^2, …; raw / degC^i.
  std::vector<Eigen::Matrix3d> sensitivity;          ///< Of tau^1, …; raw per true unit / degC^i.
  PerRateTerm<std::optional<Eigen::Vector3d>> rate;  ///< raw / (degC/s), …: terms.h.
  /// First-order lags of each axis, s (model/thermal.h); unset: no lag. The element's temperature
  /// lags behind the thermometer's; the rate in the bias terms lags behind that of the element's
  /// temperature.
  std::optional<Eigen::Vector3d> element_lag_s, rate_lag_s;
  /// Half-width of the window that smoothed the temperature to obtain its rate, s; 0: not stated.
  double smoothing_s = 0.0;
  std::vector<ThermalKnot> knots = {};
  /// Lowest and highest rate that occurred in a sweep, degC/s; unset: not stated.
  std::optional<Eigen::Vector2d> rate_range_degcps = {};
};

/// The calibration of one triad.
struct TriadCalibration {
  std::string input_unit;
  std::string output_unit;
  TriadModel<double> model;  ///< Bias (raw), sensitivity (raw per true unit), axis terms.
  /// Body axes along which the sensing axes point (model/mounting.h), as stated or else as found.
  Eigen::Matrix3d mounting = Eigen::Matrix3d::Identity();
  Eigen::Vector3d bias_sigma = Eigen::Vector3d::Zero();
  Eigen::Matrix3d sensitivity_sigma = Eigen::Matrix3d::Zero();
  /// σ of each axis term's coefficients; unset if the model lacks the term.
  PerAxisTerm<std::optional<Eigen::Vector3d>> axis_term_sigma;
  std::optional<Eigen::Matrix3d> g_sensitivity;
  std::optional<ThermalTerms> thermal;
  std::optional<double> si_per_count;  ///< True units per count, when the recording stated it.
  TriadNoise noise;

  /// The sensitivity to truth along the intended sensing axes: S transpose(M), M the mounting.
  Eigen::Matrix3d BySensingAxes() const { return model.sensitivity * mounting.transpose(); }
  /// Gains: the diagonal of S transpose(M), negative for an axis that reads with opposite sign.
  Eigen::Vector3d Scale() const { return BySensingAxes().diagonal(); }
  /// K^-1 S transpose(M) - I with K = diag(S transpose(M)), rad.
  Eigen::Matrix3d MisalignmentRad() const;
};

/// Covariance of all `parameters`, in the stated gauge; singular if entries are fixed or tied.
struct NamedCovariance {
  std::vector<std::string>
      parameters;  ///< "accelerometer.bias.x", "magnetometer.sensitivity.zz", …
  Eigen::MatrixXd matrix;

  /// Standard uncertainty of an entry by its name; zero if it is not listed.
  double Sigma(const std::string& parameter) const;
};

/// The reference quantities of the surroundings.
struct ReferenceValues {
  double gravity_mps2 = kStandardGravityMps2;
  std::optional<double> gravity_sigma_mps2;  ///< Prior σ; unset: exact.
  std::optional<double> field_ut;  ///< Field strength, used or estimated; only with a magnetometer.
  std::optional<double> dip_rad;
  bool field_estimated = false;  ///< Strength or dip was estimated.
  /// The strength is nominal: the magnetometer's common scale is not observable.
  bool field_nominal = false;
  /// Rotation fixture <- world as qw, qx, qy, qz, if the fixture's attitude was estimated. World x
  /// is magnetic north if there is a magnetometer, else the fixture's x.
  std::optional<Eigen::Vector4d> fixture_from_world;
  double temperature_degc = 25.0;
  /// Temperatures recorded at the poses: lowest, mean, highest; unset without a thermometer.
  std::optional<Eigen::Vector3d> recorded_degc = {};
};

/// A decision about a unit after its run; it overrides the verdict by the limits.
struct Decision {
  Verdict verdict = Verdict::kFail;  ///< kPass: it may be shipped; kFail: it may not.
  std::string who, why;
  std::string created;  ///< ISO 8601, UTC.
  /// Made by a later run of the unit or by another sensor of the device, not by a person.
  bool is_automatic = false;
};

/// Everything calibration.yaml holds.
struct Calibration {
  std::string serial;
  std::string model;
  Tags tags;
  std::string software_version;
  std::string created;  ///< ISO 8601, UTC.
  std::vector<InputFile> inputs;
  Mode mode = Mode::kPoses;
  Outcome outcome = Outcome::kNotCalled;  ///< Follows from the findings.
  std::optional<bool> within_limits;
  Findings findings;
  ReferenceValues reference;
  Gauge gauge = Gauge::kAccelX;
  Triad gauge_sensor = Triad::kAccelerometer;
  PerTriad<std::optional<TriadCalibration>> sensors;
  NamedCovariance covariance;
  Quality quality;
  std::string config_yaml;          ///< The resolved experiment, as YAML text.
  std::vector<Decision> decisions;  ///< In the order in which they were made: the last one holds.

  bool IsUsable() const { return outcome == Outcome::kConverged; }
  /// The last decision if there is one, else the verdict by the limits.
  Verdict verdict() const {
    return IsUsable() && !decisions.empty() ? decisions.back().verdict : LimitsVerdict();
  }
  Verdict LimitsVerdict() const {
    if (!IsUsable()) return Verdict::kNoResult;
    if (!within_limits) return Verdict::kNoLimits;
    return *within_limits ? Verdict::kPass : Verdict::kFail;
  }
  /// The code of the first refusal ("wrong-unit"); if no refusal has a code, the outcome's name.
  std::string_view ReasonNotUsable() const {
    const Finding* refusal = FirstRefusal(findings);
    return refusal == nullptr || refusal->code == FindingCode::kMessage
               ? OutcomeName(outcome)
               : FindingCodeName(refusal->code);
  }
};

}  // namespace truetriad
