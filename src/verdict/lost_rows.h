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
  double share = 0.0;   // of all rows that there were, those that are lost
  double chance = 1.0;  // in how many runs without any so much shows
};

// Rows that were lost from a log whose times were made regular afterwards. From one row to the next
// the field v in the body turns by what the gyroscope reads, v' = v x w dt; where a row is missing
// it turns by twice that. With k what it turns by beyond what it does in the steps beside it, as a
// share of what it should, the mean of k^3, |k| <= 2, tells the share of rows that are missing:
// noise is as often positive as negative, and gains, delays and hands change little from step to
// step. Where every n-th row is missing, n <= 25, the mean of k over every (n-1)-th step stands
// out.
class LostRowCounter {
 public:
  // `sigma`: of one reading of the vector sensor, as a share of its field.
  LostRowCounter(const TriadModel<double>& gyroscope,
                 const TriadModel<double>& vector,
                 double sigma)
      : gyroscope_(gyroscope), vector_(vector), sigma_(sigma) {}

  // Readings of both sensors at the same times, one after the other.
  void Add(std::span<const std::int64_t> time_ns,
           std::span<const Eigen::Vector3d> gyroscope_raw,
           std::span<const Eigen::Vector3d> vector_raw);

  // Of all rows that there were, those that are lost; 0 where chance may make so many.
  double Share() const;
  // Of rows lost at random, whether chance may make so many or not.
  ShareOfRows AtRandom() const;

 private:
  struct Step {
    double more = 0.0;   // than the gyroscope says, as a share of it
    double noise = 0.0;  // of that
    bool is_told = false;
  };
  void AddStep(std::int64_t row, double beyond, double noise);
  double PeriodicShare() const;

  TriadModel<double> gyroscope_, vector_;
  double sigma_;
  struct Told {
    std::int64_t row = 0;   // by its time
    double beyond = 0.0;    // k
    double variance = 0.0;  // of its noise and of what is beside it
  };
  // Few steps tell nothing, nor does a sensor that is read less often than rows are written, its
  // last reading being repeated: it turns by nothing and then by several steps.
  bool CanTell() const;

  std::vector<Told> told_;
  std::size_t turned_ = 0, repeated_ = 0;  // steps, and those by which the reading is the same
  std::int64_t spacing_ns_ = 0;
};

}  // namespace truetriad
