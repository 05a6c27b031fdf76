// SPDX-License-Identifier: Apache-2.0
#include "line/type1_study.h"

#include <cmath>

#include "line/spread.h"
#include "math/distributions.h"

namespace truetriad::line {

Type1Study FindType1Study(const Eigen::VectorXd& values,
                          double reference,
                          double tolerance,
                          double confidence) {
  Type1Study study;
  study.runs = values.size();
  study.reference = reference;
  if (study.runs == 0) return study;
  study.mean = values.mean();
  if (study.runs < 2) return study;
  const Spread spread = OverallSpread(values);
  const double sigma = spread.ProcessSigma();
  study.sigma = {sigma, spread.ProcessSigmaInterval(confidence)};
  study.cg = 0.2 * tolerance / (6.0 * sigma);
  study.repeatability_share = 6.0 * sigma / tolerance;
  const double bias = study.mean - reference;
  if (std::isnan(bias)) return study;
  const double bias_sigma = sigma / std::sqrt(static_cast<double>(study.runs));
  const double doubt = StudentQuantile(0.5 * (1.0 + confidence), spread.dof) * bias_sigma;
  study.bias = {bias, {bias - doubt, bias + doubt}};
  study.bias_t = bias / bias_sigma;
  if (!std::isnan(study.bias_t)) {
    study.bias_p = FisherUpper(study.bias_t * study.bias_t, 1.0, spread.dof);
  }
  study.cgk = (0.1 * tolerance - std::abs(bias)) / (3.0 * sigma);
  return study;
}

}  // namespace truetriad::line
