// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/recording_samples.h"
#include "io/temporary_folder.h"
#include "truetriad/io/recording.h"

namespace truetriad {
namespace manifest_test {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Manifest : public ::testing::Test {
 protected:
  std::string Write(const std::string& text) { return folder_.Write("recording.yaml", text); }
  /// A manifest of `log.csv` (columns t,a,b,c) with more keys for its one stream.
  std::string WriteStream(const std::string& keys) {
    return Write("recording: 1\nstreams:\n  accelerometer:\n    file: log.csv\n" + keys);
  }
  RecordingSamples Read(const std::string& path) {
    Result<RecordingSamples> recording = ReadRecording(path);
    EXPECT_TRUE(recording) << recording.error().message;
    return recording ? std::move(*recording) : RecordingSamples();
  }

  const std::string axes_ = "    x: a\n    y: b\n    z: c\n    unit: g\n";
  TemporaryFolder folder_;
};

// Tables that pandas writes without names, with and without the index.
TEST_F(Manifest, PassesOverALineThatCountsColumns) {
  const std::string keys =
      "    time: {column: 1, unit: s}\n    x: 2\n    y: 3\n    z: 4\n    unit: g\n";
  for (const std::string line : {"0,1,2,3,4\n", ",0,1,2,3\n"}) {
    folder_.Write("log.csv", line + "0,5,6,7,8\n1,6,8,9,10\n");
    const RecordingSamples recording = Read(WriteStream(keys));
    EXPECT_THAT(recording.streams[Triad::kAccelerometer].x, ElementsAre(6.0, 8.0));
  }
  // Stated to be data.
  folder_.Write("log.csv", "0,1,2,3,4\n1,6,8,9,10\n");
  const RecordingSamples recording = Read(WriteStream(keys + "    header: false\n"));
  EXPECT_THAT(recording.streams[Triad::kAccelerometer].x, ElementsAre(2.0, 8.0));
}

TEST_F(Manifest, MapsColumnsByNameAndByIndex) {
  folder_.Write("log.csv", "t,a,b,c,T,note\n1,2,3,4,300,x\n2,5,6,7,301,y\n");
  const RecordingSamples recording =
      Read(Write("recording: 1\nserial: SN7\nsource: {format: csv}\napplied: none\nframe: sensor\n"
                 "device: {ids: {accelerometer: 1310988}}\n"
                 "streams:\n"
                 "  accelerometer: {file: log.csv, time: {column: t, unit: us}, x: c, y: 2, z: a, "
                 "unit: counts, si_per_count: 0.01, temperature: {column: T, unit: K}}\n"));
  EXPECT_EQ(recording.info.serial, "SN7");
  EXPECT_EQ(recording.info.tags.device_ids[Triad::kAccelerometer], 1310988);
  EXPECT_EQ(recording.info.streams[0].si_per_count, 0.01);
  const StreamSamples& stream = recording.streams[Triad::kAccelerometer];
  EXPECT_THAT(stream.time_ns, ElementsAre(1000, 2000));
  EXPECT_THAT(stream.x, ElementsAre(4.0, 7.0));
  EXPECT_THAT(stream.y, ElementsAre(3.0, 6.0));
  EXPECT_THAT(stream.z, ElementsAre(2.0, 5.0));
  EXPECT_DOUBLE_EQ(stream.temperature_degc[1], 301.0 - 273.15);
  ASSERT_EQ(recording.inputs.size(), 2U);  // The log and the manifest itself.
  EXPECT_EQ(recording.inputs[0].samples, 2);
  EXPECT_EQ(recording.inputs[1].sha256.size(), 64U);
}

TEST_F(Manifest, SkipsAPreamble) {
  folder_.Write("log.csv", "Fs,100\nMode,0\na,b,c\n-12,-828,15032\n");
  const RecordingSamples recording = Read(WriteStream("    skip_lines: 2\n" + axes_));
  EXPECT_THAT(recording.streams[Triad::kAccelerometer].y, ElementsAre(-828.0));
}

TEST_F(Manifest, TakesAHeaderWrittenAsAComment) {
  folder_.Write("log.csv", "#a,b,c\n1,2,3\n");
  const RecordingSamples recording = Read(WriteStream("    header: true\n" + axes_));
  EXPECT_THAT(recording.streams[Triad::kAccelerometer].z, ElementsAre(3.0));
}

TEST_F(Manifest, CountsSamplesByColumnOrByRow) {
  folder_.Write("log.csv", "t,a,b,c\n7,1,1,1\n10,1,1,1\n");
  // 3 samples at 3 Hz are a second; sample 7 is at 7/3 s, to the nearest nanosecond.
  const RecordingSamples by_column =
      Read(WriteStream("    time: {column: t, unit: samples, rate_hz: 3}\n" + axes_));
  EXPECT_THAT(by_column.streams[Triad::kAccelerometer].time_ns,
              ElementsAre(2'333'333'333, 3'333'333'333));
  const RecordingSamples by_row =
      Read(WriteStream("    time: {unit: samples, rate_hz: 3}\n" + axes_));
  EXPECT_TRUE(by_row.info.has_time);
  EXPECT_THAT(by_row.streams[Triad::kAccelerometer].time_ns, ElementsAre(0, 333'333'333));
  EXPECT_FALSE(Read(WriteStream(axes_)).info.has_time);
}

// An MPU-6050: 340 counts a degree, 0 counts at 36.53.
TEST_F(Manifest, ReadsTheRegisterOfAThermometer) {
  const std::string keys =
      "    time: {column: t, unit: s}\n" + axes_ +
      "    temperature: {column: T, unit: degC, scale: 0.0029411764705882353, offset: 36.53, "
      "wrap_bits: 16, signed: true}\n";
  // Two's complement logged without its sign, and a number that goes on behind the last.
  folder_.Write("log.csv",
                "t,a,b,c,T\n0,1,1,1,65196\n1,1,1,1,\n2,1,1,1,340\n3,1,1,1,12000\n"
                "4,1,1,1,22967\n5,1,1,1,32767\n6,1,1,1,-32768\n7,1,1,1,32768\n");
  const RecordingSamples recording = Read(WriteStream(keys));
  const std::vector<double>& degc = recording.streams[Triad::kAccelerometer].temperature_degc;
  const std::vector<double> expected = {35.53,
                                        35.53,
                                        37.53,
                                        12000 / 340.0 + 36.53,
                                        22967 / 340.0 + 36.53,
                                        32767 / 340.0 + 36.53,
                                        32768 / 340.0 + 36.53,
                                        32768 / 340.0 + 36.53};
  ASSERT_EQ(degc.size(), expected.size());
  for (std::size_t i = 0; i < degc.size(); ++i) EXPECT_NEAR(degc[i], expected[i], 1e-11) << i;
  folder_.Write("log.csv", "t,a,b,c,T\n0,1,1,1,0\n1,1,1,1,65536\n");
  const auto wide = ReadRecording(WriteStream(keys));
  ASSERT_FALSE(wide);
  EXPECT_THAT(wide.error().message,
              HasSubstr("log.csv:3: column `T`: 65536 does not fit a register of wrap_bits: 16"));
  folder_.Write("log.csv", "t,a,b,c,T\n0,1,1,1,3000\n");
  const RecordingSamples kelvin =
      Read(WriteStream("    time: {column: t, unit: s}\n" + axes_ +
                       "    temperature: {column: T, unit: K, scale: 0.1, offset: -1}\n"));
  EXPECT_NEAR(kelvin.streams[Triad::kAccelerometer].temperature_degc[0], 299.0 - 273.15, 1e-12);
  // One damaged reading may not move all later ones by a register; the first may have no sign.
  folder_.Write("log.csv", "t,a,b,c,T\n0,1,1,1,340\n1,1,1,1,33108\n2,1,1,1,340\n");
  const auto damaged = ReadRecording(WriteStream(keys));
  ASSERT_FALSE(damaged);
  EXPECT_THAT(damaged.error().message,
              HasSubstr("log.csv:3: column `T`: the register steps to 33108 by more than a quarter "
                        "of the range of wrap_bits: 16; empty the field"));
  folder_.Write("log.csv", "t,a,b,c,T\n0,1,1,1,33315\n1,1,1,1,-32221\n");
  const RecordingSamples unsigned_kelvin =
      Read(WriteStream("    time: {column: t, unit: s}\n" + axes_ +
                       "    temperature: {column: T, unit: K, scale: 0.01, wrap_bits: 16, signed: "
                       "false}\n"));
  for (const double read_degc : unsigned_kelvin.streams[Triad::kAccelerometer].temperature_degc) {
    EXPECT_NEAR(read_degc, 60.0, 1e-9);
  }
  const auto unstated = ReadRecording(
      WriteStream("    time: {column: t, unit: s}\n" + axes_ +
                  "    temperature: {column: T, unit: K, scale: 0.01, wrap_bits: 16}\n"));
  ASSERT_FALSE(unstated);
  EXPECT_THAT(unstated.error().message,
              HasSubstr("log.csv:2: column `T`: the first number, 33315, is -32221 if the register "
                        "(wrap_bits: 16) is signed; state `signed: true` or `signed: false`"));
  for (const std::string wrong :
       {"scale: 0", "scale: .inf", "offset: .nan", "wrap_bits: 7", "signed: false"}) {
    EXPECT_FALSE(ReadRecording(
        WriteStream(axes_ + "    temperature: {column: T, unit: K, " + wrong + "}\n")))
        << wrong;
  }
}

class ManifestWindows : public Manifest {
 protected:
  StreamSamples Read(const std::string& rows, int size) {
    return Manifest::Read(WriteRows(rows, size)).streams[Triad::kAccelerometer];
  }
  std::string ErrorOf(const std::string& rows, int size) {
    const auto recording = ReadRecording(WriteRows(rows, size));
    return recording ? "" : recording.error().message;
  }

