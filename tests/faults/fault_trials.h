// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "calibrate/calibrate_settled.h"
#include "faults/search.h"
#include "noise/joint_test.h"
#include "support/accel_mag_trials.h"
#include "truetriad/math/rotation.h"

namespace truetriad::trials {

// A nine-axis consumer unit, or one without gyroscope, in random poses whose noise is known.
struct FaultTrial {
  SyntheticUnit unit;
  std::vector<Eigen::Quaterniond> attitudes;
  SyntheticNoise noise = ModelNoise();
  SyntheticTurns turns;
  CalibrateOptions options;
  bool states_covariances = true;
  PoseSet poses;
};

struct TrialPlan {
  int poses = 24;
  bool has_gyroscope = true;
  double scatter = 0.0;  // from pose to pose, in units of the noise at rest
  bool is_exact = false;
  bool states_covariances = true;
  bool has_faces = false;  // four rests on each face of a block, the accelerometer alone
  bool is_accelerometer_alone = false;  // with a face, edge or corner of a cube up
  bool has_faces_alone = false;         // each up in turn, by hand, with any heading
};

// Leaves the accelerometer alone, and no attitudes: they are to be set.
inline void MeasureNoField(FaultTrial* trial) {
  trial->options.triads[Triad::kMagnetometer].enabled = false;
  trial->unit.models[Triad::kMagnetometer].reset();
  trial->attitudes.clear();
}

// Adds four rests on each face: faces are off by tilts of the stated σ, rests by that of the seat.
inline void SitOnFaces(FaultTrial* trial, Random* random) {
  constexpr double kRadPerDeg = std::numbers::pi / 180.0;
  AttitudeOptions& block = trial->options.attitudes;
  block.kind = AttitudeKind::kSixFace;
  trial->options.gauge = Gauge::kFixture;
  MeasureNoField(trial);
  const auto scatter = [random](double sigma_deg) {
    return Eigen::Vector2d(sigma_deg * kRadPerDeg * random->Normal3().head<2>());
  };
  for (int face = 0; face < kFaceCount; ++face) {
    const Eigen::Vector2d tilt = scatter(block.tilt_sigma_deg);
    for (int rest = 0; rest < 4; ++rest) {
      const Eigen::Vector2d off = tilt + scatter(block.seat_sigma_deg);
      const Eigen::Vector3d up =
          FaceAxes(face) * Eigen::Vector3d(std::sqrt(1.0 - off.squaredNorm()), off[0], off[1]);
      trial->attitudes.push_back(Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()));
    }
  }
}

inline void StandOnACube(FaultTrial* trial) {
  MeasureNoField(trial);
  for (int i = 0; i < 27; ++i) {
    const Eigen::Vector3d up(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1);
    if (up.isZero()) continue;
    trial->attitudes.push_back(Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()));
  }
}

// Puts the faces up in turn, about a degree off, as a hand does.
inline void SetDownOnFaces(FaultTrial* trial, Random* random) {
  constexpr double kHandRad = 0.02;
  for (std::size_t k = 0; k < trial->attitudes.size(); ++k) {
    const Eigen::Vector3d up = FaceAxes(static_cast<int>(k) % kFaceCount).col(0);
    trial->attitudes[k] =
        Eigen::AngleAxisd(2.0 * std::numbers::pi * random->Uniform(), Eigen::Vector3d::UnitZ()) *
        Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()) *
        RotationExp(Eigen::Vector3d(kHandRad * random->Normal3()));
  }
}

