// SPDX-License-Identifier: Apache-2.0
#include "sweep/calibrate_sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "base/messages.h"
#include "problem/parameter_name.h"
#include "sweep/sweep_choice.h"
#include "sweep/sweep_fit.h"
#include "sweep/sweep_problem.h"
#include "sweep/sweep_regression.h"
#include "truetriad/base/triad.h"
#include "verdict/reference_temperature.h"
#include "verdict/verdict.h"

namespace truetriad {
namespace {

// A range below this is no sweep.
constexpr double kLeastRangeDegc = 2.0;
// More windows than this show nothing more.
constexpr int kMostShown = 400;
constexpr double kHeldGravitySigmas = 5.0;
// Share of gravity that no ageing explains.
constexpr double kOtherUnitShare = 0.01;
// Temperatures that are the same: what a bias of 1 mg/degC does not tell from noise.
constexpr double kSameDegc = 0.5;
// What a recording at one temperature may go over.
constexpr double kMostStaticRangeDegc = 5.0;

// One triad of a sweep.
struct SweptTriad {
  TriadCalibration sensor;
  std::vector<SweepChoice> axes;
  Eigen::Vector2d range_degc;
};

Eigen::Vector2d RangeOf(const SweepProblem& problem) {
  const ThermalScale& scale = problem.scale();
  return {scale.centre_degc - scale.half_range_degc, scale.centre_degc + scale.half_range_degc};
}

ThermalBlock BlockOf(const ThermalOptions& terms) {
  ThermalBlock block;
  block.at = 0;
  block.terms = terms;
  return block;
}

// Terms in tau of one axis: values and covariance, in the order of ThermalBlock's vectors, then the
// lags. `constant`: the attitude's is the first (a gyroscope's bias).
struct ListedTerms {
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;
};

// Columns of the knots of an axis.
Eigen::Index KnotColumns(const ThermalOptions& terms) {
  return static_cast<Eigen::Index>(terms.knots_degc.size()) * (terms.smooth_knots ? 1 : 2);
}

ListedTerms InTau(const SweepProblem& problem, int axis, const SweepFit& fit) {
  const int constants = problem.attitude_count();
  const Eigen::Index knots = KnotColumns(fit.terms);
  const Eigen::Index vectors = static_cast<Eigen::Index>(fit.columns.size()) - constants - knots;
  const Eigen::Index lags = fit.coefficients.size() - constants - vectors - knots;
  Eigen::MatrixXd listed =
      Eigen::MatrixXd::Zero(1 + vectors + knots + lags, fit.coefficients.size());
  listed(0, 0) = 1.0;
  listed.block(1, constants, vectors, vectors) =
      BlockOf(fit.terms).ListedFromVectors(problem.scale());
  const double half_range = problem.scale().half_range_degc;
  for (Eigen::Index k = 0; k < knots; ++k) {
    const bool is_curve = fit.terms.smooth_knots || k % 2 == 1;
    listed(1 + vectors + k, constants + vectors + k) =
        1.0 / (is_curve ? half_range * half_range : half_range);
  }
  listed.bottomRightCorner(lags, lags).setIdentity();
  ListedTerms terms{listed * fit.coefficients, listed * fit.covariance * listed.transpose()};
  terms.values[0] += problem.origin()[axis];
  return terms;
}

// Where the parts of ListedTerms go.
std::vector<ParameterName> NamesOf(Triad triad, int axis, const ThermalOptions& terms) {
  std::vector<ParameterName> names = {{triad, ParameterKind::kBias, 0, axis, 0}};
  for (int power = 1; power <= terms.bias_order; ++power) {
    names.push_back({triad, ParameterKind::kBias, power, axis, 0});
  }
  if (terms.rate_linear) names.push_back({triad, ParameterKind::kRateLinear, 0, axis, 0});
  if (terms.rate_quadratic) names.push_back({triad, ParameterKind::kRateQuadratic, 0, axis, 0});
  if (terms.rate_cross) names.push_back({triad, ParameterKind::kRateCross, 0, axis, 0});
  return names;
}

// Of knots and lags, in the order of ListedTerms.
std::vector<std::string> OtherNames(Triad triad, int axis, const SweepFit& fit) {
  const std::string head = std::string(TriadName(triad)) + ".thermal.";
  const std::string tail = std::string(".") + kAxisLetters[static_cast<std::size_t>(axis)];
  std::vector<std::string> names;
  for (std::size_t k = 1; k <= fit.terms.knots_degc.size(); ++k) {
    const std::string knot = head + "knot." + std::to_string(k);
    if (!fit.terms.smooth_knots) names.push_back(knot + ".slope" + tail);
    names.push_back(knot + ".curve" + tail);
  }
  const SweepLags& lags = fit.lags;
  if (lags.element_s > 0.0) names.push_back(head + "element_lag" + tail);
  if (lags.rate_s > 0.0) names.push_back(head + "rate_lag" + tail);
  return names;
}

void SetTerm(const ParameterName& name, double value, TriadCalibration* sensor) {
  ThermalTerms& thermal = *sensor->thermal;
  const auto on_axis = [&](std::optional<Eigen::Vector3d>* term) {
    if (!*term) *term = Eigen::Vector3d::Zero();
    (**term)[name.row] = value;
  };
  switch (name.kind) {
    case ParameterKind::kBias: {
      if (name.power == 0) {
        sensor->model.bias[name.row] = value;
        return;
      }
      const auto power = static_cast<std::size_t>(name.power);
      if (thermal.bias.size() < power) thermal.bias.resize(power, Eigen::Vector3d::Zero());
      thermal.bias[power - 1][name.row] = value;
      return;
    }
    case ParameterKind::kRateLinear:
      return on_axis(&thermal.rate_linear);
    case ParameterKind::kRateQuadratic:
      return on_axis(&thermal.rate_quadratic);
    case ParameterKind::kRateCross:
      return on_axis(&thermal.rate_cross);
    default:
      return;
  }
}

// Heating minus cooling of `residuals` in the middle half of the temperatures that both passed; NaN
// where either is missing.
double BranchGap(const SweepProblem& problem, const Eigen::VectorXd& residuals) {
  constexpr int kBins = 40;
  constexpr double kMoving = 0.1;  // of the fastest
  std::array<Eigen::ArrayXd, 2> sum, count;
  for (int branch = 0; branch < 2; ++branch) {
    sum[static_cast<std::size_t>(branch)] = Eigen::ArrayXd::Zero(kBins);
    count[static_cast<std::size_t>(branch)] = Eigen::ArrayXd::Zero(kBins);
  }
  const ThermalScale& scale = problem.scale();
  for (int i = 0; i < problem.size(); ++i) {
    const StaticPose& window = problem.window(i);
    if (std::abs(window.temperature_rate_degcps) < kMoving * scale.rate_degcps) continue;
    const double v = (*window.temperature_degc - scale.centre_degc) / scale.half_range_degc;
    const int bin = std::clamp(static_cast<int>(0.5 * (v + 1.0) * kBins), 0, kBins - 1);
    const std::size_t branch = window.temperature_rate_degcps > 0.0 ? 0 : 1;
    sum[branch][bin] += residuals[i];
    count[branch][bin] += 1.0;
  }
  std::vector<double> gaps;
  for (int bin = 0; bin < kBins; ++bin) {
    if (count[0][bin] == 0.0 || count[1][bin] == 0.0) continue;
    gaps.push_back(sum[0][bin] / count[0][bin] - sum[1][bin] / count[1][bin]);
  }
  if (gaps.empty()) return std::numeric_limits<double>::quiet_NaN();
  const std::size_t quarter = gaps.size() / 4;
  double total = 0.0;
  for (std::size_t g = quarter; g < gaps.size() - quarter; ++g) total += gaps[g];
  return total / static_cast<double>(gaps.size() - 2 * quarter);
}

double Rms(const Eigen::VectorXd& values) {
  return std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
}

SweepAxis DescribeAxis(const SweepProblem& problem,
                       Triad triad,
                       int axis,
                       const SweepChoice& choice) {
  const SweepFit& fit = choice.fit;
  SweepAxis described;
  described.triad = triad;
  described.axis = axis;
  described.noise_sigma = std::sqrt(problem.noise_variance().row(axis).mean());
  const ThermalOptions none;
  described.rms_before = Rms(FitSweep(problem, axis, none, {}).residuals);
  described.rms_after = Rms(fit.residuals);
  described.held_out = choice.held_out;
  described.held_out_cubic = choice.held_out_cubic;
  described.folds = problem.fold_count();
  ThermalOptions plain;
  plain.bias_order = std::max(fit.terms.bias_order, 1);
  described.branch_gap = BranchGap(problem, FitSweep(problem, axis, plain, {}).residuals);
  described.branch_gap_after = BranchGap(problem, fit.residuals);
  described.correlation = fit.correlation;
  auto lag_place = static_cast<Eigen::Index>(fit.columns.size());
  const auto lag_sigma = [&](double lag) {
    return lag > 0.0 ? std::sqrt(std::max(0.0, fit.covariance(lag_place, lag_place))) : 0.0;
  };
  described.element_lag_s = fit.lags.element_s;
  described.element_lag_sigma_s = lag_sigma(fit.lags.element_s);
  if (fit.lags.element_s > 0.0) ++lag_place;
  described.rate_lag_s = fit.lags.rate_s;
  described.rate_lag_sigma_s = lag_sigma(fit.lags.rate_s);
  described.chosen = TermsText(fit.terms);
  described.left_out = choice.left_out;
  described.steps = choice.steps;
  return described;
}

void ShowWindows(SweepProblem* problem,
                 Triad triad,
                 const std::vector<SweepChoice>& axes,
                 std::vector<SweepWindow>* shown) {
  const int every = problem->size() / kMostShown + 1;
  const double start_s = static_cast<double>(problem->window(0).start_ns) * 1e-9;
  std::vector<Eigen::MatrixXd> columns;
  for (const SweepChoice& choice : axes) {
    problem->SetKnots(choice.fit.terms.knots_degc);
    columns.push_back(problem->Columns(problem->States(choice.fit.lags)));
  }
  for (int i = 0; i < problem->size(); i += every) {
    const StaticPose& window = problem->window(i);
    SweepWindow& row = shown->emplace_back();
    row.triad = triad;
    row.time_s = static_cast<double>(window.start_ns) * 1e-9 - start_s + 0.5 * window.duration_s();
    row.degc = *window.temperature_degc;
    row.rate_degcps = window.temperature_rate_degcps;
    for (int axis = 0; axis < 3; ++axis) {
      const SweepFit& fit = axes[static_cast<std::size_t>(axis)].fit;
      // Of a gyroscope the constant is part of the bias.
      const auto first =
          static_cast<std::size_t>(triad == Triad::kGyroscope ? 0 : problem->attitude_count());
      const std::vector<int> used(fit.columns.begin() + static_cast<std::ptrdiff_t>(first),
                                  fit.columns.end());
      Eigen::RowVectorXd factors(static_cast<Eigen::Index>(used.size()));
      for (std::size_t j = 0; j < used.size(); ++j) {
        factors[static_cast<Eigen::Index>(j)] = columns[static_cast<std::size_t>(axis)](i, used[j]);
      }
      const auto at = static_cast<Eigen::Index>(first);
      row.fit_raw[axis] = factors.dot(fit.coefficients.segment(at, factors.size()).transpose());
      if (triad == Triad::kGyroscope) row.fit_raw[axis] += problem->origin()[axis];
      row.bias_raw[axis] = row.fit_raw[axis] + fit.residuals[i];
      const double variance = factors *
                              fit.covariance.block(at, at, factors.size(), factors.size()) *
                              factors.transpose();
      row.fit_sigma_raw[axis] = std::sqrt(std::max(variance, 0.0));
    }
  }
}

// The static calibration's part for a triad. Errors: it does not fit the recording.
Result<TriadCalibration> StaticSensor(const SweepOptions& sweep,
                                      Triad triad,
                                      const std::string& unit) {
  const std::string name(TriadName(triad));
  const Calibration& calibration = *sweep.static_calibration;
  const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
  if (!sensor) {
    return BadInputError(sweep.static_file + ": has no " + name +
                         ", which the sweep is to complete; calibrate it too, or take it out of "
                         "the sweep");
  }
  if (sensor->input_unit != unit) {
    return BadInputError(sweep.static_file + ": the " + name + " is in " + sensor->input_unit +
                         ", but the sweep is in " + unit + "; record both in the same unit");
  }
  if (sensor->thermal) {
    return BadInputError(sweep.static_file + ": the " + name +
                         " has temperature terms already; a sweep completes a calibration at one "
                         "temperature");
  }
  return *sensor;
}

// Everything about one triad; parameters go into `covariance`.
class TriadSweep {
 public:
  TriadSweep(const PoseSet& poses, const CalibrateOptions& options, Triad triad, double reference)
      : options_(options),
        triad_(triad),
        poses_(poses),
        problem_(poses,
                 triad,
                 reference,
                 options.sweep->even_temperatures,
                 options.cross_validation_folds) {}

