// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_page.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fleet/store.h"
#include "io/temporary_folder.h"
#include "tree/json.h"

namespace truetriad::fleet {
namespace fleet_page_test {

namespace fs = std::filesystem;

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Closes a script, a string and a line in every way that there is.
constexpr char kStrangeSerial[] = "</script>\"';\\\n\xE2\x80\xA8<!--&amp;../x";

UnitRun PageRun(const std::string& serial, int number, Verdict verdict) {
  UnitRun run;
  run.serial = serial;
  run.id = "2026100" + std::to_string(number) + "T000000Z";
  run.recorded = run.created = "2026-10-0" + std::to_string(number) + "T00:00:00Z";
  run.recorded_by = "list";
  run.verdict = verdict;
  if (IsRed(verdict)) run.code = "limit:accelerometer.bias.x";
  run.tags.lot = "L/1";
  run.parameters = {{"accelerometer.bias.x", 0.25, 0.001}};
  return run;
}

class FleetPage : public ::testing::Test {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<Store>> store = OpenStore(folder_.Path("fleet.db"));
    ASSERT_TRUE(store);
    store_ = *std::move(store);
    ASSERT_TRUE(store_->Add(PageRun("A1", 1, Verdict::kPass)));
    ASSERT_TRUE(store_->Add(PageRun("A2", 2, Verdict::kFail)));
    ASSERT_TRUE(store_->Add(PageRun("A2", 3, Verdict::kPass)));
    ASSERT_TRUE(store_->Add(PageRun(kStrangeSerial, 4, Verdict::kFail)));
  }

  Result<FleetPageSummary> WritePage(const std::string& name, const std::string& where = "") {
    return WriteFleetPage(
        *store_, {.store = folder_.Path("fleet.db"), .folder = folder_.Path(name), .where = where});
  }
  /// Files of a folder by name, without links that depend on where it is.
  std::map<std::string, std::string> FilesOf(const std::string& name) const {
    std::map<std::string, std::string> files;
    const fs::path root = folder_.Path(name);
    for (const auto& entry : fs::recursive_directory_iterator(root)) {
      if (!entry.is_regular_file()) continue;
      files[entry.path().lexically_relative(root).string()] =
          TemporaryFolder::Read(entry.path().string());
    }
    return files;
  }

