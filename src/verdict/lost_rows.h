// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Core>

#include "truetriad/model/triad_model.h"

namespace truetriad {

// Rows that were lost from a log whose times were made regular afterwards. From one row to the next
// the field v in the body turns by what the gyroscope reads, v' = v x w dt; where a row is missing
// it turns by twice that. As many steps must read near twice as near nothing where none is: noise
// and clumsy hands do both. A gyroscope's gain is off by a few percent at most, which a whole step
// is not.
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

 private:
  TriadModel<double> gyroscope_, vector_;
  double sigma_;
  double steps_ = 0.0, twice_ = 0.0, none_ = 0.0;
};

}  // namespace truetriad
