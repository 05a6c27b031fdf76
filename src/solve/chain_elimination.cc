// SPDX-License-Identifier: Apache-2.0
#include "solve/chain_elimination.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>
#include <utility>

#include <glog/logging.h>

namespace truetriad {
namespace {

// Number of states per panel. A panel's 192 rows fit the cache while they are squared (80 kB at 50
// columns).
constexpr std::size_t kPanelStates = 64;
// If a residual is below this share of the signal, the curvature that it causes is below 30 % of
// that of Gauss-Newton and is neglected.
constexpr double kBends = 0.3;

bool AreSame(const std::vector<SharedBlock>& a, const std::vector<SharedBlock>& b) {
  return std::equal(
      a.begin(), a.end(), b.begin(), b.end(), [](const SharedBlock& p, const SharedBlock& q) {
        return p.offset == q.offset && p.size == q.size;
      });
}

// The whitening root of a row, padded with zeros if the row has fewer than three values.
Eigen::Matrix3d Root(const ChainRow& row) {
  Eigen::Matrix3d root = Eigen::Matrix3d::Zero();
  root.topLeftCorner(row.root.rows(), row.root.cols()) = row.root;
  return root;
}

}  // namespace

// Collects rows of one Pattern until there are enough to square them together.
class ChainElimination::SquaredRows {
 public:
  explicit SquaredRows(Eigen::Index columns)
      : rows_(3 * static_cast<Eigen::Index>(kPanelStates), columns + 1),
        sum_(Eigen::MatrixXd::Zero(columns + 1, columns + 1)) {}

  void Add(const Eigen::Ref<const FreeJacobian>& jacobian, const Eigen::Vector3d& residual) {
    rows_.block(used_, 0, 3, jacobian.cols()) = jacobian;
    rows_.block<3, 1>(used_, jacobian.cols()) = residual;
    used_ += 3;
    if (used_ == rows_.rows()) Flush();
  }
  // Sum of the outer products of the rows, lower triangle; the last row is that of the residual.
  const Eigen::MatrixXd& sum() {
    Flush();
    return sum_;
  }

 private:
  void Flush() {
    if (used_ == 0) return;
    sum_.selfadjointView<Eigen::Lower>().rankUpdate(rows_.topRows(used_).transpose());
    used_ = 0;
  }

  Eigen::MatrixXd rows_;
  Eigen::MatrixXd sum_;
  Eigen::Index used_ = 0;
};

// A whitened row: its values, and derivatives by the free coordinates and by one or two states.
struct ChainElimination::LinearRow {
  explicit LinearRow(Eigen::Index free) : buffer(3, free) {}

  Eigen::Vector3d residual;
  FreeJacobian buffer;
  Eigen::Index columns = 0;  // number of columns of the row's pattern
  auto by_free() { return buffer.leftCols(columns); }
  auto by_free() const { return buffer.leftCols(columns); }
  Eigen::Matrix3d by_first, by_second;
};

// Normal equations of the next state to eliminate and of the state after it, and of their coupling.
struct ChainElimination::Arrow {
  explicit Arrow(Eigen::Index free)
      : columns(3, free + 1),
        next_columns(3, free + 1),
        eliminated(Eigen::MatrixXd::Zero(free + 1, free + 1)) {
    columns.setZero();
    next_columns.setZero();
  }

  // Adds A^T [J, r] of a row to `into`.
  static void AddColumns(const Eigen::Matrix3d& by_state,
                         const LinearRow& row,
                         const std::vector<int>& free,
                         FreeJacobian* into) {
    const Eigen::Matrix3d transposed = by_state.transpose();
    for (std::size_t j = 0; j < free.size(); ++j) {
      into->col(free[j]).noalias() += transposed * row.buffer.col(static_cast<Eigen::Index>(j));
    }
    into->col(into->cols() - 1).noalias() += transposed * row.residual;
  }

