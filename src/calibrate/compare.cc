// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "base/named_values.h"
#include "calibrate/compared_values.h"
#include "calibrate/reading_units.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "math/distributions.h"
#include "truetriad/calibrate/evaluate.h"
#include "verdict/presentation.h"
#include "verdict/reference_temperature.h"

namespace truetriad {
namespace {

// The summed covariance is scaled to unit diagonal. If an eigenvalue is below this share of the
// largest, it is rounding: the gauge fixes its entries or ties them to each other.
constexpr double kTiedShare = 1e-9;
// If a variance is below this share of the largest variance in its group, the entry is fixed and
// the variance is rounding.
constexpr double kFixedShare = 1e-20;
// If a difference is below this share of the largest entry in its group, it is rounding.
constexpr double kRounding = 1e-6;

// Whether the calibration holds every term that its covariance lists.
bool HoldsItsTerms(const Calibration& calibration) {
  for (const std::string& name : calibration.covariance.parameters) {
    const auto entry = ParameterName::Parse(name);
    if (!entry) continue;
    const auto& sensor = calibration.sensors[entry->triad];
    if (!sensor) return false;
    const ThermalTerms thermal = sensor->thermal.value_or(ThermalTerms());
    const auto power = static_cast<std::size_t>(entry->power);
    const ParameterInfo& info = InfoOf(entry->kind);
    const bool held = info.axis_term ? sensor->axis_term_sigma[*info.axis_term].has_value()
                      : info.rate    ? thermal.rate[*info.rate].has_value()
                      : entry->kind == ParameterKind::kBias ? power <= thermal.bias.size()
                      : entry->kind == ParameterKind::kSensitivity
                          ? power <= thermal.sensitivity.size()
                          : sensor->g_sensitivity.has_value();
    if (!held) return false;
  }
  return true;
}

// If a gyroscope was calibrated alone, its body axes are the axes of the turns that the operator
// stated. They are assumed to be the body axes of the other calibration.
bool HasFrameFromOutside(const Calibration& calibration) {
  return calibration.gauge == Gauge::kFixture && calibration.gauge_sensor == Triad::kGyroscope;
}

bool HaveOneFrame(const Calibration& a, const Calibration& b) {
  return a.gauge_sensor == b.gauge_sensor || HasFrameFromOutside(a) || HasFrameFromOutside(b);
}

Status CheckComparable(const Calibration& a, const Calibration& b) {
  if (!a.IsUsable() || !b.IsUsable()) {
    return Error(ErrorCode::kCalibrationNotUsable,
                 "both calibrations must be usable: a is " + std::string(OutcomeName(a.outcome)) +
                     ", b is " + std::string(OutcomeName(b.outcome)));
  }
  if (!HoldsItsTerms(a) || !HoldsItsTerms(b)) {
    return Error(ErrorCode::kDamagedFile,
                 "the covariance of one calibration lists parameters that this calibration does "
                 "not hold; its file was edited by hand");
  }
  for (const Triad triad : kTriads) {
    if (!a.sensors[triad] || !b.sensors[triad]) continue;
    const auto& thermal_a = a.sensors[triad]->thermal;
    const auto& thermal_b = b.sensors[triad]->thermal;
    if (thermal_a && thermal_b && thermal_a->reference_degc != thermal_b->reference_degc) {
      return Error(ErrorCode::kDoesNotMatch,
                   std::string(TriadName(triad)) + ": the temperature terms of a are relative to " +
                       std::to_string(thermal_a->reference_degc) + " degC, those of b to " +
                       std::to_string(thermal_b->reference_degc) +
                       " degC, and cannot be converted; calibrate both with the same "
                       "reference.temperature_degc");
    }
  }
  return {};
}

// Whether a calibration holds a whole group fixed (zero variances), although it estimates other
// parameters of the same sensor.
bool IsHeld(const Calibration& calibration, const std::string& group) {
  const NamedCovariance& covariance = calibration.covariance;
  const std::string sensor = group.substr(0, group.find('.') + 1);
  bool is_listed = false, is_sensor_estimated = false;
  for (std::size_t i = 0; i < covariance.parameters.size(); ++i) {
    const std::string& name = covariance.parameters[i];
    const auto at = static_cast<Eigen::Index>(i);
    const bool is_estimated = covariance.matrix(at, at) > 0.0;
    is_sensor_estimated = is_sensor_estimated || (is_estimated && name.starts_with(sensor));
    if (name.substr(0, name.rfind('.')) != group) continue;
    if (is_estimated) return false;
    is_listed = true;
  }
  return is_listed && is_sensor_estimated;
}

// The groups of parameters ("accelerometer.thermal.bias.1") that only one covariance lists or that
// only one calibration holds fixed. Also temperature terms without covariance, and sensors that
// only one calibration has.
std::vector<std::string> HeldByOneAlone(const Calibration& a, const Calibration& b) {
  std::set<std::string> groups;
  const auto add = [&groups](const Calibration& one, const Calibration& other, const char* which) {
    const std::vector<std::string>& names = other.covariance.parameters;
    for (const std::string& name : one.covariance.parameters) {
      const auto entry = ParameterName::Parse(name);
      if (!entry) continue;
      if (!other.sensors[entry->triad]) {
        groups.insert(std::string(TriadName(entry->triad)) + " (only in " + which + ")");
        continue;
      }
      const std::string group = name.substr(0, name.rfind('.'));
      if (IsHeld(one, group)) groups.insert(group + " (held fixed in " + which + ")");
      if (std::find(names.begin(), names.end(), name) != names.end()) continue;
      groups.insert(group + " (only in " + which + ")");
    }
  };
  add(a, b, "a");
  add(b, a, "b");
  for (const auto& [one, which] : {std::pair(&a, "a"), std::pair(&b, "b")}) {
    const std::vector<std::string>& names = one->covariance.parameters;
    for (const Triad triad : kTriads) {
      if (!one->sensors[triad] || !one->sensors[triad]->thermal) continue;
      const std::string prefix = std::string(TriadName(triad)) + ".thermal";
      const bool listed = std::any_of(names.begin(), names.end(), [&](const std::string& name) {
        return name.starts_with(prefix);
      });
      if (!listed) groups.insert(prefix + " (without σ in " + which + ")");
    }
  }
  return {groups.begin(), groups.end()};
}

// Whether `name` is a rate term that a and b relate to different temperatures: one to that of the
// sensing element, the other to that of a thermometer, which may lead or lag the element.
bool IsOfAnotherTemperature(const Calibration& a, const Calibration& b, const std::string& name) {
  const auto entry = ParameterName::Parse(name);
  if (!entry || !InfoOf(entry->kind).rate) return false;
  const auto &one = a.sensors[entry->triad]->thermal, &other = b.sensors[entry->triad]->thermal;
  if (!one || !other) return false;
  const auto has_lag = [&](const std::optional<Eigen::Vector3d>& lags) {
    return lags && (*lags)[entry->row] > 0.0;
  };
  return has_lag(one->element_lag_s) != has_lag(other->element_lag_s) ||
         has_lag(one->rate_lag_s) != has_lag(other->rate_lag_s) ||
         (one->smoothing_s > 0.0) != (other->smoothing_s > 0.0);
}

// If the field strength was a convention, the common scale of the magnetometer's gains is unknown:
// `a` is scaled to `b`, and the uncertainty of the scale is projected out of both covariances. If S
// is scaled by 1 + e, log det S changes by 3 e; so
//
//   x -> x - v (w x)      v = (S, its temperature terms)      w = transpose(S^-1) / 3      w v = 1
//
// with S the mean of both, so that the same direction is projected out of both.
void TakeOutCommonScale(PresentedSolution* a, PresentedSolution* b) {
  constexpr Triad kTriad = Triad::kMagnetometer;
  const double factor = std::cbrt(std::abs(b->models[kTriad]->sensitivity.determinant() /
                                           a->models[kTriad]->sensitivity.determinant()));
  a->models[kTriad]->sensitivity *= factor;
  if (a->thermal[kTriad]) {
    for (Eigen::Matrix3d& term : a->thermal[kTriad]->sensitivity) term *= factor;
  }
  const Eigen::Matrix3d sensitivity =
      0.5 * (a->models[kTriad]->sensitivity + b->models[kTriad]->sensitivity);
  const Eigen::Matrix3d inverse = sensitivity.inverse();
  for (const auto& [solution, scaled] : {std::pair(a, factor), std::pair(b, 1.0)}) {
    NamedCovariance& covariance = solution->covariance;
    const auto size = static_cast<Eigen::Index>(covariance.parameters.size());
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(size), v = Eigen::VectorXd::Zero(size), w = v;
    for (Eigen::Index i = 0; i < size; ++i) {
      const auto name = ParameterName::Parse(covariance.parameters[static_cast<std::size_t>(i)]);
      if (!name || name->triad != kTriad || name->kind != ParameterKind::kSensitivity) continue;
      scale[i] = scaled;
      if (name->power == 0) {
        v[i] = sensitivity(name->row, name->col);
        w[i] = inverse(name->col, name->row) / 3.0;
      } else {
        v[i] = solution->thermal[kTriad]->sensitivity[static_cast<std::size_t>(name->power) - 1](
            name->row, name->col);
      }
    }
    Eigen::MatrixXd map = scale.asDiagonal();
    map -= v * w.cwiseProduct(scale).transpose();
    covariance.matrix = map * covariance.matrix * map.transpose();
  }
}

// The temperature that a calibration's temperature terms are relative to; unset without any.
std::optional<double> ReferenceOfTerms(const Calibration& calibration) {
  for (const auto& sensor : calibration.sensors) {
    if (sensor && sensor->thermal) return sensor->thermal->reference_degc;
  }
  return std::nullopt;
}

// The p-value of the comparison, from the F distribution instead of χ². The degrees of freedom of
// the σ are those of the calibration that has fewer.
double AgreementOf(const Comparison& comparison, const Calibration& a, const Calibration& b) {
  double dof = std::numeric_limits<double>::infinity();
  for (const Calibration* calibration : {&a, &b}) {
    if (calibration->quality.effective_dof > 0.0) {
      dof = std::min(dof, calibration->quality.effective_dof);
    }
  }
  return 1.0 - FisherCdf(comparison.chi2 / comparison.dof, comparison.dof, dof);
}

// A parameter with an uncertainty in both calibrations: its places in the covariances.
struct CommonParameter {
  Eigen::Index in_a = 0, in_b = 0;
  double difference = 0.0;
};

struct LargestEntries {
  double variance = 0.0, value = 0.0;
};

void AddChiSquare(const ComparedValues& in_a,
                  const ComparedValues& in_b,
                  const std::vector<CommonParameter>& common,
                  Comparison* comparison) {
  // χ² of the difference, by the pseudo-inverse of the summed covariance scaled to unit diagonal.
  const auto n = static_cast<Eigen::Index>(common.size());
  Eigen::MatrixXd sum(n, n);
  Eigen::VectorXd difference(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& [ia, ib, off] = common[static_cast<std::size_t>(i)];
    difference[i] = off;
    const double sigma = std::sqrt(in_a.covariance(ia, ia) + in_b.covariance(ib, ib));
    comparison->largest_in_sigmas =
        std::max(comparison->largest_in_sigmas, std::abs(difference[i]) / sigma);
    for (Eigen::Index j = 0; j < n; ++j) {
      const CommonParameter& other = common[static_cast<std::size_t>(j)];
      sum(i, j) = in_a.covariance(ia, other.in_a) + in_b.covariance(ib, other.in_b);
    }
  }
  const Eigen::VectorXd scale = sum.diagonal().cwiseSqrt().cwiseInverse();
  const SymmetricEigen solver = EigenOfSymmetric(ScaledBothSides(scale, sum));
  const Eigen::VectorXd turned =
      TransposeTimesVector(solver.vectors, scale.cwiseProduct(difference));
  for (Eigen::Index i = 0; i < n; ++i) {
    if (solver.values[i] <= kTiedShare * solver.values.maxCoeff()) continue;
    comparison->chi2 += turned[i] * turned[i] / solver.values[i];
    ++comparison->dof;
  }
}

// Converts both solutions to one gauge: that of known attitudes if both have known attitudes,
// otherwise the triangular gauge.
std::pair<PresentedSolution, PresentedSolution> InOneGauge(const Calibration& a,
                                                           const Calibration& b) {
  std::pair both(SolutionOf(a), SolutionOf(b));
  if (a.gauge_sensor != b.gauge_sensor) return both;  // returned unchanged
  const Gauge gauge =
      a.gauge == Gauge::kFixture && b.gauge == Gauge::kFixture ? Gauge::kFixture : Gauge::kAccelX;
  const auto turn = [&](const Calibration& stated, PresentedSolution* solution) {
    const double sign = stated.sensors[a.gauge_sensor]->Scale()[0] < 0.0 ? -1.0 : 1.0;
    StateInGauge(gauge, a.gauge_sensor, sign, solution);
  };
  turn(a, &both.first);
  turn(b, &both.second);
  return both;
}

double VarianceOf(const ComparedValues& of_a,
                  const ComparedValues& of_b,
                  const CommonParameter& at) {
  return of_a.covariance(at.in_a, at.in_a) + of_b.covariance(at.in_b, at.in_b);
}

// Adds an entry for each parameter that both calibrations have. Returns those of them that are
// fixed neither by the gauge nor by the models of both.
std::vector<CommonParameter> AddEntries(const Calibration& a,
                                        const Calibration& b,
                                        const ComparedValues& of_a,
                                        const ComparedValues& of_b,
                                        Comparison* comparison) {
  std::vector<CommonParameter> common;
  std::map<std::string, LargestEntries> largest;  // of each matrix and vector
  const auto group_of = [](const std::string& name) { return name.substr(0, name.rfind('.')); };
  for (std::size_t i = 0; i < of_a.names.size(); ++i) {
    const std::string& name = of_a.names[i];
    const auto found = std::find(of_b.names.begin(), of_b.names.end(), name);
    if (found == of_b.names.end()) continue;
    if (IsOfAnotherTemperature(a, b, name)) {
      comparison->not_compared.push_back(
          name + " (one relates to a temperature with lag or smoothing, the other does not)");
      continue;
    }
    CommonParameter at{
        static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(found - of_b.names.begin()), 0.0};
    const double variance = VarianceOf(of_a, of_b, at);
    ComparisonEntry entry;
    entry.parameter = name;
    entry.a = of_a.values[at.in_a];
    entry.b = of_b.values[at.in_b];
    entry.difference = at.difference = entry.a - entry.b;
    entry.sigma = std::sqrt(std::max(variance, 0.0));
    comparison->entries.push_back(entry);
    LargestEntries& group = largest[group_of(name)];
    group.variance = std::max(group.variance, variance);
    group.value = std::max({group.value, std::abs(entry.a), std::abs(entry.b)});
    common.push_back(at);
  }
  std::erase_if(common, [&](const CommonParameter& at) {
    const std::string& name = of_a.names[static_cast<std::size_t>(at.in_a)];
    const LargestEntries& group = largest[group_of(name)];
    if (VarianceOf(of_a, of_b, at) > kFixedShare * group.variance) return false;
    if (std::abs(at.difference) > kRounding * group.value) {
      comparison->not_compared.push_back(name + " (held fixed in both, at different values)");
    }
    return true;
  });
  return common;
}

}  // namespace

Result<Comparison> Compare(const Calibration& a, const Calibration& stated_b) {
  Calibration b = stated_b;
  if (const auto degc = ReferenceOfTerms(a); degc && ReferenceOfTerms(b)) StateAbout(*degc, &b);
  TRUETRIAD_RETURN_IF_ERROR(CheckComparable(a, b));
  for (const Triad triad : kTriads) {
    if (!a.sensors[triad] || !b.sensors[triad]) continue;
    const TriadCalibration& sensor = *a.sensors[triad];
    TRUETRIAD_ASSIGN_OR_RETURN(const Unit unit, ParseTriadUnit(triad, sensor.input_unit));
    TRUETRIAD_RETURN_IF_ERROR(TakeReadingsIn(triad, unit, sensor.si_per_count, &b));
  }
  auto [in_a, in_b] = InOneGauge(a, b);
  Comparison comparison;
  comparison.not_compared = HeldByOneAlone(a, b);
  const bool nominal = a.reference.field_nominal || b.reference.field_nominal;
  if (nominal && in_a.models[Triad::kMagnetometer] && in_b.models[Triad::kMagnetometer]) {
    comparison.field_scale_taken_out = true;
    TakeOutCommonScale(&in_a, &in_b);
  }
  comparison.frames_differ = !HaveOneFrame(a, b);
  const auto values_of = [&](const PresentedSolution& solution) {
    return comparison.frames_differ ? ValuesWithoutFrame(solution, &comparison.not_compared)
                                    : ValuesInFrame(solution);
  };
  const ComparedValues of_a = values_of(in_a), of_b = values_of(in_b);
  const std::vector<CommonParameter> common = AddEntries(a, b, of_a, of_b, &comparison);
  if (comparison.entries.empty()) {
    return Error(ErrorCode::kDoesNotMatch,
                 "the two calibrations have no parameter with an uncertainty in common");
  }

  if (common.empty()) return comparison;  // No parameter has an uncertainty in both.

  AddChiSquare(of_a, of_b, common, &comparison);
  if (comparison.dof > 0) comparison.p_value = AgreementOf(comparison, a, b);
  return comparison;
}

const ComparisonEntry* LargestOf(const Comparison& comparison) {
  const auto in_sigmas = [](const ComparisonEntry& entry) {
    return entry.sigma > 0.0 ? std::abs(entry.difference) / entry.sigma : -1.0;
  };
  const auto largest = std::max_element(
      comparison.entries.begin(),
      comparison.entries.end(),
      [&](const auto& one, const auto& other) { return in_sigmas(one) < in_sigmas(other); });
  return largest == comparison.entries.end() || in_sigmas(*largest) < 0.0 ? nullptr : &*largest;
}

Agreement AgreementOf(const Comparison& comparison) {
  if (comparison.dof <= 0) return Agreement::kNotCompared;
  return comparison.p_value >= kAgreementProbability ? Agreement::kAgree : Agreement::kDiffer;
}

bool IsTooAlike(const Comparison& comparison) {
  // If the calibrations are from two recordings, they agree so well only once in a million, even if
  // the σ are three times too large.
  constexpr double kSigmaFactor = 3.0, kChance = 1e-6;
  if (comparison.dof <= 0) return false;
  const double most = kSigmaFactor * kSigmaFactor * comparison.chi2;
  return ChiSquareCdf(most, comparison.dof) < kChance;
}

std::string_view AgreementName(Agreement agreement) {
  constexpr NamedValues<Agreement, 3> kNames = {{
      {Agreement::kNotCompared, "not-compared"},
      {Agreement::kAgree, "agree"},
      {Agreement::kDiffer, "differ"},
  }};
  return kNames.Name(agreement);
}

}  // namespace truetriad