 private:
  std::string WriteRows(const std::string& rows, int size) {
    folder_.Write("log.csv", "t,a,b,c,T\n" + rows);
    return WriteStream("    time: {column: t, unit: ms, window_samples: " + std::to_string(size) +
                       "}\n    temperature: {column: T, unit: degC}\n" + axes_);
  }
};

TEST_F(ManifestWindows, SpreadSamplesEvenlyUpToTheirTime) {
  // The time on each row, on the first or on the last; a row without a reading; a gap; a cut end.
  for (const std::string rows :
       {"100,0,1,1,20\n100,1,1,1,\n100,2,1,1,\n100,3,1,1,\n140,4,1,1,\n140,5,1,1,\n140,,1,1,\n"
        "140,7,1,1,\n300,8,1,1,21\n300,9,1,1,\n300,10,1,1,\n300,11,1,1,\n336,12,1,1,\n336,13,1,1,"
        "\n",
        "100,0,1,1,20\n,1,1,1,\n,2,1,1,\n,3,1,1,\n140,4,1,1,\n,5,1,1,\n,,1,1,\n,7,1,1,\n"
        "300,8,1,1,21\n,9,1,1,\n,10,1,1,\n,11,1,1,\n336,12,1,1,\n,13,1,1,\n"}) {
    const StreamSamples stream = Read(rows, 4);
    EXPECT_THAT(stream.x, ElementsAre(0, 1, 2, 3, 4, 5, 7, 8, 9, 10, 11, 12, 13));
    std::vector<double> ms;
    for (const std::int64_t time_ns : stream.time_ns) ms.push_back(1e-6 * time_ns);
    EXPECT_THAT(ms, ElementsAre(70, 80, 90, 100, 110, 120, 140, 270, 280, 290, 300, 309, 318));
    EXPECT_EQ(stream.temperature_degc.front(), 20.0);
    EXPECT_EQ(stream.temperature_degc.back(), 21.0);
  }
}

// Of two sensors in one file, the rows of one have no reading of the other.
TEST_F(ManifestWindows, TakeTheirTimeFromARowWithoutAReading) {
  {
    const std::string rows =
        ",0,1,1,\n,1,1,1,\n40,,,,\n,3,1,1,\n,4,1,1,\n,5,1,1,\n80,,,,\n,7,1,1,\n";
    const StreamSamples stream = Read(rows, 4);
    EXPECT_THAT(stream.x, ElementsAre(0, 1, 3, 4, 5, 7));
    EXPECT_THAT(
        stream.time_ns,
        ElementsAre(10'000'000, 20'000'000, 40'000'000, 50'000'000, 60'000'000, 80'000'000));
  }
  // A window without any reading, which has a time all the same; one with two times.
  const StreamSamples stream = Read("20,0,1,1,\n,1,1,1,\n40,,,,\n,,,,\n60,4,1,1,\n,5,1,1,\n", 2);
  EXPECT_THAT(stream.time_ns, ElementsAre(10'000'000, 20'000'000, 50'000'000, 60'000'000));
  EXPECT_THAT(ErrorOf("1,1,1,1,\n2,,,,\n3,1,1,1,\n3,1,1,1,\n", 2),
              HasSubstr("log.csv:3: states a time that differs from that of other rows of its "
                        "window of 2 rows"));
}

TEST_F(ManifestWindows, MayHaveNumbersOfSamplesForTimes) {
  const auto read = [&](const std::string& rows, const std::string& rate_hz) {
    folder_.Write("log.csv", "t,a,b,c\n" + rows);
    return ReadRecording(WriteStream("    time: {column: t, unit: samples, rate_hz: " + rate_hz +
                                     ", window_samples: 4}\n" + axes_));
  };
  // On the last row of a window; a row without a reading; lost samples behind the second window.
  const std::string rows =
      ",0,1,1\n,1,1,1\n,2,1,1\n4,3,1,1\n,4,1,1\n,,,\n,6,1,1\n8,7,1,1\n"
      ",8,1,1\n,9,1,1\n,10,1,1\n40,11,1,1\n44,12,1,1\n";
  const Result<RecordingSamples> recording = read(rows, "100");
  ASSERT_TRUE(recording) << recording.error().message;
  const StreamSamples& stream = recording->streams[Triad::kAccelerometer];
  EXPECT_THAT(stream.x, ElementsAre(0, 1, 2, 3, 4, 6, 7, 8, 9, 10, 11, 12));
  std::vector<double> samples;
  for (const std::int64_t time_ns : stream.time_ns) samples.push_back(1e-7 * time_ns);
  EXPECT_THAT(samples, ElementsAre(1, 2, 3, 4, 5, 7, 8, 37, 38, 39, 40, 41));
  // Rates at which numbers are no times any more.
  for (const std::string rate_hz : {"1e-300", "1e-9", "1e-7"}) {
    const Result<RecordingSamples> slow = read(rows, rate_hz);
    ASSERT_FALSE(slow) << rate_hz;
    EXPECT_THAT(slow.error().message,
                AnyOf(HasSubstr("out of range"), HasSubstr("more than a day")));
  }
  folder_.Write("log.csv", "t,a,b,c\n1,1,1,1\n");
  EXPECT_THAT(ReadingError(WriteStream(
                  "    time: {unit: samples, rate_hz: 9, window_samples: 4}\n" + axes_)),
              HasSubstr("window_samples: needs a column with the time of each window"));
}

// One row less, and all later times would stand on a row before the window's last.
TEST_F(ManifestWindows, AreRefusedWhereTheirTimeMovesToAnotherRow) {
  EXPECT_THAT(
      ErrorOf(",0,1,1,\n,1,1,1,\n20,2,1,1,\n,3,1,1,\n50,4,1,1,\n,5,1,1,\n,6,1,1,\n"
              "80,7,1,1,\n,8,1,1,\n",
              3),
      HasSubstr("log.csv:6: states the time of its window on row 2 of 3 (`window_samples`), "
                "but line 4 states it on row 3; there are too few or too many rows between these "
                "lines"));
}

// What is lost right behind the first window does not stretch it.
TEST_F(ManifestWindows, BeginAsCloselyAsTheyGoOnBehindALostOne) {
  const StreamSamples stream =
      Read("20,0,1,1,\n20,1,1,1,\n60,2,1,1,\n60,3,1,1,\n80,4,1,1,\n80,5,1,1,\n", 2);
  std::vector<double> ms;
  for (const std::int64_t time_ns : stream.time_ns) ms.push_back(1e-6 * time_ns);
  EXPECT_THAT(ms, ElementsAre(10, 20, 50, 60, 70, 80));
}

// What is left in the FIFO at the end has the time of its own last sample, or of the window's where
// the file was cut: which is nearer the interval.
TEST_F(ManifestWindows, EndWithWhatIsLeft) {
  const std::string rows =
      "40,0,1,1,\n40,1,1,1,\n40,2,1,1,\n40,3,1,1,\n80,4,1,1,\n80,5,1,1,\n"
      "80,6,1,1,\n80,7,1,1,\n";
  for (const std::string time : {"100", "120"}) {
    const StreamSamples stream = Read(rows + time + ",8,1,1,\n" + time + ",9,1,1,\n", 4);
    std::vector<double> ms;
    for (const std::int64_t time_ns : stream.time_ns) ms.push_back(1e-6 * time_ns);
    EXPECT_THAT(ms, ElementsAre(10, 20, 30, 40, 50, 60, 70, 80, 90, 100));
  }
}

// With the time on the last row, a log that was cut ends with samples without one.
TEST_F(ManifestWindows, GoOnEvenlyWhereTheFileIsCut) {
  const std::string rows = ",0,1,1,\n,1,1,1,\n20,2,1,1,\n,3,1,1,\n,4,1,1,\n50,5,1,1,\n";
  const StreamSamples stream = Read(rows + ",6,1,1,\n,7,1,1,\n", 3);
  EXPECT_THAT(stream.x, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  std::vector<double> ms;
  for (const std::int64_t time_ns : stream.time_ns) ms.push_back(1e-6 * time_ns);
  EXPECT_THAT(ms, ElementsAre(0, 10, 20, 30, 40, 50, 60, 70));
  EXPECT_THAT(ErrorOf(rows + ",6,1,1,\n,7,1,1,\n,8,1,1,\n", 3),
              HasSubstr("log.csv:8: begins a window of 3 rows (`window_samples`) without a time"));
  EXPECT_THAT(ErrorOf(",0,1,1,\n,1,1,1,\n20,2,1,1,\n,3,1,1,\n", 3),
              HasSubstr("log.csv:2: begins the only window of 3 rows (`window_samples`)"));
  EXPECT_THAT(ErrorOf(",0,1,1,\n,1,1,1,\n", 3),
              HasSubstr("log.csv:2: begins a window of 3 rows (`window_samples`) without a time"));
}

// Windows that come early and late, lost ones, and one that comes twice.
TEST_F(ManifestWindows, WithJitterKeepTheirSamplesInOrder) {
  std::string rows;
  std::vector<int> times;
  for (int w = 1; w <= 400; ++w) {
    if (w % 50 == 0) continue;
    times.push_back(80 * w + 7919 * w % 31);
    for (int i = 1; i <= 8; ++i) {
      rows += (i == 8 ? std::to_string(times.back()) : "") + "," + std::to_string(8 * w + i) +
              ",1,1,\n";
    }
  }
  const StreamSamples stream = Read(rows, 8);
  ASSERT_EQ(stream.x.size(), 8 * times.size());
  for (std::size_t i = 0; i < stream.x.size(); ++i) {
    if (i > 0) {
      ASSERT_LT(stream.time_ns[i - 1], stream.time_ns[i]) << i;
    }
    const std::int64_t window_ns = std::int64_t{1'000'000} * times[i / 8];
    EXPECT_LE(stream.time_ns[i], window_ns);
    if (i % 8 == 7) {
      EXPECT_EQ(stream.time_ns[i], window_ns);
    }
    // A window is 50 to 110 ms behind the one before, where none was lost.
    EXPECT_GT(stream.time_ns[i], window_ns - 110'000'000);
  }
  EXPECT_THAT(ErrorOf(rows + ",1,1,1,\n" + std::to_string(times.back()) + ",1,1,1,\n", 8),
              HasSubstr("whose time is not after that of the previous window"));
}

// A logger's first windows may come at once, and its rate may change; two lost windows are neither.
TEST_F(ManifestWindows, AreNoGapsForEverWhereTheIntervalGrows) {
  std::string rows;
  for (const int ms : {60, 80, 160, 240, 320, 400, 560, 720, 800}) {
    for (int i = 1; i <= 4; ++i) rows += (i == 4 ? std::to_string(ms) : "") + ",1,1,1,\n";
  }
  const StreamSamples stream = Read(rows, 4);
  std::vector<double> ms_of_third;
  for (std::size_t i = 2; i < stream.time_ns.size(); i += 4)
    ms_of_third.push_back(1e-6 * stream.time_ns[i]);
  EXPECT_THAT(ms_of_third, ElementsAre(55, 75, 155, 235, 300, 380, 540, 700, 780));
}

TEST_F(ManifestWindows, DoNotDependOnHowTheFileIsRead) {
  std::string rows;
  constexpr int kSize = 1000;
  for (int i = 0; i < 9500; ++i) {
    const bool is_last = i % kSize == kSize - 1 || i == 9499;
    rows += (is_last ? std::to_string(i / kSize * 1000 + 1000) : "") + "," + std::to_string(i) +
            ",1,1,\n";
  }
  const StreamSamples stream = Read(rows, kSize);
  ASSERT_EQ(stream.x.size(), 9500U);
  for (std::size_t i = 0; i < stream.x.size(); ++i) {
    ASSERT_EQ(stream.x[i], static_cast<double>(i));
    ASSERT_EQ(stream.time_ns[i], static_cast<std::int64_t>(i + 1) * 1'000'000);
  }
}

TEST_F(ManifestWindows, RefuseWhatIsNoWindow) {
  EXPECT_THAT(ErrorOf("1,1,1,1,\n1,1,1,1,\n1,1,1,1,\n2,1,1,1,\n2,1,1,1,\n", 2),
              HasSubstr("log.csv:5: states a time that differs from that of other rows of its "
                        "window of 2 rows"));
  EXPECT_THAT(ErrorOf("1,1,1,1,\n1,1,1,1,\n,1,1,1,\n,1,1,1,\n", 2),
              HasSubstr("log.csv:4: begins a window of 2 rows (`window_samples`) without a time"));
  EXPECT_THAT(ErrorOf("2,1,1,1,\n2,1,1,1,\n2,1,1,1,\n2,1,1,1,\n", 2),
              HasSubstr("log.csv:4: begins a window of 2 rows (`window_samples`) whose time is not "
                        "after"));
  EXPECT_THAT(ErrorOf("2,1,1,1,\n2,1,1,1,\n", 2),
              HasSubstr("log.csv:2: begins the only window of 2 rows (`window_samples`)"));
  EXPECT_THAT(ErrorOf("2,1,1,1,\n2,1,1,1,\n4e12,1,1,1,\n", 2), HasSubstr("more than a day"));
  EXPECT_THAT(ErrorOf("-4e12,1,1,1,\n-4e12,1,1,1,\n4e12,1,1,1,\n", 2),
              HasSubstr("more than a day"));
  // As a time it would do, but not with a window around it.
  EXPECT_THAT(ErrorOf("2,1,1,1,\n2,1,1,1,\n4.611686e12,1,1,1,\n", 2),
              HasSubstr("log.csv:4: has a time that is out of range"));
  EXPECT_THAT(ErrorOf("2,1,1,1,\n3,1,1,1,\n", 0), HasSubstr("window_samples: `0` is out of range"));
  EXPECT_THAT(ErrorOf("2,1,1,1,\n3,1,1,1,\n", 99999), HasSubstr("expected 1 to 65536 samples"));
}

TEST_F(Manifest, ReadsAFileSharedByStreamsOnce) {
  folder_.Write("log.csv", "t,a,b,c,d,e,f\n1,2,3,4,5,6,7\n");
  const RecordingSamples recording = Read(Write(
      "recording: 1\nstreams:\n"
      "  accelerometer: {file: log.csv, time: {column: t, unit: s}, x: a, y: b, z: c, unit: g}\n"
      "  gyroscope: {file: ./log.csv, time: {column: t, unit: s}, x: d, y: e, z: f, unit: "
      "deg/s}\n"));
  EXPECT_THAT(recording.streams[Triad::kGyroscope].z, ElementsAre(7.0));
  EXPECT_EQ(recording.inputs.size(), 2U);
}

TEST_F(Manifest, KeepsFilesOfDifferentRatesInStep) {
  std::string fast = "t,a,b,c\n";
  std::string slow = fast;
  for (int i = 0; i < 40'000; ++i) {
    fast += std::to_string(i) + ",1,1,1\n";
    if (i % 4 == 0) slow += std::to_string(i) + ",1,1,1\n";
  }
  folder_.Write("fast.csv", fast);
  folder_.Write("slow.csv", slow);
  const std::string keys = ", time: {column: t, unit: ms}, x: a, y: b, z: c, unit: ";
  const Result<std::unique_ptr<SampleSource>> source =
      OpenRecording(Write("recording: 1\nstreams:\n  accelerometer: {file: fast.csv" + keys +
                          "g}\n  magnetometer: {file: slow.csv" + keys + "uT}\n"));
  ASSERT_TRUE(source) << source.error().message;
  PerTriad<std::int64_t> begin, end;
  std::vector<SampleBlock> blocks;
  for (auto& time : end) time = -1;
  while (*(*source)->Next(&blocks)) {
    for (const SampleBlock& block : blocks) {
      begin[block.triad] = block.time_ns.front();
      end[block.triad] = block.time_ns.back();
      // Nobody is read further while another stream has not caught up with the block before.
      if (end[Triad::kAccelerometer] >= 0 && end[Triad::kMagnetometer] >= 0) {
        EXPECT_LE(begin[Triad::kAccelerometer], end[Triad::kMagnetometer] + 4'000'000);
        EXPECT_LE(begin[Triad::kMagnetometer], end[Triad::kAccelerometer] + 4'000'000);
      }
    }
  }
  EXPECT_EQ((*source)->counts(Triad::kAccelerometer).samples, 40'000);
  EXPECT_EQ((*source)->counts(Triad::kMagnetometer).samples, 10'000);
  EXPECT_EQ((*source)->progress(), 1.0);
}

TEST_F(Manifest, AllowsRaggedRowsOnlyWhenTold) {
  folder_.Write("log.csv", "a,b,c,d\n1,2,3,4\n5,6,7\n8,9,10,11,12\n13,14\n");
  EXPECT_THAT(ReadingError(WriteStream(axes_)), HasSubstr("log.csv:3: has 3 fields"));
  const RecordingSamples recording = Read(WriteStream("    ragged: allow\n" + axes_));
  EXPECT_THAT(recording.streams[Triad::kAccelerometer].x, ElementsAre(1.0, 5.0, 8.0));
  EXPECT_EQ(recording.counts[Triad::kAccelerometer].dropped_empty, 1);
}

TEST_F(Manifest, RejectsUnknownDuplicateAndMissingKeysWithTheirLine) {
  folder_.Write("log.csv", "a,b,c\n1,2,3\n");
  EXPECT_THAT(ReadingError(WriteStream("    unti: g\n" + axes_)),
              HasSubstr("recording.yaml:5: streams.accelerometer.unti: is not a known key"));
  EXPECT_THAT(ReadingError(WriteStream(axes_ + "    unit: g\n")),
              HasSubstr("recording.yaml:9: streams.accelerometer.unit: is given twice"));
  EXPECT_THAT(ReadingError(WriteStream("    x: a\n    y: b\n    z: c\n")),
              HasSubstr("streams.accelerometer.unit: is missing"));
  EXPECT_THAT(ReadingError(Write("streams: {}\n")), HasSubstr("recording: is missing"));
  EXPECT_THAT(ReadingError(Write("recording: 2\nstreams: {}\n")), HasSubstr("reads version 1"));
  EXPECT_THAT(ReadingError(Write("recording: 1\nstreams: {barometer: {}}\n")),
              HasSubstr("streams.barometer: is not a known key"));
}

TEST_F(Manifest, RejectsValuesItDoesNotKnow) {
  folder_.Write("log.csv", "a,b,c\n1,2,3\n");
  const auto error = [&](const std::string& keys) {
    return ReadingError(WriteStream(keys + axes_));
  };
  EXPECT_THAT(error("    separator: '|'\n"), HasSubstr("separator: `|` is not among"));
  EXPECT_THAT(error("    header: maybe\n"),
              HasSubstr("`maybe` is unknown; expected one of true, false, auto"));
  EXPECT_THAT(error("    ragged: yes\n"),
              HasSubstr("`yes` is unknown; expected one of allow, refuse"));
  EXPECT_THAT(error("    skip_lines: -1\n"),
              HasSubstr("`-1` is out of range; expected a number of at least zero"));
  EXPECT_THAT(error("    si_per_count: 2\n"), HasSubstr("counts"));
  EXPECT_THAT(error("    time: {column: a, unit: min}\n"),
              HasSubstr("`min` is not a unit of time"));
  EXPECT_THAT(error("    time: {unit: samples}\n"), HasSubstr("time.rate_hz: is missing"));
  EXPECT_THAT(error("    time: {unit: s}\n"), HasSubstr("time.column: is missing"));
  EXPECT_THAT(error("    temperature: {column: a, unit: F}\n"), HasSubstr("neither degC nor K"));
}

TEST_F(Manifest, NamesColumnsAndFilesThatAreNotThere) {
  folder_.Write("log.csv", "a,b,c,c\n1,2,3,4\n");
  EXPECT_THAT(ReadingError(WriteStream("    x: q\n    y: b\n    z: a\n    unit: g\n")),
              HasSubstr("recording.yaml:5: streams.accelerometer.x: "));
  EXPECT_THAT(ReadingError(WriteStream("    x: q\n    y: b\n    z: a\n    unit: g\n")),
              HasSubstr("has no column `q`; its header is a, b, c, c; use"));
  EXPECT_THAT(ReadingError(WriteStream(axes_)), HasSubstr("more than one column `c`"));
  EXPECT_THAT(ReadingError(WriteStream("    x: a\n    y: 0\n    z: b\n    unit: g\n")),
              HasSubstr("is the same column as another axis"));
  EXPECT_THAT(ReadingError(Write("recording: 1\nstreams:\n  magnetometer: {file: no.csv, x: 0, "
                                 "y: 1, z: 2, unit: uT}\n")),
              HasSubstr("no.csv: cannot be opened"));
}

TEST_F(Manifest, RefusesReadingsThatWereCorrectedAlready) {
  folder_.Write("log.csv", "a,b,c\n1,2,3\n");
  const std::string rest =
      "recording: 1\nstreams:\n  accelerometer: {file: log.csv, x: a, y: b, "
      "z: c, unit: g}\n";
  EXPECT_EQ(ReadingError(Write(rest + "applied: none\n")), "");
  EXPECT_THAT(ReadingError(Write(rest + "applied: unknown\n")),
              HasSubstr("already applied to these readings are unknown"));
  EXPECT_THAT(ReadingError(Write(rest + "applied: {accelerometer: unknown}\n")),
              AllOf(HasSubstr("applied.accelerometer: the corrections already applied"),
                    HasSubstr("state them")));
  EXPECT_THAT(ReadingError(Write(rest + "applied: {accelerometer: {offset: 1}}\n")),
              HasSubstr("applied.accelerometer.offset"));
  EXPECT_THAT(ReadingError(Write(rest + "applied: {accelerometer: {gain: [1, 1, 1]}}\n")),
              HasSubstr("gain"));
  EXPECT_THAT(ReadingError(Write(rest + "applied: {accelerometer: {scale: [1, 0, 1]}}\n")),
              HasSubstr("singular"));
  EXPECT_THAT(ReadingError(Write(rest + "applied: {accelerometer: {thermal: {reference_degc: 25, "
                                        "range_degc: [0, 50], coefficients: [[1, 1, 1]]}}}\n")),
              HasSubstr("add `temperature` to the stream"));
}

// The equation of ArduPilot's accelerometer, with a board mounted upside down: what the firmware
// would log for a known raw reading reads back as that reading.
TEST_F(Manifest, UndoesWhatFirmwareApplied) {
  const std::array<double, 3> raw = {0.31, -9.7, 1.2};
  const std::array<double, 3> offset = {0.1, -0.25, 0.4};
  const std::array<double, 3> scale = {1.02, 0.98, 1.01};
  const std::array<double, 3> linear = {2e-3, -1e-3, 5e-4};
  const std::array<double, 3> cubic = {1e-6, 2e-6, -3e-6};
  const auto thermal = [&](double temperature_degc, std::size_t axis) {
    const double tau = std::min(std::max(temperature_degc, 10.0), 60.0) - 35.0;
    return linear[axis] * tau + cubic[axis] * tau * tau * tau;
  };
  std::string log = "t,a,b,c,T\n";
  // In the range, on both sides of it, and a row without a temperature, which takes the last one.
  const std::vector<double> temperatures = {25.0, 5.0, 71.5};
  const std::array<double, 3> sign = {1.0, -1.0, -1.0};  // Rolled by half a turn.
  for (std::size_t row = 0; row < 4; ++row) {
    log += std::to_string(row);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double temperature_degc = temperatures[std::min<std::size_t>(row, 2)];
      const double logged =
          sign[axis] * scale[axis] *
          (raw[axis] - offset[axis] - (thermal(temperature_degc, axis) - thermal(-300.0, axis)));
      char text[40];
      std::snprintf(text, sizeof text, ",%.17g", logged);
      log += text;
    }
    log += row < 3 ? "," + std::to_string(temperatures[row]) + "\n" : ",\n";
  }
  folder_.Write("log.csv", log);
  const RecordingSamples recording = Read(Write(
      "recording: 1\napplied:\n  accelerometer:\n    offset: [0.1, -0.25, 0.4]\n"
      "    scale: [1.02, 0.98, 1.01]\n    matrix: [[1, 0, 0], [0, -1, 0], [0, 0, -1]]\n"
      "    thermal: {reference_degc: 35, calibrated_degc: -300, range_degc: [10, 60], "
      "coefficients: [[2e-3, -1e-3, 5e-4], [0, 0, 0], [1e-6, 2e-6, -3e-6]]}\n"
      "streams:\n  accelerometer: {file: log.csv, time: {column: t, unit: s}, x: a, y: b, z: c, "
      "unit: m/s^2, temperature: {column: T, unit: degC}}\n"));
  const StreamSamples& stream = recording.streams[Triad::kAccelerometer];
  ASSERT_EQ(stream.x.size(), 4U);
  for (std::size_t row = 0; row < 4; ++row) {
    // A dozen roundings of numbers below 10.
    constexpr double kRounding = 12.0 * 10.0 * std::numeric_limits<double>::epsilon();
    EXPECT_NEAR(stream.x[row], raw[0], kRounding) << row;
    EXPECT_NEAR(stream.y[row], raw[1], kRounding) << row;
    EXPECT_NEAR(stream.z[row], raw[2], kRounding) << row;
  }
}

// A matrix with all entries, as of a magnetometer, and an offset that the firmware adds.
TEST_F(Manifest, UndoesAFullMatrix) {
  folder_.Write("log.csv", "a,b,c\n-160.5,233.25,91\n");
  const std::string manifest =
      "recording: 1\napplied: {magnetometer: {offset: [10, -20, 30], matrix: [[1.1, 0.02, -0.03], "
      "[0.02, 0.9, 0.04], [-0.03, 0.04, 1.05]]}}\n"
      "streams: {magnetometer: {file: log.csv, x: a, y: b, z: c, unit: mG}}\n";
  const RecordingSamples recording = Read(Write(manifest));
  const StreamSamples& stream = recording.streams[Triad::kMagnetometer];
  Eigen::Matrix3d matrix;
  matrix << 1.1, 0.02, -0.03, 0.02, 0.9, 0.04, -0.03, 0.04, 1.05;
  const Eigen::Vector3d raw(stream.x[0], stream.y[0], stream.z[0]);
  const Eigen::Vector3d logged = matrix * (raw - Eigen::Vector3d(10.0, -20.0, 30.0));
  constexpr double kRounding = 12.0 * 300.0 * std::numeric_limits<double>::epsilon();
  EXPECT_LT((logged - Eigen::Vector3d(-160.5, 233.25, 91.0)).norm(), kRounding);
}

TEST_F(Manifest, RefusesTimeForSomeStreamsOnly) {
  folder_.Write("log.csv", "t,a,b,c\n1,1,2,3\n");
  const std::string stream = "{file: log.csv, x: a, y: b, z: c, unit: counts";
  EXPECT_THAT(ReadingError(Write("recording: 1\nstreams:\n  accelerometer: " + stream +
                                 "}\n  gyroscope: " + stream + ", time: {column: t, unit: s}}\n")),
              HasSubstr("some streams have a `time`"));
}

TEST_F(Manifest, StatesPoses) {
  folder_.Write("log.csv", "t,a,b,c\n1,1,2,3\n");
  folder_.Write("poses.yaml",
                "poses:\n  - {first: 0, last: 9, face: +x}\n  - {first: 10, last: 19, id: two}\n");
  const auto poses = [&](const std::string& text) {
    return ManifestPoseSelection(Write(
        "recording: 1\nstreams:\n  accelerometer: {file: log.csv, x: a, y: b, z: c, unit: g}\n" +
        text));
  };
  EXPECT_FALSE(*poses(""));
  EXPECT_EQ((*poses("poses: every_row\n"))->kind, PoseSelectionKind::kEveryRow);
  EXPECT_EQ((*poses("poses: {every: 100}\n"))->every, 100);
  EXPECT_EQ((*poses("poses: {column: t}\n"))->kind, PoseSelectionKind::kColumn);
  EXPECT_THAT(Read(folder_.Path("recording.yaml")).streams[Triad::kAccelerometer].pose,
              ElementsAre(1));
  const Result<std::optional<PoseSelection>> ranges = poses("poses: {file: poses.yaml}\n");
  ASSERT_TRUE(ranges) << ranges.error().message;
  ASSERT_EQ((*ranges)->ranges.size(), 2U);
  EXPECT_EQ((*ranges)->ranges[0].face_up, "+x");
  EXPECT_EQ((*ranges)->ranges[1].id, "two");
  EXPECT_EQ((*ranges)->ranges[1].last, 19);
  EXPECT_THAT(poses("poses: each\n").error().message, HasSubstr("did you mean every_row"));
  EXPECT_THAT(poses("poses: {every: 0}\n").error().message,
              HasSubstr("`0` is out of range; expected at least 1 row"));
  EXPECT_THAT(poses("poses: {every: 5, column: t}\n").error().message,
              HasSubstr("expected one of"));
  EXPECT_THAT(poses("poses: []\n").error().message, HasSubstr("recording.yaml:4: poses"));
}

TEST_F(Manifest, RefusesPoseRangesThatMakeNoSense) {
  const auto error = [&](const std::string& text) {
    const auto ranges = ReadPoseRanges(folder_.Write("poses.yaml", text));
    return ranges ? "" : ranges.error().message;
  };
  EXPECT_THAT(error("poses: [{first: 5, last: 4}]\n"), HasSubstr("are not a range"));
  EXPECT_THAT(error("poses: [{first: 0, last: 4}, {first: 4, last: 9}]\n"),
              HasSubstr("inside or before"));
  EXPECT_THAT(error("poses: [{first: 0, last: 4, face: up}]\n"), HasSubstr("not among +x -x"));
  EXPECT_THAT(error("poses: []\n"), HasSubstr("empty"));
}

TEST_F(Manifest, MapsTheTwoXsensFiles) {
  const std::string data = TRUETRIAD_SHARED_DATASETS "/a-xsens-imu-tk-38pose";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << data << " is not there";
  const std::string keys = ", time: {column: 0, unit: s}, x: 1, y: 2, z: 3, unit: counts}\n";
  const RecordingSamples recording =
      Read(Write("recording: 1\nstreams:\n  accelerometer: {file: " + data + "/xsens_acc.mat" +
                 keys + "  gyroscope: {file: " + data + "/xsens_gyro.mat" + keys));
  const StreamSamples& accelerometer = recording.streams[Triad::kAccelerometer];
  const StreamSamples& gyroscope = recording.streams[Triad::kGyroscope];
  ASSERT_EQ(accelerometer.x.size(), 51175U);
  EXPECT_EQ(accelerometer.time_ns, gyroscope.time_ns);
  EXPECT_EQ(accelerometer.time_ns[0], 29'840'000);
  EXPECT_EQ(accelerometer.x[0], 33108.0);
  EXPECT_EQ(gyroscope.z[0], 32499.0);
  EXPECT_EQ(recording.inputs[0].sha256.substr(0, 16), "335a234736ff4dd8");
  EXPECT_EQ(recording.inputs[1].sha256.substr(0, 16), "e0d6cc7ccbc996ab");
}

}  // namespace manifest_test
}  // namespace truetriad
