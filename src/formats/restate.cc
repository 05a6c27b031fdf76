// SPDX-License-Identifier: Apache-2.0
#include "formats/restate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "calibrate/reading_units.h"
#include "formats/parameter_pattern.h"
#include "formats/text.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/qr.h"
#include "model/board_rotation.h"
#include "model/corrected_error.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

std::string Name(Triad triad) { return std::string(TriadName(triad)); }

double AngleDeg(const Eigen::Matrix3d& rotation) {
  return Eigen::AngleAxisd(rotation).angle() * kDegPerRad;
}

/// The temperature for which a constant replaces temperature terms that the format cannot hold.
Result<double> ConstantTemperature(Triad triad,
                                   const ThermalTerms& thermal,
                                   const ExportOptions& options) {
  if (!options.temperature_degc) return thermal.reference_degc;
  const double temperature = *options.temperature_degc;
  if (!(temperature >= thermal.range_degc[0] && temperature <= thermal.range_degc[1])) {
    return Error(ErrorCode::kInvalidArgument,
                 "--temperature=" + RoundedText(temperature, 6) + " is outside " +
                     RoundedText(thermal.range_degc[0], 4) + " to " +
                     RoundedText(thermal.range_degc[1], 4) + " degC, where the " + Name(triad) +
                     " was calibrated");
  }
  return temperature;
}

/// Chosen: the highest degree of the polynomial that replaces a piecewise bias.
constexpr int kRefitOrder = 9;

/// Replaces the bias by a polynomial of degree `order`, which the format can hold.
void LowerBiasOrder(int order, TriadCalibration* sensor) {
  ThermalTerms& thermal = *sensor->thermal;
  std::vector<Eigen::Vector3d> terms(static_cast<std::size_t>(order), Eigen::Vector3d::Zero());
  Eigen::Vector3d constant;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> fit = ChebyshevFit(
        [&](double tau) {
          return ModelAtTemperature(sensor->model, thermal, thermal.reference_degc + tau)
              .bias[axis];
        },
        thermal.range_degc[0] - thermal.reference_degc,
        thermal.range_degc[1] - thermal.reference_degc,
        order);
    constant[axis] = fit[0];
    for (std::size_t k = 0; k < terms.size(); ++k) terms[k][axis] = fit[k + 1];
  }
  thermal.knots.clear();
  sensor->model.bias = constant;
  thermal.bias = terms;
}

/// Drops or replaces the temperature terms that the format cannot hold.
Status HoldThermal(Triad triad,
                   const TriadCapacity& capacity,
                   const ExportOptions& options,
                   TriadCalibration* sensor,
                   std::vector<std::string>* notes) {
  if (!sensor->thermal) return {};
  ThermalTerms& thermal = *sensor->thermal;
  TRUETRIAD_ASSIGN_OR_RETURN(const double at, ConstantTemperature(triad, thermal, options));
  const std::string where = " at " + RoundedText(at, 6) + " degC";
  const TriadModel<double> constant = ModelAtTemperature(sensor->model, thermal, at);
  if (thermal.rate.any() && !capacity.rate_thermal) {
    notes->emplace_back(Name(triad) + ": dropped: bias from the temperature rate" +
                        (thermal.rate_range_degcps
                             ? ""
                             : "; the resulting error depends on how fast the temperature changes "
                               "and is not included in the stated error"));
    thermal.rate = {};
    thermal.rate_lag_s.reset();
  }
  if (thermal.element_lag_s && !capacity.rate_thermal) {
    notes->emplace_back(
        Name(triad) +
        ": dropped: temperature lag; thermal terms use the temperature as measured, without lag" +
        (thermal.rate_range_degcps ? ""
                                   : "; the resulting error is not included in the stated error"));
    thermal.element_lag_s.reset();
  }
  if (!thermal.sensitivity.empty() && !capacity.matrix_thermal) {
    notes->emplace_back(Name(triad) + ": dropped: thermal terms of the matrix; used the values" +
                        where);
    sensor->model.sensitivity = constant.sensitivity;
    thermal.sensitivity.clear();
  }
  if (!thermal.bias.empty() && capacity.bias_order == 0) {
    notes->emplace_back(Name(triad) + ": dropped: thermal terms of the bias; used the values" +
                        where);
    sensor->model.bias = constant.bias;
    thermal.bias.clear();
  } else if (static_cast<int>(thermal.bias.size()) > capacity.bias_order &&
             thermal.range_degc[1] > thermal.range_degc[0]) {
    notes->emplace_back(Name(triad) + ": thermal terms of the bias reduced from order " +
                        std::to_string(thermal.bias.size()) + " to " +
                        std::to_string(capacity.bias_order));
    LowerBiasOrder(capacity.bias_order, sensor);
  }
  if (!thermal.knots.empty() && capacity.bias_order > 0) {
    const int order = std::min(capacity.bias_order, kRefitOrder);
    notes->emplace_back(
        Name(triad) + ": piecewise thermal terms of the bias replaced by one polynomial of order " +
        std::to_string(order));
    LowerBiasOrder(order, sensor);
  }
  thermal.knots.clear();
  if (thermal.bias.empty() && thermal.sensitivity.empty() && !thermal.rate.any()) {
    sensor->thermal.reset();
  }
  return {};
}

