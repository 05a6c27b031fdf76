// SPDX-License-Identifier: Apache-2.0
#include "motion/chain.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

constexpr Triad kVectorTriads[] = {Triad::kAccelerometer, Triad::kMagnetometer};
constexpr Triad kGyroscope = Triad::kGyroscope;
// A panel of this many attitudes stays in the cache while it is squared.
constexpr std::size_t kPanelNodes = 64;
// Own columns of a triad: bias 3, sensitivity 9, then g-sensitivity 9 or reference 4.
constexpr int kOwnColumns = 21;
using OwnJacobian = Eigen::Matrix<double, 3, kOwnColumns>;
using CompactJacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kOwnColumns>;

Eigen::Map<const Eigen::Matrix3d> MatrixAt(const double* shared, int at) {
  return Eigen::Map<const Eigen::Matrix3d>(shared + at);
}

TriadModel<double> ModelAt(const SharedLayout& layout, Triad triad, const double* shared) {
  return {MatrixAt(shared, layout.sensitivity[triad]),
          Eigen::Map<const Eigen::Vector3d>(shared + layout.bias[triad])};
}

// Rows of one triad, collected until there are enough to square them at once.
class SquaredRows {
 public:
  explicit SquaredRows(Eigen::Index columns)
      : rows_(3 * static_cast<Eigen::Index>(kPanelNodes), columns),
        sum_(Eigen::MatrixXd::Zero(columns, columns)) {}

  void Add(const CompactJacobian& jacobian, const Eigen::Vector3d& residual) {
    rows_.block(used_, 0, 3, jacobian.cols()) = jacobian;
    rows_.block<3, 1>(used_, jacobian.cols()) = residual;
    used_ += 3;
    if (used_ == rows_.rows()) Flush();
  }
  // Sum of the outer products, lower triangle; the last column is the residual.
  const Eigen::MatrixXd& sum() {
    Flush();
    return sum_;
  }

 private:
  void Flush() {
    sum_.selfadjointView<Eigen::Lower>().rankUpdate(rows_.topRows(used_).transpose());
    used_ = 0;
  }
  Eigen::MatrixXd rows_, sum_;
  Eigen::Index used_ = 0;
};

}  // namespace

MotionChain::MotionChain(const SharedLayout& layout,
                         const std::vector<ScalarPrior>& priors,
                         const MotionTrack& track,
                         std::vector<MotionNode> nodes,
                         std::vector<Eigen::Quaterniond> attitudes)
    : layout_(layout),
      priors_(priors),
      track_(track),
      nodes_(std::move(nodes)),
      attitudes_(std::move(attitudes)),
      has_magnetometer_(layout.Has(Triad::kMagnetometer)) {
  for (const Triad triad : kTriads) {
    if (layout_.Has(triad)) columns_[triad] = ColumnsOf(triad);
  }
}

MotionChain::Columns MotionChain::ColumnsOf(Triad triad) const {
  Columns columns;
  const int extra = triad == kGyroscope ? layout_.g_sensitivity : layout_.reference;
  const int extra_size = triad == kGyroscope ? 9 : static_cast<int>(kReferenceSize);
  for (int j = 0; j < layout_.free_size(); ++j) {
    const std::size_t before = columns.terms.size();
    const auto column = static_cast<int>(columns.free.size());
    const auto add = [&](int begin, int size, int own) {
      for (int i = 0; begin >= 0 && i < size; ++i) {
        const double factor = layout_.basis(begin + i, j);
        if (factor != 0.0) columns.terms.push_back({column, own + i, factor});
      }
    };
    add(layout_.bias[triad], 3, 0);
    add(layout_.sensitivity[triad], 9, 3);
    add(extra, extra_size, 12);
    if (columns.terms.size() > before) columns.free.push_back(j);
  }
  return columns;
}

GyroModel MotionChain::GyroscopeAt(const double* shared) const {
  GyroModel model{ModelAt(layout_, kGyroscope, shared)};
  if (layout_.g_sensitivity >= 0) {
    model.g_sensitivity = MatrixAt(shared, layout_.g_sensitivity);
  }
  return model;
}