  const TemporaryFolder folder_;
  std::unique_ptr<Store> store_;
};

TEST(FleetPageScript, EscapesWhatEndsAScriptAStringOrALine) {
  const std::string script = ScriptOf(kStrangeSerial);
  EXPECT_EQ(script, R"("\u003c/script>\"';\\\n\u2028\u003c!--&amp;../x")");
  EXPECT_EQ(Json::parse(script).get<std::string>(), kStrangeSerial);
  EXPECT_EQ(ScriptOf("\xFF"), R"("\ufffd")");
  EXPECT_EQ(ScriptOf(std::nan("")), "null");
}

TEST_F(FleetPage, CountsUnitsByTheRunThatCounts) {
  const Result<FleetPageSummary> page = WritePage("page");
  ASSERT_TRUE(page) << page.error().message;
  EXPECT_EQ(page->units, 3U);
  EXPECT_EQ(page->good, 2U);
  EXPECT_EQ(page->runs, 4U);
  const std::map<std::string, std::string> files = FilesOf("page");
  EXPECT_THAT(files.at("index.html"),
              AllOf(HasSubstr("66.7 % good"), HasSubstr("33.3 % good at the first run")));
  EXPECT_THAT(files.at("data.js"), HasSubstr("\"rows\":[[\"L/1\",\"3\""));
  EXPECT_EQ(WritePage("bad", "verdict <> 'PASS'")->units, 1U);
}

TEST_F(FleetPage, IsTheSameForTheSameStore) {
  ASSERT_TRUE(WritePage("one"));
  ASSERT_TRUE(WritePage("two"));
  EXPECT_EQ(FilesOf("one"), FilesOf("two"));
}

TEST_F(FleetPage, HasNoScriptButThoseOfItsFolder) {
  ASSERT_TRUE(WritePage("page"));
  for (const auto& [name, text] : FilesOf("page")) {
    if (!name.ends_with(".html")) continue;
    EXPECT_THAT(text, AllOf(HasSubstr("script-src 'self'"), Not(HasSubstr("://")))) << name;
    for (std::size_t at = 0; (at = text.find("<script", at)) != std::string::npos; ++at) {
      EXPECT_EQ(text.substr(at, 19), "<script defer src=\"") << name;
    }
    EXPECT_THAT(text, Not(HasSubstr(" style="))) << name;
  }
  for (const auto& [name, text] : FilesOf("page")) {
    if (!name.starts_with("data")) continue;
    EXPECT_THAT(text, Not(HasSubstr("</script"))) << name;
  }
}

TEST_F(FleetPage, ReplacesWhatAPageWroteAndNothingElse) {
  ASSERT_TRUE(WritePage("page"));
  ASSERT_TRUE(WritePage("page", "serial = 'A1'"));
  EXPECT_THAT(FilesOf("page").at("data.js"), Not(HasSubstr("A2")));
  // Somebody has put a file of his own there, which stays.
  folder_.Write("page/notes.txt", "mine");
  ASSERT_TRUE(WritePage("page"));
  EXPECT_EQ(TemporaryFolder::Read(folder_.Path("page/notes.txt")), "mine");
  // A folder of something else, and a file.
  fs::create_directories(folder_.Path("other"));
  folder_.Write("other/index.html", "<p>mine");
  const Result<FleetPageSummary> refused = WritePage("other");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("other/index.html"));
  EXPECT_EQ(TemporaryFolder::Read(folder_.Path("other/index.html")), "<p>mine");
  EXPECT_FALSE(WritePage("fleet.db"));
  EXPECT_TRUE(WritePage("empty/"));
}

TEST_F(FleetPage, StaysAsItWasWhereNoneCanBeMade) {
  ASSERT_TRUE(WritePage("page"));
  const auto before = FilesOf("page");
  const Result<FleetPageSummary> unknown = WritePage("page", "no_such_column = 1");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().kind(), ErrorKind::kUsage);
  const Result<FleetPageSummary> none = WritePage("page", "serial = 'B'");
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("serial = 'B'"));
  EXPECT_EQ(FilesOf("page"), before);
  // Nor is anything left beside it.
  for (const auto& entry : fs::directory_iterator(folder_.Path(""))) {
    EXPECT_THAT(entry.path().filename().string(), Not(HasSubstr(".tmp-")));
  }
}

// The output folder of a run may have moved since, with the store in it.
TEST_F(FleetPage, LinksToReportsWhereTheyAreNow) {
  UnitRun run = PageRun("A 5", 5, Verdict::kPass);
  run.folder = "gone/units/A%205/" + run.id;
  ASSERT_TRUE(store_->Add(run));
  fs::create_directories(folder_.Path("units/A%205/" + run.id));
  folder_.Write("units/A%205/" + run.id + "/report.html", "<p>report");
  EXPECT_EQ(WritePage("page")->reports, 1U);
  EXPECT_THAT(FilesOf("page").at("data.js"),
              AllOf(HasSubstr("\"../units\""), HasSubstr("\"A%25205/" + run.id + "\"")));
}

TEST_F(FleetPage, HasTheLinesStatistics) {
  ASSERT_TRUE(WritePage("page"));
  const std::map<std::string, std::string> files = FilesOf("page");
  EXPECT_THAT(files.at("data.js"),
              AllOf(HasSubstr("\"line\":{\"tables\":[{\"heading\":\"2 OF 3 GOOD"),
                    HasSubstr("\"charts\":[")));
}

}  // namespace fleet_page_test
}  // namespace truetriad::fleet
