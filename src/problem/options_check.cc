// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>

#include "base/sensor_line.h"
#include "truetriad/model/quality.h"
#include "truetriad/problem/options.h"

namespace truetriad {
namespace {

// Least σ that is accepted, raw unit: no sensor has less noise, and products of the resulting
// weight, 1e60, with other weights do not overflow a double.
constexpr double kLeastSigma = 1e-30;

// Collects the errors in the options, part by part.
class OptionsCheck {
 public:
  explicit OptionsCheck(const CalibrateOptions& options) : options_(options) {}

  void Sensor(Triad triad);
  void Bends(Triad triad);
  void Reference();
  void Attitudes();
  void Sweep();
  void Motion();
  void Limits();
  void HasSomethingToEstimate();
  std::string WhyAbsent(const LimitName& limit) const;
  void Rest();
  void Require(std::string_view key, bool good, const std::string& problem) {
    if (good) return;
    if (problems_.empty()) key_ = key;
    if (!problems_.empty()) problems_ += "; ";
    problems_ += problem;
  }

  Status Result() const {
    if (problems_.empty()) return {};
    return Error(ErrorCode::kInvalidExperiment, problems_).About(key_);
  }

 private:
  bool Has(Triad triad) const { return options_.triads[triad].enabled; }
  bool HoldsAll(Triad triad) const;

