// SPDX-License-Identifier: Apache-2.0
#include "start/why_no_start.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "base/messages.h"
#include "math/dense/eigenvalues.h"
#include "problem/start_values.h"
#include "truetriad/model/finding.h"

namespace truetriad {
namespace {

// Chosen: readings with less than a fifth of their largest extent in one direction count as lying
// in a plane; evenly spread readings have a ratio near 1.
constexpr double kThinShare = 0.2;

// The axis nearest to the direction in which readings vary too little; unset if there is none.
std::optional<int> ThinAxis(const std::vector<Eigen::Vector3d>& readings) {
  if (readings.size() < 3) return std::nullopt;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& reading : readings) mean += reading;
  mean /= static_cast<double>(readings.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& reading : readings) {
    scatter += (reading - mean) * (reading - mean).transpose();
  }
  const SymmetricEigen3 solver = EigenOfSymmetric3(scatter);
  const Eigen::Vector3d extent = solver.values.cwiseMax(0.0).cwiseSqrt();
  if (extent[0] > kThinShare * extent[2]) return std::nullopt;
  int axis = 0;
  solver.vectors.col(0).cwiseAbs().maxCoeff(&axis);
  return axis;
}

// The advice to add poses that make an axis observable.
std::string PosesAlong(Triad triad, int axis) {
  return std::string("add poses with body ") + AxisLetter(axis) +
         (triad == Triad::kAccelerometer ? " up and down" : " along the field and against it");
}

}  // namespace

Error WhyNoStart(const PoseSet& poses, Triad triad, const Error& error) {
  const std::vector<Eigen::Vector3d> readings = ReadingsOf(poses, triad);
  if (!error.finding || readings.empty()) return error;
  const std::string name(TriadName(triad));
  const auto all = [&readings](auto holds) {
    return std::all_of(readings.begin(), readings.end(), holds);
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int next = (axis + 1) % 3;
    if (all([&](const auto& reading) { return reading[axis] == readings.front()[axis]; })) {
      return NotEnoughError(Finding(FindingCode::kConstantAxis,
                                    name + ": its " + AxisLetter(axis) + " axis reads " +
                                        Format("%.6g in every pose", readings.front()[axis]),
                                    "check for a dead axis or a wrong column")
                                .About(triad, axis));
    }
    if (all([&](const auto& reading) { return reading[axis] == reading[next]; })) {
      return NotEnoughError(Finding(FindingCode::kRepeatedAxis,
                                    name + ": its axes " + AxisLetter(axis) + " and " +
                                        AxisLetter(next) + " read the same in every pose",
                                    "give each axis its own column")
                                .About(triad, axis));
    }
  }
  if (const auto axis = ThinAxis(readings)) {
    return NotEnoughError(
        Finding(FindingCode::kTooFewDirections,
                name + ": its readings lie near a plane: they vary too little along " +
                    AxisLetter(*axis),
                PosesAlong(triad, *axis))
            .About(triad, *axis));
  }
  Finding why = *error.finding;
  if (!why.sensor) {
    why.About(triad);
    why.text = name + ": " + why.text;
  }
  return NotEnoughError(std::move(why));
}

Error WhyNoGyroscope(const PoseSet& poses, const Error& error) {
  std::vector<const Finding*> faults;
  for (const RecordedMove& move : poses.moves) {
    if (move.fault) faults.push_back(&*move.fault);
  }
  for (const KnownTurn& turn : poses.turns) {
    if (turn.move.fault) faults.push_back(&*turn.move.fault);
  }
  const std::size_t turns = poses.moves.size() + poses.turns.size();
  if (!error.finding || 2 * faults.size() < turns || faults.empty()) return error;
  Finding why = *error.finding;
  why.text += ": " + std::to_string(faults.size()) + " of " + std::to_string(turns) +
              " turns are skipped; the first because " + faults.front()->text;
  why.remedy = FindingKindOf(faults.front()->code).remedy;
  return NotEnoughError(std::move(why));
}

std::vector<WeakDirection> WeakDirectionsOfReadings(const PoseSet& poses,
                                                    const CalibrateOptions& options) {
  std::vector<WeakDirection> weak;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const std::vector<Eigen::Vector3d> readings = ReadingsOf(poses, triad);
    if (!options.triads[triad].enabled) continue;
    const std::optional<int> thin = ThinAxis(readings);
    if (!thin) continue;
    const std::string name(1, AxisLetter(*thin)), sensor(TriadName(triad));
    WeakDirection direction;
    direction.description = sensor + " bias " + name + " and scale " + name +
                            " are indistinguishable: the readings vary too little along the " +
                            name + " axis";
    direction.advice = PosesAlong(triad, *thin);
    direction.sigma = std::numeric_limits<double>::infinity();
    weak.push_back(std::move(direction));
  }
  return weak;
}

}  // namespace truetriad
