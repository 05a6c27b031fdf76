// SPDX-License-Identifier: Apache-2.0
#include "motion/motion_start.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "init/frame_alignment.h"
#include "init/gyro_start.h"
#include "problem/lay_out.h"
#include "problem/start_values.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// Means over this time replace rests. A unit in the hand turns by only a few degrees in this time.
constexpr double kMeanS = 0.1;
// In this time a direction changes by much more than its noise, and the gyroscope hardly drifts.
constexpr double kTurnS = 0.8;
// Chosen: the largest number of means, far more than the parameters of the start need.
constexpr std::size_t kMostMeans = 500;
// Chosen: at each node this share of the attitude error that the vector sensors show is corrected.
constexpr double kDrawn = 0.1;

// The nodes as poses, with the means of the vector sensors' readings around each node. The readings
// are not rotated to the node.
PoseSet MeansOf(const PoseSet& poses,
                const std::vector<Moment>& nodes,
                const MotionTrack& track,
                const CalibrateOptions& options) {
  const Triad leading = LeadingTriad(options);
  PoseSet means;
  means.source = poses.source;
  means.streams = poses.streams;
  const std::size_t every = nodes.size() / kMostMeans + 1;
  for (std::size_t k = 0; k < nodes.size(); k += every) {
    const Moment& node = nodes[k];
    if (node.seen(leading).count == 0) continue;
    StaticPose& pose = means.poses.emplace_back();
    pose.number = static_cast<int>(means.poses.size());
    pose.start_ns = pose.end_ns = std::llround(1e9 * track.TimeOf(node));
    for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
      const GatheredReadings& seen = node.seen(triad);
      if (seen.count == 0 || !options.triads[triad].enabled) continue;
      TriadPose& mean = pose.triads[triad].emplace();
      mean.samples = seen.count;
      mean.mean_raw = seen.mean_raw;
    }
  }
  return means;
}

// The gyroscope's start model. `vector`: the sensor whose directions show the turns.
Result<TriadModel<double>> GyroscopeFromMotion(const TriadOptions& sensor,
                                               Triad vector,
                                               const TriadModel<double>& model_of_vector,
                                               const std::vector<Moment>& nodes,
                                               double mean_s,
                                               const MotionTrack& track) {
  const auto direction_at = [&](const Moment& node) {
    return model_of_vector.TruthFromRaw(node.seen(vector).mean_raw).normalized();
  };
  const auto nodes_a_turn = std::max<std::size_t>(2, std::lround(kTurnS / mean_s));
  std::vector<DirectionMove> moves;
  for (std::size_t begin = 0; begin + nodes_a_turn < nodes.size(); begin += nodes_a_turn) {
    DirectionMove move;
    bool is_whole = true;
    for (std::size_t k = begin; k < begin + nodes_a_turn && is_whole; ++k) {
      is_whole = nodes[k].is_linked && nodes[k].seen(vector).count > 0 &&
                 nodes[k + 1].seen(vector).count > 0;
      if (!is_whole) break;
      const GyroReadings readings = track.Between(nodes[k], nodes[k + 1]);
      const Eigen::Vector3d first = direction_at(nodes[k]), second = direction_at(nodes[k + 1]);
      const std::size_t steps = readings.time_s.size() - 1;
      const bool is_last = k + 1 == begin + nodes_a_turn;
      for (std::size_t i = 0; i < steps + (is_last ? 1 : 0); ++i) {
        const double share = static_cast<double>(i) / static_cast<double>(steps);
        move.move.time_s.push_back(readings.time_s[i]);
        move.move.reading_raw.push_back(readings.reading_raw[i]);
        move.direction.emplace_back((1.0 - share) * first + share * second);
      }
    }
    if (!is_whole) continue;
    move.before = direction_at(nodes[begin]);
    move.after = direction_at(nodes[begin + nodes_a_turn]);
    moves.push_back(std::move(move));
  }
  return FindGyroModel(moves, sensor.fixed_sensitivity, sensor.fixed_bias);
}

}  // namespace

