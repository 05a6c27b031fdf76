// SPDX-License-Identifier: Apache-2.0
#include "line/tilt.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "line/baseline.h"
#include "line/linear_model.h"
#include "line/multiple_tests.h"
#include "math/dense/cholesky.h"
#include "math/dense/lu.h"
#include "math/dense/products.h"
#include "math/distributions.h"
#include "truetriad/math/rotation.h"

namespace truetriad::line {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Of robust σ of each sensor's rotation: units beyond are spoilt.
constexpr double kReachOfRotations = 8.0;
// Degrees of freedom of the rotations' covariance, at least, and for each of its rows.
constexpr double kLeastTiltDof = 10.0;
constexpr double kTiltDofOfRow = 2.0;

// Places of a sensor's nine sensitivities.
struct SensorAxes {
  std::string sensor;
  std::array<std::array<Index, 3>, 3> place{};
};

std::vector<SensorAxes> SensorsOf(const LineData& data) {
  const std::string middle = ".sensitivity.";
  const std::string axes = "xyz";
  std::map<std::string, std::map<std::pair<int, int>, Index>> entries;
  for (std::size_t k = 0; k < data.parameters.size(); ++k) {
    const std::string& name = data.parameters[k];
    const std::size_t dot = name.find('.');
    if (dot == std::string::npos || name.compare(dot, middle.size(), middle) != 0) continue;
    const std::string entry = name.substr(dot + middle.size());
    if (entry.size() != 2) continue;
    const std::size_t row = axes.find(entry[0]);
    const std::size_t col = axes.find(entry[1]);
    if (row == std::string::npos || col == std::string::npos) continue;
    entries[name.substr(0, dot)][{static_cast<int>(row), static_cast<int>(col)}] =
        static_cast<Index>(k);
  }
  std::vector<SensorAxes> sensors;
  for (const auto& [sensor, places] : entries) {
    if (places.size() != 9) continue;  // diagonal, or the frame's own
    SensorAxes own{sensor, {}};
    for (const auto& [at, place] : places) {
      own.place[static_cast<std::size_t>(at.first)][static_cast<std::size_t>(at.second)] = place;
    }
    sensors.push_back(own);
  }
  return sensors;
}

// Sensing axes of a unit: rows of unit length; unset where one is unknown.
std::optional<Matrix3d> AxesOf(const UnitRecord& unit, const SensorAxes& sensor) {
  Matrix3d axes;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t col = 0; col < 3; ++col) {
      const Index place = sensor.place[row][col];
      axes(static_cast<Index>(row), static_cast<Index>(col)) =
          place < unit.values.size() ? unit.values[place]
                                     : std::numeric_limits<double>::quiet_NaN();
    }
  }
  if (!axes.allFinite()) return std::nullopt;
  for (Index row = 0; row < 3; ++row) axes.row(row).normalize();
  return axes;
}

// Whether these sensitivities leave a rotation open: none but the three largest is fixed, and none
// is tied to another.
bool IsFree(const LineData& data, const SensorAxes& sensor) {
  RunningScatter scatter(9);
  std::array<std::vector<double>, 9> entries;
  for (const UnitRecord& unit : data.units) {
    const std::optional<Matrix3d> axes = AxesOf(unit, sensor);
    if (!axes) continue;
    for (std::size_t k = 0; k < 9; ++k) {
      const double value = unit.values[sensor.place[k / 3][k % 3]];
      entries[k].push_back(value);
    }
  }
  const auto count = entries[0].size();
  if (count < 2) return false;
  for (std::size_t unit = 0; unit < count; ++unit) {
    VectorXd row(9);
    for (std::size_t k = 0; k < 9; ++k) row[static_cast<Index>(k)] = entries[k][unit];
    scatter.Add(row);
  }
  const bool vary = std::all_of(entries.begin(), entries.end(), Varies);
  return vary && (count < 10 || IndependentColumns(scatter.Covariance()).size() == 9);
}

