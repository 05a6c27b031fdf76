// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "planning/plan_problem.h"
#include "problem/parameter_name.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

// The estimated quantities of a plan, by sensing axis and in the units in which limits are stated.

namespace truetriad {
namespace {

// A quantity: an entry of the solution divided by `divisor`.
struct ScaledEntry {
  PlanQuantity quantity;
  double divisor = 1.0;
  // Sort key: sensor by sensor, then the reference. Within a sensor: biases, gains and
  // misalignments by axis, then all else in the solution's order.
  std::tuple<int, int, std::string> order;
};

// Quantities are named by sensing axis, as limits are, not by the body axis along which the sensing
// axis points.
ScaledEntry OfSensor(const ParameterName& name,
                     const Eigen::Matrix3d& S,
                     const ReferenceVector& reference,
                     const ThermalScale& scale) {
  const Eigen::Matrix3d map = NearestAxisMap(S);
  const double gain = (S * map.transpose())(name.row, name.row);
  const bool is_gyroscope = name.triad == Triad::kGyroscope;
  // For a gyroscope, a signal of 1 rad/s is assumed.
  const double signal = is_gyroscope ? 1.0 : WorldVector(name.triad, reference).norm();
  const bool is_matrix = name.kind == ParameterKind::kSensitivity;
  const std::string text = name.str();
  std::string group = text.substr(0, text.rfind('.'));
  std::string axes = text.substr(text.rfind('.') + 1);
  std::string unit = is_matrix ? "" : std::string(TruthUnitName(name.triad));
  double typical = is_matrix ? 1.0 : signal;
  double divisor = gain;
  int rank = 3;
  if (const auto rate = InfoOf(name.kind).rate) {
    unit.append(" ").append(InfoOf(*rate).unit);
    typical /= FactorOf(*rate, scale.half_range_degc, scale.rate_degcps);
  } else if (name.is_thermal()) {
    unit += is_matrix ? "1/degC" : "/degC";
    if (name.power > 1) unit.append("^").append(std::to_string(name.power));
    typical /= std::pow(scale.half_range_degc, name.power);
  } else if (name.kind == ParameterKind::kGSensitivity) {
    unit = "rad/s/(m/s^2)";
    typical = 1.0 / reference[kGravity];
  } else if (const auto term = InfoOf(name.kind).axis_term) {
    // An axis term is stated as a share of the signal.
    unit.clear();
    typical = 1.0;
    divisor = 1.0 / InfoOf(*term).PowerOf(gain * signal);
  } else if (is_matrix) {
    Eigen::Index axis = 0;
    map.col(name.col).cwiseAbs().maxCoeff(&axis);
    const bool is_gain = axis == name.row;
    rank = is_gain ? 1 : 2;
    group = std::string(TriadName(name.triad)) + (is_gain ? ".scale_error" : ".misalignment_rad");
    unit = is_gain ? "" : "rad";
    axes = is_gain ? axes.substr(0, 1) : axes.substr(0, 1) + AxisLetter(axis);
  } else {
    rank = 0;
  }
  return {{group + "." + axes, group, unit, typical},
          divisor,
          {static_cast<int>(name.triad), rank, rank < 3 ? axes : ""}};
}

ScaledEntry OfReference(const std::string& name, const ReferenceVector& reference) {
  const bool is_gravity = name == "reference.gravity_mps2", is_field = name == "reference.field_ut";
  return {{name,
           name,
           is_gravity ? "m/s^2" : (is_field ? "uT" : "rad"),
           is_gravity ? reference[kGravity] : (is_field ? reference[kField] : 1.0)},
          1.0,
          {static_cast<int>(kTriads.size()), 0, ""}};
}

}  // namespace

void PlanProblem::FindQuantities() {
  const Eigen::Index free = graph_.layout.free_size();
  const PresentedSolution solution = Present(Eigen::MatrixXd::Zero(free, free));
  const Eigen::MatrixXd rows = solution.from_free * scale_.asDiagonal();
  std::vector<std::pair<ScaledEntry, Eigen::RowVectorXd>> entries;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    if (rows.row(i).isZero(0.0)) continue;  // a parameter that is held, or fixed by the gauge
    const std::string& name = solution.covariance.parameters[static_cast<std::size_t>(i)];
    const auto parsed = ParameterName::Parse(name);
    ScaledEntry entry = parsed ? OfSensor(*parsed,
                                          solution.models[parsed->triad]->sensitivity,
                                          nominal_.reference,
                                          graph_.layout.thermal_scale)
                               : OfReference(name, nominal_.reference);
    entries.emplace_back(entry, rows.row(i) / entry.divisor);
  }
  std::stable_sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) {
    return a.first.order < b.first.order;
  });
  quantity_rows_.resize(std::ssize(entries), free);
  for (auto& [entry, row] : entries) {
    quantity_rows_.row(std::ssize(quantities_)) = row;
    quantities_.push_back(std::move(entry.quantity));
  }
}

}  // namespace truetriad
