// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "noise/noise_settling.h"
#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "verdict/own_residuals.h"

namespace truetriad {

// Two things that happen to a magnetometer in the middle of a run.
enum class ChangeKind {
  kBias,    // iron or a magnet on the unit moved: another bias from there on
  kField,   // the unit, or iron about it, was moved: another field in the world
  kEither,  // both explain the readings about as well
};

// The magnetometer's readings from one pose on are not those of the poses before.
struct MagnetometerChange {
  std::size_t node = 0;  // the first pose after it
  // Where that explains more, it has gone again: the last pose of the few that it befell.
  std::optional<std::size_t> last;
  // The first and the last pose that are about as likely (odds of 20) to be that.
  std::size_t earliest = 0, latest = 0;
  ChangeKind kind = ChangeKind::kEither;
  // What it is if it is that: of the bias in the body frame, of the field in the world frame, uT.
  Eigen::Vector3d bias_ut = Eigen::Vector3d::Zero();
  Eigen::Vector3d field_ut = Eigen::Vector3d::Zero();
  // By how many σ some parameter is off for the poses before it, or for those after it, because
  // the solution has no such step; the lesser of both explanations where either will do.
  double effect_sigmas = 0.0;
  // What the free coordinates are less certain by: they are those of one side or of the other, as
  // likely as that has poses.
  Eigen::MatrixXd covariance;
  // Of what the magnetometer's residuals amount to.
  double explained_share = 0.0;
  // Probability of one as clear by chance, the best of all places and both kinds.
  double p_value = 1.0;
};

// Poses that a passing magnet or current befalls: seven seconds are two rests of a hand.
inline constexpr std::size_t kLongestTransient = 3;

// A run without a change is said to have one with at most this probability.
inline constexpr double kChangeLevel = 0.01;

// Looks for one change, between any two poses: the score test of a step d (uT) from a pose on, in
// the bias (rows of the magnetometer + S d) or in the field (rows + S R^T d),
//
//   u = Z^T P r      I = Z^T P Z      T = u^T I^-1 u ~ chi^2(rank I)      d = -I^-1 u
//
// P the projector of the whole graph (reduced_system.h), Z the columns of the step. Where the noise
// was estimated from the same poses, which takes the step for noise, T is held against what is left
// of the magnetometer's own residuals without it: F(rank, the rest); so it is where the residuals
// are all that tells the noise, but there a change has to explain nine tenths of them, since in a
// table of means neighbouring poses share what is off in them, which looks like a step. The level
// is shared out over all places and both kinds (Bonferroni), so that it is kept whatever their
// correlation.
//
// A few poses in a row that are off alike look like a step, too: where they explain more than any
// step does, they are what is found.
//
// A change d that the solution does not have moves its parameters, for the poses before and those
// after it, by
//
//   M^-1 J^T D Z d      M^-1 J^T D (Z - Z_all) d        Z_all: columns of a step at the first pose
//
// Where the robust step has left out poses, all count again, solved again, with the noise as if
// estimated, and are searched as well: where two or more were left out on one side, as a step looks
// to a robust fit, and where a change was found without them. Unset without a change, with fewer
// than two poses on a side or eight in all, or with more poses than people set down: neighbouring
// rows of a motion share what disturbs them, which this test would take for a step.
// `settled_system`: of `settled`.
std::optional<MagnetometerChange> FindMagnetometerChange(const PoseGraph& settled,
                                                         const ReducedSystem& settled_system,
                                                         const NoiseState& noise);

// A triad's bias from one pose on is not that before.
struct BiasStep {
  std::size_t node = 0;  // the first pose after it
  double p_value = 1.0;  // of one as clear by chance, at the best of all places
  double chi2 = 0.0;     // of what it explains
  double effect_sigmas = 0.0;
  double size = 0.0;      // true unit
  Eigen::VectorXd moved;  // the free coordinates, by the step about the mean of both sides
};

// The likeliest one, by the same test against the triad's own poses, and where the robust step
// has left out what looks like one side of it, among all as above; unset where it cannot be looked
// for. The system has full rank.
std::optional<BiasStep> FindBiasStep(const PoseGraph& graph,
                                     const ReducedSystem& system,
                                     const NoiseState& noise,
                                     Triad triad);

}  // namespace truetriad
