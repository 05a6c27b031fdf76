// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "line/factors.h"

namespace truetriad::line {

/// Sums over units from which every model of factors follows: products of the indicators of all
/// levels (first the constant) with each other, with the values, and of these.
struct FactorSums {
  Eigen::MatrixXd indicators;  // 1 + levels, square
  Eigen::MatrixXd values;      // 1 + levels, a column each quantity
  Eigen::MatrixXd squares;     // quantities, square
  double units = 0.0;

  /// Where the levels of each factor begin in `indicators`.
  static std::vector<Eigen::Index> Places(const Factors& factors);
  FactorSums(const Factors& factors, Eigen::Index quantities);
  void Add(const Factors& factors, std::size_t unit, const Eigen::VectorXd& quantities);
};

/// Least squares of one model: those factors' effects, which sum to 0 over the levels that have
/// units.
class FactorModel {
 public:
  FactorModel(const Factors& factors, const FactorSums& sums, std::vector<std::size_t> model);

  double error_dof() const { return error_dof_; }
  /// Sums of squares and products of what is left of the quantities.
  const Eigen::MatrixXd& residual() const { return residual_; }

  /// What the model gives for a unit, of each quantity.
  Eigen::VectorXd Predicted(const Factors& factors, std::size_t unit) const;

  /// Effects of one factor of the model.
  struct Levels {
    std::vector<bool> has_units;  // by level
    std::vector<bool> estimable;
    Eigen::MatrixXd effects;   // level by quantity; 0 where it cannot be told
    Eigen::VectorXd variance;  // of an effect, for residuals of variance 1
  };
  Levels LevelsOf(std::size_t factor) const;

 private:
  struct Block {  // of one factor
    std::size_t factor = 0;
    Eigen::Index place = 0;            // of its first level in the sums
    std::vector<Eigen::Index> active;  // levels with units
    Eigen::Index column = 0;           // of its first coefficient
    std::size_t levels = 0;
    Eigen::MatrixXd fitted;  // what each level adds, by quantity
  };
  Eigen::VectorXd Contrast(const Block& block, Eigen::Index level) const;

  std::vector<Block> blocks_;
  Eigen::Index columns_ = 0;
  Eigen::MatrixXd inverse_;       // pseudo-inverse of the normal equations
  Eigen::MatrixXd unknown_;       // an orthonormal basis of what they cannot tell
  Eigen::MatrixXd coefficients_;  // by quantity
  Eigen::MatrixXd residual_;
  double error_dof_ = 0.0;
};

/// What a factor's effects are held against.
struct FactorError {
  Eigen::MatrixXd squares;  // sums of squares and products of the quantities
  double dof = 0.0;
};

/// Of `model`, in which `factor` is estimated: what it leaves of the units or, where each level of
/// finer factors goes with one level of `factor`, what those add to it (levels of a finer factor
/// differ, and units of the same one are no independent witnesses of the coarser).
FactorError ErrorOf(const Factors& factors,
                    const FactorSums& sums,
                    std::size_t factor,
                    const FactorModel& model);

}  // namespace truetriad::line
