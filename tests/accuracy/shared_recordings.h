// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "io/temporary_folder.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// What `truetriad calibrate` left behind.
struct Outcomes {
  int exit_code = -1;
  std::string text;  ///< stdout and stderr.
  Calibration calibration;
};

/// Runs the experiments in configs/experiments/recordings on the shared recordings. Skips when the
/// folder of recordings is not there.
class SharedRecordings : public ::testing::Test {
 protected:
  void SetUp() override;

  /// configs/experiments/recordings/NAME.yaml on its own input or on `input`: the name of a
  /// manifest in configs/recordings, or that of a table of tools/scripts/shared_tables.py.
  Outcomes Run(const std::string& experiment,
               const std::string& input,
               const std::string& set = "");

  /// Makes the tables of tools/scripts/shared_tables.py; false when there is no Python for it.
  bool MakeTables();
  std::string Table(const std::string& name) const { return work_.Path(name + ".csv"); }

  /// A file of the shared recordings.
  static std::string File(const std::string& name) {
    return std::string(TRUETRIAD_SHARED_DATASETS) + "/" + name;
  }
  /// A manifest of configs/recordings that points to where the tables are here, and to the
  /// recordings in `datasets`.
  std::string Manifest(const std::string& name,
                       const std::string& datasets = TRUETRIAD_SHARED_DATASETS) const;

  const TemporaryFolder& work() const { return work_; }

 private:
  TemporaryFolder work_;
  int runs_ = 0;
};

/// A norm fit that somebody else made: true = matrix * (raw - bias), matrix lower triangular.
struct ReferenceFit {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  double target_norm = 0.0;  ///< Norm that the fit aims at, its own unit.
  double rms_after = 0.0;    ///< In the unit of target_norm.
};

/// The fit at `keys` of a reference.json.
ReferenceFit ReadReferenceFit(const std::string& file, const std::vector<std::string>& keys);

/// The twelve numbers of a triad's correction and bias, and their covariance, which follows from
/// that of bias and sensitivity.
struct CorrectionEstimate {
  Eigen::Matrix<double, 12, 1> values;  ///< Bias, then the correction by columns.
  Eigen::Matrix<double, 12, 12> covariance;
};
CorrectionEstimate CorrectionOf(const Calibration& calibration, Triad triad);

/// Passes when every number of the fit lies within 3 √2 σ of the calibration, in its gauge accel-x.
///
/// Both come from the same readings with different weights. The calibration's σ are those of the
/// best weights; a reference with equal weights scatters more, and its difference from the best
/// estimate has the variance σ_reference² - σ², hence √2 for weights that cost up to a factor two.
/// `norm` is the norm that the calibration aims at; the reference's scale is its own.
::testing::AssertionResult Agrees(const Calibration& calibration,
                                  Triad triad,
                                  const ReferenceFit& fit,
                                  double norm);

}  // namespace truetriad
