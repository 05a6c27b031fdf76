// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "model/corrected_error.h"
#include "report/content.h"
#include "report/table.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

std::string AxisName(int axis) { return {AxisLetter(axis)}; }

std::string BiasName(Triad triad, int axis) {
  return std::string(TriadName(triad)) + ".bias." + AxisName(axis);
}

std::string SensitivityName(Triad triad, int row, int column) {
  return std::string(TriadName(triad)) + ".sensitivity." + AxisName(row) + AxisName(column);
}

/// Whether the chip's axes nearly have their intended directions. If so, gains and small angles are
/// shown, otherwise the whole matrix.
bool AxesAreAligned(const TriadCalibration& sensor) {
  const Eigen::Matrix3d sensitivity = sensor.BySensingAxes();
  return ((sensitivity.diagonal().cwiseAbs().array() / sensitivity.rowwise().norm().array()) > 0.8)
      .all();
}

/// Builds the rows of one triad's tables.
class ParameterRows {
 public:
  ParameterRows(const TriadCalibration& sensor,
                Triad triad,
                const NamedCovariance& covariance,
                double coverage_factor = 1.0)
      : sensor_(sensor),
        triad_(triad),
        covariance_(covariance),
        coverage_factor_(coverage_factor),
        truth_unit_(TruthUnit(triad)),
        raw_unit_(DisplayUnit(sensor.input_unit)) {}

  Table Parameters() {
    table_ = Headed("; x; y; z; unit", "lrrrl");
    AddMounting();
    AddBias();
    AddBiasPerScale();
    if (AxesAreAligned(sensor_)) {
      AddScale();
    } else {
      AddSensitivity();
    }
    AddFurtherTerms();
    table_.Add() << "rest noise σ" << Significant(sensor_.noise.sigma, 4) << raw_unit_;
    return std::move(table_);
  }

  Table Results() {
    table_ = Headed(TriadTitle(triad_) + "; x; y; z; unit", "lrrrl");
    AddBias();
    AddSensitivity();
    AddFurtherTerms();
    return std::move(table_);
  }

  /// If the gauge fixes an axis or the model has no misalignment, the axis has no row, instead of a
  /// row of zeros.
  Table Misalignment() const {
    Table table = Headed("misalignment; x; y; z; unit; x; y; z; unit", "lrrrlrrrl");
    if (!AxesAreAligned(sensor_)) return table;
    const Eigen::Matrix3d angles = sensor_.MisalignmentRad();
    for (int i = 0; i < 3; ++i) {
      ThreeCells in_mrad, in_deg;
      bool is_known = false;
      for (int j = 0; j < 3; ++j) {
        const double sigma = i == j ? 0.0 : MisalignmentSigma(i, j);
        is_known = is_known || sigma > 0.0 || angles(i, j) != 0.0;
        const auto at = static_cast<std::size_t>(j);
        in_mrad[at] = i == j ? "–" : Entry(1e3 * angles(i, j), 1e3 * sigma);
        in_deg[at] = i == j ? "–" : Significant(kDegPerRad * angles(i, j), 3);
      }
      if (is_known) table.Add() << AxisName(i) << in_mrad << "mrad" << in_deg << "°";
    }
    return table;
  }

 private:
  /// The value with its σ. A value without σ is fixed by the gauge or by the experiment, and is
  /// marked as fixed.
  std::string Entry(double value, double sigma) const {
    return sigma > 0.0 ? WithSigma(value, coverage_factor_ * sigma)
                       : Significant(value, 6) + " fixed";
  }

  /// σ of value / gain for sensing axis i, from the covariance. If the covariance lacks one of the
  /// two, σ is computed as if the value and the gain were uncorrelated.
  double SigmaPerScale(const std::string& name, double value, double sigma, int i) const {
    // The covariance holds the matrix entries with their signs.
    const double scale = sensor_.model.sensitivity(i, BodyAxis(i)), quotient = value / scale;
    return SigmaOf(covariance_, {{name, 1.0 / scale}, {ScaleName(i), -quotient / scale}})
        .value_or(std::hypot(sigma / scale, quotient * ScaleSigma(i) / scale));
  }