void MotionChain::SetNoise(const MotionNoise& noise, const double* shared) {
  noise_ = noise;
  for (const Triad triad : kVectorTriads) {
    if (!layout_.Has(triad)) continue;
    inverse_sigma_[triad] =
        (noise.density[triad] / track_.spacing_s(triad)).cwiseSqrt().cwiseInverse();
  }
  const Eigen::Matrix3d correction = GyroscopeAt(shared).triad.Correction();
  const Eigen::Matrix3d variance =
      correction * noise.density[kGyroscope].asDiagonal() * correction.transpose();
  turn_root_ = Eigen::LLT<Eigen::Matrix3d>(variance).matrixL().solve(Eigen::Matrix3d::Identity());
}

double MotionChain::RootWeight(const GatheredReadings& seen) const {
  return std::sqrt(seen.weight * static_cast<double>(seen.count));
}

// Without a magnetometer nothing tells the heading of a chain: that of its first attitude is held.
bool MotionChain::HoldsHeading(std::size_t k) const {
  return !has_magnetometer_ && (k == 0 || !nodes_[k - 1].is_linked);
}

Eigen::Vector3d MotionChain::VectorResidual(Triad triad,
                                            const MotionNode& node,
                                            const TriadModel<double>& model,
                                            const Eigen::Vector3d& field) const {
  const GatheredReadings& seen = node.seen(triad);
  return RootWeight(seen) *
         inverse_sigma_[triad].cwiseProduct(model.sensitivity * field + model.bias - seen.mean_raw);
}

double MotionChain::CostAt(const double* shared,
                           const std::vector<Eigen::Quaterniond>& attitudes) const {
  const Eigen::Map<const ReferenceVector> reference(shared + layout_.reference);
  double sum = 0.0;
  for (const Triad triad : kVectorTriads) {
    if (!layout_.Has(triad)) continue;
    const TriadModel<double> model = ModelAt(layout_, triad, shared);
    const Eigen::Vector3d world = WorldVector(triad, reference);
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      const GatheredReadings& seen = nodes_[k].seen(triad);
      if (seen.count == 0) continue;
      const Eigen::Vector3d field = seen.turn * (attitudes[k].conjugate() * world);
      sum += VectorResidual(triad, nodes_[k], model, field).squaredNorm();
    }
  }
  const GyroModel gyroscope = GyroscopeAt(shared);
  for (std::size_t k = 0; k + 1 < nodes_.size(); ++k) {
    if (!nodes_[k].is_linked) continue;
    const GyroReadings readings = track_.Between(nodes_[k], nodes_[k + 1]);
    const Eigen::Quaterniond turned =
        IntegrateRotation(readings, gyroscope, RateSampling::kInstantaneous);
    const Eigen::Vector3d log =
        RotationLog(turned.conjugate() * attitudes[k].conjugate() * attitudes[k + 1]);
    const double duration_s = readings.time_s.back() - readings.time_s.front();
    sum += (turn_root_ * log).squaredNorm() * nodes_[k].weight / duration_s;
  }
  for (const ScalarPrior& prior : priors_) {
    const double error = (shared[prior.index] - prior.mean) / prior.sigma;
    sum += error * error;
  }
  return 0.5 * sum;
}

