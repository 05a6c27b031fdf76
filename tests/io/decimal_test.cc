// SPDX-License-Identifier: Apache-2.0
#include "io/decimal.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace truetriad {
namespace decimal_test {

std::optional<double> Double(const std::string& text) {
  Decimal decimal;
  const std::string terminated = text + "\n";
  if (!ScanDecimal(terminated.c_str(), &decimal) || *decimal.end != '\n') return std::nullopt;
  return ToDouble(decimal);
}

std::optional<std::int64_t> Integer(const std::string& text, int power) {
  Decimal decimal;
  const std::string terminated = text + "\n";
  if (!ScanDecimal(terminated.c_str(), &decimal) || *decimal.end != '\n') return std::nullopt;
  return ToInteger(decimal, power);
}

TEST(Decimal, ReadsEverySpellingOfANumber) {
  for (const char* text : {"0",
                           "-0",
                           "1",
                           "-1",
                           "+1",
                           "1.",
                           ".5",
                           "-.5",
                           "3.3108000e+04",
                           "1e5",
                           "1E-5",
                           "2.9840000e-02",
                           "123456789012345678901234567890",
                           "0.000000000000000000000000012345",
                           "9007199254740993",
                           "1.7976931348623157e308",
                           "2.2250738585072014e-308",
                           "5e-324",
                           "0.1000000000000000055511151231257827",
                           "-0.0e5"}) {
    ASSERT_TRUE(Double(text)) << text;
    const double expected = std::strtod(text, nullptr);
    EXPECT_EQ(*Double(text), expected) << text;
    EXPECT_EQ(std::signbit(*Double(text)), std::signbit(expected)) << text;
  }
}

TEST(Decimal, AgreesWithTheStandardLibraryToTheLastBit) {
  std::mt19937_64 random(20240131);
  std::uniform_real_distribution<double> exponent(-30.0, 30.0);
  for (int i = 0; i < 100'000; ++i) {
    char text[64];
    const double value = std::pow(10.0, exponent(random)) * (i % 2 == 0 ? 1.0 : -1.0);
    std::snprintf(text, sizeof(text), i % 3 == 0 ? "%.*g" : "%.*e", 1 + i % 19, value);
    ASSERT_EQ(Double(text), std::strtod(text, nullptr)) << text;
  }
}

TEST(Decimal, RefusesWhatIsNotANumber) {
  for (const char* text :
       {"", "-", ".", "e5", "1e", "1e+", "0x10", "1_000", "1.2.3", "nan", "--1"}) {
    EXPECT_FALSE(Double(text)) << text;
  }
  EXPECT_FALSE(Double("1e999"));
}

TEST(Decimal, KeepsEpochNanosecondsExact) {
  EXPECT_EQ(Integer("1700000000123456789", 0), 1700000000123456789);
  EXPECT_EQ(Integer("1700000000.123456789", 9), 1700000000123456789);
  EXPECT_EQ(Integer("1700000000123.456789", 6), 1700000000123456789);
  EXPECT_EQ(Integer("1.700000000123456789e9", 9), 1700000000123456789);
  EXPECT_EQ(Integer("-0.000000001", 9), -1);
  EXPECT_EQ(Integer("2.9840000e-02", 9), 29840000);
}

TEST(Decimal, RoundsWhatIsFinerThanANanosecond) {
  EXPECT_EQ(Integer("0.0000000014", 9), 1);
  EXPECT_EQ(Integer("0.0000000015", 9), 2);
  EXPECT_EQ(Integer("1e-300", 9), 0);
  // 23 digits: more than any integer holds; the first 19 count.
  EXPECT_EQ(Integer("1700000000.1234567891234", 9), 1700000000123456789);
  EXPECT_EQ(Integer("0000000000000000000000001.5", 9), 1500000000);
}

TEST(Decimal, RefusesTimesThatDoNotFit) {
  EXPECT_EQ(Integer("9223372036854775807", 0), 9223372036854775807);
  EXPECT_FALSE(Integer("9223372036854775808", 0));
  EXPECT_FALSE(Integer("1e30", 0));
  EXPECT_FALSE(Integer("1700000000123456789", 9));
}

}  // namespace decimal_test
}  // namespace truetriad
