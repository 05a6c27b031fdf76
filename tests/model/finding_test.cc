// SPDX-License-Identifier: Apache-2.0
#include "truetriad/model/finding.h"

#include <regex>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace truetriad {
namespace finding_test {

TEST(Findings, HaveNamesThatScriptsCanRelyOn) {
  const std::regex kebab("[a-z]+(-[a-z]+)*");
  std::set<std::string_view> names;
  for (const FindingKind& kind : FindingKinds()) {
    EXPECT_TRUE(std::regex_match(std::string(kind.name), kebab)) << kind.name;
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name << " twice";
    EXPECT_EQ(FindingCodeFromName(kind.name), kind.code);
    EXPECT_EQ(&FindingKindOf(kind.code), &kind);
    EXPECT_FALSE(kind.meaning.empty()) << kind.name;
    // Nothing refuses by default without saying how the run then ends.
    EXPECT_TRUE(kind.severity != Severity::kRefusal || kind.outcome != Outcome::kConverged)
        << kind.name;
  }
  EXPECT_FALSE(FindingCodeFromName("no-such-code"));
}

TEST(Findings, TellAnOperatorNoKeysOfAnExperiment) {
  for (const FindingKind& kind : FindingKinds()) {
    EXPECT_FALSE(kind.operator_remedy.empty()) << kind.name;
    EXPECT_EQ(kind.operator_remedy.find_first_of(":`_"), std::string_view::npos) << kind.name;
  }
}

TEST(Findings, OfWhichOneRefusesMakeTheOutcome) {
  EXPECT_EQ(OutcomeOf({}), Outcome::kConverged);
  Findings findings = {{FindingCode::kClockOffset, "late"}};
  EXPECT_EQ(OutcomeOf(findings), Outcome::kConverged);
  findings.emplace_back(FindingCode::kNotDetermined, "weak");
  findings.emplace_back(FindingCode::kDidNotConverge, "no");
  EXPECT_EQ(OutcomeOf(findings), Outcome::kNotObservable);  // the first one's
  // Whatever its code, a refusal lets nothing through.
  EXPECT_NE(OutcomeOf({Finding(FindingCode::kTimeGaps, "").As(Severity::kRefusal)}),
            Outcome::kConverged);
}

TEST(Findings, CarryTheirNumbersAndTheirRemedy) {
  const Finding finding = Finding(FindingCode::kClockOffset, "late", "set it")
                              .About(Triad::kMagnetometer, 1)
                              .AtPose(3)
                              .With("offset", 0.01, 0.001, "s");
  EXPECT_EQ(finding.Message(), "late; set it");
  EXPECT_EQ(finding.Value("offset"), 0.01);
  EXPECT_FALSE(finding.Value("other"));
  EXPECT_EQ(finding.axis, 1);
  EXPECT_EQ(finding.severity, Severity::kWarning);
}

TEST(Findings, ThatShiftAParameterByMoreThanItsSigmaAreDealtWith) {
  const Finding finding(FindingCode::kClockOffset, "late");
  EXPECT_FALSE(finding.IsLeftStanding());
  EXPECT_FALSE(Finding(finding).Shifting(0.9, Treatment::kNone).IsLeftStanding());
  EXPECT_TRUE(Finding(finding).Shifting(1.1, Treatment::kNone).IsLeftStanding());
  EXPECT_FALSE(Finding(finding).Shifting(1.1, Treatment::kWidened).IsLeftStanding());
  EXPECT_FALSE(Finding(finding).Shifting(1.1, Treatment::kCorrected).IsLeftStanding());
  EXPECT_FALSE(
      Finding(finding).Shifting(1.1, Treatment::kNone).As(Severity::kRefusal).IsLeftStanding());
}

TEST(Findings, GoAlongWithErrors) {
  const Error error = NotEnoughError(
      Finding(FindingCode::kTooFewPoses, "3 poses", "add poses").About(Triad::kAccelerometer));
  EXPECT_EQ(error.kind(), ErrorKind::kNotEnough);
  EXPECT_EQ(error.message, "3 poses; add poses");
  const Finding refusal = RefusalOf(error);
  EXPECT_EQ(refusal.code, FindingCode::kTooFewPoses);
  EXPECT_TRUE(refusal.IsRefusal());
  EXPECT_EQ(refusal.sensor, Triad::kAccelerometer);
  EXPECT_EQ(RefusalOf(Error(ErrorCode::kNotEnoughData, "nothing")).text, "nothing");
}

}  // namespace finding_test
}  // namespace truetriad
