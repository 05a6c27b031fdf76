// SPDX-License-Identifier: Apache-2.0
#include "truetriad/sim/synthetic_poses.h"

#include "truetriad/model/world.h"

namespace truetriad {

Eigen::Vector3d SyntheticUnit::WorldVector(Triad triad) const {
  if (triad == Triad::kAccelerometer) return ForceInWorld(gravity_mps2);
  return FieldInWorld(field_ut, dip_rad);
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

std::vector<Eigen::Quaterniond> RandomAttitudes(int count, Random* random) {
  std::vector<Eigen::Quaterniond> attitudes;
  attitudes.reserve(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) attitudes.push_back(random->Rotation());
  return attitudes;
}

}  // namespace truetriad