void DropAxisTerms(Triad triad, TriadCalibration* sensor, std::vector<std::string>* notes) {
  for (const AxisTermInfo& info : kAxisTerms) {
    Eigen::Vector3d& term = sensor->model.axis_terms[info.term];
    if (term.isZero(0.0)) continue;
    notes->emplace_back(Name(triad) + ": dropped: " + std::string(info.words));
    term.setZero();
  }
  sensor->axis_term_sigma = {};
}

void Turn(const Eigen::Matrix3d& rotation, TriadCalibration* sensor) {
  sensor->model.sensitivity = sensor->model.sensitivity * rotation;
  if (sensor->g_sensitivity) sensor->g_sensitivity = *sensor->g_sensitivity * rotation;
  if (!sensor->thermal) return;
  for (Eigen::Matrix3d& term : sensor->thermal->sensitivity) term = term * rotation;
}

/// Rotates the calibration from its body frame to that of the format's gauge.
void TurnIntoGauge(Gauge gauge, Restated* restated) {
  const Triad leading = restated->held.gauge_sensor;
  if (!restated->held.sensors[leading]) return;
  Eigen::Matrix3d& lead = restated->held.sensors[leading]->model.sensitivity;
  const double sign = restated->held.sensors[leading]->Scale().sum() < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix3d rotation = GaugeRotation(gauge, lead, sign);
  restated->whole.gauge = restated->held.gauge = gauge;
  // Rounding of a rotation matrix. A smaller rotation means that the frame already is the format's.
  constexpr double kSameFrame = 1e-14;
  if ((rotation - Eigen::Matrix3d::Identity()).norm() > kSameFrame) {
    for (Calibration* const calibration : {&restated->whole, &restated->held}) {
      for (std::optional<TriadCalibration>& sensor : calibration->sensors) {
        if (sensor) Turn(rotation, &*sensor);
      }
    }
    restated->rotation = {{rotation, rotation, rotation}};
    restated->notes.emplace_back("the body frame of all sensors is rotated by " +
                                 RoundedText(AngleDeg(rotation), 3) +
                                 " deg, to the frame convention " + std::string(GaugeName(gauge)));
  }
  // The elements in the other triangle are zero up to rounding; they are set to zero.
  if (gauge == Gauge::kAccelX) lead = lead.triangularView<Eigen::Lower>();
  if (gauge == Gauge::kAccelZ) lead = lead.triangularView<Eigen::Upper>();
}