  const SweepProblem& problem() const { return problem_; }

  Status Run(Calibration* calibration) {
    const std::string& unit = poses_.Find(triad_)->unit.name;
    TriadCalibration sensor;
    if (options_.sweep->static_calibration) {
      Result<TriadCalibration> known = StaticSensor(*options_.sweep, triad_, unit);
      TRUETRIAD_RETURN_IF_ERROR(known);
      sensor = *std::move(known);
    } else {
      const TriadOptions& wanted = options_.triads[triad_];
      sensor.model.bias = wanted.fixed_bias.value_or(Eigen::Vector3d::Zero());
      sensor.model.sensitivity = wanted.fixed_sensitivity.value_or(Eigen::Matrix3d::Identity());
    }
    sensor.input_unit = unit;
    sensor.output_unit = TruthUnitName(triad_);
    ThermalTerms& thermal = sensor.thermal.emplace();
    thermal.reference_degc = problem_.scale().reference_degc;
    thermal.range_degc = RangeOf(problem_);
    thermal.smoothing_s = poses_.sweep.temperature.smoothing_s;
    thermal.rate_range_degcps = problem_.rate_range_degcps();
    for (int axis = 0; axis < 3; ++axis) {
      choices_.push_back(ChooseSweep(&problem_, axis, options_.triads[triad_].thermal));
      TakeTerms(axis, &sensor);
      calibration->quality.sweep.push_back(DescribeAxis(problem_, triad_, axis, choices_.back()));
      if (const ThermalOptions& wanted = options_.triads[triad_].thermal; wanted.has_regression()) {
        calibration->quality.sweep.back().regression = RegressSweep(problem_, axis, wanted, unit);
      }
    }
    if (thermal.bias.empty()) thermal.bias.emplace_back(Eigen::Vector3d::Zero());
    StateNoise(calibration->quality, &sensor);
    ShowWindows(&problem_, triad_, choices_, &calibration->quality.sweep_windows);
    List(&sensor, &calibration->covariance);
    calibration->sensors[triad_] = std::move(sensor);
    return {};
  }

