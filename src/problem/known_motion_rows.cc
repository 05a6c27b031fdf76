// SPDX-License-Identifier: Apache-2.0
#include "problem/known_motion_rows.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "base/messages.h"
#include "data/readings_at.h"
#include "math/dense/qr.h"
#include "problem/moves.h"
#include "problem/observe.h"
#include "truetriad/base/triad.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// If readings show less than this share of a stated turn, the message suggests that rows of the
// turn were cut off.
constexpr double kMissingShare = 0.25;

// A σ of a direction, rad, with which the direction has no weight: far above the error of any
// stated axis.
constexpr double kNothingRad = 1.0;
// A σ, as a share of a mean rate, with which the size of the rate has no weight.
constexpr double kNothingShare = 10.0;

bool IsUsed(const KnownTurn& turn) { return !turn.stated.held_out && !turn.move.fault; }

Eigen::Vector3d MeanRate(const KnownTurn& turn) {
  return turn.stated.angle_rad / turn.move.duration_s() * turn.stated.axis;
}

Eigen::Matrix3d AcrossAxis(const Eigen::Vector3d& axis) {
  return Eigen::Matrix3d::Identity() - axis * axis.transpose();
}

// Covariance of the attitude at the end of a turn, rad², in the body frame there. An axis error d
// tilts this attitude by 2 sin(angle / 2) d: d = 1 rad removes the weight across the axis of a
// partial turn.
Eigen::Matrix3d EndCovariance(const StatedTurn& turn) {
  const double lever = 2.0 * std::sin(0.5 * turn.angle_rad) * kNothingRad;
  return turn.sigma_rad * turn.sigma_rad * Eigen::Matrix3d::Identity() +
         lever * lever * AcrossAxis(turn.axis);
}

Eigen::Matrix3d MeanRateCovariance(const KnownTurn& turn) {
  const double size = MeanRate(turn).norm();
  const Eigen::Vector3d& axis = turn.stated.axis;
  const double across = turn.stated.axis_sigma_rad * size;
  const double along = kNothingShare * size;
  return across * across * AcrossAxis(axis) + along * along * axis * axis.transpose();
}

// The rest or known rate nearest in time; a turn takes its temperature. Null if there is none.
const StaticPose* NearestInTime(const PoseSet& poses, std::int64_t time_ns) {
  const StaticPose* nearest = nullptr;
  const auto distance = [&](const StaticPose& pose) {
    return std::abs(pose.middle_ns() - time_ns);
  };
  const auto consider = [&](const StaticPose& pose) {
    if (nearest == nullptr || distance(pose) < distance(*nearest)) nearest = &pose;
  };
  for (const StaticPose& pose : poses.poses) consider(pose);
  for (const KnownRate& rate : poses.rates) consider(rate.means);
  return nearest;
}

// The name of a turn in messages.
std::string NameOf(const KnownTurn& turn, std::size_t place) {
  return "turn " + std::to_string(place + 1) +
         (turn.stated.id.empty() ? "" : " (" + turn.stated.id + ")");
}

// The angle about the stated axis with its whole turns: the sum of the corrected readings. Its
// error is of second order in the wobble of the axis.
double CountedAngle(const KnownTurn& turn, const TriadModel<double>& gyroscope) {
  const Eigen::Vector3d mean = MeanOverTime(turn.move.time_ns, turn.move.gyroscope_raw);
  return turn.stated.axis.dot(gyroscope.TruthFromRaw(mean)) * turn.move.duration_s();
}

Eigen::Quaterniond StatedRotation(const StatedTurn& turn) {
  return RotationExp(turn.angle_rad * turn.axis);
}

void SetState(const Eigen::Quaterniond& q, PoseNode* node) {
  node->state = {q.x(), q.y(), q.z(), q.w()};
}

}  // namespace

