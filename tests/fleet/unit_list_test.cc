// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "fleet/log_files.h"
#include "io/temporary_folder.h"

namespace truetriad::fleet {
namespace unit_list_test {

namespace fs = std::filesystem;

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class UnitList : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::permissions(folder_.Path(""), fs::perms::all);
    for (const char* folder : {"a", "a/u3", "a/u1.csv.truetriad", "a/.hidden"}) {
      std::filesystem::create_directories(folder_.Path(folder));
    }
    for (const char* file :
         {"a/u2.csv", "a/u1.csv", "a/notes.txt", "a/u1.csv.truetriad/x.csv", "a/.hidden/y.csv"}) {
      folder_.Write(file, "time[s]\n");
    }
    WriteRecording("a/u3", "imu.csv");
  }
  void WriteRecording(const std::string& name, const std::string& table) const {
    folder_.Write(name + "/recording.yaml",
                  "recording: 1\napplied: none\nstreams:\n  accelerometer: { file: " + table +
                      ", time: { column: t, unit: s }, x: x, y: y, z: z, unit: m/s^2 }\n");
    folder_.Write(name + "/" + table, "t,x,y,z\n0,0,0,9.8\n");
  }
  Error ErrorOf(const std::vector<std::string>& words) const {
    const Result<std::vector<UnitOrder>> units = ListUnits(words, "");
    EXPECT_FALSE(units);
    return units ? Error(ErrorCode::kStopped, "none") : units.error();
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
  EXPECT_EQ(ErrorOf({}).code, ErrorCode::kMissingArgument);
}

// Whoever leaves a recording.yaml somewhere hides no unit by it.
TEST_F(UnitList, TakesLogsBesideAndBelowARecording) {
  WriteRecording("a", "raw.csv");
  folder_.Write("a/u1.csv", "time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]\n0,0,0,9\n");
  folder_.Write("a/u2.csv", "time[s],qw,qx,qy,qz,temperature[degC]\n0,1,0,0,0,20\n");
  folder_.Write("a/u4.CSV", "time,Gyr_X\n0,0\n");
  EXPECT_THAT(Names({folder_.Path("a")}),
              ElementsAre("a/recording.yaml", "a/u1.csv", "a/u3/recording.yaml", "a/u4.CSV"));
  // Its tables may be elsewhere.
  folder_.Write("a/.hidden/z.csv", "x\n");
  WriteRecording("a/u3", "../.hidden/z.csv");
  WriteRecording("a/u3", "../raw.csv");
  fs::remove(folder_.Path("a/recording.yaml"));
  EXPECT_THAT(Names({folder_.Path("a")}),
              ElementsAre("a/u1.csv", "a/u2.csv", "a/u3/recording.yaml", "a/u4.CSV"));
}

TEST_F(UnitList, FollowsLinksToFoldersAndEntersEachOnce) {
  fs::create_directories(folder_.Path("b"));
  folder_.Write("b/u9.csv", "time[s]\n");
  fs::create_directory_symlink(folder_.Path("b"), folder_.Path("a/b"));
  fs::create_directory_symlink(folder_.Path("b"), folder_.Path("a/c"));
  fs::create_directory_symlink(folder_.Path("a"), folder_.Path("b/back"));
  const std::vector<std::string> names = Names({folder_.Path("a")});
  EXPECT_EQ(names.size(), 4u);
  EXPECT_THAT(names, ::testing::Contains(::testing::HasSubstr("u9.csv")));
}

TEST_F(UnitList, IsRefusedWhereAFolderCannotBeRead) {
  fs::create_directories(folder_.Path("a/closed"));
  fs::permissions(folder_.Path("a/closed"), fs::perms::none);
  // To root nothing is closed.
  const uid_t user = geteuid();
  ASSERT_TRUE(user != 0 || seteuid(65534) == 0);
  const Error error = ErrorOf({folder_.Path("a")});
  const Error of_pattern = ErrorOf({folder_.Path("a/*/*.csv")});
  ASSERT_TRUE(user != 0 || seteuid(user) == 0);
  EXPECT_EQ(of_pattern.code, ErrorCode::kUnreadableFile);
  EXPECT_EQ(error.code, ErrorCode::kUnreadableFile);
  EXPECT_THAT(error.message, HasSubstr("a/closed: cannot be read: Permission denied"));
}

TEST_F(UnitList, OpensFilesAlone) {
  const std::string pipe = folder_.Path("pipe.csv");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(ErrorOf({pipe}).code, ErrorCode::kUnreadableFile);
  EXPECT_EQ(ErrorOf({"/dev/null"}).code, ErrorCode::kUnreadableFile);
}

TEST_F(UnitList, TakesListsWithSerialsAndTags) {
  const std::string list = folder_.Write(
      "day.csv",
      "\xEF\xBB\xBFlog,serial,lot,part,recorded\r\n"
      "a/u2.csv,\" 7,\"\"b\t\",L1 ,P,2026-11-24 07:00+01:00\r\n# no\na/u1.csv,8 ,,,\n");
  const Result<std::vector<UnitOrder>> units = ListUnits({list}, "");
  ASSERT_TRUE(units) << units.error().message;
  ASSERT_EQ(units->size(), 2u);
  EXPECT_EQ((*units)[0].serial, "7,\"b");
  EXPECT_EQ((*units)[0].serial_from, list + ":2");
  EXPECT_EQ((*units)[0].tags.part, "P");
  EXPECT_EQ((*units)[0].recorded, "2026-11-24T06:00:00Z");
  EXPECT_EQ((*units)[1].recorded, "");
  EXPECT_EQ((*units)[0].tags.lot, "L1");
  EXPECT_EQ((*units)[1].serial, "8");
  const Result<std::vector<UnitOrder>> wrong =
      ListUnits({folder_.Write("wrong.csv", "log,seriel\na/u1.csv,1\n")}, "");
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, HasSubstr("did you mean `serial`"));
  EXPECT_EQ(wrong.error().place.line, 1);
}

