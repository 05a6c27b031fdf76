// SPDX-License-Identifier: Apache-2.0
#include "sweep/calibrate_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "base/messages.h"
#include "base/sensor_line.h"
#include "model/mechanisms.h"
#include "problem/parameter_name.h"
#include "sweep/triad_sweep.h"
#include "verdict/checks/check.h"
#include "verdict/reference_temperature.h"
#include "verdict/result.h"

namespace truetriad {
namespace {

// Chosen: least temperature range of a sweep. Terms from a smaller one hardly hold elsewhere.
constexpr double kLeastRangeDegc = 2.0;
// Chance causes a difference from gravity of more than so many σ once in two million sweeps.
constexpr double kHeldGravitySigmas = 5.0;
// If the difference is more than this share of gravity (10 mg), ageing does not explain it: the
// calibration is that of another unit.
constexpr double kOtherUnitShare = 0.01;
// Temperatures that differ by less count as the same: at 1 mg/degC biases differ by 0.5 mg.
constexpr double kSameDegc = 0.5;
// Chosen: the largest range that counts as one temperature: 5 mg of bias at 1 mg/degC.
constexpr double kMostStaticRangeDegc = 5.0;

// Copies the covariance of the static calibration's parameters, with cross terms between sensors.
void TakeStaticCovariance(const Calibration& known, NamedCovariance* covariance) {
  std::vector<int> places, known_places;
  for (std::size_t i = 0; i < covariance->parameters.size(); ++i) {
    const auto name = ParameterName::Parse(covariance->parameters[i]);
    if (!name || name->is_thermal()) continue;
    if (name->triad == Triad::kGyroscope && name->kind == ParameterKind::kBias) continue;
    const int known_at = PlaceOf(known.covariance, *name);
    if (known_at < 0) continue;
    places.push_back(static_cast<int>(i));
    known_places.push_back(known_at);
  }
  covariance->matrix(places, places) = known.covariance.matrix(known_places, known_places);
}

// Applies the static calibration to the sweep's reading at the temperature of that calibration, and
// compares the result with gravity. If chance explains the difference, the result is unset; if
// ageing cannot explain it, a refusal; otherwise a warning.
std::optional<Finding> MissedGravity(const Calibration& calibration,
                                     const TriadSweep& swept,
                                     const std::string& static_file) {
  const TriadCalibration& sensor = *calibration.sensors[Triad::kAccelerometer];
  Eigen::Vector3d reading;
  for (int axis = 0; axis < 3; ++axis) {
    reading[axis] = swept.choices()[static_cast<std::size_t>(axis)].fit.coefficients[0] +
                    swept.problem().origin()[axis];
  }
  const double seen = sensor.model.TruthFromRaw(reading).norm();
  const double off = seen - calibration.reference.gravity_mps2;
  const double sigma = sensor.bias_sigma.norm() + sensor.noise.excess_sigma;
  if (std::abs(off) < kHeldGravitySigmas * sigma) return std::nullopt;
  const bool is_other = std::abs(off) > kOtherUnitShare * calibration.reference.gravity_mps2;
  Finding finding(
      FindingCode::kGravityMissed,
      Format("the static calibration, at its own temperature, corrects the sweep's readings to "
             "%.4f m/s^2, ",
             seen) +
          Format("which differs from gravity by %+.4f ", off) + Format("± %.2g: ", sigma) +
          (is_other ? static_file + " is the calibration of another unit"
                    : "the unit or its thermometer has changed in between"),
      is_other ? "calibrate this unit at one temperature" : "");
  if (is_other && Acts(Mechanism::kGravityMissed)) {
    finding.As(Severity::kRefusal);
  } else {
    finding.text += "; the σ of the static calibration's bias are widened accordingly";
    finding.Shifting(std::abs(off) / sigma, Treatment::kWidened);
  }
  return finding.About(Triad::kAccelerometer).With("error", off, sigma, "m/s^2");
}

// Widens the σ of the bias on all axes. If the unit changed by `off_mps2` along gravity, it may
// have changed as much along any axis.
void WidenBias(double off_mps2, Calibration* calibration) {
  TriadCalibration& sensor = *calibration->sensors[Triad::kAccelerometer];
  const Eigen::Vector3d off_raw = std::abs(off_mps2) * sensor.model.sensitivity.rowwise().norm();
  for (int axis = 0; axis < 3; ++axis) {
    sensor.bias_sigma[axis] = std::hypot(sensor.bias_sigma[axis], off_raw[axis]);
    const int at =
        PlaceOf(calibration->covariance, {Triad::kAccelerometer, ParameterKind::kBias, 0, axis, 0});
    if (at >= 0) calibration->covariance.matrix(at, at) += off_raw[axis] * off_raw[axis];
  }
}

// RMS length of a triad's residual vectors, true unit.
double ResidualRms(const Calibration& calibration, Triad triad) {
  Eigen::Vector3d raw = Eigen::Vector3d::Zero();
  for (const SweepAxis& axis : calibration.quality.sweep.axes) {
    if (axis.triad == triad) raw[axis.axis] = axis.rms_after;
  }
  return (calibration.sensors[triad]->model.Correction() * raw.asDiagonal()).norm();
}

// Error: there is a limit on a quantity that the sweep holds fixed.
Status CheckLimits(const CalibrateOptions& options, Triad triad) {
  for (const auto& [name, limit] : options.limits.limits) {
    const auto parsed = ParseLimitName(name);
    if (!parsed || parsed->triad != triad) continue;
    const std::string_view what = parsed->quantity.name;
    if (what == "residual_rms" || parsed->IsSlope()) continue;
    if (triad == Triad::kGyroscope && what == "bias") continue;
    return Error(ErrorCode::kInvalidExperiment,
                 "limits: " + name +
                     " limits a quantity that a sweep does not measure; give a calibration at one "
                     "temperature as `static: FILE.yaml`, or remove the limit")
        .About("limits." + name);
  }
  return {};
}

std::string NameOf(Triad triad, int axis) {
  return std::string(TriadName(triad)) + " " + AxisLetter(axis);
}

// Reports the axes whose residuals exceed their noise by far.
void SayUnexplained(const Quality& quality, Findings* findings) {
  // Chosen: residuals of up to five times the noise are not reported.
  constexpr double kMuch = 5.0;
  for (const SweepAxis& axis : quality.sweep.axes) {
    const double times = axis.rms_after / axis.noise_sigma;
    if (!(times > kMuch)) continue;
    const std::string gap =
        std::abs(axis.branch_gap_after) > axis.rms_after
            ? "heating and cooling still differ (hysteresis, or a lag that was not estimated)"
            : "look for drift, a moved unit, or a thermometer that does not follow the sensor";
    findings->push_back(Finding(FindingCode::kSweepUnexplained,
                                NameOf(axis.triad, axis.axis) +
                                    Format(": residuals are %.0f times the noise: ", times) + gap)
                            .About(axis.triad, axis.axis)
                            .With("times_noise", times));
  }
}

// Reports the axes whose stated order is too low.
void SayOrderTooLow(Triad triad, const std::vector<SweepChoice>& axes, Findings* findings) {
  std::string names;
  int higher = 0;
  double moved_sigmas = 0.0;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    if (!axes[axis].higher) continue;
    names += names.empty() ? " " : ", ";
    names += AxisLetter(static_cast<int>(axis));
    higher = std::max(higher, axes[axis].higher->terms.bias_order);
    moved_sigmas = std::max(moved_sigmas, axes[axis].moved_sigmas);
  }
  if (names.empty()) return;
  const std::string order = std::to_string(higher);
  findings->push_back(
      Finding(
          FindingCode::kSweepUnexplained,
          std::string(TriadName(triad)) + names + ": with the stated bias_order of " +
              std::to_string(axes.front().fit.terms.bias_order) +
              ", residuals remain that a bias_order of " + order +
              " would explain; the σ are widened accordingly",
          "state " + SensorLine(triad, "thermal: { bias_order: " + order + " }") + ", or `auto`")
          .About(triad)
          .Shifting(moved_sigmas, Treatment::kWidened)
          .With("order", higher));
}

// Reports the terms left out. One finding names all axes that have the same term and reason.
void SayLeftOut(const Quality& quality, Findings* findings) {
  std::vector<std::pair<std::string, std::vector<const SweepAxis*>>> said;
  for (const SweepAxis& axis : quality.sweep.axes) {
    for (const std::string& words : axis.left_out) {
      auto same = std::find_if(
          said.begin(), said.end(), [&](const auto& entry) { return entry.first == words; });
      if (same == said.end()) same = said.insert(same, {words, {}});
      same->second.push_back(&axis);
    }
  }
  for (const auto& [words, axes] : said) {
    const SweepAxis& first = *axes.front();
    std::string names;
    bool is_one_sensor = true;
    for (const SweepAxis* axis : axes) {
      names += (names.empty() ? "" : ", ") + NameOf(axis->triad, axis->axis);
      is_one_sensor = is_one_sensor && axis->triad == first.triad;
    }
    Finding& finding =
        findings->emplace_back(FindingCode::kTermsLeftOut, names + ": left out " + words);
    if (is_one_sensor) finding.About(first.triad);
    if (axes.size() == 1) finding.About(first.triad, first.axis);
  }
}

// Error: the static calibration was recorded over a range of temperatures, so that its bias holds
// at no single temperature.
Status CheckRecorded(const Eigen::Vector3d& recorded_degc, const std::string& file) {
  const double spread = recorded_degc[2] - recorded_degc[0];
  if (spread <= kMostStaticRangeDegc) return {};
  return Error(ErrorCode::kDoesNotMatch,
               file + Format(": was recorded over %.1f to ", recorded_degc[0]) +
                   Format("%.1f degC, so that its bias belongs to no single temperature; ",
                          recorded_degc[2]) +
                   Format("record it at one temperature, to within %.0f degC, or calibrate with "
                          "`thermal:` over all poses",
                          kMostStaticRangeDegc));
}

Finding RecordedElsewhere(const Eigen::Vector3d& recorded_degc,
                          double reference_degc,
                          const std::string& file) {
  return Finding(
             FindingCode::kStaticTemperature,
             file + Format(": was recorded at %.1f degC", recorded_degc[1]) +
                 Format(" (%.1f to ", recorded_degc[0]) +
                 Format("%.1f), not at its ", recorded_degc[2]) +
                 Format("reference temperature of %.1f degC: ", reference_degc) +
                 Format("bias and sensitivity are used as those at %.1f degC", recorded_degc[1]))
      .With("recorded", recorded_degc[1], "degC")
      .With("reference", reference_degc, "degC");
}

// Takes reference values and frame from the static calibration; its temperature becomes the
// reference of the temperature terms. Error (bad input): a sweep cannot add temperature terms to
// this calibration.
Status TakeStatic(const SweepOptions& sweep, Calibration* calibration, double* reference_degc) {
  const Calibration& known = *sweep.static_calibration;
  if (!known.IsUsable()) {
    return Error(ErrorCode::kCalibrationNotUsable,
                 {sweep.static_file},
                 "is not usable (" + std::string(known.ReasonNotUsable()) + ")");
  }
  *reference_degc = known.reference.temperature_degc;
  // A calibration with temperature terms is refused later (TriadSweep::Run).
  const bool has_terms = std::any_of(kTriads.begin(), kTriads.end(), [&](Triad triad) {
    return known.sensors[triad] && known.sensors[triad]->thermal;
  });
  if (const auto& recorded = known.reference.recorded_degc; recorded && !has_terms) {
    TRUETRIAD_RETURN_IF_ERROR(CheckRecorded(*recorded, sweep.static_file));
    if (std::abs((*recorded)[1] - *reference_degc) > kSameDegc) {
      calibration->findings.push_back(
          RecordedElsewhere(*recorded, *reference_degc, sweep.static_file));
    }
    *reference_degc = (*recorded)[1];
  }
  calibration->reference = known.reference;
  calibration->reference.recorded_degc.reset();
  calibration->gauge = known.gauge;
  calibration->gauge_sensor = known.gauge_sensor;
  return {};
}

// The refusal if there are too few windows or too small a temperature range for the terms.
std::optional<Finding> TooLittle(const TriadSweep& swept, Triad triad) {
  const int most = ThermalOptions::kMaxBiasOrder + 3 + swept.problem().attitude_count();
  const int windows = swept.problem().size();
  if (windows < 3 * most) {
    return Finding(FindingCode::kTooFewWindows,
                   std::string(TriadName(triad)) + ": there are " + std::to_string(windows) +
                       " windows; at least " + std::to_string(3 * most) + " are needed")
        .About(triad)
        .With("windows", windows)
        .With("needed", 3 * most);
  }
  const Eigen::Vector2d range = swept.range_degc();
  if (range[1] - range[0] >= kLeastRangeDegc) return std::nullopt;
  return Finding(FindingCode::kTemperatureRangeTooSmall,
                 Format("the temperature changes by %.2f degC only", range[1] - range[0]),
                 "sweep over the range in which the unit is to work")
      .With("range", range[1] - range[0], "degC");
}

// Checks whether the sweep passes the stated temperatures: the reference and the knots.
Status CheckStatedTemperatures(const CalibrateOptions& options,
                               const TriadSweep& swept,
                               Triad triad,
                               double reference_degc,
                               Findings* findings) {
  const std::string name(TriadName(triad));
  const Eigen::Vector2d range = swept.range_degc();
  if (reference_degc < range[0] || reference_degc > range[1]) {
    const std::string where = Format("%.1f degC lies outside of the sweep's ", reference_degc) +
                              Format("%.1f to ", range[0]) + Format("%.1f degC", range[1]);
    if (options.sweep->static_calibration) {
      return Error(ErrorCode::kDoesNotMatch,
                   {options.sweep->static_file},
                   "its temperature of " + where +
                       ", so that the terms would be extrapolated; repeat the sweep over a range "
                       "that includes it");
    }
    findings->push_back(Finding(FindingCode::kReferenceExtrapolated,
                                name + ": the reference temperature of " + where +
                                    "; values at this temperature are extrapolated")
                            .About(triad)
                            .With("reference", reference_degc, "degC")
                            .With("lowest", range[0], "degC")
                            .With("highest", range[1], "degC"));
  }
  for (const double knot : options.triads[triad].thermal.knots_degc) {
    if (knot > range[0] && knot < range[1]) continue;
    const std::string key = "sensors." + name + ".thermal.knots";
    return Error(ErrorCode::kInvalidExperiment,
                 key + Format(": %g degC lies outside of the ", knot) +
                     Format("sweep's %.1f to ", range[0]) + Format("%.1f degC", range[1]))
        .About(key);
  }
  return {};
}

// χ² summed over all axes, and its degrees of freedom.
struct Chi2 {
  double sum = 0.0, dof = 0.0;
};

void AddDegreesOfFreedom(const TriadSweep& swept, Quality* quality, Chi2* chi2) {
  for (int axis = 0; axis < 3; ++axis) {
    const SweepFit& fit = swept.choices()[static_cast<std::size_t>(axis)].fit;
    const Eigen::VectorXd variance = swept.problem().noise_variance().row(axis).transpose();
    const auto n = static_cast<double>(fit.residuals.size());
    const auto parameters = static_cast<double>(fit.coefficients.size());
    quality->effective_dof = std::min(
        quality->effective_dof, std::max(1.0, EffectiveCount(n, fit.correlation) - parameters));
    quality->dof += n - parameters;
    if (!(variance.minCoeff() > 0.0)) continue;
    chi2->sum += fit.residuals.cwiseAbs2().cwiseQuotient(variance).sum();
    chi2->dof += n - parameters;
  }
}

// Calibrates one triad and adds its findings. A refusal among them ends the run.
Status SweepTriad(const PoseSet& poses,
                  const CalibrateOptions& options,
                  Triad triad,
                  Calibration* calibration,
                  Chi2* chi2) {
  const double reference_degc = calibration->reference.temperature_degc;
  Findings& findings = calibration->findings;
  TriadSweep swept(poses, options, triad, reference_degc);
  if (auto refusal = TooLittle(swept, triad)) {
    findings.push_back(*std::move(refusal));
    return {};
  }
  TRUETRIAD_RETURN_IF_ERROR(
      CheckStatedTemperatures(options, swept, triad, reference_degc, &findings));
  TRUETRIAD_RETURN_IF_ERROR(swept.Run(calibration));
  SayOrderTooLow(triad, swept.choices(), &findings);
  calibration->quality.residual_rms[triad] = ResidualRms(*calibration, triad);
  const bool has_static = options.sweep->static_calibration.has_value();
  if (!has_static) TRUETRIAD_RETURN_IF_ERROR(CheckLimits(options, triad));
  if (triad != Triad::kGyroscope && !has_static) {
    findings.push_back(
        Finding(
            FindingCode::kHeldAtReference,
            std::string(TriadName(triad)) +
                ": bias and sensitivity at the reference temperature are held fixed, not measured: "
                "with unknown attitudes only the temperature terms can be determined",
            "give a calibration at one temperature as `static: FILE.yaml`")
            .About(triad));
  }
  if (triad == Triad::kAccelerometer && has_static) {
    if (auto miss = MissedGravity(*calibration, swept, options.sweep->static_file)) {
      findings.push_back(*std::move(miss));
    }
  }
  AddDegreesOfFreedom(swept, &calibration->quality, chi2);
  return {};
}

}  // namespace

