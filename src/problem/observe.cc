// SPDX-License-Identifier: Apache-2.0
#include "problem/observe.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/sensor_line.h"
#include "problem/moves.h"

namespace truetriad {
namespace {

// Least σ of a gyroscope reading, rad/s, even if a recording shows less noise: no gyroscope is so
// good.
constexpr double kLeastRateSigma = 1e-9;

// The averaging time of a pose's mean, s: the number of samples times their spacing; 0 if it is
// unknown.
double AveragedTime(const StaticPose& pose, Triad triad) {
  const auto samples = static_cast<double>(pose.triads[triad]->samples);
  return samples > 1.0 ? pose.duration_s() * samples / (samples - 1.0) : 0.0;
}

}  // namespace

Result<Observation> Observe(const PoseSet& poses,
                            const StaticPose& pose,
                            Triad triad,
                            const TriadOptions& sensor,
                            NoiseSource source) {
  Observation observation;
  observation.triad = triad;
  observation.mean_raw = pose.triads[triad]->mean_raw;
  if (const double duration_s = pose.duration_s(); duration_s > 0.0) {
    observation.by_clock_raw_per_s = pose.triads[triad]->end_to_end_raw / duration_s;
  }
  if (sensor.noise_sigma_raw) {
    observation.rest_covariance = sensor.noise_sigma_raw->cwiseAbs2().asDiagonal();
  } else if (sensor.allan) {
    const double duration_s = AveragedTime(pose, triad);
    if (!(duration_s > 0.0)) {
      return Error(
          ErrorCode::kDoesNotMatch,
          {poses.source},
          "pose " + std::to_string(pose.number) + ", " + std::string(TriadName(triad)) +
              ": its averaging time is unknown, so its noise cannot be computed from an Allan "
              "deviation; record rests with time, or state " +
              SensorLine(triad, "noise: { sigma: [x, y, z] }"));
    }
    observation.rest_covariance = sensor.allan->MeanSigma(duration_s).cwiseAbs2().asDiagonal();
  } else if (source != NoiseSource::kResidual) {
    observation.rest_covariance = pose.triads[triad]->mean_covariance_raw;
  } else if (const StreamSummary* stream = poses.Find(triad)) {
    // The only known error of single readings is rounding: a step q has the variance q² / 12.
    observation.rest_covariance = (stream->resolution_raw.cwiseAbs2() / 12.0).asDiagonal();
  }
  return observation;
}

double TimeOf(const PoseSet& poses, const StaticPose& pose) {
  if (!poses.has_time) return pose.number;
  return 0.5e-9 * (static_cast<double>(pose.start_ns) + static_cast<double>(pose.end_ns));
}

Eigen::Vector3d ReadingSigma(const PoseSet& poses, const Eigen::Matrix3d& sensitivity) {
  const StreamSummary& gyroscope = *poses.Find(Triad::kGyroscope);
  const Eigen::Vector3d sigma =
      ReadingSigma(gyroscope).cwiseMax(kLeastRateSigma * sensitivity.rowwise().norm());
  // Rounding to a step q adds the variance q^2 / 12 while the unit turns, even if it hides the
  // noise at rest. If no sensor has noise, the least difference between readings is no rounding
  // step.
  const bool has_noise =
      std::any_of(poses.streams.begin(), poses.streams.end(), [](const StreamSummary& stream) {
        return stream.noise_sigma_raw.maxCoeff() > 0.0;
      });
  return has_noise ? sigma.cwiseMax(gyroscope.resolution_raw / std::sqrt(12.0)) : sigma;
}

}  // namespace truetriad
