// SPDX-License-Identifier: Apache-2.0
#include "truetriad/problem/options.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "base/named_values.h"

namespace truetriad {
namespace {

constexpr NamedValues<MatrixModel, 5> kModels = {{
    {MatrixModel::kBias, "bias"},
    {MatrixModel::kDiagonal, "diagonal"},
    {MatrixModel::kSymmetric, "symmetric"},
    {MatrixModel::kFull, "full"},
    {MatrixModel::kAuto, "auto"},
}};

constexpr NamedValues<ThermalMatrix, 3> kThermalMatrices = {{
    {ThermalMatrix::kFull, "full"},
    {ThermalMatrix::kDiagonal, "diagonal"},
    {ThermalMatrix::kScale, "scale"},
}};

constexpr NamedValues<RegressionFactor, kRegressionFactors> kFactors = {{
    {RegressionFactor::kReading, "reading"},
    {RegressionFactor::kTemperature, "temperature"},
    {RegressionFactor::kRate, "rate"},
    {RegressionFactor::kAmbient, "ambient"},
    {RegressionFactor::kAmbientRate, "ambient_rate"},
}};

constexpr NamedValues<Wanted, 3> kWanted = {{
    {Wanted::kNo, "false"},
    {Wanted::kYes, "true"},
    {Wanted::kAuto, "auto"},
}};

}  // namespace

std::string_view WantedName(Wanted wanted) { return kWanted.Name(wanted); }

std::string_view ThermalMatrixName(ThermalMatrix shape) { return kThermalMatrices.Name(shape); }

std::string_view RegressionFactorName(RegressionFactor factor) { return kFactors.Name(factor); }

double Nonlinearity::SigmaOf(const AxisTermInfo& term, double raw_per_true) const {
  return 0.01 * percent_of_full_scale /
         (term.beyond_line * term.PowerOf(raw_per_true * full_scale));
}

bool Nonlinearity::IsValid() const {
  return percent_of_full_scale > 0.0 && percent_of_full_scale <= kMostPercent && full_scale > 0.0 &&
         std::isfinite(full_scale);
}

bool ThermalOptions::any() const {
  return bias_order > 0 || matrix_order > 0 || rate.any() || needs_sweep();
}
bool ThermalOptions::needs_sweep() const {
  return lags_auto || lags > 0 || !knots_degc.empty() || find_knots > 0 || has_regression();
}
bool ThermalOptions::has_regression() const {
  return std::find(regression.begin(), regression.end(), true) != regression.end();
}
bool ThermalOptions::is_open() const {
  return bias_order_auto || rate_auto || matrix_order_auto || (matrix_auto && matrix_order > 0);
}

std::string_view MatrixModelName(MatrixModel model) { return kModels.Name(model); }

Eigen::Vector3d AllanNoise::MeanSigma(double duration_s) const {
  // The flicker floor of an Allan variance, 2 ln 2 / π of the instability squared (IEEE 952).
  constexpr double kFloorVariance = 2.0 * std::numbers::ln2 / std::numbers::pi;
  return (white_density_raw.cwiseAbs2() / duration_s + kFloorVariance * instability_raw.cwiseAbs2())
      .cwiseSqrt();
}

bool AllanNoise::IsValid() const {
  return white_density_raw.allFinite() && (white_density_raw.array() > 0.0).all() &&
         instability_raw.allFinite() && (instability_raw.array() >= 0.0).all();
}

bool CalibrateOptions::HasGyroscopeAlone() const {
  return triads[Triad::kGyroscope].enabled && !triads[Triad::kAccelerometer].enabled &&
         !triads[Triad::kMagnetometer].enabled;
}

bool CalibrateOptions::IsBodyKnown() const {
  return attitudes.kind != AttitudeKind::kNone || (HasGyroscopeAlone() && has_stated_axes);
}

Mode CalibrateOptions::mode() const {
  return motion ? Mode::kMotion : sweep ? Mode::kSweep : Mode::kPoses;
}

bool CalibrateOptions::HasThermal() const {
  return std::any_of(triads.begin(), triads.end(), [](const TriadOptions& triad) {
    return triad.enabled && triad.thermal.any();
  });
}

bool CalibrateOptions::TurnsAgainstField() const {
  return triads[Triad::kGyroscope].enabled && triads[Triad::kMagnetometer].enabled &&
         !triads[Triad::kAccelerometer].enabled && attitudes.kind == AttitudeKind::kNone;
}

bool CalibrateOptions::HasSessionBias(Triad triad) const {
  return triads[triad].bias_per_session.value_or(triad != Triad::kMagnetometer);
}

bool CalibrateOptions::HasChoice() const {
  return std::any_of(triads.begin(), triads.end(), [this](const TriadOptions& triad) {
    return triad.enabled &&
           ((triad.thermal.is_open() && !sweep) || triad.model == MatrixModel::kAuto ||
            triad.g_sensitivity == Wanted::kAuto || triad.HasAxisTerm(Wanted::kAuto));
  });
}

}  // namespace truetriad
