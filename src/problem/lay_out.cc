// SPDX-License-Identifier: Apache-2.0
#include "problem/lay_out.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "math/distributions.h"
#include "model/world.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

// Basis matrices of the free entries of a triad's sensitivity.
std::vector<Eigen::Matrix3d> FreeMatrices(const CalibrateOptions& options,
                                          Triad triad,
                                          MatrixModel model,
                                          const Eigen::Matrix3d& start) {
  const bool is_triangular = triad == LeadingTriad(options) && !options.IsBodyKnown();
  return SensitivityBasis(
      model, is_triangular, is_triangular ? LeadingAxisMap(options) : NearestAxisMap(start));
}

// Basis matrices of the temperature terms of a triad's sensitivity.
std::vector<Eigen::Matrix3d> FreeThermalMatrices(const CalibrateOptions& options,
                                                 Triad triad,
                                                 const Eigen::Matrix3d& start) {
  switch (options.triads[triad].thermal.matrix) {
    case ThermalMatrix::kFull:
      return FreeMatrices(options, triad, MatrixModel::kFull, start);
    case ThermalMatrix::kDiagonal:
      return FreeMatrices(options, triad, MatrixModel::kDiagonal, start);
    case ThermalMatrix::kScale:
      break;
  }
  // One term changes all gains in the proportions of the start's gains, so that the model stays
  // linear. If a start gain has an error, the term on this axis is wrong by the same share only.
  const Eigen::Matrix3d gains = start.rowwise().norm().asDiagonal() * NearestAxisMap(start);
  return {gains / gains.norm()};
}

// Scales temperatures so that those of the poses and the reference lie in [-1, 1], and rates so
// that the fastest is 1. Far outside of this range, rounding errors dominate a polynomial.
ThermalScale ScaleOf(const std::vector<PoseNode>& nodes, double reference_degc) {
  ThermalScale scale;
  scale.reference_degc = reference_degc;
  double low = reference_degc;
  double high = reference_degc;
  double fastest = 0.0;
  for (const PoseNode& node : nodes) {
    low = std::min(low, node.temperature_degc);
    high = std::max(high, node.temperature_degc);
    fastest = std::max(fastest, std::abs(node.temperature_rate_degcps));
  }
  scale.centre_degc = 0.5 * (low + high);
  // If the temperature is constant, no term is determined, and any scale will do.
  if (high > low) scale.half_range_degc = 0.5 * (high - low);
  if (fastest > 0.0) scale.rate_degcps = fastest;
  return scale;
}

// Transforms attitudes from the fixture's frame into the level frame that the start values define.
void LevelAttitudes(const Eigen::Quaterniond& level_from_fixture, std::vector<PoseNode>* nodes) {
  for (PoseNode& node : *nodes) {
    if (node.role != PoseRole::kRest || node.kind == PoseKind::kDirection) continue;
    const Eigen::Quaterniond q = level_from_fixture * node.rotation();
    node.state = {q.x(), q.y(), q.z(), q.w()};
    node.prior_world_from_body = level_from_fixture * node.prior_world_from_body;
  }
}

// The blocks of a triad's session biases, beginning at index `at`; no blocks if the sessions share
// one bias.
SessionBlock SessionsOf(const CalibrateOptions& options,
                        const std::vector<PoseNode>& nodes,
                        Triad triad,
                        int at) {
  SessionBlock sessions;
  if (!options.HasSessionBias(triad) || options.triads[triad].fixed_bias) return sessions;
  std::set<int> seen;
  for (const PoseNode& node : nodes) {
    for (const Observation& observation : node.observations) {
      if (observation.triad == triad) seen.insert(node.session);
    }
  }
  if (seen.size() < 2) return sessions;
  sessions.at = at;
  sessions.places.assign(static_cast<std::size_t>(*seen.rbegin()) + 1, -1);
  for (const int session : seen)
    sessions.places[static_cast<std::size_t>(session)] = sessions.seen++;
  return sessions;
}

