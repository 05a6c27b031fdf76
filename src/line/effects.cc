// SPDX-License-Identifier: Apache-2.0
#include "line/effects.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "line/baseline.h"
#include "line/factors.h"
#include "line/linear_model.h"
#include "line/multiple_tests.h"
#include "math/dense/cholesky.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of the rest's robust σ: what is beyond is a spoilt unit, which is not what factors are for.
constexpr double kSpoilt = 5.0;
// Units of a parameter, at least, for each level of the factors.
constexpr double kLeastErrorDof = 5.0;
// Of a parameter's squares about its mean: what a model leaves below it is rounding.
constexpr double kRounding = 1e-12;

// One parameter's values over those units that have one, about 0 and of size 1.
struct Column {
  int parameter = 0;
  std::vector<std::size_t> units;
  std::vector<double> values;
  double scale = 1.0;
  std::vector<bool> used;
};

std::optional<Column> ColumnOf(const LineData& data, int parameter) {
  Column column;
  column.parameter = parameter;
  for (std::size_t unit = 0; unit < data.units.size(); ++unit) {
    const VectorXd& values = data.units[unit].values;
    if (parameter >= values.size() || !std::isfinite(values[parameter])) continue;
    column.units.push_back(unit);
    column.values.push_back(values[parameter]);
  }
  if (!Varies(column.values)) return std::nullopt;
  RunningMoments moments;
  for (const double value : column.values) moments.Add(value);
  const RobustMoments robust = RobustMomentsOf(column.values);
  column.scale = robust.sigma > 0.0 ? robust.sigma : std::sqrt(moments.Variance());
  for (double& value : column.values) value = (value - robust.centre) / column.scale;
  column.used.assign(column.values.size(), true);
  return column;
}

// `of`: that factor's units only, which carry its tag.
FactorSums SumsOf(const Factors& factors,
                  const Column& column,
                  std::optional<std::size_t> of = std::nullopt) {
  FactorSums sums(factors, 1);
  VectorXd value(1);
  for (std::size_t k = 0; k < column.units.size(); ++k) {
    if (!column.used[k] || (of && !factors.IsNamed(*of, column.units[k]))) continue;
    value[0] = column.values[k];
    sums.Add(factors, column.units[k], value);
  }
  return sums;
}

// Whether of a quantity no more than rounding is `left`, so that nothing can be held against it.
bool IsDetermined(double left, const FactorSums& sums, Index quantity) {
  const double all =
      sums.squares(quantity, quantity) - std::pow(sums.values(0, quantity), 2) / sums.units;
  return !(left > kRounding * all);
}

// Units that no level explains.
void LeaveOutSpoilt(const Factors& factors, const FactorModel& model, Column* column) {
  std::vector<double> rest(column->values.size());
  for (std::size_t k = 0; k < rest.size(); ++k) {
    rest[k] = column->values[k] - model.Predicted(factors, column->units[k])[0];
  }
  const double sigma = MadSigma(rest);
  if (sigma < std::sqrt(kRounding)) return;  // most are determined, about 0 and of size 1
  for (std::size_t k = 0; k < rest.size(); ++k) {
    column->used[k] = std::abs(rest[k]) <= kSpoilt * sigma;
  }
}

ResidualSpread SpreadOf(const LineData& data, const Column& column, const FactorModel& model) {
  ResidualSpread spread;
  spread.parameter = column.parameter;
  RunningMoments variances;  // of those calibrations that state one
  for (std::size_t k = 0; k < column.units.size(); ++k) {
    if (!column.used[k]) {
      ++spread.outliers;
      continue;
    }
    ++spread.units;
    const VectorXd& sigma = data.units[column.units[k]].sigma;
    if (column.parameter < sigma.size() && std::isfinite(sigma[column.parameter])) {
      variances.Add(std::pow(sigma[column.parameter], 2));
    }
  }
  spread.sigma = column.scale * std::sqrt(model.residual()(0, 0) / model.error_dof());
  spread.without_sigma = spread.units - static_cast<int>(variances.count);
  if (variances.count == 0.0) return spread;
  spread.calibration_sigma = std::sqrt(variances.mean);
  spread.process_sigma = std::sqrt(std::max(std::pow(spread.sigma, 2) - variances.mean, 0.0));
  return spread;
}

std::vector<std::size_t> Without(std::vector<std::size_t> model, std::size_t factor) {
  std::erase(model, factor);
  return model;
}

// Variance between levels: that of their effects less what chance gives them.
double VarianceBetween(const FactorModel::Levels& levels, double error_variance) {
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t level = 0; level < levels.estimable.size(); ++level) {
    if (!levels.estimable[level]) continue;
    const auto row = static_cast<Index>(level);
    squares += std::pow(levels.effects(row, 0), 2) - error_variance * levels.variance[row];
    count += 1.0;
  }
  return count > 1.0 ? std::max(squares / (count - 1.0), 0.0) : 0.0;
}

