// SPDX-License-Identifier: Apache-2.0
#include "motion/motion_graph.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "math/distributions.h"
#include "model/mechanisms.h"
#include "problem/graph_rows.h"

namespace truetriad {
namespace {

// Median of sqrt(chi^2 / 3) with three degrees of freedom.
constexpr double kMedianLength = 0.8880;
// A ratio of variances must differ from 1 by this many sampling errors, which chance causes once in
// 30,000.
constexpr double kBelievedErrors = 4.0;
// Chosen: autocorrelations are summed up to a lag of this share of the nodes.
constexpr double kLongestLagShare = 0.05;

// Least noise as a share of the signal, for readings without noise, which still need weights.
constexpr double kLeastNoise = 1e-9;

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
  // Two successive turns share a reading, so that the noise of a turn is not that of its readings.
  // It follows from the turn's duration (WeighMoments).
  edge.sigma_raw.setZero();
  edge.Integrate(graph.layout, graph.shared.data());
  return edge;
}

// Robust σ of a reading's white noise from fourth differences, which smooth motion hardly affects.
Eigen::Vector3d DifferenceSigma(const std::vector<Eigen::Vector3d>& readings) {
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> differences;
    for (std::size_t i = 2; i + 2 < readings.size(); ++i) {
      differences.push_back(readings[i - 2][axis] + readings[i + 2][axis] -
                            4.0 * (readings[i - 1][axis] + readings[i + 1][axis]) +
                            6.0 * readings[i][axis]);
    }
    // Fourth differences of white noise have 1 + 16 + 36 + 16 + 1 = 70 times its variance.
    sigma[axis] = MadSigma(std::move(differences)) / std::sqrt(70.0);
  }
  return sigma;
}

// 1 + 2 times the sum of the autocorrelations, up to the first pair whose sum is not positive
// (Geyer 1992). If this does not exceed 1 by kBelievedErrors sampling errors, the ratio is 1.
double LongRunRatio(const Eigen::Matrix3Xd& residuals) {
  const Eigen::Index count = residuals.cols();
  const double variance = residuals.squaredNorm();
  if (!(variance > 0.0)) return 1.0;
  const auto at_lag = [&](Eigen::Index lag) {
    return (residuals.leftCols(count - lag).array() * residuals.rightCols(count - lag).array())
               .sum() /
           variance;
  };
  const auto longest = static_cast<Eigen::Index>(kLongestLagShare * static_cast<double>(count));
  double ratio = 1.0;
  Eigen::Index lag = 1;
  for (; lag + 1 <= longest; lag += 2) {
    const double pair = at_lag(lag) + at_lag(lag + 1);
    if (pair <= 0.0) break;
    ratio += 2.0 * pair;
  }
  const double sampling = 2.0 * std::sqrt(static_cast<double>(lag) / (3.0 * count));
  const bool is_believed = ratio > 1.0 + kBelievedErrors * sampling;
  return is_believed && Acts(Mechanism::kMotionCorrelation) ? ratio : 1.0;
}

// The whitened residuals of one sensor (for the gyroscope: of the turns), and for each the share
// that the attitudes do not absorb, 1 - leverage. Each moment has a column, which is zero without a
// reading.
struct Residuals {
  Eigen::Matrix3Xd value, left;
};

// `value` is W r, and `left` the diagonal of W^-T D W^-1, with W^T W = V^-1.
PerTriad<Residuals> ResidualsOf(const PoseGraph& graph, const ReducedSystem& system) {
  const auto count = static_cast<Eigen::Index>(graph.nodes.size());
  PerTriad<Residuals> all;
  for (Residuals& of_triad : all) {
    of_triad.value.setZero(3, count);
    of_triad.left.setZero(3, count);
  }
  const auto take = [&](Triad triad, std::size_t factor, Eigen::Index row, const RowRoot& root) {
    const auto moment = static_cast<Eigen::Index>(system.factors()[factor].node);
    const Eigen::Matrix3d D = system.D(factor).block(row, row, 3, 3);
    const Eigen::Matrix3d inverse = Eigen::Matrix3d(root).inverse();
    all[triad].value.col(moment) =
        root * system.residual().segment<3>(system.factors()[factor].row + row);
    all[triad].left.col(moment) = (inverse.transpose() * D * inverse).diagonal();
  };
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    Eigen::Index row = 0;
    for (const Observation& seen : graph.nodes[k].observations) {
      take(seen.triad, k, row, RootOf(seen.variance, seen.weight));
      row += 3;
    }
  }
  for (std::size_t i = 0; i < graph.increments.size(); ++i) {
    const IncrementEdge& edge = graph.increments[i];
    take(Triad::kGyroscope, graph.nodes.size() + i, 0, RootOf(edge.variance, edge.weight));
  }
  return all;
}

