// SPDX-License-Identifier: Apache-2.0
//
// Linear ellipsoid fits, made independent of the frame of the data by repetition.
//
// Quadric           z^T Q z + 2 q^T z = s
// Centre and shape  c = -Q^-1 q,  B = Q / (s + q^T Q^-1 q)
//
// Least squares     minimise |D p - 1| over p = (Q, q), s = 1.
// Constrained       minimise |D' p'| over p' = (Q, q, -s) with 4 J - I^2 = 1, where
//                   I = tr Q and J = the sum of the principal 2x2 minors of Q: an ellipsoid always.
//                   Li and Griffiths, "Least squares ellipsoid specific fitting", GMP 2004,
//                   with k = 4.
//
// 4 J > I^2 excludes ellipsoids much longer than wide, and both algebraic costs depend on the
// frame. So the data are first scaled axis by axis (gains of a triad may differ by a factor of 25,
// cross-axis terms are small). Then they are mapped to the frame in which the last ellipsoid is the
// unit sphere, and fitted again, until the sphere no longer changes: there the constraint is
// inactive, and the costs are nearly geometric.
#include "init/ellipsoid_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>

#include <Eigen/LU>
#include <glog/logging.h>

#include "base/messages.h"
#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/lu.h"
#include "math/dense/products.h"
#include "math/dense/qr.h"
#include "truetriad/model/finding.h"

namespace truetriad {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

enum class Method { kAxisAligned, kLeastSquares, kConstrained };

// Chosen: if a fit needs more rounds, it moves in a direction that the data do not determine.
constexpr int kMaxRounds = 30;
// The fit has converged when centre and radii of the unit sphere change by less than this.
constexpr double kSettled = 1e-10;
// Chosen: no sensor has noise of a tenth of the radius. If residuals are larger than this, they
// have another cause.
constexpr double kMuchScatter = 0.1;
// The least conditioning. If it is smaller, the smallest singular value of the design matrix is
// rounding error.
constexpr double kMinConditioning = 1e-7;

// z = whitening (y - centre).
struct Frame {
  Vector3d centre = Vector3d::Zero();
  Matrix3d whitening = Matrix3d::Identity();

