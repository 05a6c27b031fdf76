// SPDX-License-Identifier: Apache-2.0
#include "planning/pose_order.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "math/dense/cholesky.h"
#include "model/gyro_increment.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

using Order = std::vector<std::size_t>;

Order::iterator At(Order* order, std::size_t place) {
  return order->begin() + static_cast<std::ptrdiff_t>(place);
}

// σ of an unknown heading, rad: more than a full turn.
constexpr double kAnyHeadingRad = 10.0;
// The prior information of every entry, a σ of 100 %. It keeps log det finite even if an axis has
// no turns.
constexpr double kHardlyKnown = 1.0;
// The order is changed only if the gain, in rad of turning or in log det, is larger than this.
// Smaller gains are rounding.
constexpr double kLeastTurnGain = 1e-6;
// A guard: usually kLeastTurnGain ends the sweeps.
constexpr int kMostOrderSweeps = 50;
// Chosen: 6 deg per step of a quarter turn, over which gravity in the body frame is nearly linear.
constexpr int kIntegrationSteps = 16;

// Number of a gyroscope's parameters with axis terms: 9 entries of the matrix and 3 of each term.
constexpr int kBent = 9 + 3 * static_cast<int>(CountAxisTerms(Triad::kGyroscope));
using TurnInformation = Eigen::Matrix<double, kBent, kBent>;

TurnInformation InformationOf(const Eigen::Quaterniond& from,
                              const Eigen::Quaterniond& to,
                              const PlannedTurns& turns) {
  const Eigen::Vector3d turn = RotationLog(from.conjugate() * to);
  GyroMove move;
  for (int i = 0; i <= kIntegrationSteps; ++i) {
    move.time_s.push_back(turns.duration_s * i / kIntegrationSteps);
    move.reading_raw.push_back(turns.gyroscope.RawFromTruth(turn / turns.duration_s));
  }
  // The noise of the whole turn must not depend on the number of integration steps.
  const Eigen::Vector3d sigma_raw =
      turns.reading_sigma_raw *
      std::sqrt(kIntegrationSteps / std::max(turns.duration_s * turns.rate_hz, 1.0));
  const GyroIncrement seen =
      IntegrateMove(move,
                    {turns.gyroscope, Eigen::Matrix3d::Zero(), turns.is_bent},
                    sigma_raw,
                    RateSampling::kInstantaneous);
  const double isotropic =
      turns.sigma_rad * turns.sigma_rad + 2.0 * turns.attitude_sigma_rad * turns.attitude_sigma_rad;
  Eigen::Matrix3d covariance = seen.covariance + isotropic * Eigen::Matrix3d::Identity();
  if (!turns.has_heading) {
    const Eigen::Vector3d vertical = to.conjugate() * Eigen::Vector3d::UnitZ();
    covariance += kAnyHeadingRad * kAnyHeadingRad * vertical * vertical.transpose();
  }
  // Derivatives with respect to relative changes of the gains.
  const Eigen::Vector3d gain = turns.gyroscope.sensitivity.rowwise().norm();
  Eigen::Matrix<double, 3, kBent> by;
  by.leftCols<9>() = seen.by_sensitivity * gain.replicate<3, 1>().asDiagonal();
  int at = 9;
  for (const AxisTermInfo& info : kAxisTerms) {
    if (info.triad != Triad::kGyroscope) continue;
    by.middleCols<3>(at) = seen.by_axis_term[info.term];
    at += 3;
  }
  return by.transpose() * Cholesky(covariance).Solve(by);
}

// Changes places [first, last) of the order as long as that lowers cost(order): reverses runs of
// poses and, if `swaps`, swaps pairs. Only poses of one temperature change places, so that the
// chamber goes to each temperature once.
template <class Cost>
void Improve(const std::vector<ProgramPose>& poses,
             std::size_t first,
             std::size_t last,
             bool swaps,
             const Cost& cost,
             Order* order) {
  double least = cost(*order);
  bool improved = true;
  for (int sweep = 0; improved && sweep < kMostOrderSweeps; ++sweep) {
    improved = false;
    for (std::size_t i = first; i + 1 < last; ++i) {
      for (std::size_t j = i + 1; j < last; ++j) {
        if (poses[(*order)[i]].temperature_degc != poses[(*order)[j]].temperature_degc) break;
        for (const bool reversed : {true, false}) {
          if (!reversed && !swaps) continue;
          Order other = *order;
          if (reversed) {
            std::reverse(At(&other, i), At(&other, j + 1));
          } else {
            std::swap(other[i], other[j]);
          }
          const double other_cost = cost(other);
          if (other_cost > least - kLeastTurnGain) continue;
          least = other_cost;
          *order = std::move(other);
          improved = true;
        }
      }
    }
  }
}

