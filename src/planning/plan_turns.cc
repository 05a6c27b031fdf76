// SPDX-License-Identifier: Apache-2.0
#include "planning/plan_turns.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <Eigen/Core>

#include "math/dense/cholesky.h"
#include "model/gyro_increment.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// A heading that nothing tells, rad.
constexpr double kAnyHeadingRad = 10.0;
// What a turn of one radian shows of a matrix by itself, before there are turns about all axes.
constexpr double kHardlyKnown = 1.0;
// A turn about of a stretch that gains less in log det is not worth it.
constexpr double kLeastTurnGain = 1e-6;
// A guard: sweeps end by kLeastTurnGain.
constexpr int kMostOrderSweeps = 50;
// Chosen: pieces of six degrees of a quarter turn, over which gravity in the body is straight.
constexpr int kIntegrationSteps = 16;

// 9 entries of the matrix and 3 of each axis term.
constexpr int kBent = 9 + 3 * static_cast<int>(CountAxisTerms(Triad::kGyroscope));
using TurnInformation = Eigen::Matrix<double, kBent, kBent>;

TurnInformation InformationOf(const Eigen::Quaterniond& from,
                              const Eigen::Quaterniond& to,
                              const PlannedTurns& turns,
                              const TriadModel<double>& gyroscope,
                              double attitude_sigma_rad,
                              bool has_heading,
                              bool is_bent) {
  const Eigen::Vector3d turn = RotationLog(from.conjugate() * to);
  GyroMove move;
  for (int i = 0; i <= kIntegrationSteps; ++i) {
    move.time_s.push_back(turns.duration_s * i / kIntegrationSteps);
    move.reading_raw.push_back(gyroscope.RawFromTruth(turn / turns.duration_s));
  }
  // White noise is what it is over the turn, however few readings stand for it.
  const Eigen::Vector3d sigma_raw =
      turns.reading_sigma_raw *
      std::sqrt(kIntegrationSteps / std::max(turns.duration_s * turns.rate_hz, 1.0));
  const GyroIncrement seen = IntegrateMove(
      move, {gyroscope, Eigen::Matrix3d::Zero(), is_bent}, sigma_raw, RateSampling::kInstantaneous);
  const double isotropic =
      turns.sigma_rad * turns.sigma_rad + 2.0 * attitude_sigma_rad * attitude_sigma_rad;
  Eigen::Matrix3d covariance = seen.covariance + isotropic * Eigen::Matrix3d::Identity();
  if (!has_heading) {
    const Eigen::Vector3d vertical = to.conjugate() * Eigen::Vector3d::UnitZ();
    covariance += kAnyHeadingRad * kAnyHeadingRad * vertical * vertical.transpose();
  }
  // By shares of the gains.
  const Eigen::Vector3d gain = gyroscope.sensitivity.rowwise().norm();
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

class Orderer {
 public:
  Orderer(std::vector<TurnInformation> information, std::size_t count, bool is_bent)
      : information_(std::move(information)), count_(count), is_bent_(is_bent) {}

  double Worth(const std::vector<std::size_t>& order) const {
    TurnInformation sum = kHardlyKnown * TurnInformation::Identity();
    for (std::size_t k = 0; k + 1 < order.size(); ++k) {
      sum += information_[order[k] * count_ + order[k + 1]];
    }
    const Eigen::Index size = is_bent_ ? kBent : 9;
    return Cholesky(sum.topLeftCorner(size, size)).LogDeterminant();
  }

 private:
  std::vector<TurnInformation> information_;
  std::size_t count_;
  bool is_bent_;
};

}  // namespace

RecordedMove ExactMove(const Eigen::Quaterniond& from,
                       const Eigen::Quaterniond& to,
                       const PlannedTurns& turns,
                       const TriadModel<double>& gyroscope,
                       const TriadModel<double>& accelerometer,
                       const Eigen::Vector3d& up) {
  RecordedMove move;
  const Eigen::Vector3d turn = RotationLog(from.conjugate() * to);
  const auto steps =
      std::max<std::int64_t>(std::llround(turns.duration_s * turns.rate_hz), kIntegrationSteps);
  for (std::int64_t i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(steps);
    move.time_ns.push_back(std::llround(1e9 * turns.duration_s * share));
    move.gyroscope_raw.push_back(gyroscope.RawFromTruth(turn / turns.duration_s));
    move.accelerometer_raw.push_back(
        accelerometer.RawFromTruth((from * RotationExp(share * turn)).conjugate() * up));
  }
  return move;
}

std::vector<ProgramPose> OrderForGyroscope(std::vector<ProgramPose> poses,
                                           const PlannedTurns& turns,
                                           const TriadModel<double>& gyroscope,
                                           double attitude_sigma_rad,
                                           bool has_heading,
                                           bool is_bent) {
  const std::size_t count = poses.size();
  if (count < 3) return poses;
  std::vector<TurnInformation> information;
  information.reserve(count * count);
  for (const ProgramPose& from : poses) {
    for (const ProgramPose& to : poses) {
      information.push_back(InformationOf(from.world_from_body,
                                          to.world_from_body,
                                          turns,
                                          gyroscope,
                                          attitude_sigma_rad,
                                          has_heading,
                                          is_bent));
    }
  }
  const Orderer orderer(std::move(information), count, is_bent);
  std::vector<std::size_t> order(count);
  for (std::size_t k = 0; k < count; ++k) order[k] = k;
  double worth = orderer.Worth(order);
  for (int sweep = 0; sweep < kMostOrderSweeps; ++sweep) {
    bool improved = false;
    for (std::size_t i = 0; i + 1 < count; ++i) {
      for (std::size_t j = i + 1; j < count; ++j) {
        // The chamber goes to each temperature once.
        if (poses[order[i]].temperature_degc != poses[order[j]].temperature_degc) break;
        for (const bool reversed : {true, false}) {
          std::vector<std::size_t> other = order;
          if (reversed) {
            std::reverse(other.begin() + static_cast<std::ptrdiff_t>(i),
                         other.begin() + static_cast<std::ptrdiff_t>(j) + 1);
          } else {
            std::swap(other[i], other[j]);
          }
          const double other_worth = orderer.Worth(other);
          if (other_worth < worth + kLeastTurnGain) continue;
          worth = other_worth;
          order = std::move(other);
          improved = true;
        }
      }
    }
    if (!improved) break;
  }
  std::vector<ProgramPose> ordered;
  ordered.reserve(count);
  for (const std::size_t place : order) ordered.push_back(poses[place]);
  return ordered;
}

}  // namespace truetriad