// Assigns each parameter its place in the shared vector.
SharedLayout PlacesOf(const CalibrateOptions& options, const std::vector<PoseNode>& nodes) {
  SharedLayout layout;
  int size = 0;
  for (const Triad triad : kTriads) {
    const TriadOptions& sensor = options.triads[triad];
    if (!sensor.enabled) continue;
    layout.bias[triad] = size;
    layout.sensitivity[triad] = size + 3;
    layout.thermal[triad] = {size + 12, sensor.thermal};
    size += 12 + layout.thermal[triad].size();
    layout.sessions[triad] = SessionsOf(options, nodes, triad, size);
    size += layout.sessions[triad].size();
    for (const AxisTermInfo& info : kAxisTerms) {
      if (sensor.axis_terms[info.term] != Wanted::kYes) continue;
      layout.axis_terms[triad].push_back({info.term, size});
      size += 3;
    }
  }
  const TriadOptions& gyroscope = options.triads[Triad::kGyroscope];
  if (gyroscope.enabled && gyroscope.g_sensitivity == Wanted::kYes) {
    layout.g_sensitivity = size;
    size += 9;
  }
  layout.reference = size;
  size += kReferenceSize;
  for (const PoseNode& node : nodes) {
    if (node.face < 0 || layout.face_tilt[static_cast<std::size_t>(node.face)] >= 0) continue;
    layout.face_tilt[static_cast<std::size_t>(node.face)] = size;
    size += 2;
  }
  layout.size = size;
  return layout;
}

// The directions in which the parameters may change.
class FreeColumns {
 public:
  explicit FreeColumns(int size) : size_(size) {}

  void Entries(int at, int count) {
    for (int i = 0; i < count; ++i) columns_.push_back(Eigen::VectorXd::Unit(size_, at + i));
  }
  // Frees the matrix at `at` in each of the `directions`.
  void Matrices(int at, const std::vector<Eigen::Matrix3d>& directions) {
    for (const Eigen::Matrix3d& direction : directions) {
      Eigen::VectorXd& column = columns_.emplace_back(Eigen::VectorXd::Zero(size_));
      column.segment<9>(at) = direction.reshaped();
    }
  }
  Eigen::MatrixXd Basis() const {
    Eigen::MatrixXd basis(size_, static_cast<Eigen::Index>(columns_.size()));
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      basis.col(static_cast<Eigen::Index>(i)) = columns_[i];
    }
    return basis;
  }

 private:
  int size_;
  std::vector<Eigen::VectorXd> columns_;
};

// The projection of `matrix` on the span of the orthonormal `basis`.
Eigen::Matrix3d PartIn(const std::vector<Eigen::Matrix3d>& basis, const Eigen::Matrix3d& matrix) {
  Eigen::Matrix3d part = Eigen::Matrix3d::Zero();
  for (const Eigen::Matrix3d& direction : basis) {
    part += direction.cwiseProduct(matrix).sum() * direction;
  }
  return part;
}

// Frees the wanted parameters of the triad. Writes the start's sensitivity to `shared`, projected
// on the free matrices, since a part outside of these would never change.
void FreeTriad(const CalibrateOptions& options,
               const SharedLayout& layout,
               Triad triad,
               const Eigen::Matrix3d& start,
               Eigen::VectorXd* shared,
               FreeColumns* free) {
  const TriadOptions& sensor = options.triads[triad];
  if (!sensor.fixed_bias) free->Entries(layout.bias[triad], 3);
  free->Entries(layout.sessions[triad].at, layout.sessions[triad].size());
  const ThermalBlock& thermal = layout.thermal[triad];
  free->Entries(thermal.at, 3 * thermal.vector_count());
  for (int i = 0; i < thermal.terms.matrix_order; ++i) {
    free->Matrices(thermal.matrix_at(i), FreeThermalMatrices(options, triad, start));
  }
  for (const auto& [term, at] : layout.axis_terms[triad]) free->Entries(at, 3);
  if (triad == Triad::kGyroscope && layout.g_sensitivity >= 0) {
    free->Entries(layout.g_sensitivity, 9);
  }
  Eigen::Map<Eigen::Matrix3d> sensitivity(&(*shared)[layout.sensitivity[triad]]);
  sensitivity = start;
  if (sensor.fixed_sensitivity || sensor.model == MatrixModel::kBias) return;
  const auto basis = FreeMatrices(options, triad, sensor.model, start);
  sensitivity = PartIn(basis, start);
  free->Matrices(layout.sensitivity[triad], basis);
}

