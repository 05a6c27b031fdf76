// SPDX-License-Identifier: Apache-2.0
#include "init/gyro_start.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

#include <Eigen/LU>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "math/distributions.h"
#include "truetriad/math/rotation.h"
#include "truetriad/model/finding.h"

namespace truetriad {
namespace {

using Matrix39 = Eigen::Matrix<double, 3, 9>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Matrix312 = Eigen::Matrix<double, 3, 12>;
using Vector12 = Eigen::Matrix<double, 12, 1>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

// Only a bound: each step squares the error of the last one, so that 8 steps end at rounding.
constexpr int kRefinements = 8;
// If a Gauss-Newton step is below this share of the sensitivity, it is the last: a further step
// would change the sensitivity by the square of this, 1e-10.
constexpr double kSmallStep = 1e-5;
// Chosen: a turn whose error exceeds 10 times the median error is an outlier and left out.
constexpr double kWildMiss = 10.0;
// Chosen: readings within 50 ms are averaged into one, which is enough for a start.
constexpr double kLongestStepS = 0.05;
// An error below this share of a direction's length is rounding. No turn of exact data is left out.
constexpr double kExact = 1e-9;
// Chosen: if the smallest singular value is below this share of the largest, the turns are about
// too few axes.
constexpr double kThinTurns = 1e-4;

// Chosen: if readings vary along some direction by less than this share of their largest variation,
// the motion is about too few axes.
constexpr double kThinRates = 1e-3;

// A vector fixed in the world turns in the body as du/dt = u x omega. With omega = C y the change
// over a move is linear in C: the sum of y_j [u]_x dt, column by column.
Matrix39 DirectionChange(const DirectionMove& move, const Eigen::Vector3d& bias_raw) {
  Matrix39 change = Matrix39::Zero();
  const GyroMove& gyro = move.move;
  for (std::size_t i = 1; i < gyro.time_s.size(); ++i) {
    const double half_s = 0.5 * (gyro.time_s[i] - gyro.time_s[i - 1]);
    for (const std::size_t at : {i - 1, i}) {
      const Eigen::Matrix3d weighted = half_s * Skew(move.direction[at].normalized());
      const Eigen::Vector3d raw = gyro.reading_raw[at] - bias_raw;
      for (Eigen::Index j = 0; j < 3; ++j) change.middleCols<3>(3 * j) += raw[j] * weighted;
    }
  }
  return change;
}

// The turn with fewer readings: each new reading is a mean over at most kLongestStepS.
GyroMove Condensed(const GyroMove& move) {
  const std::size_t count = move.time_s.size();
  GyroMove condensed;
  std::size_t begin = 1;
  condensed.time_s.push_back(move.time_s.front());
  condensed.reading_raw.push_back(move.reading_raw.front());
  while (begin + 1 < count) {
    std::size_t end = begin;
    double time_s = 0.0;
    Eigen::Vector3d reading = Eigen::Vector3d::Zero();
    for (; end + 1 < count && move.time_s[end] - move.time_s[begin - 1] <= kLongestStepS; ++end) {
      time_s += move.time_s[end];
      reading += move.reading_raw[end];
    }
    if (end == begin) {  // The readings are farther apart than kLongestStepS.
      time_s = move.time_s[end];
      reading = move.reading_raw[end++];
    }
    const double share = 1.0 / static_cast<double>(end - begin);
    condensed.time_s.push_back(share * time_s);
    condensed.reading_raw.emplace_back(share * reading);
    begin = end;
  }
  if (count > 1) {
    condensed.time_s.push_back(move.time_s.back());
    condensed.reading_raw.push_back(move.reading_raw.back());
  }
  return condensed;
}

// Centre and spread by which readings are normalised, so that large offsets and gains of any size
// do not matter: y = centre + spread z, C (y - b) = K z - k.
struct RateScale {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double spread = 0.0;
  bool covers_all_axes = false;
};

RateScale ScaleOf(const std::vector<DirectionMove>& moves) {
  RateScale scale;
  Eigen::Vector3d& centre = scale.centre;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  double count = 0.0;
  for (const DirectionMove& move : moves) {
    for (const Eigen::Vector3d& reading : move.move.reading_raw) centre += reading;
    count += static_cast<double>(move.move.reading_raw.size());
  }
  centre /= std::max(count, 1.0);
  for (const DirectionMove& move : moves) {
    for (const Eigen::Vector3d& reading : move.move.reading_raw) {
      scatter += (reading - centre) * (reading - centre).transpose();
    }
  }
  const Eigen::Vector3d extent = EigenOfSymmetric3(scatter).values;
  scale.covers_all_axes = std::sqrt(std::max(extent[0], 0.0)) > kThinRates * std::sqrt(extent[2]);
  scale.spread = std::sqrt(extent.sum() / std::max(count, 1.0));
  return scale;
}

// Normal equations of K and k over the moves.
struct NormalOfMoves {
  Matrix12 information = Matrix12::Zero();
  Vector12 gradient = Vector12::Zero();
};

NormalOfMoves NormalOf(const std::vector<DirectionMove>& moves, const RateScale& scale) {
  NormalOfMoves normal;
  for (const DirectionMove& move : moves) {
    Matrix312 change;
    change.leftCols<9>() = DirectionChange(move, scale.centre) / scale.spread;
    Eigen::Matrix3d weighted = Eigen::Matrix3d::Zero();
    const std::vector<double>& time_s = move.move.time_s;
    for (std::size_t i = 1; i < time_s.size(); ++i) {
      const double half_s = 0.5 * (time_s[i] - time_s[i - 1]);
      for (const std::size_t at : {i - 1, i}) {
        weighted += half_s * Skew(move.direction[at].normalized());
      }
    }
    change.rightCols<3>() = -weighted;
    normal.information += change.transpose() * change;
    normal.gradient += change.transpose() * (move.after - move.before);
  }
  return normal;
}

// `what`: the subject and the verb of the message, such as "the motion does"; " not cover …"
// follows.
Error AxesMissing(const std::string& what) {
  return NotEnoughError(Finding(FindingCode::kTurnAxesMissing,
                                "gyroscope: " + what + " not cover all of its axes",
                                "turn the unit about three different axes, each in both directions")
                            .About(Triad::kGyroscope));
}

Error TurnsUnexplained(const std::string& where) {
  return NotEnoughError(
      Finding(FindingCode::kTurnsUnexplained,
              "gyroscope: its turns do not explain how the direction of gravity or field changes " +
                  where,
              "check its unit, axes and time stamps")
          .About(Triad::kGyroscope));
}

}  // namespace

Result<Eigen::Matrix3d> FindGyroSensitivity(const std::vector<DirectionMove>& moves,
                                            const Eigen::Vector3d& bias_raw) {
  Matrix9 information = Matrix9::Zero();
  Vector9 gradient = Vector9::Zero();
  for (const DirectionMove& move : moves) {
    const Matrix39 change = DirectionChange(move, bias_raw);
    information += change.transpose() * change;
    gradient += change.transpose() * (move.after - move.before);
  }
  const SvdSolution svd = SolveBySvd(information, gradient);
  const Vector9 values = svd.values;
  if (!(std::sqrt(values[8]) > kThinTurns * std::sqrt(values[0]))) {
    return AxesMissing("the turns between the poses do");
  }
  const Vector9 solution = svd.x;
  const Eigen::Matrix3d correction = solution.reshaped(3, 3);
  GyroModel model{{correction.inverse(), bias_raw}};
  // The unit's own acceleration during the moves distorts this start. Gauss-Newton refines it from
  // the directions at rest alone.
  std::vector<Matrix39> by_sensitivity(moves.size());
  std::vector<Eigen::Vector3d> missed(moves.size());
  std::vector<double> sizes(moves.size());
  std::vector<GyroMove> turns;
  for (const DirectionMove& move : moves) turns.push_back(Condensed(move.move));
  for (int round = 0; round < kRefinements; ++round) {
    for (std::size_t i = 0; i < moves.size(); ++i) {
      const DirectionMove& move = moves[i];
      const GyroIncrement increment =
          IntegrateMove(turns[i], model, Eigen::Vector3d::Ones(), RateSampling::kInstantaneous);
      const Eigen::Vector3d predicted = increment.rotation.conjugate() * move.before;
      // Exp(-J d) u = u + [u]_x J d.
      by_sensitivity[i] = Skew(predicted) * increment.by_sensitivity;
      missed[i] = move.after - predicted;
      sizes[i] = missed[i].norm();
    }
    const double wild = kWildMiss * std::max(Median(sizes), kExact * moves.front().before.norm());
    information.setZero();
    gradient.setZero();
    for (std::size_t i = 0; i < moves.size(); ++i) {
      if (sizes[i] > wild) continue;
      information += by_sensitivity[i].transpose() * by_sensitivity[i];
      gradient += by_sensitivity[i].transpose() * missed[i];
    }
    const Vector9 step = PivotedCholesky(information).SolveVector(gradient);
    if (!step.allFinite()) break;
    model.triad.sensitivity += step.reshaped(3, 3);
    if (step.norm() < kSmallStep * model.triad.sensitivity.norm()) break;
  }
  if (!model.triad.sensitivity.allFinite()) {
    return TurnsUnexplained("between the poses");
  }
  return model.triad.sensitivity;
}

Result<TriadModel<double>> FindGyroModel(const std::vector<DirectionMove>& moves,
                                         const std::optional<Eigen::Matrix3d>& sensitivity,
                                         const std::optional<Eigen::Vector3d>& bias_raw) {
  const RateScale scale = ScaleOf(moves);
  const Eigen::Vector3d& centre = scale.centre;
  const double spread = scale.spread;
  if (!sensitivity && !scale.covers_all_axes) {
    return AxesMissing("the motion does");
  }
  const auto [information, gradient] = NormalOf(moves, scale);
  // K = C spread and k = C (b - centre); known entries are fixed: x = base + free t.
  Vector12 base = Vector12::Zero();
  Eigen::MatrixXd free = Matrix12::Identity();
  if (sensitivity) {
    const Eigen::Matrix3d correction = sensitivity->inverse();
    base.head<9>() = (spread * correction).reshaped();
    free = Matrix12::Identity().rightCols<3>();
    if (bias_raw) return TriadModel<double>{*sensitivity, *bias_raw};
  } else if (bias_raw) {
    // k = K (b - centre) / spread.
    free = Matrix12::Identity().leftCols<9>();
    for (int axis = 0; axis < 3; ++axis) {
      free.block<3, 3>(9, 3 * axis) =
          ((*bias_raw - centre)[axis] / spread) * Eigen::Matrix3d::Identity();
    }
  }
  const Vector12 right = gradient - information * base;
  const Eigen::VectorXd solution = PivotedCholesky(TransposedCongruence(free, information))
                                       .SolveVector(TransposeTimesVector(free, right));
  const Vector12 found = base + TimesVector(free, solution);
  const Eigen::Matrix3d correction = Eigen::Matrix3d(found.head<9>().reshaped(3, 3)) / spread;
  TriadModel<double> model;
  model.sensitivity = sensitivity.value_or(correction.inverse());
  model.bias = bias_raw.value_or(centre + model.sensitivity * found.tail<3>());
  if (!model.sensitivity.allFinite() || !model.bias.allFinite()) {
    return TurnsUnexplained("in the body frame");
  }
  return model;
}

}  // namespace truetriad
