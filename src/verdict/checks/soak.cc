// SPDX-License-Identifier: Apache-2.0
#include "verdict/checks/soak.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include <Eigen/Core>

#include "math/dense/lu.h"
#include "math/dense/products.h"
#include "math/distributions.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// Drift is an error that all poses of a temperature have in common. It is significant if noise
// causes such errors in fewer than one of a hundred runs.
constexpr double kDriftLevel = 0.01;
// If the temperature terms leave a smaller share of the noise (its trace over its degrees of
// freedom), what they leave is rounding.
constexpr double kRoundingShare = 1e-6;
// Largest width of a chamber's setting, as a share of the temperature range.
constexpr double kSameSetting = 0.05;
// The width above is at least this, degC: the scatter of a thermometer.
constexpr double kSameDegc = 1.0;

double WidthOf(double range_degc) { return std::max(kSameSetting * range_degc, kSameDegc); }

// Groups temperatures by settings of the chamber, coldest first. A group has indices in `degc`.
std::vector<std::vector<std::size_t>> GroupByTemperature(const std::vector<double>& degc) {
  std::vector<std::size_t> order(degc.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&degc](auto a, auto b) { return degc[a] < degc[b]; });
  std::vector<std::vector<std::size_t>> groups;
  for (const std::size_t k : order) {
    const double width = WidthOf(degc[order.back()] - degc[order.front()]);
    if (groups.empty() || degc[k] > degc[groups.back().front()] + width) groups.emplace_back();
    groups.back().push_back(k);
  }
  return groups;
}

std::vector<std::vector<std::size_t>> NodesByTemperature(const PoseGraph& graph) {
  std::vector<double> degc;
  for (const PoseNode& node : graph.nodes) degc.push_back(node.temperature_degc);
  return GroupByTemperature(degc);
}

bool IsSeen(const PoseNode& node, Triad triad) {
  return std::any_of(node.observations.begin(), node.observations.end(), [&](const auto& seen) {
    return seen.triad == triad && !seen.rejected;
  });
}

// The solved graph with only the poses `nodes`; only the bias of `triad` is free in it.
PoseGraph WithBiasAlone(const PoseGraph& graph, std::vector<PoseNode> nodes, Triad triad) {
  PoseGraph part = graph;
  part.nodes = std::move(nodes);
  for (PoseNode& node : part.nodes) {
    // The pose's heading was determined by turns, which are removed here.
    if (node.kind == PoseKind::kRotation && !node.TellsHeading()) node.holds_heading = true;
  }
  part.increments.clear();
  part.priors.clear();
  part.layout.basis = Eigen::MatrixXd::Zero(part.layout.size, 3);
  part.layout.basis.middleRows<3>(part.layout.bias[triad]).setIdentity();
  return part;
}

}  // namespace

std::vector<std::vector<std::size_t>> PosesByTemperature(const PoseSet& poses) {
  std::vector<std::size_t> places;
  std::vector<double> degc;
  for (std::size_t k = 0; k < poses.poses.size(); ++k) {
    if (!poses.poses[k].temperature_degc) continue;
    places.push_back(k);
    degc.push_back(*poses.poses[k].temperature_degc);
  }
  std::vector<std::vector<std::size_t>> groups = GroupByTemperature(degc);
  for (std::vector<std::size_t>& group : groups) {
    for (std::size_t& k : group) k = places[k];
    std::sort(group.begin(), group.end());
  }
  return groups;
}

PoseSet PosesAmong(const PoseSet& poses, const std::vector<std::size_t>& places) {
  PoseSet chosen = poses;
  chosen.poses.clear();
  chosen.moves.clear();
  for (const std::size_t k : places) chosen.poses.push_back(poses.poses[k]);
  for (const RecordedMove& move : poses.moves) {
    const auto from = std::find(places.begin(), places.end(), move.from);
    if (from == places.end() || from + 1 == places.end() || *(from + 1) != move.from + 1) continue;
    chosen.moves.push_back(move);
    chosen.moves.back().from = static_cast<std::size_t>(from - places.begin());
  }
  return chosen;
}