void FreeReference(const CalibrateOptions& options, const SharedLayout& layout, FreeColumns* free) {
  const auto has = [&options](Triad triad) { return options.triads[triad].enabled; };
  const ReferenceOptions& reference = options.reference;
  const bool is_attitude_given = options.attitudes.kind == AttitudeKind::kGiven;
  const int at = layout.reference;
  if (has(Triad::kAccelerometer) && reference.gravity_mps2.sigma > 0.0) {
    free->Entries(at + kGravity, 1);
  }
  if (has(Triad::kMagnetometer)) {
    const bool matrix_held = options.triads[Triad::kMagnetometer].fixed_sensitivity.has_value();
    const bool field_free =
        reference.field_ut.known() ? reference.field_ut.sigma > 0.0 : matrix_held;
    if (field_free) free->Entries(at + kField, 1);
    // A magnetometer alone determines neither dip nor heading.
    const bool sees_dip = has(Triad::kAccelerometer) || is_attitude_given;
    const bool dip_known = reference.dip_rad.known() && reference.dip_rad.sigma == 0.0;
    if (sees_dip && !dip_known) free->Entries(at + kDip, 1);
  }
  // Without a magnetometer the gyroscope determines north, if its noise is low enough.
  const bool finds_north = reference.earth_rate && has(Triad::kGyroscope);
  if (is_attitude_given && (has(Triad::kMagnetometer) || finds_north)) {
    free->Entries(at + kHeading, 1);
  }
  if (options.attitudes.unknown_fixture_rotation) free->Entries(at + kFixtureTilt, 2);
}

// At rest a gyroscope reads its bias. The start value of each session's bias is therefore the
// median of the session's readings.
void StartGyroscopeSessions(PoseGraph* graph) {
  const SharedLayout& layout = graph->layout;
  const SessionBlock& sessions = layout.sessions[Triad::kGyroscope];
  if (sessions.block_count() == 0) return;
  const auto count = static_cast<std::size_t>(sessions.seen);
  std::vector<std::array<std::vector<double>, 3>> readings(count);
  for (const PoseNode& node : graph->nodes) {
    if (node.role != PoseRole::kRest) continue;
    for (const Observation& seen : node.observations) {
      if (seen.triad != Triad::kGyroscope) continue;
      const int place = sessions.places[static_cast<std::size_t>(node.session)];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        readings[static_cast<std::size_t>(place)][axis].push_back(
            seen.mean_raw[static_cast<Eigen::Index>(axis)]);
      }
    }
  }
  Eigen::Matrix3Xd bias(3, sessions.seen);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (readings[k][axis].empty()) return;
      bias(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(k)) =
          Median(readings[k][axis]);
    }
  }
  const Eigen::Vector3d mean = bias.rowwise().mean();
  graph->shared.segment<3>(layout.bias[Triad::kGyroscope]) = mean;
  for (int i = 0; i < sessions.block_count(); ++i) {
    graph->shared.segment<3>(sessions.block_at(i)) = bias.col(i) - mean;
  }
}

}  // namespace

Triad LeadingTriad(const CalibrateOptions& options) {
  if (options.HasGyroscopeAlone()) return Triad::kGyroscope;
  return options.triads[Triad::kAccelerometer].enabled ? Triad::kAccelerometer
                                                       : Triad::kMagnetometer;
}

double LeadingAxisSign(const CalibrateOptions& options) {
  const TriadOptions& accelerometer = options.triads[Triad::kAccelerometer];
  return accelerometer.enabled && accelerometer.sign == AccelerometerSign::kGravity ? -1.0 : 1.0;
}