TEST_F(UnitList, SaysWhereAListIsMalformed) {
  struct Mistake {
    std::string text, message;
    std::int64_t line;
  };
  for (const Mistake& mistake : std::vector<Mistake>{
           {"log,log\na/u1.csv,a/u2.csv\n", "`log` occurs twice", 1},
           {"log,serial,serial\na/u1.csv,1,2\n", "`serial` occurs twice", 1},
           {"log,serial\na/u1.csv,\"1\na/u2.csv,2\n", "a quotation mark is not closed", 2},
           {"log,serial\n\na/u1.csv\n", "has 1 fields", 3},
           {"log,serial\n,7\n", "names no log", 2},
           {"log,recorded\na/u1.csv,noon\n", "recorded is `noon`; expected", 2},
           {"log,recorded\na/u1.csv,2199-01-01\n", "which is in the future", 2},
           {"log,serial\na/u1.csv,\xED\xA0\x80\n", "is not UTF-8", 2},
           {"log,serial\n", "no line names a log", 0}}) {
    const Error error = ErrorOf({folder_.Write("wrong.csv", mistake.text)});
    EXPECT_THAT(error.message, HasSubstr(mistake.message));
    EXPECT_EQ(error.place.line, mistake.line) << error.message;
  }
}

// One number for all of them would let a good unit stand for a bad one.
TEST_F(UnitList, IsRefusedWhereTheExperimentGivesSeveralLogsOneSerial) {
  const auto check = [&](const std::string& serial_pattern, std::vector<std::string> overrides) {
    const std::string config = folder_.Write("e.yaml",
                                             "experiment: 1\ndevice: { serial: A0001 }\n"
                                             "sensors: { accelerometer: {} }\n");
    const Result<WorkPlan> plan = PlanWork(config, std::move(overrides), {});
    EXPECT_TRUE(plan) << plan.error().message;
    const auto units =
        ListUnits({folder_.Path("a/u1.csv"), folder_.Path("a/u2.csv")}, serial_pattern);
    EXPECT_TRUE(units);
    EXPECT_EQ(CheckSerials(*plan, *units).has_value(),
              CheckSerialsToCome(*plan, serial_pattern).has_value());
    EXPECT_TRUE(CheckSerials(*plan, {units->front()}));
    return CheckSerials(*plan, *units);
  };
  const Status refused = check("", {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind(), ErrorKind::kUsage);
  EXPECT_THAT(refused.error().message,
              HasSubstr("e.yaml:2: device.serial is `A0001`, which would"));
  EXPECT_TRUE(check("{serial}.csv", {}));
  EXPECT_TRUE(check("", {"device.serial=\"\""}));
  WorkPlan plain;
  plain.overrides = {"robust.loss=none", "device.serial=A1"};
  EXPECT_FALSE(CheckSerialsToCome(plain, ""));
}

TEST_F(UnitList, IsRefusedWhereItsSerialIsNotThatOfTheName) {
  const std::string list = folder_.Write("list.csv", "log,serial\na/u1.csv,u1\na/u2.csv,u3\n");
  const Result<std::vector<UnitOrder>> units = ListUnits({list}, "{serial}.csv");
  ASSERT_FALSE(units);
  EXPECT_THAT(units.error().message,
              HasSubstr("list.csv:3: states serial number `u3`, but --serial={serial}.csv"));
  EXPECT_TRUE(ListUnits({list}, "{serial}.log"));
}

TEST_F(UnitList, IsOneThoughItsHeaderIsMisspelt) {
  for (const char* header : {"Log,serial", " log,serial", "log;serial"}) {
    folder_.Write("list.csv", std::string(header) + "\na/u1.csv,U1\n");
    const Error error = ErrorOf({folder_.Path("list.csv")});
    EXPECT_EQ(error.code, ErrorCode::kUnknownColumn) << header;
    EXPECT_EQ(error.message.find("separate its columns by commas") != std::string::npos,
              std::string(header).find(';') != std::string::npos);
  }
  EXPECT_THAT(ErrorOf({folder_.Path("nowhere/*.csv")}).message, HasSubstr("there is no folder "));
}

TEST_F(UnitList, KnowsNamesThatAreNoSerialNumbers) {
  fs::create_directories(folder_.Path("b"));
  folder_.Write("b/u1.csv", "time[s]\n");
  const Result<std::vector<UnitOrder>> units =
      ListUnits({folder_.Path("a/u1.csv"), folder_.Path("a/u2.csv"), folder_.Path("b/u1.csv")}, "");
  ASSERT_TRUE(units);
  EXPECT_TRUE((*units)[0].shares_name && (*units)[2].shares_name);
  EXPECT_FALSE((*units)[1].shares_name);
  const Result<std::vector<UnitOrder>> stated =
      ListUnits({folder_.Path("a/u1.csv"), folder_.Path("b/u1.csv")}, "{serial}.csv");
  ASSERT_TRUE(stated);
  EXPECT_FALSE((*stated)[0].shares_name || (*stated)[1].shares_name);
}

TEST_F(UnitList, TakesSerialsFromNames) {
  const std::string log = folder_.Write("a/A-17_2026.csv", "x\n");
  const auto serial = [&log](const std::string& pattern) {
    const Result<std::vector<UnitOrder>> units = ListUnits({log}, pattern);
    return units ? units->front().serial : units.error().message;
  };
  EXPECT_EQ(serial("{serial}_*.csv"), "A-17");
  EXPECT_EQ(serial("A-{serial}_*"), "17");
  EXPECT_EQ(serial("{serial}"), "A-17_2026");
  EXPECT_THAT(serial("B{serial}.csv"), HasSubstr("does not match the pattern"));
  EXPECT_THAT(serial("*.csv"), HasSubstr("{serial}"));
}

// Shards that name one folder differently would leave units out.
TEST_F(UnitList, HasPlacesWhateverItsFolderIsCalled) {
  const auto places = [&](const std::string& word) {
    std::vector<std::string> found;
    const Result<std::vector<UnitOrder>> units = ListUnits({word}, "");
    EXPECT_TRUE(units) << word;
    for (const UnitOrder& unit : *units) found.push_back(unit.place);
    return found;
  };
  const std::string folder = folder_.Path("a"), list = folder_.Write("list.csv", "log\na/u1.csv\n");
  const std::vector<std::string> expected = places(folder);
  EXPECT_EQ(expected[0], "u1.csv");
  fs::create_directories(folder_.Path("mounted"));
  fs::copy(folder, folder_.Path("mounted/elsewhere"), fs::copy_options::recursive);
  for (const std::string& other : {folder + "/",
                                   folder + "/../a/.",
                                   fs::proximate(folder).string(),
                                   folder_.Path("mounted/elsewhere")}) {
    EXPECT_EQ(places(other), expected) << other;
  }
  EXPECT_THAT(places(list), ElementsAre("a/u1.csv"));
  EXPECT_EQ(places(fs::proximate(list).string()), places(list));
  EXPECT_EQ(places(fs::proximate(folder + "/u1.csv").string()), places(folder + "/./u1.csv"));
}

TEST_F(UnitList, NamesLogsThatAreThere) {
  const std::string list =
      folder_.Write("list.csv", "log,serial\na/u1.csv,A\na/u9.csv,B\nnone/x.csv,C\n");
  const Error error = ErrorOf({list});
  EXPECT_EQ(error.code, ErrorCode::kUnreadableFile);
  EXPECT_EQ(error.place.line, 3);
  EXPECT_THAT(error.message,
              HasSubstr("a/u9.csv, which does not exist (further lines with missing logs: 1)"));
}

TEST(Shard, TakesEachUnitOnce) {
  std::vector<UnitOrder> units;
  for (int i = 0; i < 400; ++i) {
    units.push_back({.log = "", .place = std::to_string(i) + ".csv"});
  }
  std::size_t all = 0;
  for (int shard = 0; shard < 4; ++shard) {
    const std::vector<UnitOrder> part = ShardOf(units, shard, 4);
    EXPECT_GT(part.size(), 60u);
    all += part.size();
  }
  EXPECT_EQ(all, 400u);
  EXPECT_EQ(ShardOf(units, 0, 1).size(), 400u);
}

}  // namespace unit_list_test
}  // namespace truetriad::fleet
