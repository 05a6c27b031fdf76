// SPDX-License-Identifier: Apache-2.0
#include "fleet/store.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "fleet/sqlite_store.h"
#include "io/temporary_folder.h"
#include "report/sample_calibration.h"

namespace truetriad::fleet {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class SqliteStoreTest : public ::testing::Test {
 protected:
  static UnitRun RunOf(const std::string& serial) {
    UnitRun run;
    Fill(SampleCalibration(), &run);
    run.id = NewRunId();
    run.serial = serial;
    run.log = serial + ".csv";
    run.config_sha256 = "abc";
    run.tags.lot = "L17";
    return run;
  }
  std::vector<std::vector<std::optional<std::string>>> Ask(Store& store, const std::string& sql) {
    const Result<Table> table = store.Query(sql);
    EXPECT_TRUE(table) << table.error().message;
    return table ? table->rows : std::vector<std::vector<std::optional<std::string>>>();
  }
  static void Execute(const std::string& path, const std::string& sql) {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(database);
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_.Path("fleet.db");
};

TEST_F(SqliteStoreTest, KeepsARunOnceWithAllThatBelongsToIt) {
  Result<std::unique_ptr<Store>> store = OpenStore(path_);
  ASSERT_TRUE(store) << store.error().message;
  const UnitRun run = RunOf("a'; DROP TABLE run; --\n\"");
  ASSERT_TRUE((*store)->Add(run));
  ASSERT_TRUE((*store)->Add(run));
  EXPECT_THAT(Ask(**store, "SELECT count(*) FROM run"), ElementsAre(ElementsAre("1")));
  EXPECT_THAT(Ask(**store, "SELECT serial FROM unit"), ElementsAre(ElementsAre(run.serial)));
  EXPECT_THAT(Ask(**store, "SELECT count(*) FROM parameter"),
              ElementsAre(ElementsAre(std::to_string(run.parameters.size()))));
  EXPECT_THAT(Ask(**store, "SELECT name, value FROM tag"), ElementsAre(ElementsAre("lot", "L17")));
  // To the last bit.
  for (std::size_t i = 0; i < run.parameters.size(); ++i) {
    const auto rows =
        Ask(**store, "SELECT value, sigma FROM parameter WHERE place = " + std::to_string(i + 1));
    EXPECT_EQ(std::stod(*rows[0][0]), run.parameters[i].value);
    EXPECT_EQ(std::stod(*rows[0][1]), run.parameters[i].sigma);
  }
  const auto covariance = Ask(**store, "SELECT length(covariance) FROM run");
  EXPECT_EQ(covariance[0][0], std::to_string(8 * run.covariance.size()));
}

TEST_F(SqliteStoreTest, SaysWhichRunOfALogWasTheLast) {
  Result<std::unique_ptr<Store>> store = OpenStore(path_);
  ASSERT_TRUE(store);
  UnitRun first = RunOf("A1"), second = RunOf("A1");
  first.id = "1";
  second.id = "2";
  second.config_sha256 = "def";
  ASSERT_TRUE((*store)->Add(second));
  ASSERT_TRUE((*store)->Add(first));
  const Result<std::vector<KnownRun>> runs = (*store)->LastRuns();
  ASSERT_TRUE(runs);
  ASSERT_EQ(runs->size(), 1u);
  EXPECT_EQ(runs->front().config_sha256, "def");
  EXPECT_THAT(Ask(**store, "SELECT run FROM latest"), ElementsAre(ElementsAre("2")));
}

TEST_F(SqliteStoreTest, AnswersQuestionsAndNothingElse) {
  Result<std::unique_ptr<Store>> store = OpenStore(path_);
  ASSERT_TRUE(store);
  for (const std::string sql : {"DROP TABLE run",
                                "DELETE FROM run",
                                "SELECT 1; SELECT 2",
                                "SELEC 1",
                                "",
                                "CREATE TABLE x (y)"}) {
    EXPECT_FALSE((*store)->Query(sql)) << sql;
  }
  EXPECT_TRUE((*store)->Query(" SELECT 1 ; "));
}

TEST_F(SqliteStoreTest, HasTheSameNumberOfShardsEveryTime) {
  Result<std::unique_ptr<Store>> store = OpenStore(path_);
  ASSERT_TRUE(store);
  EXPECT_TRUE((*store)->StateShard({0, 4}));
  EXPECT_TRUE((*store)->StateShard({0, 4}));
  const Status other = (*store)->StateShard({0, 5});
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("shared among 4, not 5"));
}

TEST_F(SqliteStoreTest, IsNotTakenForWhatItIsNot) {
  EXPECT_FALSE(OpenStoreToRead(path_));
  Execute(folder_.Path("other.db"), "CREATE TABLE x (y)");
  const auto other = OpenStore(folder_.Path("other.db"));
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("none that `fleet run` has written"));
  EXPECT_FALSE(OpenStore(folder_.Write("log.csv", "time[s],accel_x[m/s^2]\n0,1\n")));
  EXPECT_FALSE(OpenStore("mysql://host/x"));
  ASSERT_TRUE(OpenStore(path_));
  Execute(path_, "PRAGMA user_version = 99");
  const auto newer = OpenStore(path_);
  ASSERT_FALSE(newer);
  EXPECT_THAT(newer.error().message, HasSubstr("version 99 of the tables"));
  EXPECT_FALSE(OpenStoreToRead(path_));
}

TEST_F(SqliteStoreTest, SaysWhereItsLocksDoNotHold) {
  EXPECT_EQ(NetworkFileSystemName(0x6969), "NFS");
  EXPECT_EQ(NetworkFileSystemName(static_cast<long>(0xFF534D42)), "SMB");
  EXPECT_EQ(NetworkFileSystemName(0xEF53), "");
}

}  // namespace
}  // namespace truetriad::fleet
