// SPDX-License-Identifier: Apache-2.0
#include "verdict/limits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "math/distributions.h"
#include "problem/parameter_name.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"
#include "truetriad/model/quality.h"

namespace truetriad {
namespace {

// Number of temperatures at which terms are judged: every 5 % of the range, with both ends.
constexpr int kTemperatures = 21;

// Bias x y z, then the rows of the sensitivity.
using Entries = Eigen::Matrix<double, 12, 1>;
using EntriesCovariance = Eigen::Matrix<double, 12, 12>;

// A number that is compared with a limit.
struct JudgedValue {
  std::string component;
  double value = 0.0;
  double sigma = 0.0;
};

Eigen::Vector3d BiasOf(const Entries& entries) { return entries.head<3>(); }

Eigen::Matrix3d SensitivityOf(const Entries& entries) {
  return Eigen::Matrix3d(entries.tail<9>().reshaped(3, 3).transpose());
}

// A sensor's entries, and their covariance, at a temperature that is `tau` above its reference.
class SensorAt {
 public:
  SensorAt(const Calibration& calibration, Triad triad)
      : sensor_(*calibration.sensors[triad]), covariance_(calibration.covariance) {
    for (std::size_t i = 0; i < covariance_.parameters.size(); ++i) {
      const auto name = ParameterName::Parse(covariance_.parameters[i]);
      if (!name || name->triad != triad || InfoOf(name->kind).rate) continue;
      const bool is_bias = name->kind == ParameterKind::kBias;
      if (!is_bias && name->kind != ParameterKind::kSensitivity) continue;
      places_.push_back({static_cast<Eigen::Index>(i),
                         is_bias ? name->row : 3 + 3 * name->row + name->col,
                         name->power});
    }
  }

  std::vector<double> Temperatures() const {
    if (!sensor_.thermal) return {0.0};
    const ThermalTerms& thermal = *sensor_.thermal;
    std::vector<double> taus;
    for (int i = 0; i < kTemperatures; ++i) {
      const double share = static_cast<double>(i) / (kTemperatures - 1);
      taus.push_back((1.0 - share) * thermal.range_degc[0] + share * thermal.range_degc[1] -
                     thermal.reference_degc);
    }
    return taus;
  }

  Entries At(double tau) const {
    TriadModel<double> model = sensor_.model;
    if (sensor_.thermal) {
      const ThermalTerms& thermal = *sensor_.thermal;
      const double degc = thermal.reference_degc + tau;
      model = ModelAtTemperature(
          model, thermal, {Eigen::Vector3d::Constant(degc), Eigen::Vector3d::Zero()});
    }
    Entries entries;
    entries.head<3>() = model.bias;
    entries.tail<9>() = Eigen::Matrix3d(model.sensitivity.transpose()).reshaped();
    return entries;
  }

  // Covariance of the entries (`order` 0), or of their derivatives by tau (1).
  EntriesCovariance CovarianceAt(double tau, int order = 0) const {
    EntriesCovariance at = EntriesCovariance::Zero();
    if (places_.empty() && order == 0) {
      // The calibration has σ, but no covariance.
      at.diagonal().head<3>() = sensor_.bias_sigma.cwiseAbs2();
      at.diagonal().tail<9>() =
          Eigen::Matrix3d(sensor_.sensitivity_sigma.transpose()).reshaped().cwiseAbs2();
      return at;
    }
    const auto factor = [tau, order](int power) {
      if (order == 0) return std::pow(tau, power);
      return power == 0 ? 0.0 : power * std::pow(tau, power - 1);
    };
    for (const Place& row : places_) {
      for (const Place& column : places_) {
        at(row.entry, column.entry) +=
            factor(row.power) * factor(column.power) * covariance_.matrix(row.at, column.at);
      }
    }
    return at;
  }