Result<std::vector<StartValues>> FindMotionStarts(const PoseSet& poses,
                                                  const CalibrateOptions& options,
                                                  const MotionTrack& track) {
  // 20 % more than the interval of a slow sensor, so that each node has a reading of that sensor.
  const double mean_s = std::max(kMeanS, 1.2 * track.spacing_s(LeadingTriad(options)));
  const std::vector<Moment> nodes = track.Gather(mean_s, nullptr);
  CalibrateOptions vectors = options;
  vectors.triads[Triad::kGyroscope].enabled = false;
  const PoseSet means = MeansOf(poses, nodes, track, options);
  TRUETRIAD_RETURN_IF_ERROR(CheckPoseCounts(means, vectors));
  auto starts = FindStartValues(means, vectors);
  if (!starts) return starts;
  const Triad leading = LeadingTriad(options);
  TRUETRIAD_ASSIGN_OR_RETURN(const TriadModel<double> gyroscope,
                             GyroscopeFromMotion(options.triads[Triad::kGyroscope],
                                                 leading,
                                                 *starts->front().models[leading],
                                                 nodes,
                                                 mean_s,
                                                 track));
  for (StartValues& start : *starts) {
    start.models[Triad::kGyroscope] = gyroscope;
    if (options.TurnsAgainstField()) start.reference[kDip] = kVerticalFieldRad;
  }
  return starts;
}

std::vector<Eigen::Quaterniond> StartAttitudes(const StartValues& start,
                                               const MotionTrack& track,
                                               const std::vector<Moment>& nodes) {
  const Eigen::Vector3d up_in_world = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d field_in_world =
      WorldVector(Triad::kMagnetometer, start.reference).normalized();
  const auto seen = [&](const Moment& node, Triad triad) -> std::optional<Eigen::Vector3d> {
    if (node.seen(triad).count == 0 || !start.models[triad]) return std::nullopt;
    return start.models[triad]->TruthFromRaw(node.seen(triad).mean_raw).normalized();
  };
  const GyroModel gyroscope{*start.models[Triad::kGyroscope]};
  std::vector<Eigen::Quaterniond> attitudes(nodes.size(), Eigen::Quaterniond::Identity());
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const auto up = seen(nodes[k], Triad::kAccelerometer);
    const auto field = seen(nodes[k], Triad::kMagnetometer);
    Eigen::Quaterniond& attitude = attitudes[k];
    if (k == 0 || !nodes[k - 1].is_linked) {
      if (k > 0) attitude = attitudes[k - 1];
      if (up && field) attitude = TriadAttitude(up_in_world, field_in_world, *up, *field);
      if (up && !field) attitude = RotationBetween(*up, up_in_world);
      if (field && !up) attitude = RotationBetween(*field, field_in_world);
      continue;
    }
    attitude = attitudes[k - 1] * IntegrateRotation(track.Between(nodes[k - 1], nodes[k]),
                                                    gyroscope,
                                                    RateSampling::kInstantaneous);
    Eigen::Vector3d error = Eigen::Vector3d::Zero();
    // Exp(-d) u = u + u x d.
    if (up) error += up->cross(attitude.conjugate() * up_in_world);
    if (field) error += field->cross(attitude.conjugate() * field_in_world);
    attitude = (attitude * RotationExp(kDrawn * error)).normalized();
  }
  return attitudes;
}

std::vector<Eigen::Quaterniond> FinerAttitudes(const MotionTrack& track,
                                               const GyroModel& gyroscope,
                                               const std::vector<Moment>& coarse,
                                               const std::vector<Eigen::Quaterniond>& attitudes,
                                               const std::vector<Moment>& fine) {
  std::vector<Eigen::Quaterniond> finer(fine.size());
  std::size_t c = 0;
  for (std::size_t k = 0; k < fine.size(); ++k) {
    const bool is_new = c < coarse.size() && coarse[c].reading <= fine[k].reading;
    while (c < coarse.size() && coarse[c].reading <= fine[k].reading) ++c;
    if (is_new) {
      finer[k] = attitudes[c - 1];
      if (coarse[c - 1].reading == fine[k].reading) continue;
      finer[k] = finer[k] * IntegrateRotation(track.Between(coarse[c - 1], fine[k]),
                                              gyroscope,
                                              RateSampling::kInstantaneous);
    } else if (k == 0) {
      // After clocks were corrected, readings may belong to nodes before the first node of the
      // coarse chain.
      finer[k] = attitudes.front() * IntegrateRotation(track.Between(fine[k], coarse.front()),
                                                       gyroscope,
                                                       RateSampling::kInstantaneous)
                                         .inverse();
    } else {
      finer[k] = finer[k - 1] * IntegrateRotation(track.Between(fine[k - 1], fine[k]),
                                                  gyroscope,
                                                  RateSampling::kInstantaneous);
    }
  }
  return finer;
}

}  // namespace truetriad