/// The axes that `map` takes: "(-y, x, z)".
std::string AxisMapText(const Eigen::Matrix3d& map) {
  const std::string name = AxisMapName(map);
  std::string text;
  for (std::size_t i = 0; i < name.size(); i += 2) {
    text += (i == 0 ? "(" : ", ") + (name[i] == '+' ? name.substr(i + 1, 1) : name.substr(i, 2));
  }
  return text + ")";
}

/// Reduces the matrix to the form that the format holds.
Status HoldMatrix(Triad triad, const Format& format, TriadCalibration* sensor, Restated* restated) {
  std::vector<std::string>*const notes = &restated->notes, *const warnings = &restated->warnings;
  const MatrixForm form = format.capacity[triad].matrix;
  if (form == MatrixForm::kFull) return {};
  if (form == MatrixForm::kNothing) {
    notes->emplace_back(Name(triad) + ": dropped: bias, gains and misalignment; give " +
                        std::string(format.info.name) +
                        " readings that `truetriad apply` has corrected");
    return {};
  }
  const Eigen::Matrix3d correction = sensor->model.Correction();
  const Svd3 svd = SvdOf3(correction);
  const Eigen::Matrix3d R = svd.U * svd.V.transpose();
  // Row i names the reading that gives axis i.
  const Eigen::Matrix3d map = NearestAxisMap(R);
  const bool mirrored = correction.determinant() < 0.0;
  const bool straight = map.isIdentity(0.0);
  const std::string target(format.info.name);
  const std::string feed =
      "replace its readings (x, y, z) by " + AxisMapText(map) + " and calibrate again";
  if (form == MatrixForm::kSymmetric ? mirrored : form == MatrixForm::kDiagonal && !straight) {
    return Error(ErrorCode::kNotRepresentable,
                 "the " + Name(triad) + (mirrored ? " is mirrored" : "'s axes are swapped") +
                     (mirrored ? " (the determinant of its correction is negative)" : "") +
                     ", which " + target + " cannot represent; " + feed);
  }
  restated->dropped_turn_deg[triad] = AngleDeg(map.transpose() * R);
  const bool is_between = restated->dropped_turn_deg[triad] >= SmallestBoardTurnDeg();
  restated->is_turned[triad] = !straight || is_between;
  if (!straight && is_between) restated->dropped_turn_deg[triad] = AngleDeg(R);
  if (!straight && !(is_between && format.is_firmware)) {
    warnings->emplace_back("the " + Name(triad) + "'s axes are swapped: set its mounting in " +
                           target + ", or " + feed);
  }
  if (form == MatrixForm::kSymmetric) {
    Eigen::Matrix3d P = svd.V * svd.values.asDiagonal() * svd.V.transpose();
    P = (0.5 * (P + P.transpose())).eval();
    notes->emplace_back(Name(triad) + ": dropped: a rotation by " + RoundedText(AngleDeg(R), 3) +
                        " deg against the body frame; the format's matrix is symmetric");
    sensor->model.sensitivity = P.inverse();
    return {};
  }
  if (form == MatrixForm::kDiagonal) {
    const Eigen::Vector3d gains = correction.diagonal();
    Eigen::Matrix3d rest = gains.cwiseInverse().asDiagonal() * correction;
    rest.diagonal().setZero();
    if (rest.isZero(0.0)) return {};
    notes->emplace_back(Name(triad) + ": dropped: misalignment, up to " +
                        RoundedText(1e3 * rest.cwiseAbs().maxCoeff(), 3) + " mrad");
    sensor->model.sensitivity = gains.cwiseInverse().asDiagonal();
    return {};
  }
  notes->emplace_back(Name(triad) + ": dropped: gains and misalignment; offsets only");
  return {};
}