Eigen::Matrix3d LeadingAxisMap(const CalibrateOptions& options) {
  if (options.IsBodyKnown()) return Eigen::Matrix3d::Identity();
  return options.triads[LeadingTriad(options)].mounting.value_or(Eigen::Matrix3d::Identity());
}

Eigen::Matrix3d LeadingGaugeRotation(const CalibrateOptions& options,
                                     Gauge gauge,
                                     const Eigen::Matrix3d& sensitivity) {
  const Eigen::Matrix3d map = LeadingAxisMap(options);
  const Eigen::Matrix3d by_sensing_axes = sensitivity * map.transpose();
  return map.transpose() * GaugeRotation(gauge, by_sensing_axes, LeadingAxisSign(options)) * map;
}

void LayOutParameters(const CalibrateOptions& options, const StartValues& start, PoseGraph* graph) {
  graph->solver = options.solver;
  graph->layout = PlacesOf(options, graph->nodes);
  SharedLayout& layout = graph->layout;
  layout.thermal_scale = ScaleOf(graph->nodes, options.reference.temperature_degc);
  if (options.reference.earth_rate && options.triads[Triad::kGyroscope].enabled) {
    const EarthRateOptions& earth = *options.reference.earth_rate;
    layout.earth_rate_radps = EarthRateInWorld(earth.latitude_rad, earth.declination_rad);
  }

  graph->shared = Eigen::VectorXd::Zero(layout.size);
  graph->shared.segment<kReferenceSize>(layout.reference) = start.reference;
  FreeColumns free(layout.size);
  for (const Triad triad : kTriads) {
    if (!options.triads[triad].enabled) continue;
    const TriadModel<double>& model = *start.models[triad];
    graph->shared.segment<3>(layout.bias[triad]) =
        options.triads[triad].fixed_bias.value_or(model.bias);
    FreeTriad(options, layout, triad, model.sensitivity, &graph->shared, &free);
  }
  StartGyroscopeSessions(graph);
  FreeReference(options, layout, &free);
  if (options.attitudes.unknown_fixture_rotation) {
    graph->level_from_fixture = start.level_from_fixture;
    LevelAttitudes(start.level_from_fixture, &graph->nodes);
  }
  for (const int tilt : layout.face_tilt) {
    if (tilt >= 0) free.Entries(tilt, 2);
  }
  layout.basis = free.Basis();
  SetStartAttitudes(start, graph);
}

void AddPriors(const CalibrateOptions& options, PoseGraph* graph) {
  graph->priors.clear();
  const SharedLayout& layout = graph->layout;
  const auto add = [graph, &layout](int index, double mean, double sigma) {
    if (!std::isfinite(sigma) || sigma <= 0.0 || !layout.IsFree(index)) return;
    graph->priors.push_back({index, mean, sigma});
  };
  for (const Triad triad : kTriads) {
    if (!options.triads[triad].enabled || !options.triads[triad].prior) continue;
    const TriadPrior& prior = *options.triads[triad].prior;
    for (int i = 0; i < 3; ++i) {
      add(layout.bias[triad] + i, prior.bias[i], prior.bias_sigma[i]);
    }
    for (int i = 0; i < 9; ++i) {
      add(layout.sensitivity[triad] + i,
          prior.sensitivity.reshaped()[i],
          prior.sensitivity_sigma.reshaped()[i]);
    }
  }
  const ReferenceOptions& reference = options.reference;
  const auto add_reference = [&](int at, const Knowledge& knowledge) {
    if (knowledge.known()) add(layout.reference + at, *knowledge.value, knowledge.sigma);
  };
  add_reference(kGravity, reference.gravity_mps2);
  add_reference(kField, reference.field_ut);
  add_reference(kDip, reference.dip_rad);
  for (const int tilt : layout.face_tilt) {
    if (tilt < 0) continue;
    add(tilt, 0.0, options.attitudes.tilt_sigma_deg * kRadPerDeg);
    add(tilt + 1, 0.0, options.attitudes.tilt_sigma_deg * kRadPerDeg);
  }
}

}  // namespace truetriad