std::vector<ProgramPose> InOrder(const std::vector<ProgramPose>& poses, const Order& order) {
  std::vector<ProgramPose> ordered;
  for (const std::size_t place : order) ordered.push_back(poses[place]);
  return ordered;
}

}  // namespace

RecordedMove ExactMove(const Eigen::Quaterniond& from,
                       const Eigen::Quaterniond& to,
                       const PlannedTurns& turns,
                       const TriadModel<double>& accelerometer,
                       const Eigen::Vector3d& up) {
  RecordedMove move;
  const Eigen::Vector3d turn = RotationLog(from.conjugate() * to);
  const auto steps =
      std::max<std::int64_t>(std::llround(turns.duration_s * turns.rate_hz), kIntegrationSteps);
  for (std::int64_t i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(steps);
    move.time_ns.push_back(std::llround(1e9 * turns.duration_s * share));
    move.gyroscope_raw.push_back(turns.gyroscope.RawFromTruth(turn / turns.duration_s));
    move.accelerometer_raw.push_back(
        accelerometer.RawFromTruth((from * RotationExp(share * turn)).conjugate() * up));
  }
  return move;
}

std::vector<ProgramPose> OrderForOperator(std::vector<ProgramPose> poses, bool heading_counts) {
  std::stable_sort(poses.begin(), poses.end(), [](const ProgramPose& a, const ProgramPose& b) {
    return a.temperature_degc < b.temperature_degc;
  });
  const std::size_t count = poses.size();
  // Angles of the turns from each pose (row) to each pose, rad; the last row holds the angles from
  // a level unit.
  std::vector<double> turns;
  for (std::size_t from = 0; from <= count; ++from) {
    const Eigen::Quaterniond at =
        from < count ? poses[from].world_from_body : Eigen::Quaterniond::Identity();
    const Eigen::Vector3d up = at.conjugate() * Eigen::Vector3d::UnitZ();
    for (const ProgramPose& to : poses) {
      const Eigen::Vector3d next_up = to.world_from_body.conjugate() * Eigen::Vector3d::UnitZ();
      turns.push_back(heading_counts ? at.angularDistance(to.world_from_body)
                                     : std::acos(std::clamp(up.dot(next_up), -1.0, 1.0)));
    }
  }
  const auto turn = [&](std::size_t from, std::size_t to) { return turns[from * count + to]; };
  Order order(count);
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t first = 0, last = 0; first < count; first = last) {
    while (last < count && poses[last].temperature_degc == poses[first].temperature_degc) ++last;
    const std::size_t start = first > 0 ? order[first - 1] : count;
    for (std::size_t k = first, at = start; k < last; at = order[k++]) {
      double least = std::numeric_limits<double>::infinity();
      std::size_t nearest = k;
      for (std::size_t other = k; other < last; ++other) {
        // Angles that should be equal differ by rounding. The first pose then wins, so that all
        // machines choose the same one.
        if (turn(at, order[other]) > least - kLeastTurnGain) continue;
        least = turn(at, order[other]);
        nearest = other;
      }
      std::rotate(At(&order, k), At(&order, nearest), At(&order, nearest + 1));
    }
    const auto turning = [&](const Order& trial) {
      double sum = 0.0;
      for (std::size_t k = first, at = start; k < last; at = trial[k++]) sum += turn(at, trial[k]);
      return sum;
    };
    Improve(poses, first, last, /*swaps=*/false, turning, &order);
  }
  return InOrder(poses, order);
}

std::vector<ProgramPose> OrderForGyroscope(const std::vector<ProgramPose>& poses,
                                           const PlannedTurns& turns) {
  const std::size_t count = poses.size();
  std::vector<TurnInformation> information;
  information.reserve(count * count);
  for (const ProgramPose& from : poses) {
    for (const ProgramPose& to : poses) {
      information.push_back(InformationOf(from.world_from_body, to.world_from_body, turns));
    }
  }
  const Eigen::Index size = turns.is_bent ? kBent : 9;
  const auto cost = [&](const Order& order) {
    TurnInformation sum = kHardlyKnown * TurnInformation::Identity();
    for (std::size_t k = 0; k + 1 < count; ++k) sum += information[order[k] * count + order[k + 1]];
    return -Cholesky(sum.topLeftCorner(size, size)).LogDeterminant();
  };
  Order order(count);
  std::iota(order.begin(), order.end(), 0);
  Improve(poses, 0, count, /*swaps=*/true, cost, &order);
  return InOrder(poses, order);
}

}  // namespace truetriad