Status AddKnownMotions(const PoseSet& poses,
                       const CalibrateOptions& options,
                       const PerTriad<NoiseSource>& sources,
                       std::vector<PoseNode>* nodes) {
  int number = 0;
  for (const StaticPose& pose : poses.poses) number = std::max(number, pose.number);
  const auto node_at = [&](PoseRole role, const StaticPose* at) -> Result<PoseNode> {
    PoseNode node;
    node.number = ++number;
    node.role = role;
    node.kind = PoseKind::kHeld;
    if (at != nullptr) node.time_s = TimeOf(poses, *at);
    if (!options.HasThermal()) return node;
    if (at == nullptr || !at->temperature_degc) {
      return Error(ErrorCode::kMissingTemperature,
                   {poses.source},
                   "a known turn or rate has no temperature; `thermal:` terms need one "
                   "for each (column temperature[degC]); add the column, or remove `thermal:`");
    }
    node.temperature_degc = *at->temperature_degc;
    node.temperature_rate_degcps = at->temperature_rate_degcps;
    return node;
  };
  for (const KnownRate& rate : poses.rates) {
    if (!rate.means.triads[Triad::kGyroscope]) {
      return Error(ErrorCode::kNoReadings,
                   {poses.source},
                   "the gyroscope has no reading in rows " + std::to_string(rate.means.first_row) +
                       " to " + std::to_string(rate.means.last_row) + ", where a rate is stated");
    }
    Result<PoseNode> node = node_at(PoseRole::kRate, &rate.means);
    TRUETRIAD_RETURN_IF_ERROR(node);
    Result<Observation> seen = Observe(poses,
                                       rate.means,
                                       Triad::kGyroscope,
                                       options.triads[Triad::kGyroscope],
                                       sources[Triad::kGyroscope]);
    TRUETRIAD_RETURN_IF_ERROR(seen);
    seen->rate_covariance = rate.stated.covariance_radps2;
    node->known_rate_radps = rate.stated.rate_radps;
    node->is_axis_known = rate.stated.is_axis_known;
    if (!node->is_axis_known) node->kind = PoseKind::kDirection;
    node->observations.push_back(*std::move(seen));
    nodes->push_back(*std::move(node));
  }
  for (const KnownTurn& turn : poses.turns) {
    if (!IsUsed(turn)) continue;
    const StaticPose* at = NearestInTime(poses, turn.move.time_ns.front());
    for (const Eigen::Quaterniond& attitude :
         {Eigen::Quaterniond::Identity(), StatedRotation(turn.stated)}) {
      Result<PoseNode> end = node_at(PoseRole::kTurnEnd, at);
      TRUETRIAD_RETURN_IF_ERROR(end);
      SetState(attitude, &*end);
      nodes->push_back(*std::move(end));
    }
    Result<PoseNode> axis = node_at(PoseRole::kTurnAxis, at);
    TRUETRIAD_RETURN_IF_ERROR(axis);
    axis->known_rate_radps = MeanRate(turn);
    Observation seen;
    seen.triad = Triad::kGyroscope;
    seen.mean_raw = MeanOverTime(turn.move.time_ns, turn.move.gyroscope_raw);
    seen.rate_covariance = MeanRateCovariance(turn);
    axis->observations.push_back(seen);
    nodes->push_back(*std::move(axis));
  }
  return {};
}

IncrementEdge EdgeOfTurn(const KnownTurn& turn,
                         const PoseSet& poses,
                         const TriadModel<double>* accelerometer,
                         const PoseGraph& graph) {
  IncrementEdge edge;
  edge.move = MoveOf(turn.move, accelerometer);
  edge.sigma_raw = ReadingSigma(poses, graph.sensitivity(Triad::kGyroscope));
  edge.stated_covariance = EndCovariance(turn.stated);
  if (const StaticPose* at = NearestInTime(poses, turn.move.time_ns.front());
      at != nullptr && at->temperature_degc) {
    edge.temperature_degc = *at->temperature_degc;
    edge.temperature_rate_degcps = at->temperature_rate_degcps;
  }
  edge.Integrate(graph.layout, graph.shared.data());
  return edge;
}