// Sets the robust weights of one sensor from the length of each residual divided by the median
// length.
void Weigh(const RobustOptions& robust,
           Triad triad,
           const Residuals& residuals,
           std::vector<Moment>* moments) {
  const auto weight_of = [triad](Moment& moment) -> double& {
    return triad == Triad::kGyroscope ? moment.weight : moment.seen(triad).weight;
  };
  std::vector<double> lengths(moments->size(), 0.0), seen;
  for (std::size_t k = 0; k < moments->size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    const double left = residuals.left.col(column).sum();
    if (!(left > 0.0)) continue;
    lengths[k] =
        std::sqrt(residuals.value.col(column).squaredNorm() / left / weight_of((*moments)[k]));
    seen.push_back(lengths[k]);
  }
  if (seen.empty()) return;
  const double typical = Median(std::move(seen)) / kMedianLength;
  for (std::size_t k = 0; k < moments->size(); ++k) {
    const double length = lengths[k] / typical;
    const bool is_far = length > robust.scale && Acts(Mechanism::kMotionWeights);
    weight_of((*moments)[k]) = is_far ? robust.scale / length : 1.0;
  }
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

PerTriad<ClockError> ClockErrorsOf(const std::vector<Moment>& moments,
                                   const PoseGraph& graph,
                                   const ReducedSystem& system) {
  StackedRows Z = StackedRows::Zero(system.residual().size(), std::size(kVectorTriads));
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const PoseNode& node = graph.nodes[k];
    Eigen::Index row = system.factors()[k].row;
    for (const Observation& seen : node.observations) {
      const Eigen::Vector3d at_node =
          node.rotation().conjugate() * WorldVector(seen.triad, graph.reference());
      Z.block<3, 1>(row, seen.triad == kVectorTriads[0] ? 0 : 1) =
          graph.sensitivity(seen.triad) * (moments[k].seen(seen.triad).turn_per_s * at_node);
      row += 3;
    }
  }
  Eigen::Matrix2d information = Z.transpose() * system.Projected(Z);
  const Eigen::Array2<bool> is_seen = information.diagonal().array() > 0.0;
  if (!is_seen[0]) information(0, 0) = 1.0;
  if (!is_seen[1]) information(1, 1) = 1.0;
  const Eigen::Matrix2d covariance = information.inverse();
  const Eigen::Vector2d step = -covariance * (Z.transpose() * system.projected());
  PerTriad<ClockError> errors;
  for (Eigen::Index i = 0; i < 2; ++i) {
    if (is_seen[i]) errors[kVectorTriads[i]] = {step[i], std::sqrt(covariance(i, i))};
  }
  return errors;
}