  Eigen::Matrix3d pivot = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d next_pivot = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d coupling = Eigen::Matrix3d::Zero();
  FreeJacobian columns, next_columns;
  Eigen::MatrixXd eliminated;
};

// An upper bound of the curvature that Gauss-Newton neglects; zero if the residual is small. The
// second derivatives by a rotation are as large as the first derivatives. If this bound is added,
// no step goes beyond the minimum of the cost. Without it, an attitude whose only reading has twice
// the field's length would overshoot for ever.
double ChainElimination::BendOf(const LinearRow& row) {
  const double residual = row.residual.norm();
  const double signal = row.by_first.norm() / std::numbers::sqrt2;
  return residual > kBends * signal ? residual * signal : 0.0;
}

ChainElimination::ChainElimination(ChainProblem problem) : problem_(std::move(problem)) {
  pattern_of_.reserve(problem_.rows.size());
  for (const ChainRow& row : problem_.rows) pattern_of_.push_back(PatternOf(*row.row));
}

std::size_t ChainElimination::PatternOf(const Row& row) {
  for (std::size_t p = 0; p < patterns_.size(); ++p) {
    if (AreSame(patterns_[p].blocks, row.shared_blocks())) return p;
  }
  Pattern pattern;
  pattern.blocks = row.shared_blocks();
  std::vector<int> place(static_cast<std::size_t>(problem_.layout->free_size()), -1);
  int start = 0;
  for (const SharedBlock& block : pattern.blocks) {
    for (int column = 0; column < block.size; ++column) {
      for (int free = 0; free < problem_.layout->free_size(); ++free) {
        const double factor = problem_.layout->basis(block.offset + column, free);
        if (factor == 0.0) continue;
        int& at = place[static_cast<std::size_t>(free)];
        if (at < 0) {
          at = static_cast<int>(pattern.free.size());
          pattern.free.push_back(free);
        }
        pattern.terms.push_back({start, block.size, column, at, factor});
      }
    }
    start += block.size;
  }
  patterns_.push_back(std::move(pattern));
  return patterns_.size() - 1;
}

void ChainElimination::LineariseRow(std::size_t index,
                                    RowEvaluation* evaluation,
                                    LinearRow* linear) const {
  const ChainRow& chain_row = problem_.rows[index];
  const Row& row = *chain_row.row;
  const std::vector<ChainState>& states = problem_.states;
  const std::size_t count = row.state_count();
  const std::array<const double*, 2> seen = {
      count > 0 ? states[chain_row.state].values.data() : nullptr,
      count > 1 ? states[chain_row.state + 1].values.data() : nullptr};
  const bool has_value = evaluation->Evaluate(row, at_.data(), seen, true);
  const Eigen::Index rows = row.num_residuals();
  const Eigen::Matrix3d root = Root(chain_row);
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();
  residual.head(rows) = evaluation->residual();
  if (!has_value) residual.setConstant(std::numeric_limits<double>::quiet_NaN());
  linear->residual.noalias() = root * residual;

  const Pattern& pattern = patterns_[pattern_of_[index]];
  linear->columns = static_cast<Eigen::Index>(pattern.free.size());
  auto by_free = linear->by_free();
  by_free.setZero();
  const double* jacobian = evaluation->jacobians();
  for (const Pattern::Term& term : pattern.terms) {
    const double* from = jacobian + rows * term.start + term.column;
    double* into = &by_free.coeffRef(0, term.free);
    for (Eigen::Index i = 0; i < rows; ++i) into[i] += term.factor * from[i * term.size];
  }
  for (Eigen::Index j = 0; j < by_free.cols(); ++j) {
    by_free.col(j) = root * Eigen::Vector3d(by_free.col(j));
  }

  const auto by_state = [&](std::size_t i, Eigen::Matrix3d* by) {
    by->setZero();
    if (i >= count) return;
    const ChainState& state = states[chain_row.state + i];
    if (TangentSize(state.kind) == 0) return;
    by->topLeftCorner(rows, TangentSize(state.kind)).noalias() =
        evaluation->ByState(i).lazyProduct(PlusJacobianOf(state.kind, state.values));
    *by = root * *by;
  };
  by_state(0, &linear->by_first);
  by_state(1, &linear->by_second);
}

void ChainElimination::Linearise(const Eigen::VectorXd& shared) {
  if (is_linearised_) problem_.states = StatesAt(shared);
  LineariseAndEliminate(shared);
}

void ChainElimination::LineariseOnce(const Eigen::VectorXd& shared) {
  CHECK(!is_linearised_);
  keeps_panels_ = false;
  LineariseAndEliminate(shared);
}

void ChainElimination::LineariseAndEliminate(const Eigen::VectorXd& shared) {
  at_ = shared;
  is_linearised_ = true;
  const std::size_t count = problem_.states.size();
  factor_ = ChainFactor();
  factor_.Reserve(count);
  panels_.clear();
  std::vector<SquaredRows> squares;
  for (const Pattern& pattern : patterns_) {
    squares.emplace_back(static_cast<Eigen::Index>(pattern.free.size()));
  }
  Arrow arrow(problem_.layout->free_size());
  RowEvaluation evaluation;
  LinearRow linear(problem_.layout->free_size());
  std::size_t index = 0;
  for (std::size_t k = 0; k < count || index < problem_.rows.size(); ++k) {
    for (; index < problem_.rows.size() && (k >= count || problem_.rows[index].state == k);
         ++index) {
      LineariseRow(index, &evaluation, &linear);
      const Pattern& pattern = patterns_[pattern_of_[index]];
      squares[pattern_of_[index]].Add(linear.by_free(), linear.residual);
      const std::size_t seen = problem_.rows[index].row->state_count();
      if (seen == 0) continue;
      arrow.pivot.noalias() += linear.by_first.transpose() * linear.by_first;
      // No step follows LineariseOnce, which therefore needs no additional curvature.
      if (keeps_panels_ && seen == 1) arrow.pivot.diagonal().array() += BendOf(linear);
      Arrow::AddColumns(linear.by_first, linear, pattern.free, &arrow.columns);
      if (seen == 1) continue;
      arrow.next_pivot.noalias() += linear.by_second.transpose() * linear.by_second;
      Arrow::AddColumns(linear.by_second, linear, pattern.free, &arrow.next_columns);
      arrow.coupling.noalias() += linear.by_first.transpose() * linear.by_second;
    }
    if (k < count) EliminateState(k, &arrow);
  }
  Finish(&squares, arrow.eliminated);
}

void ChainElimination::EliminateState(std::size_t k, Arrow* arrow) {
  const std::size_t count = problem_.states.size();
  // Unused dimensions of a state have 1 on the diagonal.
  for (int i = TangentSize(problem_.states[k].kind); i < 3; ++i) arrow->pivot(i, i) = 1.0;
  factor_.Append(arrow->pivot, arrow->coupling);
  if (k % kPanelStates == 0) {
    const std::size_t rows = 3 * std::min(kPanelStates, count - k);
    if (!keeps_panels_) panels_.clear();
    panels_.emplace_back(static_cast<Eigen::Index>(rows), arrow->columns.cols());
  }
  auto whitened = panels_.back().middleRows<3>(3 * static_cast<Eigen::Index>(k % kPanelStates));
  whitened.noalias() = factor_.half(k) * arrow->columns;
  if (factor_.IsCoupled(k)) {
    arrow->next_columns.noalias() -= factor_.gain(k).transpose() * arrow->columns;
  }
  if (k % kPanelStates == kPanelStates - 1 || k + 1 == count) {
    arrow->eliminated.selfadjointView<Eigen::Lower>().rankUpdate(panels_.back().transpose());
  }
  arrow->pivot = arrow->next_pivot;
  arrow->columns.swap(arrow->next_columns);
  arrow->next_pivot.setZero();
  arrow->coupling.setZero();
  arrow->next_columns.setZero();
}

// Sets information, gradient and cost: the rows' sum of squares minus the part of the states.
void ChainElimination::Finish(std::vector<SquaredRows>* squares,
                              const Eigen::MatrixXd& eliminated) {
  const int n = problem_.layout->free_size();
  information_ = Eigen::MatrixXd::Zero(n, n);
  gradient_ = Eigen::VectorXd::Zero(n);
  double squared = 0.0;
  for (std::size_t p = 0; p < patterns_.size(); ++p) {
    const Eigen::MatrixXd& sum = (*squares)[p].sum();
    const std::vector<int>& free = patterns_[p].free;
    const auto size = static_cast<Eigen::Index>(free.size());
    for (Eigen::Index i = 0; i < size; ++i) {
      const int row = free[static_cast<std::size_t>(i)];
      gradient_[row] += sum(size, i);
      for (Eigen::Index j = 0; j <= i; ++j) {
        const int col = free[static_cast<std::size_t>(j)];
        information_(std::max(row, col), std::min(row, col)) += sum(i, j);
      }
    }
    squared += sum(size, size);
  }
  information_ -= eliminated.topLeftCorner(n, n);
  gradient_ -= eliminated.row(n).head(n).transpose();
  information_ = information_.selfadjointView<Eigen::Lower>();
  cost_ = 0.5 * squared;
}

std::vector<ChainState> ChainElimination::StatesAt(const Eigen::VectorXd& shared) const {
  CHECK(keeps_panels_);
  Eigen::VectorXd with_right_side(problem_.layout->free_size() + 1);
  with_right_side << problem_.layout->basis.transpose() * (shared - at_), 1.0;
  std::vector<ChainState> states = problem_.states;
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
  Eigen::VectorXd moved;
  for (std::size_t k = states.size(); k-- > 0;) {
    if (k + 1 == states.size() || k % kPanelStates == kPanelStates - 1) {
      moved.noalias() = panels_[k / kPanelStates] * with_right_side;
    }
    const auto at = 3 * static_cast<Eigen::Index>(k % kPanelStates);
    const Eigen::Vector3d own = -factor_.half(k).transpose() * moved.segment<3>(at);
    step = factor_.IsCoupled(k) ? Eigen::Vector3d(own - factor_.gain(k) * step) : own;
    states[k].values = After(states[k].kind, states[k].values, step);
  }
  return states;
}

double ChainElimination::CostAt(const Eigen::VectorXd& shared) const {
  const std::vector<ChainState> states = is_linearised_ ? StatesAt(shared) : problem_.states;
  RowEvaluation evaluation;
  double sum = 0.0;
  for (const ChainRow& row : problem_.rows) {
    const std::size_t count = row.row->state_count();
    const std::array<const double*, 2> seen = {
        count > 0 ? states[row.state].values.data() : nullptr,
        count > 1 ? states[row.state + 1].values.data() : nullptr};
    if (!evaluation.Evaluate(*row.row, shared.data(), seen, false)) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    sum += (row.root.lazyProduct(evaluation.residual())).squaredNorm();
  }
  return 0.5 * sum;
}

std::vector<ChainElimination::Residual> ChainElimination::Residuals() const {
  std::vector<Residual> residuals(problem_.rows.size());
  const ChainFactor::Blocks inverse = factor_.Inverse();
  RowEvaluation evaluation;
  LinearRow row(problem_.layout->free_size());
  for (std::size_t index = 0; index < residuals.size(); ++index) {
    LineariseRow(index, &evaluation, &row);
    const std::size_t seen = problem_.rows[index].row->state_count();
    const std::size_t k = problem_.rows[index].state;
    Eigen::Matrix3d taken = Eigen::Matrix3d::Zero();
    if (seen > 0) taken = row.by_first * inverse.own[k] * row.by_first.transpose();
    if (seen > 1) {
      const Eigen::Matrix3d cross = row.by_first * inverse.WithNext(k) * row.by_second.transpose();
      taken += cross + cross.transpose() +
               row.by_second * inverse.own[k + 1] * row.by_second.transpose();
    }
    const int rows = problem_.rows[index].row->num_residuals();
    residuals[index].value = row.residual;
    residuals[index].left.topLeftCorner(rows, rows) =
        (Eigen::Matrix3d::Identity() - taken).topLeftCorner(rows, rows);
  }
  return residuals;
}

ChainElimination Linearised(const PoseGraph& graph) {
  ChainElimination chain(ChainOf(graph));
  chain.LineariseOnce(graph.shared);
  return chain;
}

}  // namespace truetriad