  const std::vector<SweepChoice>& choices() const { return choices_; }

 private:
  void TakeTerms(int axis, TriadCalibration* sensor) {
    const SweepFit& fit = choices_.back().fit;
    const ListedTerms listed = InTau(problem_, axis, fit);
    const std::vector<ParameterName> names = NamesOf(triad_, axis, fit.terms);
    for (std::size_t i = 0; i < names.size(); ++i) {
      const bool is_bias = names[i].kind == ParameterKind::kBias && names[i].power == 0;
      if (is_bias && triad_ != Triad::kGyroscope) continue;
      SetTerm(names[i], listed.values[static_cast<Eigen::Index>(i)], sensor);
    }
    auto at = static_cast<Eigen::Index>(names.size());
    for (const double degc : fit.terms.knots_degc) {
      ThermalKnot& knot = sensor->thermal->knots.emplace_back();
      knot.axis = axis;
      knot.degc = degc;
      if (!fit.terms.smooth_knots) knot.slope = listed.values[at++];
      knot.curve = listed.values[at++];
    }
    const auto set_lag = [axis](double lag, std::optional<Eigen::Vector3d>* lags) {
      if (!(lag > 0.0)) return;
      if (!*lags) *lags = Eigen::Vector3d::Zero();
      (**lags)[axis] = lag;
    };
    set_lag(fit.lags.element_s, &sensor->thermal->element_lag_s);
    set_lag(fit.lags.rate_s, &sensor->thermal->rate_lag_s);
  }