  double MisalignmentSigma(int i, int j) const {
    return SigmaPerScale(SensitivityName(triad_, i, BodyAxis(j)),
                         sensor_.model.sensitivity(i, BodyAxis(j)),
                         sensor_.sensitivity_sigma(i, BodyAxis(j)),
                         i);
  }

  /// Adds a row in which `cell(axis)` gives the text of each axis.
  template <typename CellOfAxis>
  void Add(const std::string& label, const std::string& unit, const CellOfAxis& cell) {
    table_.Add() << label << cell(0) << cell(1) << cell(2) << unit;
  }

  /// The body axis along which sensing axis i is meant to point.
  int BodyAxis(int i) const {
    Eigen::Index axis = 0;
    sensor_.mounting.row(i).cwiseAbs().maxCoeff(&axis);
    return static_cast<int>(axis);
  }

  std::string ScaleName(int i) const { return SensitivityName(triad_, i, BodyAxis(i)); }
  double ScaleSigma(int i) const { return sensor_.sensitivity_sigma(i, BodyAxis(i)); }

  std::string GainUnit() const {
    return raw_unit_ == truth_unit_ ? "" : raw_unit_ + " per " + truth_unit_;
  }

  void AddMounting() {
    if (sensor_.mounting.isIdentity(0.0)) return;
    const std::string map = AxisMapName(sensor_.mounting);
    Add("along body", "", [&](std::size_t i) { return map.substr(2 * i, 2); });
  }

  void AddBias() {
    Add("bias", raw_unit_, [&](int i) {
      return Entry(sensor_.model.bias(i), sensor_.bias_sigma(i));
    });
  }

  void AddBiasPerScale() {
    // If the readings are in a physical unit, the row of the bias in this unit suffices.
    const Result<Unit> unit = ParseTriadUnit(triad_, sensor_.input_unit);
    if ((unit && !unit->is_counts) || !AxesAreAligned(sensor_)) return;
    Add("bias / scale", truth_unit_, [&](int i) {
      return Entry(
          sensor_.model.bias(i) / sensor_.Scale()(i),
          SigmaPerScale(BiasName(triad_, i), sensor_.model.bias(i), sensor_.bias_sigma(i), i));
    });
  }

  void AddScale() {
    const Eigen::Vector3d scale = sensor_.Scale();
    Add("scale", GainUnit(), [&](int i) { return Entry(scale(i), ScaleSigma(i)); });
    const std::optional<double> nominal = NominalTruthPerRaw(sensor_, triad_);
    if (!nominal) return;
    // A chip that reports gravity instead of specific force has negative gains on all axes.
    const double sign = (scale.array() < 0.0).all() ? -1.0 : 1.0;
    const Eigen::Vector3d error = (sign * scale * *nominal).array() - 1.0;
    const bool large = error.cwiseAbs().maxCoeff() >= 0.01;
    const double factor = large ? 1e2 : 1e6;
    Add("scale error", large ? "%" : "ppm", [&](int i) {
      return Entry(error(i) * factor, ScaleSigma(i) * *nominal * factor);
    });
  }

  void AddSensitivity() {
    for (int i = 0; i < 3; ++i) {
      Add("sensitivity " + AxisName(i), GainUnit(), [&](int j) {
        return Entry(sensor_.model.sensitivity(i, j), sensor_.sensitivity_sigma(i, j));
      });
    }
  }

  /// Adds a row for a vector, with σ if the covariance lists its entries. `name`: the name of the
  /// entries in the covariance, without the sensor at its beginning and the axis at its end.
  void AddTerm(const std::string& label,
               const Eigen::Vector3d& values,
               const std::string& name,
               const std::string& unit) {
    Add(label, unit, [&](int i) {
      const auto sigma =
          SigmaOf(covariance_, {{std::string(TriadName(triad_)) + "." + name + AxisName(i), 1.0}});
      return sigma ? Entry(values(i), *sigma) : Significant(values(i), 4);
    });
  }

