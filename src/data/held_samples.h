// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/triad.h"
#include "truetriad/data/sample_source.h"

namespace truetriad {

/// Held at most, of all streams: 14 minutes of three at 100 Hz, some 25 MB.
inline constexpr std::size_t kMostHeldSamples = 262144;

/// Samples of one triad that are held back until more of them have come. Columns that a recording
/// does not have stay empty.
struct HeldSamples {
  std::vector<std::int64_t> time_ns, row;
  std::vector<double> x, y, z, temperature_degc, ambient_degc;
  std::vector<std::int32_t> pose;

  std::size_t size() const { return x.size(); }
  Eigen::Vector3d reading(std::size_t i) const { return {x[i], y[i], z[i]}; }
  void Append(const SampleBlock& block);
  void Move(std::size_t from, std::size_t to);
  void Resize(std::size_t size);
  void EraseFront(std::size_t count);
  SampleBlock View(Triad triad, std::size_t begin, std::size_t end) const;

 private:
  // Optional columns are empty.
  template <typename Change>
  void EachColumn(const Change& change) {
    change(&time_ns), change(&row);
    change(&x), change(&y), change(&z);
    change(&temperature_degc), change(&ambient_degc);
    change(&pose);
  }
};

}  // namespace truetriad