// The small rotation ω that takes `mean` axes nearest to `axes`: least squares of
// axes = mean + mean x ω.
Vector3d RotationOf(const Matrix3d& axes, const Matrix3d& mean) {
  Matrix3d normal = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (Index row = 0; row < 3; ++row) {
    const Matrix3d cross = Skew(mean.row(row).transpose());
    normal += cross.transpose() * cross;
    right += cross.transpose() * (axes.row(row) - mean.row(row)).transpose();
  }
  return Solve3(normal, right);
}

// Rotations of all sensors, three entries each, of the units that have them all.
struct Rotations {
  std::vector<std::size_t> units;
  MatrixXd values;  // a column each unit
};

Rotations RotationsOf(const LineData& data, const std::vector<SensorAxes>& sensors) {
  Rotations rotations;
  std::vector<std::vector<Matrix3d>> axes;
  for (std::size_t unit = 0; unit < data.units.size(); ++unit) {
    std::vector<Matrix3d> own;
    for (const SensorAxes& sensor : sensors) {
      if (const auto found = AxesOf(data.units[unit], sensor)) own.push_back(*found);
    }
    if (own.size() != sensors.size()) continue;
    rotations.units.push_back(unit);
    axes.push_back(std::move(own));
  }
  rotations.values.resize(static_cast<Index>(3 * sensors.size()), static_cast<Index>(axes.size()));
  for (std::size_t s = 0; s < sensors.size() && !axes.empty(); ++s) {
    Matrix3d mean;
    for (Index entry = 0; entry < 9; ++entry) {
      std::vector<double> values;
      for (const auto& own : axes) values.push_back(own[s](entry / 3, entry % 3));
      mean(entry / 3, entry % 3) = Median(std::move(values));
    }
    for (Index row = 0; row < 3; ++row) mean.row(row).normalize();
    for (std::size_t k = 0; k < axes.size(); ++k) {
      rotations.values.block<3, 1>(static_cast<Index>(3 * s), static_cast<Index>(k)) =
          RotationOf(axes[k][s], mean);
    }
  }
  return rotations;
}

// Of the units that carry the factor's tag.
FactorSums SumsOfRotations(const Factors& factors, const Rotations& rotations, std::size_t factor) {
  std::vector<bool> good(rotations.units.size(), true);
  for (Index row = 0; row < rotations.values.rows(); ++row) {
    const VectorXd values = rotations.values.row(row).transpose();
    const RobustMoments robust = RobustMomentsOf({values.begin(), values.end()});
    for (std::size_t k = 0; k < good.size(); ++k) {
      const double deviation = std::abs(values[static_cast<Index>(k)] - robust.centre);
      if (robust.sigma > 0.0 && deviation > kReachOfRotations * robust.sigma) good[k] = false;
    }
  }
  FactorSums sums(factors, rotations.values.rows());
  for (std::size_t k = 0; k < good.size(); ++k) {
    if (!good[k] || !factors.IsNamed(factor, rotations.units[k])) continue;
    sums.Add(factors, rotations.units[k], rotations.values.col(static_cast<Index>(k)));
  }
  return sums;
}

// The rotation that all sensors of a level share, weighed by the covariance of theirs, which is an
// estimate with `dof`: what the sensors disagree by (`rest`) is Hotelling's T^2 of 3 (sensors - 1)
// contrasts, and the rotation's own, given the rest, one of 3 (Rao 1959).
void Share(const VectorXd& rotations, const MatrixXd& covariance, double dof, LevelTilt* level) {
  const Index sensors = rotations.size() / 3;
  MatrixXd design(rotations.size(), 3);
  for (Index sensor = 0; sensor < sensors; ++sensor) {
    design.middleRows(3 * sensor, 3) = Matrix3d::Identity();
  }
  const Cholesky root(covariance);
  const MatrixXd white_design = root.SolveLower(design);
  const VectorXd white = root.SolveLowerVector(rotations);
  const Cholesky information(TransposeTimes(white_design, white_design));
  level->rotation_rad = information.SolveVector(TransposeTimesVector(white_design, white));
  const double rest = (white - TimesVector(white_design, level->rotation_rad)).squaredNorm();
  const double own = std::max(white.squaredNorm() - rest, 0.0);
  const double others = static_cast<double>(3 * sensors - 3);
  const double left_dof = dof - others - 2.0;
  const double widening = (1.0 + rest / dof) * dof / left_dof;
  level->sigma_rad = (widening * information.Inverse().diagonal()).cwiseSqrt();
  level->p = FisherUpper(own / widening / 3.0, 3.0, left_dof);
  if (sensors > 1) {
    const double rest_dof = dof - others + 1.0;
    level->p_common = FisherUpper(rest / others * rest_dof / dof, others, rest_dof);
  }
}