/// Restates readings and results in the format's units.
Status HoldUnits(Triad triad,
                 const Format& format,
                 const ExportOptions& options,
                 Restated* restated) {
  TriadCalibration& sensor = *restated->held.sensors[triad];
  const TriadCapacity& capacity = format.capacity[triad];
  TRUETRIAD_ASSIGN_OR_RETURN(const Unit raw, ParseTriadUnit(triad, sensor.input_unit));
  const std::string target(format.info.name);
  std::string chosen(capacity.reading_unit);
  if (const std::optional<std::string>& wanted = options.units[triad]) {
    if (!capacity.free_unit) {
      return Error(ErrorCode::kInvalidArgument,
                   "--units: the " + Name(triad) + " of " + target + " is in " +
                       (chosen.empty() ? sensor.input_unit : chosen) + " and cannot be changed");
    }
    chosen = *wanted;
  }
  // The size of a count may be unknown. A format with a free unit therefore keeps counts unless the
  // user chose a unit.
  std::string reading =
      chosen.empty() || (capacity.free_unit && raw.is_counts && !options.units[triad])
          ? sensor.input_unit
          : chosen;
  double& reading_per_raw = restated->reading_per_raw[triad];
  reading_per_raw = 1.0;
  if (reading != sensor.input_unit) {
    TRUETRIAD_ASSIGN_OR_RETURN(const Unit unit, ParseTriadUnit(triad, reading));
    const std::optional<double> truth_per_raw = NominalTruthPerRaw(sensor, triad);
    if (unit.is_counts) {
      return Error(ErrorCode::kNotRepresentable,
                   target + " corrects counts, but the " + Name(triad) + " was calibrated in " +
                       sensor.input_unit + "; calibrate it from a recording in counts");
    }
    if (!truth_per_raw) {
      return Error(ErrorCode::kCountsOfUnknownSize,
                   "the " + Name(triad) + " was calibrated in counts of unknown size, and " +
                       target + " corrects readings in " + reading +
                       "; state `si_per_count:` of the stream in the recording's manifest and "
                       "calibrate again");
    }
    reading_per_raw = *truth_per_raw / unit.truth_per_raw;
  }
  double& truth_per_result = restated->truth_per_result[triad];
  truth_per_result = 1.0;
  std::string result(TruthUnitName(triad));
  if (capacity.result_in_reading_unit) {
    result = reading == "counts" && !chosen.empty() ? chosen : reading;
    TRUETRIAD_ASSIGN_OR_RETURN(const Unit unit, ParseTriadUnit(triad, result));
    truth_per_result = unit.truth_per_raw;
    if (unit.is_counts && sensor.si_per_count) truth_per_result = *sensor.si_per_count;
    if (unit.is_counts && !sensor.si_per_count) {
      truth_per_result = std::cbrt(std::abs(sensor.model.Correction().determinant()));
      restated->notes.emplace_back(
          Name(triad) + ": the size of a count is not stated; the mean gain is used instead");
    }
  }
  sensor = InUnits(sensor, reading_per_raw, 1.0 / truth_per_result);
  ScaleCovariance(triad, reading_per_raw, 1.0 / truth_per_result, &restated->held.covariance);
  sensor.input_unit = reading;
  sensor.output_unit = result;
  if (capacity.matrix <= MatrixForm::kNone) sensor.model.sensitivity.setIdentity();
  if (capacity.matrix == MatrixForm::kNothing) sensor.model.bias.setZero();
  return {};
}

}  // namespace

void TurnReadingsToo(const Eigen::Matrix3d& turn, TriadCalibration* sensor) {
  Turn(turn.transpose(), sensor);
  sensor->model.sensitivity = turn * sensor->model.sensitivity;
  sensor->model.bias = turn * sensor->model.bias;
  if (sensor->g_sensitivity) sensor->g_sensitivity = turn * *sensor->g_sensitivity;
  if (!sensor->thermal) return;
  for (Eigen::Matrix3d& term : sensor->thermal->sensitivity) term = turn * term;
  for (Eigen::Vector3d& term : sensor->thermal->bias) term = turn * term;
}

