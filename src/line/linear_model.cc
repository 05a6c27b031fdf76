// SPDX-License-Identifier: Apache-2.0
#include "line/linear_model.h"

#include <algorithm>

#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"

namespace truetriad::line {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of the largest eigenvalue of the scaled normal equations, whose entries are counts: what is below
// is zero.
constexpr double kSingular = 1e-10;
// Length of a contrast's part in directions that cannot be told, up to which it is rounding.
constexpr double kEstimable = 1e-6;

}  // namespace

std::vector<Index> FactorSums::Places(const Factors& factors) {
  std::vector<Index> places;
  Index next = 1;
  for (const FactorLevels& factor : factors.factors) {
    places.push_back(next);
    next += static_cast<Index>(factor.levels.size());
  }
  places.push_back(next);
  return places;
}

FactorSums::FactorSums(const Factors& factors, Index quantities) {
  const Index size = Places(factors).back();
  indicators = MatrixXd::Zero(size, size);
  values = MatrixXd::Zero(size, quantities);
  squares = MatrixXd::Zero(quantities, quantities);
}

void FactorSums::Add(const Factors& factors, std::size_t unit, const VectorXd& quantities) {
  std::vector<Index> rows{0};
  Index place = 1;
  for (std::size_t factor = 0; factor < factors.count(); ++factor) {
    rows.push_back(place + factors.level_of[factor][unit]);
    place += static_cast<Index>(factors.factors[factor].levels.size());
  }
  for (const Index row : rows) {
    for (const Index col : rows) indicators(row, col) += 1.0;
    values.row(row) += quantities.transpose();
  }
  squares.noalias() += quantities * quantities.transpose();
  units += 1.0;
}

FactorModel::FactorModel(const Factors& factors,
                         const FactorSums& sums,
                         std::vector<std::size_t> model) {
  const std::vector<Index> places = FactorSums::Places(factors);
  columns_ = 1;
  for (const std::size_t factor : model) {
    Block block{factor, places[factor], {}, columns_, factors.factors[factor].levels.size(), {}};
    for (Index level = 0; level < static_cast<Index>(block.levels); ++level) {
      const Index place = block.place + level;
      if (sums.indicators(place, place) > 0.0) block.active.push_back(level);
    }
    columns_ += std::max<Index>(static_cast<Index>(block.active.size()) - 1, 0);
    blocks_.push_back(std::move(block));
  }
  // Coefficients to indicators: the last active level has minus the sum of the others.
  MatrixXd coding = MatrixXd::Zero(sums.indicators.rows(), columns_);
  coding(0, 0) = 1.0;
  for (const Block& block : blocks_) {
    for (const Index level : block.active) {
      coding.row(block.place + level) = Contrast(block, level).transpose();
    }
  }
  const MatrixXd normal = TransposedCongruence(coding, sums.indicators);
  const SymmetricEigen eigen = EigenOfSymmetric(normal);
  const double least = kSingular * eigen.values.tail(1)[0];
  Index singular = 0;
  while (singular < columns_ && eigen.values[singular] <= least) ++singular;
  unknown_ = eigen.vectors.leftCols(singular);
  const MatrixXd known = eigen.vectors.rightCols(columns_ - singular);
  const VectorXd scale = eigen.values.tail(columns_ - singular).cwiseInverse();
  inverse_ = TimesTranspose(known * scale.asDiagonal(), known);
  const MatrixXd right = TransposeTimes(coding, sums.values);
  coefficients_ = Times(inverse_, right);
  residual_ = sums.squares - TransposeTimes(coefficients_, right);
  for (Block& block : blocks_) {
    block.fitted = MatrixXd::Zero(static_cast<Index>(block.levels), coefficients_.cols());
    for (const Index level : block.active) {
      block.fitted.row(level) =
          TransposeTimesVector(coefficients_, Contrast(block, level)).transpose();
    }
  }
  error_dof_ = sums.units - static_cast<double>(columns_ - singular);
}

// Of coefficients to a level's effect.
VectorXd FactorModel::Contrast(const Block& block, Index level) const {
  VectorXd contrast = VectorXd::Zero(columns_);
  if (block.active.empty()) return contrast;
  const Index others = static_cast<Index>(block.active.size()) - 1;
  if (level == block.active.back()) {
    contrast.segment(block.column, others).setConstant(-1.0);
  } else {
    Index place = 0;
    while (block.active[static_cast<std::size_t>(place)] != level) ++place;
    contrast[block.column + place] = 1.0;
  }
  return contrast;
}

VectorXd FactorModel::Predicted(const Factors& factors, std::size_t unit) const {
  VectorXd predicted = coefficients_.row(0).transpose();
  for (const Block& block : blocks_) {
    predicted += block.fitted.row(factors.level_of[block.factor][unit]).transpose();
  }
  return predicted;
}

FactorModel::Levels FactorModel::LevelsOf(std::size_t factor) const {
  Levels result;
  for (const Block& block : blocks_) {
    if (block.factor != factor) continue;
    result.has_units.assign(block.levels, false);
    result.estimable.assign(block.levels, false);
    result.effects = MatrixXd::Zero(static_cast<Index>(block.levels), coefficients_.cols());
    result.variance = VectorXd::Zero(static_cast<Index>(block.levels));
    for (const Index level : block.active) {
      const auto place = static_cast<std::size_t>(level);
      result.has_units[place] = true;
      const VectorXd contrast = Contrast(block, level);
      result.estimable[place] = TransposeTimesVector(unknown_, contrast).norm() < kEstimable;
      if (!result.estimable[place]) continue;
      result.effects.row(level) = block.fitted.row(level);
      result.variance[level] = QuadraticForm(inverse_, contrast);
    }
  }
  return result;
}

FactorError ErrorOf(const Factors& factors,
                    const FactorSums& sums,
                    std::size_t factor,
                    const FactorModel& model) {
  const std::vector<std::size_t> all = FullModel(factors);
  const bool has_finer = std::find(all.begin(), all.end(), factor) == all.end();
  if (has_finer) {
    const FactorModel finest(factors, sums, all);
    const double dof = model.error_dof() - finest.error_dof();
    // 0 where the other factor has the same levels.
    if (dof >= 1.0) return {model.residual() - finest.residual(), dof};
  }
  return {model.residual(), model.error_dof()};
}

}  // namespace truetriad::line
