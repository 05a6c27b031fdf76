// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace truetriad {

// Readings of a triad, linearly interpolated to ascending times and constant beyond both ends;
// empty without readings.
std::vector<Eigen::Vector3d> ReadingsAt(const std::vector<std::int64_t>& at_ns,
                                        const std::vector<std::int64_t>& time_ns,
                                        const std::vector<Eigen::Vector3d>& reading_raw);
std::vector<Eigen::Vector3d> ReadingsAt(const std::vector<double>& at_s,
                                        const std::vector<double>& time_s,
                                        const std::vector<Eigen::Vector3d>& reading_raw);

// Mean over time of readings at uneven times, by trapezoids. Needs two times.
Eigen::Vector3d MeanOverTime(const std::vector<std::int64_t>& time_ns,
                             const std::vector<Eigen::Vector3d>& reading_raw);

}  // namespace truetriad
