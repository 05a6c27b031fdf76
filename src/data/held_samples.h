// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/triad.h"
#include "truetriad/data/sample_source.h"

namespace truetriad {

/// The most samples held, over all streams: 14 minutes of three streams at 100 Hz, some 25 MB.
inline constexpr std::size_t kMostHeldSamples = 262144;
/// Number of samples that sources hand over at once: 32 kB per column, which the cache holds.
inline constexpr std::size_t kBlockSamples = 4096;

/// The readings begin, …, end - 1 of a block; columns that the block lacks stay empty.
SampleBlock PieceOf(const SampleBlock& block, std::size_t begin, std::size_t end);

/// Number of readings from which a stream's smallest step is determined. If the noise has a σ of
/// 100 steps, one of √π σ = 177 readings differs from the one before by one step; of this number,
/// 113 do.
inline constexpr std::int64_t kStepReadings = 20000;

/// The smaller one of `step` and the smallest change between consecutive readings, which are
/// `before` and then `values`. Changes below 1e-9 of the `largest` reading are left out, as they
/// are rounding of a conversion.
inline double SmallestStep(std::span<const double> values,
                           double before,
                           double largest,
                           double step) {
  const double rounding = 1e-9 * largest;
  for (const double value : values) {
    const double difference = std::abs(value - std::exchange(before, value));
    step = difference > rounding && difference < step ? difference : step;
  }
  return step;
}

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
  SampleBlock View(Triad triad, std::size_t begin, std::size_t end) const {
    return PieceOf(
        {triad, time_ns, x, y, z, temperature_degc, pose, row, ambient_degc}, begin, end);
  }

 private:
  // Calls `change` with each column and the pointer to the same column of SampleBlock. Optional
  // columns may be empty.
  template <typename Change>
  void EachColumn(const Change& change) {
    change(&time_ns, &SampleBlock::time_ns), change(&row, &SampleBlock::row);
    change(&x, &SampleBlock::x), change(&y, &SampleBlock::y), change(&z, &SampleBlock::z);
    change(&temperature_degc, &SampleBlock::temperature_degc);
    change(&ambient_degc, &SampleBlock::ambient_degc);
    change(&pose, &SampleBlock::pose);
  }
};

}  // namespace truetriad
