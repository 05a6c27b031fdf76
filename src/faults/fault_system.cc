// SPDX-License-Identifier: Apache-2.0
#include "faults/fault_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glog/logging.h>

#include "faults/log_tail.h"
#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "noise/variance_components.h"

namespace truetriad {
namespace {

// Largest number of unknowns of a form in one group of poses: the entries of a 3 x 3 matrix.
constexpr int kMostOfForm = 9;
// With more turns, the correlation of neighbouring turns is estimated from 64 groups of turns.
constexpr std::size_t kMostTurnGroups = 64;
// A direction of a turn counts as undetermined (attitudes absorb its errors) if P has less than
// this share of the turn's largest information there.
constexpr double kSeenOfTurn = 1e-3;

// R of `square` = R R^T, which may be singular, as for turns about one axis.
Eigen::Matrix3d RootOfSquare(const Eigen::Matrix3d& square) {
  const SymmetricEigen3 eigen = EigenOfSymmetric3(square);
  return eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

// Factor, at least 1, by which correlation of neighbouring values enlarges the variance of their
// sum. It is found from sums over groups of consecutive values.
double TogetherOf(const std::vector<double>& values) {
  if (values.size() <= kMostTurnGroups) return 1.0;
  const Eigen::Map<const Eigen::VectorXd> all(values.data(), std::ssize(values));
  const Eigen::VectorXd off = all.array() - all.mean();
  Eigen::VectorXd of_group = Eigen::VectorXd::Zero(kMostTurnGroups);
  for (std::size_t i = 0; i < values.size(); ++i) {
    of_group[static_cast<Eigen::Index>(i * kMostTurnGroups / values.size())] +=
        off[static_cast<Eigen::Index>(i)];
  }
  return std::max(1.0, of_group.squaredNorm() / off.squaredNorm());
}

// sum += value^T y for the three rows of y from `row` on.
template <typename Value>
void AddTransposed(const Value& value, const StackedRows& y, Eigen::Index row, StackedRows* sum) {
  for (Eigen::Index j = 0; j < value.cols(); j += 3) {
    const Eigen::Index count = std::min<Eigen::Index>(3, value.cols() - j);
    AddProduct(1.0,
               value.middleCols(j, count).transpose(),
               y.middleRows(row, 3),
               sum->middleRows(j, count));
  }
}

// The information if columns are added: F_cd - 1/2 (x_cd + x_dc - tr E_c E_d), x_cd = tr X_cd.
Eigen::MatrixXd Without(Eigen::MatrixXd fisher,
                        const Eigen::MatrixXd& x,
                        const std::vector<Eigen::MatrixXd>& E) {
  for (Eigen::Index c = 0; c < fisher.rows(); ++c) {
    for (Eigen::Index d = 0; d < fisher.cols(); ++d) {
      const double both =
          E[static_cast<std::size_t>(c)].cwiseProduct(E[static_cast<std::size_t>(d)]).sum();
      fisher(c, d) -= 0.5 * (x(c, d) + x(d, c) - both);
    }
  }
  return fisher;
}

}  // namespace

void FaultColumn::Add(Eigen::Index row, const Eigen::Ref<const Eigen::MatrixXd>& value) {
  unknowns = value.cols();
  if (!value.isZero(0.0)) blocks.push_back({row, value});
}

Eigen::MatrixXd FaultColumn::Transposed(const StackedRows& y) const {
  StackedRows sum = StackedRows::Zero(unknowns, y.cols());
  for (const Block& block : blocks) AddTransposed(block.value, y, block.row, &sum);
  return sum;
}

Eigen::VectorXd FaultColumn::TransposedVector(const Eigen::VectorXd& y) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(unknowns);
  for (const Block& block : blocks) {
    sum.noalias() += block.value.transpose().lazyProduct(y.segment<3>(block.row));
  }
  return sum;
}

void AddedColumns::Append(const FaultColumn& column,
                          const Eigen::VectorXd& sigma_of,
                          Eigen::Index rows) {
  const Eigen::Index before = size(), more = column.unknowns;
  StackedRows both = StackedRows::Zero(rows, before + more);
  if (before > 0) both.leftCols(before) = Z;
  for (const FaultColumn::Block& block : column.blocks) {
    both.block(block.row, before, 3, more) += block.value;
  }
  Z = std::move(both);
  sigma.conservativeResize(before + more);
  sigma.tail(more) = sigma_of;
  for (Eigen::VectorXd* of : {&mean, &at}) {
    of->conservativeResize(before + more);
    of->tail(more).setZero();
  }
}

FaultSystem::FaultSystem(const ReducedSystem& system,
                         const PoseGraph& graph,
                         std::vector<NoiseComponent> components,
                         Eigen::Index most_dense_rows)
    : ReducedSystem(system), components_(std::move(components)), most_dense_rows_(most_dense_rows) {
  TakeIn(graph, {});
}

void FaultSystem::Linearise(const PoseGraph& graph, const AddedColumns& columns) {
  ReducedSystem::Linearise(graph);
  TakeIn(graph, columns);
}

void FaultSystem::Eliminate(const PoseGraph& graph, const AddedColumns& columns) {
  ReducedSystem::Eliminate(graph);
  TakeIn(graph, columns);
}

void FaultSystem::TakeIn(const PoseGraph& graph, const AddedColumns& columns) {
  PlaceParts(graph);
  SolveFor(columns);
  if (residual().size() <= most_dense_rows_) {
    FormDense();
    StateRemlDense();
  } else {
    P_.resize(0, 0);
    StateRemlByRows(graph);
  }
  score_ = -0.5 * traces_;
  for (const Part& part : parts_) {
    score_[part.component] += 0.5 * (part.root.transpose() * q_.segment<3>(part.row)).squaredNorm();
  }
}

void FaultSystem::PlaceParts(const PoseGraph& graph) {
  parts_.clear();
  const auto last = static_cast<Eigen::Index>(components_.size());
  for (const VariancePart& part : PartsOf(graph)) {
    if (part.rejected) continue;
    const Eigen::Index row = factors()[part.factor].row + part.row;
    const double per_root = 1.0 / std::sqrt(part.weight);
    const auto at = std::find(components_.begin(), components_.end(), part.component);
    if (at != components_.end()) {
      parts_.push_back({row, at - components_.begin(), per_root * CholeskyRoot(part.unit)});
    }
    if (part.component != NoiseComponent::kTurn || turn_unit_.empty()) continue;
    parts_.push_back({row, last, per_root * RootOfSquare(turn_unit_[part.index])});
  }
}

// Computes h = h_0 - (L L^T)^-1 (Z^T P_0 r + Λ (h_0 - mean)); readings have the correction h_0.
void FaultSystem::SolveFor(const AddedColumns& columns) {
  const Eigen::Index count = columns.size();
  U_.resize(residual().size(), count);
  V_.resize(size(), count);
  q_ = projected();
  h_.resize(count);
  h_covariance_.resize(count, count);
  along_.resize(count);
  log_determinant_ = prior_square_ = 0.0;
  if (count == 0) return;
  StackedRows G = Project(columns.Z);
  Eigen::MatrixXd shared(size(), count);  // M^-1 J^T D Z
  if (size() > 0) {
    shared = TransposeTimesRows(BM(), columns.Z);
    G -= ProductOfRows(projected_columns(), StackedRows(shared));
  }
  const Eigen::VectorXd information = columns.sigma.cwiseAbs2().cwiseInverse();
  Eigen::MatrixXd H = SymmetricProduct(columns.Z, G);
  H.diagonal() += information;
  // H is scaled: unknowns of a turn (rad) and of a magnetometer differ by many powers of ten.
  const Eigen::VectorXd balance = H.diagonal().cwiseSqrt().cwiseInverse();
  const Cholesky factor(ScaledBothSides(balance, H));
  const Eigen::MatrixXd upper =
      factor.SolveLower(Eigen::MatrixXd::Identity(count, count)).transpose();
  const Eigen::MatrixXd root = ScaledRows(balance, upper);  // L^-T
  U_ = ProductOfRows(G, StackedRows(root));
  V_ = Times(shared, root);
  const Eigen::VectorXd gradient =
      columns.Z.transpose() * projected() + information.cwiseProduct(columns.at - columns.mean);
  along_ = TransposeTimesVector(root, gradient);
  h_covariance_ = TimesTranspose(root, root);
  h_ = columns.at - TimesVector(root, along_);
  q_ -= U_ * along_;
  log_determinant_ = factor.LogDeterminant() - 2.0 * balance.array().log().sum() +
                     2.0 * columns.sigma.array().log().sum();
  prior_square_ = (columns.at - columns.mean).cwiseQuotient(columns.sigma).squaredNorm();
}

// Forms P = V^-1 - (V^-1 A) N^-1 (V^-1 A)^T - B M^-1 B^T - U U^T, with N = A^T V^-1 A.
void FaultSystem::FormDense() {
  const Eigen::Index rows = residual().size();
  StackedRows right = StackedRows::Zero(chain().size(), rows);  // N^-1 A^T V^-1
  for (const Factor& factor : factors()) {
    right.block(PoseRow(factor), factor.row, factor.tangents(), factor.rows) =
        Weighted(factor).transpose();
  }
  chain().SolveInPlace(&right);
  P_.setZero(rows, rows);
  for (const Factor& factor : factors()) {
    for (Eigen::Index row = 0; row < factor.rows; row += 3) {
      const auto information = Information(factor, row);
      const Eigen::Index at = factor.row + row;
      P_.block(at, at, information.rows(), information.cols()) = information;
    }
    AddProduct(-1.0,
               Weighted(factor),
               right.middleRows(PoseRow(factor), factor.tangents()),
               P_.middleRows(factor.row, factor.rows));
  }
  const Eigen::Index wide = size() + U_.cols();
  if (wide == 0) return;
  StackedRows left(rows, wide), both(wide, rows);
  left << BM(), U_;
  both.topRows(size()) = B().transpose();
  both.bottomRows(U_.cols()) = U_.transpose();
  P_ -= ProductOfRows(left, both);
}

// Z_a^T P Z_b for the columns of two faults a and b; kWide: number of unknowns of each.
template <int kWide>
Eigen::Matrix<double, kWide, kWide> FaultSystem::Between(const FaultColumn& a,
                                                         const FaultColumn& b) const {
  using ThreeRows = Eigen::Matrix<double, 3, kWide>;
  const auto value_of = [](const FaultColumn::Block& block) {
    return Eigen::Map<const ThreeRows>(block.value.data());
  };
  Eigen::Matrix<double, kWide, kWide> sum = Eigen::Matrix<double, kWide, kWide>::Zero();
  for (const FaultColumn::Block& own : a.blocks) {
    ThreeRows half = ThreeRows::Zero();
    for (const FaultColumn::Block& other : b.blocks) {
      half.noalias() += P_.block<3, 3>(own.row, other.row).lazyProduct(value_of(other));
    }
    sum.noalias() += value_of(own).transpose().lazyProduct(half);
  }
  return sum;
}

template <int kWide>
Eigen::MatrixXd FaultSystem::DenseInformation(const std::vector<FaultColumn>& columns) const {
  const auto count = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd all(kWide * count, kWide * count);
  for (Eigen::Index h = 0; h < count; ++h) {
    for (Eigen::Index g = h; g < count; ++g) {
      auto block = all.block<kWide, kWide>(g * kWide, h * kWide);
      block = Between<kWide>(columns[static_cast<std::size_t>(g)],
                             columns[static_cast<std::size_t>(h)]);
      if (g > h) all.block<kWide, kWide>(h * kWide, g * kWide) = block.transpose();
    }
  }
  return all;
}

Eigen::MatrixXd FaultSystem::InformationOf(const std::vector<FaultColumn>& columns) const {
  const auto count = static_cast<Eigen::Index>(columns.size());
  const Eigen::Index wide = columns.front().unknowns;
  if (is_dense()) {
    if (wide == 1) return DenseInformation<1>(columns);
    if (wide == 3) return DenseInformation<3>(columns);
    CHECK_EQ(wide, kMostOfForm);
    return DenseInformation<kMostOfForm>(columns);
  }
  Eigen::MatrixXd BZ(wide * count, size()), UZ(wide * count, U_.cols());
  for (Eigen::Index h = 0; h < count; ++h) {
    const FaultColumn& column = columns[static_cast<std::size_t>(h)];
    BZ.middleRows(h * wide, wide) = column.Transposed(projected_columns()).leftCols(size());
    UZ.middleRows(h * wide, wide) = column.Transposed(U_);
  }
  return InformationByFactors(columns) - TimesTranspose(Times(BZ, covariance()), BZ) -
         TimesTranspose(UZ, UZ);
}

// Z_g^T D Z_h = Z_g^T W Z_h - b_g^T N^-1 b_h for all pairs, with W = V^-1 and b = A^T W Z.
Eigen::MatrixXd FaultSystem::InformationByFactors(const std::vector<FaultColumn>& columns) const {
  std::vector<ChainFactor::Panel> panels;
  std::size_t last_end = 0;
  for (const FaultColumn& column : columns) {
    panels.push_back(PanelOf(column, last_end));
    if (panels.back().rows.rows() > 0) last_end = panels.back().end();
  }
  return WeightedSquares(columns) - chain().InverseBetween(panels, pose_covariance());
}

// The panel A^T W Z of a column. Its rows reach to state `least_end` or further.
ChainFactor::Panel FaultSystem::PanelOf(const FaultColumn& column, std::size_t least_end) const {
  ChainFactor::Panel panel;
  std::size_t first = chain().states(), end = least_end;
  std::vector<const Factor*> factor_of;
  factor_of.reserve(column.blocks.size());
  for (const FaultColumn::Block& block : column.blocks) {
    const Factor& factor = FactorOf(block.row);
    factor_of.push_back(&factor);
    first = std::min(first, factor.node);
    end = std::max(end, factor.node + (factor.sees_next ? 2 : 1));
  }
  panel.first = first;
  const auto count = static_cast<Eigen::Index>(column.blocks.empty() ? 0 : end - first);
  panel.rows = Eigen::MatrixXd::Zero(3 * count, column.unknowns);
  for (std::size_t i = 0; i < factor_of.size(); ++i) {
    const Factor& factor = *factor_of[i];
    const FaultColumn::Block& block = column.blocks[i];
    const auto weighted = Weighted(factor).middleRows<3>(block.row - factor.row);
    auto own = panel.rows.middleRows(PoseRow(factor) - 3 * static_cast<Eigen::Index>(first),
                                     factor.tangents());
    own.noalias() += weighted.transpose().lazyProduct(block.value);
  }
  return panel;
}

// Z_g^T W Z_h of all pairs of columns, with W = V^-1.
Eigen::MatrixXd FaultSystem::WeightedSquares(const std::vector<FaultColumn>& columns) const {
  struct Placed {
    Eigen::Index column = 0;
    const FaultColumn::Block* block = nullptr;
  };
  std::vector<Placed> placed;
  const Eigen::Index wide = columns.front().unknowns;
  for (Eigen::Index h = 0; h < std::ssize(columns); ++h) {
    for (const FaultColumn::Block& block : columns[static_cast<std::size_t>(h)].blocks) {
      placed.push_back({h, &block});
    }
  }
  std::stable_sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) {
    return a.block->row < b.block->row;
  });
  Eigen::MatrixXd all =
      Eigen::MatrixXd::Zero(wide * std::ssize(columns), wide * std::ssize(columns));
  for (auto begin = placed.begin(), end = begin; begin != placed.end(); begin = end) {
    const Eigen::Index row = begin->block->row;
    end = std::find_if(begin, placed.end(), [row](const Placed& p) { return p.block->row != row; });
    const Factor& factor = FactorOf(row);
    const Eigen::Matrix3d W = Information(factor, row - factor.row);
    for (auto other = begin; other != end; ++other) {
      const Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMostOfForm> half =
          W.lazyProduct(other->block->value);
      for (auto own = begin; own != end; ++own) {
        all.block(own->column * wide, other->column * wide, wide, wide).noalias() +=
            own->block->value.transpose().lazyProduct(half);
      }
    }
  }
  return all;
}