Status CalibrateSweep(const PoseSet& poses,
                      const CalibrateOptions& options,
                      CalibrationSummary* summary) {
  Calibration& calibration = summary->calibration;
  Quality& quality = calibration.quality;
  if (poses.sweep.temperature.empty()) {
    return Error(ErrorCode::kInvalidExperiment,
                 "a sweep is calibrated from windows of a recording; state "
                 "`poses: { sweep: auto }`")
        .About("poses");
  }
  quality.poses = static_cast<int>(poses.poses.size());
  double reference = options.reference.temperature_degc;
  if (options.sweep->static_calibration) {
    TRUETRIAD_RETURN_IF_ERROR(TakeStatic(*options.sweep, &calibration, &reference));
  }
  calibration.reference.temperature_degc = reference;
  Chi2 chi2;
  quality.effective_dof = std::numeric_limits<double>::infinity();
  for (const Triad triad : kTriads) {
    if (!options.triads[triad].enabled) continue;
    TRUETRIAD_RETURN_IF_ERROR(SweepTriad(poses, options, triad, &calibration, &chi2));
    if (OutcomeOf(calibration.findings) != Outcome::kConverged) {
      return Conclude(options, poses, &calibration);
    }
  }
  if (options.sweep->static_calibration) {
    TakeStaticCovariance(*options.sweep->static_calibration, &calibration.covariance);
    if (const Finding* missed = Find(calibration.findings, FindingCode::kGravityMissed);
        missed != nullptr && Acts(Mechanism::kGravityMissed)) {
      WidenBias(*missed->Value("error"), &calibration);
    }
  }
  quality.reduced_chi2 =
      chi2.dof > 0.0 ? chi2.sum / chi2.dof : std::numeric_limits<double>::quiet_NaN();
  quality.reduced_chi2_before = quality.reduced_chi2;
  SayLeftOut(quality, &calibration.findings);
  SayUnexplained(quality, &calibration.findings);
  const Findings few =
      CheckDegreesOfFreedom(quality.effective_dof,
                            "the residuals vary slowly, so that neighbouring windows are not "
                            "independent: repeat the sweep, or make it longer");
  calibration.findings.insert(calibration.findings.end(), few.begin(), few.end());
  const Findings non_finite = CheckFinite(TriadOptions(), true, calibration.covariance);
  if (non_finite.empty()) {
    StateAbout(options.reference.temperature_degc, &calibration);
  } else {
    calibration.findings.insert(calibration.findings.end(), non_finite.begin(), non_finite.end());
  }
  return Conclude(options, poses, &calibration);
}

}  // namespace truetriad
