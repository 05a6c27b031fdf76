// SPDX-License-Identifier: Apache-2.0
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"

namespace truetriad {
namespace usage_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

struct Misuse {
  std::string name;
  std::vector<std::string> arguments;
  std::string message;

  friend std::ostream& operator<<(std::ostream& out, const Misuse& misuse) {
    return out << misuse.name;
  }
};

class CommandLineMisuse : public ::testing::TestWithParam<Misuse> {};

TEST_P(CommandLineMisuse, ExitsWithOneClearLine) {
  const Finished run = RunTruetriad(GetParam().arguments);
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.out, IsEmpty());
  EXPECT_THAT(run.err, AllOf(StartsWith("truetriad"), HasSubstr(GetParam().message)));
  EXPECT_EQ(run.err.find('\n'), run.err.size() - 1);
}

INSTANTIATE_TEST_SUITE_P(
    Each,
    CommandLineMisuse,
    ::testing::Values(
        Misuse{"UnknownVerb", {"clibrate"}, "`clibrate` is not a verb (did you mean `calibrate`?)"},
        Misuse{"VerbLikeNoOther", {"xyzzy"}, "`xyzzy` is not a verb; `truetriad help` lists them"},
        Misuse{"HalfAVerb",
               {"fleet", "--config=x"},
               "needs a second word, one of run, watch, query, summary, report, export, collect, "
               "dispose"},
        Misuse{"HelpForAnUnknownVerb", {"help", "aply"}, "did you mean `apply`?"},
        Misuse{"UnknownFlag", {"inspect", "--inptu=x"}, "--inptu is not a flag (did you mean"},
        Misuse{"FlagOfALibrary", {"inspect", "--logtostderr"}, "--logtostderr is not a flag"},
        Misuse{
            "FlagOfAnotherVerb", {"inspect", "--config=x"}, "--config does not apply to this verb"},
        Misuse{"RepeatedFlag", {"inspect", "--input=a", "--input=b"}, "--input is given twice"},
        Misuse{"FlagWithoutValue", {"inspect", "--input"}, "--input has no value"},
        Misuse{"EmptyValue", {"inspect", "--input="}, "--input has no value"},
        Misuse{"FlagInPlaceOfAValue", {"evaluate", "--input", "--poses=detect"}, "--input has no"},
        Misuse{"RequiredFlagMissing",
               {"evaluate", "--calibration=x"},
               "LOG is missing; expected `truetriad evaluate FILE LOG [ANOTHER-FILE] [flags]`"},
        Misuse{"StrayWord",
               {"inspect", "log.csv", "b.csv"},
               "`b.csv` is one word too many; expected `truetriad inspect"},
        Misuse{"WordForAFlagThatIsGiven", {"check", "-c", "a", "b"}, "`b` is one word too many"},
        Misuse{"NothingToCalibrate", {"calibrate"}, "no log; name one"},
        Misuse{"BooleanThatIsNone",
               {"calibrate", "--config=x", "--output=y", "--report=maybe"},
               "--report=maybe is invalid; expected true or false"},
        Misuse{"PosesThatAreNone", {"inspect", "--input=x", "--poses=every:0"}, "--poses=every:0"}),
    [](const auto& test) { return test.param.name; });

TEST(CommandLine, ShowsTheVerbsOnStderrWhenThereIsNone) {
  const Finished run = RunTruetriad({});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.out, IsEmpty());
  EXPECT_THAT(run.err, AllOf(HasSubstr("inspect"), HasSubstr("calibrate"), HasSubstr("report")));
}

TEST(CommandLine, StatesItsVersion) {
  for (const char* spelling : {"version", "--version"}) {
    const Finished run = RunTruetriad({spelling});
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_THAT(run.out, ::testing::MatchesRegex("truetriad [0-9]+\\.[0-9]+\\.[0-9]+\n"));
  }
}