// D Z. If no factor has two poses, D is block diagonal.
StackedRows FaultSystem::ProjectedByFactors(const FaultColumn& column) const {
  StackedRows Y = StackedRows::Zero(residual().size(), column.unknowns);
  if (sees_pairs()) {
    for (const FaultColumn::Block& block : column.blocks) {
      Y.middleRows<3>(block.row) += block.value;
    }
    return Project(std::move(Y));
  }
  for (const FaultColumn::Block& block : column.blocks) {
    const auto at = static_cast<std::size_t>(&FactorOf(block.row) - factors().data());
    const Factor& factor = factors()[at];
    Y.middleRows(factor.row, factor.rows) +=
        D(at).middleCols(block.row - factor.row, 3).lazyProduct(block.value);
  }
  return Y;
}

StackedRows FaultSystem::Projected(const FaultColumn& column) const {
  if (is_dense()) return column.Transposed(P_).transpose();
  StackedRows PZ = ProjectedByFactors(column);
  if (size() > 0) {
    const Eigen::MatrixXd ZB = column.Transposed(projected_columns()).leftCols(size());
    PZ -= ProductOfRows(BM(), StackedRows(ZB.transpose()));
  }
  if (U_.cols() > 0) PZ -= StackedRows(U_ * column.Transposed(U_).transpose());
  return PZ;
}

