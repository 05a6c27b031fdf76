// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "noise/noise_settling.h"
#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/model/finding.h"
#include "truetriad/problem/options.h"
#include "verdict/presentation.h"
#include "verdict/unmodelled.h"

namespace truetriad {

// The noise of a unit in motion, which its chain was settled with.
struct MotionNoiseFound {
  PerTriad<TriadNoise> stated;                  // as a result states it
  PerTriad<Eigen::Vector3d> reading_sigma_raw;  // of one reading
};

// A run whose weights, noise and solution have settled.
struct SettledRun {
  const PoseSet& poses;
  const CalibrateOptions& options;
  const PoseGraph& graph;
  const NoiseState& noise;
  bool converged = false;
  Findings remarks = {};                        // on the way there
  const MotionNoiseFound* of_motion = nullptr;  // where nodes are moments
};

// What was made of it so far.
struct SolvedRun {
  const ReducedSystem& system;
  const PresentedSolution& solution;
  const Unmodelled& unmodelled;
  const NoiseState& noise_before;  // faults were looked for
  const OffOptimum& off;           // of that
  bool determined = true;     // every parameter that was asked for, to the σ that counts as such
  const Calibration& stated;  // reference and quality; for remarks also the sensors
};

// A change of temperature that moves biases by more than a good calibration leaves: consumer
// sensors drift by about 1 mg, 0.02 deg/s and 0.1 uT per degC.
inline constexpr double kMuchTemperatureDegc = 10.0;

// A check looks at a run and says what it found. One that refuses ends the run: no later one is
// asked.
using Check = Findings (*)(const SettledRun& run, const SolvedRun& solved);

// Whether the solution can be used, in the order of kUsability (verdict.cc). fit.cc
Findings CheckFinite(const SettledRun& run, const SolvedRun& solved);
Findings CheckNoiseKnown(const SettledRun& run, const SolvedRun& solved);
Findings CheckRowsAreRests(const SettledRun& run, const SolvedRun& solved);  // rows_are_rests.cc
Findings CheckExplained(const SettledRun& run, const SolvedRun& solved);
Findings CheckTemperatureModelled(const SettledRun& run, const SolvedRun& solved);
Findings CheckFaultsAllow(const SettledRun& run, const SolvedRun& solved);  // faults.cc
Findings CheckOutliers(const SettledRun& run, const SolvedRun& solved);
Findings CheckDetermined(const SettledRun& run, const SolvedRun& solved);
Findings CheckConverged(const SettledRun& run, const SolvedRun& solved);
Findings CheckNotCorrected(const SettledRun& run, const SolvedRun& solved);  // sensors.cc
Findings CheckMounting(const SettledRun& run, const SolvedRun& solved);      // mounting.cc
Findings CheckTurnsTold(const SettledRun& run, const SolvedRun& solved);     // turn_units.cc
Findings CheckGains(const SettledRun& run, const SolvedRun& solved);         // units.cc

// What the reader of a usable result should know besides its numbers; none of these refuses.
Findings CheckDegreesOfFreedom(const SettledRun& run, const SolvedRun& solved);
Findings CheckRejectedPoses(const SettledRun& run, const SolvedRun& solved);  // outliers.cc
Findings CheckHeldGyroscope(const SettledRun& run, const SolvedRun& solved);
Findings CheckClockOffsets(const SettledRun& run, const SolvedRun& solved);
Findings CheckNoiseFree(const SettledRun& run, const SolvedRun& solved);
Findings CheckStatedNoise(const SettledRun& run, const SolvedRun& solved);   // stated.cc
Findings CheckStatedValues(const SettledRun& run, const SolvedRun& solved);  // stated.cc
Findings CheckCoverage(const SettledRun& run, const SolvedRun& solved);
Findings CheckTemperatures(const SettledRun& run, const SolvedRun& solved);
Findings CheckMagnetometerScale(const SettledRun& run, const SolvedRun& solved);
Findings CheckHand(const SettledRun& run, const SolvedRun& solved);  // mounting.cc
Findings CheckDrift(const SettledRun& run, const SolvedRun& solved);
Findings CheckFaults(const SettledRun& run, const SolvedRun& solved);  // faults.cc
Findings CheckCurves(const SettledRun& run, const SolvedRun& solved);
Findings CheckSessions(const SettledRun& run, const SolvedRun& solved);  // verdict/sessions.cc

// Parts that hold however the solution was found.
//
// Degrees of freedom that are too few to know σ by.
Findings CheckDegreesOfFreedom(double dof, const char* remedy);
// A solution (`is_finite`: of its parameters), a covariance or a variance that is no number.
Findings CheckFinite(const TriadOptions& gyroscope,
                     bool is_finite,
                     const NamedCovariance& covariance);
// A solution that is known badly, or too badly to be used, once σ allow for all that was found:
// some σ is more than `limit` of its parameter's typical size.
Findings CheckStillDetermined(const PoseGraph& graph,
                              const Eigen::MatrixXd& covariance,
                              double limit);
// What the report lists of the faults that were looked for.
std::vector<LeftOutTest> TestsOf(const FaultFindings& faults);

}  // namespace truetriad
