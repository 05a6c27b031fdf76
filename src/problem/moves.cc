// SPDX-License-Identifier: Apache-2.0
#include "problem/moves.h"

#include <cmath>

namespace truetriad {
namespace {

// Largest number of steps of a gyroscope's converter, 20 bits. Smaller differences of readings are
// no steps: the readings are not rounded.
constexpr double kMostSteps = 1 << 20;

}  // namespace

GyroMove MoveOf(const RecordedMove& recorded, const TriadModel<double>* accelerometer) {
  GyroMove move;
  move.time_s.reserve(recorded.time_ns.size());
  for (const std::int64_t time_ns : recorded.time_ns) {
    move.time_s.push_back(1e-9 * static_cast<double>(time_ns - recorded.time_ns.front()));
  }
  move.reading_raw = recorded.gyroscope_raw;
  if (accelerometer != nullptr) {
    move.force_mps2 = FieldsDuring(recorded, Triad::kAccelerometer, *accelerometer);
  }
  return move;
}

std::vector<Eigen::Vector3d> FieldsDuring(const RecordedMove& recorded,
                                          Triad triad,
                                          const TriadModel<double>& model) {
  const std::vector<Eigen::Vector3d>& readings =
      triad == Triad::kMagnetometer ? recorded.magnetometer_raw : recorded.accelerometer_raw;
  std::vector<Eigen::Vector3d> fields;
  fields.reserve(readings.size());
  for (const Eigen::Vector3d& raw : readings) fields.push_back(model.TruthFromRaw(raw));
  return fields;
}

Eigen::Vector3d ReadingSigma(const StreamSummary& gyroscope) {
  // A step q adds the variance q^2 / 12 while the unit turns, also if it hides the noise at rest.
  const Eigen::Array3d range = gyroscope.maximum_raw - gyroscope.minimum_raw;
  const Eigen::Array3d step = gyroscope.resolution_raw;
  const Eigen::Array3d rounding = (range < kMostSteps * step).select(step / std::sqrt(12.0), 0.0);
  return gyroscope.noise_sigma_raw.cwiseProduct(gyroscope.correlation_inflation.cwiseSqrt())
      .cwiseMax(rounding.matrix());
}

}  // namespace truetriad
