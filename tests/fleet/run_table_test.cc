// SPDX-License-Identifier: Apache-2.0
#include "fleet/run_table.h"

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "fleet/run_samples.h"
#include "io/temporary_folder.h"

namespace truetriad::fleet {
namespace run_table_test {

using ::testing::HasSubstr;

class Exporting : public ::testing::Test {
 protected:
  Exporting() {
    UnitRun first = SampleRun("1", "A\n\"1\""), second = SampleRun("2", "A\n\"1\"");
    second.log_bytes += 1;  // Of another recording.
    second.readings[0].digest = "0b2f";
    second.parameters[0].value = 1.0 / 3.0;
    UnitRun refused = SampleRun("3", "-B2");
    refused.verdict = Verdict::kNoResult;
    refused.parameters.clear();
    refused.covariance.clear();
    for (const UnitRun& run : {first, second, refused}) EXPECT_TRUE(store_->Add(run));
  }
  /// Records and fields by RFC 4180.
  static std::vector<std::vector<std::string>> Records(const std::string& text) {
    std::vector<std::vector<std::string>> records(1, {""});
    bool is_quoted = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
      std::string& field = records.back().back();
      if (is_quoted && text[i] == '"' && i + 1 < text.size() && text[i + 1] == '"') {
        field += text[++i];
      } else if (text[i] == '"') {
        is_quoted = !is_quoted;
      } else if (is_quoted) {
        field += text[i];
      } else if (text[i] == ',') {
        records.back().emplace_back();
      } else if (text[i] == '\r' && text[i + 1] == '\n') {
        ++i;
        records.push_back({""});
      } else {
        field += text[i];
      }
    }
    records.pop_back();
    return records;
  }

