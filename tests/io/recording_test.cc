// SPDX-License-Identifier: Apache-2.0
#include "truetriad/io/recording.h"

#include <cmath>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "io/recording_samples.h"
#include "io/temporary_folder.h"

namespace truetriad {
namespace recording_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kHeader[] = "time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]\n";

class Recording : public ::testing::Test {
 protected:
  /// What reading `text` as a CSV complains about.
  std::string ErrorOf(const std::string& text) {
    return ReadingError(folder_.Write("log.csv", text));
  }
  std::string ErrorOfRows(const std::string& rows) { return ErrorOf(kHeader + rows); }

  RecordingSamples Read(const std::string& text) {
    Result<RecordingSamples> recording = ReadRecording(folder_.Write("log.csv", text));
    EXPECT_TRUE(recording) << recording.error().message;
    return recording ? std::move(*recording) : RecordingSamples();
  }

  TemporaryFolder folder_;
};

TEST_F(Recording, ProposesAHeaderWithTheUnitsThatNamesSay) {
  const std::string rows = "0,1,2,3\n10,1,2,3\n";
  for (const std::string time : {"ms", "t_ms", "millis", "time_ms"}) {
    EXPECT_THAT(ErrorOf(time + ",ax_g,ay_g,az_g\n" + rows),
                HasSubstr("a header like `time[ms],accel_x[g],accel_y[g],accel_z[g]`"));
  }
  EXPECT_THAT(ErrorOf("timestamp_us,gx_dps,gy_dps,gz_dps\n" + rows),
              HasSubstr("a header like `time[us],gyro_x[deg/s],gyro_y[deg/s],gyro_z[deg/s]`"));
  EXPECT_EQ(ErrorOf("time[ms],accel_x[g],accel_y[g],accel_z[g]\n" + rows), "");
}

TEST_F(Recording, MayBeginWithManyRemarks) {
  std::string remarks;
  for (int line = 0; line < 1000; ++line) remarks += "# the shaker was switched off and on again\n";
  const RecordingSamples recording = Read(remarks + kHeader + "0,1,2,3\n1,4,5,6\n");
  EXPECT_THAT(recording.streams[Triad::kAccelerometer].z, ElementsAre(3.0, 6.0));
}

TEST_F(Recording, CarriesTheAmbientTemperatureOnlyWhereItIsAskedFor) {
  const std::string path = folder_.Write(
      "log.csv",
      "time[s],accel_x[g],accel_y[g],accel_z[g],temperature[degC],ambient_temperature[K]\n"
      "0,0,0,1,20,293.15\n1,0,0,1,21,\n");
  for (const bool is_asked : {false, true}) {
    const auto source = OpenRecording(path, {.pose_column = "", .ambient = is_asked});
    ASSERT_TRUE(source) << source.error().message;
    EXPECT_TRUE((*source)->info().streams[0].has_ambient);
    std::vector<SampleBlock> blocks;
    ASSERT_TRUE((*source)->Next(&blocks));
    ASSERT_EQ(blocks.size(), 1U);
    EXPECT_THAT(blocks[0].temperature_degc, ElementsAre(20.0, 21.0));
    ASSERT_EQ(blocks[0].ambient_degc.size(), is_asked ? 2U : 0U);
    // It holds, as the other does.
    if (!is_asked) continue;
    EXPECT_THAT(blocks[0].ambient_degc, ElementsAre(20.0, 20.0));
  }
}

TEST_F(Recording, ReadsASelfDescribingHeader) {
  const RecordingSamples recording = Read(
      "# a comment\n"
      "time[ms],accel_x[g],accel_y[g],accel_z[g],gyro_x[deg/s],gyro_y[deg/s],gyro_z[deg/s],"
      "mag_x[nT],mag_y[nT],mag_z[nT],temperature[K],pose\n"
      "1,2,3,4,5,6,7,8,9,10,293.15,0\n"
      "2,-2,-3,-4,-5,-6,-7,-8,-9,-10,294.15,1\n");
  ASSERT_EQ(recording.info.streams.size(), 3U);
  EXPECT_EQ(recording.info.Find(Triad::kAccelerometer)->unit.name, "g");
  EXPECT_EQ(recording.info.Find(Triad::kMagnetometer)->unit.truth_per_raw, 1e-3);
  const StreamSamples& gyroscope = recording.streams[Triad::kGyroscope];
  EXPECT_THAT(gyroscope.time_ns, ElementsAre(1'000'000, 2'000'000));
  EXPECT_THAT(gyroscope.x, ElementsAre(5.0, -5.0));
  EXPECT_THAT(gyroscope.z, ElementsAre(7.0, -7.0));
  EXPECT_THAT(gyroscope.temperature_degc, ElementsAre(20.0, 21.0));
  EXPECT_THAT(gyroscope.pose, ElementsAre(0, 1));
  EXPECT_THAT(gyroscope.row, ElementsAre(0, 1));
  ASSERT_EQ(recording.inputs.size(), 1U);
  EXPECT_EQ(recording.inputs[0].samples, 2);
  EXPECT_EQ(recording.inputs[0].sha256.size(), 64U);
}

TEST_F(Recording, KeepsEpochTimesExact) {
  const std::string rows = ",1,1,1\n";
  const std::int64_t expected = 1700000000123456789;
  const std::string axes = ",accel_x[g],accel_y[g],accel_z[g]\n";
  for (const std::string time : {"time[ns]|1700000000123456789",
                                 "time[us]|1700000000123456.789",
                                 "time[s]|1700000000.123456789"}) {
    const std::size_t bar = time.find('|');
    const RecordingSamples recording =
        Read(time.substr(0, bar) + axes + time.substr(bar + 1) + rows);
    EXPECT_THAT(recording.streams[Triad::kAccelerometer].time_ns, ElementsAre(expected));
  }
}

TEST_F(Recording, TakesEverySeparatorAndLineEnd) {
  const std::vector<double> expected = {1.0, 4.0};
  for (const std::string text :
       {"time[s],accel_x[g],accel_y[g],accel_z[g]\r\n0,1,2,3\r\n1,4,5,6\r\n",
        "time[s];accel_x[g];accel_y[g];accel_z[g]\n0;1;2;3\n1;4;5;6",
        "time[s]\taccel_x[g]\taccel_y[g]\taccel_z[g]\n0\t1\t2\t3\n1\t4\t5\t6\n",
        "  time[s] accel_x[g]  accel_y[g] \t accel_z[g]\n  0 1   2\t3  \n 1 4 5 6\n",
        "time[s],accel_x[g],accel_y[g],accel_z[g]\n0 1 2 3\n1 4 5 6\n",
        "time[s] accel_x[g] accel_y[g] accel_z[g]\n0;1;2;3\n1;4;5;6\n",
        "sep=;\r\ntime[s];accel_x[g];accel_y[g];accel_z[g]\r\n0;1;2;3\r\n1;4;5;6\r\n",
        "# time[s] accel_x[g] accel_y[g] accel_z[g]\n0 1 2 3\n1 4 5 6\n",
        "\"sep=;\"\ntime[s];accel_x[g];accel_y[g];accel_z[g]\n0;1;2;3\n1;4;5;6\n",
        "sep=\t\ntime[s]\taccel_x[g]\taccel_y[g]\taccel_z[g]\n0\t1\t2\t3\n1\t4\t5\t6\n",
        "# of the bench\n#time[s],accel_x[g],accel_y[g],accel_z[g]\n0,1,2,3\n1,4,5,6\n",
        "# time[s],accel_x[g],accel_y[g],accel_z[g]\n# at noon\n0,1,2,3\n1,4,5,6\n",
        "# time[s], accel_x[g], accel_y[g], accel_z[g]\n0 1 2 3\n1 4 5 6\n",
        "#\ttime[s]\taccel_x[g]\taccel_y[g]\taccel_z[g]\n0\t1\t2\t3\n1\t4\t5\t6\n",
        "time[s] , accel_x [g] , accel_y[g], accel_z[g]\n 0 , +1 , 2 , 3 \n1,4,5,6\n",
        "\xEF\xBB\xBFtime[s],accel_x[g],accel_y[g],accel_z[g]\n\n0,1,2,3\n# pause\n\n1,4,5,6\n"}) {
    EXPECT_EQ(Read(text).streams[Triad::kAccelerometer].x, expected) << text;
  }
}

TEST_F(Recording, RefusesATableOnItsSide) {
  std::string header = "time[s]", row = "0";
  for (int i = 0; i < 5000; ++i) {
    header += ",a" + std::to_string(i);
    row += ",0";
  }
  EXPECT_THAT(ErrorOf(header + "\n" + row + "\n"),
              AllOf(HasSubstr("has 5001 columns"), HasSubstr("transposed")));
}

TEST_F(Recording, DropsAndCountsRowsOfASlowerSensor) {
  const RecordingSamples recording = Read(
      "time[s],accel_x[g],accel_y[g],accel_z[g],mag_x[uT],mag_y[uT],mag_z[uT],temperature[degC]\n"
      "0,1,2,3,,,,\n"
      "1,1,2,3,7,8,9,25\n"
      "2,nan,2,3,NaN,8,9,\n"
      "3,4,5,6,-nan,,,\n");
  const StreamSamples& accelerometer = recording.streams[Triad::kAccelerometer];
  EXPECT_THAT(accelerometer.time_ns, ElementsAre(0, 1'000'000'000, 3'000'000'000));
  EXPECT_THAT(accelerometer.row, ElementsAre(0, 1, 3));
  EXPECT_EQ(recording.counts[Triad::kAccelerometer].dropped_empty, 1);
  EXPECT_THAT(recording.streams[Triad::kMagnetometer].x, ElementsAre(7.0));
  EXPECT_EQ(recording.counts[Triad::kMagnetometer].dropped_empty, 3);
  // A temperature holds until the next one.
  EXPECT_TRUE(std::isnan(accelerometer.temperature_degc[0]));
  EXPECT_EQ(accelerometer.temperature_degc[1], 25.0);
  EXPECT_EQ(accelerometer.temperature_degc[2], 25.0);
}

TEST_F(Recording, HasRowsOnlyWithoutATimeColumn) {
  const RecordingSamples recording = Read("mag_x[uT],mag_y[uT],mag_z[uT]\n1,2,3\n4,5,6\n");
  EXPECT_FALSE(recording.info.has_time);
  EXPECT_THAT(recording.streams[Triad::kMagnetometer].time_ns, ElementsAre(0, 1));
}

TEST_F(Recording, ReadsTheSameFromGzip) {
  std::string text = kHeader;
  for (int i = 0; i < 50'000; ++i) {
    text += std::to_string(i) + "," + std::to_string(i * 0.001) + ",2,3\n";
  }
  const Result<RecordingSamples> plain = ReadRecording(folder_.Write("log.csv", text));
  const Result<RecordingSamples> packed = ReadRecording(folder_.WriteGzip("log.csv.gz", text));
  ASSERT_TRUE(plain);
  ASSERT_TRUE(packed) << packed.error().message;
  const StreamSamples& expected = plain->streams[Triad::kAccelerometer];
  EXPECT_EQ(expected.x.size(), 50'000U);
  EXPECT_EQ(packed->streams[Triad::kAccelerometer].x, expected.x);
  EXPECT_EQ(packed->streams[Triad::kAccelerometer].time_ns, expected.time_ns);
  EXPECT_EQ(packed->streams[Triad::kAccelerometer].row, expected.row);
}

TEST_F(Recording, AcceptsEqualTimesButNotTimeGoingBackwards) {
  EXPECT_EQ(ErrorOfRows("1,1,1,1\n1,1,1,1\n"), "");
  EXPECT_THAT(ErrorOfRows("1,1,1,1\n2,1,1,1\n1.5,1,1,1\n"),
              HasSubstr("log.csv:4: column `time[s]`: time goes backwards to 1.5 s after 2 s"));
}

TEST_F(Recording, RefusesTimesWhoseDifferencesAreNoTime) {
  EXPECT_THAT(ErrorOfRows("-9e9,1,1,1\n9e9,1,1,1\n"),
              HasSubstr("log.csv:2: column `time[s]`: `-9e9` is out of range for a time"));
  EXPECT_EQ(ErrorOfRows("-4.6e9,1,1,1\n4.6e9,1,1,1\n"), "");
}

// As `to_csv` of pandas writes an index.
TEST_F(Recording, ReadsFieldsInQuotationMarks) {
  const RecordingSamples recording = Read(
      "\"time[s]\",\"accel_x[g]\",\"accel_y[g]\",\"accel_z[g]\",\"note, by hand\"\n"
      "\"0\",\"1\",\" 2 \",3,\"a, \"\"b\"\"\"\n0.5,\"4\",5,6,\"\"\n1,\"\",5,6,x\n");
  EXPECT_THAT(recording.streams[Triad::kAccelerometer].x, ElementsAre(1.0, 4.0));
  EXPECT_THAT(recording.streams[Triad::kAccelerometer].y, ElementsAre(2.0, 5.0));
  EXPECT_THAT(ErrorOfRows("0,\"1,2,3\n"), HasSubstr("is not a number"));
  EXPECT_THAT(ErrorOfRows("0,\"1 2\",2,3\n"), HasSubstr("`1 2` is not a number"));
}

TEST_F(Recording, ReadsUnitsAsOthersWriteThem) {
  const auto unit_of = [&](const std::string& prefix, const std::string& unit) {
    const std::string path =
        folder_.Write("log.csv",
                      "time[s]," + prefix + "_x[" + unit + "]," + prefix + "_y[" + unit + "]," +
                          prefix + "_z[" + unit + "]\n0,1,2,3\n");
    const auto source = OpenRecording(path);
    return source ? (*source)->info().streams[0].unit.name : source.error().message;
  };
  EXPECT_EQ(unit_of("gyro", "dps"), "deg/s");
  EXPECT_EQ(unit_of("gyro", "LSB"), "counts");
  EXPECT_EQ(unit_of("accel", "m/s²"), "m/s^2");
  for (const char* micro : {"\u00b5T", "\u03bcT"}) EXPECT_EQ(unit_of("mag", micro), "uT");
}

TEST_F(Recording, NamesTheColumnsThatNothingIsReadFrom) {
  const auto source = OpenRecording(folder_.Write(
      "log.csv",
      "time[s],accel_x[g],accel_y[g],accel_z[g],status,pressure[hPa]\n0,1,2,3,ok,1013\n"));
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_THAT((*source)->info().ignored_columns, ElementsAre("status", "pressure"));
}

TEST_F(Recording, PassesOverAFirstColumnWithoutAName) {
  const RecordingSamples recording =
      Read(",time[s],accel_x[g],accel_y[g],accel_z[g]\n0,0,1,2,3\n1,0.5,4,5,6\n");
  EXPECT_THAT(recording.streams[Triad::kAccelerometer].x, ElementsAre(1.0, 4.0));
  EXPECT_THAT(recording.info.ignored_columns, ElementsAre("without a name (row numbers)"));
  EXPECT_THAT(ErrorOf(",accel_x[g],accel_y[g],accel_z[g]\n0.01,1,2,3\n0.02,4,5,6\n"),
              HasSubstr("log.csv:1: the first column has no name and does not hold row numbers"));
}

// Times in whole numbers step otherwise than rows do, of which some may have been taken out.
TEST_F(Recording, TakesNoTimeInWholeNumbersForRowNumbers) {
  const auto table = [](const std::function<long(long)>& number, const std::string& begin) {
    std::string text = begin + "accel_x[g],accel_y[g],accel_z[g]\n";
    for (long i = 0; i < 40; ++i) text += std::to_string(number(i)) + ",1,2,3\n";
    return text;
  };
  for (const auto& number :
       std::vector<std::function<long(long)>>{[](long i) { return 20 * i; },
                                              [](long i) { return 5000 - i; },
                                              [](long i) { return i * i; },
                                              [](long i) { return 1'700'000'000 + i; },
                                              [](long i) { return i < 3 ? i : 3; }}) {
    EXPECT_THAT(ErrorOf(table(number, ",")), HasSubstr("does not hold row numbers")) << number(5);
    EXPECT_THAT(ErrorOf(table(number, "")), HasSubstr("fields; expected")) << number(5);
  }
  const auto every_fifth_left_out = [](long i) { return i + i / 4; };
  for (const std::string begin : {",", ""}) {
    const RecordingSamples recording = Read(table(every_fifth_left_out, begin));
    EXPECT_EQ(recording.streams[Triad::kAccelerometer].x.size(), 40U);
  }
}

// As pandas (`index_label=False`) and R write a table.
TEST_F(Recording, PassesOverRowNumbersThatTheHeaderLeavesOut) {
  for (const std::string rows : {"0,0,1,2,3\n1,0.5,4,5,6\n", "\"1\",0,1,2,3\n\"2\",0.5,4,5,6\n"}) {
    const RecordingSamples recording = Read("time[s],accel_x[g],accel_y[g],accel_z[g]\n" + rows);
    EXPECT_THAT(recording.streams[Triad::kAccelerometer].x, ElementsAre(1.0, 4.0));
    EXPECT_THAT(recording.streams[Triad::kAccelerometer].time_ns, ElementsAre(0, 500'000'000));
    EXPECT_THAT(recording.info.ignored_columns, ElementsAre("without a name (row numbers)"));
  }
  const RecordingSamples blanks =
      Read("accel_x[g] accel_y[g] accel_z[g]\n1 1 2 3\n2 4 5 6\n3 7 8 9\n");
  EXPECT_THAT(blanks.streams[Triad::kAccelerometer].x, ElementsAre(1.0, 4.0, 7.0));
}

TEST_F(Recording, DoesNotTakeANumberTooManyForThatOfItsRow) {
  // No numbers of rows; a named column that counts; one row of them.
  for (const std::string text :
       {"time[s],accel_x[g],accel_y[g],accel_z[g]\n0,1,2,3,9\n0.5,4,5,6,9\n",
        "time[s],accel_x[g],accel_y[g],accel_z[g]\n5,0,1,2,3\n7,1,4,5,6\n",
        "n,accel_x[g],accel_y[g],accel_z[g]\n0,1,2,3,9\n1,4,5,6,9\n",
        "time[s],accel_x[g],accel_y[g],accel_z[g]\n0,0,1,2,3\n1,4,5,6\n"}) {
    EXPECT_THAT(ErrorOf(text), HasSubstr("fields; expected")) << text;
  }
}

TEST_F(Recording, TakesSeparatorsAtTheEndForNothing) {
  const std::string header = "time[s],accel_x[g],accel_y[g],accel_z[g]";
  for (const std::string& text : {header + ",\n0,1,2,3\n1,4,5,6\n",
                                  header + ",,\n0,1,2,3\n1,4,5,6\n",
                                  header + "\n0,1,2,3,\n1,4,5,6,\n",
                                  header + ",\n0,1,2,3,,\n1,4,5,6,,\n"}) {
    EXPECT_EQ(ErrorOf(text), "") << text;
  }
  EXPECT_THAT(ErrorOf(header + ",,\n0,1,2,3,8,9\n1,4,5,6,8,9\n"), HasSubstr("without a name"));
}

// Rows of a piece that begins at zero, 10 ms apart.
std::string PieceOfRows(int count) {
  std::string rows;
  for (int i = 0; i < count; ++i) rows += std::to_string(0.01 * i) + ",1,2,3\n";
  return rows;
}

TEST_F(Recording, TakesTimesOnWhereAnotherPieceBeginsIfItMay) {
  const std::string text = kHeader + PieceOfRows(100) + kHeader + PieceOfRows(50);
  const std::string path = folder_.Write("log.csv", text);
  EXPECT_THAT(ReadingError(path), HasSubstr("log.csv:103: column `time[s]`: time goes backwards"));
  const auto source = OpenRecording(path, {.pose_column = "", .may_be_joined = true});
  ASSERT_TRUE(source) << source.error().message;
  std::vector<SampleBlock> blocks;
  ASSERT_TRUE((*source)->Next(&blocks));
  ASSERT_EQ(blocks.size(), 1U);
  ASSERT_EQ(blocks[0].time_ns.size(), 150U);
  for (std::size_t i = 0; i < 150; ++i) {
    EXPECT_EQ(blocks[0].time_ns[i], static_cast<std::int64_t>(i) * 10'000'000) << i;
  }
  const std::vector<RecordingJoint> joints = (*source)->joints();
  ASSERT_EQ(joints.size(), 1U);
  EXPECT_EQ(joints[0].row, 100);
  EXPECT_EQ(joints[0].time_ns, 1'000'000'000);
}

TEST_F(Recording, RefusesPiecesThatAreTogetherLongerThanTimesCanBe) {
  std::string rows;
  for (int piece = 0; piece < 3; ++piece) {
    for (int i = 0; i < 20; ++i) rows += "-4.6e9,1,2,3\n";
    for (int i = 0; i < 20; ++i) rows += std::to_string(4.5e9 + i) + ",1,2,3\n";
  }
  const auto source = OpenRecording(folder_.Write("log.csv", kHeader + rows),
                                    {.pose_column = "", .may_be_joined = true});
  ASSERT_TRUE(source) << source.error().message;
  std::vector<SampleBlock> blocks;
  const auto more = (*source)->Next(&blocks);
  ASSERT_FALSE(more);
  EXPECT_THAT(more.error().message, HasSubstr("log.csv:"));
}

TEST_F(Recording, IsNotSortedByReadingItInPieces) {
  for (const std::string& rows :
       {PieceOfRows(100) + PieceOfRows(15) + PieceOfRows(15), PieceOfRows(15) + "0.10,1,2,3\n"}) {
    const auto source = OpenRecording(folder_.Write("log.csv", kHeader + rows),
                                      {.pose_column = "", .may_be_joined = true});
    ASSERT_TRUE(source) << source.error().message;
    std::vector<SampleBlock> blocks;
    const auto more = (*source)->Next(&blocks);
    ASSERT_FALSE(more);
    EXPECT_THAT(more.error().message, HasSubstr("time goes backwards"));
  }
}

TEST_F(Recording, NamesLineAndColumnOfWhatIsNoNumber) {
  EXPECT_THAT(ErrorOfRows("0,1,2,3\n1,abc,2,3\n"),
              HasSubstr("log.csv:3: column `accel_x[m/s^2]`: `abc` is not a number"));
  EXPECT_THAT(ErrorOfRows("0,1,2,12ab\n"), HasSubstr("column `accel_z[m/s^2]`: `12ab` is not"));
  EXPECT_THAT(ErrorOfRows("0,1,-inf,3\n"), HasSubstr("log.csv:2: column `accel_y[m/s^2]`: `-inf`"));
  EXPECT_THAT(ErrorOfRows("0,1,1e999,3\n"), HasSubstr("too large for a reading"));
  EXPECT_THAT(ErrorOfRows("1e30,1,1,3\n"), HasSubstr("out of range for a time"));
  EXPECT_THAT(ErrorOfRows("0,1 2,2,3\n"), HasSubstr("`1 2` is not a number"));
  EXPECT_THAT(ErrorOf("time[s];accel_x[g];accel_y[g];accel_z[g]\n0;1,5;2;3\n"),
              HasSubstr("use a decimal point"));
}

TEST_F(Recording, SaysThatNulBytesComeFromALogThatWasNotClosed) {
  std::string text = kHeader;
  while (text.size() < 8192) text += "1,1,1,1\n";
  EXPECT_THAT(ErrorOf(text + std::string(64, '\0') + "\n"), HasSubstr("a log that was not closed"));
}

TEST_F(Recording, RefusesRaggedRows) {
  EXPECT_THAT(ErrorOfRows("0,1,2,3\n1,1,2\n2,1,2,3\n"),
              HasSubstr("log.csv:3: has 3 fields; expected 4 as in the header (line 1)"));
  EXPECT_THAT(ErrorOfRows("0,1,2,3,4\n"), HasSubstr("log.csv:2: has 5 fields; expected 4"));
}

TEST_F(Recording, SaysThatAHalfWrittenLastLineIsTruncated) {
  EXPECT_THAT(ErrorOfRows("0,1,2,3\n1,1,2."), HasSubstr("log.csv:3: looks truncated"));
  EXPECT_THAT(ErrorOfRows("0,1,2,3\n1,1,2,-"), HasSubstr("log.csv:3: looks truncated"));
  EXPECT_EQ(ErrorOfRows("0,1,2,3\n1,1,2,3"), "");
}

TEST_F(Recording, RefusesAColumnWithoutUnitAndSaysHowToStateIt) {
  EXPECT_THAT(ErrorOf("time[s],accel_x,accel_y,accel_z\n0,1,2,3\n"),
              HasSubstr("log.csv:1: column `accel_x`: has no unit; state it in the header, like "
                        "`accel_x[m/s^2]`"));
  EXPECT_THAT(ErrorOf("time,accel_x[g],accel_y[g],accel_z[g]\n0,1,2,3\n"), HasSubstr("`time[s]`"));
}

TEST_F(Recording, RefusesHeadersThatItWouldHaveToGuess) {
  EXPECT_THAT(ErrorOf("time[s],accel_x[g],accel_y[mg],accel_z[g]\n0,1,2,3\n"),
              HasSubstr("is in mg, but `accel_x` is in g"));
  EXPECT_THAT(ErrorOf("time[s],accel_x[uT],accel_y[uT],accel_z[uT]\n0,1,2,3\n"),
              HasSubstr("`uT` is not a unit of the accelerometer"));
  EXPECT_THAT(ErrorOf("time[s],accel_x[g],accel_y[g]\n0,1,2\n"),
              HasSubstr("has no matching `accel_z`"));
  EXPECT_THAT(ErrorOf("time[s],accel_x[g],accel_x[g],accel_z[g]\n0,1,2,3\n"),
              HasSubstr("column `accel_x` occurs twice"));
  EXPECT_THAT(ErrorOf("time[min],accel_x[g],accel_y[g],accel_z[g]\n0,1,2,3\n"),
              HasSubstr("`min` is not a unit of time"));
  // What may be a reading that the log otherwise lacks.
  for (const char* column : {"gyr_x", "MagX", "w1[deg/s]", "board[uT]", "temp"}) {
    EXPECT_THAT(ErrorOf(std::string("time[s],accel_x[g],accel_y[g],accel_z[g],") + column +
                        "\n0,1,2,3,4\n"),
                HasSubstr("is unknown; "))
        << column;
  }
  EXPECT_THAT(ErrorOf("t,accel_x[g],accel_y[g],accel_z[g]\n0,1,2,3\n"), HasSubstr("is unknown"));
  EXPECT_THAT(ErrorOf("time[s],temperature[degC]\n0,1\n"), HasSubstr("no sensor columns"));
  EXPECT_THAT(
      ErrorOf("clock,ax,ay,az\n0,1,2,3\n"),
      HasSubstr(
          "a header like `clock,accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]`, with your units"));
  EXPECT_THAT(ErrorOf("Timestamp (ms),AccX,acc y,accelerometer_z\n0,1,2,3\n"),
              HasSubstr("a header like `time[ms],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]`"));
  EXPECT_THAT(ErrorOf("0,1,2,3\n"), HasSubstr("has no header"));
}

TEST_F(Recording, ReadsNamesInCapitalsAndUnitsInRoundBrackets) {
  const RecordingInfo info = Read("Time (ms),Accel_X (g),ACCEL_Y [g],accel_z[g]\n0,1,2,3\n").info;
  EXPECT_TRUE(info.has_time);
  ASSERT_EQ(info.streams.size(), 1u);
  EXPECT_EQ(info.streams[0].unit.name, "g");
}

TEST_F(Recording, RefusesALogWithoutRows) {
  EXPECT_THAT(ErrorOf(kHeader), HasSubstr("has a header but no rows"));
  EXPECT_THAT(ErrorOf("# only a comment\n"), HasSubstr("has no rows"));
}

TEST_F(Recording, RefusesPosesThatAreNotNumbersOfPoses) {
  const std::string header = "pose,accel_x[g],accel_y[g],accel_z[g]\n";
  EXPECT_THAT(ErrorOf(header + "1,1,2,3\n1.5,1,2,3\n"), HasSubstr("log.csv:3: column `pose`"));
  EXPECT_THAT(ErrorOf(header + "-1,1,2,3\n"), HasSubstr("expected whole numbers"));
  EXPECT_THAT(ErrorOf(header + ",1,2,3\n"), HasSubstr("expected whole numbers"));
}

TEST_F(Recording, FindsThePoseColumnByTheNameGiven) {
  const std::string path =
      folder_.Write("log.csv", "rest,accel_x[g],accel_y[g],accel_z[g]\n7,1,2,3\n");
  const Result<RecordingSamples> recording = ReadRecording(path, {.pose_column = "rest"});
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(recording->streams[Triad::kAccelerometer].pose, ElementsAre(7));
  EXPECT_THAT(ReadingError(path, {.pose_column = "pose"}), HasSubstr("has no column `pose`"));
}

/// Largest resident memory so far, in bytes.
std::int64_t PeakMemory() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    std::int64_t kilobytes = 0;
    if (word == "VmHWM:" && status >> kilobytes) return kilobytes * 1024;
  }
  return 0;
}

TEST_F(Recording, TakesNoMoreMemoryForALongerLog) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "the sanitizer's own memory grows";
#endif
  constexpr std::int64_t kLogBytes = 40'000'000;
  std::string text = kHeader;
  std::int64_t time_us = 0;
  while (text.size() < kLogBytes) {
    text += std::to_string(time_us++ * 1e-6) + ",-0.123456789,9.80665,0.000123\n";
  }
  const std::string path = folder_.Write("log.csv", text);
  // In a process of its own, because the peak of this one already holds the text.
  text = std::string();
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    std::ofstream("/proc/self/clear_refs") << 5;  // The peak starts from what is in use now.
    const std::int64_t before = PeakMemory();
    const Result<std::unique_ptr<SampleSource>> source = OpenRecording(path);
    std::vector<SampleBlock> blocks;
    while (source && *(*source)->Next(&blocks)) {
    }
    // Buffers of 4096 rows and of two chunks of text take less than 1 MB.
    constexpr std::int64_t kAllowed = 4'000'000;
    _exit(PeakMemory() - before < kAllowed ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace recording_test
}  // namespace truetriad
