// SPDX-License-Identifier: Apache-2.0
#include "formats/loss.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "problem/parameter_name.h"
#include "truetriad/model/thermal.h"

namespace truetriad {
namespace {

// About 14 deg apart on the sphere: quadratic terms change by a few per cent from one to the next.
constexpr int kDirections = 200;
// Chosen: every bend of a cubic is met several times over.
constexpr int kTemperatures = 17;
// Of those that a sweep passed, both ends among them.
constexpr int kRates = 5;

/// Directions on a Fibonacci spiral.
Eigen::Vector3d Direction(int i) {
  const double z = 1.0 - (2.0 * i + 1.0) / kDirections;
  const double r = std::sqrt(1.0 - z * z);
  const double longitude = 2.0 * std::numbers::pi * i / std::numbers::phi;
  return {r * std::cos(longitude), r * std::sin(longitude), z};
}

double Signal(Triad triad, const ReferenceValues& reference) {
  // At middle latitudes.
  constexpr double kTypicalFieldUt = 50.0;
  switch (triad) {
    case Triad::kAccelerometer:
      return reference.gravity_mps2;
    case Triad::kGyroscope:
      return std::numbers::pi;
    case Triad::kMagnetometer:
      return reference.field_ut.value_or(kTypicalFieldUt);
  }
  return 1.0;
}

std::vector<double> Temperatures(const TriadCalibration& sensor, const ReferenceValues& reference) {
  if (!sensor.thermal) return {reference.temperature_degc};
  const Eigen::Vector2d& range = sensor.thermal->range_degc;
  std::vector<double> temperatures;
  for (int i = 0; i < kTemperatures; ++i) {
    temperatures.push_back(range[0] + (range[1] - range[0]) * i / (kTemperatures - 1.0));
  }
  return temperatures;
}

/// Covariance of the corrected reading's error from the uncertainty of the parameters, to
/// first order in the higher terms: d truth = -C (dS truth + db + dG f + dq o u^2 + da o |u|), u =
/// S truth.
class PredictionSigma {
 public:
  PredictionSigma(Triad triad, const Calibration& calibration)
      : matrix_(calibration.covariance.matrix) {
    names_.reserve(calibration.covariance.parameters.size());
    for (const std::string& text : calibration.covariance.parameters) {
      std::optional<ParameterName> name = ParameterName::Parse(text);
      if (name && name->triad != triad) name.reset();
      names_.push_back(name);
    }
  }

  /// σ of the error's length.
  double operator()(const TriadModel<double>& model,
                    const Eigen::Vector3d& truth,
                    const Eigen::Vector3d& force_mps2,
                    double tau_degc) const {
    return std::sqrt(std::max(Covariance(model, truth, force_mps2, tau_degc).trace(), 0.0));
  }

  Eigen::Matrix3d Covariance(const TriadModel<double>& model,
                             const Eigen::Vector3d& truth,
                             const Eigen::Vector3d& force_mps2,
                             double tau_degc) const {
    const Eigen::Matrix3d correction = model.Correction();
    const Eigen::Vector3d felt = model.sensitivity * truth;
    Eigen::Matrix3Xd jacobian = Eigen::Matrix3Xd::Zero(3, matrix_.rows());
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (!names_[i]) continue;
      const ParameterName& name = *names_[i];
      double factor = std::pow(tau_degc, name.power);
      if (name.kind == ParameterKind::kSensitivity) {
        factor *= truth[name.col];
      } else if (name.kind == ParameterKind::kGSensitivity) {
        factor *= force_mps2[name.col];
      } else if (const auto term = InfoOf(name.kind).axis_term) {
        factor *= ValueOf(*term, felt[name.row]);
      } else if (name.kind != ParameterKind::kBias) {
        continue;  // Terms in the rate of temperature: no rate here.
      }
      jacobian.col(static_cast<Eigen::Index>(i)) = -factor * correction.col(name.row);
    }
    return jacobian * matrix_ * jacobian.transpose();
  }

