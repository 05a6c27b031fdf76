// SPDX-License-Identifier: Apache-2.0
#include "line/robust_core.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "line/baseline.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kCore = 0.75;
// Robust σ at which values are clipped for the start.
constexpr double kClip = 2.0;
constexpr double kLeastSize = 1e-12;
constexpr int kMostCoreSteps = 10;
// The core is found with so many units; more would not make it better.
constexpr Index kMostCoreUnits = 5000;

std::vector<Index> All(Index count) {
  std::vector<Index> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), Index{0});
  return all;
}

// The `count` units with the smallest distances, in their order.
std::vector<Index> Nearest(const VectorXd& distances, Index count) {
  std::vector<Index> order = All(distances.size());
  std::nth_element(order.begin(), order.begin() + count - 1, order.end(), [&](Index a, Index b) {
    return distances[a] < distances[b];
  });
  order.resize(static_cast<std::size_t>(count));
  std::sort(order.begin(), order.end());
  return order;
}

// Some units spread evenly over all.
MatrixXd Sampled(const MatrixXd& values) {
  const Index count = values.cols();
  if (count <= kMostCoreUnits) return values;
  MatrixXd sampled(values.rows(), kMostCoreUnits);
  for (Index k = 0; k < kMostCoreUnits; ++k)
    sampled.col(k) = values.col(k * count / kMostCoreUnits);
  return sampled;
}

MatrixXd Clipped(const MatrixXd& values) { return values.cwiseMax(-kClip).cwiseMin(kClip); }

// What units are far from by a scatter that spoilt units may have drawn towards them: along its own
// axes their spread is found anew, from medians, which they hold against.
VectorXd DistancesAlongAxes(const MatrixXd& values, const MatrixXd& scatter) {
  const MatrixXd along = TransposeTimes(EigenOfSymmetric(scatter).vectors, values);
  VectorXd distances = VectorXd::Zero(values.cols());
  for (Index axis = 0; axis < along.rows(); ++axis) {
    const VectorXd own = along.row(axis).transpose();
    const RobustMoments robust = RobustMomentsOf({own.begin(), own.end()});
    // Half of the units are the same along it.
    if (!(robust.sigma > 0.0)) continue;
    distances += ((own.array() - robust.centre) / robust.sigma).square().matrix();
  }
  return distances;
}

// Distances to start from, of which one at least is not misled: by correlations of clipped values;
// along the axes of these, of the units' directions alone, and of the half nearest to the median.
std::vector<VectorXd> Starts(const MatrixXd& values) {
  const Index count = values.cols();
  const MatrixXd clipped = Clipped(values);
  const CentreAndRoot of_clipped = MomentsOf(clipped, All(count));
  // A unit that is at every median has none.
  const Eigen::RowVectorXd sizes = values.colwise().norm().cwiseMax(kLeastSize);
  const MatrixXd directions = values.array().rowwise() / sizes.array();
  const CentreAndRoot of_half =
      MomentsOf(values, Nearest(values.colwise().squaredNorm().transpose(), (count + 1) / 2));
  const auto along_axes_of = [&values](const CentreAndRoot& moments) {
    const MatrixXd root = moments.root.Root();
    return DistancesAlongAxes(values, TimesTranspose(root, root));
  };
  std::vector<VectorXd> starts = {
      SquaredDistances(values, of_clipped),
      along_axes_of(of_clipped),
      DistancesAlongAxes(values, TimesTranspose(directions, directions))};
  if (of_half.root.is_positive()) starts.push_back(along_axes_of(of_half));
  return starts;
}

// The core that a start leads to.
CentreAndRoot CoreFrom(const MatrixXd& values, const VectorXd& start) {
  const Index count = values.cols();
  const Index core = static_cast<Index>(std::ceil(kCore * static_cast<double>(count)));
  CentreAndRoot about = MomentsOf(values, Nearest(start, (count + 1) / 2));
  std::vector<Index> nearest;
  for (int round = 0; round < kMostCoreSteps && about.root.is_positive(); ++round) {
    std::vector<Index> next = Nearest(SquaredDistances(values, about), core);
    if (next == nearest) break;
    nearest = std::move(next);
    about = MomentsOf(values, nearest);
  }
  return about;
}

}  // namespace

VectorXd SquaredDistances(const MatrixXd& values, const CentreAndRoot& about) {
  return about.root.SolveLower(values.colwise() - about.centre).colwise().squaredNorm().transpose();
}

CentreAndRoot MomentsOf(const MatrixXd& values, const std::vector<Index>& some) {
  MatrixXd selected(values.rows(), static_cast<Index>(some.size()));
  for (std::size_t k = 0; k < some.size(); ++k) {
    selected.col(static_cast<Index>(k)) = values.col(some[k]);
  }
  CentreAndRoot moments;
  moments.count = static_cast<double>(some.size());
  moments.centre = selected.rowwise().mean();
  selected.colwise() -= moments.centre;
  moments.root = Cholesky(TimesTranspose(selected, selected) / (moments.count - 1.0));
  return moments;
}

CentreAndRoot RobustCore(const MatrixXd& all) {
  const MatrixXd values = Sampled(all);
  CentreAndRoot about;
  double least = std::numeric_limits<double>::infinity();
  for (const VectorXd& start : Starts(values)) {
    CentreAndRoot core = CoreFrom(values, start);
    // Units of a start that are the same say nothing of the others.
    const double determinant =
        core.root.is_positive() ? core.root.LogDeterminant() : std::numeric_limits<double>::max();
    if (!(determinant < least)) continue;
    least = determinant;
    about = std::move(core);
  }
  if (!about.root.is_positive()) return about;
  const VectorXd distances = SquaredDistances(values, about);
  const double scale = Median({distances.begin(), distances.end()}) /
                       ChiSquareQuantile(0.5, static_cast<double>(values.rows()));
  const MatrixXd root = std::sqrt(scale) * about.root.Root();
  about.root = Cholesky(TimesTranspose(root, root));
  return about;
}

}  // namespace truetriad::line
