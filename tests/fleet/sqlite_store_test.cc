// SPDX-License-Identifier: Apache-2.0
#include "fleet/sqlite_store.h"

#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "fleet/schema.h"
#include "fleet/store_samples.h"
#include "io/temporary_folder.h"

namespace truetriad::fleet {
namespace sqlite_store_test {

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

// A store of the first version, with rows in it.
TEST_F(SqliteStoreTest, BringsAnOlderStoreUpToDate) {
  std::string tables(kMigrations[0]);
  for (const auto& [from, to] :
       {std::pair{"{text}", "TEXT"}, {"{real}", "REAL"}, {"{bytes}", "BLOB"}}) {
    for (std::size_t at = 0; (at = tables.find(from)) != std::string::npos;) {
      tables.replace(at, std::string_view(from).size(), to);
    }
  }
  Execute(path_,
          tables +
              "INSERT INTO unit VALUES ('A1');"
              "INSERT INTO run VALUES ('1', 'A1', 'a.csv', 5, 6, 'c', 's', 'h', '', '', 'PASS', "
              "'', '', 'poses', 0.5, 0.5, 10, x'0102');"
              "INSERT INTO finding VALUES ('1', 1, 'message', 'note', NULL, NULL, NULL, 'told');"
              "INSERT INTO fact VALUES ('shards', '4');"
              "PRAGMA application_id = 1953654388; PRAGMA user_version = 1; "
              "PRAGMA journal_mode = WAL");
  {
    const Result<std::unique_ptr<Store>> to_read = OpenStoreToRead(path_);
    ASSERT_TRUE(to_read) << to_read.error().message;
    EXPECT_THAT(Ask(**to_read, "SELECT serial, final_verdict, attempts, covariance FROM standing"),
                ElementsAre(ElementsAre("A1", "PASS", "1", "0102")));
    EXPECT_THAT(Ask(**to_read, "SELECT text, remedy, \"values\" FROM finding"),
                ElementsAre(ElementsAre("told", std::nullopt, std::nullopt)));
  }
  const Result<std::unique_ptr<Store>> store = OpenStore(path_);
  ASSERT_TRUE(store);
  EXPECT_FALSE((*store)->StateShard({0, 5}));
  ASSERT_TRUE((*store)->Add(RunOf("2", Verdict::kPass)));
  EXPECT_THAT(Ask(**store, "SELECT run FROM standing"), ElementsAre(ElementsAre("2")));
}

// One of the second version, with what people had decided.
TEST_F(SqliteStoreTest, KeepsTheDecisionsOfAnOlderStore) {
  {
    // Of today, and taken back to what it was.
    ASSERT_TRUE(OpenStore(path_));
    Execute(path_,
            "DROP VIEW standing; DROP VIEW latest; DROP VIEW measured; DROP INDEX input_of_content;"
            "ALTER TABLE finding DROP COLUMN treatment;"
            "ALTER TABLE run DROP COLUMN temperature_degc;"
            "ALTER TABLE run DROP COLUMN recorded; ALTER TABLE run DROP COLUMN recorded_by;"
            "ALTER TABLE station_check DROP COLUMN recording;"
            "ALTER TABLE station_check DROP COLUMN repeatability;"
            "DELETE FROM fact; PRAGMA user_version = 2;"
            "CREATE VIEW latest AS SELECT * FROM run; CREATE VIEW standing AS SELECT * FROM run;"
            "INSERT INTO unit VALUES ('A1');"
            "INSERT INTO run VALUES ('1', 'A1', 'a.csv', 5, 6, 'c', 's', 'h', '', '', 'PASS', "
            "'', '', 'poses', 0.5, 0.5, 10, NULL);"
            "INSERT INTO disposition VALUES ('d', '1', 'c', 'R. Roe', 'FAIL', 'bent');"
            "INSERT INTO station_check VALUES ('k', 'S3', 'G', 'c', 1, 0.5, 2, 'p', 'l')");
  }
  const Result<std::unique_ptr<Store>> store = OpenStoreToRead(path_);
  ASSERT_TRUE(store) << store.error().message;
  EXPECT_THAT(Ask(**store, "SELECT final_verdict, disposed_by, disposed_why FROM standing"),
              ElementsAre(ElementsAre("FAIL", "R. Roe", "bent")));
  const auto check = (*store)->LastStationCheck("S3");
  ASSERT_TRUE(check && *check);
  EXPECT_EQ((*check)->recording, "");
  EXPECT_NE(*(*store)->Identity(), "");
}

TEST_F(SqliteStoreTest, SaysThatItsNumberOfShardsIsNone) {
  const Result<std::unique_ptr<Store>> store = OpenStore(path_);
  ASSERT_TRUE(store);
  Execute(path_, "INSERT INTO fact VALUES ('shards', 'x')");
  const Result<StatedShards> shards = (*store)->Shards();
  ASSERT_FALSE(shards);
  EXPECT_THAT(shards.error().message, HasSubstr("`shards` is `x`"));
}

TEST_F(SqliteStoreTest, SaysThatAVerdictIsNone) {
  const Result<std::unique_ptr<Store>> store = OpenStore(path_);
  ASSERT_TRUE(store);
  ASSERT_TRUE((*store)->Add(RunOf("1", Verdict::kPass)));
  Execute(path_, "UPDATE run SET verdict = 'pass'");
  const Status status = (*store)->ForEachRun({}, [](const UnitRun&) { return Status(); });
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("run 1: its verdict is `pass`, which is none"));
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
  const Result<std::vector<KnownRun>> runs = (*store)->LastRuns();
  ASSERT_TRUE(runs);
  std::set<std::string> logs;
  for (const KnownRun& run : *runs) {
    logs.insert(run.log);
    EXPECT_TRUE(run.log_bytes % 2 == 1 || run.log_bytes == 50002) << run.log;
  }
  EXPECT_EQ(logs.size(), 25002u);
  EXPECT_EQ(runs->size(), 25002u);
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
  EXPECT_EQ(newer.error().code, ErrorCode::kStoreFailure);
  EXPECT_FALSE(OpenStoreToRead(path_));
}

TEST_F(SqliteStoreTest, SaysWhereItsLocksDoNotHold) {
  EXPECT_EQ(NetworkFileSystemName(0x6969), "NFS");
  EXPECT_EQ(NetworkFileSystemName(static_cast<long>(0xFF534D42)), "SMB");
  EXPECT_EQ(NetworkFileSystemName(0xEF53), "");
}

}  // namespace sqlite_store_test
}  // namespace truetriad::fleet
