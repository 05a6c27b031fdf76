// SPDX-License-Identifier: Apache-2.0
//
// Clean units of the shipped scenarios by the shipped experiments with default settings: none is
// refused, the σ stated for one unit are those of the others, and they are true.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/nightly.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/config/experiment.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/session/session.h"
#include "truetriad/sim/scenario.h"
#include "trust/recording.h"

namespace truetriad::trust {
namespace fleet_test {

namespace fs = std::filesystem;

constexpr int kNightlyUnits = 300;
constexpr int kDailyUnits = 12;
constexpr double kAllowedSigmas = 5.0;
constexpr double kMostOddShare = 0.005;
// Two-sided 99 % limit of a mean, in standard errors.
constexpr double kStandardErrors = 2.58;

struct Fleet {
  std::string scenario, experiment;
  std::vector<std::string> overrides;
  // The least NEES over its dimension: σ may be too wide by its square root. An excess of poses
  // that is really zero cannot be estimated as negative, and the accelerations of a hand are taken
  // to be correlated.
  double least_nees = 0.75;
};

std::ostream& operator<<(std::ostream& out, const Fleet& fleet) {
  return out << fleet.scenario << " by " << fleet.experiment;
}

std::string ConfigPath(const std::string& folder, const std::string& name) {
  return TRUETRIAD_SOURCE_DIR "/configs/" + folder + "/" + name + ".yaml";
}

// σ of each gain, with one entry per unit.
class SigmasOfGains {
 public:
  void Add(const Calibration& found) {
    for (const Triad triad : kTriads) {
      if (!found.sensors[triad]) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto at = static_cast<Eigen::Index>(axis);
        sigmas_[triad][axis].push_back(found.sensors[triad]->sensitivity_sigma(at, at));
      }
    }
  }
  // The number of units whose σ is not within a factor of two of the median, for the worst gain.
  int MostOdd() const {
    int most = 0;
    for (const Triad triad : kTriads) {
      for (std::vector<double> all : sigmas_[triad]) {
        if (all.empty()) continue;
        std::sort(all.begin(), all.end());
        const double median = all[all.size() / 2];
        most = std::max(most, static_cast<int>(std::ranges::count_if(all, [median](double sigma) {
                          return !(sigma > 0.5 * median && sigma < 2.0 * median);
                        })));
      }
    }
    return most;
  }

 private:
  PerTriad<std::array<std::vector<double>, 3>> sigmas_;
};

class CleanUnits : public testing::TestWithParam<Fleet> {
 protected:
  void TearDown() override { fs::remove_all(folder_); }

  Result<Comparison> CalibrateUnit(const Scenario& scenario, int unit, Calibration* found) {
    TRUETRIAD_ASSIGN_OR_RETURN(const Recording recording, Play(scenario, unit));
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string manifest, Write(recording, folder_));
    std::vector<std::string> overrides = GetParam().overrides;
    for (std::string& text : overrides) {
      if (const std::size_t at = text.find("HERE"); at != text.npos) text.replace(at, 4, folder_);
    }
    overrides.push_back("input=" + manifest);
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Experiment experiment,
        ReadExperiment(ConfigPath("experiments", GetParam().experiment), overrides));
    TRUETRIAD_ASSIGN_OR_RETURN(*found, CalibrateExperiment(experiment));
    return Compare(*found, recording.TruthFor(*found));
  }

  const std::string folder_ = (fs::path(testing::TempDir()) /
                               ("fleet_" + GetParam().scenario + "_" + GetParam().experiment))
                                  .string();
};

