// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "noise/noise_settling.h"
#include "problem/graph.h"
#include "solve/reduced_system.h"

namespace truetriad {

// The residuals of one triad; those of the gyroscope with its turns and rates.
struct OwnResiduals {
  double chi2 = 0.0;
  double dof = 0.0;  // how many they are after all that was fitted
  // The noise was estimated from them, or should have been: more than was stated scatters.
  bool is_estimated = false;

  // Probability that something makes so much of them by chance; held against what is left of them
  // without it, F(rank, the rest), where the noise was estimated, which took it for noise.
  double ChanceOf(double part, int rank) const;
  // As ChanceOf, with what is left, and how many, as it is with this fitted, too: where the poses
  // are few, others' residuals are a good part of what something explains, and the difference of
  // both numbers says next to nothing is left.
  double ChanceBeside(double part, int rank, const OwnResiduals& left) const;
  // Variance that is left without it, of what the noise was estimated to.
  double VarianceWithout(double part, int rank) const;
  // Twice the log likelihood that it adds.
  double LikelihoodOf(double part, int rank) const;

 private:
  bool IsJudgedByRest(int rank) const { return is_estimated && dof - rank >= 1.0; }
  double LeftWithout(double part) const;
};

// What is fitted in addition: d of Z d, with Z all rows by some columns.
struct FittedBeside {
  StackedRows projected;       // P Z
  Eigen::MatrixXd covariance;  // (Z^T P Z)^-1
  Eigen::VectorXd step;        // d, by which the rows become P (r + Z d)
};

// `level`: at which residuals scatter by more than the noise that was stated. `of_poses`: without
// the gyroscope's turns, which another noise is in. `beside`: as they are with that fitted, too.
OwnResiduals OwnResidualsOf(const PoseGraph& graph,
                            const ReducedSystem& system,
                            const NoiseState& noise,
                            Triad triad,
                            double level,
                            bool of_poses = false,
                            const FittedBeside* beside = nullptr);

}  // namespace truetriad
