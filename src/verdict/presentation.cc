// SPDX-License-Identifier: Apache-2.0
#include "verdict/presentation.h"

#include <algorithm>
#include <vector>

#include "problem/lay_out.h"
#include "problem/pose_node.h"
#include "truetriad/math/rotation.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

// Rounding error of a product of rotations.
constexpr double kRounding = 1e-12;

// The index of an entry in a matrix stored by columns; `entry` is its index by rows.
int RowMajorPlace(int entry) { return 3 * (entry % 3) + entry / 3; }

// A 3x3 matrix of the solution; its entry (row, col) is at first + 3 row + col of the covariance,
// or not in it if first < 0.
struct ListedMatrix {
  Eigen::Matrix3d* matrix;
  int first;
};

std::vector<ListedMatrix> MatricesOf(Triad triad, PresentedSolution* solution) {
  const auto first = [&](int power) {
    return PlaceOf(solution->covariance, {triad, ParameterKind::kSensitivity, power, 0, 0});
  };
  std::vector<ListedMatrix> matrices = {{&solution->models[triad]->sensitivity, first(0)}};
  if (solution->thermal[triad]) {
    for (Eigen::Matrix3d& term : solution->thermal[triad]->sensitivity) {
      matrices.push_back({&term, first(static_cast<int>(matrices.size()))});
    }
  }
  if (triad == Triad::kGyroscope && solution->g_sensitivity) {
    matrices.push_back(
        {&*solution->g_sensitivity,
         PlaceOf(solution->covariance, {triad, ParameterKind::kGSensitivity, 0, 0, 0})});
  }
  return matrices;
}

// Renames the axes of the body frame: S' = S map.
void ExchangeAxes(const Eigen::Matrix3d& map, PresentedSolution* solution) {
  if (map.isIdentity(0.0)) return;
  const Eigen::Index size = solution->covariance.matrix.rows();
  Eigen::MatrixXd entries = Eigen::MatrixXd::Identity(size, size);
  for (const Triad triad : kTriads) {
    if (!solution->models[triad]) continue;
    for (const auto& [matrix, first] : MatricesOf(triad, solution)) {
      *matrix = *matrix * map;
      if (first < 0) continue;
      for (int row = 0; row < 3; ++row) {
        entries.block<3, 3>(first + 3 * row, first + 3 * row) = map.transpose();
      }
    }
  }
  solution->rotation = solution->rotation * map;
  NamedCovariance& covariance = solution->covariance;
  covariance.matrix = entries * covariance.matrix * entries.transpose();
  if (solution->from_free.size() > 0) solution->from_free = entries * solution->from_free;
}

}  // namespace

int PlaceOf(const NamedCovariance& covariance, const ParameterName& name) {
  const auto at = std::find(covariance.parameters.begin(), covariance.parameters.end(), name.str());
  return at == covariance.parameters.end() ? -1
                                           : static_cast<int>(at - covariance.parameters.begin());
}

TriadModel<double> PresentedSolution::ModelAt(Triad triad, const PoseNode& node) const {
  TriadModel<double> model = *models[triad];
  if (thermal[triad]) {
    model = ModelAtTemperature(
        model, *thermal[triad], node.temperature_degc, node.temperature_rate_degcps);
  }
  const auto session = static_cast<std::size_t>(node.session);
  if (session < session_bias[triad].size()) model.bias += session_bias[triad][session];
  return model;
}

PresentedSolution SolvedFrame(const PoseGraph& graph, const Eigen::MatrixXd& free_covariance) {
  const SharedLayout& layout = graph.layout;
  PresentedSolution solution;
  const std::vector<std::string> names = ParameterNames(layout);
  std::vector<Eigen::RowVectorXd> rows;
  const auto list = [&](int index, const Eigen::RowVectorXd& row) {
    solution.covariance.parameters.push_back(names[static_cast<std::size_t>(index)]);
    rows.push_back(row);
  };
  // Lists entry `offset` of term i; terms are `stride` entries apart, from `first` on.
  const auto list_term =
      [&](const Eigen::MatrixXd& listed_from_scaled, int i, int first, int stride, int offset) {
        Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(layout.basis.cols());
        for (int j = 0; j < listed_from_scaled.cols(); ++j) {
          row += listed_from_scaled(i, j) * layout.basis.row(first + stride * j + offset);
        }
        list(first + stride * i + offset, row);
      };
  for (const Triad triad : kTriads) {
    if (!layout.Has(triad)) continue;
    solution.models[triad] = layout.ModelOf(triad, graph.shared.data(), ThermalFactors());
    for (int i = 0; i < 3; ++i) {
      list(layout.bias[triad] + i, layout.basis.row(layout.bias[triad] + i));
    }
    for (int entry = 0; entry < 9; ++entry) {
      const int at = layout.sensitivity[triad] + RowMajorPlace(entry);
      list(at, layout.basis.row(at));
    }
    const SessionBlock& sessions = layout.sessions[triad];
    for (std::size_t k = 0; k < (sessions.at < 0 ? 0 : sessions.places.size()); ++k) {
      TriadModel<double> added{Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero()};
      sessions.AddTo(static_cast<int>(k), graph.shared.data(), &added);
      solution.session_bias[triad].push_back(added.bias);
    }
    const ThermalBlock& thermal = layout.thermal[triad];
    if (thermal.size() > 0) {
      solution.thermal[triad] = thermal.TermsInTau(layout.thermal_scale, graph.shared.data());
    }
    const Eigen::MatrixXd vectors = thermal.ListedFromVectors(layout.thermal_scale);
    for (int i = 0; i < thermal.vector_count(); ++i) {
      for (int axis = 0; axis < 3; ++axis) list_term(vectors, i, thermal.at, 3, axis);
    }
    const Eigen::MatrixXd matrices = thermal.ListedFromMatrices(layout.thermal_scale);
    for (int i = 0; i < thermal.terms.matrix_order; ++i) {
      for (int entry = 0; entry < 9; ++entry) {
        list_term(matrices, i, thermal.matrix_at(0), 9, RowMajorPlace(entry));
      }
    }
    for (const auto& [term, at] : layout.axis_terms[triad]) {
      for (int i = 0; i < 3; ++i) list(at + i, layout.basis.row(at + i));
    }
  }
  if (layout.g_sensitivity >= 0) {
    solution.g_sensitivity = Eigen::Map<const Eigen::Matrix3d>(&graph.shared[layout.g_sensitivity]);
    for (int entry = 0; entry < 9; ++entry) {
      const int at = layout.g_sensitivity + RowMajorPlace(entry);
      list(at, layout.basis.row(at));
    }
  }
  for (int i = 0; i < kReferenceSize; ++i) {
    const int at = layout.reference + i;
    if (layout.IsFree(at)) list(at, layout.basis.row(at));
  }
  Eigen::MatrixXd& basis = solution.from_free;
  basis.resize(static_cast<Eigen::Index>(rows.size()), layout.basis.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) basis.row(static_cast<Eigen::Index>(i)) = rows[i];
  solution.covariance.matrix = basis * free_covariance * basis.transpose();
  return solution;
}