  const TemporaryFolder folder_;
  std::unique_ptr<Store> store_ = *OpenStore(folder_.Path("fleet.db"));
  const std::string path_ = folder_.Path("runs");
};

TEST_F(Exporting, ToCsvGivesARowARunThatCounts) {
  const Result<std::size_t> runs = ExportCsv(*store_, {.only_standing = true}, path_);
  ASSERT_TRUE(runs) << runs.error().message;
  EXPECT_EQ(*runs, 2u);
  const auto records = Records(TemporaryFolder::Read(path_));
  ASSERT_EQ(records.size(), 3u);
  const std::vector<std::string>& names = records[0];
  for (const auto& record : records) ASSERT_EQ(record.size(), names.size());
  const auto field = [&](std::size_t row, const std::string& name) {
    const auto at = std::find(names.begin(), names.end(), name);
    EXPECT_NE(at, names.end()) << name;
    return records[row][static_cast<std::size_t>(at - names.begin())];
  };
  // What a spreadsheet would calculate is text.
  EXPECT_EQ(field(1, "serial"), "'-B2");
  EXPECT_EQ(field(1, "note"), "'=1+1, \"x\"");
  EXPECT_EQ(field(1, "verdict"), "NO_RESULT");
  EXPECT_EQ(field(2, "serial"), "A\n\"1\"");
  EXPECT_EQ(field(2, "run"), SampleId("2"));
  EXPECT_EQ(field(2, "lot"), "L17");
  EXPECT_EQ(field(2, "log_modified_ns"), "1795570000123456789");
  const Parameter first = SampleRun("2", "A").parameters[0];
  EXPECT_EQ(std::stod(field(2, first.name)), 1.0 / 3.0);
  EXPECT_EQ(std::stod(field(2, first.name + ".sigma")), first.sigma);
  EXPECT_EQ(field(1, first.name), "");
  EXPECT_EQ(field(2, "accelerometer.bias.x.judged"), "0.1");
}

TEST_F(Exporting, SaysWhatPeopleDecidedOfTheRunThatCounts) {
  ASSERT_TRUE(store_->Dispose({.id = "d",
                               .serial = "A\n\"1\"",
                               .created = "2026-11-25T12:00:00Z",
                               .who = "R. Roe",
                               .why = "bent",
                               .verdict = Verdict::kFail}));
  ASSERT_TRUE(ExportCsv(*store_, {}, path_));
  const auto records = Records(TemporaryFolder::Read(path_));
  const auto& names = records[0];
  const auto at = static_cast<std::size_t>(std::find(names.begin(), names.end(), "final_verdict") -
                                           names.begin());
  ASSERT_EQ(records.size(), 4u);
  const auto last_four = [&](std::size_t row) {
    const auto begin = records[row].begin() + static_cast<std::ptrdiff_t>(at);
    return std::vector<std::string>(begin, begin + 4);
  };
  using ::testing::ElementsAre;
  EXPECT_THAT(last_four(1), ElementsAre("NO_RESULT", "NO_RESULT", "1", ""));
  EXPECT_THAT(last_four(2), ElementsAre("", "", "", ""));
  EXPECT_THAT(last_four(3), ElementsAre("FAIL", "PASS", "2", "R. Roe"));
  // A tag is asked for by its name.
  EXPECT_EQ(*ExportCsv(*store_, {.where = "lot = 'L17' AND serial LIKE '-%'"}, path_), 1u);
}

TEST_F(Exporting, TakesTheRunsThatAConditionNames) {
  EXPECT_EQ(*ExportCsv(*store_, {}, path_), 3u);
  EXPECT_EQ(*ExportCsv(*store_, {.where = "verdict = 'NO_RESULT' -- only"}, path_), 1u);
  EXPECT_EQ(*ExportCsv(*store_, {.only_standing = true, .where = "attempts > 1"}, path_), 1u);
  EXPECT_EQ(*ExportCsv(*store_, {.where = "serial = ''"}, path_), 0u);
  const std::string before = TemporaryFolder::Read(path_);
  for (const char* const where : {"verdic = 1", "1; DROP TABLE run", "'"}) {
    EXPECT_FALSE(ExportCsv(*store_, {.where = where}, path_)) << where;
  }
  EXPECT_FALSE(ExportCsv(*store_, {}, folder_.Path("no/folder")));
  EXPECT_EQ(TemporaryFolder::Read(path_), before);
}

TEST_F(Exporting, ToATypedTableKeepsEveryField) {
  ASSERT_TRUE(ExportTypedTable(*store_, {}, path_));
  std::istringstream lines(TemporaryFolder::Read(path_));
  std::string line;
  std::getline(lines, line);
  const auto columns = nlohmann::json::parse(line);
  EXPECT_EQ(columns[1]["name"], "serial");
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(std::getline(lines, line));
    EXPECT_EQ(nlohmann::json::parse(line).size(), columns.size());
  }
  EXPECT_THAT(line, HasSubstr("\"A\\n\\\"1\\\"\""));
}

// More units than are read at once, and units with several runs.
TEST_F(Exporting, TakesEveryRunOnceHoweverManyUnits) {
  std::vector<UnitRun> runs;
  UnitRun run = SampleRun("", "");
  run.covariance.clear();
  run.parameters.resize(1);
  for (int i = 0; i < 730; ++i) {
    run.id = "r" + std::to_string(i);
    run.serial = "u" + std::to_string(i % 365);
    runs.push_back(run);
  }
  ASSERT_TRUE(store_->AddAll(runs));
  std::vector<std::string> ids;
  std::string before;
  ASSERT_TRUE(store_->ForEachRun({}, [&](const UnitRun& one) -> Status {
    EXPECT_LT(before, one.serial + "\x01" + one.id);
    before = one.serial + "\x01" + one.id;
    EXPECT_EQ(one.tags.lot, "L17");
    ids.push_back(one.id);
    return {};
  }));
  EXPECT_EQ(ids.size(), 733u);
}

}  // namespace run_table_test
}  // namespace truetriad::fleet
