// SPDX-License-Identifier: Apache-2.0
#include "problem/moves.h"

namespace truetriad {

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
  return gyroscope.noise_sigma_raw.cwiseProduct(gyroscope.correlation_inflation.cwiseSqrt());
}

}  // namespace truetriad