TEST_P(CleanUnits, AreRightAndStatedAlike) {
  const int units = IsNightly() ? kNightlyUnits : kDailyUnits;
  const auto scenario = ReadScenario(ConfigPath("scenarios", GetParam().scenario),
                                     {"count=" + std::to_string(units), "seed=4242"});
  ASSERT_TRUE(scenario) << scenario.error().message;
  int refused = 0;
  double nees = 0.0, squared_nees = 0.0, expected_nees = 0.0;
  SigmasOfGains sigmas;
  for (int unit = 0; unit < units; ++unit) {
    SCOPED_TRACE(unit);
    Calibration found;
    const Result<Comparison> comparison = CalibrateUnit(*scenario, unit, &found);
    ASSERT_TRUE(comparison) << comparison.error().message;
    if (!found.IsUsable()) {
      ++refused;
      std::cout << unit << ": " << found.findings.front().Message() << "\n";
      continue;
    }
    EXPECT_LT(comparison->largest_in_sigmas, kAllowedSigmas);
    const double own = comparison->chi2 / comparison->dof;
    nees += own;
    squared_nees += own * own;
    // The mean of the F distribution.
    const double dof = found.quality.effective_dof;
    expected_nees += std::isfinite(dof) ? dof / std::max(dof - 2.0, 1.0) : 1.0;
    sigmas.Add(found);
  }
  const double usable = units - refused;
  EXPECT_EQ(refused, 0);
  ASSERT_GT(usable, 1.0);

  const double mean = nees / usable;
  const double error =
      kStandardErrors * std::sqrt((squared_nees / usable - mean * mean) / (usable - 1.0));
  EXPECT_LT(mean - error, expected_nees / usable);
  EXPECT_GT(mean + error, GetParam().least_nees);

  const int odd = sigmas.MostOdd();
  EXPECT_LE(odd, std::ceil(kMostOddShare * units));
  std::cout << GetParam() << ": refused " << refused << " of " << units << ", NEES/dim " << mean
            << " (by F " << expected_nees / usable << "), sigma off the median by a factor of two "
            << odd << "\n";
}

INSTANTIATE_TEST_SUITE_P(
    Shipped,
    CleanUnits,
    testing::Values(
        Fleet{"fleet", "nine-axis", {}},
        Fleet{"consumer-9dof", "nine-axis", {}},
        Fleet{"late-magnetometer", "nine-axis", {}},
        Fleet{"fleet", "joint", {}},
        Fleet{"fleet", "accelerometer-only", {}},
        Fleet{"fleet", "magnetometer-only", {}},
        Fleet{"fleet", "magnetometer-gyroscope", {}},
        Fleet{"tumble", "tumble", {}},
        Fleet{"tumble-by-hand", "tumble", {}, 0.45},
        Fleet{"turntable-rates", "rate-table", {"rates.file=HERE/rates.yaml", "turns=none"}},
        Fleet{"turntable-attitudes", "rates-without-axis", {"rates.file=HERE/rates.yaml"}, 0.7},
        Fleet{"thermal-soak", "thermal-soak", {"poses.file=HERE/poses.yaml"}}),
    [](const auto& fleet) {
      std::string name = fleet.param.scenario + "_by_" + fleet.param.experiment;
      std::ranges::replace(name, '-', '_');
      return name;
    });

constexpr int kLikeUnits = 150;

Result<CalibrationSummary> CalibrateInMemory(const Scenario& scenario,
                                             int unit,
                                             const Experiment& experiment) {
  TRUETRIAD_ASSIGN_OR_RETURN(const auto simulation, Simulation::Create(scenario, unit));
  PoseSelection selection;
  selection.moves = true;
  TRUETRIAD_ASSIGN_OR_RETURN(const PoseSet poses, CollectPoses(*simulation, selection));
  return Calibrate(poses, experiment.options);
}

// The units of simulate --config=configs/scenarios/fleet.yaml --set=count=150,seed=777. The verdict
// refuses a unit whose variance components are not at their optimum. Six of these units once ended
// far from it, with gains whose σ were 3 to 16 times too large.
TEST(LikeUnits, HaveTheSameUncertaintyStated) {
  const auto scenario = ReadScenario(ConfigPath("scenarios", "fleet"), {"count=150", "seed=777"});
  ASSERT_TRUE(scenario) << scenario.error().message;
  const auto experiment = ReadExperiment(ConfigPath("experiments", "nine-axis"));
  ASSERT_TRUE(experiment) << experiment.error().message;
  SigmasOfGains sigmas;
  for (int unit = 0; unit < kLikeUnits; ++unit) {
    SCOPED_TRACE(unit);
    const auto summary = CalibrateInMemory(*scenario, unit, *experiment);
    ASSERT_TRUE(summary) << summary.error().message;
    const Calibration& found = summary->calibration;
    ASSERT_TRUE(found.IsUsable()) << found.findings.back().Message();
    sigmas.Add(found);
  }
  EXPECT_EQ(sigmas.MostOdd(), 0);
}

}  // namespace fleet_test
}  // namespace truetriad::trust
