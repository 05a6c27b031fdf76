// SPDX-License-Identifier: Apache-2.0
#include "planning/pose_order.h"

#include <algorithm>
#include <limits>

#include <Eigen/Geometry>

namespace truetriad {
namespace {

// By how much the unit is turned from one pose to the next, rad.
double Turn(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to, bool heading_counts) {
  if (heading_counts) return from.angularDistance(to);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  return std::acos(std::clamp((from.conjugate() * up).dot(to.conjugate() * up), -1.0, 1.0));
}

using Iterator = std::vector<ProgramPose>::iterator;

// Orders first…last, coming from `start`.
void OrderGroup(const Eigen::Quaterniond& start,
                bool heading_counts,
                Iterator first,
                Iterator last) {
  const Eigen::Quaterniond* at = &start;
  for (Iterator place = first; place != last; ++place) {
    double least = std::numeric_limits<double>::infinity();
    Iterator nearest = place;
    for (Iterator other = place; other != last; ++other) {
      const double turn = Turn(*at, other->world_from_body, heading_counts);
      // Equal turns differ by rounding: the first of them, on every machine.
      if (turn < least - 1e-6) {
        least = turn;
        nearest = other;
      }
    }
    std::rotate(place, nearest, nearest + 1);
    at = &place->world_from_body;
  }
  // 2-opt: a stretch run backwards, where its two ends then lie nearer to what joins them.
  for (bool improved = true; improved;) {
    improved = false;
    for (Iterator i = first; i != last; ++i) {
      const Eigen::Quaterniond before = i == first ? start : (i - 1)->world_from_body;
      for (Iterator j = i + 1; j < last; ++j) {
        double saved = Turn(before, i->world_from_body, heading_counts) -
                       Turn(before, j->world_from_body, heading_counts);
        if (j + 1 != last) {
          const Eigen::Quaterniond& after = (j + 1)->world_from_body;
          saved += Turn(j->world_from_body, after, heading_counts) -
                   Turn(i->world_from_body, after, heading_counts);
        }
        if (saved < 1e-6) continue;
        std::reverse(i, j + 1);
        improved = true;
      }
    }
  }
}

}  // namespace

std::vector<ProgramPose> OrderForOperator(std::vector<ProgramPose> poses, bool heading_counts) {
  std::stable_sort(poses.begin(), poses.end(), [](const ProgramPose& a, const ProgramPose& b) {
    return a.temperature_degc < b.temperature_degc;
  });
  Eigen::Quaterniond at = Eigen::Quaterniond::Identity();
  for (Iterator first = poses.begin(); first != poses.end();) {
    const Iterator last = std::find_if(first, poses.end(), [first](const ProgramPose& pose) {
      return pose.temperature_degc != first->temperature_degc;
    });
    OrderGroup(at, heading_counts, first, last);
    at = (last - 1)->world_from_body;
    first = last;
  }
  return poses;
}

}  // namespace truetriad
