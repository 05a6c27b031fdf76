// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fleet/postgres.h"
#include "fleet/store_samples.h"
#include "support/private_postgres.h"

namespace truetriad::fleet {
namespace postgres_store_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

TEST(StoreUrl, IsShownWithoutPasswords) {
  const std::map<std::string, std::string> shown = {
      {"day/fleet.db", "day/fleet.db"},
      {"postgresql://line@db:5432/day", "postgresql://line@db:5432/day"},
      {"postgres://line:secret@db/day", "postgresql://line@db/day"},
      {"postgresql://line:se:cr@et@db/day", "postgresql://"},
      {"postgresql://line:se/cret@db/day", "postgresql://"},
      {"postgresql://line:secret/day", "postgresql://"},
      {"postgresql://[::1]:5432/day", "postgresql://[::1]:5432/day"},
      {"postgresql://line:se?cret@db/day", "postgresql://"},
      {"postgresql:///day?host=/run&password=secret&user=line", "postgresql:///day"},
      {"postgresql://db/day?sslpassword=secret", "postgresql://db/day"},
      {"postgresql:host=/run password=secret dbname=day user=line",
       "postgresql:host=/run dbname=day user=line"},
      {"postgresql:password = 'se host=x \\' cret' host = db", "postgresql:"},
      {"postgresql:password=se\\ host=x host=db", "postgresql:"},
      {"postgresql:secret", "postgresql:"},
  };
  for (const auto& [url, text] : shown) EXPECT_EQ(ShownStore(url), text) << url;
}

/// What libpq does at its call of this number, counted over all connections:
/// nothing, or all of it; and then it is lost.
struct Interruption {
  int at = -1;
  bool is_done = false;
  int count = 0;
};
Interruption interruption;

const Libpq* RealLibpq() { return LoadedLibpq().value(); }

/// The result of a call, or none.
template <typename Call>
PGresult* Interrupted(const Call& call) {
  const bool is_interrupted = interruption.count++ == interruption.at;
  if (is_interrupted && !interruption.is_done) return nullptr;
  PGresult* const result = call();
  if (!is_interrupted) return result;
  RealLibpq()->clear(result);
  return nullptr;
}

const Libpq& InterruptedLibpq() {
  static Libpq libpq = *RealLibpq();
  libpq.exec = [](PGconn* connection, const char* sql) {
    return Interrupted([&] { return RealLibpq()->exec(connection, sql); });
  };
  libpq.execParams = [](PGconn* connection, const char* sql, int count, auto... values) {
    return Interrupted([&] { return RealLibpq()->execParams(connection, sql, count, values...); });
  };
  return libpq;
}

class PostgreSQLStore : public ::testing::Test {
 protected:
  void SetUp() override {
    TRUETRIAD_SKIP_WITHOUT_POSTGRES();
    url_ = server()->NewDatabase();
  }
  static PrivatePostgres* server() { return PrivatePostgres::Get(); }
  Result<std::unique_ptr<Store>> Opened(const Libpq& libpq, double patience_s) const {
    TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<Database> database,
                               OpenPostgres(libpq, url_, Access::kWrite, patience_s));
    return Store::Open(std::move(database));
  }

  std::string url_;
};

// Wherever the connection is lost, and whether the server has still done it or not.
TEST_F(PostgreSQLStore, RepeatsWhatIsInDoubt) {
  interruption = {};
  const auto store = Opened(InterruptedLibpq(), 5.0);
  ASSERT_TRUE(store) << store.error().message;
  interruption.count = 0;
  ASSERT_TRUE((*store)->Add(RunOf("whole")));
  const int operations = interruption.count;
  EXPECT_LE(operations, 9);  // Journeys to the server and back.
  int runs = 1;
  for (const bool is_done : {false, true}) {
    for (int at = 0; at < operations; ++at, ++runs) {
      interruption = {at, is_done};
      const Status status = (*store)->Add(RunOf("A" + std::to_string(runs)));
      EXPECT_TRUE(status) << status.error().message;
    }
  }
  interruption = {};
  EXPECT_THAT(Ask(**store, "SELECT count(*), count(DISTINCT serial) FROM run"),
              ElementsAre(ElementsAre(std::to_string(runs), std::to_string(runs))));
  EXPECT_THAT(Ask(**store,
                  "SELECT DISTINCT (SELECT count(*) FROM parameter WHERE parameter.run = run.run) "
                  "FROM run"),
              SizeIs(1));
}

TEST_F(PostgreSQLStore, ConnectsAnewWhenTheServerIsBack) {
  const auto store = OpenStore(url_);
  ASSERT_TRUE(store) << store.error().message;
  ASSERT_TRUE((*store)->Add(RunOf("A1")));
  server()->Stop();
  std::vector<std::string> notes;
  (*store)->TellNotes([&](const std::string& note) { notes.push_back(note); });
  std::thread later([&] { server()->Start(); });
  const Status status = (*store)->Add(RunOf("A2"));
  later.join();
  EXPECT_THAT(notes, ElementsAre(HasSubstr("the connection was lost")));
  EXPECT_TRUE(status) << status.error().message;
  EXPECT_THAT(Ask(**store, "SELECT serial FROM run ORDER BY serial"),
              ElementsAre(ElementsAre("A1"), ElementsAre("A2")));
}