void JoinKnownTurns(const PoseSet& poses, const StartValues& start, PoseGraph* graph) {
  const auto& accelerometer = start.models[Triad::kAccelerometer];
  const auto find = [&](PoseRole role, std::size_t from) {
    while (from < graph->nodes.size() && graph->nodes[from].role != role) ++from;
    return from;
  };
  std::size_t at = 0;
  for (const KnownRate& rate : poses.rates) {
    at = find(PoseRole::kRate, at);
    PoseNode& node = graph->nodes[at++];
    const auto& force = rate.means.triads[Triad::kAccelerometer];
    if (accelerometer && force) {
      node.known_force_mps2 = accelerometer->TruthFromRaw(force->mean_raw);
    }
  }
  at = 0;
  for (std::size_t i = 0; i < poses.turns.size(); ++i) {
    const KnownTurn& turn = poses.turns[i];
    if (!IsUsed(turn)) continue;
    IncrementEdge edge = EdgeOfTurn(turn, poses, accelerometer ? &*accelerometer : nullptr, *graph);
    edge.stated_turn = static_cast<int>(i);
    edge.from = find(PoseRole::kTurnEnd, at);
    at = edge.from + 2;
    PoseNode& axis = graph->nodes[at];
    const double readings = static_cast<double>(turn.move.time_ns.size());
    axis.observations.front().rest_covariance =
        (edge.sigma_raw.cwiseAbs2() / readings).asDiagonal();
    if (accelerometer && !turn.move.accelerometer_raw.empty()) {
      axis.known_force_mps2 =
          accelerometer->TruthFromRaw(MeanOverTime(turn.move.time_ns, turn.move.accelerometer_raw));
    }
    graph->increments.push_back(std::move(edge));
  }
}

Result<TriadModel<double>> GyroscopeFromKnownMotions(const PoseSet& poses) {
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> rates;  // known rate, mean reading
  for (const StaticPose& pose : poses.poses) {
    if (const auto& seen = pose.triads[Triad::kGyroscope]) {
      rates.emplace_back(Eigen::Vector3d::Zero(), seen->mean_raw);
    }
  }
  for (const KnownRate& rate : poses.rates) {
    if (!rate.stated.is_axis_known) continue;
    if (const auto& seen = rate.means.triads[Triad::kGyroscope]) {
      rates.emplace_back(rate.stated.rate_radps, seen->mean_raw);
    }
  }
  for (const KnownTurn& turn : poses.turns) {
    if (!IsUsed(turn)) continue;
    rates.emplace_back(MeanRate(turn), MeanOverTime(turn.move.time_ns, turn.move.gyroscope_raw));
  }
  const auto count = static_cast<Eigen::Index>(rates.size());
  double largest = 0.0;
  for (const auto& [known, read] : rates) largest = std::max(largest, known.norm());
  Eigen::MatrixXd design(count, 4);
  Eigen::MatrixXd values(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto& [known, read] = rates[static_cast<std::size_t>(i)];
    // Scales the rate columns like the constant column, so that the rank tolerance is meaningful.
    design.row(i) << known.transpose() / std::max(largest, 1e-300), 1.0;
    values.row(i) = read.transpose();
  }
  // The least pivot, as a share of the largest. A direction with a smaller pivot has a σ of over
  // 1000 times that of the best direction, and counts as undetermined.
  constexpr double kThin = 1e-3;
  const LeastSquares fit(design, kThin);
  if (count < 4 || fit.rank() < 4) {
    return NotEnoughError(
        Finding(FindingCode::kTurnAxesMissing,
                "gyroscope: known turns, known rates and rests do not determine all of its gains "
                "and its bias",
                "turn the unit about three different axes, each in both directions, or add rests")
            .About(Triad::kGyroscope));
  }
  const Eigen::MatrixXd solution = fit.Solve(values);
  return TriadModel<double>{solution.topRows<3>().transpose() / largest,
                            solution.row(3).transpose()};
}

