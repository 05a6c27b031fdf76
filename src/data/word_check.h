// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace truetriad {

/// No sensor reads as much.
inline constexpr double kNoSensorReads = 1e30;
/// The smallest word but zero.
inline constexpr double kLeastWord = 999.0;

/// What drivers and file formats put where there is no reading: zero, ends of 16 and 32 bits, rows
/// of nines.
inline bool IsWord(double value) {
  const double size = std::abs(value);
  if (size < kLeastWord) return size == 0.0;
  if (size < 32767.0) return size == 999.0 || size == 9999.0;
  if (size <= 65535.0) return size == 32767.0 || size == 32768.0 || size == 65535.0;
  return size == 99999.0 || size == 2147483647.0 || size == 2147483648.0 || size >= kNoSensorReads;
}

/// All axes read the same.
bool IsOneWord(const Eigen::Vector3d& reading);

/// Readings about a word, and what is known of their stream.
struct AboutWord {
  std::vector<Eigen::Vector3d> readings;  ///< Good ones before and after.
  Eigen::Vector3d step;                   ///< Smallest between readings, by axis.
  std::size_t in_a_row = 1;               ///< Words.
  double zero_share = 0.0;                ///< Of the rows so far that were 0, 0, 0 and no reading.
};

/// Whether `reading`, of which at least one axis is a word or all are one, cannot be a reading. A
/// word alone says nothing: a gyroscope at rest may read 0, 0, 0.
bool IsNoReading(const Eigen::Vector3d& reading, const AboutWord& about);

}  // namespace truetriad
