// SPDX-License-Identifier: Apache-2.0
#include "truetriad/model/gyro_increment.h"

#include <array>
#include <cstddef>
#include <vector>

#include <glog/logging.h>

#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// Sums over the readings of weight * turned * (what the rate is multiplied with), with `turned`
// the attitude against the begin.
struct Sums {
  Eigen::Matrix3d by_reading = Eigen::Matrix3d::Zero();
  std::array<Eigen::Matrix3d, 3> by_rate{
      Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  std::array<Eigen::Matrix3d, 3> by_force = by_rate;
  Eigen::Matrix3d by_size = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
};

// The sensor that the readings come from.
struct Sensor {
  const GyroModel& model;
  Eigen::Matrix3d correction;
  Eigen::Vector3d sigma_raw;
};

// What one reading adds: it turned the body by weight_s * rate while that stood at `turned`.
void AddReading(const Sensor& sensor,
                const Eigen::Matrix3d& turned,
                double weight_s,
                const Eigen::Vector3d& rate_radps,
                const Eigen::Vector3d* force_mps2,
                Sums* sums) {
  const Eigen::Matrix3d weighted = weight_s * turned;
  Eigen::Matrix3d by_reading = weighted * sensor.correction;
  if (sensor.model.has_asymmetry) {
    const Eigen::Vector3d felt = sensor.model.triad.sensitivity * rate_radps;
    by_reading *= sensor.model.triad.Slope(felt).cwiseInverse().asDiagonal();
    sums->by_size += by_reading * felt.cwiseAbs().asDiagonal();
  }
  sums->by_reading += by_reading;
  for (std::size_t j = 0; j < 3; ++j) {
    const auto axis = static_cast<Eigen::Index>(j);
    sums->by_rate[j] += rate_radps[axis] * weighted;
    if (force_mps2 != nullptr) sums->by_force[j] += (*force_mps2)[axis] * by_reading;
  }
  const Eigen::Matrix3d noise = by_reading * sensor.sigma_raw.asDiagonal();
  sums->noise.noalias() += noise * noise.transpose();
}

// Change of the rate per second about sample i, from its neighbours; zero at the ends, where the
// unit rests. Not the weighted difference for uneven steps: this one does not amplify noise beside
// a gap.
Eigen::Vector3d Slope(const std::vector<double>& time_s,
                      const std::vector<Eigen::Vector3d>& rates,
                      std::size_t i) {
  if (i == 0 || i + 1 == rates.size() || !(time_s[i + 1] > time_s[i - 1])) {
    return Eigen::Vector3d::Zero();
  }
  return (rates[i + 1] - rates[i - 1]) / (time_s[i + 1] - time_s[i - 1]);
}

// Rotation vector from sample `first` to the next.
Eigen::Vector3d InstantaneousStep(const std::vector<double>& time_s,
                                  const std::vector<Eigen::Vector3d>& rates,
                                  std::size_t first) {
  const double step_s = time_s[first + 1] - time_s[first];
  const Eigen::Vector3d& begin = rates[first];
  const Eigen::Vector3d& end = rates[first + 1];
  return 0.5 * step_s * (begin + end) +
         step_s * step_s / 12.0 *
             (begin.cross(end) + Slope(time_s, rates, first) - Slope(time_s, rates, first + 1));
}

}  // namespace

GyroIncrement IntegrateMove(const GyroMove& move,
                            const GyroModel& model,
                            const Eigen::Vector3d& sigma_raw,
                            RateSampling sampling) {
  const std::size_t count = move.time_s.size();
  CHECK_GT(count, 0U);
  CHECK_EQ(move.reading_raw.size(), count);
  const bool has_force = !move.force_mps2.empty();
  if (has_force) CHECK_EQ(move.force_mps2.size(), count);
  CHECK(model.triad.quadratic.isZero(0.0));
  CHECK(model.has_asymmetry || model.triad.asymmetry.isZero(0.0));

  const Sensor sensor{model, model.triad.Correction(), sigma_raw};
  std::vector<Eigen::Vector3d> rates(count);
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Vector3d raw = move.reading_raw[i] - model.triad.bias;
    if (has_force) raw -= model.g_sensitivity * move.force_mps2[i];
    rates[i] = sensor.correction * model.triad.Felt(raw);
  }
  const auto force_at = [&](std::size_t i) { return has_force ? &move.force_mps2[i] : nullptr; };

  const bool is_mean = sampling == RateSampling::kMeanRate;
  Sums sums;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
  double half_step_before_s = 0.0;
  for (std::size_t i = 1; i < count; ++i) {
    const double step_s = move.time_s[i] - move.time_s[i - 1];
    const Eigen::Matrix3d turned_before = turned;
    rotation = rotation * RotationExp(is_mean ? Eigen::Vector3d(step_s * rates[i])
                                              : InstantaneousStep(move.time_s, rates, i - 1));
    turned = rotation.toRotationMatrix();
    if (is_mean) {
      AddReading(sensor, 0.5 * (turned_before + turned), step_s, rates[i], force_at(i), &sums);
    } else {
      AddReading(sensor,
                 turned_before,
                 half_step_before_s + 0.5 * step_s,
                 rates[i - 1],
                 force_at(i - 1),
                 &sums);
      half_step_before_s = 0.5 * step_s;
    }
  }
  if (!is_mean) {
    AddReading(sensor, turned, half_step_before_s, rates.back(), force_at(count - 1), &sums);
  }

  GyroIncrement increment;
  increment.duration_s = move.time_s.back() - move.time_s.front();
  increment.rotation = rotation.normalized();
  const Eigen::Matrix3d to_end = turned.transpose();
  // d rate = -C dS rate - C D^-1 (db + dG force + |u| da) with D = d raw / d u.
  increment.by_bias = -to_end * sums.by_reading;
  increment.by_asymmetry = -to_end * sums.by_size;
  for (std::size_t j = 0; j < 3; ++j) {
    const Eigen::Index columns = 3 * static_cast<Eigen::Index>(j);
    increment.by_sensitivity.middleCols<3>(columns) = -to_end * sums.by_rate[j] * sensor.correction;
    increment.by_g_sensitivity.middleCols<3>(columns) = -to_end * sums.by_force[j];
  }
  increment.covariance = to_end * sums.noise * turned;
  return increment;
}

}  // namespace truetriad
