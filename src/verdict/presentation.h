// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "problem/parameter_name.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// A solution in one body frame: the sensors' models, and the covariance of all their entries, with
// names. Each sensor's entries stand together: bias x y z; sensitivity by rows; temperature terms
// in powers of tau, the temperature above the reference (bias, then sensitivity); nonlinear terms
// (quadratic, cubic, asymmetry). The g-sensitivity, by rows, follows after all sensors.
struct PresentedSolution {
  PerTriad<std::optional<TriadModel<double>>> models;  // at the reference temperature
  PerTriad<std::optional<ThermalTerms>> thermal;
  // For each session, its bias minus the bias in `models`; empty if sessions share one bias.
  PerTriad<std::vector<Eigen::Vector3d>> session_bias;
  std::optional<Eigen::Matrix3d> g_sensitivity;  // of the gyroscope
  NamedCovariance covariance;                    // singular if entries are fixed or tied
  // Derivative of the entries by the graph's free coordinates; empty for a stored calibration.
  Eigen::MatrixXd from_free;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // this frame = solved frame * rotation

  TriadModel<double> ModelAt(Triad triad, const PoseNode& node) const;
};

// The graph's solution in the solver's frame; its covariance also has the free reference values.
PresentedSolution SolvedFrame(const PoseGraph& graph, const Eigen::MatrixXd& free_covariance);

// A stored calibration as a solution.
PresentedSolution SolutionOf(const Calibration& calibration);

// Index of the entry `name` in covariance.parameters; -1 if it is not among them.
int PlaceOf(const NamedCovariance& covariance, const ParameterName& name);

// Transforms the solution into `gauge` by a rotation Q that depends on the leading sensor: S_s' =
// S_s Q(S_lead) for each sensor s, and G' = G Q for the g-sensitivity. Biases, nonlinear terms and
// reference do not change. The sensitivities' temperature terms are rotated by the same Q, which is
// that at the reference temperature. The covariance of all sensors is transformed by the full
// derivative of this map, dQ/dS_lead included. Entries that the gauge fixes are exactly zero, and
// entries that it ties are exactly equal. docs/method.md, "Gauge".
void StateInGauge(Gauge gauge, Triad leading, double axis_sign, PresentedSolution* solution);

// Transforms into the gauge of `options`. The gauge's form (say, triangular) is that of S_lead
// transpose(M), with the leading triad's mounting M: the columns of this matrix are sensing axes,
// those of S_lead body axes.
void StateInGauge(const CalibrateOptions& options, PresentedSolution* solution);

}  // namespace truetriad