  // The points in this frame, 3 x n.
  Eigen::Matrix3Xd Map(const std::vector<Vector3d>& points) const {
    Eigen::Matrix3Xd mapped(3, points.size());
    for (std::size_t k = 0; k < points.size(); ++k) {
      mapped.col(static_cast<Eigen::Index>(k)) = whitening * (points[k] - centre);
    }
    return mapped;
  }
};

struct Quadric {
  Matrix3d quadratic = Matrix3d::Zero();  // Q
  Vector3d linear = Vector3d::Zero();     // q
  double level = 1.0;                     // s
};

int ParameterCount(Method method) { return method == Method::kAxisAligned ? 6 : 9; }

// A row per point: x^2 y^2 z^2 [2yz 2xz 2xy] 2x 2y 2z.
MatrixXd Design(const Eigen::Matrix3Xd& points, Method method) {
  MatrixXd design(points.cols(), ParameterCount(method));
  const auto x = points.row(0).transpose().array();
  const auto y = points.row(1).transpose().array();
  const auto z = points.row(2).transpose().array();
  design.leftCols<3>() = points.transpose().array().square();
  if (method != Method::kAxisAligned) {
    design.col(3) = 2.0 * y * z;
    design.col(4) = 2.0 * x * z;
    design.col(5) = 2.0 * x * y;
  }
  design.rightCols<3>() = 2.0 * points.transpose();
  return design;
}

// `coefficients` has one entry for each column of Design.
Quadric QuadricOf(const VectorXd& coefficients, double level) {
  Quadric quadric;
  quadric.level = level;
  quadric.quadratic.diagonal() = coefficients.head<3>();
  if (coefficients.size() == 9) {
    quadric.quadratic(1, 2) = quadric.quadratic(2, 1) = coefficients(3);
    quadric.quadratic(0, 2) = quadric.quadratic(2, 0) = coefficients(4);
    quadric.quadratic(0, 1) = quadric.quadratic(1, 0) = coefficients(5);
  }
  quadric.linear = coefficients.tail<3>();
  return quadric;
}

std::optional<Quadric> ConstrainedFit(const MatrixXd& design) {
  // R of the QR factors, with the unconstrained columns (2x 2y 2z 1) first: the last six columns
  // and rows of R are the square root of the Schur complement, without squaring the condition
  // number.
  constexpr int kFree = 4;
  // A symmetric 3x3 matrix has six entries.
  constexpr int kQuadratic = 6;
  using Matrix6d = Eigen::Matrix<double, kQuadratic, kQuadratic>;
  MatrixXd ordered(design.rows(), kFree + kQuadratic);
  ordered << design.rightCols<3>(), VectorXd::Ones(design.rows()), design.leftCols<kQuadratic>();
  const MatrixXd reduced = UpperTriangle(ordered);
  const MatrixXd root = reduced.bottomRightCorner(reduced.rows() - kFree, kQuadratic);

  // a^T C a = 4 J - I^2.
  Matrix6d constraint = Matrix6d::Zero();
  constraint.topLeftCorner<3, 3>().setOnes();
  constraint.diagonal() << -1, -1, -1, -4, -4, -4;
  const Matrix6d scatter = TransposeTimes(root, root);
  const Matrix6d inverse = InverseByLu(constraint);
  for (const Vector6d& quadratic : RealEigenvectors(inverse * scatter)) {
    // Exactly one of the six eigenvectors meets the constraint. Li and Griffiths 2004.
    if (quadratic.dot(constraint * quadratic) <= 0.0) continue;
    const Eigen::Vector4d free =
        -SolveUpper4(reduced.topLeftCorner<kFree, kFree>(),
                     reduced.topRightCorner<kFree, kQuadratic>() * quadratic);
    Eigen::Matrix<double, 9, 1> coefficients;
    coefficients << quadratic, free.head<3>();
    return QuadricOf(coefficients, -free(3));
  }
  return std::nullopt;
}

std::optional<Quadric> Fit(const Eigen::Matrix3Xd& points, Method method) {
  const MatrixXd design = Design(points, method);
  if (method == Method::kConstrained) return ConstrainedFit(design);
  const VectorXd ones = VectorXd::Ones(points.cols());
  return QuadricOf(LeastSquares(design).SolveVector(ones), 1.0);
}

// The frame in which the quadric is the unit sphere; nullopt if the quadric is not an ellipsoid.
// The whitening is triangular, so that an axis-aligned ellipsoid keeps its axes.
std::optional<Frame> SphereFrame(const Quadric& quadric) {
  const Vector3d centre = -Solve3(quadric.quadratic, quadric.linear);
  const double level = quadric.level - quadric.linear.dot(centre);
  const std::optional<Matrix3d> root = CholeskyRootOfPositive(quadric.quadratic / level);
  if (!centre.allFinite() || !(std::abs(level) > 0.0) || !root) return std::nullopt;
  return Frame{centre, root->transpose()};
}

std::optional<Frame> FitInSettledFrame(const std::vector<Vector3d>& points,
                                       Method method,
                                       Frame frame) {
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::optional<Quadric> quadric = Fit(frame.Map(points), method);
    const std::optional<Frame> sphere = quadric ? SphereFrame(*quadric) : std::nullopt;
    if (!sphere) return std::nullopt;
    frame.centre += Solve3(frame.whitening, sphere->centre);
    frame.whitening = sphere->whitening * frame.whitening;
    const double change = sphere->centre.norm() + (sphere->whitening - Matrix3d::Identity()).norm();
    if (change < kSettled) break;
  }
  if (!frame.centre.allFinite() || !frame.whitening.allFinite()) return std::nullopt;
  return frame;
}

double Conditioning(const Eigen::Matrix3Xd& points, Method method) {
  const VectorXd singular = SingularValues(UpperTriangle(Design(points, method)));
  return singular(singular.size() - 1) / singular(0);
}

// The mean square distance of the points from the ellipsoid of `frame`, measured in the frame
// `start`. The distance is computed to first order as F / |grad F| with F = |z|^2 - 1 (Sampson
// 1982). All candidates are measured in one frame, because a diverged ellipsoid has a small
// residual in its own frame.
double GeometricResidual(const std::vector<Vector3d>& points,
                         const Frame& frame,
                         const Frame& start) {
  const Eigen::Matrix3Xd sphere = frame.Map(points);
  const Matrix3d sphere_from_start = frame.whitening * start.whitening.inverse();
  return ((sphere.colwise().squaredNorm().array() - 1.0) /
          (2.0 * (sphere_from_start.transpose() * sphere).colwise().norm().array()))
      .square()
      .mean();
}