 private:
  struct Place {
    Eigen::Index at;
    int entry;
    int power;
  };
  const TriadCalibration& sensor_;
  const NamedCovariance& covariance_;
  std::vector<Place> places_;
};

// A function of the entries; its σ is computed by finite differences.
using OfEntries = std::function<double(const Entries&)>;

JudgedValue Judged(std::string component,
                   const OfEntries& number,
                   const Entries& entries,
                   const EntriesCovariance& covariance) {
  JudgedValue judged{std::move(component), number(entries), 0.0};
  Entries gradient = Entries::Zero();
  for (int i = 0; i < entries.size(); ++i) {
    if (!(covariance(i, i) > 0.0)) continue;
    Entries up = entries, down = entries;
    // A step of one σ of the entry is far above rounding.
    const double step = std::max(std::sqrt(covariance(i, i)), 1e-9 * std::abs(entries[i]));
    up[i] += step, down[i] -= step;
    gradient[i] = (number(up) - number(down)) / (2.0 * step);
  }
  judged.sigma = std::sqrt(std::max(0.0, gradient.dot(covariance * gradient)));
  return judged;
}

std::string AxisName(int axis) { return {AxisLetter(axis)}; }

// Angle between two sensing axes minus 90 degrees.
double OverRightAngle(const Eigen::Matrix3d& sensitivity, int i, int j) {
  const double cosine = sensitivity.row(i).normalized().dot(sensitivity.row(j).normalized());
  return -std::asin(std::clamp(cosine, -1.0, 1.0));
}

// The components of a quantity, as functions of a sensor's entries. Gains and misalignments are
// named by sensing axes, whatever body axes these point along.
std::vector<std::pair<std::string, OfEntries>> NumbersOf(const std::string_view quantity,
                                                         const Eigen::Matrix3d& axis_map,
                                                         double truth_per_raw) {
  const auto gains = [axis_map](const Entries& entries) {
    return Eigen::Matrix3d(SensitivityOf(entries) * axis_map.transpose());
  };
  std::vector<std::pair<std::string, OfEntries>> numbers;
  const bool is_bias = quantity.starts_with("bias"), is_scale = quantity.starts_with("scale");
  for (int i = 0; i < 3; ++i) {
    if (is_bias) {
      numbers.emplace_back(AxisName(i), [gains, i](const Entries& entries) {
        return BiasOf(entries)[i] / gains(entries)(i, i);
      });
    }
    if (is_scale) {
      numbers.emplace_back(AxisName(i), [gains, i, truth_per_raw](const Entries& entries) {
        return gains(entries)(i, i) * truth_per_raw - 1.0;
      });
    }
    for (int j = 0; j < 3; ++j) {
      if (i != j && quantity.starts_with("misalignment")) {
        numbers.emplace_back(AxisName(i) + AxisName(j), [gains, i, j](const Entries& entries) {
          const Eigen::Matrix3d matrix = gains(entries);
          return matrix(i, j) / matrix(i, i);
        });
      }
      if (i < j && quantity == "non_orthogonality_rad") {
        numbers.emplace_back(AxisName(i) + AxisName(j), [i, j](const Entries& entries) {
          return OverRightAngle(SensitivityOf(entries), i, j);
        });
      }
    }
  }
  return numbers;
}

// The values that are compared with limits, at each temperature.
std::vector<JudgedValue> ValuesOfSensor(const SensorAt& sensor,
                                        const LimitName& limit,
                                        const Eigen::Matrix3d& axis_map,
                                        double truth_per_raw) {
  std::vector<JudgedValue> values;
  const std::string_view quantity = limit.quantity.name;
  const bool is_sigma = quantity.find("sigma") != std::string_view::npos;
  const auto numbers = NumbersOf(quantity, axis_map, truth_per_raw);
  for (const double tau : sensor.Temperatures()) {
    const Entries entries = sensor.At(tau);
    for (const auto& [component, number] : numbers) {
      if (limit.IsSlope()) {
        // The difference is accurate: for a cubic over 100 degC, it errs by (0.01 / 100)^2 = 1e-8
        // of the slope.
        constexpr double kStepDegc = 0.01;
        const double slope =
            (number(sensor.At(tau + kStepDegc)) - number(sensor.At(tau - kStepDegc))) /
            (2.0 * kStepDegc);
        JudgedValue judged =
            Judged(component, number, entries, sensor.CovarianceAt(tau, /*order=*/1));
        judged.value = slope;
        values.push_back(judged);
        continue;
      }
      JudgedValue judged = Judged(component, number, entries, sensor.CovarianceAt(tau));
      if (is_sigma) judged = {component, judged.sigma, 0.0};
      values.push_back(judged);
    }
  }
  return values;
}

Result<std::vector<JudgedValue>> ValuesOfReference(const Calibration& calibration,
                                                   std::string_view name) {
  const ReferenceValues& reference = calibration.reference;
  const auto lacks = [name](const char* why) {
    return Error(ErrorCode::kInvalidExperiment, "limit `" + std::string(name) + "`: " + why)
        .About("limits." + std::string(name));
  };
  if (name == "reference.gravity_mps2") {
    return std::vector<JudgedValue>{
        {"", reference.gravity_mps2, calibration.covariance.Sigma("reference.gravity_mps2")}};
  }
  if (name == "reference.field_ut") {
    if (!reference.field_ut || reference.field_nominal) {
      return lacks(
          "the field strength is unknown; state `reference: { field: { strength_ut: … } }`");
    }
    return std::vector<JudgedValue>{
        {"", *reference.field_ut, calibration.covariance.Sigma("reference.field_ut")}};
  }
  if (!reference.dip_rad) return lacks("this calibration has no dip");
  return std::vector<JudgedValue>{{"",
                                   *reference.dip_rad * kDegPerRad,
                                   calibration.covariance.Sigma("reference.dip_rad") * kDegPerRad}};
}

Result<std::vector<JudgedValue>> ValuesOf(const Calibration& calibration,
                                          const PoseSet& poses,
                                          const std::string& name,
                                          const LimitName& parsed) {
  if (!parsed.triad) return ValuesOfReference(calibration, parsed.quantity.name);
  const auto fail = [&name](const char* why) {
    return Error(ErrorCode::kInvalidExperiment, "limit `" + name + "`: " + why)
        .About("limits." + name);
  };
  const Triad triad = *parsed.triad;
  if (!calibration.sensors[triad]) return fail("no such sensor in this calibration");
  const std::string_view quantity = parsed.quantity.name;
  if (quantity == "residual_rms") {
    return std::vector<JudgedValue>{{"", calibration.quality.residual_rms[triad].value_or(0.0), 0}};
  }
  if (quantity == "held_out_rms") {
    const auto& held_out = calibration.quality.rests.held_out;
    if (!held_out || !held_out->rms[triad]) {
      return fail("no poses were held out; set `cross_validation: { folds: 5 }`, or add poses");
    }
    return std::vector<JudgedValue>{{"", *held_out->rms[triad], 0.0}};
  }
  double truth_per_raw = 1.0;
  if (parsed.GoesWithField() && calibration.reference.field_nominal) {
    return fail(
        "the field strength is unknown, and with it the common scale of the magnetometer's gains "
        "and its bias in µT; state `reference: { field: { strength_ut: … } }`");
  }
  if (quantity.starts_with("scale")) {
    const StreamSummary* stream = poses.Find(triad);
    if (stream == nullptr || stream->unit.is_counts) {
      return fail("readings in counts have no nominal scale");
    }
    truth_per_raw = stream->unit.truth_per_raw;
  }
  if (parsed.IsSlope() && !calibration.sensors[triad]->thermal) {
    return fail("this calibration has no temperature terms");
  }
  return ValuesOfSensor(SensorAt(calibration, triad),
                        parsed,
                        NearestAxisMap(calibration.sensors[triad]->model.sensitivity),
                        truth_per_raw);
}

// Distance of the value to the nearer limit minus k σ; negative if its guard band exceeds a limit.
double Room(const JudgedValue& judged, const Limit& limit, double k) {
  return std::min(limit.upper - judged.value, judged.value - limit.lower) - k * judged.sigma;
}

// Probability that the true value exceeds its estimate by more than `distance`.
double ChanceBeyond(double distance, double sigma, double dof) {
  if (!(sigma > 0.0)) return distance < 0.0 ? 1.0 : 0.0;
  if (std::isinf(distance)) return 0.0;
  const double t = distance / sigma;
  const double tail =
      0.5 *
      (1.0 - FisherCdf(t * t, 1.0, dof > 0.0 ? dof : std::numeric_limits<double>::infinity()));
  return t > 0.0 ? tail : 1.0 - tail;
}

}  // namespace

Result<std::vector<LimitCheck>> JudgeLimits(const Calibration& calibration,
                                            const PoseSet& poses,
                                            const LimitOptions& limits) {
  std::vector<LimitCheck> checks;
  const double k = limits.guard_band_k, dof = calibration.quality.effective_dof;
  for (const auto& [name, limit] : limits.limits) {
    TRUETRIAD_ASSIGN_OR_RETURN(const LimitName parsed, ParseLimitName(name));
    const Result<std::vector<JudgedValue>> values = ValuesOf(calibration, poses, name, parsed);
    if (!values && limit.if_present) continue;
    TRUETRIAD_RETURN_IF_ERROR(values);
    const JudgedValue* worst = nullptr;
    struct Component {
      const JudgedValue* worst = nullptr;
      double outside = 0.0;
    };
    std::map<std::string, Component> components;  // each at its worst temperature
    const auto is_worse = [&limit = limit, k](const JudgedValue& judged, const JudgedValue* than) {
      return than == nullptr || Room(judged, limit, k) < Room(*than, limit, k);
    };
    for (const JudgedValue& judged : *values) {
      if (!parsed.component.empty() && judged.component != parsed.component) continue;
      Component& own = components[judged.component];
      own.outside = std::max(own.outside,
                             ChanceBeyond(limit.upper - judged.value, judged.sigma, dof) +
                                 ChanceBeyond(judged.value - limit.lower, judged.sigma, dof));
      if (is_worse(judged, own.worst)) own.worst = &judged;
      if (is_worse(judged, worst)) worst = &judged;
    }
    LimitCheck check;
    check.name = name;
    check.component = parsed.component.empty() ? worst->component : "";
    check.limit = limit;
    check.worst = worst->value;
    check.sigma = worst->sigma;
    // For small probabilities the sum avoids the rounding of 1 - (1 - p).
    double inside = 1.0, sum = 0.0;
    for (const auto& [name_of, own] : components) {
      const double chance = std::min(own.outside, 1.0);
      inside *= 1.0 - chance;
      sum += chance;
      check.components.push_back(
          {name_of, own.worst->value, own.worst->sigma, chance, Room(*own.worst, limit, k) >= 0.0});
    }
    check.outside = sum < 1e-6 ? sum : 1.0 - inside;
    check.pass = Room(*worst, limit, k) >= 0.0;
    check.guard_band_k = k;
    checks.push_back(std::move(check));
  }
  return checks;
}

}  // namespace truetriad
