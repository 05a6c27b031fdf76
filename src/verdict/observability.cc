// SPDX-License-Identifier: Apache-2.0
#include "verdict/observability.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <set>
#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "base/messages.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "math/distributions.h"
#include "model/attitude_sets.h"
#include "problem/parameter_name.h"
#include "solve/reduced_system.h"

namespace truetriad {
namespace {

// Most parameters that a message names: chosen to keep it readable.
constexpr int kMostNamed = 4;
constexpr std::size_t kMostDirections = 6;  // most directions that a report names
// An eigenvalue of the scaled information below this share of the largest one is rounding.
constexpr double kUndetermined = 1e-14;
// Temperatures within this share of half their range are one setting of a chamber.
constexpr double kSameTemperature = 0.05;

// "accelerometer.thermal.sensitivity.1.xx" -> "accelerometer scale x, tau^1".
std::string SpokenName(const std::string& text) {
  if (const auto name = ParameterName::Parse(text)) {
    const std::string row(1, AxisLetter(name->row));
    const std::string col(1, AxisLetter(name->col));
    std::string spoken(TriadName(name->triad));
    if (name->kind == ParameterKind::kGSensitivity) return spoken + " g-sensitivity " + row + col;
    const ParameterInfo& info = InfoOf(name->kind);
    if (info.axis_term) {
      return spoken.append(" ").append(InfoOf(*info.axis_term).words).append(" ").append(row);
    }
    if (name->kind != ParameterKind::kSensitivity) {
      spoken += " bias " + row;
    } else {
      spoken += name->row == name->col ? " scale " + row : " misalignment " + row + col;
    }
    if (name->power > 0) spoken += ", tau^" + std::to_string(name->power);
    if (info.rate) spoken.append(", ").append(InfoOf(*info.rate).words);
    return spoken;
  }
  int session = 0, read = 0;
  if (std::sscanf(text.c_str(), "session_%d.%n", &session, &read) == 1) {
    return SpokenName(text.substr(static_cast<std::size_t>(read))) + " in session " +
           std::to_string(session);
  }
  if (text == "reference.dip_rad") return "dip of the field";
  if (text == "reference.field_ut") return "field strength";
  if (text == "reference.heading_rad") return "heading of the field";
  if (text == "reference.gravity_mps2") return "gravity";
  const auto first = text.find('.');
  return "tilt of face " + text.substr(first + 1, text.rfind('.') - first - 1);
}

std::string Describe(const std::vector<std::string>& names,
                     const Eigen::VectorXd& loading,
                     bool determined) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(loading.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::stable_sort(order.begin(), order.end(), [&loading](Eigen::Index a, Eigen::Index b) {
    return std::abs(loading[a]) > std::abs(loading[b]);
  });
  std::vector<std::string> parts;
  for (const Eigen::Index i : order) {
    if (std::abs(loading[i]) < 0.4 * std::abs(loading[order.front()])) break;
    if (parts.size() == kMostNamed) break;
    const std::string part = SpokenName(names[static_cast<std::size_t>(i)]);
    if (std::find(parts.begin(), parts.end(), part) == parts.end()) parts.push_back(part);
  }
  if (parts.size() == 1) {
    return parts.front() + (determined ? " is weakly determined" : " is not determined");
  }
  return Listed(parts) + (determined ? " are nearly indistinguishable" : " are indistinguishable");
}

// A direction in words: "+z", "-x", "halfway between +x and -y", "between +x, +y and +z".
std::string SpokenDirection(const Eigen::Vector3d& direction) {
  std::vector<std::string> parts;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (std::abs(direction[axis]) < 0.1) continue;
    std::string part(1, direction[axis] > 0.0 ? '+' : '-');
    part += AxisLetter(axis);
    parts.push_back(part);
  }
  if (parts.size() == 1) return parts.front();
  return (parts.size() == 2 ? "halfway between " : "between ") + Listed(parts);
}

// A pose that could be added: its upward axis (for a magnetometer alone, the axis along the field),
// and rows like those of a recorded pose.
struct CandidatePose {
  Eigen::Vector3d up;
  PoseNode node;
};

bool HasThermal(const SharedLayout& layout) {
  return std::any_of(layout.thermal.begin(), layout.thermal.end(), [](const ThermalBlock& block) {
    return block.size() > 0;
  });
}

// Temperatures of the poses, ascending; those of one chamber setting count as one.
std::vector<double> DistinctTemperatures(const PoseGraph& graph) {
  std::vector<double> all;
  for (const PoseNode& node : graph.nodes) all.push_back(node.temperature_degc);
  std::sort(all.begin(), all.end());
  const double apart = kSameTemperature * graph.layout.thermal_scale.half_range_degc;
  std::vector<double> distinct;
  for (const double temperature : all) {
    if (distinct.empty() || temperature > distinct.back() + apart) distinct.push_back(temperature);
  }
  return distinct;
}

std::vector<CandidatePose> CandidatePoses(const PoseGraph& graph) {
  std::vector<CandidatePose> candidates;
  // A typical pose has the triads and variances of the pose with the most triads.
  const PoseNode* fullest = &graph.nodes.front();
  for (const PoseNode& node : graph.nodes) {
    if (node.observations.size() > fullest->observations.size()) fullest = &node;
  }
  for (const Eigen::Quaterniond& q : HandAttitudes()) {
    CandidatePose candidate{q.conjugate() * Eigen::Vector3d::UnitZ(), *fullest};
    candidate.node.has_attitude_prior = false;
    candidate.node.face = -1;
    for (Observation& observation : candidate.node.observations) observation.weight = 1.0;
    if (fullest->kind == PoseKind::kDirection) {
      const Eigen::Vector3d& up = candidate.up;
      candidate.node.state = {up.x(), up.y(), up.z(), 0.0};
    } else {
      candidate.node.kind = PoseKind::kRotation;
      candidate.node.state = {q.x(), q.y(), q.z(), q.w()};
    }
    if (!HasThermal(graph.layout)) {
      candidates.push_back(candidate);
      continue;
    }
    for (const double temperature : DistinctTemperatures(graph)) {
      candidate.node.temperature_degc = temperature;
      candidates.push_back(candidate);
    }
  }
  return candidates;
}

// Advice for a direction that poses at the present temperatures would not determine.
std::string TemperatureAdvice(const PoseGraph& graph, const ParameterName& name) {
  if (name.kind != ParameterKind::kBias && name.kind != ParameterKind::kSensitivity) {
    return "take poses while the temperature rises and falls at several rates, or drop the rate "
           "terms";
  }
  const std::size_t count = DistinctTemperatures(graph).size();
  return "take poses at more temperatures (" + std::to_string(count) +
         (count == 1 ? " was" : " were") + " seen), or lower the order of the terms";
}

// The wanted parameters are all but the tilts of a block. `sigmas`: the roots of the eigenvalues of
// their covariance in typical units, ascending; infinite for an undetermined direction.
struct Marginal {
  Eigen::VectorXd sigmas;
  Eigen::MatrixXd directions;  // in scaled free coordinates, unit columns
};

Marginal MarginalOfWanted(const PoseGraph& graph, const SharedInformation& system) {
  std::vector<Eigen::Index> wanted;
  const SharedLayout& layout = graph.layout;
  for (Eigen::Index i = 0; i < layout.basis.cols(); ++i) {
    bool tilt = false;
    for (const int at : layout.face_tilt) {
      tilt = tilt || (at >= 0 && !layout.basis.col(i).segment<2>(at).isZero(0.0));
    }
    if (!tilt) wanted.push_back(i);
  }
  const auto count = static_cast<Eigen::Index>(wanted.size());
  Marginal marginal;
  if (count == 0) return marginal;
  Eigen::MatrixXd covariance(count, count);
  double most = std::numeric_limits<double>::infinity();  // a larger variance is due to rounding
  if (system.is_regular()) {
    covariance =
        ScaledBothSides(system.scale()(wanted).cwiseInverse(), system.covariance()(wanted, wanted));
  } else {
    // An undetermined direction gets the largest variance that is not due to rounding.
    const auto [values, vectors] = system.FindSpectrum();
    const double least = kUndetermined * std::max(values.maxCoeff(), 1e-300);
    const Eigen::VectorXd variances = values.cwiseMax(least).cwiseInverse();
    Eigen::MatrixXd selected(count, system.size());
    for (Eigen::Index i = 0; i < count; ++i) {
      selected.row(i) = vectors.row(wanted[static_cast<std::size_t>(i)]);
    }
    covariance = TimesTranspose(selected * variances.asDiagonal(), selected);
    most = 0.01 / least;
  }
  const SymmetricEigen solver = EigenOfSymmetric(covariance);
  marginal.sigmas = solver.values.cwiseMax(0.0).cwiseSqrt();
  for (double& sigma : marginal.sigmas) {
    if (sigma * sigma > most) sigma = std::numeric_limits<double>::infinity();
  }
  marginal.directions = Eigen::MatrixXd::Zero(system.size(), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    marginal.directions.row(wanted[static_cast<std::size_t>(i)]) = solver.vectors.row(i);
  }
  return marginal;
}

// The axis whose asymmetry dominates a direction of parameter space, or -1. If all turns have one
// sense, they do not separate the asymmetry from the gain.
int AsymmetricAxis(const std::vector<std::string>& names, const Eigen::VectorXd& loading) {
  constexpr double kShare = 0.5;  // an asymmetry dominates above this share of the largest loading
  int axis = -1;
  double largest = kShare * loading.cwiseAbs().maxCoeff();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double size = std::abs(loading[static_cast<Eigen::Index>(i)]);
    const auto name = ParameterName::Parse(names[i]);
    if (size < largest || !name || name->kind != ParameterKind::kAsymmetry) continue;
    largest = size;
    axis = name->row;
  }
  return axis;
}

