// SPDX-License-Identifier: Apache-2.0
#include "motion/motion_graph.h"

#include <Eigen/LU>

namespace truetriad {
namespace {

constexpr Triad kVectorTriads[] = {Triad::kAccelerometer, Triad::kMagnetometer};

double DurationOf(const GyroReadings& readings) {
  return readings.time_s.back() - readings.time_s.front();
}

// Whether the piece of the chain that begins with `first` has readings of both vector sensors.
bool TellsHeading(const std::vector<Moment>& moments, std::size_t first) {
  PerTriad<bool> is_seen{};
  for (std::size_t k = first; k < moments.size(); ++k) {
    for (const Triad triad : kVectorTriads) {
      is_seen[triad] = is_seen[triad] || moments[k].seen(triad).count > 0;
    }
    if (!moments[k].is_linked) break;
  }
  return is_seen[Triad::kAccelerometer] && is_seen[Triad::kMagnetometer];
}

IncrementEdge TurnFrom(std::size_t from,
                       const MotionTrack& track,
                       const std::vector<Moment>& moments,
                       const PoseGraph& graph) {
  IncrementEdge edge;
  edge.from = from;
  const GyroReadings readings = track.Between(moments[from], moments[from + 1]);
  edge.move.time_s.assign(readings.time_s.begin(), readings.time_s.end());
  edge.move.reading_raw.assign(readings.reading_raw.begin(), readings.reading_raw.end());
  if (graph.layout.g_sensitivity >= 0) {
    edge.accelerometer_raw = track.AccelerometerBetween(moments[from], moments[from + 1]);
  }
  // What two turns share of a reading counts in both: their noise is that of their duration.
  edge.sigma_raw.setZero();
  edge.Integrate(graph.layout, graph.shared.data());
  return edge;
}

}  // namespace

void BuildMoments(const MotionTrack& track,
                  const std::vector<Moment>& moments,
                  const std::vector<Eigen::Quaterniond>& attitudes,
                  PoseGraph* graph) {
  graph->nodes.clear();
  graph->increments.clear();
  graph->nodes.reserve(moments.size());
  for (std::size_t k = 0; k < moments.size(); ++k) {
    PoseNode& node = graph->nodes.emplace_back();
    node.number = static_cast<int>(k + 1);
    node.role = PoseRole::kMoment;
    node.time_s = track.TimeOf(moments[k]);
    node.is_field_inclined = graph->layout.Has(Triad::kAccelerometer);
    node.state = ValuesOf(attitudes[k]);
    for (const Triad triad : kVectorTriads) {
      const GatheredReadings& seen = moments[k].seen(triad);
      if (seen.count == 0 || !graph->layout.Has(triad)) continue;
      Observation& observation = node.observations.emplace_back();
      observation.triad = triad;
      observation.mean_raw = seen.mean_raw;
      observation.mean_turn = seen.turn;
      observation.turning = seen.turning;
    }
    if ((k == 0 || !moments[k - 1].is_linked) && !TellsHeading(moments, k)) {
      node.holds_heading = true;
      node.held_world_from_body = attitudes[k];
    }
    if (moments[k].is_linked && k + 1 < moments.size()) {
      graph->increments.push_back(TurnFrom(k, track, moments, *graph));
    }
  }
  graph->integrated_at = graph->shared;
}

void WeighMoments(const MotionNoise& noise,
                  const MotionTrack& track,
                  const std::vector<Moment>& moments,
                  PoseGraph* graph) {
  for (std::size_t k = 0; k < moments.size(); ++k) {
    for (Observation& observation : graph->nodes[k].observations) {
      const Triad triad = observation.triad;
      const GatheredReadings& seen = moments[k].seen(triad);
      observation.rest_covariance =
          (noise.density[triad] / (track.spacing_s(triad) * seen.count)).asDiagonal();
      observation.variance = observation.rest_covariance;
      observation.weight = seen.weight;
    }
  }
  if (graph->increments.empty()) return;
  const Eigen::Matrix3d C = graph->sensitivity(Triad::kGyroscope).inverse();
  const Eigen::Matrix3d density = C * noise.density[Triad::kGyroscope].asDiagonal() * C.transpose();
  for (IncrementEdge& edge : graph->increments) {
    const GyroReadings readings = track.Between(moments[edge.from], moments[edge.from + 1]);
    edge.stated_covariance = DurationOf(readings) * density;
    edge.variance = edge.stated_covariance;
    edge.weight = moments[edge.from].weight;
  }
}

std::vector<Eigen::Quaterniond> AttitudesOf(const PoseGraph& graph) {
  std::vector<Eigen::Quaterniond> attitudes;
  attitudes.reserve(graph.nodes.size());
  for (const PoseNode& node : graph.nodes) attitudes.push_back(node.rotation());
  return attitudes;
}

// A reading that is stamped too late by t shows the field of t earlier: the residual is t times the
// change.
ClockError ClockErrorOf(Triad triad,
                        const MotionTrack& track,
                        const std::vector<Moment>& moments,
                        const PoseGraph& graph) {
  const Eigen::Vector3d world = WorldVector(triad, graph.reference());
  const Eigen::Matrix3d correction = graph.sensitivity(Triad::kGyroscope).inverse();
  double along = 0.0, squared = 0.0;
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const PoseNode& node = graph.nodes[k];
    for (const Observation& seen : node.observations) {
      if (seen.triad != triad) continue;
      const TriadModel<double> model = graph.ModelAt(triad, node);
      const Eigen::Vector3d field = seen.mean_turn * (node.rotation().conjugate() * world);
      const Eigen::Vector3d rate =
          correction * (track.RateAt(moments[k]) - graph.bias(Triad::kGyroscope));
      const Eigen::Vector3d root =
          (seen.weight * seen.variance.diagonal().cwiseInverse()).cwiseSqrt();
      const Eigen::Vector3d change = root.cwiseProduct(model.sensitivity * field.cross(rate));
      along += change.dot(root.cwiseProduct(model.RawFromTruth(field) - seen.mean_raw));
      squared += change.squaredNorm();
    }
  }
  if (!(squared > 0.0)) return {};
  return {along / squared, 1.0 / std::sqrt(squared)};
}

}  // namespace truetriad
