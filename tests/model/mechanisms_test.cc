// SPDX-License-Identifier: Apache-2.0
#include "model/mechanisms.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <fstream>
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

// A row that no source asks for is no mechanism, unless its codes are said by the verdict's checks
// alone, whose refusals are dropped where it is switched off; and a source whose reason to leave
// something out is a finding asks for some row.
TEST(Mechanisms, StandWhereTheyAct) {
  std::set<std::string> used;         // by any source
  std::set<std::string> said_before;  // codes, by sources other than the verdict's checks
  const std::regex said(R"((?:Finding(?: \w+)?\(|emplace_back\(|\{)\s*FindingCode::(k\w+))");
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(TRUETRIAD_SOURCE_DIR "/src")) {
    if (entry.path().extension() != ".cc" || entry.path().stem() == "mechanisms") continue;
    std::ifstream file(entry.path());
    std::stringstream text;
    text << file.rdbuf();
    const std::string source = text.str(), scope = "Mechanism::";
    for (auto at = source.find(scope); at != std::string::npos; at = source.find(scope, at)) {
      at += scope.size();
      const auto end = std::find_if(source.begin() + static_cast<std::ptrdiff_t>(at),
                                    source.end(),
                                    [](unsigned char c) { return std::isalnum(c) == 0; });
      used.emplace(source.begin() + static_cast<std::ptrdiff_t>(at), end);
    }
    const std::string room = entry.path().parent_path().filename();
    const std::sregex_iterator none;
    for (std::sregex_iterator at(source.begin(), source.end(), said); at != none; ++at) {
      if (room != "checks" && room != "model") said_before.insert((*at)[1].str());
    }
    const bool leaves_out = source.find("left out") != std::string::npos &&
                            source.find("FindingCode::") != std::string::npos;
    if (room != "data" || !leaves_out) continue;
    EXPECT_NE(source.find(scope), std::string::npos) << entry.path();
  }
  std::ifstream list(TRUETRIAD_SOURCE_DIR "/src/model/mechanisms.def");
  const std::regex row(R"re(^MECHANISM\((k\w+), "([a-z-]+)", "[^"]*", ([^)]*)\))re");
  const std::regex code(R"(k\w+)");
  std::size_t rows = 0;
  for (std::string line; std::getline(list, line);) {
    std::smatch parts;
    if (!std::regex_search(line, parts, row)) continue;
    const MechanismInfo& info = Mechanisms()[rows++];
    EXPECT_EQ(info.name, parts[2].str());
    if (used.contains(parts[1].str()) || info.mechanism >= Mechanism::kNothingToSolve) continue;
    EXPECT_FALSE(info.codes.empty()) << info.name;
    const std::string codes = parts[3];
    const std::sregex_iterator none;
    for (std::sregex_iterator at(codes.begin(), codes.end(), code); at != none; ++at) {
      EXPECT_FALSE(said_before.contains(at->str())) << info.name << ": " << at->str();
    }
  }
  // Nothing after the two that cannot be switched off.
  EXPECT_EQ(Mechanisms().back().mechanism, Mechanism::kRemark);
  EXPECT_EQ(rows, Mechanisms().size());
}

}  // namespace mechanisms_test
}  // namespace truetriad