  void StateNoise(const Quality& quality, TriadCalibration* sensor) const {
    sensor->noise = TriadNoise();
    const Eigen::Vector3d gain = sensor->model.sensitivity.rowwise().norm();
    double excess = 0.0;
    for (const SweepAxis& axis : quality.sweep) {
      if (axis.triad != triad_) continue;
      sensor->noise.sigma[axis.axis] = axis.noise_sigma;
      const double more = axis.rms_after * axis.rms_after - axis.noise_sigma * axis.noise_sigma;
      excess += std::max(0.0, more) / (gain[axis.axis] * gain[axis.axis]) / 3.0;
    }
    sensor->noise.source = NoiseSource::kStatic;
    sensor->noise.excess_sigma = std::sqrt(excess);
    sensor->noise.excess_dof = static_cast<double>(problem_.size());
  }

  // Bias, sensitivity, temperature terms and lags with their covariance. What is held has none.
  void List(TriadCalibration* sensor, NamedCovariance* covariance) const {
    std::vector<std::string> names;
    const ThermalTerms& thermal = *sensor->thermal;
    const auto list = [&](ParameterKind kind, int power) {
      for (int axis = 0; axis < 3; ++axis) {
        names.push_back(ParameterName{triad_, kind, power, axis, 0}.str());
      }
    };
    list(ParameterKind::kBias, 0);
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col) {
        names.push_back(ParameterName{triad_, ParameterKind::kSensitivity, 0, row, col}.str());
      }
    }
    for (std::size_t power = 1; power <= thermal.bias.size(); ++power) {
      list(ParameterKind::kBias, static_cast<int>(power));
    }
    if (thermal.rate_linear) list(ParameterKind::kRateLinear, 0);
    if (thermal.rate_quadratic) list(ParameterKind::kRateQuadratic, 0);
    if (thermal.rate_cross) list(ParameterKind::kRateCross, 0);
    for (int axis = 0; axis < 3; ++axis) {
      for (const std::string& name :
           OtherNames(triad_, axis, choices_[static_cast<std::size_t>(axis)].fit)) {
        names.push_back(name);
      }
    }
    const auto before = static_cast<Eigen::Index>(covariance->parameters.size());
    const auto size = before + static_cast<Eigen::Index>(names.size());
    std::map<std::string, Eigen::Index> places;
    for (std::size_t i = 0; i < names.size(); ++i) {
      places[names[i]] = before + static_cast<Eigen::Index>(i);
    }
    covariance->parameters.insert(covariance->parameters.end(), names.begin(), names.end());
    covariance->matrix.conservativeResizeLike(Eigen::MatrixXd::Zero(size, size));
    for (int axis = 0; axis < 3; ++axis) {
      const SweepFit& fit = choices_[static_cast<std::size_t>(axis)].fit;
      const ListedTerms listed = InTau(problem_, axis, fit);
      std::vector<std::string> own;
      for (const ParameterName& name : NamesOf(triad_, axis, fit.terms)) own.push_back(name.str());
      for (const std::string& name : OtherNames(triad_, axis, fit)) own.push_back(name);
      const std::size_t first = triad_ == Triad::kGyroscope ? 0 : 1;
      for (std::size_t i = first; i < own.size(); ++i) {
        for (std::size_t j = first; j < own.size(); ++j) {
          covariance->matrix(places[own[i]], places[own[j]]) =
              listed.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
        }
      }
    }
    if (triad_ == Triad::kGyroscope) {
      sensor->bias_sigma =
          covariance->matrix.diagonal().segment<3>(before).cwiseMax(0.0).cwiseSqrt();
    }
  }