inline FaultTrial MakeFaultTrial(const TrialPlan& plan, Random* random) {
  constexpr Triad kG = Triad::kGyroscope;
  FaultTrial trial;
  trial.unit = RandomUnit({}, random);
  trial.options = JointOptions(trial.unit);
  trial.options.robust.enabled = false;
  trial.attitudes = RandomAttitudes(plan.poses, random);
  if (plan.has_gyroscope) {
    trial.unit.models[kG] = RandomModel({}, 1.0, random);
    trial.unit.models[kG]->bias *= 0.05;
    trial.unit.units[kG] = UnitOf(kG, false);
    trial.options.triads[kG].enabled = true;
    trial.noise.rest_sigma[kG] = 5e-5;
    trial.turns.gyroscope_sigma_radps = 1e-3;
    trial.turns.accelerometer_sigma_mps2 = 0.06;
  }
  for (const Triad triad : kTriads) {
    trial.noise.excess_sigma[triad] = plan.scatter * trial.noise.rest_sigma[triad];
  }
  if (plan.has_faces) SitOnFaces(&trial, random);
  if (plan.is_accelerometer_alone) StandOnACube(&trial);
  if (plan.has_faces_alone) SetDownOnFaces(&trial, random);
  SyntheticNoise drawn = trial.noise;
  if (plan.is_exact) drawn.rest_sigma = drawn.excess_sigma = {};
  trial.poses = SimulatePoses(trial.unit, trial.attitudes, drawn, random);
  if (plan.has_gyroscope) {
    AddTurns(
        trial.unit, trial.attitudes, trial.turns, plan.is_exact ? nullptr : random, &trial.poses);
  }
  for (StaticPose& pose : trial.poses.poses) {
    // Rests of 4 s, turns of 4 s with the hand's rest before and after.
    pose.start_ns = 8'000'000'000 * pose.number;
    pose.end_ns = pose.start_ns + 4'000'000'000;
    for (const Triad triad : kTriads) {
      if (!pose.triads[triad]) continue;
      const Eigen::Matrix3d& S = trial.unit.models[triad]->sensitivity;
      const double sigma = trial.noise.rest_sigma[triad];
      pose.triads[triad]->mean_covariance_raw = sigma * sigma * S * S.transpose();
      pose.triads[triad]->has_covariance = plan.states_covariances;
    }
  }
  return trial;
}

// The settled model of a trial, which the calibration hands to the search for faults.
inline SettledModel Settled(const FaultTrial& trial) {
  SettledModel settled;
  const auto summary = CalibrateSettled(trial.poses, trial.options, &settled);
  EXPECT_TRUE(summary) << summary.error().message;
  return settled;
}

// The covariance as StateVerdict prints it.
inline Eigen::MatrixXd CovarianceOf(const SettledModel& settled, const FaultFindings& found) {
  const ReducedSystem system(settled.graph);
  const JointTest joint = KenwardRogerTest(settled.noise.estimate, system);
  return AdjustedCovariance(settled.noise.estimate, system) / joint.scale + found.beyond;
}

// The parameters of a graph minus the truth, in free coordinates.
inline Eigen::VectorXd ErrorOf(const PoseGraph& graph, const SyntheticUnit& unit) {
  Eigen::VectorXd truth = graph.shared;
  for (const Triad triad : kTriads) {
    if (!graph.layout.Has(triad)) continue;
    truth.segment<9>(graph.layout.sensitivity[triad]) = unit.models[triad]->sensitivity.reshaped();
    truth.segment<3>(graph.layout.bias[triad]) = unit.models[triad]->bias;
  }
  truth[graph.layout.reference + truetriad::kDip] = unit.dip_rad;
  return graph.layout.basis.transpose() * (graph.shared - truth);
}

// NEES of the sensors' parameters alone: other free ones (tilts of faces) have no truth here.
inline double SensorNees(const PoseGraph& graph,
                         const SyntheticUnit& unit,
                         const Eigen::MatrixXd& covariance,
                         int* dimension) {
  std::vector<Eigen::Index> columns;
  for (const Triad triad : kTriads) {
    if (!graph.layout.Has(triad)) continue;
    for (const int at : {graph.layout.bias[triad], graph.layout.sensitivity[triad]}) {
      const int size = at == graph.layout.bias[triad] ? 3 : 9;
      const auto of_block = graph.layout.ColumnsOf(at, size);
      columns.insert(columns.end(), of_block.begin(), of_block.end());
    }
  }
  return Nees(ErrorOf(graph, unit)(columns), covariance(columns, columns), dimension);
}

}  // namespace truetriad::trials