// The information (1 / σ^2) on the direction `free` that each candidate adds.
std::vector<double> GainsOf(const ReducedSystem& added, const Eigen::VectorXd& free) {
  std::vector<double> gains;
  for (std::size_t c = 0; c < added.factors().size(); ++c) {
    const ReducedSystem::Factor& pose = added.factors()[c];
    const Eigen::VectorXd moved = added.J().middleRows(pose.row, pose.rows) * free;
    gains.push_back(moved.dot(added.D(c) * moved));
  }
  return gains;
}

// What to record to reduce a direction's σ. If there are temperature terms, and no candidate alone
// reduces σ to `wanted`, the advice is on temperatures.
std::string AdviceFor(const PoseGraph& graph,
                      const std::vector<std::string>& names,
                      const Eigen::VectorXd& loading,
                      const std::vector<CandidatePose>& candidates,
                      const std::vector<double>& gains,
                      double wanted,
                      const char* how_to_add) {
  if (const int axis = AsymmetricAxis(names, loading); axis >= 0) {
    return std::string("turn the unit both ways about its ") + AxisLetter(axis) + " axis";
  }
  if (candidates.empty()) return {};
  const auto most = std::max_element(gains.begin(), gains.end());
  const CandidatePose& best = candidates[static_cast<std::size_t>(most - gains.begin())];
  Eigen::Index leading = 0;
  loading.cwiseAbs().maxCoeff(&leading);
  const auto name = ParameterName::Parse(names[static_cast<std::size_t>(leading)]);
  const bool has_thermal = HasThermal(graph.layout);
  // More poses at the present temperatures would not suffice.
  if (has_thermal && name && *most * wanted * wanted < 1.0) return TemperatureAdvice(graph, *name);
  if (!(*most > 0.0)) return {};
  const bool field_only = !best.node.is_field_inclined ||
                          (best.node.kind == PoseKind::kDirection &&
                           best.node.observations.front().triad == Triad::kMagnetometer);
  const std::string how = field_only ? " along the field" : " up";
  // The opposite pose is advised, too, if it adds at least 30 % as much information.
  double opposite = 0.0;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    if ((candidates[c].up + best.up).norm() < 1e-6) opposite = std::max(opposite, gains[c]);
  }
  std::string advice = std::string(how_to_add) + " " +
                       (has_thermal ? Format("at %.3g degC ", best.node.temperature_degc) : "") +
                       "with body " + SpokenDirection(best.up) + how;
  if (opposite > 0.3 * *most) advice += ", and with " + SpokenDirection(-best.up) + how;
  return advice;
}

}  // namespace