  const CalibrateOptions& options_;
  Triad triad_;
  const PoseSet& poses_;
  SweepProblem problem_;
  std::vector<SweepChoice> choices_;
};

// The covariance of what a static calibration brings along, cross terms between sensors too.
void TakeStaticCovariance(const Calibration& known, NamedCovariance* covariance) {
  std::vector<std::pair<Eigen::Index, Eigen::Index>> places;
  for (std::size_t i = 0; i < covariance->parameters.size(); ++i) {
    const auto name = ParameterName::Parse(covariance->parameters[i]);
    if (!name || name->is_thermal()) continue;
    if (name->triad == Triad::kGyroscope && name->kind == ParameterKind::kBias) continue;
    const auto& listed = known.covariance.parameters;
    const auto at = std::find(listed.begin(), listed.end(), covariance->parameters[i]);
    if (at == listed.end()) continue;
    places.emplace_back(static_cast<Eigen::Index>(i), at - listed.begin());
  }
  for (const auto& [row, known_row] : places) {
    for (const auto& [column, known_column] : places) {
      covariance->matrix(row, column) = known.covariance.matrix(known_row, known_column);
    }
  }
}

// Gravity as the static calibration sees it in the sweep, at its own temperature.
// How far the static calibration's gravity is off in the sweep, where that is beyond chance.
struct GravityMiss {
  double share = 0.0;  // of gravity
  std::string words;
};
std::optional<GravityMiss> MissedGravity(const Calibration& calibration, const TriadSweep& swept) {
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
  return GravityMiss{
      std::abs(off) / calibration.reference.gravity_mps2,
      Format("the static calibration sees %.4f m/s^2 in the sweep at its own temperature, ", seen) +
          Format("%+.4f ", off) + Format("± %.2g from gravity: ", sigma)};
}