TEST_F(PostgreSQLStore, GivesUpAServerThatIsGone) {
  const auto store = Opened(*RealLibpq(), 0.5);
  ASSERT_TRUE(store) << store.error().message;
  server()->Stop();
  const Status status = (*store)->Add(RunOf("A1"));
  const auto at_once = OpenStore(url_);
  server()->Start();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kStoreFailure);
  EXPECT_THAT(status.error().message, HasSubstr("not restored within 0.5 s"));
  EXPECT_FALSE(at_once);
  EXPECT_TRUE((*store)->Add(RunOf("A1")));
}

TEST_F(PostgreSQLStore, IsMadeOnceByManyAtOnce) {
  std::vector<std::thread> writers;
  std::vector<std::string> failures(6);
  for (std::string& failure : failures) {
    writers.emplace_back([&] {
      const auto store = OpenStore(url_);
      failure = store ? "" : store.error().message;
    });
  }
  for (std::thread& writer : writers) writer.join();
  for (const std::string& failure : failures) EXPECT_EQ(failure, "");
  EXPECT_EQ(server()->Psql(url_, "SELECT count(*) FROM fact WHERE name = 'store'"), "1");
}

TEST_F(PostgreSQLStore, IsNotTakenForWhatItIsNot) {
  const auto empty = OpenStoreToRead(url_);
  ASSERT_FALSE(empty);
  EXPECT_THAT(empty.error().message, HasSubstr("has no tables"));
  server()->Psql(url_, "CREATE TABLE fact (name TEXT, value TEXT)");
  const auto other = OpenStore(url_);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("that truetriad has not created"));
  server()->Psql(url_, "DROP TABLE fact; CREATE TABLE unit (name TEXT)");
  const auto taken = OpenStore(url_);
  ASSERT_FALSE(taken);
  EXPECT_THAT(taken.error().message, HasSubstr("was not created by truetriad"));
  server()->Psql(url_, "DROP TABLE unit");
  ASSERT_TRUE(OpenStore(url_));
  server()->Psql(url_, "UPDATE fact SET value = 99 WHERE name = 'schema_version'");
  for (const auto& open : {OpenStore, OpenStoreToRead}) {
    const auto newer = open(url_);
    ASSERT_FALSE(newer);
    EXPECT_THAT(newer.error().message, HasSubstr("has the schema of version 99"));
  }
}

TEST_F(PostgreSQLStore, SaysNoPassword) {
  const std::string there = url_.substr(url_.find('?'));
  for (const std::string& url : {"postgresql://u:hunter2@/none" + there,
                                 "postgresql://u:hunter2%zz@/none" + there,
                                 "postgresql://u:hun@hunter2@/none" + there,
                                 "postgresql://u:hunter2/none" + there,
                                 "postgresql://u:1/hunter2@x/none" + there,
                                 std::string("postgresql:host=/nowhere password=a hunter2"),
                                 std::string("postgresql:host=/nowhere password=hunter2")}) {
    const auto store = OpenStore(url);
    ASSERT_FALSE(store) << url;
    EXPECT_THAT(store.error().message, Not(HasSubstr("hunter2")));
  }
}

TEST_F(PostgreSQLStore, TakesTextThatIsNone) {
  const auto store = OpenStore(url_);
  ASSERT_TRUE(store);
  UnitRun run = RunOf("A1");
  run.message = std::string("a\0b\xFF\xC3\xA4\xED\xA0\x80", 9);
  ASSERT_TRUE((*store)->Add(run));
  EXPECT_THAT(Ask(**store, "SELECT message FROM run"),
              ElementsAre(ElementsAre("a\uFFFDb\uFFFDä\uFFFD\uFFFD\uFFFD")));
}

TEST_F(PostgreSQLStore, ChangesNothingForAQuestion) {
  const auto store = OpenStore(url_);
  ASSERT_TRUE(store);
  ASSERT_TRUE((*store)->Add(RunOf("A1")));
  for (const std::string sql : {"COMMIT; DROP TABLE run CASCADE",
                                "COPY run TO PROGRAM 'cat'",
                                "SELECT * INTO more FROM run",
                                "WITH gone AS (DELETE FROM tag RETURNING run) SELECT * FROM gone",
                                "SET synchronous_commit = off",
                                "SELECT 1 / 0"}) {
    const auto answer = (*store)->Query(sql);
    ASSERT_FALSE(answer) << sql;
    EXPECT_EQ(answer.error().code, ErrorCode::kInvalidArgument) << answer.error().message;
  }
  EXPECT_EQ(server()->Psql(url_, "SELECT count(*) FROM tag"), "1");
  // Before version 16 read-only transactions make large objects.
  EXPECT_TRUE((*store)->Query("SELECT lo_create(77)"));
  EXPECT_EQ(server()->Psql(url_, "SELECT count(*) FROM pg_largeobject_metadata"), "0");
}

TEST_F(PostgreSQLStore, AsksNothingThatWasTypedAsASuperuser) {
  ASSERT_TRUE(OpenStore(url_));
  EXPECT_TRUE((*OpenStoreToRead(url_))->AllowTypedText());
  std::string mighty = url_;
  mighty.replace(mighty.find("line@"), 5, "postgres@");
  const Status refused = (*OpenStoreToRead(mighty))->AllowTypedText();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("CREATE ROLE"));
  server()->Psql(mighty, "GRANT pg_write_server_files TO line");
  EXPECT_FALSE((*OpenStoreToRead(url_))->AllowTypedText());
  server()->Psql(mighty, "REVOKE pg_write_server_files FROM line");
  EXPECT_TRUE((*OpenStoreToRead(url_))->AllowTypedText());
}

}  // namespace postgres_store_test
}  // namespace truetriad::fleet
