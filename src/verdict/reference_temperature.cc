// SPDX-License-Identifier: Apache-2.0
#include "verdict/reference_temperature.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <vector>

#include "problem/parameter_name.h"
#include "truetriad/model/calibration.h"
#include "verdict/presentation.h"

namespace truetriad {
namespace {

// Weights of the old coefficients c_0, c_1, … in the new coefficient of `power`, if the reference
// temperature rises by `shift`.
std::vector<double> ShiftWeights(std::size_t power, std::size_t size, double shift) {
  // Weight of c_i in the new c_power.
  std::vector<double> weights(size, 0.0);
  double binomial = 1.0;
  for (std::size_t i = power; i < size; ++i) {
    weights[i] = binomial * std::pow(shift, static_cast<double>(i - power));
    binomial *= static_cast<double>(i + 1) / static_cast<double>(i + 1 - power);
  }
  return weights;
}

template <typename T>
void ShiftPowers(double shift, T* constant, std::vector<T>* powers) {
  std::vector<T> all = {*constant};
  all.insert(all.end(), powers->begin(), powers->end());
  for (std::size_t power = 0; power < all.size(); ++power) {
    const std::vector<double> weights = ShiftWeights(power, all.size(), shift);
    T sum = T::Zero();
    for (std::size_t i = power; i < all.size(); ++i) sum += weights[i] * all[i];
    (power == 0 ? *constant : (*powers)[power - 1]) = sum;
  }
}

// Adds to `jacobian`, which is an identity at first, the derivatives of one sensor's new terms by
// its old ones.
void AddShift(const Calibration& calibration,
              Triad triad,
              double shift,
              Eigen::MatrixXd* jacobian) {
  const NamedCovariance& covariance = calibration.covariance;
  const ThermalTerms& thermal = *calibration.sensors[triad]->thermal;
  const auto add = [&](const ParameterName& to, const ParameterName& from, double weight) {
    const int row = PlaceOf(covariance, to);
    const int col = PlaceOf(covariance, from);
    if (row >= 0 && col >= 0) (*jacobian)(row, col) += weight;
  };
  for (const auto& [kind, size, cols] :
       {std::tuple(ParameterKind::kBias, thermal.bias.size() + 1, 1),
        std::tuple(ParameterKind::kSensitivity, thermal.sensitivity.size() + 1, 3)}) {
    for (std::size_t power = 0; power < size; ++power) {
      const std::vector<double> weights = ShiftWeights(power, size, shift);
      for (std::size_t i = power + 1; i < size; ++i) {
        for (int row = 0; row < 3; ++row) {
          for (int col = 0; col < cols; ++col) {
            add({triad, kind, static_cast<int>(power), row, col},
                {triad, kind, static_cast<int>(i), row, col},
                weights[i]);
          }
        }
      }
    }
  }
  for (int row = 0; row < 3 && thermal.rate[RateTerm::kCross]; ++row) {
    add({triad, ParameterKind::kRateLinear, 0, row, 0},
        {triad, ParameterKind::kRateCross, 0, row, 0},
        shift);
  }
}

}  // namespace

bool StateAbout(double reference_degc, Calibration* calibration) {
  bool is_moved = false;
  for (const auto& sensor : calibration->sensors) {
    if (!sensor || !sensor->thermal) continue;
    is_moved = is_moved || sensor->thermal->reference_degc != reference_degc;
    const auto& rate = sensor->thermal->rate;
    if (rate[RateTerm::kCross] && !rate[RateTerm::kLinear]) return false;
  }
  if (!is_moved) return true;
  const auto size = static_cast<Eigen::Index>(calibration->covariance.parameters.size());
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Identity(size, size);
  for (const Triad triad : kTriads) {
    std::optional<TriadCalibration>& sensor = calibration->sensors[triad];
    if (!sensor || !sensor->thermal) continue;
    ThermalTerms& thermal = *sensor->thermal;
    const double shift = reference_degc - thermal.reference_degc;
    AddShift(*calibration, triad, shift, &jacobian);
    // The curve of the knots is zero at the reference. A new reference shifts the curve by a
    // constant, which is added to the bias.
    const Eigen::Vector3d bias =
        ModelAtTemperature(sensor->model, thermal, reference_degc, 0.0).bias;
    ShiftPowers(shift, &sensor->model.bias, &thermal.bias);
    sensor->model.bias = bias;
    ShiftPowers(shift, &sensor->model.sensitivity, &thermal.sensitivity);
    if (const auto& cross = thermal.rate[RateTerm::kCross]) {
      *thermal.rate[RateTerm::kLinear] += shift * *cross;
    }
    thermal.reference_degc = reference_degc;
  }
  calibration->reference.temperature_degc = reference_degc;
  Eigen::MatrixXd& P = calibration->covariance.matrix;
  if (P.rows() != size) return true;
  P = (jacobian * P * jacobian.transpose()).eval();
  P = 0.5 * (P + P.transpose()).eval();
  for (const Triad triad : kTriads) {
    std::optional<TriadCalibration>& sensor = calibration->sensors[triad];
    if (!sensor || !sensor->thermal) continue;
    const auto sigma = [&](const ParameterName& name, double* value) {
      const int at = PlaceOf(calibration->covariance, name);
      if (at >= 0) *value = std::sqrt(std::max(P(at, at), 0.0));
    };
    for (int row = 0; row < 3; ++row) {
      sigma({triad, ParameterKind::kBias, 0, row, 0}, &sensor->bias_sigma[row]);
      for (int col = 0; col < 3; ++col) {
        sigma({triad, ParameterKind::kSensitivity, 0, row, col},
              &sensor->sensitivity_sigma(row, col));
      }
    }
  }
  return true;
}

}  // namespace truetriad
