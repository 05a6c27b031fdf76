// SPDX-License-Identifier: Apache-2.0
//
// How often `model: auto` chooses what a unit is like, and whether the likelihood ratio's p is the
// probability that it says. Prints the rows of a table in docs/tables/accuracy.md.

#include <algorithm>
#include <cstdio>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/accel_mag_trials.h"
#include "support/kolmogorov_smirnov.h"
#include "support/nightly.h"

namespace truetriad {
namespace model_choice_montecarlo_test {

using trials::JointOptions;
using trials::ModelNoise;
using trials::RandomUnit;
using trials::UnitSpread;

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kMag = Triad::kMagnetometer;

struct Case {
  const char* name;
  const char* row;
  UnitSpread spread = {};
  const char* chosen;      // what the unit is like
  const char* term;        // a term that it does not have, as the table of the choice names it …
  const char* other_term;  // … and as it does where it was chosen nevertheless
  double excess_mps2 = 0.0;
  double quadratic = 0.0;  // per m/s^2
};
void PrintTo(const Case& tested, std::ostream* out) { *out << tested.name; }

const std::vector<Case> kCases = {
    {"Full",
     "full matrices",
     {},
     "accelerometer full; magnetometer full",
     "accelerometer with quadratic term",
     "accelerometer without quadratic term"},
    {"FullWithExcess",
     "the same, excess 0.006 m/s² and 0.1 µT, estimated",
     {},
     "accelerometer full; magnetometer full",
     "accelerometer with quadratic term",
     "accelerometer without quadratic term",
     0.006},
    {"Diagonal",
     "gains alone",
     {.cross_axis = 0.0},
     "accelerometer diagonal; magnetometer diagonal",
     "magnetometer symmetric",
     "magnetometer diagonal"},
    {"Nominal",
     "nothing but biases",
     {.gain_low = 1.0, .gain_high = 1.0, .cross_axis = 0.0},
     "accelerometer bias; magnetometer bias",
     "accelerometer diagonal",
     "accelerometer bias"},
    // σ of a quadratic term is some 600 µg/g² here.
    {"Quadratic",
     "quadratic terms of 3600 µg/g², some 6 σ",
     {},
     "accelerometer full, quadratic term; magnetometer full",
     nullptr,
     nullptr,
     0.0,
     3.6e-4},
};

struct Trial {
  PoseSet poses;
  CalibrateOptions options;
};

Trial MakeTrial(const Case& tested, Random* random) {
  SyntheticUnit unit = RandomUnit(tested.spread, random);
  for (int axis = 0; axis < 3; ++axis) {
    unit.models[kAccel]->axis_terms[AxisTerm::kQuadratic][axis] =
        random->Uniform() < 0.5 ? -tested.quadratic : tested.quadratic;
  }
  SyntheticNoise noise = ModelNoise();
  noise.excess_sigma[kAccel] = tested.excess_mps2;
  noise.excess_sigma[kMag] = tested.excess_mps2 * 0.1 / 0.006;
  Trial trial;
  trial.poses = SimulatePoses(unit, RandomAttitudes(24, random), noise, random);
  trial.options = JointOptions(unit);
  trial.options.cross_validation_folds = 5;
  for (const Triad triad : {kAccel, kMag}) {
    TriadOptions& sensor = trial.options.triads[triad];
    sensor.model = MatrixModel::kAuto;
    sensor.nominal_sensitivity = Eigen::Matrix3d::Identity();
    sensor.excess = tested.excess_mps2 > 0.0 ? ExcessNoise::kEstimate : ExcessNoise::kNone;
  }
  trial.options.triads[kAccel].axis_terms[AxisTerm::kQuadratic] = Wanted::kAuto;
  return trial;
}

std::optional<double> PValueOf(const Quality& quality, const Case& tested) {
  for (const ModelAlternative& model : quality.rests.model_choice) {
    if (tested.term == nullptr || model.chosen) continue;
    if (model.description == tested.term || model.description == tested.other_term) {
      return model.p_value;
    }
  }
  return std::nullopt;
}

class ModelChoice : public ::testing::TestWithParam<Case> {};

TEST_P(ModelChoice, IsWhatTheUnitIsLike) {
  const Case& tested = GetParam();
  // A thousand leave a KS p of 0.0004 to chance: docs/tables/accuracy.md.
  const int runs = IsNightly() ? 5000 : 100;
  int right = 0;
  int below_level = 0;
  std::vector<double> p_values;
  for (int run = 0; run < runs; ++run) {
    Random random(90'000 + static_cast<std::uint64_t>(run));
    const Trial trial = MakeTrial(tested, &random);
    const auto summary = Calibrate(trial.poses, trial.options);
    ASSERT_TRUE(summary) << summary.error().message;
    const Quality& quality = summary->calibration.quality;
    ASSERT_TRUE(summary->calibration.IsUsable()) << "run " << run;
    ASSERT_FALSE(quality.rests.model_choice.empty());
    if (quality.rests.model_choice.front().description == tested.chosen) ++right;
    if (const std::optional<double> p = PValueOf(quality, tested)) {
      p_values.push_back(*p);
      if (*p < 0.05) ++below_level;
    }
  }
  const double share = static_cast<double>(right) / runs;
  std::printf("@choice | %s | %d | %.1f %% | ", tested.row, runs, 100.0 * share);
  EXPECT_GE(share, 0.95);
  if (tested.term == nullptr) {
    std::printf("– | – |\n");
    return;
  }
  ASSERT_GE(p_values.size(), 0.97 * runs);
  const double n = static_cast<double>(p_values.size());
  const double size = below_level / n;
  // Five per cent of true hypotheses have p < 5 %: within the 99.9 % interval of a binomial.
  const double margin = 3.29 * std::sqrt(0.05 * 0.95 / n);
  const double ks = KolmogorovSmirnovUniform(p_values).p_value;
  std::printf("%.1f %% (5.0 ± %.1f %%) | %.3f |\n", 100.0 * size, 100.0 * margin, ks);
  EXPECT_NEAR(size, 0.05, margin);
  EXPECT_GT(ks, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Of, ModelChoice, ::testing::ValuesIn(kCases), [](const auto& test) {
  return std::string(test.param.name);
});

}  // namespace model_choice_montecarlo_test
}  // namespace truetriad
