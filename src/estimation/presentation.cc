// SPDX-License-Identifier: Apache-2.0
#include "estimation/presentation.h"

#include <algorithm>
#include <vector>

#include "estimation/pose_node.h"

namespace truetriad {
namespace {

// Place of entry (row, col) of the sensitivity in a sensor's list of twelve.
int EntryAt(int sensor_at, int row, int col) { return sensor_at + 3 + 3 * row + col; }

// Where the sensor's twelve entries begin, or -1.
int SensorAt(const NamedCovariance& covariance, Triad triad) {
  const std::string first = std::string(TriadName(triad)) + ".bias.x";
  const auto at = std::find(covariance.parameters.begin(), covariance.parameters.end(), first);
  return at == covariance.parameters.end() ? -1
                                           : static_cast<int>(at - covariance.parameters.begin());
}

}  // namespace

PresentedSolution SolvedFrame(const PoseGraph& graph, const Eigen::MatrixXd& free_covariance) {
  const SharedLayout& layout = graph.layout;
  PresentedSolution solution;
  std::vector<int> listed;
  for (const Triad triad : kTriads) {
    if (!layout.Has(triad)) continue;
    solution.models[triad] = {graph.sensitivity(triad), graph.bias(triad)};
    for (int i = 0; i < 3; ++i) listed.push_back(layout.bias[triad] + i);
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col) listed.push_back(layout.sensitivity[triad] + 3 * col + row);
    }
  }
  for (int i = 0; i < kReferenceSize; ++i) {
    if (layout.IsFree(layout.reference + i)) listed.push_back(layout.reference + i);
  }
  const std::vector<std::string> names = ParameterNames(layout);
  Eigen::MatrixXd& basis = solution.from_free;
  basis.resize(static_cast<Eigen::Index>(listed.size()), layout.basis.cols());
  for (std::size_t i = 0; i < listed.size(); ++i) {
    solution.covariance.parameters.push_back(names[static_cast<std::size_t>(listed[i])]);
    basis.row(static_cast<Eigen::Index>(i)) = layout.basis.row(listed[i]);
  }
  solution.covariance.matrix = basis * free_covariance * basis.transpose();
  return solution;
}

PresentedSolution SolutionOf(const Calibration& calibration) {
  PresentedSolution solution;
  for (const Triad triad : kTriads) {
    if (calibration.sensors[triad]) solution.models[triad] = calibration.sensors[triad]->model;
  }
  solution.covariance = calibration.covariance;
  return solution;
}

void StateInGauge(Gauge gauge, Triad leading, double axis_sign, PresentedSolution* solution) {
  const Eigen::Matrix3d lead = solution->models[leading]->sensitivity;
  const Eigen::Matrix3d Q = GaugeRotation(gauge, lead, axis_sign);
  // In the list's order of entries: vec of dS_lead is by columns in GaugeRotationJacobian.
  const Eigen::Matrix<double, 3, 9> turn = GaugeRotationJacobian(gauge, lead, Q);
  solution->rotation = solution->rotation * Q;

  NamedCovariance& covariance = solution->covariance;
  const Eigen::Index size = covariance.matrix.rows();
  Eigen::MatrixXd map = Eigen::MatrixXd::Identity(size, size);
  const int lead_at = SensorAt(covariance, leading);
  for (const Triad triad : kTriads) {
    if (!solution->models[triad]) continue;
    Eigen::Matrix3d& stated = solution->models[triad]->sensitivity;
    stated = stated * Q;
    const int at = SensorAt(covariance, triad);
    if (at < 0 || lead_at < 0) continue;
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col) {
        auto entry = map.row(EntryAt(at, row, col));
        entry.setZero();
        // (S Q)(row, col) = sum_j S(row, j) Q(j, col).
        for (int j = 0; j < 3; ++j) entry[EntryAt(at, row, j)] = Q(j, col);
        // + S' [omega]_x, column col: S' (omega x e_col) = -S' [e_col]_x omega.
        const Eigen::RowVector3d by_turn = -stated.row(row) * Skew(Eigen::Vector3d::Unit(col));
        for (int i = 0; i < 3; ++i) {
          for (int j = 0; j < 3; ++j) {
            entry[EntryAt(lead_at, i, j)] += by_turn.dot(turn.col(3 * j + i));
          }
        }
      }
    }
  }
  Eigen::Matrix3d& stated_lead = solution->models[leading]->sensitivity;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      const bool fixed =
          (gauge == Gauge::kAccelX && col > row) || (gauge == Gauge::kAccelZ && col < row);
      const bool tied = gauge == Gauge::kSymmetric && col < row;
      if (fixed) stated_lead(row, col) = 0.0;
      if (tied) stated_lead(row, col) = stated_lead(col, row);
      if (lead_at < 0) continue;
      if (fixed) map.row(EntryAt(lead_at, row, col)).setZero();
      if (tied) map.row(EntryAt(lead_at, row, col)) = map.row(EntryAt(lead_at, col, row));
    }
  }
  covariance.matrix = map * covariance.matrix * map.transpose();
  if (solution->from_free.size() > 0) solution->from_free = map * solution->from_free;
}

}  // namespace truetriad
