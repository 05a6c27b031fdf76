// SPDX-License-Identifier: Apache-2.0
#include "calibrate/why_not_as_settled.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "base/messages.h"
#include "init/frame_alignment.h"
#include "math/dense/eigenvalues.h"
#include "model/mechanisms.h"
#include "noise/joint_test.h"
#include "problem/graph_builder.h"
#include "problem/start_values.h"
#include "solve/chain_elimination.h"
#include "solve/field_side.h"
#include "solve/shared_information.h"
#include "solve/solve_graph.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

// A stated dip is suspect if the readings pull the dip away from it by over this many σ of the
// pull. Chosen low: a contradiction increases the noise and thereby this σ, so that a larger limit
// would hide the contradiction.
constexpr double kSuspectSigmas = 1.5;

// A stated dip may pull the estimated dip by this many σ of the dip that the readings alone give.
constexpr double kPulledSigmas = 3.0;

double VarianceAt(int index, const PoseGraph& graph, const SharedInformation& known) {
  const Eigen::RowVectorXd row = graph.layout.basis.row(index);
  return row * known.covariance() * row.transpose();
}

SharedInformation KnownOf(const PoseGraph& graph) {
  const ChainElimination linearised = Linearised(graph);
  return {graph.layout, graph.shared, linearised.information(), linearised.gradient()};
}

// Whether the stated dip must be tested: it is stated as exact, or the solution is too far from it.
bool IsSuspect(const Knowledge& dip, int dip_at, const PoseGraph& solved) {
  if (!(dip.sigma > 0.0)) return true;
  const double left = VarianceAt(dip_at, solved, KnownOf(solved)) / (dip.sigma * dip.sigma);
  const double off = (solved.shared[dip_at] - *dip.value) / dip.sigma;
  return off * off > kSuspectSigmas * kSuspectSigmas * (1.0 - left);
}

std::optional<Finding> FindContradictedDip(const CalibrateOptions& options,
                                           const NoiseState& noise,
                                           const PoseGraph& solved) {
  const Knowledge& dip = options.reference.dip_rad;
  const int dip_at = solved.layout.reference + kDip;
  if (!dip.known() || !solved.layout.Has(Triad::kAccelerometer) ||
      !solved.layout.Has(Triad::kMagnetometer) || !IsSuspect(dip, dip_at, solved)) {
    return std::nullopt;
  }
  CalibrateOptions unknown = options;
  unknown.reference.dip_rad = {};
  PoseGraph freed = WithTermsOf(unknown, solved);
  const int freed_at = freed.layout.reference + kDip;
  if (!freed.layout.IsFree(freed_at)) return std::nullopt;
  NoiseState found = noise;
  SolveLog log;
  Findings of_noise;
  SettleNoise(options.robust, &found, &freed, &log, &of_noise);
  const SharedInformation known = KnownOf(freed);
  if (!log.converged || known.rank() < known.size()) return std::nullopt;
  const double variance = VarianceAt(freed_at, freed, known);
  const double off_rad = freed.shared[freed_at] - *dip.value;
  const double chi2 = off_rad * off_rad / (variance + dip.sigma * dip.sigma);
  if (!(chi2 > FarInChi2(NoiseDof(found.estimate, freed)))) return std::nullopt;
  // If the readings outweigh the stated dip, it does no harm; stated.cc reports the contradiction.
  const double pulled_rad = freed.shared[freed_at] - solved.shared[dip_at];
  if (pulled_rad * pulled_rad < kPulledSigmas * kPulledSigmas * variance) return std::nullopt;
  return Finding(
             FindingCode::kStatedOtherwise,
             Format("the dip was stated as %.6g", *dip.value / kRadPerDeg) +
                 (dip.sigma > 0.0 ? Format(" ± %.2g", dip.sigma / kRadPerDeg) : "") +
                 Format(" deg, but the readings give %.6g", freed.shared[freed_at] / kRadPerDeg) +
                 Format(" ± %.2g deg", std::sqrt(variance) / kRadPerDeg),
             "leave `dip_deg` out, or state how well it is known (`{ value, sigma }`): "
             "nearby iron makes it differ from a map")
      .As(Severity::kRefusal)
      .About(Triad::kMagnetometer)
      .With("dip", freed.shared[freed_at] / kRadPerDeg, "deg")
      .With("sigmas", std::sqrt(chi2));
}

