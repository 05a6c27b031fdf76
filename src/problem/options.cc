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
std::optional<MatrixModel> MatrixModelFromName(std::string_view name) { return kModels.Find(name); }

Eigen::Vector3d AllanNoise::MeanSigma(double duration_s) const {
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
  return attitudes.kind != AttitudeKind::kNone || HasGyroscopeAlone();
}

bool CalibrateOptions::HasThermal() const {
  return std::any_of(triads.begin(), triads.end(), [](const TriadOptions& triad) {
    return triad.enabled && triad.thermal.any();
  });
}

bool CalibrateOptions::HasChoice() const {
  return std::any_of(triads.begin(), triads.end(), [this](const TriadOptions& triad) {
    return triad.enabled &&
           ((triad.thermal.is_open() && !sweep) || triad.model == MatrixModel::kAuto ||
            triad.g_sensitivity == Wanted::kAuto || triad.HasAxisTerm(Wanted::kAuto));
  });
}

Status CalibrateOptions::Validate() const {
  std::string problems;
  // The key of the experiment that a problem is about; the first problem's is said.
  std::string key = "sensors", first_key;
  const auto require = [&](bool good, const std::string& problem) {
    if (good) return;
    if (problems.empty()) first_key = key;
    if (!problems.empty()) problems += "; ";
    problems += problem;
  };
  bool any = false;
  for (const Triad triad : kTriads) {
    const TriadOptions& sensor = triads[triad];
    if (!sensor.enabled) continue;
    any = true;
    const std::string name(TriadName(triad));
    key = "sensors." + name;
    require(sweep || triad != Triad::kGyroscope || triads[Triad::kAccelerometer].enabled ||
                HasGyroscopeAlone(),
            "gyroscope: its turns are measured against gravity; enable the accelerometer too, or "
            "calibrate it alone from known turns and rates");
    key = "sensors." + name + ".g_sensitivity";
    require(
        sensor.g_sensitivity == Wanted::kNo || triads[Triad::kAccelerometer].enabled,
        name + ": g-sensitivity needs the accelerometer; enable it too, or remove `g_sensitivity`");
    const auto require_owner =
        [&](Wanted wanted, const std::string& term, std::string_view term_key, Triad owner) {
          key = "sensors." + name + "." + std::string(term_key);
          require(wanted == Wanted::kNo || triad == owner,
                  name + ": " + term + " exists only for the " + std::string(TriadName(owner)) +
                      "; remove it");
        };
    require_owner(sensor.g_sensitivity, "a g-sensitivity", "g_sensitivity", Triad::kGyroscope);
    for (const AxisTermInfo& info : kAxisTerms) {
      require_owner(sensor.axis_terms[info.term], WithArticle(info.words), info.name, info.triad);
    }
    key = "sensors." + name + ".noise";
    require(sensor.excess_sigma >= 0.0 && std::isfinite(sensor.excess_sigma),
            name + ": excess sigma " + std::to_string(sensor.excess_sigma) + " must be >= 0");
    require(!sensor.noise_sigma_raw || (sensor.noise_sigma_raw->array() > 0.0).all(),
            name + ": every noise sigma must be > 0");
    require(!sensor.allan || !sensor.noise_sigma_raw,
            name + ": noise is given twice, as sigma and from an Allan deviation");
    require(!sensor.allan || sensor.allan->IsValid(),
            name + ": an Allan deviation's noise density must be > 0 and its instability >= 0");
    const auto require_order = [&](const char* what, int order, int most) {
      require(order >= 0 && order <= most,
              name + ": thermal " + what + " order " + std::to_string(order) +
                  " must lie between 0 and " + std::to_string(most));
    };
    key = "sensors." + name + ".thermal";
    require(sweep || !sensor.thermal.needs_sweep(),
            name + ": knots, lags and a regression need a sweep");
    require_order("bias", sensor.thermal.bias_order, ThermalOptions::kMaxBiasOrder);
    require_order("matrix", sensor.thermal.matrix_order, ThermalOptions::kMaxMatrixOrder);
  }
  key = "sensors";
  require(any, "no sensor is enabled: list at least one under `sensors:`");
  key = "reference.gravity";
  require(reference.gravity_mps2.known() && *reference.gravity_mps2.value > 0.0,
          "gravity must be known and positive");
  if (reference.earth_rate && triads[Triad::kGyroscope].enabled) {
    key = "reference.earth_rate";
    require(std::abs(reference.earth_rate->latitude_rad) <= 0.5 * std::numbers::pi &&
                std::isfinite(reference.earth_rate->declination_rad),
            "earth rate: the latitude must lie between -90 and 90 degrees, and the declination be "
            "finite");
    require(!HasGyroscopeAlone() &&
                (triads[Triad::kMagnetometer].enabled || attitudes.kind == AttitudeKind::kGiven),
            "earth rate: heading is unobservable, so the earth rate in the body frame is unknown; "
            "enable the magnetometer too, give the attitudes (`attitudes: { file }`), or remove "
            "`reference.earth_rate`");
    require(!motion,
            "earth rate: it is not modelled for a unit that is tumbled without rests; remove "
            "`reference.earth_rate` or `poses: { motion }`");
  }
  key = "reference";
  require(!reference.field_ut.known() || *reference.field_ut.value > 0.0,
          "field strength must be positive");
  key = "gauge";
  require(gauge != Gauge::kFixture || IsBodyKnown(), "gauge `fixture` needs known attitudes");
  key = "attitudes";
  require(attitudes.kind != AttitudeKind::kSixFace || triads[Triad::kAccelerometer].enabled,
          "six-face attitudes need the accelerometer to tell which face is up; enable it");
  key = "attitudes.fixture_rotation";
  require(!attitudes.unknown_fixture_rotation ||
              (attitudes.kind == AttitudeKind::kGiven && triads[Triad::kAccelerometer].enabled),
          "an unknown fixture rotation needs given attitudes and the accelerometer; enable both");
  key = "attitudes";
  require(attitudes.tilt_sigma_deg > 0.0 && attitudes.seat_sigma_deg >= 0.0,
          "tilt sigma must be > 0 and seat sigma >= 0 degrees");
  key = "robust";
  require(robust.scale > 0.0, "robust scale " + std::to_string(robust.scale) + " must be > 0");
  if (sweep) {
    key = "attitudes";
    require(!motion && attitudes.kind == AttitudeKind::kNone,
            "sweep: cannot be combined with motion or known attitudes; remove `attitudes:`");
    key = "reference.earth_rate";
    require(!reference.earth_rate,
            "sweep: the earth rate is part of the bias of a unit at rest; remove "
            "`reference.earth_rate`");
    for (const Triad triad : kTriads) {
      const TriadOptions& sensor = triads[triad];
      key = "sensors." + std::string(TriadName(triad));
      require(!sensor.enabled || sensor.thermal.bias_order > 0,
              std::string(TriadName(triad)) +
                  ": a sweep determines how the bias depends on temperature; state `thermal: { "
                  "bias_order: … }`, or remove the sensor");
      require(!sensor.enabled || sensor.thermal.matrix_order == 0,
              std::string(TriadName(triad)) +
                  ": a sweep in few attitudes cannot separate sensitivity from bias; remove "
                  "`matrix_order`, or record poses at several temperatures (a soak)");
      require(
          !sensor.enabled ||
              (!sensor.HasAxisTerm(Wanted::kYes) && !sensor.HasAxisTerm(Wanted::kAuto) &&
               sensor.g_sensitivity == Wanted::kNo),
          std::string(TriadName(triad)) +
              ": a sweep determines only terms that change with temperature; remove the others");
    }
  }
  if (motion) {
    key = "poses.motion";
    require(motion->spacing_s >= 0.0 && std::isfinite(motion->spacing_s),
            "motion: spacing " + std::to_string(motion->spacing_s) + " s must be >= 0");
    require(triads[Triad::kAccelerometer].enabled && triads[Triad::kGyroscope].enabled,
            "motion: needs both the accelerometer and the gyroscope to track the attitude; list "
            "both (with `fixed: { matrix: identity }` for one that is not to be calibrated)");
    key = "attitudes";
    require(attitudes.kind == AttitudeKind::kNone,
            "motion: a tumbling unit has no known attitudes; remove `attitudes:`");
    key = "sensors";
    require(!HasThermal(), "motion: temperature terms need rests; remove `thermal:`");
    require(!HasChoice(),
            "motion: choosing a model needs rests; name the models and terms instead of `auto`");
    for (const AxisTermInfo& info : kAxisTerms) {
      require(triads[info.triad].axis_terms[info.term] == Wanted::kNo,
              "motion: " + WithArticle(info.words) + " needs rests; remove it");
    }
    key = "initialise";
    require(!initialise.only && initialise.method == InitialiseMethod::kAuto,
            "motion: only `initialise: { method: auto }` starts without rests");
  }
  key = "cross_validation";
  require(cross_validation_folds == 0 || cross_validation_folds >= 2,
          "cross-validation folds must be 0 or at least 2");
  key = "observable_sigma";
  require(observable_sigma > 0.0 && observable_sigma < 1.0,
          "observable_sigma must lie between 0 and 1");
  key = "limits";
  require(limits.guard_band_k >= 0.0, "guard band must be >= 0");
  if (problems.empty()) return {};
  return UsageError(problems, first_key);
}

}  // namespace truetriad