StackedRows FaultSystem::Projected(const StackedRows& y) const {
  StackedRows Py = ReducedSystem::Projected(y);
  if (U_.cols() > 0) Py -= StackedRows(U_ * TransposeTimesRows(U_, y));
  return Py;
}

Eigen::Matrix3d FaultSystem::BlockOfP(Eigen::Index row) const {
  if (is_dense()) return P_.block<3, 3>(row, row);
  const Factor& factor = FactorOf(row);
  const auto at = static_cast<std::size_t>(&factor - factors().data());
  Eigen::Matrix3d block = ProjectorBlock(at, row - factor.row);
  if (U_.cols() > 0) block -= U_.middleRows<3>(row) * U_.middleRows<3>(row).transpose();
  return block;
}

FaultSystem::Alignment FaultSystem::AlignmentOf(const TurnVariances& unit) const {
  double sum = 0.0, squares = 0.0, fourths = 0.0, beyond = 0.0;
  std::vector<double> directions;
  const std::size_t first = factors().size() - unit.size();
  for (std::size_t i = 0; i < unit.size(); ++i) {
    const Eigen::Index row = factors()[first + i].row;
    const SymmetricEigen3 block = EigenOfSymmetric3(BlockOfP(row));
    const Eigen::Array3d values = block.values;
    const Eigen::Array3d seen = (values > kSeenOfTurn * values.maxCoeff()).cast<double>();
    const double k = seen.sum();
    if (k < 2.0) continue;
    const Eigen::Vector3d root = (seen * values.max(0.0)).sqrt();
    const Eigen::Vector3d along = block.vectors.transpose() * q_.segment<3>(row);
    const double square = (seen * along.array().square() / values.max(1e-300)).sum();
    const Eigen::Matrix3d turned = block.vectors.transpose() * unit[i] * block.vectors;
    const Eigen::Matrix3d Q = root.asDiagonal() * turned * root.asDiagonal();
    const double trace = Q.trace(), apart = Q.squaredNorm() - trace * trace / k;
    if (!(apart > 0.0) || !(square > 0.0)) continue;
    const double more = along.dot(turned * along) - square * trace / k;
    // If all directions are equally likely, this value has variance 1.
    directions.push_back(more / square * std::sqrt(0.5 * k * (k + 2.0) / apart));
    sum += std::sqrt(apart) * directions.back();
    squares += apart;
    fourths += apart * apart;
    beyond += more;
  }
  if (!(squares > 0.0) || sum <= 0.0) return {};
  // Satterthwaite's degrees of freedom. They are few if few turns have most of the variance.
  const double dof = squares * squares / fourths;
  const double ratio = sum * sum / (squares * TogetherOf(directions));
  return {std::log(0.5) + LogFisherUpper(ratio, 1.0, dof), std::max(beyond / squares, 0.0)};
}