// `finest_variance`: of what the model of everything leaves.
std::optional<ParameterEffect> EffectOf(const Factors& factors,
                                        const Column& column,
                                        double finest_variance,
                                        std::size_t factor) {
  const FactorSums sums = SumsOf(factors, column, factor);
  const std::vector<std::size_t> model = ModelFor(factors, factor);
  const FactorModel full(factors, sums, model);
  const FactorModel reduced(factors, sums, Without(model, factor));
  ParameterEffect effect;
  effect.factor = static_cast<int>(factor);
  effect.parameter = column.parameter;
  const FactorError error = ErrorOf(factors, sums, factor, full);
  effect.dof = reduced.error_dof() - full.error_dof();
  effect.error_dof = error.dof;
  if (effect.dof < 1.0 || full.error_dof() < kLeastErrorDof) return std::nullopt;
  // Levels of finer factors that are alike by chance do not differ by less than what is left.
  const double variance = std::max(error.squares(0, 0) / error.dof, finest_variance);
  const double explained = std::max(reduced.residual()(0, 0) - full.residual()(0, 0), 0.0);
  effect.f = explained / effect.dof / variance;
  effect.p = FisherUpper(effect.f, effect.dof, effect.error_dof);
  const FactorModel::Levels levels = full.LevelsOf(factor);
  effect.sigma_between = column.scale * std::sqrt(VarianceBetween(levels, variance));
  const Index place = FactorSums::Places(factors)[factor];
  for (std::size_t level = 0; level < levels.estimable.size(); ++level) {
    const auto row = static_cast<Index>(level);
    if (factors.factors[factor].levels[level].empty()) continue;
    LevelEffect own{factors.factors[factor].levels[level],
                    static_cast<int>(sums.indicators(place + row, place + row)),
                    std::numeric_limits<double>::quiet_NaN(),
                    std::numeric_limits<double>::quiet_NaN()};
    if (levels.estimable[level]) {
      own.effect = column.scale * levels.effects(row, 0);
      own.sigma = column.scale * std::sqrt(variance * levels.variance[row]);
    }
    effect.levels.push_back(std::move(own));
  }
  return effect;
}

// Sums of all parameters at once, over the units that have them all, are spoilt in none and carry
// the factor's tag.
FactorSums JointSums(const Factors& factors,
                     const std::vector<Column>& columns,
                     std::size_t units,
                     std::size_t factor) {
  MatrixXd values = MatrixXd::Constant(static_cast<Index>(columns.size()),
                                       static_cast<Index>(units),
                                       std::numeric_limits<double>::quiet_NaN());
  for (std::size_t c = 0; c < columns.size(); ++c) {
    for (std::size_t k = 0; k < columns[c].units.size(); ++k) {
      if (!columns[c].used[k]) continue;
      values(static_cast<Index>(c), static_cast<Index>(columns[c].units[k])) = columns[c].values[k];
    }
  }
  FactorSums sums(factors, values.rows());
  for (std::size_t unit = 0; unit < units; ++unit) {
    const VectorXd row = values.col(static_cast<Index>(unit));
    if (row.allFinite() && factors.IsNamed(factor, unit)) sums.Add(factors, unit, row);
  }
  return sums;
}

MatrixXd Selected(const MatrixXd& A, const std::vector<Index>& kept) {
  const Index size = static_cast<Index>(kept.size());
  MatrixXd selected(size, size);
  for (Index row = 0; row < size; ++row) {
    for (Index col = 0; col < size; ++col) {
      selected(row, col) =
          A(kept[static_cast<std::size_t>(row)], kept[static_cast<std::size_t>(col)]);
    }
  }
  return selected;
}

// Rao's (1951) approximation of Λ's distribution; exact where one of the two numbers is 1 or 2.
void TestWilks(double parameters, JointEffect* effect, double levels_dof, double rest_dof) {
  const double product = parameters * levels_dof;
  const double under = parameters * parameters + levels_dof * levels_dof - 5.0;
  const double root = under > 0.0 ? std::sqrt((product * product - 4.0) / under) : 1.0;
  effect->dof = product;
  effect->error_dof =
      root * (rest_dof - 0.5 * (parameters - levels_dof + 1.0)) - 0.5 * (product - 2.0);
  const double share = std::pow(effect->wilks, 1.0 / root);
  effect->f = (1.0 - share) / share * effect->error_dof / effect->dof;
  effect->p = FisherUpper(std::max(effect->f, 0.0), effect->dof, effect->error_dof);
}