// RMS of what the terms leave of a triad, all axes, true unit.
double ResidualRms(const Calibration& calibration, Triad triad) {
  Eigen::Vector3d raw = Eigen::Vector3d::Zero();
  for (const SweepAxis& axis : calibration.quality.sweep) {
    if (axis.triad == triad) raw[axis.axis] = axis.rms_after;
  }
  return (calibration.sensors[triad]->model.Correction() * raw.asDiagonal()).norm();
}

// What is held cannot be judged.
Status CheckLimits(const CalibrateOptions& options, Triad triad) {
  const std::string sensor(TriadName(triad));
  for (const auto& [name, limit] : options.limits.limits) {
    if (!name.starts_with(sensor + ".") || name.ends_with(".residual_rms")) continue;
    if (triad == Triad::kGyroscope && name.ends_with(".bias")) continue;
    return UsageError("limits: " + name +
                      " is held in a sweep, not measured; give a calibration at one temperature as "
                      "`static: FILE.yaml`, or remove the limit");
  }
  return {};
}

// Axes of which much more than noise is left.
void SayUnexplained(const Quality& quality, std::vector<std::string>* messages) {
  constexpr double kMuch = 5.0;
  for (const SweepAxis& axis : quality.sweep) {
    const double times = axis.rms_after / axis.noise_sigma;
    if (!(times > kMuch)) continue;
    const std::string gap =
        std::abs(axis.branch_gap_after) > axis.rms_after
            ? "heating and cooling still differ: hysteresis, or a lag that was not asked for"
            : "drift, a unit that was moved, or a thermometer that does not follow";
    messages->push_back(std::string(TriadName(axis.triad)) + " " +
                        kAxisLetters[static_cast<std::size_t>(axis.axis)] +
                        Format(": the terms leave %.0f times its noise: ", times) + gap);
  }
}

