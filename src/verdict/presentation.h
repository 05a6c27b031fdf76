// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "problem/parameter_name.h"
#include "truetriad/model/calibration.h"
#include "truetriad/model/gauge.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// A solution in one body frame: models, and the covariance of all their entries by name (a sensor's
// twelve entries stand together: bias x y z, then the rows of the sensitivity; then its temperature
// terms in tau, likewise; its higher terms; its g-sensitivity by rows).
struct PresentedSolution {
  PerTriad<std::optional<TriadModel<double>>> models;  // at the reference temperature
  PerTriad<std::optional<ThermalTerms>> thermal;
  // What each session adds to the bias; empty where they share one.
  PerTriad<std::vector<Eigen::Vector3d>> session_bias;
  std::optional<Eigen::Matrix3d> g_sensitivity;  // of the gyroscope
  NamedCovariance covariance;                    // singular where entries are fixed or tied
  // Derivative of the listed entries by the graph's free coordinates; empty for a stored solution.
  Eigen::MatrixXd from_free;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // this frame = solved frame * rotation

  TriadModel<double> ModelAt(Triad triad, const PoseNode& node) const;
};

// The graph's solution in the frame it was solved in, with the reference entries that are
// estimated.
PresentedSolution SolvedFrame(const PoseGraph& graph, const Eigen::MatrixXd& free_covariance);

// A stored calibration as a solution.
PresentedSolution SolutionOf(const Calibration& calibration);

// Place of an entry in the covariance's list, or -1.
int PlaceOf(const NamedCovariance& covariance, const ParameterName& name);

// Restates in `gauge`: S_s' = S_s Q(S_lead), G' = G Q, biases, higher terms and reference
// unchanged. Q is that of the reference temperature for the temperature terms too. The covariance
// goes through the full derivative of this map, dQ/dS_lead included, for all triads and their cross
// terms. Entries that the gauge fixes or ties are exactly so. docs/method.md, "Gauge".
void StateInGauge(Gauge gauge, Triad leading, double axis_sign, PresentedSolution* solution);

// The same in the gauge that the options ask for, whose form is that of the leading sensitivity by
// its sensing axes: S_lead transpose(M), M being how the leading triad is mounted.
void StateInGauge(const CalibrateOptions& options, PresentedSolution* solution);

}  // namespace truetriad
