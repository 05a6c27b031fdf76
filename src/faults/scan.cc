// SPDX-License-Identifier: Apache-2.0
#include "faults/scan.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glog/logging.h>

namespace truetriad {
namespace {

// Number of cosines of kWander. The fastest has two periods over the run, so that the cosines
// resolve a quarter of the run.
constexpr int kCosines = 4;
// The fewest poses for kWander, four for each cosine: with fewer, the cosines would fit noise.
constexpr std::size_t kFewestToWander = 4 * kCosines;
// A warm-up decays by a factor of e^6 over the run, as τ goes from -1 to 1.
constexpr double kWarmUpPerTau = 3.0;
// A change needs two poses on each side: a single pose that differs is another kind of fault.
constexpr int kFewestPosesAside = 2;

Eigen::VectorXd Centred(Eigen::VectorXd values, const FaultScene& scene) {
  double sum = 0.0;
  for (Eigen::Index g = 0; g < values.size(); ++g) {
    sum += values[g] * scene.PosesIn(static_cast<std::size_t>(g));
  }
  values.array() -= sum / static_cast<double>(scene.poses());
  return values;
}

// A group at which a function's weight changes, and by how much.
struct Change {
  Eigen::Index at = 0, function = 0;
  double by = 0.0;
};

// Adds half of the sum over all pairs of changes: each pair of two changes once, and half of each
// change with itself. The caller then adds the transpose.
template <int kWide>
void AddPairs(const std::vector<Change>& changes,
              const Eigen::MatrixXd& from,
              Eigen::MatrixXd* to) {
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const Change& a = changes[i];
    for (std::size_t j = 0; j <= i; ++j) {
      const Change& b = changes[j];
      const double factor = (i == j ? 0.5 : 1.0) * a.by * b.by;
      to->block<kWide, kWide>(a.function * kWide, b.function * kWide) +=
          factor * from.block<kWide, kWide>(a.at * kWide, b.at * kWide);
    }
  }
}

}  // namespace

std::vector<std::pair<int, int>> PositionsOf(FaultShape shape,
                                             const FaultScene& scene,
                                             const std::vector<FaultColumn>& columns) {
  if (columns.empty()) return {};
  const int count = static_cast<int>(scene.stretches());
  std::vector<std::pair<int, int>> positions;
  switch (shape) {
    case FaultShape::kStep:
      for (int k = kFewestPosesAside; k < count - 1; ++k) positions.emplace_back(k, count);
      break;
    case FaultShape::kWindow:
      for (int k = 1; k < count - 1; ++k) {
        const int last = std::min(k + count / 2, count - 1);
        for (int l = k + kFewestPosesAside; l <= last; ++l) positions.emplace_back(k, l);
      }
      break;
    case FaultShape::kOnce:
      for (int k = 0; k < count; ++k) {
        if (scene.PosesIn(static_cast<std::size_t>(k)) == 1.0) positions.emplace_back(k, k + 1);
      }
      break;
    default:
      positions.emplace_back(0, count);
  }
  if (!IsScan(shape)) return positions;
  // For each group: the number of earlier groups with readings.
  std::vector<int> seen = {0};
  for (const FaultColumn& column : columns) {
    seen.push_back(seen.back() + (column.blocks.empty() ? 0 : 1));
  }
  const int fewest = shape == FaultShape::kOnce ? 1 : kFewestPosesAside;
  std::erase_if(positions, [&](const std::pair<int, int>& position) {
    const int inside = seen[static_cast<std::size_t>(position.second)] -
                       seen[static_cast<std::size_t>(position.first)];
    return inside < fewest || seen.back() - inside < fewest;
  });
  return positions;
}

StretchWeights WeightsOf(FaultShape shape, std::pair<int, int> position, const FaultScene& scene) {
  const auto count = static_cast<Eigen::Index>(scene.stretches());
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(count);
  switch (shape) {
    case FaultShape::kThroughout:
      return Eigen::VectorXd::Ones(count);
    case FaultShape::kOnce:
      weights[position.first] = 1.0;
      return weights;
    case FaultShape::kStep:
    case FaultShape::kWindow:
      weights.segment(position.first, position.second - position.first).setOnes();
      break;
    case FaultShape::kDrift:
      weights = scene.tau();
      break;
    case FaultShape::kWarmUp:
      weights = (-kWarmUpPerTau * (scene.tau().array() + 1.0)).exp();
      break;
    case FaultShape::kTemperature: {
      if (!scene.temperature()) return {};
      const Eigen::VectorXd& degc = *scene.temperature();
      weights = 2.0 / (degc.maxCoeff() - degc.minCoeff()) * degc;
      break;
    }
    case FaultShape::kWander: {
      if (scene.poses() < kFewestToWander) return {};
      StretchWeights cosines(count, kCosines);
      for (int j = 1; j <= kCosines; ++j) {
        const Eigen::ArrayXd phase = 0.5 * std::numbers::pi * j * (scene.tau().array() + 1.0);
        cosines.col(j - 1) = Centred(phase.cos(), scene);
      }
      return cosines;
    }
  }
  return Centred(std::move(weights), scene);
}