  const CalibrateOptions& options_;
  std::string problems_;
  std::string key_;  // the experiment's key of the first problem
};

std::string SensorKey(Triad triad) { return "sensors." + std::string(TriadName(triad)); }

void OptionsCheck::Sensor(Triad triad) {
  const TriadOptions& sensor = options_.triads[triad];
  const std::string name(TriadName(triad)), key = SensorKey(triad);
  Require(
      key + ".g_sensitivity",
      sensor.g_sensitivity == Wanted::kNo || Has(Triad::kAccelerometer),
      name + ": g-sensitivity needs the accelerometer; enable it too, or remove `g_sensitivity`");
  const auto require_owner =
      [&](Wanted wanted, const std::string& term, std::string_view term_key, Triad owner) {
        Require(key + "." + std::string(term_key),
                wanted == Wanted::kNo || triad == owner,
                name + ": " + term + " exists only for the " + std::string(TriadName(owner)) +
                    "; remove it");
      };
  require_owner(sensor.g_sensitivity, "a g-sensitivity", "g_sensitivity", Triad::kGyroscope);
  for (const AxisTermInfo& info : kAxisTerms) {
    require_owner(sensor.axis_terms[info.term], WithArticle(info.words), info.name, info.triad);
  }
  if (options_.initialise.only) {
    const bool has_more = std::any_of(kAxisTerms.begin(), kAxisTerms.end(), [&](const auto& info) {
      return sensor.axis_terms[info.term] != Wanted::kNo;
    });
    Require(key,
            !has_more && !sensor.thermal.any() && sensor.g_sensitivity == Wanted::kNo,
            name +
                ": `initialise: { only: true }` computes only a bias and a matrix; remove the "
                "other terms, or that key");
  }
  Require(key + ".noise",
          sensor.excess_sigma >= 0.0 && std::isfinite(sensor.excess_sigma),
          name + ": excess sigma " + std::to_string(sensor.excess_sigma) + " must be >= 0");
  Require(key + ".noise",
          !sensor.noise_sigma_raw || (sensor.noise_sigma_raw->array() >= kLeastSigma).all(),
          name + ": every noise sigma must be > 0, and at least 1e-30");
  Require(key + ".noise",
          !sensor.allan || !sensor.noise_sigma_raw,
          name + ": noise is given twice, as sigma and from an Allan deviation; remove one");
  Require(key + ".noise",
          !sensor.allan || sensor.allan->IsValid(),
          name + ": an Allan deviation's noise density must be > 0 and its instability >= 0");
  Bends(triad);
  Require(key + ".thermal",
          options_.sweep || !sensor.thermal.needs_sweep(),
          name +
              ": knots, lags and a regression need a sweep; state `poses: { sweep: auto }`, or "
              "remove them");
  const auto require_order = [&](const char* what, int order, int most) {
    Require(key + ".thermal",
            order >= 0 && order <= most,
            name + ": thermal " + what + " order " + std::to_string(order) +
                " must lie between 0 and " + std::to_string(most));
  };
  require_order("bias", sensor.thermal.bias_order, ThermalOptions::kMaxBiasOrder);
  require_order("matrix", sensor.thermal.matrix_order, ThermalOptions::kMaxMatrixOrder);
}

void OptionsCheck::Bends(Triad triad) {
  const TriadOptions& sensor = options_.triads[triad];
  const std::string name(TriadName(triad)), key = SensorKey(triad) + ".nonlinearity";
  if (!sensor.nonlinearity) return;
  Require(key,
          sensor.nonlinearity->IsValid(),
          name +
              ": the non-linearity must be above 0 and at most 10 % of the full scale, and the "
              "full scale above 0");
  const Knowledge& field = triad == Triad::kAccelerometer ? options_.reference.gravity_mps2
                                                          : options_.reference.field_ut;
  Require(key,
          triad == Triad::kGyroscope || !field.known() ||
              sensor.nonlinearity->full_scale > *field.value,
          name +
              ": the full scale of the non-linearity is less than the field that the sensor "
              "measures; state the end of the sensor's measuring range");
  Require(key,
          !options_.initialise.only,
          name +
              ": start values have no σ that the non-linearity could widen; remove `nonlinearity`, "
              "or `initialise: { only: true }`");
  // If quadratic and cubic terms are both estimated, a stated nonlinearity would have no term whose
  // σ it could widen.
  Require(key,
          sensor.axis_terms[AxisTerm::kQuadratic] != Wanted::kYes ||
              sensor.axis_terms[AxisTerm::kCubic] != Wanted::kYes,
          name +
              ": quadratic and cubic terms are estimated, which leaves no non-linearity to state; "
              "remove `nonlinearity`, or one of the two terms");
}

void OptionsCheck::Reference() {
  const ReferenceOptions& reference = options_.reference;
  Require("reference.gravity",
          reference.gravity_mps2.known() && *reference.gravity_mps2.value > 0.0,
          "gravity must be known and positive");
  Require("reference",
          !reference.field_ut.known() || *reference.field_ut.value > 0.0,
          "field strength must be positive");
  if (!reference.earth_rate || !Has(Triad::kGyroscope)) return;
  constexpr std::string_view kKey = "reference.earth_rate";
  Require(kKey,
          std::abs(reference.earth_rate->latitude_rad) <= 0.5 * std::numbers::pi &&
              std::isfinite(reference.earth_rate->declination_rad),
          "earth rate: the latitude must lie between -90 and 90 degrees, and the declination "
          "must be finite");
  Require(
      kKey,
      !options_.HasGyroscopeAlone() && ((Has(Triad::kMagnetometer) && Has(Triad::kAccelerometer)) ||
                                        options_.attitudes.kind == AttitudeKind::kGiven),
      "earth rate: heading is unobservable, so the earth rate in the body frame is unknown; "
      "enable accelerometer and magnetometer too, give the attitudes (`attitudes: { file: … }`), "
      "or "
      "remove "
      "`reference.earth_rate`");
  Require(kKey,
          !options_.motion,
          "earth rate: not modelled if the unit is tumbled without rests; remove "
          "`reference.earth_rate` or `poses: { motion: {} }`");
}

void OptionsCheck::Attitudes() {
  const AttitudeOptions& attitudes = options_.attitudes;
  Require("gauge",
          options_.gauge != Gauge::kFixture || options_.IsBodyKnown(),
          "gauge `fixture` needs known attitudes or, for a gyroscope alone, known axes of turns or "
          "rates");
  Require("attitudes",
          attitudes.kind != AttitudeKind::kSixFace || Has(Triad::kAccelerometer),
          "six-face attitudes need the accelerometer to determine which face is up; enable it");
  Require("attitudes.fixture_rotation",
          !attitudes.unknown_fixture_rotation ||
              (attitudes.kind == AttitudeKind::kGiven && Has(Triad::kAccelerometer)),
          "an unknown fixture rotation needs given attitudes and the accelerometer; enable both");
  Require("attitudes",
          attitudes.tilt_sigma_deg > 0.0 && attitudes.seat_sigma_deg >= 0.0,
          "tilt sigma must be > 0 and seat sigma >= 0 degrees");
}

bool OptionsCheck::HoldsAll(Triad triad) const {
  const TriadOptions& sensor = options_.triads[triad];
  return sensor.fixed_bias && (sensor.fixed_sensitivity || sensor.model == MatrixModel::kBias) &&
         !sensor.HasAxisTerm(Wanted::kYes) && !sensor.HasAxisTerm(Wanted::kAuto) &&
         sensor.g_sensitivity == Wanted::kNo && !sensor.thermal.any();
}

// Requires a free parameter of some sensor; free gravity or field does not suffice.
void OptionsCheck::HasSomethingToEstimate() {
  bool is_any = false, is_any_free = false;
  for (const Triad triad : kTriads) {
    is_any |= Has(triad);
    is_any_free |= Has(triad) && !HoldsAll(triad);
  }
  Require("sensors", is_any, "no sensor is enabled: list at least one under `sensors:`");
  Require("sensors",
          !is_any || is_any_free,
          "every parameter is held by `fixed:`, so that nothing is left to estimate; free at least "
          "one parameter");
}

void OptionsCheck::Sweep() {
  Require("attitudes",
          !options_.motion && options_.attitudes.kind == AttitudeKind::kNone,
          "sweep: cannot be combined with motion or known attitudes; remove `attitudes:`");
  Require("reference.earth_rate",
          !options_.reference.earth_rate,
          "sweep: the earth rate is part of the bias of a unit at rest; remove "
          "`reference.earth_rate`");
  for (const Triad triad : kTriads) {
    if (!Has(triad)) continue;
    const TriadOptions& sensor = options_.triads[triad];
    const std::string name(TriadName(triad));
    Require(SensorKey(triad),
            sensor.thermal.bias_order > 0,
            name + ": a sweep determines how the bias depends on temperature; state " +
                SensorLine(triad, "thermal: { bias_order: … }") + ", or remove the sensor");
    Require(SensorKey(triad),
            sensor.thermal.matrix_order == 0,
            name +
                ": a sweep in few attitudes cannot separate sensitivity from bias; remove "
                "`matrix_order`, or record poses at several temperatures (a soak)");
    Require(SensorKey(triad),
            !sensor.HasAxisTerm(Wanted::kYes) && !sensor.HasAxisTerm(Wanted::kAuto) &&
                sensor.g_sensitivity == Wanted::kNo,
            name +
                ": a sweep determines only terms that change with temperature; remove "
                "g-sensitivity, quadratic, cubic and asymmetry terms");
  }
}

void OptionsCheck::Motion() {
  Require("poses.motion",
          options_.motion->spacing_s >= 0.0 && std::isfinite(options_.motion->spacing_s),
          "motion: spacing " + std::to_string(options_.motion->spacing_s) + " s must be >= 0");
  Require("poses.motion",
          Has(Triad::kGyroscope) && (Has(Triad::kAccelerometer) || Has(Triad::kMagnetometer)),
          "motion: tracking the attitude needs the gyroscope and the accelerometer or "
          "magnetometer; list them under `sensors:` (to keep a sensor's nominal gains, state " +
              SensorLine(Triad::kAccelerometer, "fixed: { matrix: identity }") + ")");
  Require("attitudes",
          options_.attitudes.kind == AttitudeKind::kNone,
          "motion: a tumbling unit has no known attitudes; remove `attitudes:`");
  Require(
      "sensors", !options_.HasThermal(), "motion: temperature terms need rests; remove `thermal:`");
  Require("sensors",
          !options_.HasChoice(),
          "motion: choosing a model needs rests; name the models and terms instead of `auto`");
  for (const AxisTermInfo& info : kAxisTerms) {
    Require("sensors",
            options_.triads[info.triad].axis_terms[info.term] == Wanted::kNo,
            "motion: " + WithArticle(info.words) + " needs rests; remove it");
  }
  Require("initialise",
          !options_.initialise.only && options_.initialise.method == InitialiseMethod::kAuto,
          "motion: without rests, only `initialise: { method: auto }` finds start values; state "
          "it, or remove `initialise:`");
}

// If the result cannot have the quantity of this limit: why, and the remedy. Otherwise empty.
std::string OptionsCheck::WhyAbsent(const LimitName& limit) const {
  const std::string_view quantity = limit.quantity.name;
  const bool needs_field = quantity == "reference.field_ut" || limit.GoesWithField();
  if (limit.triad && !Has(*limit.triad)) {
    return "no " + std::string(TriadName(*limit.triad)) +
           " is calibrated; list it under `sensors:`, or remove the limit";
  }
  if (quantity.starts_with("reference.") && quantity != "reference.gravity_mps2" &&
      !Has(Triad::kMagnetometer)) {
    return "no magnetometer is calibrated; list it under `sensors:`, or remove the limit";
  }
  if (needs_field && !options_.reference.field_ut.known() &&
      !options_.triads[Triad::kMagnetometer].fixed_sensitivity) {
    return "the field strength is unknown, so that the magnetometer has no scale; state "
           "`reference: { field: { strength_ut: … } }`, or remove the limit";
  }
  if (limit.IsSlope() && !options_.triads[*limit.triad].thermal.any()) {
    return "no temperature terms of the " + std::string(TriadName(*limit.triad)) +
           " are estimated; state " + SensorLine(*limit.triad, "thermal: { bias_order: … }") +
           ", or remove the limit";
  }
  if (quantity == "held_out_rms" && options_.cross_validation_folds == 0) {
    return "no poses are held out; state `cross_validation: { folds: 5 }`, or remove the limit";
  }
  return "";
}

void OptionsCheck::Limits() {
  const LimitOptions& limits = options_.limits;
  Require("limits", limits.guard_band_k >= 0.0, "guard band must be >= 0");
  Require("limits",
          limits.limits.empty() || !options_.initialise.only,
          "limits: start values have no σ, without which no limit can be judged; remove the "
          "limits, or `initialise: { only: true }`");
  bool is_any_there = limits.limits.empty();
  for (const auto& [name, limit] : limits.limits) {
    const auto parsed = ParseLimitName(name);
    const std::string absent = parsed ? WhyAbsent(*parsed) : "";
    Require(
        "limits." + name, absent.empty() || limit.if_present, "limit `" + name + "`: " + absent);
    is_any_there |= absent.empty() || !limit.if_present;
  }
  Require("limits",
          is_any_there,
          "limits: this calibration has none of the limited quantities; state limits for the "
          "calibrated sensors");
}

void OptionsCheck::Rest() {
  Require("robust",
          options_.robust.scale > 0.0,
          "robust scale " + std::to_string(options_.robust.scale) + " must be > 0");
  Require("cross_validation",
          options_.cross_validation_folds == 0 || options_.cross_validation_folds >= 2,
          "cross-validation folds must be 0 or at least 2");
  Require("observable_sigma",
          options_.observable_sigma > 0.0 && options_.observable_sigma < 1.0,
          "observable_sigma must lie between 0 and 1");
}

}  // namespace

Status CalibrateOptions::Validate() const {
  OptionsCheck check(*this);
  check.HasSomethingToEstimate();
  for (const Triad triad : kTriads) {
    if (triads[triad].enabled) check.Sensor(triad);
  }
  check.Reference();
  check.Attitudes();
  if (sweep) check.Sweep();
  if (motion) check.Motion();
  check.Limits();
  check.Rest();
  return check.Result();
}

}  // namespace truetriad