Observability AnalyseObservability(const PoseGraph& graph,
                                   const SharedInformation& system,
                                   double limit,
                                   const char* how_to_add) {
  Observability result;
  const Marginal marginal = MarginalOfWanted(graph, system);
  const auto n = marginal.sigmas.size();
  if (n == 0 || graph.nodes.empty()) return result;
  const double median = Median({marginal.sigmas.begin(), marginal.sigmas.end()});
  const auto is_weak = [&](double sigma) {
    return sigma > 0.25 * limit || (sigma > 10.0 * median && sigma > 0.01);
  };
  if (std::none_of(marginal.sigmas.begin(), marginal.sigmas.end(), is_weak)) return result;

  const std::vector<std::string> names = ParameterNames(graph.layout);
  const Eigen::VectorXd typical = TypicalSizes(graph.layout, graph.shared);
  const bool alone =
      !graph.layout.Has(Triad::kAccelerometer) && !graph.layout.Has(Triad::kMagnetometer);
  // A graph of the candidate poses alone, for the information that they add.
  PoseGraph extended = graph;
  const std::vector<CandidatePose> candidates = CandidatePoses(graph);
  extended.nodes.clear();
  extended.increments.clear();
  extended.priors.clear();
  for (const CandidatePose& candidate : candidates) extended.nodes.push_back(candidate.node);
  const ReducedSystem added(extended);
  const bool on_block = std::any_of(graph.layout.face_tilt.begin(),
                                    graph.layout.face_tilt.end(),
                                    [](int tilt) { return tilt >= 0; });

  std::set<std::string> said;
  for (Eigen::Index i = n - 1; i >= 0; --i) {  // σ ascend: worst first
    const double sigma = marginal.sigmas[i];
    if (!is_weak(sigma)) continue;
    const bool determined = sigma <= limit;
    result.determined = result.determined && determined;
    if (result.weak_directions.size() >= kMostDirections) continue;
    WeakDirection weak;
    weak.sigma = sigma;
    const Eigen::VectorXd free = system.scale().asDiagonal() * marginal.directions.col(i);
    const Eigen::VectorXd loading = TimesVector(graph.layout.basis, free).cwiseQuotient(typical);
    weak.description = Describe(names, loading, determined);
    if (alone) {
      weak.advice = "add known rates or turns about body x, y and z, each both ways, and rests";
      if (said.insert(weak.description).second) result.weak_directions.push_back(weak);
      continue;
    }
    if (on_block) {
      weak.advice =
          "this σ follows from tilt_sigma_deg: level the block better, or add free poses without "
          "the block";
      if (said.insert(weak.description).second) result.weak_directions.push_back(weak);
      continue;
    }
    weak.advice = AdviceFor(graph,
                            names,
                            loading,
                            candidates,
                            GainsOf(added, free),
                            std::min(sigma, limit),
                            how_to_add);
    if (!said.insert(weak.description + weak.advice).second) continue;
    result.weak_directions.push_back(weak);
  }
  return result;
}

LeastKnown LeastKnownOf(const PoseGraph& graph, const Eigen::MatrixXd& covariance) {
  const SharedLayout& layout = graph.layout;
  Eigen::ArrayXd shares = VariancesOf(layout, covariance).max(0.0).sqrt() /
                          TypicalSizes(layout, graph.shared).array().abs();
  for (const int tilt : layout.face_tilt) {
    if (tilt >= 0) shares.segment<2>(tilt).setZero();
  }
  if (shares.size() == 0) return {};
  Eigen::Index most = 0;
  const double share = shares.maxCoeff(&most);
  return {SpokenName(ParameterNames(layout)[static_cast<std::size_t>(most)]), share};
}

}  // namespace truetriad