MotionNoiseState ChooseMotionNoise(const PoseSet& poses,
                                   const CalibrateOptions& options,
                                   const StartValues& start,
                                   const MotionTrack& track) {
  MotionNoiseState state;
  for (const Triad triad : kTriads) {
    const TriadOptions& sensor = options.triads[triad];
    state.noise.density[triad].setOnes();
    state.stated.density[triad].setZero();
    state.seen.density[triad].setZero();
    if (!sensor.enabled) continue;
    const double spacing_s = track.spacing_s(triad);
    const Eigen::Vector3d gain = start.models[triad]->sensitivity.rowwise().norm();
    const bool is_stated = sensor.noise_sigma_raw || sensor.allan;
    if (sensor.noise_sigma_raw) {
      state.source[triad] = sensor.noise_source;
      state.stated.density[triad] = spacing_s * sensor.noise_sigma_raw->cwiseAbs2();
    } else if (sensor.allan) {
      state.source[triad] = NoiseSource::kAllan;
      state.stated.density[triad] = sensor.allan->white_density_raw.cwiseAbs2();
    } else {
      state.source[triad] = NoiseSource::kResidual;
      const Eigen::Vector3d sigma = DifferenceSigma(poses.tracks[triad].reading_raw);
      state.noise.density[triad] = spacing_s * sigma.cwiseAbs2();
      // Readings without noise still need weights.
      const double strength =
          triad == Triad::kGyroscope ? 1.0 : WorldVector(triad, start.reference).norm();
      state.stated.density[triad] = spacing_s * (kLeastNoise * strength * gain).cwiseAbs2();
      // A part of the differences is rounding, which does not accumulate in an integral.
      const StreamSummary* stream = poses.Find(triad);
      const Eigen::Vector3d step =
          stream != nullptr ? stream->resolution_raw : Eigen::Vector3d::Zero().eval();
      state.seen.density[triad] =
          (state.noise.density[triad] - spacing_s / 12.0 * step.cwiseAbs2()).cwiseMax(0.0);
    }
    if (sensor.excess == ExcessNoise::kGiven) {
      state.stated.density[triad] +=
          spacing_s * sensor.excess_sigma * sensor.excess_sigma * gain.cwiseAbs2();
    }
    state.noise.density[triad] =
        is_stated ? state.stated.density[triad]
                  : state.noise.density[triad].cwiseMax(state.stated.density[triad]).eval();
    state.is_estimated[triad] = !is_stated || sensor.excess == ExcessNoise::kEstimate;
  }
  return state;
}

double UpdateMotionNoise(const RobustOptions& robust,
                         const MotionTrack& track,
                         std::vector<Moment>* moments,
                         PoseGraph* graph,
                         ReducedSystem* system,
                         MotionNoiseState* state) {
  const PerTriad<Residuals> residuals = ResidualsOf(*graph, *system);
  double change = 0.0;
  for (const Triad triad : kTriads) {
    const Residuals& of_triad = residuals[triad];
    const double left = of_triad.left.sum();
    if (!(left > 0.0)) continue;
    if (robust.enabled) Weigh(robust, triad, of_triad, moments);
    if (!state->is_estimated[triad]) continue;
    state->correlation[triad] = LongRunRatio(of_triad.value);
    if (triad == Triad::kGyroscope && !state->is_carried) {
      // The attitudes absorb the fast part of the gyroscope's noise, but not the slow part. Even
      // white noise thus leaves correlated residuals, whose long-run ratio is 1 / share.
      const double share = left / static_cast<double>(of_triad.left.size());
      state->correlation[triad] = std::max(1.0, share * state->correlation[triad]);
    }
    Eigen::Vector3d factor = Eigen::Vector3d::Constant(of_triad.value.squaredNorm() / left);
    if (triad != Triad::kGyroscope) {
      factor = of_triad.value.rowwise().squaredNorm().cwiseQuotient(
          of_triad.left.rowwise().sum().cwiseMax(1e-12));
    }
    Eigen::Vector3d& density = state->noise.density[triad];
    const Eigen::Vector3d before = density;
    const Eigen::Vector3d found = state->correlation[triad] * factor.cwiseProduct(density);
    Eigen::Vector3d& seen = state->seen.density[triad];
    if (found.sum() < (1.0 - kBelievedErrors * 2.0 / std::sqrt(left)) * seen.sum()) {
      seen.setZero();
    }
    density = found.cwiseMax(state->stated.density[triad]).cwiseMax(seen);
    change = std::max(change, (density - before).cwiseAbs().cwiseQuotient(before).maxCoeff());
  }
  WeighMoments(state->noise, track, *moments, graph);
  system->Eliminate(*graph);
  return change;
}

}  // namespace truetriad