void MotionChain::Linearise(const double* shared) {
  const int n = layout_.free_size();
  const Eigen::Map<const ReferenceVector> reference(shared + layout_.reference);
  const GyroModel gyroscope = GyroscopeAt(shared);
  PerTriad<TriadModel<double>> models;
  PerTriad<Eigen::Vector3d> world;
  PerTriad<Eigen::Matrix<double, 3, kReferenceSize>> world_by_reference;
  PerTriad<bool> has_reference{};
  std::vector<SquaredRows> squares;
  for (const Triad triad : kTriads) {
    squares.emplace_back(static_cast<Eigen::Index>(columns_[triad].free.size()) + 1);
    if (triad == kGyroscope || !layout_.Has(triad)) continue;
    models[triad] = ModelAt(layout_, triad, shared);
    world[triad] = WorldVector(triad, reference);
    world_by_reference[triad] = WorldVectorJacobian(triad, reference);
    has_reference[triad] = std::any_of(columns_[triad].terms.begin(),
                                       columns_[triad].terms.end(),
                                       [](const auto& term) { return term.own >= 12; });
  }
  const auto square_of = [&squares](Triad triad) -> SquaredRows& {
    return squares[static_cast<std::size_t>(triad)];
  };

  const std::size_t count = nodes_.size();
  inverse_factor_.resize(count);
  gain_.assign(count, Eigen::Matrix3d::Zero());
  panels_.clear();
  information_ = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd eliminated = Eigen::MatrixXd::Zero(n + 1, n + 1);

  // Of the present attitude, and what the turn into the next adds to that.
  Eigen::Matrix3d pivot = Eigen::Matrix3d::Zero(), next_pivot, coupling;
  Eigen::Matrix<double, 3, Eigen::Dynamic> columns(3, n + 1), next_columns(3, n + 1);
  columns.setZero();
  OwnJacobian own;
  CompactJacobian compact;
  const auto compress = [&own, &compact](const Columns& which) {
    compact.setZero(3, static_cast<Eigen::Index>(which.free.size()));
    for (const Columns::Term& term : which.terms) {
      compact.col(term.column) += term.factor * own.col(term.own);
    }
  };
  // Adds A^T [J, r] to the columns of an attitude.
  const auto add_columns = [n](const Eigen::Matrix3d& by_attitude,
                               const CompactJacobian& jacobian,
                               const Eigen::Vector3d& residual,
                               const Columns& which,
                               Eigen::Matrix<double, 3, Eigen::Dynamic>* into) {
    const Eigen::Matrix3d transposed = by_attitude.transpose();
    for (std::size_t j = 0; j < which.free.size(); ++j) {
      into->col(which.free[j]).noalias() += transposed * jacobian.col(static_cast<Eigen::Index>(j));
    }
    into->col(n).noalias() += transposed * residual;
  };

  for (std::size_t k = 0; k < count; ++k) {
    const MotionNode& node = nodes_[k];
    const Eigen::Matrix3d body_from_world = attitudes_[k].conjugate().toRotationMatrix();
    for (const Triad triad : kVectorTriads) {
      const GatheredReadings& seen = node.seen(triad);
      if (seen.count == 0 || !layout_.Has(triad)) continue;
      const Eigen::Matrix3d& sensitivity = models[triad].sensitivity;
      const Eigen::Matrix3d turned = seen.turn * body_from_world;
      const Eigen::Vector3d at_node = body_from_world * world[triad];
      const Eigen::Vector3d field = seen.turn * at_node;
      const Eigen::Vector3d root = RootWeight(seen) * inverse_sigma_[triad];
      const Eigen::Vector3d residual = VectorResidual(triad, node, models[triad], field);
      // (R Exp(d))^T v = x + [x]_x d.
      const Eigen::Matrix3d whitened = root.asDiagonal() * sensitivity;
      const Eigen::Matrix3d by_attitude = whitened * seen.turn * Skew(at_node);
      own.leftCols<3>() = root.asDiagonal();
      for (int axis = 0; axis < 3; ++axis) {
        own.middleCols<3>(3 + 3 * axis) = (field[axis] * root).asDiagonal();
      }
      if (has_reference[triad]) {
        own.middleCols<kReferenceSize>(12) = whitened * turned * world_by_reference[triad];
      }
      compress(columns_[triad]);
      pivot.noalias() += by_attitude.transpose() * by_attitude;
      add_columns(by_attitude, compact, residual, columns_[triad], &columns);
      square_of(triad).Add(compact, residual);
    }
    if (HoldsHeading(k)) {
      // The vertical in the body: nothing else pulls about it.
      const Eigen::Vector3d up = body_from_world.col(2);
      pivot.noalias() += up * up.transpose();
    }

    const bool is_linked = node.is_linked && k + 1 < count;
    if (is_linked) {
      const GyroReadings readings = track_.Between(node, nodes_[k + 1]);
      const GyroIncrement increment =
          IntegrateMove(readings, gyroscope, Eigen::Vector3d::Zero(), RateSampling::kInstantaneous);
      const Eigen::Matrix3d root = std::sqrt(node.weight / increment.duration_s) * turn_root_;
      const Eigen::Quaterniond between = attitudes_[k].conjugate() * attitudes_[k + 1];
      const Eigen::Vector3d log = RotationLog(increment.rotation.conjugate() * between);
      const Eigen::Matrix3d from_right = InverseRightJacobian(log);
      const Eigen::Matrix3d by_next = root * from_right;
      const Eigen::Matrix3d by_this = -by_next * between.toRotationMatrix().transpose();
      // Exp(-J d) from the left; the inverse left Jacobian is the right one's transpose.
      const Eigen::Matrix3d by_change = -root * from_right.transpose();
      own.leftCols<3>() = by_change * increment.by_bias;
      own.middleCols<9>(3) = by_change * increment.by_sensitivity;
      if (layout_.g_sensitivity >= 0) {
        own.middleCols<9>(12) = by_change * increment.by_g_sensitivity;
      }
      compress(columns_[kGyroscope]);
      const Eigen::Vector3d residual = root * log;
      square_of(kGyroscope).Add(compact, residual);
      pivot.noalias() += by_this.transpose() * by_this;
      add_columns(by_this, compact, residual, columns_[kGyroscope], &columns);
      next_pivot.noalias() = by_next.transpose() * by_next;
      next_columns.setZero();
      add_columns(by_next, compact, residual, columns_[kGyroscope], &next_columns);
      coupling.noalias() = by_this.transpose() * by_next;
    } else {
      next_pivot.setZero();
      next_columns.setZero();
    }

    const Eigen::LLT<Eigen::Matrix3d> factor(pivot);
    inverse_factor_[k] = factor.matrixL().solve(Eigen::Matrix3d::Identity());
    if (k % kPanelNodes == 0) {
      const std::size_t rows = 3 * std::min(kPanelNodes, count - k);
      panels_.emplace_back(static_cast<Eigen::Index>(rows), n + 1);
    }
    auto whitened = panels_.back().middleRows<3>(3 * static_cast<Eigen::Index>(k % kPanelNodes));
    whitened.noalias() = inverse_factor_[k] * columns;
    if (is_linked) {
      const Eigen::Matrix3d half_gain = inverse_factor_[k] * coupling;
      gain_[k].noalias() = inverse_factor_[k].transpose() * half_gain;
      next_pivot.noalias() -= half_gain.transpose() * half_gain;
      next_columns.noalias() -= half_gain.transpose() * whitened;
    }
    if (k % kPanelNodes == kPanelNodes - 1 || k + 1 == count) {
      eliminated.selfadjointView<Eigen::Lower>().rankUpdate(panels_.back().transpose());
    }
    pivot = next_pivot;
    columns.swap(next_columns);
  }

  gradient_ = Eigen::VectorXd::Zero(n);
  double squared = 0.0;
  for (const Triad triad : kTriads) {
    const Eigen::MatrixXd& sum = square_of(triad).sum();
    const std::vector<int>& free = columns_[triad].free;
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
  for (const ScalarPrior& prior : priors_) {
    const Eigen::VectorXd row = layout_.basis.row(prior.index).transpose() / prior.sigma;
    const double error = (shared[prior.index] - prior.mean) / prior.sigma;
    information_.triangularView<Eigen::Lower>() += row * row.transpose();
    gradient_ += error * row;
    squared += error * error;
  }
  information_ = information_.selfadjointView<Eigen::Lower>();
  cost_ = 0.5 * squared;
}

std::vector<Eigen::Quaterniond> MotionChain::AttitudesAfter(const Eigen::VectorXd& step) const {
  Eigen::VectorXd with_right_side(step.size() + 1);
  with_right_side << step, 1.0;
  std::vector<Eigen::Quaterniond> attitudes = attitudes_;
  Eigen::Vector3d next = Eigen::Vector3d::Zero();
  Eigen::VectorXd moved;
  for (std::size_t k = nodes_.size(); k-- > 0;) {
    if (k + 1 == nodes_.size() || k % kPanelNodes == kPanelNodes - 1) {
      moved.noalias() = panels_[k / kPanelNodes] * with_right_side;
    }
    const auto at = 3 * static_cast<Eigen::Index>(k % kPanelNodes);
    next = (-inverse_factor_[k].transpose() * moved.segment<3>(at) - gain_[k] * next).eval();
    attitudes[k] = (attitudes[k] * RotationExp(next)).normalized();
  }
  return attitudes;
}

PerTriad<MotionChain::Residuals> MotionChain::AllResiduals(const double* shared) const {
  const Eigen::Map<const ReferenceVector> reference(shared + layout_.reference);
  const auto count = static_cast<Eigen::Index>(nodes_.size());
  PerTriad<Residuals> all;
  for (const Triad triad : kTriads) {
    all[triad].value.setZero(3, count);
    all[triad].left.setZero(3, count);
  }
  const GyroModel gyroscope = GyroscopeAt(shared);
  // Blocks of the inverse of the attitudes' normal matrix: of one, and of one with the next.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero(), with_next;
  for (std::size_t k = nodes_.size(); k-- > 0;) {
    const auto column = static_cast<Eigen::Index>(k);
    const Eigen::Matrix3d next_covariance = covariance;
    with_next.noalias() = -gain_[k] * next_covariance;
    covariance = inverse_factor_[k].transpose() * inverse_factor_[k];
    covariance.noalias() -= with_next * gain_[k].transpose();
    const MotionNode& node = nodes_[k];
    const Eigen::Matrix3d body_from_world = attitudes_[k].conjugate().toRotationMatrix();
    for (const Triad triad : kVectorTriads) {
      const GatheredReadings& seen = node.seen(triad);
      if (seen.count == 0 || !layout_.Has(triad)) continue;
      const TriadModel<double> model = ModelAt(layout_, triad, shared);
      const Eigen::Vector3d at_node = body_from_world * WorldVector(triad, reference);
      const Eigen::Vector3d root = RootWeight(seen) * inverse_sigma_[triad];
      const Eigen::Matrix3d by_attitude =
          root.asDiagonal() * model.sensitivity * seen.turn * Skew(at_node);
      all[triad].value.col(column) = VectorResidual(triad, node, model, seen.turn * at_node);
      all[triad].left.col(column) =
          Eigen::Vector3d::Ones() - (by_attitude * covariance * by_attitude.transpose()).diagonal();
    }
    if (!node.is_linked || k + 1 == nodes_.size()) continue;
    const GyroReadings readings = track_.Between(node, nodes_[k + 1]);
    const Eigen::Quaterniond turned =
        IntegrateRotation(readings, gyroscope, RateSampling::kInstantaneous);
    const Eigen::Quaterniond between = attitudes_[k].conjugate() * attitudes_[k + 1];
    const Eigen::Vector3d log = RotationLog(turned.conjugate() * between);
    const double duration_s = readings.time_s.back() - readings.time_s.front();
    const Eigen::Matrix3d root = std::sqrt(node.weight / duration_s) * turn_root_;
    const Eigen::Matrix3d by_next = root * InverseRightJacobian(log);
    const Eigen::Matrix3d by_this = -by_next * between.toRotationMatrix().transpose();
    const Eigen::Matrix3d cross = by_this * with_next * by_next.transpose();
    all[kGyroscope].value.col(column) = root * log;
    all[kGyroscope].left.col(column) =
        Eigen::Vector3d::Ones() -
        (by_this * covariance * by_this.transpose() + cross + cross.transpose() +
         by_next * next_covariance * by_next.transpose())
            .diagonal();
  }
  return all;
}

MotionChain::ClockError MotionChain::ClockErrorOf(Triad triad, const double* shared) const {
  const Eigen::Map<const ReferenceVector> reference(shared + layout_.reference);
  const TriadModel<double> model = ModelAt(layout_, triad, shared);
  const GyroModel gyroscope = GyroscopeAt(shared);
  const Eigen::Matrix3d correction = gyroscope.triad.Correction();
  const Eigen::Vector3d world = WorldVector(triad, reference);
  double along = 0.0, squared = 0.0;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const GatheredReadings& seen = nodes_[k].seen(triad);
    if (seen.count == 0) continue;
    const Eigen::Vector3d field = seen.turn * (attitudes_[k].conjugate() * world);
    const Eigen::Vector3d rate = correction * (track_.RateAt(nodes_[k]) - gyroscope.triad.bias);
    const Eigen::Vector3d change = RootWeight(seen) * inverse_sigma_[triad].cwiseProduct(
                                                          model.sensitivity * field.cross(rate));
    along += change.dot(VectorResidual(triad, nodes_[k], model, field));
    squared += change.squaredNorm();
  }
  // A reading that is stamped too late by t shows the field of t earlier: the residual is t times
  // the change.
  if (!(squared > 0.0)) return {};
  return {along / squared, 1.0 / std::sqrt(squared)};
}

}  // namespace truetriad
