// SPDX-License-Identifier: Apache-2.0
#include "model/gyro_increment.h"

#include <array>
#include <cstddef>
#include <vector>

#include <glog/logging.h>

#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// A 3x3 matrix, column by column, with one more number so that it fills whole registers.
using Padded = Eigen::Matrix<double, 10, 1>;

// Sums over all readings. Each term is the reading's matrix `by_rate` (class Turning) times the
// factor with which a parameter enters the rate.
struct Sums {
  // Columns: sums of by_rate times 1, rate x y z, force x y z.
  Eigen::Matrix<double, 10, 7> by_factor = Eigen::Matrix<double, 10, 7>::Zero();
  // Used if the model has axis terms: sums for bias, forces and terms, in which each reading is
  // divided by its slope d raw / d u.
  Eigen::Matrix3d by_reading = Eigen::Matrix3d::Zero();
  std::array<Eigen::Matrix3d, 3> by_force{
      Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  PerAxisTerm<Eigen::Matrix3d> by_axis_term =
      PerAxisTerm<Eigen::Matrix3d>::All(Eigen::Matrix3d::Zero());
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();

  Eigen::Matrix3d Factor(Eigen::Index i) const {
    return Eigen::Map<const Eigen::Matrix3d>(by_factor.col(i).data());
  }
};

// The calibration and the noise of the sensor whose readings are integrated.
struct Sensor {
  Sensor(const GyroModel& gyro, const Eigen::Vector3d& sigma)
      : model(gyro), correction(gyro.triad.Correction()), variance_raw(sigma.cwiseAbs2()) {
    noise.noalias() = correction * variance_raw.asDiagonal() * correction.transpose();
  }
  const GyroModel& model;
  Eigen::Matrix3d correction;
  Eigen::Vector3d variance_raw;
  Eigen::Matrix3d noise;  // Covariance of a reading's rate without axis terms.
};

// Adds one reading. If the rate of this reading changes by d, the whole rotation turns by by_rate *
// d.
void AddReading(const Sensor& sensor,
                const Eigen::Matrix3d& by_rate,
                const Eigen::Vector3d& rate_radps,
                const Eigen::Vector3d* force_mps2,
                Sums* sums) {
  Padded padded;
  padded << by_rate.reshaped(), 0.0;
  sums->by_factor.leftCols<4>().noalias() +=
      padded * Eigen::RowVector4d(1.0, rate_radps.x(), rate_radps.y(), rate_radps.z());
  if (!sensor.model.is_bent) {
    if (force_mps2 != nullptr) {
      sums->by_factor.rightCols<3>().noalias() += padded * force_mps2->transpose();
    }
    sums->noise.noalias() += (by_rate * sensor.noise).lazyProduct(by_rate.transpose());
    return;
  }
  const Eigen::Vector3d felt = sensor.model.triad.sensitivity * rate_radps;
  const Eigen::Matrix3d by_reading =
      by_rate * sensor.correction * sensor.model.triad.Slope(felt).cwiseInverse().asDiagonal();
  for (const AxisTermInfo& info : kAxisTerms) {
    const Eigen::Vector3d values = felt.unaryExpr([&](double u) { return ValueOf(info.term, u); });
    sums->by_axis_term[info.term] += by_reading * values.asDiagonal();
  }
  sums->by_reading += by_reading;
  if (force_mps2 != nullptr) {
    for (std::size_t j = 0; j < 3; ++j) {
      sums->by_force[j] += (*force_mps2)[static_cast<Eigen::Index>(j)] * by_reading;
    }
  }
  sums->noise += by_reading * sensor.variance_raw.asDiagonal() * by_reading.transpose();
}

// The rates and their slopes at both ends of a step. The slope at an end needs the readings before
// and after that end.
class RateWindow {
 public:
  RateWindow(const GyroReadings& readings, const GyroModel& model)
      : readings_(readings),
        model_(model),
        correction_(model.triad.Correction()),
        has_force_(!readings.force_mps2.empty()),
        begin_(RateOf(0)),
        end_(readings.time_s.size() > 1 ? RateOf(1) : begin_) {}