 private:
  std::vector<std::optional<ParameterName>> names_;
  const Eigen::MatrixXd& matrix_;
};

bool HasRates(const ThermalTerms& thermal) { return thermal.rate.any() || thermal.element_lag_s; }

bool DropsRates(const Restated& restated, Triad triad) {
  const std::optional<ThermalTerms>& held = restated.held.sensors[triad]->thermal;
  return HasRates(*restated.whole.sensors[triad]->thermal) && !(held && HasRates(*held));
}

// What each axis feels when the thermometer has long gone at a rate: it is behind by its lag.
ThermalState SettledState(const ThermalTerms& thermal, double degc, double rate_degcps) {
  ThermalState state;
  const Eigen::Vector3d lag_s = thermal.element_lag_s.value_or(Eigen::Vector3d::Zero());
  state.degc = (degc - rate_degcps * lag_s.array()).matrix();
  state.rate_degcps.setConstant(rate_degcps);
  return state;
}

ExportLoss::AtRates LossAtRates(Triad triad,
                                const Equation& equation,
                                const Restated& restated,
                                const ReferenceValues& reference) {
  const TriadCalibration& whole = *restated.whole.sensors[triad];
  const double signal = Signal(triad, reference);
  ExportLoss::AtRates loss;
  loss.range_degcps = *whole.thermal->rate_range_degcps;
  double squares = 0.0;
  int points = 0;
  for (const double degc : Temperatures(whole, reference)) {
    for (int r = 0; r < kRates; ++r) {
      const double rate =
          loss.range_degcps[0] + (loss.range_degcps[1] - loss.range_degcps[0]) * r / (kRates - 1.0);
      const TriadModel<double> model =
          ModelAtTemperature(whole.model, *whole.thermal, SettledState(*whole.thermal, degc, rate));
      for (int i = 0; i < kDirections; ++i) {
        const Eigen::Vector3d truth = signal * Direction(i);
        const Eigen::Vector3d force = reference.gravity_mps2 * Direction((7 * i) % kDirections);
        Eigen::Vector3d raw = model.RawFromTruth(truth);
        if (whole.g_sensitivity) raw += *whole.g_sensitivity * force;
        const double error = (restated.truth_per_result[triad] *
                                  equation(restated.reading_per_raw[triad] * raw, force, degc) -
                              truth)
                                 .norm();
        loss.largest = std::max(loss.largest, error);
        squares += error * error;
        ++points;
      }
    }
  }
  loss.rms = std::sqrt(squares / points);
  return loss;
}

}  // namespace

ExportLoss LossOf(Triad triad,
                  const Equation& equation,
                  const Restated& restated,
                  const Calibration& calibration) {
  const TriadCalibration& whole = *restated.whole.sensors[triad];
  const TriadCalibration& stated = *calibration.sensors[triad];
  const Eigen::Matrix3d& rotation = restated.rotation[triad];
  const PredictionSigma sigma_of(triad, calibration);
  ExportLoss loss;
  loss.signal = Signal(triad, calibration.reference);
  double squares = 0.0;
  int points = 0;
  for (const double temperature : Temperatures(whole, calibration.reference)) {
    const auto at = [temperature](const TriadCalibration& sensor) {
      return sensor.thermal ? ModelAtTemperature(sensor.model, *sensor.thermal, temperature)
                            : sensor.model;
    };
    const TriadModel<double> model = at(whole);
    const TriadModel<double> stated_model = at(stated);
    const double tau = whole.thermal ? temperature - whole.thermal->reference_degc : 0.0;
    for (int i = 0; i < kDirections; ++i) {
      const Eigen::Vector3d truth = loss.signal * Direction(i);
      // Any force goes with any rate.
      const Eigen::Vector3d force =
          calibration.reference.gravity_mps2 * Direction((7 * i) % kDirections);
      Eigen::Vector3d raw = model.RawFromTruth(truth);
      if (whole.g_sensitivity) raw += *whole.g_sensitivity * force;
      const Eigen::Vector3d result =
          restated.truth_per_result[triad] *
          equation(restated.reading_per_raw[triad] * raw, force, temperature);
      const double error = (result - truth).norm();
      loss.largest = std::max(loss.largest, error);
      squares += error * error;
      ++points;
      const double sigma = sigma_of(stated_model, rotation * truth, rotation * force, tau);
      if (sigma > 0.0) loss.in_sigmas = std::max(loss.in_sigmas.value_or(0.0), error / sigma);
    }
  }
  loss.rms = std::sqrt(squares / points);
  if (whole.thermal && whole.thermal->rate_range_degcps && DropsRates(restated, triad)) {
    loss.at_rates = LossAtRates(triad, equation, restated, calibration.reference);
  }
  return loss;
}

Eigen::Vector3d ReadingVariances(Triad triad, const Calibration& calibration) {
  const TriadModel<double>& model = calibration.sensors[triad]->model;
  const double signal = Signal(triad, calibration.reference);
  const PredictionSigma sigma_of(triad, calibration);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < kDirections; ++i) {
    const Eigen::Vector3d force =
        calibration.reference.gravity_mps2 * Direction((7 * i) % kDirections);
    sum += sigma_of.Covariance(model, signal * Direction(i), force, 0.0).diagonal();
  }
  return sum.cwiseMax(0.0) / kDirections;
}

}  // namespace truetriad
