// SPDX-License-Identifier: Apache-2.0
#include "model/corrected_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "model/directions.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

// These directions are 6.4 deg apart: one is within 3.2 deg of the worst direction, where an error
// is larger by (3.2 deg)^2 / 2 = 0.16 %.
constexpr int kDirections = 1000;

using Matrix12d = Eigen::Matrix<double, 12, 12>;

/// Covariance indices of the bias and of the sensitivity's columns; -1 for a fixed entry.
std::array<Eigen::Index, 12> PlacesOf(const NamedCovariance& covariance, Triad triad) {
  std::array<Eigen::Index, 12> places{};
  places.fill(-1);
  const std::string sensor(TriadName(triad));
  for (std::size_t at = 0; at < covariance.parameters.size(); ++at) {
    const std::string& name = covariance.parameters[at];
    for (int i = 0; i < 3; ++i) {
      const auto set = [&](const std::string& wanted, std::size_t place) {
        if (name == wanted) places[place] = static_cast<Eigen::Index>(at);
      };
      const auto row = static_cast<std::size_t>(i);
      set(sensor + ".bias." + AxisLetter(i), row);
      for (int j = 0; j < 3; ++j) {
        set(sensor + ".sensitivity." + AxisLetter(i) + AxisLetter(j),
            3 * (static_cast<std::size_t>(j) + 1) + row);
      }
    }
  }
  return places;
}

/// Squares of a reading's error: of its length, and of the angle between true and read direction.
struct Squares {
  double length = 0.0, angle = 0.0;
};

/// RMS and maximum of the error over evenly spread directions; `at`(u) returns the Squares at u.
template <typename At>
DirectionalError Over(const At& at) {
  DirectionalError error;
  for (int k = 0; k < kDirections; ++k) {
    const Squares squares = at(EvenDirection(k, kDirections));
    error.rms += squares.length / kDirections;
    error.worst = std::max(error.worst, squares.length);
    error.angle_rms += squares.angle / kDirections;
    error.angle_worst = std::max(error.angle_worst, squares.angle);
  }
  for (double* square : {&error.rms, &error.worst, &error.angle_rms, &error.angle_worst}) {
    *square = std::sqrt(*square);
  }
  return error;
}

}  // namespace

Eigen::MatrixXd BiasAndSensitivityCovariance(const NamedCovariance& covariance,
                                             const std::vector<Triad>& triads) {
  std::vector<Eigen::Index> places;
  for (const Triad triad : triads) {
    const std::array<Eigen::Index, 12> of_triad = PlacesOf(covariance, triad);
    places.insert(places.end(), of_triad.begin(), of_triad.end());
  }
  const auto size = static_cast<Eigen::Index>(places.size());
  Eigen::MatrixXd found = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < size; ++j) {
      const Eigen::Index row = places[static_cast<std::size_t>(i)];
      const Eigen::Index column = places[static_cast<std::size_t>(j)];
      if (row >= 0 && column >= 0) found(i, j) = covariance.matrix(row, column);
    }
  }
  return found;
}

std::optional<double> NominalTruthPerRaw(const TriadCalibration& sensor, Triad triad) {
  if (sensor.si_per_count) return sensor.si_per_count;
  const Result<Unit> unit = ParseTriadUnit(triad, sensor.input_unit);
  if (!unit || unit->is_counts) return std::nullopt;
  return unit->truth_per_raw;
}

Result<double> ReadingPerRaw(const TriadCalibration& sensor,
                             Triad triad,
                             const Unit& unit,
                             const std::optional<double>& si_per_count) {
  if (sensor.input_unit == unit.name) return 1.0;
  const std::optional<double> raw = NominalTruthPerRaw(sensor, triad);
  const std::optional<double> reading = unit.is_counts ? si_per_count : unit.truth_per_raw;
  if (raw && reading) return *raw / *reading;
  return Error(ErrorCode::kUnitMismatch,
               "the " + std::string(TriadName(triad)) + "'s readings are in " + unit.name +
                   ", and its calibration takes " + sensor.input_unit +
                   ", but the size of a count is unknown; state `si_per_count:` of the stream "
                   "in the manifest of the recording in counts");
}

std::optional<Eigen::Matrix3d> NominalCorrection(const TriadCalibration& sensor, Triad triad) {
  const std::optional<double> gain = NominalTruthPerRaw(sensor, triad);
  if (!gain) return std::nullopt;
  // A chip that reports gravity has the opposite sign on all axes.
  const double sign = (sensor.Scale().array() < 0.0).all() ? -1.0 : 1.0;
  return sign * *gain * sensor.mounting.transpose();
}

CorrectedError CorrectedErrorOf(const Calibration& calibration,
                                Triad triad,
                                double magnitude,
                                bool has_bias) {
  const TriadCalibration& sensor = *calibration.sensors[triad];
  CorrectedError error;
  Matrix12d covariance = BiasAndSensitivityCovariance(calibration.covariance, {triad});
  Eigen::Vector3d bias = sensor.model.bias;
  if (!has_bias) {
    bias.setZero();
    covariance.topRows<3>().setZero();
    covariance.leftCols<3>().setZero();
  }
  const Eigen::Matrix3d correction = sensor.model.Correction();
  // Parameter errors of covariance P cause an error of the reading with the second moment J P J^T,
  // where J = C (v^T x I), v = (1, magnitude u). The trace is the mean square of the error's
  // length, a quadratic form of v. The angle needs the part of the error across u.
  Eigen::Matrix4d traces;
  for (Eigen::Index i = 0; i < 4; ++i) {
    for (Eigen::Index j = 0; j < 4; ++j) {
      traces(i, j) =
          (correction * covariance.block<3, 3>(3 * i, 3 * j) * correction.transpose()).trace();
    }
  }
  error.after = Over([&](const Eigen::Vector3d& u) {
    Eigen::Vector4d v;
    v << 1.0, magnitude * u;
    Squares squares{std::max(v.dot(traces * v), 0.0), 0.0};
    if (magnitude > 0.0) {
      const Eigen::Vector3d w = correction.transpose() * u;
      Eigen::Matrix<double, 12, 1> along;
      for (int j = 0; j < 4; ++j) along.segment<3>(3 * j) = v[j] * w;
      const double radial = along.dot(covariance * along);
      squares.angle = std::max(squares.length - radial, 0.0) / (magnitude * magnitude);
    }
    return squares;
  });
  const std::optional<Eigen::Matrix3d> nominal = NominalCorrection(sensor, triad);
  if (!nominal) return error;
  error.before = Over([&](const Eigen::Vector3d& u) {
    const Eigen::Vector3d read = *nominal * (magnitude * sensor.model.sensitivity * u + bias);
    Squares squares{(read - magnitude * u).squaredNorm(), 0.0};
    if (magnitude > 0.0) {
      const double angle = std::atan2(u.cross(read).norm(), u.dot(read));
      squares.angle = angle * angle;
    }
    return squares;
  });
  return error;
}

}  // namespace truetriad