Eigen::MatrixXd FaultSystem::BeyondGraph() const {
  if (V_.cols() == 0) return Eigen::MatrixXd::Zero(size(), size());
  return TimesTranspose(V_, V_);
}

double FaultSystem::ChiSquareOf(const PoseGraph& graph) {
  LinearisedGraph::Eliminate(graph);
  const Eigen::VectorXd projected = projected_columns().col(size());
  if (size() == 0) return residual().dot(projected);
  const Eigen::VectorXd step =
      SharedInformation(graph.layout, graph.shared, matrix(), gradient()).step();
  return (residual() + J() * step).dot(projected + B() * step);
}

// The shift without included faults, -M^-1 J^T D Z, plus what these faults absorb, V U^T Z.
Eigen::MatrixXd FaultSystem::SharedShift(const FaultColumn& column) const {
  Eigen::MatrixXd shift = -column.Transposed(BM()).transpose();
  if (U_.cols() > 0) shift += TimesTranspose(V_, column.Transposed(U_));
  return shift;
}

const FaultSystem::Factor& FaultSystem::FactorOf(Eigen::Index row) const {
  const auto after = std::upper_bound(
      factors().begin(), factors().end(), row, [](Eigen::Index wanted, const Factor& factor) {
        return wanted < factor.row;
      });
  return *std::prev(after);
}