std::optional<JointEffect> JointEffectOf(const Factors& factors,
                                         const FactorSums& sums,
                                         std::size_t factor) {
  const std::vector<std::size_t> model = ModelFor(factors, factor);
  const FactorModel full(factors, sums, model);
  const FactorModel reduced(factors, sums, Without(model, factor));
  const double levels_dof = reduced.error_dof() - full.error_dof();
  const FactorError error = ErrorOf(factors, sums, factor, full);
  MatrixXd rest = error.squares;
  for (Index row = 0; row < rest.rows(); ++row) {
    if (!IsDetermined(rest(row, row), sums, row)) continue;
    rest.row(row).setZero();
    rest.col(row).setZero();
  }
  const std::vector<Index> kept = IndependentColumns(rest);
  const double parameters = static_cast<double>(kept.size());
  if (levels_dof < 1.0 || kept.empty() || error.dof < parameters + kLeastErrorDof) {
    return std::nullopt;
  }
  const MatrixXd all = rest + reduced.residual() - full.residual();
  JointEffect effect;
  effect.factor = static_cast<int>(factor);
  effect.parameters = static_cast<int>(kept.size());
  effect.wilks = std::exp(Cholesky(Selected(rest, kept)).LogDeterminant() -
                          Cholesky(Selected(all, kept)).LogDeterminant());
  TestWilks(parameters, &effect, levels_dof, error.dof);
  return effect;
}

template <typename Test>
void AdjustAll(std::vector<Test>* tests) {
  std::vector<double> p;
  for (const Test& test : *tests) p.push_back(test.p);
  const std::vector<double> adjusted = HolmAdjusted(p);
  for (std::size_t k = 0; k < tests->size(); ++k) (*tests)[k].p_adjusted = adjusted[k];
}

// One sentence for those with the same number of them.
void NoteWithoutSigma(const LineData& data, EffectReport* report) {
  std::map<int, std::string> names;
  for (const ResidualSpread& spread : report->spreads) {
    if (spread.without_sigma == 0) continue;
    std::string& list = names[spread.without_sigma];
    list +=
        (list.empty() ? "" : ", ") + data.parameters[static_cast<std::size_t>(spread.parameter)];
  }
  for (const auto& [units, list] : names) {
    report->notes.push_back("the σ of calibration is without " + std::to_string(units) +
                            (units == 1 ? " unit that states" : " units that state") + " none of " +
                            list);
  }
}

void NoteUnestimable(const EffectReport& report, std::vector<std::string>* notes) {
  std::vector<bool> noted(report.factors.size(), false);
  for (const ParameterEffect& effect : report.effects) {
    for (const LevelEffect& level : effect.levels) {
      const auto factor = static_cast<std::size_t>(effect.factor);
      if (level.units == 0 || std::isfinite(level.effect) || noted[factor]) continue;
      noted[factor] = true;
      notes->push_back(report.factors[factor].name + " " + level.level +
                       " cannot be told from other factors: it has no units in common with "
                       "enough of their levels");
    }
  }
}

}  // namespace

EffectReport Effects(const LineData& data, const EffectOptions& options) {
  const Factors factors = FactorsOf(data, options.factors);
  EffectReport report;
  report.factors = factors.factors;
  report.notes = factors.notes;
  std::vector<Column> columns;
  for (int parameter = 0; parameter < static_cast<int>(data.parameters.size()); ++parameter) {
    std::optional<Column> column = ColumnOf(data, parameter);
    if (!column) continue;
    if (!std::isfinite(column->scale)) {
      report.notes.push_back(data.parameters[static_cast<std::size_t>(parameter)] +
                             " is left out: its values are too far from each other for a variance "
                             "(squares beyond 1e308)");
      continue;
    }
    const FactorModel first(factors, SumsOf(factors, *column), FullModel(factors));
    if (first.error_dof() < kLeastErrorDof) continue;
    LeaveOutSpoilt(factors, first, &*column);
    const FactorSums sums = SumsOf(factors, *column);
    const FactorModel model(factors, sums, FullModel(factors));
    if (model.error_dof() < kLeastErrorDof) continue;
    if (IsDetermined(model.residual()(0, 0), sums, 0)) {
      report.notes.push_back(data.parameters[static_cast<std::size_t>(parameter)] +
                             " is left out: the factors determine it, nothing of it is left to "
                             "hold their effects against");
      continue;
    }
    report.spreads.push_back(SpreadOf(data, *column, model));
    const double variance = model.residual()(0, 0) / model.error_dof();
    for (std::size_t factor = 0; factor < factors.count(); ++factor) {
      if (auto effect = EffectOf(factors, *column, variance, factor)) {
        report.effects.push_back(*std::move(effect));
      }
    }
    columns.push_back(*std::move(column));
  }
  for (std::size_t factor = 0; factor < factors.count(); ++factor) {
    const FactorSums joint = JointSums(factors, columns, data.units.size(), factor);
    if (auto effect = JointEffectOf(factors, joint, factor)) report.joint.push_back(*effect);
  }
  AdjustAll(&report.effects);
  AdjustAll(&report.joint);
  NoteUnestimable(report, &report.notes);
  NoteWithoutSigma(data, &report);
  return report;
}

}  // namespace truetriad::line
