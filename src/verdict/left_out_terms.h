// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "model/mechanisms.h"
#include "noise/noise_settling.h"
#include "problem/graph.h"
#include "problem/rows/row.h"
#include "solve/reduced_system.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/quality.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// What a sensor does beyond the model that was asked for.
enum class LeftOutKind {
  kAxisTerm,      // bends, or gains for both directions
  kMatrix,        // has a matrix of another shape than its `model:`
  kGSensitivity,  // of the gyroscope
  kDrift,         // the bias goes on with time
  kGainDrift,     // each gain does
  kThermalGain,   // the matrix follows the temperature by a power more than the terms allow
  kLowPass,       // reads less the faster it is turned
  kLeverArm,      // of the accelerometer: is not where the unit is turned about
  kOneSided,      // single readings are off to one side
  kLostRows,      // of the gyroscope, whose turns are too short by them
  kRounding,      // of the gyroscope: at rest it reads the same step throughout
  kTurnScatter,   // of the gyroscope: turns miss along their axes
  kSettling,      // of the gyroscope: turns go on into the rests
};

// A term that is not in the model and that the residuals show.
struct LeftOutTerm {
  Triad triad = Triad::kAccelerometer;
  LeftOutKind kind = LeftOutKind::kAxisTerm;
  AxisTerm axis_term = AxisTerm::kQuadratic;
  double p_value = 1.0;
  double chi2 = 0.0;  // of what it explains
  // By how many σ some parameter is off because the term is not there.
  double effect_sigmas = 0.0;
  double share = 0.0;  // of the rows, that are lost
  // Of its unknowns; of a lever arm m, of a low-pass s^2, of a step and of a drift over the run as
  // much of the bias in true units.
  double size = 0.0;
  bool is_shared = false;  // by the matrices of several sensors: a rotation that none of them has
  // The model prints entries that are tied to others, which σ cannot be widened for.
  bool is_tied = false;
  bool is_beyond_stated = false;  // though a data sheet lets the sensor bend
};

// What a data sheet lets a sensor bend, and what that does.
struct StatedBend {
  Triad triad = Triad::kAccelerometer;
  Nonlinearity nonlinearity;
  double widening = 1.0;  // how many times larger it makes the σ that it makes the largest
};

// One that readings are tested for by unknowns of its own, problem/rows/probed_row.h.
struct ProbedTerm {
  LeftOutTerm term;
  SharedBlock block;
};

struct LeftOutTerms {
  std::vector<LeftOutTerm> found;     // the clearest first
  std::vector<LeftOutTerm> doubtful;  // neither shown nor to be ruled out, and moving much
  std::vector<LeftOutTest> tests;     // of all that were looked for together
  std::vector<StatedBend> stated;
  bool has_temperature = false;  // so that temperature terms may explain what drifts
  // What they make the free shared coordinates less certain by: those are where the model without
  // the terms has them, and as uncertain as that is from where the model with the terms would.
  Eigen::MatrixXd covariance;
};

// In a few words, of those that are looked for together.
std::string_view NameOf(const LeftOutTerm& term);
Mechanism ActsAs(const LeftOutTerm& term);

// A term is said to be there when chance makes it in so few runs; one that moves a parameter by
// more than a σ for each of its own (kappa), sooner: before chance is ruled out the result is off
// by some.
inline constexpr double kLeftOutLevel = 1e-4;
inline constexpr double kMovingLevel = 5e-4;
// One that moves so much and that chance makes in fewer runs than this may be there: it stays out,
// and σ grow by what it shifts the result by, though at most to one and a half times what they are.
inline constexpr double kDoubtLevel = 0.01;
inline constexpr double kMostByDoubt = 1.5;

// Score tests of what the model does not have, by one linearisation of the model that has it all:
// with b the free coordinates of the solution and h those of a term, from information and gradient
// of the larger model at the solution,
//
//   I = M_hh - M_hb M_bb^-1 M_bh      u = g_h - M_hb M_bb^-1 g_b      u^T I^-1 u ~ chi^2
//
// (Rao 1948), held against the triad's own residuals where its noise was estimated from them. The
// clearest is taken in and the others are tested again beside it, until none is left. With those
// that were taken in, h = -I^-1 u moves b by d = -M_bb^-1 M_bh h, known to V = M_bb^-1 M_bh I^-1
// M_hb M_bb^-1; the solution without them is off by that, and its covariance grows by d d^T + V.
// Bends of a sensor whose data sheet states its non-linearity are known beforehand to be zero with
// a σ: with its L = diag(1 / σ^2) added to I they are counted in d and V whether they show or not,
// and are tested for what they have beyond it, as u^T I^-1 u of u and I without their expectation.
//
// `options` with all that bends, and the search once somebody linearised the graph that WithTermsOf
// makes of them, with probes appended. `covariance`: of the solution's
// free coordinates; the noise is taken as known.
CalibrateOptions WithLeftOutBends(const CalibrateOptions& options, const SharedLayout& has);
LeftOutTerms FindLeftOutTerms(const PoseGraph& graph,
                              const Eigen::MatrixXd& covariance,
                              const CalibrateOptions& options,
                              const SharedLayout& larger,
                              const std::vector<ProbedTerm>& probed,
                              const Eigen::MatrixXd& information,
                              const Eigen::VectorXd& gradient);

}  // namespace truetriad