void SayLeftOut(const Quality& quality, std::vector<std::string>* messages) {
  // Axes that say the same are named together.
  std::vector<std::pair<std::string, std::string>> said;
  for (const SweepAxis& axis : quality.sweep) {
    for (const std::string& words : axis.left_out) {
      const std::string name = std::string(TriadName(axis.triad)) + " " +
                               kAxisLetters[static_cast<std::size_t>(axis.axis)];
      const auto same = std::find_if(
          said.begin(), said.end(), [&](const auto& entry) { return entry.second == words; });
      if (same == said.end()) {
        said.emplace_back(name, words);
      } else {
        same->first += ", " + name;
      }
    }
  }
  for (const auto& [names, words] : said) messages->push_back(names + ": left out " + words);
}

// A bias at no one temperature cannot be completed by terms in it.
Status CheckRecorded(const Eigen::Vector3d& recorded_degc, const std::string& file) {
  const double spread = recorded_degc[2] - recorded_degc[0];
  if (spread <= kMostStaticRangeDegc) return {};
  return BadInputError(
      file + Format(": was recorded at %.1f to ", recorded_degc[0]) +
      Format("%.1f degC, so that its bias holds at no one temperature; ", recorded_degc[2]) +
      Format("record it at one, within %.0f degC, or calibrate with `thermal:` over all poses",
             kMostStaticRangeDegc));
}

std::string SayRecorded(const Eigen::Vector3d& recorded_degc,
                        double reference_degc,
                        const std::string& file) {
  return file + Format(": was recorded at %.1f degC", recorded_degc[1]) +
         Format(" (%.1f to ", recorded_degc[0]) + Format("%.1f), not at its ", recorded_degc[2]) +
         Format("reference temperature of %.1f degC: ", reference_degc) +
         Format("bias and sensitivity are taken as those at %.1f degC", recorded_degc[1]);
}

}  // namespace

