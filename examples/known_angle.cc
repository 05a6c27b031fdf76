// SPDX-License-Identifier: Apache-2.0
// Adds a cost function of your own to a calibration: the angle by which a fixture turned the unit
// between its first two rests is known. Prints the accelerometer without and with that.
//   known_angle datasets/demo/recording.csv 90 0.01        angle and its σ in degrees
#include <cstdio>
#include <cstdlib>

#include <Eigen/Geometry>
#include <ceres/autodiff_cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include "truetriad/calibrate/calibrate.h"
#include "truetriad/session/session.h"

using namespace truetriad;

// (angle of R_a^T R_b - angle) / σ
struct KnownAngle {
  double angle_rad, sigma_rad;
  template <typename T>
  bool operator()(const T* a, const T* b, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> world_from_a(a), world_from_b(b);
    const Eigen::Quaternion<T> turn = world_from_a.conjugate() * world_from_b;
    const T half = atan2(turn.vec().norm(), abs(turn.w()));
    residual[0] = (T(2) * half - T(angle_rad)) / T(sigma_rad);
    return true;
  }
};

void Print(const char* what, const TriadModel<double>& model) {
  const Eigen::Vector3d gain = model.sensitivity.diagonal();
  std::printf("%-8s bias %.6f %.6f %.6f  gain %.7f %.7f %.7f\n",
              what,
              model.bias.x(),
              model.bias.y(),
              model.bias.z(),
              gain.x(),
              gain.y(),
              gain.z());
}

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: known_angle LOG DEGREES SIGMA_DEGREES\n");
    return 1;
  }
  const Result<LoadedPoses> loaded = LoadPoses(argv[1], {});
  CalibrateOptions options;
  options.triads[Triad::kAccelerometer].enabled = true;
  options.triads[Triad::kMagnetometer].enabled = true;
  auto problem = loaded ? PoseProblem::Create(loaded->poses, options) : loaded.error();
  if (!problem) {
    std::fprintf(stderr, "%s\n", problem.error().message.c_str());
    return 2;
  }
  Print("without", problem->Model(Triad::kAccelerometer));
  constexpr double kRadPerDeg = 0.017453292519943295;
  auto* known = new KnownAngle{std::atof(argv[2]) * kRadPerDeg, std::atof(argv[3]) * kRadPerDeg};
  problem->ceres_problem().AddResidualBlock(
      new ceres::AutoDiffCostFunction<KnownAngle, 1, 4, 4>(known),
      nullptr,
      problem->Attitude(0),
      problem->Attitude(1));
  ceres::Solver::Options solver;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem->ceres_problem(), &summary);
  Print("with", problem->Model(Triad::kAccelerometer));
}