TEST(CommandLine, ColoursTheVerdictInATerminalAlone) {
  const std::string call = "'" TRUETRIAD_BINARY "' inspect datasets/demo/recording.csv";
  const std::string good = "\033[1;32mENOUGH for a usable calibration\033[0m";
  // `script` (util-linux) runs it in a terminal of its own.
  const auto in_terminal = [](const std::string& what) {
    return RunShell("script -qec \"" + what + "\" /dev/null");
  };
  if (RunShell("command -v script").exit_code != 0) GTEST_SKIP() << "no `script`";
  EXPECT_THAT(in_terminal("TERM=xterm " + call).out, HasSubstr(good));
  EXPECT_THAT(in_terminal("TERM=xterm NO_COLOR=1 " + call).out, Not(HasSubstr("\033[1")));
  EXPECT_THAT(in_terminal("TERM=dumb " + call).out, Not(HasSubstr("\033[1")));
  EXPECT_THAT(RunShell("TERM=xterm " + call).out, ::testing::StartsWith("ENOUGH for a usable"));
  EXPECT_THAT(in_terminal("TERM=xterm '" TRUETRIAD_BINARY "' bogus").out,
              HasSubstr("\033[1;31mtruetriad:\033[0m `bogus`"));
}

TEST(CommandLine, SaysWhereAWriteToAFullStdoutFailed) {
  const Finished run = RunShell("'" TRUETRIAD_BINARY "' help >/dev/full 2>&1; echo $?");
  EXPECT_THAT(run.out, StartsWith("2"));
  // More than one buffer: the failure comes before the end and must not be forgotten.
  const std::string inspect = "'" TRUETRIAD_BINARY "' inspect --input='" TRUETRIAD_SOURCE_DIR
                              "/datasets/demo/recording.csv' >/dev/full 2>/dev/null; echo $?";
  EXPECT_THAT(RunShell(inspect).out, StartsWith("2"));
}

class CommandLineHelp : public ::testing::TestWithParam<std::string> {};

TEST_P(CommandLineHelp, IsTheSameHoweverItIsAskedFor) {
  const Finished help = RunTruetriad({"help", GetParam()});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.err, IsEmpty());
  EXPECT_THAT(help.out,
              AllOf(StartsWith("Example"),
                    HasSubstr("truetriad " + GetParam() + ":"),
                    Not(HasSubstr("logtostderr"))));
  for (const char* spelling : {"--help", "-h"}) {
    const Finished run = RunTruetriad({GetParam(), "--no-such-flag", spelling});
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_EQ(run.out, help.out);
  }
}

TEST_P(CommandLineHelp, OpensWithAnExampleThatWorks) {
  // The example is run as it stands in a folder that has the shipped files but not their owner.
  const TemporaryFolder folder;
  for (const char* shipped : {"configs", "datasets"}) {
    std::filesystem::create_directory_symlink(std::filesystem::path(TRUETRIAD_SOURCE_DIR) / shipped,
                                              folder.Path(shipped));
  }
  std::filesystem::create_directory(folder.Path("build"));
  std::filesystem::create_symlink(TRUETRIAD_BINARY, folder.Path("build/truetriad"));

  std::istringstream help(RunTruetriad({"help", GetParam()}).out);
  std::string line;
  std::getline(help, line);
  int examples = 0;
  while (std::getline(help, line) && line.starts_with("  ")) {
    ++examples;
    const Finished run = RunShell(line, folder.Path("."));
    EXPECT_EQ(run.exit_code, 0) << line << '\n' << run.out << run.err;
  }
  EXPECT_GE(examples, 1);
}

INSTANTIATE_TEST_SUITE_P(OfEach,
                         CommandLineHelp,
                         ::testing::Values("inspect",
                                           "init",
                                           "check",
                                           "calibrate",
                                           "apply",
                                           "evaluate",
                                           "compare",
                                           "export",
                                           "import",
                                           "report",
                                           "explain",
                                           "help",
                                           "version"),
                         [](const auto& test) { return test.param; });

}  // namespace usage_test
}  // namespace truetriad