// Chosen: an alignment that is nearer to the solution than this is the solution itself. It may
// differ since the closed form gives all poses the same weight.
constexpr double kSameByClosedFormRad = 2.0 * kRadPerDeg;
// Chosen: if two solved alignments are nearer to each other than this, they are the same.
constexpr double kSameRad = 0.5 * kRadPerDeg;
// If the cosine of the angle between field and gravity scatters by more than this RMS, the field is
// not constant. It is 6 deg if the angle is a right angle.
constexpr double kExplainedRms = 0.1;
// With so many poses, one of several alignments is clearly the best, whatever the attitudes are.
constexpr std::size_t kEnoughPairs = 8;

struct Pairs {
  std::vector<Eigen::Vector3d> ups, fields;  // in the body as it was solved, unit vectors
  double cosine = 0.0;                       // of the angle between them, mean
  double rms = 0.0;                          // of the cosines' deviations from the mean
  double noise = 0.0;                        // σ of a cosine from one pose's noise, RMS
};

// The variance that the noise of a reading causes in a component of the unit vector; mean of the
// components.
double VarianceOfDirection(const TriadModel<double>& model, const Observation& observation) {
  const Eigen::Matrix3d C = model.sensitivity.inverse();
  const Eigen::Matrix3d variance = C * observation.variance * C.transpose();
  return variance.trace() / 3.0 / model.TruthFromRaw(observation.mean_raw).squaredNorm();
}

// `of_kept`: without readings that were rejected.
Pairs PairsOf(const PoseGraph& graph, bool of_kept) {
  Pairs pairs;
  for (const PoseNode& node : graph.nodes) {
    PerTriad<std::optional<Eigen::Vector3d>> seen;
    double variance = 0.0;
    for (const Observation& observation : node.observations) {
      if (observation.triad == Triad::kGyroscope) continue;
      if (of_kept && observation.rejected) continue;
      const TriadModel<double> model = graph.ModelAt(observation.triad, node);
      seen[observation.triad] = model.TruthFromRaw(observation.mean_raw).normalized();
      variance += VarianceOfDirection(model, observation);
    }
    if (!seen[Triad::kAccelerometer] || !seen[Triad::kMagnetometer]) continue;
    pairs.noise += variance;
    pairs.ups.push_back(*seen[Triad::kAccelerometer]);
    pairs.fields.push_back(*seen[Triad::kMagnetometer]);
  }
  const auto count = static_cast<double>(pairs.ups.size());
  for (std::size_t k = 0; k < pairs.ups.size(); ++k) {
    pairs.cosine += pairs.ups[k].dot(pairs.fields[k]) / count;
  }
  for (std::size_t k = 0; k < pairs.ups.size(); ++k) {
    pairs.rms += std::pow(pairs.ups[k].dot(pairs.fields[k]) - pairs.cosine, 2) / count;
  }
  pairs.rms = std::sqrt(pairs.rms);
  pairs.noise = std::sqrt(pairs.noise / count);
  return pairs;
}

// Rotation angle of an orthogonal matrix of either handedness.
double AngleOf(const Eigen::Matrix3d& turn) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(turn.determinant() < 0.0 ? -turn : turn)).angle();
}

// The other minima of the closed form, as rotations or reflections of the solved field directions.
std::vector<FrameAlignment> Others(const PoseGraph& solved, const Pairs& pairs) {
  const bool is_dip_free = solved.layout.IsFree(solved.layout.reference + kDip);
  std::vector<FrameAlignment> all;
  const auto add = [&](int determinant, const double* cosine) {
    auto found = AlignFrames(pairs.ups, pairs.fields, determinant, cosine);
    if (found) all.insert(all.end(), found->begin(), found->end());
  };
  if (is_dip_free) {
    add(+1, nullptr);
    for (FrameAlignment& other : all) {
      if (other.cosine * pairs.cosine > 0.0) continue;
      // The same alignment with the solution's sign of the dip.
      other.rotation = -other.rotation;
      other.cosine = -other.cosine;
    }
  } else {
    add(+1, &pairs.cosine);
    add(-1, &pairs.cosine);
  }
  // An alignment is not tried if its RMS exceeds three times that of the solution (or of the noise,
  // if this is larger) by 1.1 deg. Chosen wide, since only the cost after solving decides.
  constexpr double kHopeless = 0.02;
  std::erase_if(all, [&](const FrameAlignment& other) {
    return AngleOf(other.rotation) < kSameByClosedFormRad ||
           other.rms > 3.0 * std::max(pairs.rms, pairs.noise) + kHopeless;
  });
  return all;
}

