// SPDX-License-Identifier: Apache-2.0
// The manual page and the completion of bash hold every verb and flag that the help has.
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"

namespace truetriad {
namespace completion_test {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;

/// The first group of `pattern` wherever it matches a line of `text`.
std::vector<std::string> Found(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::vector<std::string> found;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (std::smatch match; std::regex_search(line, match, regex)) found.push_back(match[1]);
  }
  return found;
}

std::vector<std::string> Verbs() {
  const std::string help = RunTruetriad({"help"}).out;
  // After the usage, each on a line of its own, with its question.
  return Found(help.substr(help.find("Usage:")), "^  ([a-z-]+) +[A-Z].*\\?$");
}

std::vector<std::string> FlagsOf(const std::string& verb) {
  return Found(RunTruetriad({"help", verb}).out, "^  (--[a-z-]+)=");
}

/// What bash offers after `words`, the last of which is not finished.
std::vector<std::string> Completed(const std::vector<std::string>& words) {
  const TemporaryFolder folder;
  std::string script = RunTruetriad({"help", "--as=bash"}).out + "COMP_WORDS=(truetriad";
  for (const std::string& word : words) script += " '" + word + "'";
  script += ")\nCOMP_CWORD=" + std::to_string(words.size()) +
            "\n_truetriad\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n";
  const std::string path = folder.Write("complete.sh", script);
  const Finished run = RunShell("bash '" + path + "'");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return Found(run.out, "^(.+)$");
}

TEST(Completion, OffersEveryVerb) {
  std::vector<std::string> verbs = Verbs();
  verbs.emplace_back("fleet");
  EXPECT_THAT(verbs, IsSupersetOf({"calibrate", "export", "help", "version"}));
  EXPECT_THAT(Completed({""}), testing::UnorderedElementsAreArray(verbs));
  EXPECT_THAT(Completed({"calib"}), ElementsAre("calibrate"));
  EXPECT_THAT(Completed({"help", "calib"}), ElementsAre("calibrate"));
}

TEST(Completion, OffersEveryFlagOfEachVerb) {
  int flags = 0;
  for (const std::string& verb : Verbs()) {
    if (verb == "help") continue;  // Takes verbs.
    const std::vector<std::string> offered = Completed({verb, "--"});
    EXPECT_THAT(offered, Contains("--help")) << verb;
    for (const std::string& flag : FlagsOf(verb)) {
      EXPECT_THAT(offered, Contains(flag + "=")) << verb;
      ++flags;
    }
  }
  EXPECT_GT(flags, 30);
}

TEST(Completion, OffersVerbsOfTwoWords) {
  EXPECT_THAT(
      Completed({"fleet", ""}),
      ElementsAre("run", "watch", "query", "summary", "report", "export", "collect", "dispose"));
  EXPECT_THAT(Completed({"fleet", "r"}), ElementsAre("run", "report"));
  EXPECT_THAT(Completed({"fleet", "run", "--"}), IsSupersetOf({"--resume=", "--store=", "--help"}));
  EXPECT_THAT(Completed({"fleet", "query", "--"}), IsSupersetOf({"--sql=", "--store="}));
}

TEST(Completion, OffersTheFormatsAndFiles) {
  const std::vector<std::string> formats =
      Found(RunTruetriad({"help", "export"}).out, "^  ([a-z][a-z0-9-]+)  +[^ ]");
  EXPECT_THAT(formats, IsSupersetOf({"px4", "record"}));
  EXPECT_THAT(Completed({"export", "--to", "=", ""}), testing::UnorderedElementsAreArray(formats));
  EXPECT_THAT(Completed({"export", "--to", "="}), testing::UnorderedElementsAreArray(formats));
  EXPECT_THAT(Completed({"export", "--to", "px"}), ElementsAre("px4"));
  EXPECT_THAT(Completed({"calibrate", "--to", "=", ""}),
              testing::UnorderedElementsAreArray(formats));
  EXPECT_THAT(Completed({"calibrate", "--report", "=", "f"}), ElementsAre("false"));
  EXPECT_THAT(Completed({"inspect", "--input", "=", "README"}), ElementsAre("README.md"));
  EXPECT_THAT(Completed({"calibrate", "--output", "=", "doc"}), ElementsAre("docs"));
}

TEST(ManPage, HoldsEveryVerbAndFlag) {
  const std::string page = RunTruetriad({"help", "--as=man"}).out;
  for (const std::string& verb : Verbs()) {
    EXPECT_THAT(page, HasSubstr("\n.SS " + verb + "\n"));
    for (const std::string& flag : FlagsOf(verb)) {
      const std::string escaped = std::regex_replace(flag, std::regex("-"), "\\-");
      EXPECT_THAT(page, HasSubstr("\\fB" + escaped + "\\fR=")) << verb;
    }
  }
}

TEST(ManPage, IsSetWithoutWarnings) {
  if (RunShell("command -v groff").exit_code != 0) GTEST_SKIP() << "groff is not installed";
  const TemporaryFolder folder;
  const std::string page = folder.Write("truetriad.1", RunTruetriad({"help", "--as=man"}).out);
  const Finished run = RunShell("groff -man -Kutf8 -Tutf8 -ww -P-cbou '" + page + "'");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(run.out, HasSubstr("--max-loss=SHARE"));
}

TEST(HelpForm, IsOfAllVerbsOrRefused) {
  EXPECT_EQ(RunTruetriad({"help", "--as=info"}).exit_code, 1);
  EXPECT_EQ(RunTruetriad({"help", "calibrate", "--as=man"}).exit_code, 1);
}

}  // namespace completion_test
}  // namespace truetriad
