// SPDX-License-Identifier: Apache-2.0
//
// Temperature terms against known truth: efficiency and consistency of the joint solution at
// several chamber temperatures, and whether σ that were planned for it come true.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "model/attitude_sets.h"
#include "support/kolmogorov_smirnov.h"
#include "support/nightly.h"
#include "support/soak_trials.h"
#include "truetriad/planning/plan.h"

namespace truetriad {
namespace soak_montecarlo_test {

using trials::MakeSoak;
using trials::Soak;

ThermalOptions CubicAndLinear() {
  ThermalOptions terms;
  terms.bias_order = 3;
  terms.matrix_order = 1;
  return terms;
}

// Mean over parameters of (error / σ)^2, and its standard error in one run: with R the correlation
// of the p parameters, sqrt(2 tr(R^2)) / p.
struct Pooled {
  double mean_square = 0.0;
  double standard_error = 0.0;
};

Pooled Pool(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
  Pooled pooled;
  int parameters = 0;
  double squares = 0.0;
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    if (!(covariance(i, i) > 0.0)) continue;
    ++parameters;
    pooled.mean_square += error[i] * error[i] / covariance(i, i);
    for (Eigen::Index j = 0; j < error.size(); ++j) {
      if (!(covariance(j, j) > 0.0)) continue;
      squares += covariance(i, j) * covariance(i, j) / (covariance(i, i) * covariance(j, j));
    }
  }
  pooled.mean_square /= parameters;
  pooled.standard_error = std::sqrt(2.0 * squares) / parameters;
  return pooled;
}

// As the regimes of regimes_test.cc are judged. By chance drift is found in one of a hundred units
// for each sensor, and a fault in one of a hundred units; σ are widened by it. What units scatter
// by is independent of their errors, so that the others are as they would be without findings. The
// efficiency counts all.
void ExpectEfficientAndConsistent(const char* row, bool joint, std::uint64_t seed) {
  const int runs = IsNightly() ? 1000 : 150;
  // Of each parameter's error over its bound, summed over the runs: all, and those without
  // findings.
  Eigen::VectorXd squares_of_all, squares;
  std::vector<std::string> names;
  double nees = 0.0;
  int dimension = 0, drifts = 0, faults = 0;
  std::vector<double> p_values;
  for (int run = 0; run < runs; ++run) {
    Random random(seed + static_cast<std::uint64_t>(run));
    const Soak soak = MakeSoak(CubicAndLinear(), 12, joint, &random);
    const auto summary = Calibrate(
        trials::PosesOf(soak, trials::ModelNoise(), trials::ModelNoise(), &random), soak.options);
    ASSERT_TRUE(summary && summary->calibration.IsUsable()) << "run " << run;
    CalibrateOptions known = soak.options;
    known.robust.enabled = false;
    const auto bound = Calibrate(trials::ExactSoakPoses(soak), known);
    ASSERT_TRUE(bound && bound->calibration.IsUsable()) << "run " << run;
    const Eigen::VectorXd error = trials::SoakErrors(summary->calibration, soak);
    const NamedCovariance& covariance = bound->calibration.covariance;
    names = covariance.parameters;
    if (squares.size() == 0) squares = squares_of_all = Eigen::VectorXd::Zero(error.size());
    const Eigen::VectorXd variances = covariance.matrix.diagonal();
    const Eigen::VectorXd ratios =
        (variances.array() > 0.0).select(error.array().square() / variances.array(), 0.0);
    squares_of_all += ratios;
    const Findings& findings = summary->calibration.findings;
    const auto found = std::count_if(findings.begin(), findings.end(), [](const Finding& finding) {
      return finding.code == FindingCode::kBiasDrift;
    });
    const bool has_fault = Find(findings, FindingCode::kFault) != nullptr;
    drifts += static_cast<int>(found);
    faults += has_fault ? 1 : 0;
    if (found > 0 || has_fault) continue;
    squares += ratios;
    const double squared = trials::Nees(error, summary->calibration.covariance.matrix, &dimension);
    p_values.push_back(ChiSquareCdf(squared, dimension));
    nees += squared / dimension;
  }
  nees /= static_cast<double>(p_values.size());
  const double tests = runs * (joint ? 2.0 : 1.0);
  EXPECT_NEAR(drifts, 0.01 * tests, 3.29 * std::sqrt(0.01 * 0.99 * tests));  // 99.9 %
  EXPECT_LE(faults, 0.01 * runs + 3.29 * std::sqrt(0.01 * 0.99 * runs));     // 99.9 %
  // The mean square of one parameter, over its bound, is χ²(n) / n in n runs.
  const auto as_stated = static_cast<double>(p_values.size());
  const double low = ChiSquareQuantile(0.0005, as_stated) / as_stated;
  const double high = ChiSquareQuantile(0.9995, as_stated) / as_stated;
  double sum = 0.0;
  int count = 0;
  std::string worst;
  double worst_ratio = 1.0;
  for (Eigen::Index i = 0; i < squares.size(); ++i) {
    const double ratio = squares[i] / as_stated;
    if (!(ratio > 0.0)) continue;  // fixed by the gauge
    const std::string& name = names[static_cast<std::size_t>(i)];
    EXPECT_GE(ratio, low) << name;
    EXPECT_LE(ratio, high) << name;
    if (worst.empty() || std::abs(std::log(ratio)) > std::abs(std::log(worst_ratio))) {
      worst = name;
      worst_ratio = ratio;
    }
    sum += squares_of_all[i] / runs;
    ++count;
  }
  const double efficiency = std::sqrt(sum / count);
  const double nees_margin = 2.576 * std::sqrt(2.0 / (dimension * runs));  // 99 %
  const double ks = KolmogorovSmirnovUniform(p_values).p_value;
  std::printf("@regimes | %s | %d | %.3f | %.3f | 1.000 ± %.3f | %.3f | %s %.3f (%.3f – %.3f) |\n",
              row,
              runs,
              efficiency,
              nees,
              nees_margin,
              ks,
              worst.c_str(),
              std::sqrt(worst_ratio),
              std::sqrt(low),
              std::sqrt(high));
  EXPECT_LE(efficiency, IsNightly() ? 1.03 : 1.05);
  EXPECT_NEAR(nees, 1.0, nees_margin);
  EXPECT_GE(ks, 1e-3);
}

TEST(Soak, ReachesTheBoundAndStatesItsErrors) {
  ExpectEfficientAndConsistent("joint at five temperatures, bias τ³, matrix τ", true, 50'000);
}

TEST(Soak, ReachesTheBoundAndStatesItsErrorsForAnAccelerometerAlone) {
  ExpectEfficientAndConsistent(
      "accelerometer alone at five temperatures, bias τ³, matrix τ", false, 60'000);
}

// A unit that is nominal at the reference and drifts by a few per cent from there.
TEST(PlannedSigma, OverTemperatureAgreesWithTheErrors) {
  Random drawn(70'000);
  Soak soak = MakeSoak(CubicAndLinear(), 1, true, &drawn);
  PlanOptions options;
  for (const Triad triad : trials::kStaticTriads) {
    soak.unit.models[triad] = TriadModel<double>();
    soak.options.triads[triad].noise_sigma_raw =
        Eigen::Vector3d::Constant(trials::ModelNoise().rest_sigma[triad]);
  }
  options.calibrate = soak.options;
  options.nominal_dip_rad = soak.unit.dip_rad;
  options.criterion = PlanCriterion::kDeterminant;
  options.grid.attitudes = HandAttitudes();
  options.grid.temperatures_degc.assign(trials::kSoakDegc.begin(), trials::kSoakDegc.end());
  options.poses = 36;
  const auto plan = MakePlan({}, options);
  ASSERT_TRUE(plan && plan->IsMet());
  soak.attitudes.clear();
  soak.temperatures_degc.clear();
  for (const ProgramPose& pose : plan->program.poses) {
    soak.attitudes.push_back(pose.world_from_body);
    soak.temperatures_degc.push_back(*pose.temperature_degc);
  }
  soak.rates_degcps.assign(soak.attitudes.size(), 0.0);
  const int runs = IsNightly() ? 2000 : 400;
  double mean_square = 0.0;
  double standard_error = 0.0;
  for (int run = 0; run < runs; ++run) {
    Random random(80'000 + static_cast<std::uint64_t>(run));
    const auto summary = Calibrate(
        trials::PosesOf(soak, trials::ModelNoise(), trials::ModelNoise(), &random), soak.options);
    ASSERT_TRUE(summary && summary->calibration.IsUsable()) << "run " << run;
    ASSERT_EQ(summary->calibration.covariance.parameters, plan->covariance.parameters);
    const Pooled pooled =
        Pool(trials::SoakErrors(summary->calibration, soak), plan->covariance.matrix);
    mean_square += pooled.mean_square / runs;
    standard_error = 0.5 * pooled.standard_error / std::sqrt(runs);
  }
  std::printf("@planned | 36 poses over five temperatures | %d | %.3f ± %.3f |\n",
              runs,
              std::sqrt(mean_square),
              standard_error);
  EXPECT_LT(4.0 * standard_error, 0.05);
  EXPECT_NEAR(std::sqrt(mean_square), 1.0, 0.05);
}

// Every pose of one temperature off by the same.
void AddWander(double sigma, int attitudes_each, PoseSet* poses, Random* random) {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < poses->poses.size(); ++k) {
    if (k % static_cast<std::size_t>(attitudes_each) == 0) offset = sigma * random->Normal3();
    poses->poses[k].triads[Triad::kAccelerometer]->mean_raw += offset;
  }
}

// A bias that wanders from one temperature to the next by many times the noise of its poses is
// counted in the σ of the bias and of its terms.
TEST(Soak, CountsABiasThatWandersBetweenTemperatures) {
  const int runs = IsNightly() ? 1000 : 150;
  int inside = 0;
  int count = 0;
  for (int run = 0; run < runs; ++run) {
    Random random(110'000 + static_cast<std::uint64_t>(run));
    ThermalOptions terms;
    terms.bias_order = 1;
    Soak soak = MakeSoak(terms, 12, false, &random);
    soak.options.triads[Triad::kAccelerometer].excess = ExcessNoise::kEstimate;
    PoseSet poses = trials::PosesOf(soak, trials::ModelNoise(), trials::ModelNoise(), &random);
    AddWander(0.01, 12, &poses, &random);
    const auto summary = Calibrate(poses, soak.options);
    ASSERT_TRUE(summary && summary->calibration.IsUsable()) << "run " << run;
    const Calibration& calibration = summary->calibration;
    const double factor = StudentQuantile(0.975, calibration.quality.effective_dof);
    const Eigen::VectorXd error = trials::SoakErrors(calibration, soak);
    for (Eigen::Index i = 0; i < error.size(); ++i) {
      const double sigma = std::sqrt(calibration.covariance.matrix(i, i));
      // The drift hardly moves the sensitivity, whose σ are known better than its are.
      const std::string& name = calibration.covariance.parameters[static_cast<std::size_t>(i)];
      if (name.find("bias") == std::string::npos) continue;
      ++count;
      if (std::abs(error[i]) <= factor * sigma) ++inside;
    }
  }
  const double share = static_cast<double>(inside) / count;
  // The parameters of a run are correlated: as if a third of them were independent. 99.9 %.
  const double margin = 3.29 * std::sqrt(0.05 * 0.95 / (count / 3.0));
  std::printf(
      "@drift | bias τ, wandering by 10 mm/s² between temperatures | %d | %.1f %% (95.0 ± "
      "%.1f %%) |\n",
      runs,
      100.0 * share,
      100.0 * margin);
  EXPECT_NEAR(share, 0.95, margin);
}

// What a unit is like in temperature, with all terms open.
struct Drift {
  const char* name;
  const char* row;
  int bias_order, matrix_order;
  double wander = 0.0;  // of the bias from one temperature to the next, m/s^2
};

constexpr Drift kDrifts[] = {
    {"Nothing", "nothing", 0, 0},
    {"Linear", "bias τ", 1, 0},
    // Three times the noise of a pose; what the poses of one temperature share has no excess.
    {"LinearAndWandering", "bias τ, wandering by 10 mm/s² between temperatures", 1, 0, 0.01},
    {"LinearWithMatrix", "bias τ, matrix τ", 1, 1},
    {"LinearWithMatrixAndWandering",
     "bias τ, matrix τ, wandering by 10 mm/s² between temperatures",
     1,
     1,
     0.01},
    {"Cubic", "bias τ³, matrix τ", 3, 1},
};

class SoakChoice : public ::testing::TestWithParam<Drift> {};

TEST_P(SoakChoice, IsWhatTheUnitIsLike) {
  constexpr Triad kAccel = Triad::kAccelerometer;
  const Drift& drift = GetParam();
  const int runs = IsNightly() ? 1000 : 60;
  int right = 0;
  int larger = 0;
  for (int run = 0; run < runs; ++run) {
    Random random(100'000 + static_cast<std::uint64_t>(run));
    ThermalOptions terms;
    terms.bias_order = drift.bias_order;
    terms.matrix_order = drift.matrix_order;
    Soak soak = MakeSoak(terms, 12, false, &random);
    PoseSet poses = trials::PosesOf(soak, trials::ModelNoise(), trials::ModelNoise(), &random);
    AddWander(drift.wander, 12, &poses, &random);
    ThermalOptions& open = soak.options.triads[kAccel].thermal;
    open.bias_order = ThermalOptions::kMaxBiasOrder;
    open.matrix_order = ThermalOptions::kMaxMatrixOrder;
    open.bias_order_auto = open.matrix_order_auto = open.matrix_auto = true;
    soak.options.triads[kAccel].excess = ExcessNoise::kEstimate;
    soak.options.cross_validation_folds = 5;
    const auto summary = Calibrate(poses, soak.options);
    ASSERT_TRUE(summary && summary->calibration.IsUsable()) << "run " << run;
    const ThermalOptions& chosen = summary->options.triads[kAccel].thermal;
    if (chosen.bias_order == drift.bias_order && chosen.matrix_order == drift.matrix_order) ++right;
    if (chosen.bias_order > drift.bias_order || chosen.matrix_order > drift.matrix_order) ++larger;
  }
  std::printf("@soak_choice | %s | %d | %.1f %% | %.1f %% |\n",
              drift.row,
              runs,
              100.0 * right / runs,
              100.0 * larger / runs);
  EXPECT_GE(right, 0.95 * runs);
}

INSTANTIATE_TEST_SUITE_P(Of, SoakChoice, ::testing::ValuesIn(kDrifts), [](const auto& test) {
  return std::string(test.param.name);
});

}  // namespace soak_montecarlo_test
}  // namespace truetriad