  // Moves to the step from reading `first` to the next; each call must raise `first` by one.
  void MoveTo(std::size_t first) {
    if (first > 0) {
      begin_ = end_;
      end_ = after_;
      slope_begin_ = slope_end_;
    }
    const bool is_last = first + 2 >= readings_.time_s.size();
    after_ = is_last ? end_ : RateOf(first + 2);
    // The slope is the difference of both neighbours over the time between them; it is zero at the
    // first and last reading, where the unit rests. Uneven steps get no weights, which would
    // amplify noise beside a gap.
    slope_end_.setZero();
    const std::span<const double> time = readings_.time_s;
    if (!is_last && time[first + 2] > time[first]) {
      slope_end_ = (after_ - begin_) / (time[first + 2] - time[first]);
    }
  }

  const Eigen::Vector3d& begin() const { return begin_; }
  const Eigen::Vector3d& end() const { return end_; }

  // Rotation vector of the step for instantaneous readings.
  Eigen::Vector3d InstantaneousStep(double step_s) const {
    return 0.5 * step_s * (begin_ + end_) +
           step_s * step_s / 12.0 * (begin_.cross(end_) + slope_begin_ - slope_end_);
  }

 private:
  Eigen::Vector3d RateOf(std::size_t i) const {
    Eigen::Vector3d raw = readings_.reading_raw[i] - model_.triad.bias;
    if (has_force_) raw -= model_.g_sensitivity * readings_.force_mps2[i];
    return correction_ * (model_.is_bent ? model_.triad.Felt(raw) : raw);
  }

  const GyroReadings& readings_;
  const GyroModel& model_;
  Eigen::Matrix3d correction_;
  bool has_force_;
  Eigen::Vector3d begin_, end_, after_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d slope_begin_ = Eigen::Vector3d::Zero(), slope_end_ = slope_begin_;
};

// Derivatives of the whole rotation, in the frame at its begin, with respect to the rate of each
// instantaneous reading (RateWindow::InstantaneousStep). A reading affects the two steps beside it
// and, through the slopes, one further step on each side.
class Turning {
 public:
  struct Reading {
    Eigen::Matrix3d by_rate = Eigen::Matrix3d::Zero();
    Eigen::Vector3d rate_radps = Eigen::Vector3d::Zero();
  };

  explicit Turning(std::span<const double> time_s) : time_s_(time_s) {}

  // Adds the step that ends at reading `i`; a change of the step by d turns the whole rotation by
  // by_step * d. After this, the derivative for reading i - 2 is complete.
  void AddStep(std::size_t i, const Eigen::Matrix3d& by_step, const RateWindow& rates) {
    const double step_s = time_s_[i] - time_s_[i - 1];
    const double square = step_s * step_s / 12.0;
    const Eigen::Matrix3d by_square = square * by_step;
    if (i == 1) At(0) = {Eigen::Matrix3d::Zero(), rates.begin()};
    const Eigen::Matrix3d half = 0.5 * step_s * by_step;
    At(i).rate_radps = rates.end();
    At(i).by_rate = half;
    AddTimesSkew(by_square, rates.begin(), &At(i).by_rate);
    At(i - 1).by_rate += half;
    AddTimesSkew(by_square, -rates.end(), &At(i - 1).by_rate);
    if (i > 1 && time_s_[i] > time_s_[i - 2]) {
      const double per_s = 1.0 / (time_s_[i] - time_s_[i - 2]);
      const Eigen::Matrix3d by_slope = per_s * (by_square - by_square_before_);
      At(i).by_rate += by_slope;
      At(i - 2).by_rate -= by_slope;
    }
    by_square_before_ = by_square;
  }

  // The derivative for reading `i`, which must be one of the last three.
  const Reading& Of(std::size_t i) const { return last_[i % 3]; }

 private:
  Reading& At(std::size_t i) { return last_[i % 3]; }
  // Adds matrix [vector]x to `sum`.
  static void AddTimesSkew(const Eigen::Matrix3d& matrix,
                           const Eigen::Vector3d& vector,
                           Eigen::Matrix3d* sum) {
    sum->col(0) += vector.z() * matrix.col(1) - vector.y() * matrix.col(2);
    sum->col(1) += vector.x() * matrix.col(2) - vector.z() * matrix.col(0);
    sum->col(2) += vector.y() * matrix.col(0) - vector.x() * matrix.col(1);
  }

  std::span<const double> time_s_;
  std::array<Reading, 3> last_;
  Eigen::Matrix3d by_square_before_ = Eigen::Matrix3d::Zero();
};

}  // namespace