  void AddAxisTerms() {
    for (const AxisTermInfo& info : kAxisTerms) {
      const auto& sigma = sensor_.axis_term_sigma[info.term];
      if (!sigma) continue;
      // Per g, as in data sheets. The gain's relative σ is far below the term's and neglected.
      const Eigen::Vector3d per_g =
          kStandardGravityMps2 * sensor_.model.sensitivity.rowwise().norm();
      const std::string unit =
          info.power > 0 ? DisplayUnit("µg/g^" + std::to_string(1 + info.power)) : "ppm";
      Add(std::string(info.label), unit, [&](int i) {
        const double factor = 1e6 * info.PowerOf(per_g[i]);
        return Entry(factor * sensor_.model.axis_terms[info.term][i], factor * (*sigma)[i]);
      });
    }
  }

  void AddFurtherTerms() {
    AddAxisTerms();
    for (int row = 0; sensor_.g_sensitivity && row < 3; ++row) {
      AddTerm("g-sensitivity " + AxisName(row),
              sensor_.g_sensitivity->row(row),
              "g_sensitivity." + AxisName(row),
              raw_unit_ + " per m/s²");
    }
    if (sensor_.thermal) AddThermal(*sensor_.thermal);
  }

  void AddThermal(const ThermalTerms& thermal) {
    const auto power_of = [](const std::string& what, std::size_t i) {
      return DisplayUnit(what + '^' + std::to_string(i + 1));
    };
    for (std::size_t i = 0; i < thermal.bias.size(); ++i) {
      AddTerm("bias, " + power_of("τ", i),
              thermal.bias[i],
              "thermal.bias." + std::to_string(i + 1) + ".",
              raw_unit_ + " / " + power_of("°C", i));
    }
    for (std::size_t i = 0; i < thermal.sensitivity.size(); ++i) {
      for (int row = 0; row < 3; ++row) {
        AddTerm("sensitivity, " + power_of("τ", i) + " " + AxisName(row),
                thermal.sensitivity[i].row(row),
                "thermal.sensitivity." + std::to_string(i + 1) + "." + AxisName(row),
                raw_unit_ + " per " + truth_unit_ + " / " + power_of("°C", i));
      }
    }
    for (const RateTermInfo& info : kRateTerms) {
      if (!thermal.rate[info.term]) continue;
      AddTerm("bias, " + DisplayUnit(info.words),
              *thermal.rate[info.term],
              "thermal." + std::string(info.path) + ".",
              raw_unit_ + " " + DisplayUnit(info.unit));
    }
    if (thermal.element_lag_s) {
      AddTerm("lag of T", *thermal.element_lag_s, "thermal.element_lag.", "s");
    }
    if (thermal.rate_lag_s) AddTerm("lag of dT/dt", *thermal.rate_lag_s, "thermal.rate_lag.", "s");
  }

  const TriadCalibration& sensor_;
  Triad triad_;
  const NamedCovariance& covariance_;
  double coverage_factor_;
  std::string truth_unit_;
  std::string raw_unit_;
  Table table_;
};

/// C and b as lists that most programming languages can read.
std::string CopyOfCorrection(const Table& table, Triad triad) {
  const auto& rows = table.rows;
  const auto listed = [](const std::string& a, const std::string& b, const std::string& c) {
    return '[' + a + ", " + b + ", " + c + ']';
  };
  const auto row_of_c = [&](const auto& row) { return listed(row[1], row[2], row[3]); };
  const auto unit = [](const std::string& words) { return words.empty() ? "1" : words; };
  return std::string(TriadName(triad)) + ": corrected = C (raw - b), C in " + unit(rows[0][4]) +
         ", b in " + unit(rows[0][6]) +
         "\nC = " + listed(row_of_c(rows[0]), row_of_c(rows[1]), row_of_c(rows[2])) +
         "\nb = " + listed(rows[0][5], rows[1][5], rows[2][5]) + '\n';
}

}  // namespace

std::optional<double> SigmaOf(const NamedCovariance& covariance, const Derivatives& derivatives) {
  const std::vector<std::string>& names = covariance.parameters;
  const auto size = static_cast<Eigen::Index>(names.size());
  if (covariance.matrix.rows() != size || covariance.matrix.cols() != size) return std::nullopt;
  std::vector<Eigen::Index> places;
  for (const auto& [name, derivative] : derivatives) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) return std::nullopt;
    places.push_back(found - names.begin());
  }
  double variance = 0.0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t j = 0; j < places.size(); ++j) {
      variance +=
          derivatives[i].second * derivatives[j].second * covariance.matrix(places[i], places[j]);
    }
  }
  return std::sqrt(std::max(variance, 0.0));
}