double FaultSystem::WhitenedSquare(Eigen::Index row) const {
  const Factor& factor = FactorOf(row);
  const Eigen::Vector3d r = residual().segment<3>(row);
  return r.dot(Information(factor, row - factor.row) * r);
}

Eigen::VectorXd FaultSystem::Squares(const FaultColumn& column) const {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(column.unknowns);
  for (const FaultColumn::Block& block : column.blocks) {
    const Factor& factor = FactorOf(block.row);
    const Eigen::Matrix3d W = Information(factor, block.row - factor.row);
    for (Eigen::Index j = 0; j < column.unknowns; ++j) {
      const Eigen::Vector3d one = block.value.col(j);
      squares[j] += one.dot(W * one);
    }
  }
  return squares;
}

// F_cd = 1/2 Σ |R_b^T P_bb' R_b'|^2 over the parts b of component c and b' of component d.
void FaultSystem::StateRemlDense() {
  traces_ = Eigen::VectorXd::Zero(components());
  fisher_ = Eigen::MatrixXd::Zero(components(), components());
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Part& a = parts_[i];
    const Eigen::Matrix3d a_root = a.root.transpose();
    traces_[a.component] += (a_root * P_.block<3, 3>(a.row, a.row)).cwiseProduct(a_root).sum();
    for (std::size_t j = i; j < parts_.size(); ++j) {
      const Part& b = parts_[j];
      const Eigen::Matrix3d half = a_root * P_.block<3, 3>(a.row, b.row);
      const double square = (half * b.root).squaredNorm() * (i == j ? 0.5 : 1.0);
      fisher_(a.component, b.component) += 0.5 * square;
      fisher_(b.component, a.component) += 0.5 * square;
    }
  }
}