std::vector<double> ChebyshevFit(const std::function<double(double)>& function,
                                 double low,
                                 double high,
                                 int degree) {
  const Eigen::Index size = degree + 1;
  const double middle = 0.5 * (low + high);
  const double half = 0.5 * (high - low);
  // Interpolates in u = (x - middle) / half, in which the powers are well conditioned.
  Eigen::MatrixXd powers(size, size);
  Eigen::VectorXd values(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const double u =
        std::cos(std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(size));
    values[i] = function(middle + half * u);
    for (Eigen::Index k = 0; k < size; ++k) powers(i, k) = std::pow(u, static_cast<double>(k));
  }
  const Eigen::VectorXd in_u = LeastSquares(powers).SolveVector(values);
  // Converts powers of u to powers of x: Horner's scheme with (x - middle) / half for u.
  std::vector<double> in_x(static_cast<std::size_t>(size), 0.0);
  for (Eigen::Index k = size - 1; k >= 0; --k) {
    for (std::size_t j = in_x.size(); j-- > 0;) {
      in_x[j] = -middle / half * in_x[j] + (j > 0 ? in_x[j - 1] / half : 0.0);
    }
    in_x[0] += in_u[k];
  }
  return in_x;
}

Result<Restated> Restate(const Calibration& calibration,
                         const Format& format,
                         const ExportOptions& options) {
  if (!calibration.IsUsable()) {
    return Error(ErrorCode::kCalibrationNotUsable,
                 "this calibration is not usable (" + std::string(calibration.ReasonNotUsable()) +
                     "), so it has no parameters to export");
  }
  Restated restated;
  restated.whole = restated.held = calibration;
  bool any = false;
  for (const Triad triad : kTriads) {
    std::optional<TriadCalibration>& sensor = restated.held.sensors[triad];
    if (!sensor) continue;
    if (!format.capacity[triad].held) {
      restated.notes.emplace_back(Name(triad) + ": dropped: " + std::string(format.info.name) +
                                  " does not support it");
      continue;  // The sensor may define the frame, so it is removed only after the rotation.
    }
    any = true;
    TRUETRIAD_RETURN_IF_ERROR(
        HoldThermal(triad, format.capacity[triad], options, &*sensor, &restated.notes));
    if (!format.capacity[triad].axis_terms) DropAxisTerms(triad, &*sensor, &restated.notes);
    if (sensor->g_sensitivity && !format.capacity[triad].g_sensitivity) {
      restated.notes.emplace_back(Name(triad) + ": dropped: g-sensitivity");
      sensor->g_sensitivity.reset();
    }
  }
  if (!any) {
    return Error(
        ErrorCode::kMissingSensor,
        "the calibration includes no sensor that " + std::string(format.info.name) + " supports");
  }
  if (format.gauge) TurnIntoGauge(*format.gauge, &restated);
  const std::optional<Eigen::Vector3d>& turn_deg = calibration.tags.magnetometer_turn_deg;
  const std::string& firmware = calibration.tags.firmware;
  if (Reads(firmware, format.info.name) && turn_deg && !turn_deg->isZero(0.0)) {
    const Eigen::Matrix3d turn = TurnOf(*turn_deg);
    for (const Triad triad : kTriads) {
      if (triad != Triad::kMagnetometer && firmware != kArduPilotOf2014) continue;
      for (Calibration* const turned : {&restated.whole, &restated.held}) {
        if (turned->sensors[triad]) TurnReadingsToo(turn, &*turned->sensors[triad]);
      }
      restated.rotation[triad] = turn.transpose();
    }
  }
  for (const Triad triad : kTriads) {
    std::optional<TriadCalibration>& sensor = restated.held.sensors[triad];
    if (!sensor) continue;
    if (!format.capacity[triad].held) {
      sensor.reset();
      continue;
    }
    TRUETRIAD_RETURN_IF_ERROR(HoldMatrix(triad, format, &*sensor, &restated));
    TRUETRIAD_RETURN_IF_ERROR(HoldUnits(triad, format, options, &restated));
  }
  return restated;
}

}  // namespace truetriad
