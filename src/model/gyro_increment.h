// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "truetriad/model/triad_model.h"

namespace truetriad {

/// What a gyroscope's reading measures.
enum class RateSampling {
  kInstantaneous,  ///< The rate at its time stamp.
  kMeanRate,       ///< The rotation since the previous reading, divided by the time since then.
};

/// Readings of a gyroscope while the unit is turned from one rest to the next, with time stamps as
/// recorded.
struct GyroMove {
  std::vector<double> time_s;                ///< Ascending; equal times count once.
  std::vector<Eigen::Vector3d> reading_raw;  ///< One per time.
  /// Specific force at the same times, m/s^2, body frame; empty when there is no g-sensitivity.
  std::vector<Eigen::Vector3d> force_mps2;
};

/// The readings of a GyroMove, owned by the caller.
struct GyroReadings {
  std::span<const double> time_s;
  std::span<const Eigen::Vector3d> reading_raw;
  std::span<const Eigen::Vector3d> force_mps2;
};

/// A gyroscope: its reading is raw of triad_model.h plus G f, f being the specific force.
struct GyroModel {
  TriadModel<double> triad;                                 ///< Without other sensors' axis terms.
  Eigen::Matrix3d g_sensitivity = Eigen::Matrix3d::Zero();  ///< Raw per m/s^2.
  bool is_bent = false;  ///< Whether axis terms are estimated; if not, they are zero.
};

/// The rotation that a gyroscope measured, and its derivatives by the gyroscope's parameters:
///
///   rotation(p + d) = rotation(p) Exp(by_bias db + by_sensitivity vec(dS) + by_g vec(dG)
///                                     + by_axis_term da)
///
/// to first order in d; matrices column by column.
struct GyroIncrement {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< Body at begin <- body at end.
  Eigen::Matrix3d by_bias = Eigen::Matrix3d::Zero();             ///< rad per raw.
  Eigen::Matrix<double, 3, 9> by_sensitivity = Eigen::Matrix<double, 3, 9>::Zero();
  Eigen::Matrix<double, 3, 9> by_g_sensitivity = Eigen::Matrix<double, 3, 9>::Zero();
  /// In rad per unit of the term; zero if the gyroscope is not `is_bent`.
  PerAxisTerm<Eigen::Matrix3d> by_axis_term =
      PerAxisTerm<Eigen::Matrix3d>::All(Eigen::Matrix3d::Zero());
  /// Covariance of the rotation's error in the body frame at the end, rad^2, if the readings have
  /// independent errors of the stated sigma.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double duration_s = 0.0;
};

/// Integrates the readings in one pass, after Forster et al. 2017 but with all entries of the
/// sensitivity as parameters. Between two instantaneous readings the rate w is a cubic whose slopes
/// s follow from the neighbouring readings. The first term of the Magnus series accounts for the
/// change of the rate's direction:
///
///   Log = (w0 + w1) dt / 2 + (s0 - s1 + w0 x w1) dt^2 / 12.
///
/// The error, including that from coning, is of order dt^4. If steps are even and the axis is
/// fixed, the terms of the slopes sum to zero and add no noise. `sigma_raw`: σ of one reading, per
/// axis. Range: at least one reading, S regular.
GyroIncrement IntegrateMove(const GyroReadings& readings,
                            const GyroModel& model,
                            const Eigen::Vector3d& sigma_raw,
                            RateSampling sampling);
GyroIncrement IntegrateMove(const GyroMove& move,
                            const GyroModel& model,
                            const Eigen::Vector3d& sigma_raw,
                            RateSampling sampling);

/// The rotation of IntegrateMove without its derivatives.
Eigen::Quaterniond IntegrateRotation(const GyroReadings& readings,
                                     const GyroModel& model,
                                     RateSampling sampling);

}  // namespace truetriad