GyroIncrement IntegrateMove(const GyroMove& move,
                            const GyroModel& model,
                            const Eigen::Vector3d& sigma_raw,
                            RateSampling sampling) {
  return IntegrateMove(
      GyroReadings{move.time_s, move.reading_raw, move.force_mps2}, model, sigma_raw, sampling);
}

GyroIncrement IntegrateMove(const GyroReadings& readings,
                            const GyroModel& model,
                            const Eigen::Vector3d& sigma_raw,
                            RateSampling sampling) {
  const std::size_t count = readings.time_s.size();
  CHECK_GT(count, 0U);
  CHECK_EQ(readings.reading_raw.size(), count);
  const bool has_force = !readings.force_mps2.empty();
  if (has_force) CHECK_EQ(readings.force_mps2.size(), count);
  for (const AxisTermInfo& info : kAxisTerms) {
    CHECK((model.is_bent && info.triad == Triad::kGyroscope) ||
          model.triad.axis_terms[info.term].isZero(0.0));
  }

  const Sensor sensor(model, sigma_raw);
  const auto force_at = [&](std::size_t i) {
    return has_force ? &readings.force_mps2[i] : nullptr;
  };

  const bool is_mean = sampling == RateSampling::kMeanRate;
  Sums sums;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
  RateWindow rates(readings, model);
  Turning turning(readings.time_s);
  const auto add = [&](const Turning::Reading& reading, std::size_t i) {
    AddReading(sensor, reading.by_rate, reading.rate_radps, force_at(i), &sums);
  };
  for (std::size_t i = 1; i < count; ++i) {
    rates.MoveTo(i - 1);
    const double step_s = readings.time_s[i] - readings.time_s[i - 1];
    const Eigen::Vector3d step =
        is_mean ? Eigen::Vector3d(step_s * rates.end()) : rates.InstantaneousStep(step_s);
    // A change of the step by d is a turn by J_l(step) d in the frame at the step's begin.
    Eigen::Matrix3d by_step;
    by_step.noalias() = turned.lazyProduct(RightJacobian(-step));
    if (is_mean) {
      AddReading(sensor, step_s * by_step, rates.end(), force_at(i), &sums);
    } else {
      turning.AddStep(i, by_step, rates);
      if (i > 1) add(turning.Of(i - 2), i - 2);
    }
    rotation = rotation * RotationExp(step);
    turned = rotation.toRotationMatrix();
  }
  if (!is_mean && count > 1) {
    add(turning.Of(count - 2), count - 2);
    add(turning.Of(count - 1), count - 1);
  }

  GyroIncrement increment;
  increment.duration_s = readings.time_s.back() - readings.time_s.front();
  increment.rotation = rotation.normalized();
  const Eigen::Matrix3d to_end = turned.transpose();
  // d rate = -C dS rate - C D^-1 (db + dG force + f(u) da) with D = d raw / d u.
  if (!model.is_bent) {
    sums.by_reading = sums.Factor(0) * sensor.correction;
    for (std::size_t j = 0; j < 3; ++j) {
      sums.by_force[j] = sums.Factor(4 + static_cast<Eigen::Index>(j)) * sensor.correction;
    }
  }
  increment.by_bias = -to_end * sums.by_reading;
  for (const AxisTermInfo& info : kAxisTerms) {
    increment.by_axis_term[info.term] = -to_end * sums.by_axis_term[info.term];
  }
  for (Eigen::Index j = 0; j < 3; ++j) {
    increment.by_sensitivity.middleCols<3>(3 * j) =
        -to_end * sums.Factor(1 + j) * sensor.correction;
    increment.by_g_sensitivity.middleCols<3>(3 * j) =
        -to_end * sums.by_force[static_cast<std::size_t>(j)];
  }
  increment.covariance = to_end * sums.noise * turned;
  return increment;
}

Eigen::Quaterniond IntegrateRotation(const GyroReadings& readings,
                                     const GyroModel& model,
                                     RateSampling sampling) {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  RateWindow rates(readings, model);
  for (std::size_t i = 1; i < readings.time_s.size(); ++i) {
    rates.MoveTo(i - 1);
    const double step_s = readings.time_s[i] - readings.time_s[i - 1];
    rotation = rotation * RotationExp(sampling == RateSampling::kMeanRate
                                          ? Eigen::Vector3d(step_s * rates.end())
                                          : rates.InstantaneousStep(step_s));
  }
  return rotation.normalized();
}

}  // namespace truetriad