Result<Ellipsoid> BestFit(const std::vector<Vector3d>& points, const std::vector<Method>& methods) {
  const int needed = ParameterCount(methods.front());
  const std::string count = std::to_string(points.size()) + " readings";
  if (points.size() < static_cast<std::size_t>(needed)) {
    return NotEnoughError(Finding(FindingCode::kTooFewDirections,
                                  count + " cannot determine an ellipsoid; at least " +
                                      std::to_string(needed) + " in different attitudes are needed")
                              .With("readings", static_cast<double>(points.size()))
                              .With("needed", needed));
  }
  const std::string more_attitudes =
      "add attitudes with every axis up, down and level, and some on edges and corners";
  Vector3d mean = Vector3d::Zero();
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!points[k].allFinite()) {
      return Error(ErrorCode::kUnreadableNumber,
                   "reading " + std::to_string(k + 1) + " of " + std::to_string(points.size()) +
                       " is not finite");
    }
    mean += points[k] / static_cast<double>(points.size());
  }
  Frame start;
  start.centre = mean;
  const Vector3d spread =
      (start.Map(points).rowwise().squaredNorm() / static_cast<double>(points.size())).cwiseSqrt();
  const Error undetermined = NotEnoughError(Finding(
      FindingCode::kTooFewDirections,
      count +
          " do not determine an ellipsoid: they lie close to a plane or another surface, or cover "
          "too little of the sphere",
      more_attitudes + " (six faces alone are enough for a diagonal model or with `attitudes: { "
                       "six_face: {} }`)"));
  // If a spread is of the size of rounding, that axis always reads one value.
  if ((spread.array() <= 1e-12 * mean.array().abs()).any()) return undetermined;
  start.whitening = spread.cwiseInverse().asDiagonal();
  if (Conditioning(start.Map(points), methods.front()) < kMinConditioning) return undetermined;

  std::optional<Frame> best;
  double best_residual = std::numeric_limits<double>::infinity();
  for (const Method method : methods) {
    const std::optional<Frame> frame = FitInSettledFrame(points, method, start);
    if (!frame) continue;
    const double residual = GeometricResidual(points, *frame, start);
    if (residual < best_residual) {
      best = frame;
      best_residual = residual;
    }
  }
  if (!best) {
    return NotEnoughError(
        Finding(FindingCode::kNotAnEllipsoid,
                "the best-fitting quadric surface of " + count + " is not an ellipsoid",
                "add attitudes, or look for readings disturbed by motion or magnetic objects"));
  }
  const Eigen::Matrix3Xd sphere = best->Map(points);
  Ellipsoid ellipsoid;
  ellipsoid.centre = best->centre;
  ellipsoid.shape = best->whitening.transpose() * best->whitening;
  ellipsoid.conditioning = Conditioning(sphere, methods.front());
  ellipsoid.relative_rms = std::sqrt((sphere.colwise().norm().array() - 1.0).square().mean());
  // If the conditioning is below the residual, scatter determines the ellipsoid: the readings are
  // near a plane, or on a small cap. This does not hold for the axis-aligned fit, in which a tilted
  // ellipsoid leaves a residual that is not scatter.
  const double least = methods.front() == Method::kAxisAligned ? 0.0 : ellipsoid.relative_rms;
  if (ellipsoid.conditioning > std::max(kMinConditioning, least)) return ellipsoid;
  if (ellipsoid.relative_rms < kMuchScatter) return undetermined;
  return NotEnoughError(
      Finding(FindingCode::kTooFewDirections,
              count +
                  " do not determine an ellipsoid: they cover too little of the sphere, or mix "
                  "measuring ranges, units of measure or sensors" +
                  Format(" (RMS residual of the best fit: %.0f %% of its radius)",
                         100.0 * ellipsoid.relative_rms),
              more_attitudes + "; plot the magnitude over time")
          .With("readings", static_cast<double>(points.size()))
          .With("scatter", ellipsoid.relative_rms));
}

}  // namespace

Result<Ellipsoid> FitAxisAlignedEllipsoid(const std::vector<Vector3d>& points) {
  return BestFit(points, {Method::kAxisAligned});
}

Result<Ellipsoid> FitEllipsoid(const std::vector<Vector3d>& points) {
  return BestFit(points, {Method::kLeastSquares, Method::kConstrained});
}

Matrix3d SymmetricSensitivity(const Ellipsoid& ellipsoid, double radius) {
  CHECK_GT(radius, 0.0);
  CHECK(EigenOfSymmetric3(ellipsoid.shape).values[0] > 0.0) << "the shape is not positive definite";
  return InverseSquareRoot3(ellipsoid.shape) / radius;
}

}  // namespace truetriad
