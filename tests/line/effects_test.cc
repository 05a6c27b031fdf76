// SPDX-License-Identifier: Apache-2.0
#include "line/effects.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "math/fast_random.h"

namespace truetriad::line {
namespace effects_test {

UnitRecord UnitOf(std::map<std::string, std::string> tags, const Eigen::VectorXd& values) {
  UnitRecord unit;
  unit.tags = std::move(tags);
  unit.values = values;
  unit.sigma = Eigen::VectorXd::Zero(values.size());
  return unit;
}

// 17 units, unbalanced over three fixtures and two operators.
LineData Unbalanced() {
  const char* fixtures = "AAAAAABBBBBCCCCCC";
  const char* operators = "xxxyyyxxyyyxyyyyx";
  const double a[] = {
      3.1, 2.9, 3.3, 3.8, 3.6, 4.0, 2.2, 2.5, 3.1, 2.8, 2.9, 4.4, 5.1, 5.0, 4.7, 5.3, 4.1};
  const double b[] = {
      1.0, 1.4, 0.7, 1.1, 1.3, 0.9, 2.0, 1.8, 2.3, 2.1, 1.7, 1.2, 1.5, 0.8, 1.6, 1.1, 1.4};
  LineData data;
  data.parameters = {"a", "b"};
  for (std::size_t k = 0; k < 17; ++k) {
    data.units.push_back(UnitOf(
        {{"fixture", std::string(1, fixtures[k])}, {"operator", std::string(1, operators[k])}},
        Eigen::Vector2d(a[k], b[k])));
  }
  return data;
}

// python3, statsmodels 0.13:
//   d=pd.DataFrame(dict(f=list("AAAAAABBBBBCCCCCC"),o=list("xxxyyyxxyyyxyyyyx"),a=[...],b=[...]))
//   m=smf.ols("a~C(f,Sum)+C(o,Sum)",d).fit(); anova_lm(m,typ=3); m.params; m.bse; m.scale
//   MANOVA.from_formula("a+b~C(f,Sum)+C(o,Sum)",d).mv_test()
TEST(Effects, AgreeWithStatsmodels) {
  const EffectReport report = Effects(Unbalanced());
  ASSERT_EQ(report.factors.size(), 2U);
  ASSERT_EQ(report.effects.size(), 4U);
  const ParameterEffect& fixture = report.effects[0];
  EXPECT_EQ(fixture.dof, 2.0);
  EXPECT_EQ(fixture.error_dof, 13.0);
  // Statsmodels prints what it has in doubles; least squares of so few numbers keeps 1e-10.
  EXPECT_NEAR(fixture.f, 145.749233614, 1e-8 * 145.749233614);
  EXPECT_NEAR(fixture.p, 1.25120528322e-09, 1e-7 * 1.25120528322e-09);
  ASSERT_EQ(fixture.levels.size(), 3U);
  EXPECT_NEAR(fixture.levels[0].effect, -0.127548209366, 1e-9);
  EXPECT_NEAR(fixture.levels[0].sigma, 0.0675247909998, 1e-9);
  EXPECT_NEAR(fixture.levels[2].effect, 1.0741046832, 1e-9);
  const ParameterEffect& by_operator = report.effects[1];
  EXPECT_NEAR(by_operator.f, 49.1909530012, 1e-8 * 49.1909530012);
  EXPECT_NEAR(by_operator.p, 9.15315317751e-06, 1e-7);
  EXPECT_NEAR(report.spreads[0].sigma, 0.197601640017, 1e-9);
  ASSERT_EQ(report.joint.size(), 2U);
  EXPECT_NEAR(report.joint[0].wilks, 0.0134721429283, 1e-8);
  EXPECT_NEAR(report.joint[0].f, 45.6931395467, 1e-6);
  EXPECT_EQ(report.joint[0].dof, 4);
  EXPECT_EQ(report.joint[0].error_dof, 24);
  EXPECT_NEAR(report.joint[0].p / 6.93978887533e-11, 1.0, 1e-6);
}

// Balanced: (mean square between - within) / units of a level, as any textbook has it.
TEST(Effects, VarianceBetweenLevelsIsThatOfTheAnalysisOfVariance) {
  LineData data;
  data.parameters = {"a"};
  const double values[3][4] = {{10, 11, 12, 11}, {14, 15, 13, 14}, {12, 11, 13, 12}};
  for (int level = 0; level < 3; ++level) {
    for (const double value : values[level]) {
      data.units.push_back(
          UnitOf({{"slot", std::to_string(level)}}, Eigen::VectorXd::Constant(1, value)));
      data.units.back().sigma.setConstant(0.5);
    }
  }
  const EffectReport report = Effects(data);
  // Means 11, 14, 12: between 4 * (16 + 25 + 1) / 9 / 2 = 9.3333; within 6 / 9.
  ASSERT_EQ(report.effects.size(), 1U);
  EXPECT_NEAR(report.effects[0].f, (28.0 / 3.0) / (6.0 / 9.0), 1e-9);
  EXPECT_NEAR(report.effects[0].sigma_between, std::sqrt((28.0 / 3.0 - 2.0 / 3.0) / 4.0), 1e-9);
  EXPECT_NEAR(report.spreads[0].process_sigma, std::sqrt(2.0 / 3.0 - 0.25), 1e-9);
}

TEST(Effects, SayWhatCannotBeToldApart) {
  LineData data = Unbalanced();
  for (UnitRecord& unit : data.units) {
    unit.tags["slot"] = unit.tags["fixture"];
    unit.tags["station"] = unit.tags["fixture"] == "A" ? "left" : "right";
  }
  // What was refused says nothing of what goes with what.
  data.units.push_back(UnitOf({{"slot", "A"}, {"fixture", "B"}, {"station", "right"}}, {}));
  const EffectReport report = Effects(data);
  EXPECT_THAT(
      report.notes,
      testing::UnorderedElementsAre(
          "slot and fixture cannot be told apart: all units of a slot have the same fixture, and "
          "all of a fixture the same slot",
          "each slot goes with one station: the effect of station includes that of slot, and is "
          "held against it",
          "each fixture goes with one station: the effect of station includes that of fixture, and "
          "is held against it"));
  for (const ParameterEffect& effect : report.effects) {
    for (const LevelEffect& level : effect.levels) EXPECT_TRUE(std::isfinite(level.effect));
  }
}

// Those without the tag are neither a level nor in the other levels' mean.
TEST(Effects, OfATagAreThoseOfTheUnitsThatCarryIt) {
  LineData data = Unbalanced();
  for (UnitRecord& unit : data.units) unit.tags.erase("operator");
  const ParameterEffect alone = Effects(data).effects[0];
  for (int k = 0; k < 9; ++k) {
    data.units.push_back(UnitOf({}, Eigen::Vector2d(20.0 + 0.1 * k, 1.0 + 0.2 * k)));
  }
  data.units[3].sigma.setConstant(std::nan(""));
  const EffectReport report = Effects(data);
  ASSERT_FALSE(report.effects.empty());
  const ParameterEffect& effect = report.effects[0];
  ASSERT_EQ(effect.levels.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(effect.levels[k].effect, alone.levels[k].effect, 1e-12);
  }
  EXPECT_EQ(effect.dof, 2.0);
  EXPECT_THAT(
      report.notes,
      testing::ElementsAre("9 of 26 units have no fixture and are not in its estimate",
                           "the σ of calibration is without 1 unit that states none of a, b"));
  EXPECT_EQ(report.spreads[0].without_sigma, 1);
}

// Two operators who share no slot: neither differences between them nor between their slots show.
TEST(Effects, LeaveOutWhatNoUnitConnects) {
  LineData data;
  data.parameters = {"a"};
  const char* slots = "112211223344334433441122";
  const char* operators = "vwvwvwvwxyxyxyxyxyxyvwvw";
  for (std::size_t k = 0; k < 24; ++k) {
    data.units.push_back(
        UnitOf({{"slot", std::string(1, slots[k])}, {"operator", std::string(1, operators[k])}},
               Eigen::VectorXd::Constant(1, std::sin(7.0 * static_cast<double>(k)))));
  }
  const EffectReport report = Effects(data);
  ASSERT_EQ(report.effects.size(), 2U);
  EXPECT_EQ(report.effects[0].dof, 2.0);  // within 1, 2 and within 3, 4
  EXPECT_TRUE(std::isnan(report.effects[0].levels[0].effect));
  EXPECT_EQ(report.notes.size(), 2U);
}

// 400 simulated lines without effects: p is uniform; the share below 5 % is 20 ± 4.4 of 400.
TEST(Effects, WithoutAnyAreFoundAsOftenAsStated) {
  FastRandom random({11});
  int joint = 0;
  int any = 0;
  for (int line = 0; line < 400; ++line) {
    LineData data;
    data.parameters = {"a", "b", "c", "d"};
    for (int unit = 0; unit < 80; ++unit) {
      Eigen::Vector4d values;
      for (double& value : values) value = random.Normal();
      values[1] += values[0];
      data.units.push_back(UnitOf({{"slot", std::to_string(random.Below(6))},
                                   {"operator", std::to_string(random.Below(3))}},
                                  values));
    }
    const EffectReport report = Effects(data);
    joint += report.joint[0].p < 0.05 ? 1 : 0;
    any += std::any_of(report.effects.begin(), report.effects.end(), [](const auto& effect) {
      return effect.p_adjusted < 0.05;
    });
  }
  EXPECT_NEAR(joint, 20, 3.5 * 4.4);
  EXPECT_LE(any, 20 + 3.5 * 4.4);
}

// Three of four parameters are what a factor, or two factors together, make them; one has a spoilt
// unit.
TEST(Effects, OfWhatFactorsDetermineAreNotTested) {
  FastRandom random({13});
  LineData data;
  data.parameters = {"free", "by slot", "by both", "by slot but one"};
  for (int unit = 0; unit < 60; ++unit) {
    const int slot = unit % 3;
    const int person = unit / 3 % 2;
    const Eigen::Vector4d values(random.Normal(),
                                 1.0 / (3.0 + slot),
                                 0.1 * slot + 0.7 * person,
                                 1.0 / (7.0 + slot) + (unit == 5 ? 1.0 : 0.0));
    data.units.push_back(
        UnitOf({{"slot", std::to_string(slot)}, {"operator", std::to_string(person)}}, values));
  }
  const EffectReport report = Effects(data);
  EXPECT_EQ(report.effects.size(), 2U);
  for (const ParameterEffect& effect : report.effects) EXPECT_EQ(effect.parameter, 0);
  ASSERT_GE(report.notes.size(), 2U);
  EXPECT_THAT(report.notes[0], testing::HasSubstr("by slot is left out"));
  EXPECT_THAT(report.notes[1], testing::HasSubstr("by both is left out"));
}

TEST(Effects, OfValuesTooLargeForAVarianceAreNotTested) {
  FastRandom random({14});
  LineData data;
  data.parameters = {"free", "huge"};
  for (int unit = 0; unit < 40; ++unit) {
    UnitRecord record;
    record.values = Eigen::Vector2d(random.Normal(), unit == 5 ? -1e300 : 1e300);
    record.sigma = Eigen::Vector2d::Zero();
    data.units.push_back(std::move(record));
  }
  EXPECT_EQ(Effects(data).notes,
            std::vector{data.parameters[1] +
                        " is left out: its values are too far from each other for a variance "
                        "(squares beyond 1e308)"});
}

// 300 lines of two stations with four fixtures each that differ by as much as units do: stations do
// not differ, and 5 % of the tests are 15 ± 3.8.
TEST(Effects, OfStationsAreHeldAgainstTheirFixtures) {
  FastRandom random({14});
  int found = 0;
  for (int line = 0; line < 300; ++line) {
    LineData data;
    data.parameters = {"a"};
    Eigen::Matrix<double, 8, 1> fixtures;
    for (double& fixture : fixtures) fixture = random.Normal();
    for (int unit = 0; unit < 80; ++unit) {
      const int fixture = unit % 8;
      data.units.push_back(
          UnitOf({{"station", fixture < 4 ? "S1" : "S2"}, {"fixture", std::to_string(fixture)}},
                 Eigen::VectorXd::Constant(1, fixtures[fixture] + random.Normal())));
    }
    const EffectReport report = Effects(data);
    ASSERT_EQ(report.effects[0].error_dof, 6.0);
    found += report.effects[0].p < 0.05 ? 1 : 0;
  }
  EXPECT_NEAR(found, 15, 3.5 * 3.8);
}

}  // namespace effects_test
}  // namespace truetriad::line
