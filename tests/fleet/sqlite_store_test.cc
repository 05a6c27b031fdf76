// SPDX-License-Identifier: Apache-2.0
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "fleet/database.h"
#include "fleet/store_samples.h"
#include "io/temporary_folder.h"

namespace truetriad::fleet {
namespace sqlite_store_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class SqliteStoreTest : public ::testing::Test {
 protected:
  static void Execute(const std::string& path, const std::string& sql) {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(database);
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_.Path("fleet.db");
};

TEST_F(SqliteStoreTest, SaysThatItsNumberOfShardsIsNone) {
  const Result<std::unique_ptr<Store>> store = OpenStore(path_);
  ASSERT_TRUE(store);
  Execute(path_, "INSERT INTO fact VALUES ('shards', 'x')");
  const Result<StoreHeader> header = (*store)->Header();
  ASSERT_FALSE(header);
  EXPECT_THAT(header.error().message, HasSubstr("`shards` is `x`"));
}

TEST_F(SqliteStoreTest, SaysThatAVerdictIsNone) {
  const Result<std::unique_ptr<Store>> store = OpenStore(path_);
  ASSERT_TRUE(store);
  ASSERT_TRUE((*store)->Add(RunOf("1", Verdict::kPass)));
  Execute(path_, "UPDATE run SET verdict = 'pass'");
  const Status status = (*store)->ForEachRun({}, [](const UnitRun&) { return Status(); });
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message,
              HasSubstr("run 1: its verdict is `pass`, which is not a verdict"));
}

TEST_F(SqliteStoreTest, KnowsTheLastRunsOfManyLogs) {
  const Result<std::unique_ptr<Store>> store = OpenStore(path_);
  ASSERT_TRUE(store);
  // Two runs each of more logs than are asked for at once.
  Execute(
      path_,
      "INSERT INTO unit VALUES ('A1');"
      "WITH RECURSIVE number (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM number WHERE i < 50002)"
      "INSERT INTO run SELECT printf('%06d', i), 'A1', printf('%d.csv', i / 2), i, 0, '', '', '', "
      "'', '', 'PASS', '', '', '', 0, 0, 0, NULL, NULL, '', '' FROM number");
  const std::vector<UnitRun> runs = LastRuns(**store);
  std::set<std::string> logs;
  for (const UnitRun& run : runs) {
    logs.insert(run.log);
    EXPECT_TRUE(run.log_bytes % 2 == 1 || run.log_bytes == 50002) << run.log;
  }
  EXPECT_EQ(logs.size(), 25002u);
  EXPECT_EQ(runs.size(), 25002u);
}

TEST_F(SqliteStoreTest, IsNotTakenForWhatItIsNot) {
  EXPECT_FALSE(OpenStoreToRead(path_));
  Execute(folder_.Path("other.db"), "CREATE TABLE x (y)");
  const auto other = OpenStore(folder_.Path("other.db"));
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("that truetriad has not written"));
  EXPECT_FALSE(OpenStore(folder_.Write("log.csv", "time[s],accel_x[m/s^2]\n0,1\n")));
  EXPECT_FALSE(OpenStore("mysql://host/x"));
}

TEST_F(SqliteStoreTest, RefusesAnotherVersion) {
  ASSERT_TRUE(OpenStore(path_));
  for (const auto& [change, found] :
       {std::pair{"UPDATE fact SET value = '99' WHERE name = 'schema_version'",
                  "has the schema of version 99"},
        std::pair{"DELETE FROM fact WHERE name = 'schema_version'", "states no version"}}) {
    Execute(path_, change);
    for (const auto& open : {OpenStore, OpenStoreToRead}) {
      const auto other = open(path_);
      ASSERT_FALSE(other);
      EXPECT_EQ(other.error().code, ErrorCode::kStoreFailure);
      EXPECT_THAT(other.error().message,
                  AllOf(HasSubstr(path_),
                        HasSubstr(found),
                        HasSubstr("this program reads and writes version 6"),
                        HasSubstr("calibrate its logs into a new store")));
    }
  }
}

TEST_F(SqliteStoreTest, SaysWhereItsLocksDoNotHold) {
  EXPECT_EQ(NetworkFileSystemName(0x6969), "NFS");
  EXPECT_EQ(NetworkFileSystemName(static_cast<long>(0xFF534D42)), "SMB");
  EXPECT_EQ(NetworkFileSystemName(0xEF53), "");
}

}  // namespace sqlite_store_test
}  // namespace truetriad::fleet
