// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "fleet/unit_run.h"
#include "tree/json.h"
#include "truetriad/base/result.h"

namespace truetriad {
namespace explain_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// Written by `truetriad explain > docs/reasons.md`.
TEST(Explain, PrintsTheListOfTheDocs) {
  EXPECT_EQ(RunTruetriad({"explain"}).out,
            TemporaryFolder::Read(TRUETRIAD_SOURCE_DIR "/docs/reasons.md"));
}

TEST(Explain, SaysWhatACodeMeansAndWhatToDo) {
  const Finished run = RunTruetriad({"explain", "no-rest"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.out,
            "no-rest: refusal\n"
            "  No rest was found.\n"
            "  What to do: hold poses longer, or state them.\n"
            "  An operator: record again; do not touch the unit while it rests.\n");
}

// "no-readings" is a warning where one stream has none, and an error where the file has none.
TEST(Explain, SaysBothOfACodeThatFindingsAndErrorsHave) {
  const Json json = Json::parse(RunTruetriad({"explain", "no-readings", "--json"}).out);
  EXPECT_EQ(json["result"]["findings"][0]["severity"], "warning");
  EXPECT_EQ(json["result"]["errors"][0]["exit"], 2);
  EXPECT_THAT(RunTruetriad({"explain", "no-readings"}).out,
              AllOf(StartsWith("no-readings: warning\n"),
                    HasSubstr("\nno-readings: error, exit code 2\n")));
}

// What `fleet summary` and the page print, too.
TEST(Explain, KnowsEveryCodeThatIsPrinted) {
  std::vector<std::string> words = {"explain", "limit:accelerometer.bias.x"};
  for (const FindingKind& kind : FindingKinds()) words.emplace_back(kind.name);
  for (const ErrorInfo& info : AllErrorCodes()) words.emplace_back(info.name);
  for (const fleet::RunCode& code : fleet::kRunCodes) words.emplace_back(code.name);
  const Finished run = RunTruetriad(words);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("\nlimit:NAME: a unit"), HasSubstr("\ncrashed: a unit")));
}

TEST(Explain, NamesTheNearestOfAnUnknownCode) {
  const Finished run = RunTruetriad({"explain", "clok-offset"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("`clok-offset` is not a code (did you mean `clock-offset`?)"));
}

}  // namespace explain_test
}  // namespace truetriad
