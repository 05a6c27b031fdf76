// SPDX-License-Identifier: Apache-2.0
#include "faults/log_tail.h"

#include <cmath>

namespace truetriad {
namespace {

// The most terms of a fraction. About sqrt(max(a, b)) are needed (Press et al. 2007, 6.4): 224 at
// 5e4.
constexpr int kMostTerms = 2000;
// A fraction ends at this relative accuracy, 45 epsilon of a double.
constexpr double kEnough = 1e-14;
// Replaces zero in a continued fraction (Lentz 1976).
constexpr double kTiny = 1e-300;
// If dof2 is larger, F is replaced by χ²: log p differs by less than value^2 / (4 dof2), which is
// 0.01 at a χ² of 60.
constexpr double kAsGoodAsKnown = 1e5;

double NotZero(double value) { return std::abs(value) < kTiny ? kTiny : value; }

// Lentz's method for b0 + a1/(b1 + a2/(b2 + …)); a step returns the factor of its term.
struct Lentz {
  double c = 1.0;
  double d = 0.0;
  double Step(double a, double b) {
    d = 1.0 / NotZero(b + a * d);
    c = NotZero(b + a / c);
    return c * d;
  }
};

// log Q(a, x), the upper incomplete gamma function over Γ(a). Press et al. 2007, 6.2.
double LogGammaUpper(double a, double x) {
  const double front = a * std::log(x) - x - std::lgamma(a);
  if (x < a + 1.0) {
    double term = 1.0 / a, sum = term;
    for (int n = 1; n < kMostTerms && term > kEnough * sum; ++n) {
      term *= x / (a + n);
      sum += term;
    }
    return std::log1p(-std::exp(front + std::log(sum)));
  }
  double b = x + 1.0 - a;
  Lentz fraction{1.0 / kTiny, 1.0 / NotZero(b)};
  double h = fraction.d;
  for (int n = 1; n < kMostTerms; ++n) {
    b += 2.0;
    const double factor = fraction.Step(-n * (n - a), b);
    h *= factor;
    if (std::abs(factor - 1.0) < kEnough) break;
  }
  return front + std::log(h);
}

// log I_x(a, b), the regularised incomplete beta function, for x below its mean. Press et al. 6.4.
double LogBetaBelow(double a, double b, double x) {
  const double front = a * std::log(x) + b * std::log1p(-x) + std::lgamma(a + b) - std::lgamma(a) -
                       std::lgamma(b) - std::log(a);
  Lentz fraction{1.0, 1.0 / NotZero(1.0 - (a + b) * x / (a + 1.0))};
  double h = fraction.d;
  for (int m = 1; m < kMostTerms; ++m) {
    const double twice = a + 2.0 * m;
    h *= fraction.Step(m * (b - m) * x / ((twice - 1.0) * twice), 1.0);
    const double factor = fraction.Step(-(a + m) * (a + b + m) * x / (twice * (twice + 1.0)), 1.0);
    h *= factor;
    if (std::abs(factor - 1.0) < kEnough) break;
  }
  return front + std::log(h);
}

}  // namespace

double LogChiSquareUpper(double value, double dof) {
  if (!(value > 0.0)) return 0.0;
  return LogGammaUpper(0.5 * dof, 0.5 * value);
}

// P(F > f) = I_x(dof2/2, dof1/2) at x = dof2 / (dof2 + dof1 f).
double LogFisherUpper(double value, double dof1, double dof2) {
  if (!(value > 0.0)) return 0.0;
  if (dof2 > kAsGoodAsKnown) return LogChiSquareUpper(dof1 * value, dof1);
  const double a = 0.5 * dof2, b = 0.5 * dof1;
  const double x = dof2 / (dof2 + dof1 * value);
  if (x < (a + 1.0) / (a + b + 2.0)) return LogBetaBelow(a, b, x);
  return std::log1p(-std::exp(LogBetaBelow(b, a, dof1 * value / (dof2 + dof1 * value))));
}

}  // namespace truetriad
