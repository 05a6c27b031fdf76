// SPDX-License-Identifier: Apache-2.0
//
// The rotation of a second triad relative to the leading one, from two fields at a constant angle:
//
//   u_k^T R m_k = c            for all k; with r = vec R (by columns), h_k = vec(u_k m_k^T):
//   h_k^T r = c                homogeneous in (r, c)
//   cost = r^T W r - 2 p^T r + q
//          c free:  W = mean(h h^T) - mean(h) mean(h)^T, p = 0, q = 0; the best c is mean(h)^T r
//          c known: W = mean(h h^T), p = c mean(h), q = c^2
//
// so cost and derivatives for any R follow from the 9x9 moment W, whatever the number of pairs, and
// many starts are cheap. The homogeneous solution is the joint accelerometer and magnetometer
// alignment of Kok and Schön, IEEE Sensors Journal 16(14), 2016, with c unknown too.
#include "init/frame_alignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>

#include <Eigen/LU>
#include <glog/logging.h>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "truetriad/math/rotation.h"
#include "truetriad/model/finding.h"

namespace truetriad {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Vector9d = Eigen::Matrix<double, 9, 1>;

// The cost above, with the names of the head of this file.
struct Moments {
  Matrix9d W = Matrix9d::Zero();
  Vector9d p = Vector9d::Zero();
  double q = 0.0;

  double Cost(const Vector9d& r) const { return r.dot(W * r - 2.0 * p) + q; }
};

Vector9d Vec(const Matrix3d& matrix) { return Vector9d(matrix.reshaped()); }

// The nearest orthogonal matrix with the wanted determinant.
Matrix3d NearestOrthogonal(const Matrix3d& matrix, int determinant) {
  const Svd3 svd = SvdOf3(matrix);
  Vector3d signs = Vector3d::Ones();
  if (svd.U.determinant() * svd.V.determinant() * determinant < 0.0) {
    signs.z() = -1.0;
  }
  return svd.U * signs.asDiagonal() * svd.V.transpose();
}

// The 24 signed axis maps of one determinant.
std::array<Matrix3d, 24> SignedAxisMaps(int determinant) {
  std::array<Matrix3d, 24> maps;
  std::size_t count = 0;
  std::array<int, 3> axes = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3d map = Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) {
        map(row, axes[static_cast<std::size_t>(row)]) = ((signs >> row) & 1) != 0 ? -1.0 : 1.0;
      }
      if (map.determinant() * determinant > 0.0) maps[count++] = map;
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  return maps;
}

struct Minimum {
  Matrix3d rotation = Matrix3d::Identity();
  double curvature = 0.0;  // Smallest eigenvalue of the Gauss-Newton Hessian.
};

// Whether a and b are the same minimum: they are less than 0.01 rad apart. 3 - tr = angle^2 for
// small angles.
bool AreSame(const Matrix3d& a, const Matrix3d& b) { return 3.0 - a.cwiseProduct(b).sum() < 1e-4; }

// Levenberg-Marquardt on R Exp(omega); nullopt as soon as it runs into a minimum already found.
std::optional<Minimum> Descend(const Moments& moments,
                               Matrix3d rotation,
                               const std::vector<FrameAlignment>& found) {
  // A bound only: convergence is faster than linear.
  constexpr int kMaxSteps = 50;
  constexpr double kSmallStepRad = 1e-9;  // The next step is rounding.
  double damping = 1e-3;
  double cost = moments.Cost(Vec(rotation));
  Matrix3d hessian;
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Matrix<double, 9, 3> jacobian;
    for (int i = 0; i < 3; ++i) jacobian.col(i) = Vec(rotation * Skew(Vector3d::Unit(i)));
    const Vector3d gradient = jacobian.transpose() * (moments.W * Vec(rotation) - moments.p);
    hessian = jacobian.transpose() * moments.W * jacobian;
    Matrix3d damped = hessian;
    damped.diagonal().array() += damping * hessian.trace() + 1e-300;
    const Vector3d omega = -SolveSymmetric3(damped, gradient);
    const double angle_rad = omega.norm();
    const Matrix3d moved =
        angle_rad > 0.0
            ? Matrix3d(rotation * Eigen::AngleAxisd(angle_rad, omega / angle_rad).matrix())
            : rotation;
    const double moved_cost = moments.Cost(Vec(moved));
    if (moved_cost <= cost) {
      rotation = moved;
      cost = moved_cost;
      damping *= 0.1;
      for (const FrameAlignment& other : found) {
        if (AreSame(rotation, other.rotation)) return std::nullopt;
      }
    } else {
      damping *= 10.0;
    }
    if (angle_rad < kSmallStepRad) break;
  }
  return Minimum{rotation, EigenOfSymmetric3(hessian).values[0]};
}

