// SPDX-License-Identifier: Apache-2.0
//
// Sampling consensus: ellipsoids through as few readings as determine one, the one with the
// smallest distance to most readings, and then those about it.
//
// Scored by geometric distance, to first order |F| / |grad F|. Relative to its own radius an
// ellipsoid that runs to infinity would be the best. No thinning by direction: scattered bad
// readings would become the majority.
#include "init/ellipsoid_consensus.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <random>
#include <tuple>
#include <utility>

#include "math/dense/cholesky.h"
#include "math/dense/lu.h"
#include "math/dense/qr.h"
#include "math/distributions.h"

namespace truetriad {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Readings that score; their quantile is known to some percent.
constexpr std::size_t kMostScored = 1500;
// With a fifth of the readings bad, 0.8^9 = 13 % of the samples are good: 40, of which the better
// ones cover the sphere.
constexpr int kSamples = 300;
// The distance that this share of the readings stays below; the others may be bad.
constexpr double kGoodShare = 0.72;
// With a fifth bad that share is 1.6 σ: the readings of one ellipsoid are within 5 σ.
constexpr double kReachOfShare = 3.0;
constexpr int kRefinements = 6;
// Of the spread: below it is rounding.
constexpr double kRounding = 1e-9;

// z^T Q z + 2 q^T z = 1, as x^2 y^2 z^2 2yz 2xz 2xy 2x 2y 2z.
using Coefficients = Eigen::Matrix<double, 9, 1>;

Coefficients RowOf(const Vector3d& z) {
  Coefficients row;
  row << z.cwiseAbs2(), 2.0 * z.y() * z.z(), 2.0 * z.x() * z.z(), 2.0 * z.x() * z.y(), 2.0 * z;
  return row;
}

struct EllipsoidQuadric {
  Matrix3d Q;
  Vector3d q;

  explicit EllipsoidQuadric(const Coefficients& p) : q(p.tail<3>()) {
    Q << p[0], p[5], p[4], p[5], p[1], p[3], p[4], p[3], p[2];
  }

  bool IsEllipsoid() const {
    const Vector3d centre = -Solve3(Q, q);
    const double level = 1.0 - q.dot(centre);
    return centre.allFinite() && std::abs(level) > 0.0 &&
           CholeskyRootOfPositive(Q / level).has_value();
  }

  double Distance(const Vector3d& z) const {
    const Vector3d half_gradient = Q * z + q;
    return 0.5 * std::abs(z.dot(half_gradient) + q.dot(z) - 1.0) / half_gradient.norm();
  }
};

class Consensus {
 public:
  // `readings` without repeats.
  Consensus(const std::vector<Vector3d>& readings, bool axis_aligned)
      : axis_aligned_(axis_aligned), needed_(axis_aligned ? 6 : 9) {
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      values.reserve(readings.size());
      for (const Vector3d& reading : readings) values.push_back(reading[axis]);
      centre_[axis] = Median(values);
      for (double& value : values) value = std::abs(value - centre_[axis]);
      spread_[axis] = Median(values);
    }
    const std::size_t count = std::min(readings.size(), kMostScored);
    for (std::size_t k = 0; k < count; ++k) {
      scored_.push_back(Mapped(readings[k * readings.size() / count]));
    }
  }

  bool IsPossible() const {
    return scored_.size() > static_cast<std::size_t>(needed_) && (spread_.array() > 0.0).all();
  }

  Vector3d Mapped(const Vector3d& reading) const {
    return (reading - centre_).cwiseQuotient(spread_);
  }

  // The ellipsoid and the distance within which readings are its own.
  std::optional<std::pair<EllipsoidQuadric, double>> Find() {
    std::mt19937_64 random(1);
    std::optional<EllipsoidQuadric> best;
    double least = std::numeric_limits<double>::infinity();
    const auto consider = [&](const Coefficients& p) {
      const EllipsoidQuadric quadric(p);
      if (!p.allFinite() || !quadric.IsEllipsoid()) return false;
      const double score = Score(quadric);
      if (!(score < least)) return false;
      best = quadric;
      least = score;
      return true;
    };
    for (int sample = 0; sample < kSamples; ++sample) consider(Through(&random));
    for (int round = 0; round < kRefinements && best; ++round) {
      if (!consider(FitWithin(*best, kReachOfShare * least))) break;
    }
    if (!best) return std::nullopt;
    return std::pair(*best, kReachOfShare * std::max(least, kRounding));
  }

 private:
  double Score(const EllipsoidQuadric& quadric) {
    distances_.clear();
    for (const Vector3d& z : scored_) distances_.push_back(quadric.Distance(z));
    const auto place =
        distances_.begin() +
        static_cast<std::ptrdiff_t>(kGoodShare * static_cast<double>(distances_.size() - 1));
    std::nth_element(distances_.begin(), place, distances_.end());
    return *place;
  }

  // Through random readings.
  Coefficients Through(std::mt19937_64* random) const {
    Eigen::Matrix<double, 9, 9> design = Eigen::Matrix<double, 9, 9>::Identity();
    Coefficients values = Coefficients::Ones();
    for (int k = 0; k < needed_; ++k) design.row(k) = RowOf(scored_[(*random)() % scored_.size()]);
    if (axis_aligned_) {
      design.bottomRows<3>().setZero();
      for (int k = 6; k < 9; ++k) design(k, k - 3) = 1.0;
      values.tail<3>().setZero();
    }
    return Solve9(design, values);
  }

  // Least squares over the readings near `quadric`.
  Coefficients FitWithin(const EllipsoidQuadric& quadric, double reach) const {
    std::vector<Vector3d> near;
    for (const Vector3d& z : scored_) {
      if (quadric.Distance(z) <= std::max(reach, kRounding)) near.push_back(z);
    }
    Eigen::MatrixXd design(static_cast<Eigen::Index>(near.size()), 9);
    for (Eigen::Index k = 0; k < design.rows(); ++k) {
      design.row(k) = RowOf(near[static_cast<std::size_t>(k)]);
    }
    if (axis_aligned_) design.middleCols<3>(3).setZero();
    return LeastSquares(design).SolveVector(Eigen::VectorXd::Ones(design.rows()));
  }

  bool axis_aligned_;
  int needed_;
  Vector3d centre_, spread_;
  std::vector<Vector3d> scored_;  // Mapped.
  std::vector<double> distances_;
};

}  // namespace

std::vector<Vector3d> ReadingsOfOneEllipsoid(const std::vector<Vector3d>& readings,
                                             bool axis_aligned) {
  std::vector<Vector3d> distinct = readings;
  const auto key = [](const Vector3d& v) { return std::tuple(v.x(), v.y(), v.z()); };
  std::sort(distinct.begin(), distinct.end(), [&](const Vector3d& a, const Vector3d& b) {
    return key(a) < key(b);
  });
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  std::vector<Vector3d> own;
  Consensus consensus(distinct, axis_aligned);
  if (!consensus.IsPossible()) return own;
  const auto found = consensus.Find();
  if (!found) return own;
  for (const Vector3d& reading : readings) {
    if (found->first.Distance(consensus.Mapped(reading)) <= found->second) own.push_back(reading);
  }
  return own;
}

}  // namespace truetriad
