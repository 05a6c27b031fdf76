// SPDX-License-Identifier: Apache-2.0
#include "fleet/unit_list.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/temporary_folder.h"

namespace truetriad::fleet {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class UnitList : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* folder : {"a", "a/u3", "a/u1.csv.truetriad", "a/.hidden"}) {
      std::filesystem::create_directories(folder_.Path(folder));
    }
    for (const char* file : {"a/u2.csv",
                             "a/u1.csv",
                             "a/notes.txt",
                             "a/u3/recording.yaml",
                             "a/u3/imu.csv",
                             "a/u1.csv.truetriad/x.csv",
                             "a/.hidden/y.csv"}) {
      folder_.Write(file, "time[s]\n");
    }
  }
  std::vector<std::string> Names(const std::vector<std::string>& words) const {
    const Result<std::vector<UnitOrder>> units = ListUnits(words, "");
    EXPECT_TRUE(units) << units.error().message;
    std::vector<std::string> names;
    if (!units) return names;
    for (const UnitOrder& unit : *units) {
      names.push_back(std::filesystem::relative(unit.log, folder_.Path("")).string());
    }
    return names;
  }

  const TemporaryFolder folder_;
};

TEST_F(UnitList, TakesLogsFoldersAndPatterns) {
  EXPECT_THAT(Names({folder_.Path("a")}),
              ElementsAre("a/u1.csv", "a/u2.csv", "a/u3/recording.yaml"));
  EXPECT_THAT(Names({folder_.Path("a/u2.csv"), folder_.Path("a/u1.csv")}),
              ElementsAre("a/u2.csv", "a/u1.csv"));
  EXPECT_THAT(Names({folder_.Path("a/u[12].csv")}), ElementsAre("a/u1.csv", "a/u2.csv"));
  EXPECT_FALSE(ListUnits({folder_.Path("a/v*.csv")}, ""));
  EXPECT_FALSE(ListUnits({folder_.Path("a"), folder_.Path("a/u1.csv")}, ""));
}

TEST_F(UnitList, TakesListsWithSerialsAndTags) {
  const std::string list = folder_.Write(
      "day.csv",
      "\xEF\xBB\xBFlog,serial,lot,part\r\na/u2.csv,\"7,\"\"b\",L1,P\r\n# no\na/u1.csv,8,,\n");
  const Result<std::vector<UnitOrder>> units = ListUnits({list}, "");
  ASSERT_TRUE(units) << units.error().message;
  ASSERT_EQ(units->size(), 2u);
  EXPECT_EQ((*units)[0].serial, "7,\"b");
  EXPECT_THAT((*units)[0].overrides, ElementsAre("run.lot=\"L1\"", "device.part=\"P\""));
  EXPECT_EQ((*units)[1].serial, "8");
  const Result<std::vector<UnitOrder>> wrong =
      ListUnits({folder_.Write("wrong.csv", "log,seriel\na/u1.csv,1\n")}, "");
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, HasSubstr("did you mean `serial`"));
  EXPECT_EQ(wrong.error().place.line, 1);
}

TEST_F(UnitList, TakesSerialsFromNames) {
  const std::string log = folder_.Write("a/A-17_2026.csv", "x\n");
  const auto serial = [&log](const std::string& pattern) {
    const Result<std::vector<UnitOrder>> units = ListUnits({log}, pattern);
    return units ? units->front().serial : units.error().message;
  };
  EXPECT_EQ(serial("{serial}_*.csv"), "A-17");
  EXPECT_EQ(serial("A-{serial}_*"), "17");
  EXPECT_EQ(serial("{serial}"), "A-17_2026.csv");
  EXPECT_THAT(serial("B{serial}.csv"), HasSubstr("is not named like"));
  EXPECT_THAT(serial("*.csv"), HasSubstr("{serial}"));
}

TEST(Shard, TakesEachUnitOnce) {
  std::vector<UnitOrder> units;
  for (int i = 0; i < 400; ++i) units.push_back({.log = std::to_string(i) + ".csv"});
  std::size_t all = 0;
  for (int shard = 0; shard < 4; ++shard) {
    const std::vector<UnitOrder> part = ShardOf(units, shard, 4);
    EXPECT_GT(part.size(), 60u);
    all += part.size();
  }
  EXPECT_EQ(all, 400u);
  EXPECT_EQ(ShardOf(units, 0, 1).size(), 400u);
}

}  // namespace
}  // namespace truetriad::fleet