// Right-handed orthonormal frame with `first` as x and `second` in its xy plane. If both are
// parallel, the rotation about `first` is arbitrary.
Matrix3d FrameOf(const Vector3d& first, const Vector3d& second) {
  Matrix3d frame;
  frame.col(0) = first.normalized();
  const Vector3d normal = frame.col(0).cross(second.normalized());
  // Above the rounding of a cross product of unit vectors, 1e-16, with a margin.
  constexpr double kParallel = 1e-12;
  frame.col(2) = normal.norm() > kParallel ? normal.normalized() : frame.col(0).unitOrthogonal();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

// The moments of the pairs. If the cosine is unknown, they are moments about the mean.
struct PairMoments {
  Moments moments;
  Vector9d mean = Vector9d::Zero();
  Matrix9d centred;
};

PairMoments MomentsOf(const std::vector<Vector3d>& up_in_body,
                      const std::vector<Vector3d>& field_in_triad,
                      const double* known_cosine) {
  PairMoments of_pairs;
  auto& [moments, mean, centred] = of_pairs;
  const double weight = 1.0 / static_cast<double>(up_in_body.size());
  for (std::size_t k = 0; k < up_in_body.size(); ++k) {
    const Vector9d h = Vec(up_in_body[k] * field_in_triad[k].transpose());
    mean += weight * h;
    moments.W += weight * h * h.transpose();
  }
  centred = moments.W - mean * mean.transpose();
  if (known_cosine != nullptr) {
    moments.p = *known_cosine * mean;
    moments.q = *known_cosine * *known_cosine;
  } else {
    moments.W = centred;
  }
  return of_pairs;
}

// Homogeneous start: the direction of r in which h^T r varies least, with the sign that gives the
// determinant. This start is also used if the cosine is known, since a descent follows.
Matrix3d HomogeneousStart(const Matrix9d& centred, int determinant) {
  const Vector9d least = EigenOfSymmetric(centred).vectors.col(0);
  Matrix3d homogeneous = least.reshaped(3, 3);
  if (homogeneous.determinant() * determinant < 0.0) homogeneous *= -1.0;
  return NearestOrthogonal(homogeneous, determinant);
}

}  // namespace

Result<std::vector<FrameAlignment>> AlignFrames(const std::vector<Vector3d>& up_in_body,
                                                const std::vector<Vector3d>& field_in_triad,
                                                int determinant,
                                                const double* known_cosine) {
  CHECK_EQ(up_in_body.size(), field_in_triad.size());
  CHECK(determinant == 1 || determinant == -1);
  const std::size_t pairs = up_in_body.size();
  // Four unknowns (three of the rotation, the angle between the fields), one equation per pair.
  constexpr std::size_t kMinPairs = 4;
  if (pairs < kMinPairs) {
    return NotEnoughError(
        Finding(
            FindingCode::kAlignmentUndetermined,
            std::to_string(pairs) + " poses are too few to align the sensors' axes with each other",
            "record at least 4 in different attitudes")
            .With("poses", static_cast<double>(pairs)));
  }
  const double weight = 1.0 / static_cast<double>(pairs);
  const auto [moments, mean, centred] = MomentsOf(up_in_body, field_in_triad, known_cosine);
  std::vector<Matrix3d> starts = {HomogeneousStart(centred, determinant)};
  for (const Matrix3d& map : SignedAxisMaps(determinant)) starts.push_back(map);
  std::vector<FrameAlignment> alignments;
  double best_curvature = 0.0;
  for (const Matrix3d& start : starts) {
    const std::optional<Minimum> minimum = Descend(moments, start, alignments);
    if (!minimum) continue;
    FrameAlignment alignment;
    alignment.rotation = minimum->rotation;
    alignment.cosine = known_cosine != nullptr ? *known_cosine : mean.dot(Vec(minimum->rotation));
    double sum = 0.0;  // Pair by pair, since moments of an exact fit lose all digits.
    for (std::size_t k = 0; k < pairs; ++k) {
      const double cosine = up_in_body[k].dot(alignment.rotation * field_in_triad[k]);
      sum += std::pow(cosine - alignment.cosine, 2);
    }
    alignment.rms = std::sqrt(weight * sum);
    const bool is_best = std::all_of(
        alignments.begin(), alignments.end(), [&alignment](const FrameAlignment& other) {
          return alignment.rms < other.rms;
        });
    if (is_best) best_curvature = minimum->curvature;
    alignments.push_back(alignment);
  }
  // Least curvature: if a rotation of the triad has no effect, rounding leaves a curvature of
  // 1e-16.
  constexpr double kMinCurvature = 1e-12;
  if (!(best_curvature > kMinCurvature)) {
    return NotEnoughError(
        Finding(FindingCode::kAlignmentUndetermined,
                "the alignment between the sensors' axes is unobservable from these " +
                    std::to_string(pairs) +
                    " poses: one sensor's axes could be rotated without changing the residuals",
                "add poses tilted about another axis")
            .With("poses", static_cast<double>(pairs)));
  }
  std::sort(alignments.begin(),
            alignments.end(),
            [](const FrameAlignment& a, const FrameAlignment& b) { return a.rms < b.rms; });
  return alignments;
}

Eigen::Quaterniond TriadAttitude(const Vector3d& first_in_world,
                                 const Vector3d& second_in_world,
                                 const Vector3d& first_in_body,
                                 const Vector3d& second_in_body) {
  // Shuster and Oh 1981, eq. 3-8, with world as the reference frame.
  const Matrix3d world_from_body =
      FrameOf(first_in_world, second_in_world) * FrameOf(first_in_body, second_in_body).transpose();
  return Eigen::Quaterniond(world_from_body);
}

}  // namespace truetriad