std::vector<HeldOutGroup> GroupsOfSettings(const PoseGraph& graph) {
  std::vector<HeldOutGroup> groups;
  std::vector<std::size_t> group_of(graph.nodes.size());
  for (std::vector<std::size_t>& nodes : NodesByTemperature(graph)) {
    for (const std::size_t k : nodes) group_of[k] = groups.size();
    groups.push_back({std::move(nodes), {}});
  }
  for (std::size_t i = 0; i < graph.increments.size(); ++i) {
    groups[group_of[graph.increments[i].from]].increments.push_back(i);
  }
  return groups;
}

std::vector<TemperatureSetting> FindTemperatureSettings(const PoseGraph& graph) {
  std::vector<TemperatureSetting> settings;
  const std::vector<std::vector<std::size_t>> groups = NodesByTemperature(graph);
  for (const Triad triad : kTriads) {
    if (graph.layout.thermal[triad].size() == 0) continue;
    const TriadModel<double> at_reference =
        graph.layout.ModelOf(triad, graph.shared.data(), ThermalFactors());
    const double strength = WorldVector(triad, graph.reference()).norm();
    for (const std::vector<std::size_t>& group : groups) {
      std::vector<PoseNode> nodes;
      Eigen::Vector3d bias = Eigen::Vector3d::Zero();
      TemperatureSetting setting;
      setting.triad = triad;
      RootMeanSquare before, after;
      for (const std::size_t k : group) {
        const PoseNode& node = graph.nodes[k];
        if (node.role != PoseRole::kRest || !IsSeen(node, triad)) continue;
        const TriadModel<double> model = graph.ModelAt(triad, node);
        bias += model.bias;
        setting.degc += node.temperature_degc;
        for (const Observation& seen : node.observations) {
          if (seen.triad != triad) continue;
          before.Add(NormError(at_reference, seen.mean_raw, strength));
          after.Add(NormError(model, seen.mean_raw, strength));
        }
        nodes.push_back(node);
      }
      if (nodes.empty()) continue;
      setting.poses = static_cast<int>(nodes.size());
      setting.degc /= setting.poses;
      setting.rms_before = *before.value();
      setting.rms_after = *after.value();
      const ReducedSystem system(WithBiasAlone(graph, std::move(nodes), triad));
      if (system.rank() < system.size()) continue;
      setting.beyond_terms_raw = system.step();
      setting.bias_raw = bias / setting.poses + setting.beyond_terms_raw;
      setting.bias_sigma_raw = system.covariance().diagonal().cwiseSqrt();
      settings.push_back(setting);
    }
  }
  return settings;
}

namespace {

// G has three columns for each temperature: the change of the gradient if a triad's readings at
// this temperature have a common offset. Offsets o change the solution by M^-1 G o.
Eigen::MatrixXd OffsetColumns(const PoseGraph& graph, const ReducedSystem& system, Triad triad) {
  const std::vector<std::vector<std::size_t>> groups = NodesByTemperature(graph);
  Eigen::MatrixXd G =
      Eigen::MatrixXd::Zero(system.size(), 3 * static_cast<Eigen::Index>(groups.size()));
  Eigen::Index col = 0;
  for (const std::vector<std::size_t>& group : groups) {
    for (const std::size_t k : group) {
      if (graph.nodes[k].role != PoseRole::kRest) continue;
      Eigen::Index row = system.factors()[k].row;
      for (const Observation& seen : graph.nodes[k].observations) {
        if (seen.triad == triad) G.middleCols<3>(col) += system.B().middleRows<3>(row).transpose();
        row += 3;
      }
    }
    col += 3;
  }
  return G;
}

// If there are offsets o at the temperatures, the temperature terms, the bias and the rest of the
// model adapt to them, and L o is left. `trace`, `dof`: the trace of L L^T, and the degrees of
// freedom of |L o|^2 (Satterthwaite 1946). Noise with covariance S at each temperature leaves L S,
// all effects on the solution included. `noise_trace`, `noise_dof`: the same of L S in units of the
// settings' σ (diagonal of S). Unset if the bias is held, or if a temperature does not determine
// it.
struct Leftover {
  double trace = 0.0;
  double dof = 0.0;
  double noise_trace = 0.0;
  double noise_dof = 0.0;
};
std::optional<Leftover> LeftoverOf(const PoseGraph& graph,
                                   const ReducedSystem& system,
                                   Triad triad,
                                   const Eigen::MatrixXd& G) {
  Eigen::MatrixXd of_bias(3, system.size());
  for (int i = 0; i < 3; ++i) of_bias.row(i) = graph.layout.basis.row(graph.layout.bias[triad] + i);
  Eigen::MatrixXd L = -TransposedCongruence(G, system.covariance());
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(G.cols(), G.cols());
  for (Eigen::Index at = 0; at < G.cols(); at += 3) {
    // The information of this temperature alone on an offset.
    const PivotedLu solver(Times(of_bias, G.middleCols(at, 3)));
    if (!solver.is_invertible()) return std::nullopt;
    L.middleRows<3>(at) = solver.Solve(L.middleRows<3>(at));
    S.block<3, 3>(at, at) = solver.Solve(Eigen::MatrixXd(Eigen::Matrix3d::Identity()));
  }
  L.diagonal().array() += 1.0;
  const Eigen::MatrixXd K = TimesTranspose(L, L);
  const Eigen::VectorXd per_sigma = S.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd N = ScaledBothSides(per_sigma, Times(L, S));
  const auto dof_of = [](const Eigen::MatrixXd& covariance) {
    return covariance.trace() * covariance.trace() / covariance.squaredNorm();
  };
  return Leftover{K.trace(), dof_of(K), N.trace(), dof_of(N)};
}

}  // namespace