Status CalibrateSweep(const PoseSet& poses,
                      const CalibrateOptions& options,
                      CalibrationSummary* summary) {
  Calibration& calibration = summary->calibration;
  Quality& quality = calibration.quality;
  const auto refuse = [&](const std::string& message) -> Status {
    calibration.outcome = Outcome::kNotEnough;
    calibration.messages.push_back(message);
    return {};
  };
  if (poses.sweep.temperature.empty()) {
    return UsageError(
        "a sweep is calibrated from windows of a recording: `poses: { sweep: auto }`");
  }
  quality.poses = static_cast<int>(poses.poses.size());
  double reference = options.reference.temperature_degc;
  if (const auto& known = options.sweep->static_calibration) {
    if (!known->IsUsable()) {
      return BadInputError(options.sweep->static_file + ": is not usable (" +
                           std::string(OutcomeName(known->outcome)) + ")");
    }
    reference = known->reference.temperature_degc;
    // Temperature terms are refused with words of their own.
    const bool has_terms = std::any_of(kTriads.begin(), kTriads.end(), [&](Triad triad) {
      return known->sensors[triad] && known->sensors[triad]->thermal;
    });
    if (const auto& recorded = known->reference.recorded_degc; recorded && !has_terms) {
      TRUETRIAD_RETURN_IF_ERROR(CheckRecorded(*recorded, options.sweep->static_file));
      if (std::abs((*recorded)[1] - reference) > kSameDegc) {
        calibration.messages.push_back(
            SayRecorded(*recorded, reference, options.sweep->static_file));
      }
      reference = (*recorded)[1];
    }
    calibration.reference = known->reference;
    calibration.reference.recorded_degc.reset();
    calibration.gauge = known->gauge;
    calibration.gauge_sensor = known->gauge_sensor;
  }
  calibration.reference.temperature_degc = reference;
  NamedCovariance& covariance = calibration.covariance;
  double chi2 = 0.0, chi2_dof = 0.0;
  quality.effective_dof = std::numeric_limits<double>::infinity();
  for (const Triad triad : kTriads) {
    if (!options.triads[triad].enabled) continue;
    TriadSweep swept(poses, options, triad, reference);
    const std::string name(TriadName(triad));
    const int most = ThermalOptions::kMaxBiasOrder + 3 + swept.problem().attitude_count();
    if (swept.problem().size() < 3 * most) {
      return refuse(name + ": there are " + std::to_string(swept.problem().size()) +
                    " windows; at least " + std::to_string(3 * most) + " are expected");
    }
    const Eigen::Vector2d range = RangeOf(swept.problem());
    if (range[1] - range[0] < kLeastRangeDegc) {
      return refuse(
          Format("the temperature changes by %.2f degC only; sweep over ", range[1] - range[0]) +
          "the range in which the unit is to work");
    }
    const bool is_outside = reference < range[0] || reference > range[1];
    const std::string where = Format("%.1f degC lies outside of the sweep's ", reference) +
                              Format("%.1f to ", range[0]) + Format("%.1f degC", range[1]);
    if (is_outside && options.sweep->static_calibration) {
      return BadInputError(options.sweep->static_file + ": its temperature of " + where +
                           ", so that the terms would be extrapolated to it; sweep over it");
    }
    for (const double knot : options.triads[triad].thermal.knots_degc) {
      if (knot > range[0] && knot < range[1]) continue;
      return UsageError("sensors." + name +
                        Format(".thermal.knots: %g degC lies outside of the ", knot) +
                        Format("sweep's %.1f to ", range[0]) + Format("%.1f degC", range[1]));
    }
    TRUETRIAD_RETURN_IF_ERROR(swept.Run(&calibration));
    quality.residual_rms[triad] = ResidualRms(calibration, triad);
    if (!options.sweep->static_calibration) TRUETRIAD_RETURN_IF_ERROR(CheckLimits(options, triad));
    if (is_outside) {
      calibration.messages.push_back(name + ": the reference temperature of " + where +
                                     "; what is stated there is extrapolated");
    }
    if (triad != Triad::kGyroscope && !options.sweep->static_calibration) {
      calibration.messages.push_back(
          name +
          ": bias and sensitivity at the reference temperature are held, not measured: in an "
          "attitude that is not known only the temperature terms show; give a calibration at one "
          "temperature as `static: FILE.yaml`");
    }
    if (triad == Triad::kAccelerometer && options.sweep->static_calibration) {
      if (const auto miss = MissedGravity(calibration, swept)) {
        if (miss->share > kOtherUnitShare) {
          return refuse(miss->words + options.sweep->static_file +
                        " is not of this unit; calibrate it at one temperature");
        }
        calibration.messages.push_back(miss->words +
                                       "the unit or its thermometer has changed in between");
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      const SweepFit& fit = swept.choices()[static_cast<std::size_t>(axis)].fit;
      const Eigen::VectorXd variance = swept.problem().noise_variance().row(axis).transpose();
      const auto n = static_cast<double>(fit.residuals.size());
      const double rho = std::clamp(fit.correlation, 0.0, 0.97);
      const auto parameters = static_cast<double>(fit.coefficients.size());
      quality.effective_dof = std::min(quality.effective_dof,
                                       std::max(1.0, n * (1.0 - rho) / (1.0 + rho) - parameters));
      quality.dof += n - parameters;
      if (!(variance.minCoeff() > 0.0)) continue;
      chi2 += fit.residuals.cwiseAbs2().cwiseQuotient(variance).sum();
      chi2_dof += n - parameters;
    }
  }
  if (options.sweep->static_calibration) {
    TakeStaticCovariance(*options.sweep->static_calibration, &covariance);
  }
  quality.reduced_chi2 =
      chi2_dof > 0.0 ? chi2 / chi2_dof : std::numeric_limits<double>::quiet_NaN();
  quality.reduced_chi2_before = quality.reduced_chi2;
  SayLeftOut(quality, &calibration.messages);
  SayUnexplained(quality, &calibration.messages);
  if (!covariance.matrix.allFinite() || covariance.matrix.diagonal().minCoeff() < 0.0) {
    calibration.outcome = Outcome::kNotConverged;
    calibration.messages.emplace_back(
        "the numbers left the range that can be computed with; look for absurd readings");
    return {};
  }
  calibration.outcome = Outcome::kConverged;
  StateAbout(options.reference.temperature_degc, &calibration);
  return StateLimits(options, poses, &calibration);
}

}  // namespace truetriad
