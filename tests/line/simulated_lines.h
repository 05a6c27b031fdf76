// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include <Eigen/Core>

#include "line/line_data.h"
#include "math/dense/products.h"
#include "math/fast_random.h"

namespace truetriad::line {

/// Units whose parameters are correlated as those of real ones: p00, p01, ...
class SimulatedLine {
 public:
  /// Parameters share `common` random causes; `seed` says which.
  SimulatedLine(int parameters, std::uint64_t seed, int common = 5)
      : random_({seed, 1}), root_(Eigen::MatrixXd::Zero(parameters, parameters + common)) {
    // The same mixture for all seeds: a line's own units differ, not what they are of.
    FastRandom mixture({2});
    for (int row = 0; row < parameters; ++row) {
      root_(row, row) = 1.0;
      for (int col = 0; col < common; ++col) root_(row, parameters + col) = 0.5 * mixture.Normal();
      root_.row(row) /= root_.row(row).norm();
    }
  }

  /// Standard normal values, correlated.
  Eigen::VectorXd Draw() {
    Eigen::VectorXd causes(root_.cols());
    for (double& cause : causes) cause = random_.Normal();
    return TimesVector(root_, causes);
  }
  FastRandom& random() { return random_; }

  /// `units` of them; those from `shifted_from` on have `shift` added to parameter 0. Parameter k
  /// has σ 10^-k % 4 about k, so that scales differ.
  LineData Units(int units, double shift = 0.0, int shifted_from = 0) {
    LineData data;
    for (Eigen::Index k = 0; k < root_.rows(); ++k) {
      data.parameters.push_back((k < 10 ? "p0" : "p") + std::to_string(k));
    }
    for (int unit = 0; unit < units; ++unit) {
      UnitRecord record;
      record.serial = std::to_string(unit);
      record.values = Draw();
      if (unit >= shifted_from) record.values[0] += shift;
      for (Eigen::Index k = 0; k < root_.rows(); ++k) {
        record.values[k] = ScaleOf(k) * record.values[k] + static_cast<double>(k);
      }
      record.sigma = Eigen::VectorXd::Zero(root_.rows());
      data.units.push_back(std::move(record));
    }
    return data;
  }

  static double ScaleOf(Eigen::Index parameter) {
    static constexpr double kScales[] = {1.0, 0.1, 0.01, 0.001};
    return kScales[parameter % 4];
  }

 private:
  FastRandom random_;
  Eigen::MatrixXd root_;
};

}  // namespace truetriad::line
