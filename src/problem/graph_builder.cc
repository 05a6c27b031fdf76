// SPDX-License-Identifier: Apache-2.0
#include "problem/graph_builder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "model/world.h"
#include "problem/known_motion_rows.h"
#include "problem/moves.h"
#include "problem/observe.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

// The least σ of a block's seat: a variance of zero would have no inverse. 1e-7 rad is 0.1 µm/m.
constexpr double kSmallestSeatRad = 1e-7;

// A turn that the graph can use: node `from` and the node after it belong to consecutive poses.
struct Turn {
  std::size_t from = 0;
  const RecordedMove* move = nullptr;
};

// Whether one of the node's readings depends on the node's attitude; a gyroscope's reading at rest
// does not.
bool SeesAttitude(const PoseNode& node) {
  return std::any_of(node.observations.begin(), node.observations.end(), [](const auto& seen) {
    return seen.triad != Triad::kGyroscope;
  });
}

std::vector<Turn> TurnsBetween(const PoseSet& poses, const std::vector<PoseNode>& nodes) {
  std::vector<Turn> turns;
  std::size_t node = 0;
  for (const RecordedMove& move : poses.moves) {
    const int number = poses.poses[move.from].number;
    while (node < nodes.size() && nodes[node].number < number) ++node;
    if (move.fault || node + 1 >= nodes.size() || nodes[node].number != number ||
        nodes[node + 1].number != poses.poses[move.from + 1].number || !SeesAttitude(nodes[node]) ||
        !SeesAttitude(nodes[node + 1])) {
      continue;
    }
    turns.push_back({node, &move});
  }
  return turns;
}

// If a turn begins or ends at a pose, the unknown of this pose becomes a rotation (kRotation). If
// no pose in a chain of turns determines a heading, the heading of the chain's first pose is held.
void LinkByTurns(const PoseSet& poses, std::vector<PoseNode>* nodes) {
  std::vector<bool> linked(nodes->size(), false);  // whether a turn links the node to the next one
  for (const Turn& turn : TurnsBetween(poses, *nodes)) linked[turn.from] = true;
  for (std::size_t begin = 0; begin < nodes->size();) {
    std::size_t end = begin;
    bool tells_heading = (*nodes)[begin].TellsHeading();
    while (linked[end]) tells_heading = (*nodes)[++end].TellsHeading() || tells_heading;
    for (std::size_t k = begin; k <= end && end > begin; ++k) {
      if ((*nodes)[k].kind == PoseKind::kDirection) (*nodes)[k].kind = PoseKind::kRotation;
    }
    (*nodes)[begin].holds_heading = end > begin && !tells_heading;
    begin = end + 1;
  }
}

// Requires the heading of each pose with a gyroscope reading, since the earth's rate in the reading
// depends on it.
Status CheckHeadings(const PoseSet& poses, const std::vector<PoseNode>& nodes) {
  bool heading_is_held = false;  // whether the chain of the node has a held heading
  for (const PoseNode& node : nodes) {
    heading_is_held = node.holds_heading || (heading_is_held && !node.TellsHeading());
    const bool is_seen = std::any_of(
        node.observations.begin(), node.observations.end(), [](const Observation& seen) {
          return seen.triad == Triad::kGyroscope;
        });
    if (!is_seen || (node.kind != PoseKind::kDirection && !heading_is_held)) continue;
    return Error(ErrorCode::kNoReadings,
                 {poses.source},
                 "pose " + std::to_string(node.number) +
                     " has neither a magnetometer reading nor a known attitude, so its heading is "
                     "unobservable, "
                     "but `reference.earth_rate` needs it; remove the pose or the key");
  }
  return {};
}

// Raises the noise of readings to a least value, without which noise-free readings would have
// infinite weight relative to priors and other sensors.
void RaiseRestNoise(Triad triad, std::vector<PoseNode>* nodes) {
  Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array3d high = -low;
  const auto for_each = [&](auto what) {
    for (PoseNode& node : *nodes) {
      for (Observation& seen : node.observations) {
        if (seen.triad == triad) what(&seen);
      }
    }
  };
  for_each([&](const Observation* seen) {
    low = low.min(seen->mean_raw.array());
    high = high.max(seen->mean_raw.array());
  });
  const double least = kLeastNoiseShare * 0.5 * (high - low).maxCoeff();
  if (!std::isfinite(least)) return;
  for_each([&](Observation* seen) {
    seen->rest_covariance.diagonal() = seen->rest_covariance.diagonal().cwiseMax(least * least);
  });
}

