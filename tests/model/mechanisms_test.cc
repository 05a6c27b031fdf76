// SPDX-License-Identifier: Apache-2.0
#include "model/mechanisms.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace truetriad {
namespace mechanisms_test {

TEST(Mechanisms, HaveNamesAndSentences) {
  const std::regex kebab("[a-z]+(-[a-z]+)*");
  std::set<std::string_view> names;
  for (const MechanismInfo& info : Mechanisms()) {
    EXPECT_TRUE(std::regex_match(std::string(info.name), kebab)) << info.name;
    EXPECT_TRUE(names.insert(info.name).second) << info.name << " twice";
    EXPECT_EQ(MechanismFromName(info.name), info.mechanism);
    EXPECT_FALSE(info.does.empty()) << info.name;
  }
}

TEST(Mechanisms, AreListedForEveryFindingCode) {
  for (const FindingKind& kind : FindingKinds()) {
    const bool is_listed =
        std::any_of(Mechanisms().begin(), Mechanisms().end(), [&](const MechanismInfo& info) {
          return std::find(info.codes.begin(), info.codes.end(), kind.code) != info.codes.end();
        });
    EXPECT_TRUE(is_listed) << kind.name << ": give it a row in model/mechanisms.def";
    // What may refuse is no mere remark.
    if (kind.outcome == Outcome::kConverged) continue;
    EXPECT_NE(MechanismOf(kind.code), Mechanism::kRemark) << kind.name;
  }
}

// The sources, by their path from the root.
std::map<std::string, std::string> Sources() {
  std::map<std::string, std::string> sources;
  const std::filesystem::path root = TRUETRIAD_SOURCE_DIR;
  for (const char* folder : {"src", "tools/truetriad"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() != ".cc" || entry.path().stem() == "mechanisms") continue;
      std::ifstream file(entry.path());
      std::stringstream text;
      text << file.rdbuf();
      sources[std::filesystem::relative(entry.path(), root)] = text.str();
    }
  }
  return sources;
}

// The first groups of all matches.
std::set<std::string> Matches(const std::string& text, const std::regex& pattern) {
  std::set<std::string> found;
  for (std::sregex_iterator at(text.begin(), text.end(), pattern), end; at != end; ++at) {
    found.insert((*at)[1].str());
  }
  return found;
}

// A row that no source asks for is no mechanism, unless its codes are said by the verdict's checks
// alone, whose refusals are dropped where it is switched off; a source that leaves something out,
// or says a code that is not an error for want of anything to solve, asks for some row.
TEST(Mechanisms, StandWhereTheyAct) {
  const std::regex asked("Mechanism::(k\\w+)");
  const std::regex said(R"(Finding(?: \w+)?\(\s*FindingCode::(k\w+),)");
  const std::regex in_error(R"(NotEnoughError\(\s*Finding\(\s*FindingCode::(k\w+),)");
  std::set<std::string> used, said_before;  // said_before: codes, before the verdict's checks
  for (const auto& [path, source] : Sources()) {
    const std::set<std::string> here = Matches(source, asked);
    used.insert(here.begin(), here.end());
    if (!here.empty() || !path.starts_with("src/")) continue;
    EXPECT_FALSE(path.starts_with("src/data/") && source.find("left out") != std::string::npos &&
                 source.find("FindingCode::") != std::string::npos)
        << path;
    const bool is_verdict = path.starts_with("src/verdict/") || path.starts_with("src/report/");
    if (is_verdict) continue;
    const std::set<std::string> errors = Matches(source, in_error);
    for (const std::string& one : Matches(source, said)) {
      if (!errors.contains(one)) said_before.insert(one);
    }
  }
  std::ifstream list(TRUETRIAD_SOURCE_DIR "/src/model/mechanisms.def");
  const std::regex row(R"re(^MECHANISM\((k\w+), "([a-z-]+)", "[^"]*", ([^)]*)\))re");
  const std::regex code(R"((k\w+))");
  std::size_t rows = 0;
  for (std::string line; std::getline(list, line);) {
    std::smatch parts;
    if (!std::regex_search(line, parts, row)) continue;
    const MechanismInfo& info = Mechanisms()[rows++];
    EXPECT_EQ(info.name, parts[2].str());
    if (used.contains(parts[1].str()) || info.mechanism >= Mechanism::kNothingToSolve) continue;
    EXPECT_FALSE(info.codes.empty()) << info.name;
    for (const std::string& own : Matches(parts[3].str(), code)) {
      EXPECT_FALSE(said_before.contains(own)) << info.name << ": " << own;
    }
  }
  EXPECT_EQ(rows, Mechanisms().size());
  // Nothing after the two that cannot be switched off.
  EXPECT_EQ(Mechanisms().back().mechanism, Mechanism::kRemark);
}

}  // namespace mechanisms_test
}  // namespace truetriad
