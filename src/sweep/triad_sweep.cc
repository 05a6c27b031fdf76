// SPDX-License-Identifier: Apache-2.0
#include "sweep/triad_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include <Eigen/Dense>

#include "math/dense/lu.h"
#include "math/dense/products.h"
#include "problem/parameter_name.h"
#include "sweep/sweep_fit.h"
#include "sweep/sweep_regression.h"

namespace truetriad {
namespace {

// Chosen: the largest number of windows in a chart. More would show no more detail, so the windows
// of longer sweeps are thinned out.
constexpr int kMostShown = 400;

ThermalBlock BlockOf(const ThermalOptions& terms) {
  ThermalBlock block;
  block.at = 0;
  block.terms = terms;
  return block;
}

// The number of columns that the knots of an axis need.
Eigen::Index KnotColumns(const ThermalOptions& terms) {
  return static_cast<Eigen::Index>(terms.knots_degc.size()) * (terms.smooth_knots ? 1 : 2);
}

// The terms of one axis as powers of tau, in the order of TermsOf.
struct TermsInTau {
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;
};

TermsInTau InTau(const SweepProblem& problem, int axis, const SweepFit& fit) {
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
  TermsInTau terms{listed * fit.coefficients, listed * fit.covariance * listed.transpose()};
  terms.values[0] += problem.origin()[axis];
  return terms;
}

// For each term in tau of `fit`, adds the square of its shift from `fit` to `higher` to its
// variance; correlations between terms are left out. Returns the largest of these shifts in σ.
double WidenBy(const SweepProblem& problem, int axis, const SweepFit& higher, SweepFit* fit) {
  const int order = fit->terms.bias_order, more = higher.terms.bias_order - order;
  const TermsInTau without = InTau(problem, axis, *fit);
  const Eigen::VectorXd with = InTau(problem, axis, higher).values;
  const int constants = problem.attitude_count();
  const Eigen::MatrixXd listed = BlockOf(fit->terms).ListedFromVectors(problem.scale());
  const Eigen::Index size = listed.rows();
  Eigen::VectorXd moved(1 + size);
  moved.head(1 + order) = with.head(1 + order);
  moved.tail(size - order) = with.segment(1 + order + more, size - order);
  moved -= without.values.head(1 + size);
  const Eigen::MatrixXd vectors = InverseByLu(listed) * moved.tail(size).asDiagonal();
  fit->covariance.block(constants, constants, size, size) += TimesTranspose(vectors, vectors);
  fit->covariance(0, 0) += moved[0] * moved[0];
  const Eigen::ArrayXd variances = without.covariance.diagonal().head(1 + size).array();
  return std::sqrt((variances > 0.0).select(moved.array().square() / variances, 0.0).maxCoeff());
}

// A term: its name in the covariance, and where its value is stored.
struct NamedTerm {
  std::string name;
  double* value;
};

// The terms of one axis of a sensor: its bias, powers of tau, rates, knots, lags.
std::vector<NamedTerm> TermsOf(Triad triad,
                               int axis,
                               const SweepFit& fit,
                               TriadCalibration* sensor) {
  ThermalTerms& thermal = *sensor->thermal;
  std::vector<NamedTerm> terms;
  const auto add = [&](ParameterKind kind, int power, Eigen::Vector3d* vector) {
    terms.push_back({ParameterName{triad, kind, power, axis, 0}.str(), &(*vector)[axis]});
  };
  const auto held = [](std::optional<Eigen::Vector3d>* vector) {
    if (!*vector) *vector = Eigen::Vector3d::Zero();
    return &**vector;
  };
  add(ParameterKind::kBias, 0, &sensor->model.bias);
  const auto order = static_cast<std::size_t>(fit.terms.bias_order);
  thermal.bias.resize(std::max(thermal.bias.size(), order), Eigen::Vector3d::Zero());
  for (std::size_t power = 1; power <= order; ++power) {
    add(ParameterKind::kBias, static_cast<int>(power), &thermal.bias[power - 1]);
  }
  for (const RateTermInfo& info : kRateTerms) {
    if (fit.terms.rate[info.term]) add(info.kind, 0, held(&thermal.rate[info.term]));
  }
  const auto add_other = [&](const std::string& name, double* value) {
    terms.push_back(
        {std::string(TriadName(triad)) + ".thermal." + name + "." + AxisLetter(axis), value});
  };
  const std::size_t before = thermal.knots.size();
  for (const double degc : fit.terms.knots_degc) thermal.knots.push_back({axis, degc, 0.0, 0.0});
  for (std::size_t k = before; k < thermal.knots.size(); ++k) {
    const std::string knot = "knot." + std::to_string(k - before + 1);
    if (!fit.terms.smooth_knots) add_other(knot + ".slope", &thermal.knots[k].slope);
    add_other(knot + ".curve", &thermal.knots[k].curve);
  }
  const auto add_lag = [&](const char* name, double lag, std::optional<Eigen::Vector3d>* lags) {
    if (lag > 0.0) add_other(name, &(*held(lags))[axis]);
  };
  add_lag("element_lag", fit.lags.element_s, &thermal.element_lag_s);
  add_lag("rate_lag", fit.lags.rate_s, &thermal.rate_lag_s);
  return terms;
}

// The mean residual while heating minus that while cooling, over the middle half of the
// temperatures that were passed in both directions; NaN if there are none.
double BranchGap(const SweepProblem& problem, const Eigen::VectorXd& residuals) {
  // Bins of 2.5 % of the range each.
  constexpr int kTemperatureBins = 40;
  constexpr double kMoving = 0.1;  // of the fastest rate; slower windows are left out
  Eigen::ArrayX2d sum = Eigen::ArrayX2d::Zero(kTemperatureBins, 2), count = sum;
  const ThermalScale& scale = problem.scale();
  for (int i = 0; i < problem.size(); ++i) {
    const StaticPose& window = problem.window(i);
    if (std::abs(window.temperature_rate_degcps) < kMoving * scale.rate_degcps) continue;
    const double v = (*window.temperature_degc - scale.centre_degc) / scale.half_range_degc;
    const int bin =
        std::clamp(static_cast<int>(0.5 * (v + 1.0) * kTemperatureBins), 0, kTemperatureBins - 1);
    const int branch = window.temperature_rate_degcps > 0.0 ? 0 : 1;
    sum(bin, branch) += residuals[i];
    count(bin, branch) += 1.0;
  }
  std::vector<double> gaps;
  for (int bin = 0; bin < kTemperatureBins; ++bin) {
    if (count.row(bin).minCoeff() == 0.0) continue;
    gaps.push_back(sum(bin, 0) / count(bin, 0) - sum(bin, 1) / count(bin, 1));
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
  const std::size_t before = shown->size();
  for (int i = 0; i < problem->size(); i += every) {
    const StaticPose& window = problem->window(i);
    SweepWindow& row = shown->emplace_back();
    row.triad = triad;
    row.time_s = static_cast<double>(window.start_ns) * 1e-9 - start_s + 0.5 * window.duration_s();
    row.degc = *window.temperature_degc;
    row.rate_degcps = window.temperature_rate_degcps;
  }
  // A gyroscope's constant is part of its bias.
  const Eigen::Index first = triad == Triad::kGyroscope ? 0 : problem->attitude_count();
  for (int axis = 0; axis < 3; ++axis) {
    const SweepFit& fit = axes[static_cast<std::size_t>(axis)].fit;
    problem->SetKnots(fit.terms.knots_degc);
    const Eigen::Index terms = std::ssize(fit.columns) - first;
    const Eigen::MatrixXd columns = problem->Columns(problem->States(fit.lags))(
        Eigen::all, Eigen::Map<const Eigen::VectorXi>(fit.columns.data() + first, terms));
    const Eigen::RowVectorXd coefficients = fit.coefficients.segment(first, terms).transpose();
    const Eigen::MatrixXd covariance = fit.covariance.block(first, first, terms, terms);
    for (int i = 0; i < problem->size(); i += every) {
      SweepWindow& row = (*shown)[before + static_cast<std::size_t>(i / every)];
      const Eigen::RowVectorXd factors = columns.row(i);
      row.fit_raw[axis] = factors.dot(coefficients);
      if (triad == Triad::kGyroscope) row.fit_raw[axis] += problem->origin()[axis];
      row.bias_raw[axis] = row.fit_raw[axis] + fit.residuals[i];
      const double variance = factors * covariance * factors.transpose();
      row.fit_sigma_raw[axis] = std::sqrt(std::max(variance, 0.0));
    }
  }
}

// The triad's part of the static calibration. Errors: this part is missing or does not fit the
// recording.
Result<TriadCalibration> StaticSensor(const SweepOptions& sweep,
                                      Triad triad,
                                      const std::string& unit) {
  const std::string name(TriadName(triad));
  const Calibration& calibration = *sweep.static_calibration;
  const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
  if (!sensor) {
    return Error(ErrorCode::kMissingSensor,
                 {sweep.static_file},
                 "has no " + name +
                     ", to which the sweep would add temperature terms; calibrate this sensor "
                     "there too, or take it out of the sweep");
  }
  if (sensor->input_unit != unit) {
    return Error(ErrorCode::kUnitMismatch,
                 {sweep.static_file},
                 "the " + name + " is in " + sensor->input_unit + ", but the sweep is in " + unit +
                     "; record both in the same unit");
  }
  if (sensor->thermal) {
    return Error(ErrorCode::kDoesNotMatch,
                 {sweep.static_file},
                 "the " + name +
                     " has temperature terms already; a sweep adds them to a calibration at one "
                     "temperature: give one without `thermal:`");
  }
  return *sensor;
}

}  // namespace

TriadSweep::TriadSweep(const PoseSet& poses,
                       const CalibrateOptions& options,
                       Triad triad,
                       double reference)
    : options_(options),
      triad_(triad),
      poses_(poses),
      problem_(poses,
               triad,
               reference,
               options.sweep->even_temperatures,
               options.cross_validation_folds) {}

Eigen::Vector2d TriadSweep::range_degc() const {
  const ThermalScale& scale = problem_.scale();
  return {scale.centre_degc - scale.half_range_degc, scale.centre_degc + scale.half_range_degc};
}

Status TriadSweep::Run(Calibration* calibration) {
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
    sensor.mounting = wanted.mounting.value_or(Eigen::Matrix3d::Identity());
  }
  sensor.input_unit = unit;
  sensor.output_unit = TruthUnitName(triad_);
  ThermalTerms& thermal = sensor.thermal.emplace();
  thermal.reference_degc = problem_.scale().reference_degc;
  thermal.range_degc = range_degc();
  thermal.smoothing_s = poses_.sweep.temperature.smoothing_s;
  thermal.rate_range_degcps = problem_.rate_range_degcps();
  for (int axis = 0; axis < 3; ++axis) {
    choices_.push_back(ChooseSweep(&problem_, axis, options_.triads[triad_].thermal));
    if (SweepChoice& choice = choices_.back(); choice.higher) {
      choice.moved_sigmas = WidenBy(problem_, axis, *choice.higher, &choice.fit);
    }
    TakeTerms(axis, &sensor);
    calibration->quality.sweep.axes.push_back(
        DescribeAxis(problem_, triad_, axis, choices_.back()));
    if (const ThermalOptions& wanted = options_.triads[triad_].thermal; wanted.has_regression()) {
      calibration->quality.sweep.axes.back().regression =
          RegressSweep(problem_, axis, wanted, unit);
    }
  }
  if (thermal.bias.empty()) thermal.bias.emplace_back(Eigen::Vector3d::Zero());
  StateNoise(calibration->quality, &sensor);
  ShowWindows(&problem_, triad_, choices_, &calibration->quality.sweep.windows);
  List(&sensor, &calibration->covariance);
  calibration->sensors[triad_] = std::move(sensor);
  return {};
}

void TriadSweep::TakeTerms(int axis, TriadCalibration* sensor) {
  const SweepFit& fit = choices_.back().fit;
  const TermsInTau in_tau = InTau(problem_, axis, fit);
  const std::vector<NamedTerm> terms = TermsOf(triad_, axis, fit, sensor);
  // The constant determines the bias only for a gyroscope.
  const std::size_t first = triad_ == Triad::kGyroscope ? 0 : 1;
  ListedTerms& listed = listed_.emplace_back();
  for (std::size_t i = first; i < terms.size(); ++i) {
    *terms[i].value = in_tau.values[static_cast<Eigen::Index>(i)];
    listed.names.push_back(terms[i].name);
  }
  const std::ptrdiff_t size = std::ssize(listed.names);
  listed.covariance = in_tau.covariance.bottomRightCorner(size, size);
}

void TriadSweep::StateNoise(const Quality& quality, TriadCalibration* sensor) const {
  sensor->noise = TriadNoise();
  const Eigen::Vector3d gain = sensor->model.sensitivity.rowwise().norm();
  double excess = 0.0;
  for (const SweepAxis& axis : quality.sweep.axes) {
    if (axis.triad != triad_) continue;
    sensor->noise.sigma[axis.axis] = axis.noise_sigma;
    const double more = axis.rms_after * axis.rms_after - axis.noise_sigma * axis.noise_sigma;
    excess += std::max(0.0, more) / (gain[axis.axis] * gain[axis.axis]) / 3.0;
  }
  sensor->noise.source = NoiseSource::kStatic;
  sensor->noise.excess_sigma = std::sqrt(excess);
  sensor->noise.excess_dof = static_cast<double>(problem_.size());
}

void TriadSweep::List(TriadCalibration* sensor, NamedCovariance* covariance) const {
  std::vector<std::string>& names = covariance->parameters;
  const std::ptrdiff_t before = std::ssize(names);
  const ThermalTerms& thermal = *sensor->thermal;
  const auto list = [&](ParameterKind kind, int power) {
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < (InfoOf(kind).is_matrix ? 3 : 1); ++col) {
        names.push_back(ParameterName{triad_, kind, power, row, col}.str());
      }
    }
  };
  list(ParameterKind::kBias, 0);
  list(ParameterKind::kSensitivity, 0);
  for (std::size_t power = 1; power <= thermal.bias.size(); ++power) {
    list(ParameterKind::kBias, static_cast<int>(power));
  }
  for (const RateTermInfo& info : kRateTerms) {
    if (thermal.rate[info.term]) list(info.kind, 0);
  }
  std::vector<std::vector<std::ptrdiff_t>> places;
  for (const ListedTerms& listed : listed_) {
    std::vector<std::ptrdiff_t>& of_axis = places.emplace_back();
    for (const std::string& name : listed.names) {
      const auto found = std::find(names.begin() + before, names.end(), name);
      of_axis.push_back(found - names.begin());
      if (found == names.end()) names.push_back(name);
    }
  }
  const std::ptrdiff_t size = std::ssize(names);
  covariance->matrix.conservativeResizeLike(Eigen::MatrixXd::Zero(size, size));
  for (std::size_t axis = 0; axis < listed_.size(); ++axis) {
    covariance->matrix(places[axis], places[axis]) = listed_[axis].covariance;
  }
  if (triad_ == Triad::kGyroscope) {
    sensor->bias_sigma = covariance->matrix.diagonal().segment<3>(before).cwiseMax(0.0).cwiseSqrt();
  }
}

}  // namespace truetriad
