// SPDX-License-Identifier: Apache-2.0
#include "planning/plan_quantities.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "planning/plan_problem.h"
#include "problem/parameter_name.h"
#include "truetriad/base/triad.h"
#include "truetriad/base/units.h"
#include "truetriad/model/mounting.h"

namespace truetriad {
namespace {

// A sensor by its sensing axes, whatever body axes they were mounted along; as limits are judged.
struct SensingAxes {
  SensingAxes(Triad of_triad, const Eigen::Matrix3d& S, const ReferenceVector& reference)
      : triad(of_triad), map(NearestAxisMap(S)), gain((S * map.transpose()).diagonal()) {
    if (triad != Triad::kGyroscope) signal = WorldVector(triad, reference).norm();
  }

  Triad triad;
  Eigen::Matrix3d map;
  Eigen::Vector3d gain;
  double signal = 1.0;  // that of a gyroscope: 1 rad/s
};

class QuantityList {
 public:
  QuantityList(const PresentedSolution& solution, const Eigen::MatrixXd& rows)
      : names_(solution.covariance.parameters), rows_(rows) {}

  bool Has(const std::string& name) const {
    return std::find(names_.begin(), names_.end(), name) != names_.end();
  }
  Eigen::RowVectorXd RowOf(const std::string& name) const {
    return rows_.row(std::find(names_.begin(), names_.end(), name) - names_.begin());
  }

  void Add(const std::string& group,
           const std::string& axes,
           const std::string& unit,
           double typical,
           const Eigen::RowVectorXd& row) {
    if (row.isZero(0.0)) return;  // held, or fixed by the gauge
    quantities_.push_back({axes.empty() ? group : group + "." + axes, group, unit, typical, row});
  }

  // Biases, gains and misalignments.
  void AddModel(const SensingAxes& sensing) {
    const std::string sensor(TriadName(sensing.triad));
    const auto entry = [&](int row, int col) -> Eigen::RowVectorXd {
      Eigen::Index from = 0;
      sensing.map.row(col).cwiseAbs().maxCoeff(&from);
      return RowOf(sensor + ".sensitivity." + AxisLetter(row) + AxisLetter(from)) /
             sensing.gain[row];
    };
    for (int i = 0; i < 3; ++i) {
      const std::string axis(1, AxisLetter(i));
      Add(sensor + ".bias",
          axis,
          std::string(TruthUnitName(sensing.triad)),
          sensing.signal,
          RowOf(sensor + ".bias." + axis) / sensing.gain[i]);
    }
    for (int i = 0; i < 3; ++i) {
      Add(sensor + ".scale_error", std::string(1, AxisLetter(i)), "", 1.0, entry(i, i));
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        if (i == j) continue;
        Add(sensor + ".misalignment_rad",
            std::string(1, AxisLetter(i)) + AxisLetter(j),
            "rad",
            1.0,
            entry(i, j));
      }
    }
  }

  // One of the parameters beyond these, if it is of this sensor.
  void AddTerm(const std::string& name,
               const SensingAxes& sensing,
               const ReferenceVector& reference,
               const ThermalScale& scale) {
    const auto term = ParameterName::Parse(name);
    if (!term || term->triad != sensing.triad) return;
    const std::string group = name.substr(0, name.rfind('.'));
    const std::string axes = name.substr(name.rfind('.') + 1);
    const double gain = sensing.gain[term->row];
    if (term->kind == ParameterKind::kGSensitivity) {
      Add(group, axes, "rad/s/(m/s^2)", 1.0 / reference[kGravity], RowOf(name) / gain);
    } else if (const auto bend = InfoOf(term->kind).axis_term) {
      // As a share of the signal.
      Add(group, axes, "", 1.0, RowOf(name) * InfoOf(*bend).PowerOf(gain * sensing.signal));
    }
    if (!term->is_thermal()) return;
    const bool is_bias = term->kind != ParameterKind::kSensitivity;
    std::string unit = is_bias ? std::string(TruthUnitName(sensing.triad)) : "1";
    double typical = is_bias ? sensing.signal : 1.0;
    if (const auto rate = InfoOf(term->kind).rate) {
      unit.append(" ").append(InfoOf(*rate).unit);
      typical /= FactorOf(*rate, scale.half_range_degc, scale.rate_degcps);
    } else {
      unit += "/degC";
      if (term->power > 1) unit.append("^").append(std::to_string(term->power));
      typical /= std::pow(scale.half_range_degc, term->power);
    }
    Add(group, axes, unit, typical, RowOf(name) / gain);
  }

  std::vector<PlanQuantity> Take() { return std::move(quantities_); }

 private:
  const std::vector<std::string>& names_;
  const Eigen::MatrixXd& rows_;
  std::vector<PlanQuantity> quantities_;
};

}  // namespace

std::vector<PlanQuantity> QuantitiesOf(const PresentedSolution& solution,
                                       const Eigen::MatrixXd& rows,
                                       const ReferenceVector& reference,
                                       const ThermalScale& scale) {
  QuantityList list(solution, rows);
  for (const Triad triad : kPlannedTriads) {
    if (!solution.models[triad]) continue;
    const SensingAxes sensing(triad, solution.models[triad]->sensitivity, reference);
    list.AddModel(sensing);
    for (const std::string& name : solution.covariance.parameters) {
      list.AddTerm(name, sensing, reference, scale);
    }
  }
  for (const auto& [name, unit, typical] :
       {std::tuple("reference.gravity_mps2", "m/s^2", reference[kGravity]),
        std::tuple("reference.field_ut", "uT", reference[kField]),
        std::tuple("reference.dip_rad", "rad", 1.0),
        std::tuple("reference.heading_rad", "rad", 1.0)}) {
    if (list.Has(name)) list.Add(name, "", unit, typical, list.RowOf(name));
  }
  return list.Take();
}

}  // namespace truetriad