FactorTilt TiltOf(const Factors& factors,
                  const FactorSums& sums,
                  const std::vector<SensorAxes>& sensors,
                  std::size_t factor) {
  FactorTilt tilt;
  tilt.factor = static_cast<int>(factor);
  for (const SensorAxes& sensor : sensors) tilt.sensors.push_back(sensor.sensor);
  const FactorModel model(factors, sums, ModelFor(factors, factor));
  const FactorError error = ErrorOf(factors, sums, factor, model);
  const double rows = static_cast<double>(3 * sensors.size());
  if (error.dof < std::max(kLeastTiltDof, kTiltDofOfRow * rows)) return tilt;
  const FactorModel::Levels levels = model.LevelsOf(factor);
  const MatrixXd covariance = error.squares / error.dof;
  if (!Cholesky(covariance).is_positive()) return tilt;
  const Index place = FactorSums::Places(factors)[factor];
  for (std::size_t level = 0; level < levels.estimable.size(); ++level) {
    if (!levels.estimable[level] || factors.factors[factor].levels[level].empty()) continue;
    const auto row = static_cast<Index>(level);
    LevelTilt own;
    own.level = factors.factors[factor].levels[level];
    own.units = static_cast<int>(sums.indicators(place + row, place + row));
    Share(levels.effects.row(row).transpose(), levels.variance[row] * covariance, error.dof, &own);
    tilt.levels.push_back(own);
  }
  return tilt;
}

void AdjustTilts(std::vector<FactorTilt>* tilts) {
  std::vector<double> p;
  for (const FactorTilt& tilt : *tilts) {
    for (const LevelTilt& level : tilt.levels) p.push_back(level.p);
  }
  const std::vector<double> adjusted = HolmAdjusted(p);
  auto next = adjusted.begin();
  for (FactorTilt& tilt : *tilts) {
    for (LevelTilt& level : tilt.levels) level.p_adjusted = *next++;
  }
}

bool HoldsUnits(const std::string& factor) { return factor == "fixture" || factor == "slot"; }

}  // namespace

std::vector<FactorTilt> TiltsOf(const LineData& data,
                                const Factors& factors,
                                std::vector<std::string>* notes) {
  std::vector<FactorTilt> tilts;
  const std::vector<SensorAxes> sensors = SensorsOf(data);
  const bool any = std::any_of(factors.factors.begin(), factors.factors.end(), [](const auto& f) {
    return HoldsUnits(f.name);
  });
  if (!any || sensors.empty()) return tilts;
  for (const SensorAxes& sensor : sensors) {
    if (IsFree(data, sensor)) continue;
    notes->push_back("the tilt of fixtures does not show: the axes of the " + sensor.sensor +
                     " define the frame (gauge), which turns with the unit; it takes given "
                     "attitudes and gauge: fixture");
    return tilts;
  }
  const Rotations rotations = RotationsOf(data, sensors);
  for (std::size_t factor = 0; factor < factors.count(); ++factor) {
    if (!HoldsUnits(factors.factors[factor].name)) continue;
    const FactorSums sums = SumsOfRotations(factors, rotations, factor);
    tilts.push_back(TiltOf(factors, sums, sensors, factor));
  }
  AdjustTilts(&tilts);
  return tilts;
}

}  // namespace truetriad::line
