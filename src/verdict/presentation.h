// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "problem/parameter_name.h"
#include "truetriad/model/calibration.h"
#include "truetriad/model/gauge.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// A solution in one body frame: models, and the covariance of all their entries by name (a sensor's
// twelve entries are adjacent: bias x y z, then the rows of the sensitivity; then its temperature
// terms in tau, in the same order; its higher terms; its g-sensitivity by rows).
struct PresentedSolution {
  PerTriad<std::optional<TriadModel<double>>> models;  // at the reference temperature
  PerTriad<std::optional<ThermalTerms>> thermal;
  // Each session's difference from the bias; empty if sessions share one bias.
  PerTriad<std::vector<Eigen::Vector3d>> session_bias;
  std::optional<Eigen::Matrix3d> g_sensitivity;  // of the gyroscope
  NamedCovariance covariance;                    // singular if entries are fixed or tied
  // Derivative of the listed entries by the graph's free coordinates; empty for a stored solution.
  Eigen::MatrixXd from_free;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // this frame = solved frame * rotation

  TriadModel<double> ModelAt(Triad triad, const PoseNode& node) const;
};

// The graph's solution in the frame of the solver, with the estimated reference entries.
PresentedSolution SolvedFrame(const PoseGraph& graph, const Eigen::MatrixXd& free_covariance);

// A stored calibration as a solution.
PresentedSolution SolutionOf(const Calibration& calibration);

// Index of an entry in the covariance's list, or -1.
int PlaceOf(const NamedCovariance& covariance, const ParameterName& name);

// Transforms into `gauge`: S_s' = S_s Q(S_lead), G' = G Q, biases, higher terms and reference
// unchanged. Temperature terms use Q of the reference temperature, too. The covariance is
// transformed by the full derivative of this map, dQ/dS_lead included, for all triads and their
// cross terms. Entries that the gauge fixes or ties are exact. docs/method.md, "Gauge".
void StateInGauge(Gauge gauge, Triad leading, double axis_sign, PresentedSolution* solution);

// Transforms into the gauge of `options`, which gives the leading sensitivity its form by sensing
// axes: S_lead transpose(M), with the leading triad's mounting M.
void StateInGauge(const CalibrateOptions& options, PresentedSolution* solution);

}  // namespace truetriad
