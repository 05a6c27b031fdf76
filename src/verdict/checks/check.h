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

// The noise of a motion's readings that was used to solve the chain of its moments.
struct MotionNoiseFound {
  PerTriad<TriadNoise> stated;                  // in the form that a result states
  PerTriad<Eigen::Vector3d> reading_sigma_raw;  // σ of one reading
};

// A run whose weights, noise and solution have settled.
struct SettledRun {
  const PoseSet& poses;
  const CalibrateOptions& options;
  const PoseGraph& graph;
  const NoiseState& noise;
  bool converged = false;
  Findings remarks = {};                        // findings of earlier steps
  const MotionNoiseFound* of_motion = nullptr;  // set for a motion
};

// The results of a run so far, which checks examine.
struct SolvedRun {
  const ReducedSystem& system;
  const PresentedSolution& solution;
  const Unmodelled& unmodelled;
  const NoiseState& noise_before;  // before faults were included
  const OffOptimum& off;           // how far noise_before is from its optimum
  bool determined = true;          // each wanted parameter has a σ below the limit
  const Calibration& stated;       // has reference and quality; for remarks also sensors
};

// If the temperature changes by more than this, biases change by more than a good calibration's σ:
// consumer sensors drift by about 1 mg, 0.02 deg/s and 0.1 uT per degC.
inline constexpr double kMuchTemperatureDegc = 10.0;

// A check examines a run and returns findings. If a check refuses, the following ones do not run.
using Check = Findings (*)(const SettledRun& run, const SolvedRun& solved);

// Checks whether the solution can be used, in the order of kUsability (verdict.cc). A check is in
// fit.cc unless another file is named beside it.
Findings CheckFinite(const SettledRun& run, const SolvedRun& solved);
Findings CheckNoiseKnown(const SettledRun& run, const SolvedRun& solved);
Findings CheckRowsAreRests(const SettledRun& run, const SolvedRun& solved);  // rows_are_rests.cc
Findings CheckExplained(const SettledRun& run, const SolvedRun& solved);
Findings CheckTemperatureModelled(const SettledRun& run, const SolvedRun& solved);
Findings CheckFaultsAllow(const SettledRun& run, const SolvedRun& solved);  // faults.cc
Findings CheckOutliers(const SettledRun& run, const SolvedRun& solved);     // outliers.cc
Findings CheckDetermined(const SettledRun& run, const SolvedRun& solved);
Findings CheckConverged(const SettledRun& run, const SolvedRun& solved);
Findings CheckNotCorrected(const SettledRun& run, const SolvedRun& solved);  // sensors.cc
Findings CheckMounting(const SettledRun& run, const SolvedRun& solved);      // mounting.cc
Findings CheckGains(const SettledRun& run, const SolvedRun& solved);         // units.cc

// Checks that add remarks for the reader of a usable result, and never refuse it.
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

// Checks that apply to rests, motions and sweeps.
//
// A warning if degrees of freedom are too few to know σ well.
Findings CheckDegreesOfFreedom(double dof, const char* remedy);
// A refusal if parameters (`is_finite`) or covariances are not finite, or a variance is negative.
Findings CheckFinite(const TriadOptions& gyroscope,
                     bool is_finite,
                     const NamedCovariance& covariance);
// A finding if the σ of a parameter, all effects included, exceeds `limit` times its typical size.
Findings CheckStillDetermined(const PoseGraph& graph,
                              const Eigen::MatrixXd& covariance,
                              double limit);
// The list of tested faults, for the report.
std::vector<LeftOutTest> TestsOf(const FaultFindings& faults);

}  // namespace truetriad