SettingScatter ScatterOf(const PoseGraph& graph,
                         const ReducedSystem& system,
                         const std::vector<TemperatureSetting>& settings,
                         Triad triad) {
  SettingScatter scatter;
  int count = 0;
  double squares = 0.0;
  double noise = 0.0;
  double chi2 = 0.0;
  for (const TemperatureSetting& setting : settings) {
    if (setting.triad != triad) continue;
    ++count;
    squares += setting.beyond_terms_raw.squaredNorm();
    noise += setting.bias_sigma_raw.squaredNorm();
    chi2 += setting.beyond_terms_raw.cwiseQuotient(setting.bias_sigma_raw).squaredNorm();
  }
  const double left = 3.0 * (count - 1 - graph.layout.thermal[triad].terms.bias_order);
  if (left <= 0.0) return scatter;
  const Leftover leftover = LeftoverOf(graph, system, triad, OffsetColumns(graph, system, triad))
                                .value_or(Leftover{left, left, left, left});
  scatter.dof = leftover.dof;
  scatter.ratio = chi2 / leftover.trace;
  // The terms adapt to all offsets, so that nothing can be tested.
  if (!(leftover.noise_trace > kRoundingShare * left)) return scatter;
  scatter.p_value =
      1.0 - ChiSquareCdf(chi2 / leftover.noise_trace * leftover.noise_dof, leftover.noise_dof);
  scatter.variance_raw = std::max(squares / leftover.trace - noise / (3.0 * count), 0.0);
  return scatter;
}

Eigen::MatrixXd DriftOf(const PoseGraph& graph,
                        const ReducedSystem& system,
                        Triad triad,
                        double variance_raw) {
  const Eigen::MatrixXd moved = system.covariance() * OffsetColumns(graph, system, triad);
  return variance_raw * moved * moved.transpose();
}

DriftCovariance FindDriftCovariance(const PoseGraph& graph,
                                    const ReducedSystem& system,
                                    const std::vector<TemperatureSetting>& settings) {
  DriftCovariance drift;
  drift.covariance = Eigen::MatrixXd::Zero(system.size(), system.size());
  drift.dof = std::numeric_limits<double>::infinity();
  for (const Triad triad : kTriads) {
    if (graph.layout.thermal[triad].size() == 0) continue;
    const SettingScatter scatter = ScatterOf(graph, system, settings, triad);
    if (scatter.p_value >= kDriftLevel || scatter.variance_raw <= 0.0) continue;
    if (!Acts(Mechanism::kDriftBySetting)) continue;
    drift.sigma_raw[triad] = std::sqrt(scatter.variance_raw);
    drift.dof = std::min(drift.dof, scatter.dof);
    drift.covariance += DriftOf(graph, system, triad, scatter.variance_raw);
  }
  return drift;
}

}  // namespace truetriad
