// SPDX-License-Identifier: Apache-2.0
#include "io/text_file.h"

#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/temporary_folder.h"

namespace truetriad {
namespace text_file_test {

using ::testing::HasSubstr;

struct Content {
  std::string text;
  std::string sha256;
  std::string error;
};

Content ReadAll(const std::string& path) {
  Content content;
  Result<std::unique_ptr<TextFile>> file = TextFile::Open(path);
  if (!file) return {"", "", file.error().message};
  for (;;) {
    const Result<std::string_view> lines = (*file)->Next();
    if (!lines) return {content.text, "", lines.error().message};
    if (lines->empty()) break;
    EXPECT_EQ(lines->back(), '\n');
    content.text += *lines;
  }
  EXPECT_EQ((*file)->progress(), 1.0);
  content.sha256 = (*file)->Sha256();
  return content;
}

/// Lines of different lengths, several chunks of them.
std::string ManyLines() {
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += std::to_string(i) + std::string(i % 17, 'x') + "\n";
  return text;
}

TEST(TextFile, HandsOverEveryLineOnce) {
  const TemporaryFolder folder;
  const std::string text = ManyLines();
  EXPECT_EQ(ReadAll(folder.Write("log", text)).text, text);
}

TEST(TextFile, HashesTheBytesOfTheFile) {
  const TemporaryFolder folder;
  // The test vector "abc" of FIPS 180-2, appendix B.1.
  EXPECT_EQ(ReadAll(folder.Write("log", "abc")).sha256,
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  const std::string text = ManyLines();
  EXPECT_EQ(ReadAll(folder.Write("log", text)).sha256, Sha256Hex(text));
  const std::string packed = folder.WriteGzip("log.gz", text);
  EXPECT_EQ(ReadAll(packed).sha256, Sha256Hex(TemporaryFolder::Read(packed)));
}

TEST(TextFile, ReadsGzipWhateverItsNameIs) {
  const TemporaryFolder folder;
  const std::string text = ManyLines();
  EXPECT_EQ(ReadAll(folder.WriteGzip("log.csv", text)).text, text);
}

TEST(TextFile, ReadsGzipOfSeveralMembers) {
  const TemporaryFolder folder;
  const std::string first = TemporaryFolder::Read(folder.WriteGzip("first", "1\n"));
  const std::string second = TemporaryFolder::Read(folder.WriteGzip("second", "2\n"));
  EXPECT_EQ(ReadAll(folder.Write("both", first + second)).text, "1\n2\n");
}

TEST(TextFile, NamesAGzipThatEndsEarly) {
  const TemporaryFolder folder;
  const std::string whole = TemporaryFolder::Read(folder.WriteGzip("whole", ManyLines()));
  const std::string cut = folder.Write("cut.csv.gz", whole.substr(0, whole.size() / 2));
  EXPECT_THAT(ReadAll(cut).error, HasSubstr("cut.csv.gz: is an incomplete gzip file"));
}

TEST(TextFile, NamesADamagedGzip) {
  const TemporaryFolder folder;
  std::string bytes = TemporaryFolder::Read(folder.WriteGzip("whole", ManyLines()));
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x55);
  EXPECT_THAT(ReadAll(folder.Write("log.gz", bytes)).error, HasSubstr("damaged gzip"));
}

TEST(TextFile, EndsTheLastLineAndLeavesOutTheByteOrderMark) {
  const TemporaryFolder folder;
  EXPECT_EQ(ReadAll(folder.Write("log",
                                 "\xEF\xBB\xBF"
                                 "a,b\n1,2"))
                .text,
            "a,b\n1,2\n");
}

TEST(TextFile, TellsWhichConverterReadsAnotherSystemsLog) {
  const TemporaryFolder folder;
  EXPECT_EQ(ForeignFormatOf(folder.Write("a", "ULog\x01\x12\x35\x01")), "ulog");
  EXPECT_EQ(ForeignFormatOf(folder.Write("b", "\xA3\x95\x80")), "dataflash");
  for (const char* const other :
       {"H Product:Blackbox flight data recorder", "time[s],accel_x[g]", ""}) {
    EXPECT_EQ(ForeignFormatOf(folder.Write("c", other)), "");
  }
}

TEST(TextFile, SaysWhatIsWrongWithAFileThatIsNoText) {
  const TemporaryFolder folder;
  EXPECT_THAT(ReadAll(folder.Path("none.csv")).error,
              HasSubstr("none.csv: cannot be opened: No such"));
  EXPECT_THAT(ReadAll(folder.Path("")).error, HasSubstr("is a folder"));
  EXPECT_THAT(ReadAll("/dev/null").error, HasSubstr("not a regular file"));
  EXPECT_THAT(ReadAll(folder.Write("log", "")).error, HasSubstr("is empty"));
  EXPECT_THAT(ReadAll(folder.Write("log", "{\"a\": 1}")).error, HasSubstr("a JSON file"));
  EXPECT_THAT(ReadAll(folder.Write("log", "#ROSBAG V2.0\n")).error, HasSubstr("a ROS 1 bag"));
  EXPECT_THAT(ReadAll(folder.Write("log",
                                   "\xFF\xFE"
                                   "a"))
                  .error,
              HasSubstr("UTF-16"));
  EXPECT_THAT(ReadAll(folder.Write("log", std::string("1,\0,2\n", 6))).error,
              HasSubstr("binary file"));
}

TEST(TextFile, RefusesAnEndlessLine) {
  const TemporaryFolder folder;
  EXPECT_THAT(ReadAll(folder.Write("log", std::string(9U << 20, 'x'))).error,
              HasSubstr("has a line of more than"));
}

}  // namespace text_file_test
}  // namespace truetriad
