// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "truetriad/model/triad_model.h"

namespace truetriad {

struct ShareOfRows {
  double share = 0.0;   // lost rows as a share of all original rows
  double chance = 1.0;  // probability of such a share if no rows are lost
};

// Estimates how many rows were lost from a log whose times were made regular afterwards. From one
// row to the next, the field v in the body turns by the gyroscope's rate w: v' = v x w dt. Across a
// missing row, it turns by twice that. k is the turn of v in a step minus the predicted turn,
// divided by the predicted turn; the mean over neighbouring steps is subtracted. The mean of k^3,
// with |k| <= 2, is the share of missing rows: noise has both signs equally often, and errors of
// gains, delays and the hand's motion change little from step to step. If every n-th row is
// missing, n <= 25, the mean of k over every (n-1)-th step is significant.
class LostRowCounter {
 public:
  // `sigma`: σ of one reading of the vector sensor, relative to the strength of its field.
  LostRowCounter(const TriadModel<double>& gyroscope,
                 const TriadModel<double>& vector,
                 double sigma)
      : gyroscope_(gyroscope), vector_(vector), sigma_(sigma) {}

  // Adds readings of both sensors at the same times, in the order of time.
  void Add(std::span<const std::int64_t> time_ns,
           std::span<const Eigen::Vector3d> gyroscope_raw,
           std::span<const Eigen::Vector3d> vector_raw);

  // Lost rows as a share of all original rows; 0 if not significant.
  double Share() const;
  // The share of rows that are lost at random, significant or not.
  ShareOfRows AtRandom() const;

 private:
  struct Step {
    double more = 0.0;   // turn beyond the gyroscope's, over the gyroscope's
    double noise = 0.0;  // σ of `more`
    bool is_told = false;
  };
  void AddStep(std::int64_t row, double beyond, double noise);
  double PeriodicShare() const;

  TriadModel<double> gyroscope_, vector_;
  double sigma_;
  struct Told {
    std::int64_t row = 0;   // row number, counted by time
    double beyond = 0.0;    // k
    double variance = 0.0;  // of k, by the noise of the step and its neighbours
  };
  // Whether the steps can show lost rows. False if there are too few steps, or if a sensor is read
  // less often than rows are written: repeated readings then look like steps without a turn,
  // followed by a turn of several steps at once.
  bool CanTell() const;

  std::vector<Told> told_;
  std::size_t turned_ = 0, repeated_ = 0;  // number of steps, and of steps with a repeated reading
  std::int64_t spacing_ns_ = 0;
};

}  // namespace truetriad
