// SPDX-License-Identifier: Apache-2.0
#include "truetriad/estimation/calibrate.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <utility>

#include <glog/logging.h>

#include "estimation/graph.h"
#include "estimation/noise.h"
#include "estimation/observability.h"
#include "estimation/presentation.h"
#include "estimation/quality.h"
#include "estimation/reduced_system.h"
#include "estimation/start.h"
#include "truetriad/math/distributions.h"

namespace truetriad {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr int kMaxNoiseRounds = 15;
constexpr int kReadmittingRounds = 5;
// Mean change of the weights below which they have settled.
constexpr double kSettledWeight = 1e-3;
// Share of false alarms, over all poses and sensors of a run, at which a pose is left out.
constexpr double kRejectionLevel = 0.01;
// A rejected observation keeps this weight: nothing against the rest (an error of 1000 σ moves the
// fit by 1e-5 σ), but its pose stays determined.
constexpr double kRejectedWeight = 1e-8;
// Fewer residual degrees of freedom than this cannot tell a bad pose from a good one.
constexpr int kMinRobustDof = 6;
// An estimated excess with fewer degrees of freedom than this is not an estimate.
constexpr double kLeastExcessDof = 0.5;
// Below this the noise level itself is hardly known. model.md §2.
constexpr double kFewDof = 10.0;
// A fit whose residual is this share of the field does not explain the data.
constexpr double kExplainedShare = 0.1;
// A cap this wide without a pose is half of the sphere.
constexpr double kOneSidedGapDeg = 90.0;
// A magnetometer's gain this far from its unit is worth a word; normalised fields are used, too.
constexpr double kOddGain = 5.0;
// The seat of a six-face rest is never exact: a zero sigma is this.
constexpr double kSmallestSeatRad = 1e-7;
// Numerical floor of an estimated noise, as a share of the field strength.
constexpr double kNoiseFloorShare = 1e-12;

std::string Format(const char* format, double value) {
  char text[256];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// One run of the estimator: the graph and what is known about its noise.
class Estimator {
 public:
  Estimator(const PoseSet& poses, const CalibrateOptions& options)
      : poses_(poses), options_(options) {}

  Result<CalibrationSummary> Run();

 private:
  bool Wants(Triad triad) const { return options_.triads[triad].enabled; }
  Triad leading() const {
    return Wants(Triad::kAccelerometer) ? Triad::kAccelerometer : Triad::kMagnetometer;
  }
  double axis_sign() const {
    return Wants(Triad::kAccelerometer) &&
                   options_.triads[Triad::kAccelerometer].sign == AccelerometerSign::kGravity
               ? -1.0
               : 1.0;
  }

  void ChooseNoise();
  Status BuildNodes();
  void BuildLayout(const StartValues& start);
  void BuildPriors();
  bool SolveFromBestStart(const std::vector<StartValues>& starts);

  // The robust step, the excess noise and the solution, in turn until nothing changes.
  void SettleNoise();
  void SettleHemisphere();
  void GuessExcessFromMedians();
  ExcessVariance ExcessFloor() const;
  void DropExcessThatIsNotSeen();
  bool UpdateWeights(bool may_readmit);
  double ResidualDof(const ReducedSystem& system) const;

  CalibrationSummary Refuse(Outcome outcome, const std::string& message);
  CalibrationSummary StateStart(const StartValues& start);
  Status Finish();
  void StateSensors(const PresentedSolution& solution);
  void Say(std::string message) { summary_.calibration.messages.push_back(std::move(message)); }
  void Solve(double tolerance) {
    const SolveOutcome outcome = SolveGraph(&graph_, tolerance);
    VLOG(1) << outcome.iterations << " iterations, cost " << outcome.initial_cost << " -> "
            << outcome.final_cost;
    if (summary_.initial_cost < 0.0) summary_.initial_cost = outcome.initial_cost;
    summary_.iterations += outcome.iterations;
    summary_.final_cost = outcome.final_cost;
    converged_ = outcome.converged;
  }

  const PoseSet& poses_;
  const CalibrateOptions& options_;
  PoseGraph graph_;
  std::vector<Triad> estimated_;  // triads whose excess is estimated
  ExcessVariance excess_{};
  ExcessEstimate excess_estimate_;
  PerTriad<NoiseSource> source_{};
  bool field_nominal_ = false;
  bool robust_ = false;
  bool noise_unknown_ = false;  // residuals were to show it, and there are none
  bool converged_ = false;
  CalibrationSummary summary_;
};

CalibrationSummary Estimator::Refuse(Outcome outcome, const std::string& message) {
  summary_.calibration.outcome = outcome;
  Say(message);
  return summary_;
}

// Where each triad's rest noise comes from, and whether its excess is estimated.
void Estimator::ChooseNoise() {
  for (const Triad triad : kTriads) {
    if (!Wants(triad)) continue;
    const TriadOptions& sensor = options_.triads[triad];
    int seen = 0;
    int with_covariance = 0;
    for (const StaticPose& pose : poses_.poses) {
      if (!pose.triads[triad]) continue;
      ++seen;
      if (pose.triads[triad]->has_covariance) ++with_covariance;
    }
    const bool all_have_covariance = with_covariance == seen;
    if (!all_have_covariance && with_covariance > 0 && !sensor.noise_sigma_raw) {
      Say(std::string(TriadName(triad)) + ": " + std::to_string(seen - with_covariance) + " of " +
          std::to_string(seen) +
          " poses state no sigma; those of the others are not used, noise comes from the "
          "residuals");
    }
    if (sensor.noise_sigma_raw) {
      source_[triad] = sensor.noise_source;
    } else {
      source_[triad] = all_have_covariance ? NoiseSource::kStatic : NoiseSource::kResidual;
    }
    if (source_[triad] == NoiseSource::kResidual || sensor.excess == ExcessNoise::kEstimate) {
      estimated_.push_back(triad);
    } else if (sensor.excess == ExcessNoise::kGiven) {
      excess_[triad] = sensor.excess_sigma * sensor.excess_sigma;
    }
  }
}

Status Estimator::BuildNodes() {
  std::vector<int> faces(poses_.poses.size(), -1);
  if (options_.attitudes.kind == AttitudeKind::kSixFace) {
    auto found = FacesOfPoses(poses_, options_.triads[Triad::kAccelerometer].sign);
    if (!found) return found.error();
    faces = std::move(*found);
  }
  for (std::size_t k = 0; k < poses_.poses.size(); ++k) {
    const StaticPose& pose = poses_.poses[k];
    PoseNode node;
    node.number = pose.number;
    for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
      if (!Wants(triad) || !pose.triads[triad]) continue;
      Observation observation;
      observation.triad = triad;
      observation.mean_raw = pose.triads[triad]->mean_raw;
      if (options_.triads[triad].noise_sigma_raw) {
        observation.rest_covariance =
            options_.triads[triad].noise_sigma_raw->cwiseAbs2().asDiagonal();
      } else if (source_[triad] != NoiseSource::kResidual) {
        observation.rest_covariance = pose.triads[triad]->mean_covariance_raw;
      }
      node.observations.push_back(observation);
    }
    if (node.observations.empty()) continue;
    node.kind = node.observations.size() == 1 ? PoseKind::kDirection : PoseKind::kRotation;
    if (options_.attitudes.kind == AttitudeKind::kGiven) {
      if (!pose.attitude) {
        return BadInputError(poses_.source + ": pose " + std::to_string(pose.number) +
                             " has no known attitude; every pose needs one with `attitudes: "
                             "{file: …}`");
      }
      const Eigen::Quaterniond& q = pose.attitude->world_from_body;
      node.state = {q.x(), q.y(), q.z(), q.w()};
      if (pose.attitude->sigma_rad.maxCoeff() > 0.0) {
        node.kind = PoseKind::kRotation;
        node.has_attitude_prior = true;
        node.prior_world_from_body = q;
        node.prior_sigma_rad = pose.attitude->sigma_rad;
      } else {
        node.kind = PoseKind::kHeld;
      }
    }
    // The face is known from what the accelerometer says; a pose without it carries no face.
    if (faces[k] >= 0 && node.observations.front().triad == Triad::kAccelerometer) {
      node.face = faces[k];
      node.seat_sigma_rad =
          std::max(options_.attitudes.seat_sigma_deg * kRadPerDeg, kSmallestSeatRad);
    }
    graph_.nodes.push_back(node);
  }
  return {};
}

// Offsets of the blocks, start values in the vector, and the basis of what is free.
void Estimator::BuildLayout(const StartValues& start) {
  SharedLayout& layout = graph_.layout;
  layout = SharedLayout{};
  int size = 0;
  for (const Triad triad : kTriads) {
    if (!Wants(triad)) continue;
    layout.bias[triad] = size;
    layout.sensitivity[triad] = size + 3;
    size += 12;
  }
  layout.reference = size;
  size += kReferenceSize;
  for (const PoseNode& node : graph_.nodes) {
    if (node.face < 0 || layout.face_tilt[static_cast<std::size_t>(node.face)] >= 0) continue;
    layout.face_tilt[static_cast<std::size_t>(node.face)] = size;
    size += 2;
  }
  layout.size = size;

  graph_.shared = Eigen::VectorXd::Zero(size);
  std::vector<Eigen::VectorXd> columns;
  const auto free_entry = [&columns, size](int index) {
    columns.push_back(Eigen::VectorXd::Unit(size, index));
  };
  const bool fixture = options_.attitudes.kind != AttitudeKind::kNone;
  for (const Triad triad : kTriads) {
    if (!Wants(triad)) continue;
    const TriadOptions& sensor = options_.triads[triad];
    const TriadModel<double>& model = *start.models[triad];
    graph_.shared.segment<3>(layout.bias[triad]) = sensor.fixed_bias.value_or(model.bias);
    Eigen::Map<Eigen::Matrix3d>(&graph_.shared[layout.sensitivity[triad]]) = model.sensitivity;
    if (!sensor.fixed_bias) {
      for (int i = 0; i < 3; ++i) free_entry(layout.bias[triad] + i);
    }
    if (sensor.fixed_sensitivity) continue;
    const bool triangular = triad == leading() && !fixture;
    const Eigen::Matrix3d axis_map =
        triad == leading() ? Eigen::Matrix3d::Identity() : NearestAxisMap(model.sensitivity);
    for (const Eigen::Matrix3d& entry : SensitivityBasis(sensor.model, triangular, axis_map)) {
      Eigen::VectorXd column = Eigen::VectorXd::Zero(size);
      column.segment<9>(layout.sensitivity[triad]) = entry.reshaped();
      columns.push_back(column);
    }
  }

  graph_.shared.segment<4>(layout.reference) = start.reference;
  const ReferenceOptions& reference = options_.reference;
  if (Wants(Triad::kAccelerometer) && reference.gravity_mps2.sigma > 0.0) {
    free_entry(layout.reference + kGravity);
  }
  if (Wants(Triad::kMagnetometer)) {
    const bool matrix_held = options_.triads[Triad::kMagnetometer].fixed_sensitivity.has_value();
    const bool field_free =
        reference.field_ut.known() ? reference.field_ut.sigma > 0.0 : matrix_held;
    field_nominal_ = start.field_nominal && !field_free;
    if (field_free) free_entry(layout.reference + kField);
    // A magnetometer alone sees neither dip nor heading.
    const bool sees_dip =
        Wants(Triad::kAccelerometer) || options_.attitudes.kind == AttitudeKind::kGiven;
    if (sees_dip && !(reference.dip_rad.known() && reference.dip_rad.sigma == 0.0)) {
      free_entry(layout.reference + kDip);
    }
    if (options_.attitudes.kind == AttitudeKind::kGiven) free_entry(layout.reference + kHeading);
  }
  for (const int tilt : layout.face_tilt) {
    if (tilt < 0) continue;
    free_entry(tilt);
    free_entry(tilt + 1);
  }
  layout.basis.resize(size, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    layout.basis.col(static_cast<Eigen::Index>(i)) = columns[i];
  }
}

void Estimator::BuildPriors() {
  graph_.priors.clear();
  const SharedLayout& layout = graph_.layout;
  const auto add = [this, &layout](int index, double mean, double sigma) {
    if (!std::isfinite(sigma) || sigma <= 0.0) return;
    if (layout.basis.row(index).isZero(0.0)) return;
    graph_.priors.push_back({index, mean, sigma});
  };
  for (const Triad triad : kTriads) {
    if (!Wants(triad) || !options_.triads[triad].prior) continue;
    const TriadPrior& prior = *options_.triads[triad].prior;
    for (int i = 0; i < 3; ++i) {
      add(layout.bias[triad] + i, prior.bias[i], prior.bias_sigma[i]);
    }
    for (int i = 0; i < 9; ++i) {
      add(layout.sensitivity[triad] + i,
          prior.sensitivity.reshaped()[i],
          prior.sensitivity_sigma.reshaped()[i]);
    }
  }
  const ReferenceOptions& reference = options_.reference;
  const auto add_reference = [&](int at, const Knowledge& knowledge) {
    if (knowledge.known()) add(layout.reference + at, *knowledge.value, knowledge.sigma);
  };
  add_reference(kGravity, reference.gravity_mps2);
  add_reference(kField, reference.field_ut);
  add_reference(kDip, reference.dip_rad);
  for (const int tilt : layout.face_tilt) {
    if (tilt < 0) continue;
    add(tilt, 0.0, options_.attitudes.tilt_sigma_deg * kRadPerDeg);
    add(tilt + 1, 0.0, options_.attitudes.tilt_sigma_deg * kRadPerDeg);
  }
}

// How badly the poses fit, few of them counting little however far off they are: the sum over all
// deletion tests of log(1 + χ² / dof), the cost of a Cauchy distribution.
double RobustMisfit(const PoseGraph& graph) {
  const ReducedSystem system(graph);
  double misfit = 0.0;
  for (const DeletionTest& test : DeletionTests(graph, system)) {
    if (test.rank > 0) misfit += std::log1p(test.chi2 / test.rank);
  }
  return misfit;
}

// Rival starts (a magnetometer's rotation may have several) are all refined; the best fit wins, by
// a measure that three poses beside a magnet do not decide.
bool Estimator::SolveFromBestStart(const std::vector<StartValues>& starts) {
  PoseGraph best;
  double best_misfit = std::numeric_limits<double>::infinity();
  const std::vector<PoseNode> nodes = graph_.nodes;
  for (const StartValues& start : starts) {
    graph_.nodes = nodes;
    BuildLayout(start);
    BuildPriors();
    SetStartAttitudes(start, &graph_);
    for (const Triad triad : estimated_) {
      // Before anything is known of the excess: a thousandth of the field keeps triads without
      // rest noise balanced against each other.
      if (source_[triad] != NoiseSource::kResidual) continue;
      const double sigma = 1e-3 * WorldVector(triad, graph_.reference()).norm();
      excess_[triad] = sigma * sigma;
    }
    ApplyExcess(excess_, &graph_);
    Solve(kRoundTolerance);
    if (!std::isfinite(summary_.final_cost)) continue;
    const double misfit = starts.size() > 1 ? RobustMisfit(graph_) : 0.0;
    if (misfit < best_misfit) {
      best_misfit = misfit;
      best = graph_;
    }
  }
  if (!std::isfinite(best_misfit)) return false;
  graph_ = std::move(best);
  return true;
}

double Estimator::ResidualDof(const ReducedSystem& system) const {
  double dof = static_cast<double>(graph_.priors.size()) - system.rank();
  for (const PoseNode& node : graph_.nodes) {
    dof += node.row_count() - node.tangent_size();
    for (const Observation& observation : node.observations) {
      if (!observation.rejected) continue;
      // A rejected triad takes its rows along; a rotation that loses it keeps only a direction.
      dof -= node.kind == PoseKind::kRotation && !node.has_attitude_prior ? 2 : 3;
      if (node.kind == PoseKind::kDirection) dof += 2;
    }
  }
  return dof;
}

// Without rest noise the excess is all the noise there is, and exact data would drive it to zero.
ExcessVariance Estimator::ExcessFloor() const {
  ExcessVariance floor{};
  for (const Triad triad : estimated_) {
    if (source_[triad] != NoiseSource::kResidual) continue;
    const double sigma = kNoiseFloorShare * WorldVector(triad, graph_.reference()).norm();
    floor[triad] = sigma * sigma;
  }
  return floor;
}

// Residuals that other unknowns can explain as well (the tilt of a six-face block, say) hold no
// information on the excess: its estimate would be noise, and so would every σ made from it.
void Estimator::DropExcessThatIsNotSeen() {
  std::vector<Triad> seen;
  for (const Triad triad : estimated_) {
    const double dof = ExcessDegreesOfFreedom(excess_estimate_, graph_, triad);
    if (dof >= kLeastExcessDof || source_[triad] == NoiseSource::kResidual) {
      seen.push_back(triad);
      continue;
    }
    excess_[triad] = 0.0;
    Say(std::string(TriadName(triad)) +
        ": these poses hold no information on pose-to-pose noise; σ rests on the noise inside "
        "rests alone (state `noise: { excess: { sigma: … } }` if you know it)");
  }
  if (seen.size() == estimated_.size()) return;
  estimated_ = std::move(seen);
  ApplyExcess(excess_, &graph_);
  excess_estimate_ = ExcessEstimate{};
  if (!estimated_.empty()) {
    ReducedSystem system(graph_);
    excess_estimate_ = EstimateExcess(estimated_, excess_, ExcessFloor(), &graph_, &system);
    excess_ = excess_estimate_.variance;
  }
}

// First guess of each excess: what makes the median deletion test match its χ². Half of the poses
// may be disturbed without moving it much.
void Estimator::GuessExcessFromMedians() {
  const ReducedSystem system(graph_);
  const std::vector<DeletionTest> tests = DeletionTests(graph_, system);
  for (const Triad triad : estimated_) {
    std::vector<double> ratios;
    const Eigen::Matrix3d correction = graph_.sensitivity(triad).inverse();
    double rest = 0.0;
    for (const DeletionTest& test : tests) {
      const Observation& observation = graph_.nodes[test.node].observations[test.observation];
      if (observation.triad != triad || test.rank == 0) continue;
      ratios.push_back(test.chi2 / ChiSquareQuantile(0.5, test.rank));
      rest += (correction * observation.rest_covariance * correction.transpose()).trace() / 3.0;
    }
    if (ratios.empty()) continue;
    rest /= static_cast<double>(ratios.size());
    excess_[triad] =
        std::max(Median(ratios) * (rest + excess_[triad]) - rest, ExcessFloor()[triad]);
  }
  ApplyExcess(excess_, &graph_);
}

// Huber weights from the deletion tests; observations whose test cannot be chance are rejected.
// Returns whether the rejected set or a weight changed notably. `may_readmit`: a rejected
// observation whose test has become good again returns.
bool Estimator::UpdateWeights(bool may_readmit) {
  const ReducedSystem system(graph_);
  const std::vector<DeletionTest> tests = DeletionTests(graph_, system);
  const double level =
      kRejectionLevel / static_cast<double>(std::max<std::size_t>(tests.size(), 1));
  // A weight that starts at `scale` normal σ must start at the same probability for any rank.
  std::array<double, 4> huber_limit{};
  // A scale whose tail a double cannot hold is as good as no loss at all.
  const double inside =
      std::min(ChiSquareCdf(options_.robust.scale * options_.robust.scale, 1.0), 1.0 - 1e-12);
  for (int rank = 1; rank <= 3 && inside > 0.0; ++rank) {
    huber_limit[static_cast<std::size_t>(rank)] = std::sqrt(ChiSquareQuantile(inside, rank));
  }
  PerTriad<double> dof{{std::numeric_limits<double>::infinity(),
                        std::numeric_limits<double>::infinity(),
                        std::numeric_limits<double>::infinity()}};
  for (const Triad triad : estimated_) {
    if (!excess_estimate_.triads.empty()) {
      const double found = ExcessDegreesOfFreedom(excess_estimate_, graph_, triad);
      dof[triad] = found > 1.0 ? found : 1.0;
    }
  }

  bool changed = false;
  double moved = 0.0;
  std::size_t t = 0;
  for (std::size_t k = 0; k < graph_.nodes.size(); ++k) {
    PoseNode& node = graph_.nodes[k];
    const std::size_t first = t;
    // At one pose the triads share the blame for their disagreement: only the worst goes, and the
    // others are judged again without it.
    std::size_t worst = first;
    double worst_ratio = -1.0;
    bool has_rejected = false;
    for (; t < tests.size() && tests[t].node == k; ++t) {
      has_rejected = has_rejected || node.observations[tests[t].observation].rejected;
      const double ratio = tests[t].rank > 0 ? tests[t].chi2 / tests[t].rank : 0.0;
      if (ratio > worst_ratio) {
        worst_ratio = ratio;
        worst = t;
      }
    }
    for (std::size_t i = first; i < t; ++i) {
      Observation& observation = node.observations[tests[i].observation];
      double weight = 1.0;
      bool rejected = false;
      if (tests[i].rank > 0) {
        const double z = std::sqrt(tests[i].chi2);
        const double limit = huber_limit[static_cast<std::size_t>(tests[i].rank)];
        if (z > limit) weight = limit / z;
        const double nu = dof[observation.triad];
        const double p = std::isfinite(nu)
                             ? 1.0 - FisherCdf(tests[i].chi2 / tests[i].rank, tests[i].rank, nu)
                             : 1.0 - ChiSquareCdf(tests[i].chi2, tests[i].rank);
        rejected = p < level && (observation.rejected || (!has_rejected && i == worst));
      } else {
        rejected = observation.rejected;
      }
      rejected = rejected || (observation.rejected && !may_readmit);
      if (rejected) weight = kRejectedWeight;
      changed = changed || rejected != observation.rejected;
      moved += std::abs(weight - observation.weight);
      observation.rejected = rejected;
      observation.weight = weight;
    }
  }
  return changed || moved > kSettledWeight * static_cast<double>(tests.size());
}

void Estimator::SettleNoise() {
  const double dof = ResidualDof(ReducedSystem(graph_));
  robust_ = options_.robust.enabled && dof >= kMinRobustDof;
  if (options_.robust.enabled && !robust_) {
    Say("few residual degrees of freedom (" + Format("%.0f", dof) +
        "): a disturbed pose could not be told from a good one, none was looked for");
  }
  if (dof < 1.0) {
    if (!estimated_.empty()) {
      Say("no residual degrees of freedom: pose-to-pose noise could not be estimated, σ rests on "
          "the noise inside rests alone");
    }
    for (const Triad triad : estimated_) {
      noise_unknown_ = noise_unknown_ || source_[triad] == NoiseSource::kResidual;
      if (source_[triad] != NoiseSource::kResidual) excess_[triad] = 0.0;
    }
    estimated_.clear();
  }
  if (!robust_ && estimated_.empty()) {
    ApplyExcess(excess_, &graph_);
    Solve(kFinalTolerance);
    return;
  }
  if (robust_) GuessExcessFromMedians();
  for (int round = 0; round < kMaxNoiseRounds; ++round) {
    ++summary_.rounds;
    // Late in the day borderline observations could come and go for ever.
    const bool weights_changed = robust_ && UpdateWeights(round < kReadmittingRounds);
    Solve(kRoundTolerance);
    // A direction that nothing determines: more rounds would only creep along it.
    if (!converged_) return;
    const ExcessVariance before = excess_;
    if (!estimated_.empty()) {
      ReducedSystem system(graph_);
      excess_estimate_ = EstimateExcess(estimated_, excess_, ExcessFloor(), &graph_, &system);
      excess_ = excess_estimate_.variance;
      DropExcessThatIsNotSeen();
    }
    bool excess_changed = false;
    for (const Triad triad : estimated_) {
      excess_changed =
          excess_changed || std::abs(excess_[triad] - before[triad]) > 1e-4 * excess_[triad];
    }
    if (!weights_changed && !excess_changed) break;
  }
  Solve(kFinalTolerance);
}

// (S_m, dip) and (-S_m, -dip) explain the same readings with every attitude turned half a turn
// about the vertical. A start spoilt by disturbed poses may have ended on the wrong side of the
// equator.
void Estimator::SettleHemisphere() {
  const SharedLayout& layout = graph_.layout;
  if (!Wants(Triad::kMagnetometer) || layout.basis.row(layout.reference + kDip).isZero(0.0) ||
      options_.reference.dip_rad.known() || options_.attitudes.kind == AttitudeKind::kGiven ||
      options_.triads[Triad::kMagnetometer].prior ||
      options_.triads[Triad::kMagnetometer].fixed_sensitivity) {
    return;
  }
  double& dip = graph_.shared[layout.reference + kDip];
  const bool north = dip > 0.0;
  if (std::abs(std::sin(dip)) < kEquatorSine || north == options_.reference.northern_hemisphere) {
    return;
  }
  dip = -dip;
  graph_.shared.segment<9>(layout.sensitivity[Triad::kMagnetometer]) *= -1.0;
  const Eigen::Quaterniond half_turn(0.0, 0.0, 0.0, 1.0);
  for (PoseNode& node : graph_.nodes) {
    if (node.kind == PoseKind::kRotation) {
      const Eigen::Quaterniond turned = half_turn * node.rotation();
      node.state = {turned.x(), turned.y(), turned.z(), turned.w()};
    } else if (node.observations.front().triad == Triad::kMagnetometer) {
      node.state = {-node.state[0], -node.state[1], -node.state[2], 0.0};
    }
  }
}

void Estimator::StateSensors(const PresentedSolution& solution) {
  Calibration& calibration = summary_.calibration;
  int at = 0;
  for (const Triad triad : kTriads) {
    if (!Wants(triad)) continue;
    TriadCalibration sensor;
    const StreamSummary* stream = poses_.Find(triad);
    sensor.input_unit = stream != nullptr ? stream->unit.name : "";
    sensor.output_unit = std::string(TruthUnitName(triad));
    sensor.model = *solution.models[triad];
    const Eigen::VectorXd variance = solution.covariance.matrix.diagonal().segment(at, 12);
    for (int i = 0; i < 3; ++i) {
      sensor.bias_sigma[i] = std::sqrt(std::max(variance[i], 0.0));
      for (int j = 0; j < 3; ++j) {
        sensor.sensitivity_sigma(i, j) = std::sqrt(std::max(variance[3 + 3 * i + j], 0.0));
      }
    }
    at += 12;
    // RMS over poses of each axis' σ.
    Eigen::Vector3d rest = Eigen::Vector3d::Zero();
    Eigen::Vector3d total = Eigen::Vector3d::Zero();
    int count = 0;
    for (const PoseNode& node : graph_.nodes) {
      for (const Observation& observation : node.observations) {
        if (observation.triad != triad || observation.rejected) continue;
        rest += observation.rest_covariance.diagonal();
        total += observation.variance.diagonal();
        ++count;
      }
    }
    sensor.noise.source = source_[triad];
    const bool residual = source_[triad] == NoiseSource::kResidual;
    sensor.noise.sigma = ((residual ? total : rest) / std::max(count, 1)).cwiseSqrt();
    sensor.noise.excess_sigma = residual ? 0.0 : std::sqrt(excess_[triad]);
    sensor.noise.excess_dof = ExcessDegreesOfFreedom(excess_estimate_, graph_, triad);
    calibration.sensors[triad] = sensor;
  }
}

CalibrationSummary Estimator::StateStart(const StartValues& start) {
  Calibration& calibration = summary_.calibration;
  BuildLayout(start);
  SetStartAttitudes(start, &graph_);
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Matrix3d Q =
      GaugeRotation(options_.gauge, start.models[leading()]->sensitivity, axis_sign());
  for (const Triad triad : kTriads) {
    if (!start.models[triad]) continue;
    TriadCalibration sensor;
    const StreamSummary* stream = poses_.Find(triad);
    sensor.input_unit = stream != nullptr ? stream->unit.name : "";
    sensor.output_unit = std::string(TruthUnitName(triad));
    sensor.model = {start.models[triad]->sensitivity * Q, start.models[triad]->bias};
    sensor.bias_sigma.setConstant(unknown);
    sensor.sensitivity_sigma.setConstant(unknown);
    sensor.noise.sigma.setConstant(unknown);
    sensor.noise.source = source_[triad];
    calibration.sensors[triad] = sensor;
    const double strength = WorldVector(triad, start.reference).norm();
    double sum = 0.0;
    int count = 0;
    for (const PoseNode& node : graph_.nodes) {
      for (const Observation& observation : node.observations) {
        if (observation.triad != triad) continue;
        const double error = NormError(sensor.model, observation.mean_raw, strength);
        sum += error * error;
        ++count;
      }
    }
    if (count > 0) calibration.quality.residual_rms[triad] = std::sqrt(sum / count);
  }
  calibration.reference.gravity_mps2 = start.reference[kGravity];
  if (Wants(Triad::kMagnetometer)) {
    calibration.reference.field_ut = start.reference[kField];
    calibration.reference.field_nominal = start.field_nominal;
    if (Wants(Triad::kAccelerometer)) calibration.reference.dip_rad = start.reference[kDip];
  }
  calibration.quality.poses = static_cast<int>(graph_.nodes.size());
  calibration.quality.reduced_chi2 = unknown;
  calibration.quality.reduced_chi2_before = unknown;
  calibration.outcome = Outcome::kConverged;
  Say("start values only, as asked: no refinement, no uncertainty");
  return summary_;
}

// Everything that is reported, from the settled graph.
Status Estimator::Finish() {
  Calibration& calibration = summary_.calibration;
  Quality& quality = calibration.quality;
  const ReducedSystem system(graph_);
  const double dof = ResidualDof(system);
  quality.poses = static_cast<int>(graph_.nodes.size());
  quality.dof = dof;
  const JointTest joint = KenwardRogerTest(excess_estimate_, system);
  quality.effective_dof = joint.dof;

  const Eigen::Vector4d reference = graph_.reference();
  calibration.reference.gravity_mps2 = reference[kGravity];
  if (options_.reference.gravity_mps2.sigma > 0.0) {
    calibration.reference.gravity_sigma_mps2 = options_.reference.gravity_mps2.sigma;
  }
  const auto is_free = [this](int at) {
    return !graph_.layout.basis.row(graph_.layout.reference + at).isZero(0.0);
  };
  if (Wants(Triad::kMagnetometer)) {
    calibration.reference.field_ut = reference[kField];
    calibration.reference.field_nominal = field_nominal_;
    calibration.reference.field_estimated = is_free(kField) || is_free(kDip);
    if (is_free(kDip) || options_.reference.dip_rad.known()) {
      calibration.reference.dip_rad = reference[kDip];
    }
  }

  Observability observability = AnalyseObservability(graph_, system, options_.observable_sigma);
  quality.weak_directions = std::move(observability.weak_directions);

  // The joint test's scale goes into the covariance, so that F(dim, ν) holds for it as printed.
  PresentedSolution solution =
      SolvedFrame(graph_, AdjustedCovariance(excess_estimate_, system) / joint.scale);
  StateInGauge(options_.gauge, leading(), axis_sign(), &solution);
  FillPoseQuality(graph_, solution, DeletionTests(graph_, system), poses_, &quality);
  for (const PoseNode& node : graph_.nodes) {
    for (const Observation& observation : node.observations) {
      if (!observation.rejected) continue;
      const auto at = std::find_if(
          quality.pose_residuals.begin(), quality.pose_residuals.end(), [&](const auto& residual) {
            return residual.pose == node.number && residual.triad == observation.triad;
          });
      quality.rejected_poses.push_back(
          {node.number,
           observation.triad,
           Format("disagrees with all other poses by %.1f times its noise", at->normalized)});
    }
  }

  // χ² of the residuals against the noise inside rests alone, and with everything.
  const auto reduced_chi2 = [dof](const ReducedSystem& reduced) {
    double sum = 0.0;
    for (const ReducedSystem::Pose& pose : reduced.poses()) {
      sum += (pose.residual + pose.J * reduced.step()).dot(pose.projected);
    }
    return sum / dof;
  };
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  quality.reduced_chi2 = dof >= 1.0 ? reduced_chi2(system) : unknown;
  quality.reduced_chi2_before = unknown;
  bool rests_known = dof >= 1.0;
  for (const Triad triad : kTriads) {
    rests_known = rests_known && !(Wants(triad) && source_[triad] == NoiseSource::kResidual);
  }
  if (rests_known) {
    PoseGraph rests = graph_;
    ApplyExcess(ExcessVariance{}, &rests);
    quality.reduced_chi2_before = reduced_chi2(ReducedSystem(rests));
  }

  // The verdict.
  if (!graph_.shared.allFinite() || !solution.covariance.matrix.allFinite() ||
      solution.covariance.matrix.diagonal().minCoeff() < 0.0) {
    quality = Quality{};
    quality.poses = static_cast<int>(graph_.nodes.size());
    calibration.outcome = Outcome::kNotConverged;
    Say("the numbers left the range that can be computed with; look for absurd readings, σ or held "
        "values");
    return {};
  }
  if (noise_unknown_) {
    calibration.outcome = Outcome::kNotEnough;
    Say("every residual is needed to determine the parameters, so the noise cannot be estimated; "
        "add poses, or state `noise: { sigma: [x, y, z] }`");
    return {};
  }
  for (const Triad triad : kTriads) {
    if (!Wants(triad) || !quality.residual_rms[triad]) continue;
    const double strength = WorldVector(triad, reference).norm();
    if (*quality.residual_rms[triad] > kExplainedShare * strength) {
      calibration.outcome = Outcome::kNotConverged;
      Say(std::string(TriadName(triad)) +
          Format(": after the fit the readings still scatter by %.0f %%",
                 100.0 * *quality.residual_rms[triad] / strength) +
          " of the field; these are not rests in one constant field");
      return {};
    }
  }
  // Before convergence: along a direction that is not determined the optimiser only creeps.
  if (!observability.determined || system.rank() < system.size()) {
    calibration.outcome = Outcome::kNotObservable;
    Say("the poses do not determine every wanted parameter; see the weak directions");
    return {};
  }
  if (!converged_) {
    calibration.outcome = Outcome::kNotConverged;
    Say("the optimiser did not converge: the readings do not fit the model from any start");
    return {};
  }
  calibration.outcome = Outcome::kConverged;
  calibration.covariance = solution.covariance;
  StateSensors(solution);
  quality.held_out = CrossValidate(graph_, options_.cross_validation_folds);

  if (!estimated_.empty() && quality.effective_dof < kFewDof) {
    Say(Format("σ rests on few (%.1f) degrees of freedom: use the stated interval factor, not 2 σ",
               quality.effective_dof));
  }
  if (calibration.sensors[Triad::kMagnetometer] && Wants(Triad::kAccelerometer) &&
      graph_.sensitivity(Triad::kMagnetometer).determinant() < 0.0) {
    Say("the magnetometer's axes came out left-handed (determinant < 0); a wrong accelerometer "
        "`sign` or `hemisphere` would explain the data as well");
  }
  for (const Coverage& coverage : quality.coverage) {
    if (coverage.largest_gap_deg < kOneSidedGapDeg) continue;
    Say(std::string(TriadName(coverage.triad)) +
        Format(": no pose within %.0f deg of one direction; nothing checks the model on that side",
               coverage.largest_gap_deg));
  }
  if (poses_.temperature_range_degc) {
    const Eigen::Vector2d& range = *poses_.temperature_range_degc;
    Say("recorded at " + Format("%.1f", range[0]) + " to " + Format("%.1f", range[1]) +
        " degC; no temperature terms were estimated");
  }
  if (const auto& magnetometer = calibration.sensors[Triad::kMagnetometer];
      magnetometer && options_.reference.field_ut.known()) {
    const StreamSummary* stream = poses_.Find(Triad::kMagnetometer);
    const double gain = std::cbrt(std::abs(magnetometer->model.sensitivity.determinant())) *
                        stream->unit.truth_per_raw;
    if (!stream->unit.is_counts && (gain > kOddGain || gain < 1.0 / kOddGain)) {
      Say("the magnetometer's gain is " + Format("%.4g", gain) + " times what " +
          stream->unit.name +
          " means at the stated field strength: check the unit and strength_ut");
    }
  }
  if (field_nominal_) {
    Say(
        Format("field strength unknown: the magnetometer's common scale is not observable, "
               "strength fixed to %.6g uT",
               reference[kField]));
  }
  auto limits = JudgeLimits(calibration, poses_, options_.limits);
  if (!limits) return limits.error();
  quality.limits = std::move(*limits);
  if (!quality.limits.empty()) {
    calibration.within_limits = std::all_of(quality.limits.begin(),
                                            quality.limits.end(),
                                            [](const LimitCheck& check) { return check.pass; });
  }
  return {};
}

Result<CalibrationSummary> Estimator::Run() {
  TRUETRIAD_RETURN_IF_ERROR(options_.Validate());
  Calibration& calibration = summary_.calibration;
  calibration.gauge = options_.gauge;
  calibration.gauge_sensor = leading();
  calibration.serial = poses_.serial;
  calibration.reference.gravity_mps2 = *options_.reference.gravity_mps2.value;
  calibration.reference.temperature_degc = options_.reference.temperature_degc;
  for (const Triad triad : kTriads) {
    if (!Wants(triad) || poses_.Find(triad) != nullptr) continue;
    return BadInputError(poses_.source + ": the experiment wants the " +
                         std::string(TriadName(triad)) + ", but the recording has none");
  }
  ChooseNoise();
  calibration.quality.poses = static_cast<int>(poses_.poses.size());
  if (const Status counts = CheckPoseCounts(poses_, options_); !counts) {
    return Refuse(Outcome::kNotEnough, counts.error().message);
  }
  auto starts = FindStartValues(poses_, options_);
  if (!starts) {
    if (starts.error().code != ErrorCode::kNotEnough) return starts.error();
    calibration.quality.weak_directions = WeakDirectionsOfReadings(poses_, options_);
    return Refuse(Outcome::kNotObservable, starts.error().message);
  }
  TRUETRIAD_RETURN_IF_ERROR(BuildNodes());
  if (options_.initialise.only) return StateStart(starts->front());
  if (!SolveFromBestStart(*starts)) {
    return Refuse(Outcome::kNotConverged, "the optimiser failed from every start");
  }
  if (graph_.layout.free_size() == 0) {
    return UsageError("every wanted parameter is held by `fixed:`; nothing is left to estimate");
  }
  SettleNoise();
  SettleHemisphere();
  TRUETRIAD_RETURN_IF_ERROR(Finish());
  return summary_;
}

}  // namespace

Result<CalibrationSummary> Calibrate(const PoseSet& poses, const CalibrateOptions& options) {
  return Estimator(poses, options).Run();
}

}  // namespace truetriad