Finding NotOneAngle(const Pairs& pairs) {
  return Finding(FindingCode::kUnexplainedReadings,
                 "the angle between gravity and field differs from pose to pose by " +
                     Format("%.2g deg (RMS): ", std::asin(std::min(1.0, pairs.rms)) / kRadPerDeg) +
                     "readings of the two sensors do not belong together, or the field changed",
                 "look for rows of one sensor that are late or out of order, and for iron nearby")
      .With("poses", static_cast<double>(pairs.ups.size()))
      .With("rms", std::asin(std::min(1.0, pairs.rms)) / kRadPerDeg, "deg");
}

// Solves the graph from a start in which `turned`, the triad that does not lead, has this
// alignment.
PoseGraph SolvedFrom(const FrameAlignment& alignment, Triad turned, PoseGraph graph) {
  const SharedLayout& layout = graph.layout;
  const Eigen::Matrix3d body_from_turned =
      turned == Triad::kMagnetometer ? alignment.rotation.transpose() : alignment.rotation;
  const auto turn = [&](int at) {
    graph.shared.segment<9>(at) =
        Eigen::Matrix3d(graph.shared.segment<9>(at).reshaped(3, 3) * body_from_turned).reshaped();
  };
  turn(layout.sensitivity[turned]);
  const ThermalBlock& thermal = layout.thermal[turned];
  for (int i = 0; i < thermal.terms.matrix_order; ++i) turn(thermal.matrix_at(i));
  if (layout.IsFree(layout.reference + kDip)) {
    graph.shared[layout.reference + kDip] = -std::asin(std::clamp(alignment.cosine, -1.0, 1.0));
  }
  SetStartAttitudes(StartAt(graph), &graph);
  SolveGraph(&graph);
  return graph;
}

// Angle of the rotation between the sensitivities of two solutions.
double AngleBetween(const PoseGraph& a, const PoseGraph& b, Triad triad) {
  const Svd3 svd = SvdOf3(a.sensitivity(triad).inverse() * b.sensitivity(triad));
  return AngleOf(svd.U * svd.V.transpose());
}

std::optional<Finding> FindRivalAlignment(const CalibrateOptions& options,
                                          const ExcessEstimate& noise,
                                          const PoseGraph& solved) {
  const SharedLayout& layout = solved.layout;
  if (!layout.Has(Triad::kAccelerometer) || !layout.Has(Triad::kMagnetometer) ||
      !solved.increments.empty() || options.attitudes.kind == AttitudeKind::kGiven) {
    return std::nullopt;
  }
  const Triad turned =
      LeadingTriad(options) == Triad::kMagnetometer ? Triad::kAccelerometer : Triad::kMagnetometer;
  const TriadOptions& triad = options.triads[turned];
  if (triad.fixed_sensitivity || triad.model != MatrixModel::kFull) return std::nullopt;
  const Pairs kept = PairsOf(solved, /*of_kept=*/true);
  if (kept.rms > kExplainedRms && Acts(Mechanism::kNoOneAngle)) return NotOneAngle(kept);
  const Pairs pairs = PairsOf(solved, /*of_kept=*/false);
  const std::vector<FrameAlignment> others = Others(solved, pairs);
  if (others.empty()) return std::nullopt;
  const double cost = Linearised(solved).cost();
  const double far = FarInChi2(NoiseDof(noise, solved));
  for (const FrameAlignment& alignment : others) {
    const PoseGraph other = SolvedFrom(alignment, turned, solved);
    const double worse = 2.0 * (Linearised(other).cost() - cost);
    const double angle_rad = AngleBetween(solved, other, turned);
    if (!(worse < far) || angle_rad < kSameRad) continue;
    if (!Acts(Mechanism::kRivalAlignment)) continue;
    return Finding(FindingCode::kAlignmentUndetermined,
                   "the " + std::to_string(pairs.ups.size()) +
                       " poses with both sensors do not determine the rotation between them: " +
                       Format("rotated by %.3g deg, the ", angle_rad / kRadPerDeg) +
                       std::string(TriadName(turned)) + " fits all poses equally well",
                   pairs.ups.size() < kEnoughPairs
                       ? "record 8 or more poses with both sensors, in different attitudes"
                       : "record poses with both sensors in more different attitudes")
        .With("poses", static_cast<double>(pairs.ups.size()))
        .With("angle", angle_rad / kRadPerDeg, "deg")
        .With("chi2", worse);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Finding> WhyNotAsSettled(const CalibrateOptions& options,
                                       const NoiseState& noise,
                                       const PoseGraph& solved) {
  auto contradicted = FindContradictedDip(options, noise, solved);
  if (contradicted && Acts(Mechanism::kContradictedDip)) return contradicted;
  return FindRivalAlignment(options, noise.estimate, solved);
}

}  // namespace truetriad