PresentedSolution SolutionOf(const Calibration& calibration) {
  PresentedSolution solution;
  for (const Triad triad : kTriads) {
    if (!calibration.sensors[triad]) continue;
    solution.models[triad] = calibration.sensors[triad]->model;
    solution.thermal[triad] = calibration.sensors[triad]->thermal;
    if (triad == Triad::kGyroscope) {
      solution.g_sensitivity = calibration.sensors[triad]->g_sensitivity;
    }
  }
  solution.covariance = calibration.covariance;
  return solution;
}

void StateInGauge(Gauge gauge, Triad leading, double axis_sign, PresentedSolution* solution) {
  const Eigen::Matrix3d lead = solution->models[leading]->sensitivity;
  const Eigen::Matrix3d Q = GaugeRotation(gauge, lead, axis_sign);
  // Each column of `turn` belongs to an entry of S_lead, counted by columns; the covariance counts
  // these entries by rows.
  const Eigen::Matrix<double, 3, 9> turn = GaugeRotationJacobian(gauge, lead, Q);
  solution->rotation = solution->rotation * Q;

  NamedCovariance& covariance = solution->covariance;
  const Eigen::Index size = covariance.matrix.rows();
  Eigen::MatrixXd map = Eigen::MatrixXd::Identity(size, size);
  const int lead_at = PlaceOf(covariance, {leading, ParameterKind::kSensitivity, 0, 0, 0});
  // Whether the leading matrix is triangular already, up to rounding: its temperature terms are
  // then exactly triangular, and Q, which is only rounding, must not rotate them.
  const bool in_gauge =
      gauge == Gauge::kAccelX && (Q - Eigen::Matrix3d::Identity()).norm() < kRounding;
  for (const Triad triad : kTriads) {
    if (!solution->models[triad]) continue;
    for (const auto& [matrix, first] : MatricesOf(triad, solution)) {
      if (in_gauge && matrix != &solution->models[triad]->sensitivity) continue;
      *matrix = *matrix * Q;
      if (first < 0 || lead_at < 0) continue;
      for (int row = 0; row < 3; ++row) {
        for (int col = 0; col < 3; ++col) {
          auto entry = map.row(first + 3 * row + col);
          entry.setZero();
          // (S Q)(row, col) = sum_j S(row, j) Q(j, col).
          for (int j = 0; j < 3; ++j) entry[first + 3 * row + j] = Q(j, col);
          // + S' [omega]_x, column col: S' (omega x e_col) = -S' [e_col]_x omega.
          const Eigen::RowVector3d by_turn = -matrix->row(row) * Skew(Eigen::Vector3d::Unit(col));
          for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
              entry[lead_at + 3 * i + j] += by_turn.dot(turn.col(3 * j + i));
            }
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
      if (fixed) map.row(lead_at + 3 * row + col).setZero();
      if (tied) map.row(lead_at + 3 * row + col) = map.row(lead_at + 3 * col + row);
    }
  }
  covariance.matrix = map * covariance.matrix * map.transpose();
  if (solution->from_free.size() > 0) solution->from_free = map * solution->from_free;
}

void StateInGauge(const CalibrateOptions& options, PresentedSolution* solution) {
  const Eigen::Matrix3d axis_map = LeadingAxisMap(options);
  ExchangeAxes(axis_map.transpose(), solution);
  StateInGauge(options.gauge, LeadingTriad(options), LeadingAxisSign(options), solution);
  ExchangeAxes(axis_map, solution);
}

}  // namespace truetriad