// Like StateRemlDense without P: the values of the graph, minus the part of included columns.
void FaultSystem::StateRemlByRows(const PoseGraph& graph) {
  VarianceTraces plain = TracesOf(components_, graph, *this);
  traces_ = std::move(plain.traces);
  fisher_ = std::move(plain.fisher);
  if (U_.cols() == 0) return;
  const std::vector<Eigen::MatrixXd> E = ComponentSquares(U_);
  fisher_ = Without(std::move(fisher_), CrossTraces(U_), E);
  for (Eigen::Index c = 0; c < components(); ++c)
    traces_[c] -= E[static_cast<std::size_t>(c)].trace();
}

// The restricted log likelihood without constants (N, M: reduced_system.h; L, Λ: fault_system.h):
// -1/2 (log |V| + log |N| + log |M| + log |L L^T| - log |Λ| + r^T P r + |(h_0 - mean) / σ|^2).
double FaultSystem::LogLikelihood() const {
  double sum = log_determinant_ + prior_square_ - along_.squaredNorm();
  for (const Factor& factor : factors()) {
    for (Eigen::Index row = 0; row + 3 <= factor.rows; row += 3) {
      sum -= std::log(Eigen::Matrix3d(Information(factor, row)).determinant());
    }
  }
  for (std::size_t k = 0; k < chain().states(); ++k) {
    sum -= 2.0 * std::log(std::abs(chain().half(k).determinant()));
  }
  sum += residual().dot(projected_columns().col(size()));
  if (size() > 0) {
    const Eigen::VectorXd balance = information().diagonal().cwiseSqrt().cwiseInverse();
    sum += Cholesky(ScaledBothSides(balance, information())).LogDeterminant() -
           2.0 * balance.array().log().sum();
    sum += gradient().dot(step());
  }
  return -0.5 * sum;
}