Status CheckTurnCounts(const PoseSet& poses, const StartValues& start) {
  const auto& gyroscope = start.models[Triad::kGyroscope];
  if (!gyroscope) return {};
  for (std::size_t i = 0; i < poses.turns.size(); ++i) {
    const KnownTurn& turn = poses.turns[i];
    if (!IsUsed(turn)) continue;
    const double counted = CountedAngle(turn, *gyroscope);
    if (std::abs(counted - turn.stated.angle_rad) < std::numbers::pi) continue;
    const Eigen::Vector3d& axis = turn.stated.axis;
    const bool is_missing = std::abs(counted) < kMissingShare * std::abs(turn.stated.angle_rad);
    return Error(
        ErrorCode::kDoesNotMatch,
        {poses.source},
        NameOf(turn, i) + " is stated as " +
            Format("%.0f deg", kDegPerRad * turn.stated.angle_rad) +
            Format(" about (%.3g, ", axis.x()) + Format("%.3g, ", axis.y()) +
            Format("%.3g), but the gyroscope measures ", axis.z()) +
            Format("%.0f deg about that axis", kDegPerRad * counted) +
            "; check the axis, the number of turns and the sign (right-hand rule about the axis)" +
            (is_missing ? ", or leave the turn out if its readings were cut out of the recording"
                        : ""));
  }
  return {};
}

std::vector<TurnCheck> CheckTurns(const PoseSet& poses,
                                  const PoseGraph& graph,
                                  const Eigen::MatrixXd& free_covariance,
                                  double excess_variance) {
  const bool has_force = graph.layout.Has(Triad::kAccelerometer);
  const TriadModel<double> accelerometer =
      has_force ? TriadModel<double>{graph.sensitivity(Triad::kAccelerometer),
                                     graph.bias(Triad::kAccelerometer)}
                : TriadModel<double>();
  const TriadModel<double> gyroscope{graph.sensitivity(Triad::kGyroscope),
                                     graph.bias(Triad::kGyroscope)};
  std::vector<TurnCheck> checks;
  for (std::size_t i = 0; i < poses.turns.size(); ++i) {
    const KnownTurn& turn = poses.turns[i];
    const StatedTurn& stated = turn.stated;
    TurnCheck& check = checks.emplace_back();
    check.name = NameOf(turn, i);
    check.axis = stated.axis;
    check.stated_rad = stated.angle_rad;
    check.stated_sigma_rad = stated.sigma_rad;
    if (turn.move.fault) {
      check.fault = turn.move.fault->text;
      continue;
    }
    const IncrementEdge edge = EdgeOfTurn(turn, poses, has_force ? &accelerometer : nullptr, graph);
    PoseNode begin, end;
    SetState(StatedRotation(stated), &end);
    Eigen::Vector3d residual;
    PoseSharedJacobian jacobian;
    edge.Evaluate(graph.layout,
                  graph.shared.data(),
                  begin.state.data(),
                  end.state.data(),
                  &residual,
                  &jacobian,
                  nullptr,
                  nullptr);
    const double wrapped = stated.angle_rad - stated.axis.dot(residual);
    const double turns =
        std::round((CountedAngle(turn, gyroscope) - wrapped) / (2.0 * std::numbers::pi));
    check.found_rad = wrapped + 2.0 * std::numbers::pi * turns;
    const Eigen::RowVectorXd by_free = stated.axis.transpose() * jacobian * graph.layout.basis;
    check.found_sigma_rad =
        std::sqrt(std::max(0.0, by_free.dot(free_covariance * by_free.transpose())) +
                  stated.axis.dot(edge.increment.covariance * stated.axis) + excess_variance);
    check.used = IsUsed(turn);
    for (const IncrementEdge& other : graph.increments) {
      if (other.stated_turn == static_cast<int>(i)) check.used = !other.rejected;
    }
  }
  return checks;
}

}  // namespace truetriad
