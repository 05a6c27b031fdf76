// SPDX-License-Identifier: Apache-2.0
#include "support/synthetic_poses.h"

#include <cmath>

#include "model/world.h"
#include "truetriad/math/rotation.h"

namespace truetriad {

Eigen::Vector3d SyntheticUnit::WorldVector(Triad triad) const {
  switch (triad) {
    case Triad::kAccelerometer:
      return ForceInWorld(gravity_mps2);
    case Triad::kMagnetometer:
      return FieldInWorld(field_ut, dip_rad);
    case Triad::kGyroscope:
      break;
  }
  return Eigen::Vector3d::Zero();
}

PoseSet SimulatePoses(const SyntheticUnit& unit,
                      const std::vector<Eigen::Quaterniond>& world_from_body,
                      const SyntheticNoise& noise,
                      Random* random) {
  PoseSet set;
  set.source = "simulated poses";
  set.how = "simulated";
  for (const Triad triad : kTriads) {
    if (!unit.models[triad]) continue;
    StreamSummary stream;
    stream.triad = triad;
    stream.unit = unit.units[triad];
    stream.samples = static_cast<std::int64_t>(world_from_body.size());
    set.streams.push_back(stream);
  }
  for (std::size_t k = 0; k < world_from_body.size(); ++k) {
    StaticPose pose;
    pose.number = static_cast<int>(k) + 1;
    for (const Triad triad : kTriads) {
      if (!unit.models[triad]) continue;
      const TriadModel<double>& model = *unit.models[triad];
      const Eigen::Vector3d truth = world_from_body[k].conjugate() * unit.WorldVector(triad);
      const double sigma = noise.rest_sigma[triad];
      const Eigen::Vector3d error =
          sigma * random->Normal3() + noise.excess_sigma[triad] * random->Normal3();
      TriadPose reading;
      reading.samples = 1;
      reading.mean_raw = model.RawFromTruth(truth + error);
      // Isotropic in true units: S S^T in raw ones.
      reading.mean_covariance_raw =
          sigma * sigma * model.sensitivity * model.sensitivity.transpose();
      reading.has_covariance = sigma > 0.0;
      pose.triads[triad] = reading;
    }
    set.poses.push_back(pose);
  }
  return set;
}

void AddTurns(const SyntheticUnit& unit,
              const std::vector<Eigen::Quaterniond>& world_from_body,
              const SyntheticTurns& turns,
              Random* random,
              PoseSet* set) {
  const TriadModel<double>& gyroscope = *unit.models[Triad::kGyroscope];
  const bool has_force = unit.models[Triad::kAccelerometer].has_value();
  const Triad vector = has_force ? Triad::kAccelerometer : Triad::kMagnetometer;
  const TriadModel<double>& vector_model = *unit.models[vector];
  const Eigen::Vector3d rate_sigma_raw =
      turns.gyroscope_sigma_radps * gyroscope.sensitivity.rowwise().norm();
  const Eigen::Vector3d vector_sigma_raw =
      (has_force ? turns.accelerometer_sigma_mps2 : turns.magnetometer_sigma_ut) *
      vector_model.sensitivity.rowwise().norm();
  const auto noise = [random](const Eigen::Vector3d& sigma) {
    if (random == nullptr) return Eigen::Vector3d(Eigen::Vector3d::Zero());
    return Eigen::Vector3d(sigma.cwiseProduct(random->Normal3()));
  };
  for (StreamSummary& stream : set->streams) {
    if (stream.triad == Triad::kGyroscope) stream.noise_sigma_raw = rate_sigma_raw;
  }
  const Eigen::Vector3d in_world = unit.WorldVector(vector);
  const auto steps = std::lround(turns.duration_s * turns.rate_hz);
  for (std::size_t k = 0; k + 1 < world_from_body.size(); ++k) {
    RecordedMove& move = set->moves.emplace_back();
    move.from = k;
    const Eigen::Vector3d turn =
        RotationLog(world_from_body[k].conjugate() * world_from_body[k + 1]);
    for (long i = 0; i <= steps; ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(steps);
      const double share = s * s * s * (10.0 + s * (6.0 * s - 15.0));
      const double speed_hz = 30.0 * s * s * (1.0 - s) * (1.0 - s) / turns.duration_s;
      const Eigen::Quaterniond attitude = world_from_body[k] * RotationExp(share * turn);
      move.time_ns.push_back(std::llround(1e9 * s * turns.duration_s));
      move.gyroscope_raw.emplace_back(gyroscope.RawFromTruth(speed_hz * turn) +
                                      noise(rate_sigma_raw));
      (has_force ? move.accelerometer_raw : move.magnetometer_raw)
          .emplace_back(vector_model.RawFromTruth(attitude.conjugate() * in_world) +
                        noise(vector_sigma_raw));
    }
  }
}

std::vector<Eigen::Quaterniond> RandomAttitudes(int count, Random* random) {
  std::vector<Eigen::Quaterniond> attitudes;
  attitudes.reserve(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) attitudes.push_back(random->Rotation());
  return attitudes;
}

}  // namespace truetriad
