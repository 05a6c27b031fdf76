// SPDX-License-Identifier: Apache-2.0
#include "calibrate/reading_units.h"

#include "model/corrected_error.h"
#include "problem/parameter_name.h"

namespace truetriad {

TriadCalibration InUnits(const TriadCalibration& sensor,
                         double reading_per_raw,
                         double result_per_truth) {
  TriadCalibration restated = sensor;
  const double matrix_factor = reading_per_raw / result_per_truth;
  restated.model.bias *= reading_per_raw;
  restated.bias_sigma *= reading_per_raw;
  restated.noise.sigma *= reading_per_raw;
  restated.noise.excess_sigma *= result_per_truth;
  restated.model.sensitivity *= matrix_factor;
  restated.sensitivity_sigma *= matrix_factor;
  for (const AxisTermInfo& info : kAxisTerms) {
    restated.model.axis_terms[info.term] /= info.PowerOf(reading_per_raw);
    if (auto& sigma = restated.axis_term_sigma[info.term]) *sigma /= info.PowerOf(reading_per_raw);
  }
  if (restated.g_sensitivity) *restated.g_sensitivity *= reading_per_raw;
  if (restated.thermal) {
    ThermalTerms& thermal = *restated.thermal;
    for (Eigen::Vector3d& term : thermal.bias) term *= reading_per_raw;
    for (ThermalKnot& knot : thermal.knots) {
      knot.slope *= reading_per_raw;
      knot.curve *= reading_per_raw;
    }
    for (Eigen::Matrix3d& term : thermal.sensitivity) term *= matrix_factor;
    for (std::optional<Eigen::Vector3d>& rate : thermal.rate) {
      if (rate) *rate *= reading_per_raw;
    }
  }
  return restated;
}

void ScaleCovariance(Triad triad,
                     double reading_per_raw,
                     double result_per_truth,
                     NamedCovariance* covariance) {
  for (std::size_t i = 0; i < covariance->parameters.size(); ++i) {
    const auto name = ParameterName::Parse(covariance->parameters[i]);
    if (!name || name->triad != triad) continue;
    const auto term = InfoOf(name->kind).axis_term;
    const double factor = name->kind == ParameterKind::kSensitivity
                              ? reading_per_raw / result_per_truth
                          : term ? 1.0 / InfoOf(*term).PowerOf(reading_per_raw)
                                 : reading_per_raw;
    covariance->matrix.row(static_cast<Eigen::Index>(i)) *= factor;
    covariance->matrix.col(static_cast<Eigen::Index>(i)) *= factor;
  }
}

Status TakeReadingsIn(Triad triad,
                      const Unit& unit,
                      const std::optional<double>& si_per_count,
                      Calibration* calibration) {
  TriadCalibration& sensor = *calibration->sensors[triad];
  if (sensor.input_unit == unit.name) return {};
  TRUETRIAD_ASSIGN_OR_RETURN(const double reading_per_raw,
                             ReadingPerRaw(sensor, triad, unit, si_per_count));
  sensor = InUnits(sensor, reading_per_raw, 1.0);
  ScaleCovariance(triad, reading_per_raw, 1.0, &calibration->covariance);
  sensor.input_unit = unit.name;
  sensor.si_per_count = si_per_count;
  return {};
}

}  // namespace truetriad
