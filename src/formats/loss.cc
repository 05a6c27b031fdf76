// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "calibrate/evaluated_poses.h"
#include "formats/restate.h"
#include "model/directions.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

// Neighbouring truths are 14 deg apart (sqrt(4 pi / 200)); over this angle quadratic terms change
// by a few per cent.
constexpr int kDirections = 200;
// Chosen: a cubic has two extremes and one inflection; 17 points cover the surroundings of each.
constexpr int kTemperatures = 17;
// Five rates, evenly spaced over the range of the sweep, with both ends.
constexpr int kRates = 5;

Eigen::Vector3d Direction(int i) { return EvenDirection(i, kDirections); }

double Signal(Triad triad, const ReferenceValues& reference) {
  // The field strength at middle latitudes.
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

/// Covariance of the error that the uncertainty of the parameters causes in a corrected reading.
Eigen::Matrix3d PredictedCovariance(const NamesOfTriad& names,
                                    const Eigen::MatrixXd& covariance,
                                    const ModelAtPose& at,
                                    const Eigen::Vector3d& truth,
                                    const Eigen::Vector3d& force_mps2) {
  const Eigen::Matrix3Xd by_parameters = TruthByParameters(names, at, truth, force_mps2);
  return by_parameters * covariance * by_parameters.transpose();
}

bool HasRates(const ThermalTerms& thermal) { return thermal.rate.any() || thermal.element_lag_s; }

bool DropsRates(const Restated& restated, Triad triad) {
  const std::optional<ThermalTerms>& held = restated.held.sensors[triad]->thermal;
  return HasRates(*restated.whole.sensors[triad]->thermal) && !(held && HasRates(*held));
}

// The thermal state of each axis after the thermometer has changed at this rate for a long time:
// the temperature of an axis is then behind the thermometer by the axis' lag times the rate.
ThermalState SettledState(const ThermalTerms& thermal, double degc, double rate_degcps) {
  ThermalState state;
  const Eigen::Vector3d lag_s = thermal.element_lag_s.value_or(Eigen::Vector3d::Zero());
  state.degc = (degc - rate_degcps * lag_s.array()).matrix();
  state.rate_degcps.setConstant(rate_degcps);
  return state;
}

/// The force for the truth number `i`. As 7 and 200 are coprime, every force direction occurs once.
Eigen::Vector3d ForceWith(int i, const ReferenceValues& reference) {
  return reference.gravity_mps2 * Direction((7 * i) % kDirections);
}

/// For each truth on the sphere: the length of the error of the target's result. `model` predicts
/// the readings, at the temperature `degc`.
Eigen::VectorXd ErrorsOf(Triad triad,
                         const Equation& equation,
                         const Restated& restated,
                         const TriadModel<double>& model,
                         double degc) {
  const Calibration& whole = restated.whole;
  const auto& g_sensitivity = whole.sensors[triad]->g_sensitivity;
  Eigen::VectorXd errors(kDirections);
  for (int i = 0; i < kDirections; ++i) {
    const Eigen::Vector3d truth = Signal(triad, whole.reference) * Direction(i);
    const Eigen::Vector3d force = ForceWith(i, whole.reference);
    Eigen::Vector3d raw = model.RawFromTruth(truth);
    if (g_sensitivity) raw += *g_sensitivity * force;
    const Eigen::Vector3d result = equation(restated.reading_per_raw[triad] * raw, force, degc);
    errors[i] = (restated.truth_per_result[triad] * result - truth).norm();
  }
  return errors;
}

/// Adds errors to `loss`. Until all errors are added, loss->rms holds their mean square.
template <typename Loss>
void Add(const Eigen::VectorXd& errors, double share, Loss* loss) {
  loss->largest = std::max(loss->largest, errors.maxCoeff());
  loss->rms += share * errors.squaredNorm() / kDirections;
}

}  // namespace

ExportLoss LossOf(Triad triad,
                  const Equation& equation,
                  const Restated& restated,
                  const Calibration& calibration) {
  const TriadCalibration& whole = *restated.whole.sensors[triad];
  const std::optional<ThermalTerms>& thermal = whole.thermal;
  const Eigen::Matrix3d& rotation = restated.rotation[triad];
  const NamesOfTriad names = NamesOf(calibration.covariance, triad);
  const std::vector<double> temperatures = Temperatures(whole, calibration.reference);
  const double share = 1.0 / static_cast<double>(temperatures.size());
  ExportLoss loss;
  loss.signal = Signal(triad, calibration.reference);
  if (thermal && thermal->rate_range_degcps && DropsRates(restated, triad))
    loss.at_rates = {*thermal->rate_range_degcps};
  for (const double degc : temperatures) {
    const ThermalState steady{Eigen::Vector3d::Constant(degc), Eigen::Vector3d::Zero()};
    const ModelAtPose at = ModelAtTemperatureOf(whole, steady);
    const Eigen::VectorXd errors = ErrorsOf(triad, equation, restated, at.model, degc);
    Add(errors, share, &loss);
    const ModelAtPose stated = ModelAtTemperatureOf(*calibration.sensors[triad], steady);
    for (int i = 0; i < kDirections; ++i) {
      const double variance = PredictedCovariance(names,
                                                  calibration.covariance.matrix,
                                                  stated,
                                                  rotation * loss.signal * Direction(i),
                                                  rotation * ForceWith(i, calibration.reference))
                                  .trace();
      if (!(variance > 0.0)) continue;
      loss.in_sigmas = std::max(loss.in_sigmas.value_or(0.0), errors[i] / std::sqrt(variance));
    }
    for (int r = 0; loss.at_rates && r < kRates; ++r) {
      const Eigen::Vector2d& range = loss.at_rates->range_degcps;
      const ThermalState state =
          SettledState(*thermal, degc, range[0] + (range[1] - range[0]) * r / (kRates - 1.0));
      const TriadModel<double> model = ModelAtTemperature(whole.model, *thermal, state);
      Add(ErrorsOf(triad, equation, restated, model, degc), share / kRates, &*loss.at_rates);
    }
  }
  loss.rms = std::sqrt(loss.rms);
  if (loss.at_rates) loss.at_rates->rms = std::sqrt(loss.at_rates->rms);
  return loss;
}

Eigen::Vector3d ReadingVariances(Triad triad, const Calibration& calibration) {
  const ModelAtPose at{.model = calibration.sensors[triad]->model};
  const double signal = Signal(triad, calibration.reference);
  const NamesOfTriad names = NamesOf(calibration.covariance, triad);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < kDirections; ++i) {
    const Eigen::Vector3d force = ForceWith(i, calibration.reference);
    sum +=
        PredictedCovariance(names, calibration.covariance.matrix, at, signal * Direction(i), force)
            .diagonal();
  }
  return sum.cwiseMax(0.0) / kDirections;
}

}  // namespace truetriad