// Gives the node the known attitude of its pose, which is exact or has a σ.
Status TakeGivenAttitude(const PoseSet& poses, const StaticPose& pose, PoseNode* node) {
  if (!pose.attitude) {
    return Error(ErrorCode::kDoesNotMatch,
                 {poses.source},
                 "pose " + std::to_string(pose.number) +
                     " has no known attitude; `attitudes: {file: …}` needs one for every pose");
  }
  const Eigen::Quaterniond& q = pose.attitude->world_from_body;
  node->state = {q.x(), q.y(), q.z(), q.w()};
  node->has_attitude_prior = pose.attitude->sigma_rad.maxCoeff() > 0.0;
  node->kind = node->has_attitude_prior ? PoseKind::kRotation : PoseKind::kHeld;
  if (node->has_attitude_prior) {
    node->prior_world_from_body = q;
    node->prior_sigma_rad = pose.attitude->sigma_rad;
  }
  return {};
}

Status TakeTemperature(const PoseSet& poses, const StaticPose& pose, PoseNode* node) {
  if (!pose.temperature_degc) {
    return Error(ErrorCode::kMissingTemperature,
                 {poses.source},
                 "pose " + std::to_string(pose.number) +
                     " has no temperature; `thermal:` terms need one for every pose "
                     "(column temperature[degC]); add the column, or remove `thermal:`");
  }
  node->temperature_degc = *pose.temperature_degc;
  node->temperature_rate_degcps = pose.temperature_rate_degcps;
  return {};
}

// The node of a pose; unset if the graph can use no reading of the pose. `face`: the face that is
// up, or -1 if it is unknown.
Result<std::optional<PoseNode>> NodeOf(const PoseSet& poses,
                                       const StaticPose& pose,
                                       int face,
                                       const CalibrateOptions& options,
                                       const PerTriad<NoiseSource>& sources) {
  PoseNode node;
  node.number = pose.number;
  node.session = pose.session;
  node.is_field_inclined = !options.TurnsAgainstField();
  node.time_s = TimeOf(poses, pose);
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer, Triad::kGyroscope}) {
    const TriadOptions& sensor = options.triads[triad];
    if (!sensor.enabled || !pose.triads[triad]) continue;
    TRUETRIAD_ASSIGN_OR_RETURN(Observation observation,
                               Observe(poses, pose, triad, sensor, sources[triad]));
    node.observations.push_back(std::move(observation));
  }
  const auto vectors = std::count_if(
      node.observations.begin(), node.observations.end(), [](const Observation& seen) {
        return seen.triad != Triad::kGyroscope;
      });
  const bool counts = vectors > 0 || options.HasGyroscopeAlone();
  if (!counts || node.observations.empty()) return std::optional<PoseNode>();
  if (options.HasThermal()) TRUETRIAD_RETURN_IF_ERROR(TakeTemperature(poses, pose, &node));
  // At rest a gyroscope reads its bias in any attitude. If it is the only sensor, the attitudes are
  // held.
  node.kind = vectors == 0   ? PoseKind::kHeld
              : vectors == 1 ? PoseKind::kDirection
                             : PoseKind::kRotation;
  if (vectors > 0 && options.attitudes.kind == AttitudeKind::kGiven) {
    TRUETRIAD_RETURN_IF_ERROR(TakeGivenAttitude(poses, pose, &node));
  }
  // Accelerometer determines the face, so that a pose without an accelerometer reading has no face.
  if (face >= 0 && node.observations.front().triad == Triad::kAccelerometer) {
    node.face = face;
    node.seat_sigma_rad = std::max(options.attitudes.seat_sigma_deg * kRadPerDeg, kSmallestSeatRad);
  }
  return std::optional(std::move(node));
}

}  // namespace