ScannedForm::ScannedForm(std::vector<FaultColumn> stretches, bool is_whole)
    : columns_(std::move(stretches)) {
  if (!is_whole || columns_.empty()) return;
  const auto count = static_cast<Eigen::Index>(columns_.size());
  columns_ = {Column(StretchWeights::Ones(count, 1))};
  is_whole_ = true;
}

void ScannedForm::Project(const FaultSystem& system) {
  const auto count = static_cast<Eigen::Index>(columns_.size());
  const Eigen::Index wide = unknowns();
  squares_.resize(wide, count);
  suffix_gradient_.resize(wide, count);
  suffix_information_ = system.InformationOf(columns_);
  for (Eigen::Index h = 0; h < count; ++h) {
    const FaultColumn& column = columns_[static_cast<std::size_t>(h)];
    squares_.col(h) = system.Squares(column);
    suffix_gradient_.col(h) = column.TransposedVector(system.q());
  }
  for (Eigen::Index g = count - 2; g >= 0; --g) {
    suffix_gradient_.col(g) += suffix_gradient_.col(g + 1);
    suffix_information_.middleRows(g * wide, wide) +=
        suffix_information_.middleRows((g + 1) * wide, wide);
  }
  for (Eigen::Index g = count - 2; g >= 0; --g) {
    suffix_information_.middleCols(g * wide, wide) +=
        suffix_information_.middleCols((g + 1) * wide, wide);
  }
}

ColumnSums ScannedForm::SumsOf(const StretchWeights& asked) const {
  const StretchWeights whole = StretchWeights::Ones(is_whole_ ? 1 : 0, 1);
  const StretchWeights& weights = is_whole_ ? whole : asked;
  const Eigen::Index wide = unknowns(), functions = weights.cols(), count = weights.rows();
  std::vector<Change> changes;
  changes.reserve(static_cast<std::size_t>(functions) * (functions > 1 ? count : 3));
  ColumnSums sums;
  sums.information = Eigen::MatrixXd::Zero(wide * functions, wide * functions);
  sums.gradient = Eigen::VectorXd::Zero(wide * functions);
  sums.squares = Eigen::VectorXd::Zero(wide * functions);
  for (Eigen::Index f = 0; f < functions; ++f) {
    sums.squares.segment(f * wide, wide).noalias() =
        squares_ * Eigen::VectorXd(weights.col(f).cwiseAbs2());
    double before = 0.0;
    for (Eigen::Index g = 0; g < count; ++g) {
      const double weight = weights(g, f), by = weight - before;
      if (by == 0.0) continue;
      changes.push_back({g, f, by});
      sums.gradient.segment(f * wide, wide) += by * suffix_gradient_.col(g);
      before = weight;
    }
  }
  if (wide == 3) {
    AddPairs<3>(changes, suffix_information_, &sums.information);
  } else if (wide == 1) {
    AddPairs<1>(changes, suffix_information_, &sums.information);
  } else {
    CHECK_EQ(wide, 9);
    AddPairs<9>(changes, suffix_information_, &sums.information);
  }
  sums.information += sums.information.transpose().eval();
  return sums;
}

FaultColumn ScannedForm::Column(const StretchWeights& asked) const {
  const StretchWeights weights = is_whole_ ? StretchWeights::Ones(1, 1) : asked;
  FaultColumn column;
  const Eigen::Index wide = unknowns(), functions = weights.cols();
  for (std::size_t g = 0; g < columns_.size(); ++g) {
    for (const FaultColumn::Block& block : columns_[g].blocks) {
      Eigen::MatrixXd value(3, wide * functions);
      for (Eigen::Index f = 0; f < functions; ++f) {
        value.middleCols(f * wide, wide) = weights(static_cast<Eigen::Index>(g), f) * block.value;
      }
      column.Add(block.row, value);
    }
  }
  column.unknowns = wide * functions;
  column.is_noisy = columns_.front().is_noisy;
  return column;
}

}  // namespace truetriad