std::vector<Eigen::MatrixXd> FaultSystem::ComponentSquares(const StackedRows& Y) const {
  std::vector<Eigen::MatrixXd> E(static_cast<std::size_t>(components()),
                                 Eigen::MatrixXd::Zero(Y.cols(), Y.cols()));
  std::vector<StackedRows> blocks(E.size(), StackedRows(kRowsAtOnce, Y.cols()));
  std::vector<Eigen::Index> filled(E.size(), 0);
  const auto add = [&](std::size_t c) {
    const StackedRows rows = blocks[c].topRows(filled[c]);
    E[c] += SymmetricProduct(rows, rows);
    filled[c] = 0;
  };
  for (const Part& part : parts_) {
    const auto c = static_cast<std::size_t>(part.component);
    blocks[c].middleRows<3>(filled[c]).noalias() =
        part.root.transpose().lazyProduct(Y.middleRows<3>(part.row));
    filled[c] += 3;
    if (filled[c] == kRowsAtOnce) add(c);
  }
  for (std::size_t c = 0; c < E.size(); ++c) add(c);
  return E;
}

// tr X_cd, X_cd = Y^T D_c P D_d Y. If P is not formed, V^-1 is used instead: with that many rows, P
// is nearly V^-1.
Eigen::MatrixXd FaultSystem::CrossTraces(const StackedRows& Y) const {
  const Eigen::Index count = components(), wide = Y.cols();
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(count, count);
  if (!is_dense()) {
    for (const Part& part : parts_) {
      const Factor& factor = FactorOf(part.row);
      const Eigen::Matrix3d W = Information(factor, part.row - factor.row);
      const StackedRows DY =
          part.root * part.root.transpose().lazyProduct(Y.middleRows<3>(part.row)).eval();
      x(part.component, part.component) += DY.cwiseProduct(W.lazyProduct(DY)).sum();
    }
    return x;
  }
  std::vector<StackedRows> PDY(static_cast<std::size_t>(count), StackedRows::Zero(wide, Y.rows()));
  const auto changed_by = [&](const Part& part) -> Eigen::Matrix<double, 3, Eigen::Dynamic> {
    return (part.root * part.root.transpose()).lazyProduct(Y.middleRows<3>(part.row));
  };
  for (const Part& part : parts_) {
    const auto c = static_cast<std::size_t>(part.component);
    AddTransposed(changed_by(part), P_, part.row, &PDY[c]);
  }
  for (const Part& part : parts_) {
    const Eigen::Matrix<double, 3, Eigen::Dynamic> changed = changed_by(part);
    for (Eigen::Index c = 0; c < count; ++c) {
      const auto own = PDY[static_cast<std::size_t>(c)].middleCols<3>(part.row);
      x(c, part.component) += own.transpose().cwiseProduct(changed).sum();
    }
  }
  return x;
}

Eigen::MatrixXd FaultSystem::FisherWithout(const StackedRows& Y,
                                           const std::vector<Eigen::MatrixXd>& E) const {
  return Without(fisher_, CrossTraces(Y), E);
}

}  // namespace truetriad