Table ParameterTable(const TriadCalibration& sensor,
                     Triad triad,
                     const NamedCovariance& covariance) {
  return ParameterRows(sensor, triad, covariance).Parameters();
}

Table ResultTable(const TriadCalibration& sensor,
                  Triad triad,
                  const NamedCovariance& covariance,
                  double coverage_factor) {
  return ParameterRows(sensor, triad, covariance, coverage_factor).Results();
}

Table MisalignmentTable(const TriadCalibration& sensor,
                        Triad triad,
                        const NamedCovariance& covariance) {
  return ParameterRows(sensor, triad, covariance).Misalignment();
}

Table CorrectionTable(const TriadCalibration& sensor, Triad triad) {
  constexpr int kDigits = 8;  // Eight digits hold a reading of 24 bits (1.7e7).
  const Eigen::Matrix3d correction = sensor.model.Correction();
  Table table = Headed(std::string(TriadName(triad)) + "; C x; C y; C z; unit; b; unit", "lrrrlrl");
  const std::string raw_unit = DisplayUnit(sensor.input_unit);
  const std::string unit =
      raw_unit == TruthUnit(triad) ? "" : TruthUnit(triad) + " per " + raw_unit;
  for (int i = 0; i < 3; ++i) {
    table.Add() << AxisName(i) << Significant(correction.row(i).transpose(), kDigits) << unit
                << Significant(sensor.model.bias(i), kDigits) << raw_unit;
  }
  table.copy = CopyOfCorrection(table, triad);
  return table;
}

Table ReferenceTable(const ReferenceValues& reference, const NamedCovariance& covariance) {
  Table table = Headed("reference; value; unit; ", "lrll");
  const auto add = [&](const std::string& label,
                       double value,
                       const std::string& parameter,
                       double factor,
                       const std::string& unit,
                       const std::string& otherwise,
                       bool is_stated = false) {
    const double sigma = SigmaOf(covariance, {{parameter, factor}}).value_or(0.0);
    table.Add() << label << WithSigma(value * factor, sigma) << unit
                << (sigma > 0.0 && !is_stated ? "estimated with the parameters" : otherwise);
  };
  add("gravity",
      reference.gravity_mps2,
      "reference.gravity_mps2",
      1.0,
      "m/s²",
      reference.gravity_sigma_mps2
          ? "known with σ " + Significant(*reference.gravity_sigma_mps2, 2) +
                ", which the σ of all gains include"
          : "assumed exact",
      reference.gravity_sigma_mps2.has_value());
  const bool listed = SigmaOf(covariance, {{"reference.field_ut", 1.0}}) ||
                      SigmaOf(covariance, {{"reference.dip_rad", 1.0}});
  const std::string given =
      reference.field_estimated && !listed ? "strength or dip estimated" : "given";
  if (reference.field_ut) {
    add("field strength",
        *reference.field_ut,
        "reference.field_ut",
        1.0,
        "µT",
        reference.field_nominal
            ? "nominal: the magnetometer's common scale is known only relative to this value"
            : given);
  }
  if (reference.dip_rad) {
    add("field dip (down)", *reference.dip_rad, "reference.dip_rad", kDegPerRad, "deg", given);
  }
  if (reference.fixture_from_world) {
    const Eigen::Vector4d& q = *reference.fixture_from_world;
    const Eigen::AngleAxisd turn(Eigen::Quaterniond(q[0], q[1], q[2], q[3]));
    table.Add() << "fixture's rotation" << Fixed(kDegPerRad * turn.angle(), 2) << "deg"
                << "fixture from world, about [" + Joined(Fixed(turn.axis(), 3)) + "]; estimated";
  }
  table.Add() << "temperature" << Significant(reference.temperature_degc, 4) << "°C"
              << "reference, as configured";
  return table;
}

}  // namespace truetriad
