// SPDX-License-Identifier: Apache-2.0
#include "line/run_length.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

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
// Final limits are taken as reached once the variance is within this share of its final value.
constexpr double kSettled = 1e-4;
// Relative accuracy of limits; a run length has some 10 times that.
constexpr double kLimitAccuracy = 1e-6;

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

struct EwmaChain {
  EwmaKernel kernel;
  Quadrature rule;  // on -1...1
  Quadrature grid;  // between the final limits
  VectorXd run;     // from its points

  double RunFrom(double start) const {
    double run_length = 1.0;
    for (Index k = 0; k < run.size(); ++k) {
      run_length += grid.weights[k] * kernel(start, grid.points[k]) * run[k];
    }
    return run_length;
  }
};

void CheckLambda(double lambda) {
  CHECK(lambda >= 0.01 && lambda <= 1.0) << "smoothing constant " << lambda;
}

EwmaChain ChainOf(double lambda, double width, double shift) {
  const EwmaKernel kernel(lambda, shift);
  const double limit = width * kernel.Sigma();
  EwmaChain chain{kernel, GaussLegendre(EwmaPoints(lambda)), {}, {}};
  chain.grid = Between(-limit, limit, chain.rule);
  const Index count = chain.grid.points.size();
  MatrixXd values(count, count);
  for (Index row = 0; row < count; ++row) {
    for (Index col = 0; col < count; ++col) {
      values(row, col) = kernel(chain.grid.points[row], chain.grid.points[col]);
    }
  }
  chain.run = RunLengths(values, chain.grid.weights);
  return chain;
}

// x with f(x) = wanted of a growing f whose logarithm is nearly straight; the end of low...high
// that is nearer where there is none between.
double Inverse(const std::function<double(double)>& f, double wanted, double low, double high) {
  const double target = std::log(wanted);
  double low_error = std::log(f(low)) - target;
  double high_error = std::log(f(high)) - target;
  if (low_error >= 0.0) return low;
  if (high_error <= 0.0) return high;
  while (high - low > kLimitAccuracy * high) {
    // False position, with the Illinois rule against an end that never moves.
    const double middle = (low * high_error - high * low_error) / (high_error - low_error);
    const double error = std::log(f(middle)) - target;
    if (std::abs(error) < kLimitAccuracy) return middle;
    if (error < 0.0) {
      low = middle;
      low_error = error;
      high_error *= 0.5;
    } else {
      high = middle;
      high_error = error;
      low_error *= 0.5;
    }
  }
  return 0.5 * (low + high);
}

}  // namespace

double EwmaRunLengthFixedLimits(double lambda, double width, double shift) {
  CheckLambda(lambda);
  return ChainOf(lambda, width, shift).RunFrom(0.0);
}

double EwmaRunLength(double lambda, double width, double shift) {
  CheckLambda(lambda);
  const EwmaChain chain = ChainOf(lambda, width, shift);
  // Density of z_i over those lines that are without an alarm until then.
  Quadrature grid{VectorXd::Zero(1), VectorXd::Ones(1)};
  VectorXd mass = VectorXd::Ones(1);
  double run_length = 0.0;
  for (double decay = 1.0; decay > kSettled;) {
    run_length += mass.sum();  // those that take another point
    decay *= (1.0 - lambda) * (1.0 - lambda);
    const double limit = width * chain.kernel.Sigma() * std::sqrt(1.0 - decay);
    const Quadrature next = Between(-limit, limit, chain.rule);
    VectorXd next_mass = VectorXd::Zero(next.points.size());
    for (Index to = 0; to < next_mass.size(); ++to) {
      for (Index from = 0; from < mass.size(); ++from) {
        next_mass[to] += mass[from] * chain.kernel(grid.points[from], next.points[to]);
      }
    }
    mass = next_mass.cwiseProduct(next.weights);
    grid = next;
  }
  for (Index k = 0; k < mass.size(); ++k) run_length += mass[k] * chain.RunFrom(grid.points[k]);
  return run_length;
}

double EwmaWidth(double lambda, double run_length) {
  // At most that of single values: an average has fewer chances to be outside.
  const auto run = [&](double width) { return EwmaRunLength(lambda, width); };
  const double high = -NormalQuantile(0.25 / run_length);
  return Inverse(run, run_length, 0.5, high);
}

}  // namespace truetriad::line
