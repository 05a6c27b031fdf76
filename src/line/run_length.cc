// SPDX-License-Identifier: Apache-2.0
#include "line/run_length.h"

#include <cmath>
#include <numbers>

#include <Eigen/Core>
#include <glog/logging.h>

#include "math/dense/lu.h"
#include "math/dense/products.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The kernel is a normal density of width λ in an interval of some 6 sqrt(λ / 2): Gauss points for
// which it is at least twice as wide as the distance between them: eight digits of run lengths to
// 10^6.
int EwmaPoints(double lambda) { return 10 + static_cast<int>(14.0 / std::sqrt(lambda)); }
// Relative accuracy of limits; a run length has some 10 times that.
constexpr double kLimitAccuracy = 1e-7;

struct Quadrature {
  VectorXd points, weights;
};

// Gauss and Legendre's on -1...1: Newton's iteration from the usual cosine.
Quadrature GaussLegendre(int count) {
  Quadrature rule{VectorXd(count), VectorXd(count)};
  for (int k = 0; k < count; ++k) {
    double x = std::cos(std::numbers::pi * (k + 0.75) / (count + 0.5));
    double slope = 1.0;
    for (int step = 0; step < 10; ++step) {
      double before = 1.0;
      double value = x;
      for (int degree = 2; degree <= count; ++degree) {
        const double next = ((2 * degree - 1) * x * value - (degree - 1) * before) / degree;
        before = value;
        value = next;
      }
      slope = count * (x * value - before) / (x * x - 1.0);
      x -= value / slope;
    }
    rule.points[k] = x;
    rule.weights[k] = 2.0 / ((1.0 - x * x) * slope * slope);
  }
  return rule;
}

Quadrature Between(double low, double high, const Quadrature& rule) {
  const double half = 0.5 * (high - low);
  return {(low + half + half * rule.points.array()).matrix(), half * rule.weights};
}

// Density at `to` of the EWMA's next value after `from`.
class EwmaKernel {
 public:
  EwmaKernel(double lambda, double shift) : lambda_(lambda), shift_(shift) {}
  double operator()(double from, double to) const {
    const double x = (to - (1.0 - lambda_) * from) / lambda_ - shift_;
    return std::exp(-0.5 * x * x) / (lambda_ * std::sqrt(2.0 * std::numbers::pi));
  }
  double Sigma() const { return std::sqrt(lambda_ / (2.0 - lambda_)); }

 private:
  double lambda_, shift_;
};

// Run length from each point: run = 1 + K W run.
VectorXd RunLengths(const MatrixXd& kernel, const VectorXd& weights) {
  const Index count = weights.size();
  const MatrixXd system = MatrixXd::Identity(count, count) - kernel * weights.asDiagonal();
  return SolveByLu(system, VectorXd::Ones(count));
}

}  // namespace

double EwmaRunLength(double lambda, double width, double shift) {
  CHECK(lambda >= 0.01 && lambda <= 1.0) << "smoothing constant " << lambda;
  const EwmaKernel kernel(lambda, shift);
  const double limit = width * kernel.Sigma();
  const Quadrature grid = Between(-limit, limit, GaussLegendre(EwmaPoints(lambda)));
  const Index count = grid.points.size();
  MatrixXd values(count, count);
  for (Index row = 0; row < count; ++row) {
    for (Index col = 0; col < count; ++col) {
      values(row, col) = kernel(grid.points[row], grid.points[col]);
    }
  }
  const VectorXd run = RunLengths(values, grid.weights);
  double run_length = 1.0;
  for (Index k = 0; k < count; ++k) {
    run_length += grid.weights[k] * kernel(0.0, grid.points[k]) * run[k];
  }
  return run_length;
}

double EwmaWidth(double lambda, double run_length) {
  // At most that of single values: an average has fewer chances to be outside.
  double low = 0.5, high = -NormalQuantile(0.25 / run_length);
  while (high - low > kLimitAccuracy * high) {
    const double middle = 0.5 * (low + high);
    (EwmaRunLength(lambda, middle) < run_length ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace truetriad::line