Result<std::vector<PoseNode>> BuildNodes(const PoseSet& poses,
                                         const CalibrateOptions& options,
                                         const PerTriad<NoiseSource>& sources) {
  std::vector<int> faces(poses.poses.size(), -1);
  if (options.attitudes.kind == AttitudeKind::kSixFace) {
    TRUETRIAD_ASSIGN_OR_RETURN(faces, FacesOfPoses(poses, options.triads[Triad::kAccelerometer]));
  }
  std::vector<PoseNode> nodes;
  nodes.reserve(poses.poses.size());
  for (std::size_t k = 0; k < poses.poses.size(); ++k) {
    TRUETRIAD_ASSIGN_OR_RETURN(std::optional<PoseNode> node,
                               NodeOf(poses, poses.poses[k], faces[k], options, sources));
    if (node) nodes.push_back(*std::move(node));
  }
  if (options.triads[Triad::kGyroscope].enabled) {
    LinkByTurns(poses, &nodes);
    if (options.reference.earth_rate) TRUETRIAD_RETURN_IF_ERROR(CheckHeadings(poses, nodes));
    TRUETRIAD_RETURN_IF_ERROR(AddKnownMotions(poses, options, sources, &nodes));
  }
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (options.triads[triad].enabled && sources[triad] == NoiseSource::kStatic) {
      RaiseRestNoise(triad, &nodes);
    }
  }
  return nodes;
}

void BuildIncrements(const PoseSet& poses, const StartValues& start, PoseGraph* graph) {
  graph->increments.clear();
  for (const Turn& turn : TurnsBetween(poses, graph->nodes)) {
    const PoseNode& first = graph->nodes[turn.from];
    const PoseNode& second = graph->nodes[turn.from + 1];
    IncrementEdge& edge = graph->increments.emplace_back();
    edge.from = turn.from;
    edge.session = first.session;
    // Each integration computes the forces anew, with the current parameters of the accelerometer.
    edge.move = MoveOf(*turn.move, nullptr);
    if (graph->layout.g_sensitivity >= 0) edge.accelerometer_raw = turn.move->accelerometer_raw;
    edge.sigma_raw = ReadingSigma(poses, start.models[Triad::kGyroscope]->sensitivity);
    edge.temperature_degc = 0.5 * (first.temperature_degc + second.temperature_degc);
    edge.temperature_rate_degcps =
        0.5 * (first.temperature_rate_degcps + second.temperature_rate_degcps);
    edge.Integrate(graph->layout, graph->shared.data());
  }
  SetStartHeadings(graph);
  JoinKnownTurns(poses, start, graph);
}

std::vector<int> PlacesIn(const SharedLayout& whole, const SharedLayout& part) {
  const std::vector<std::string> names = ParameterNames(whole);
  std::vector<int> places;
  for (const std::string& name : ParameterNames(part)) {
    const auto found = std::find(names.begin(), names.end(), name);
    places.push_back(found == names.end() ? -1 : static_cast<int>(found - names.begin()));
  }
  return places;
}

PoseGraph WithTermsOf(const CalibrateOptions& options, const PoseGraph& solved) {
  StartValues start = StartAt(solved);
  for (const Triad triad : kTriads) {
    const std::optional<Eigen::Matrix3d>& held = options.triads[triad].fixed_sensitivity;
    if (start.models[triad] && held) start.models[triad]->sensitivity = *held;
  }
  PoseGraph graph = solved;
  LayOutParameters(options, start, &graph);
  graph.nodes = solved.nodes;  // Restores the attitudes that LayOutParameters replaced.
  const SharedLayout& layout = graph.layout;
  const std::vector<int> places = PlacesIn(solved.layout, layout);
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (places[i] < 0) continue;
    graph.shared[static_cast<Eigen::Index>(i)] = solved.shared[places[i]];
  }
  const auto keep_what_is_free = [&graph, &layout](int at) {
    const Eigen::MatrixXd basis = layout.basis.middleRows<9>(at);
    const Eigen::Matrix<double, 9, 1> entries = graph.shared.segment<9>(at);
    graph.shared.segment<9>(at) = basis * (basis.transpose() * entries);
  };
  for (const Triad triad : kTriads) {
    if (!layout.Has(triad)) continue;
    if (options.triads[triad].fixed_sensitivity) {
      graph.shared.segment<9>(layout.sensitivity[triad]) =
          options.triads[triad].fixed_sensitivity->reshaped();
    } else {
      keep_what_is_free(layout.sensitivity[triad]);
    }
    const ThermalBlock& thermal = layout.thermal[triad];
    for (int i = 0; i < thermal.terms.matrix_order; ++i) keep_what_is_free(thermal.matrix_at(i));
  }
  for (IncrementEdge& edge : graph.increments) edge.Integrate(layout, graph.shared.data());
  graph.integrated_at = graph.shared;
  AddPriors(options, &graph);
  return graph;
}

}  // namespace truetriad
