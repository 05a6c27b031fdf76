// SPDX-License-Identifier: Apache-2.0
#include "report/table.h"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace truetriad {
namespace format_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Its way for everyday numbers is that of the library, also where a tie is near.
TEST(Fixed, RoundsAsTheLibraryDoes) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(-6.0, 9.0), sign(-1.0, 1.0);
  std::vector<double> values = {
      0.0, -0.0, 0.05, -0.05, 0.25, 0.35, 0.125, 1.005, 2.5, -3.5, 99999.95};
  for (int i = 0; i < 20000; ++i) values.push_back(sign(random) * std::pow(10.0, exponent(random)));
  for (int i = 0; i < 2000; ++i) values.push_back((i - 1000) / 8.0 + 0.05);
  for (const double value : values) {
    for (int decimals = 0; decimals < 6; ++decimals) {
      std::array<char, 64> buffer{};
      const auto end = std::to_chars(buffer.data(),
                                     buffer.data() + buffer.size(),
                                     value,
                                     std::chars_format::fixed,
                                     decimals)
                           .ptr;
      std::string expected(buffer.data(), end);
      if (expected.find_first_of("123456789") == std::string::npos && expected[0] == '-') {
        expected.erase(0, 1);
      }
      ASSERT_EQ(Fixed(value, decimals), expected) << value;
    }
  }
}

TEST(WithSigma, ShowsTwoDigitsOfSigmaAndTheValueToTheSamePlace) {
  EXPECT_EQ(WithSigma(0.0512345, 0.00045), "0.05123 ± 0.00045");
  EXPECT_EQ(WithSigma(-132.44, 0.91), "-132.44 ± 0.91");
  EXPECT_EQ(WithSigma(132.44, 3.2), "132.4 ± 3.2");
  EXPECT_EQ(WithSigma(2310.4, 41.0), "2310 ± 41");
}

TEST(WithSigma, RoundsSigmaUpWithoutAThirdDigit) {
  EXPECT_EQ(WithSigma(1.0, 0.0996), "1.00 ± 0.10");
  EXPECT_EQ(WithSigma(1.0, 9.96), "1 ± 10");
}

TEST(WithSigma, ShowsZerosWhereDigitsMeanNothing) {
  EXPECT_EQ(WithSigma(123456.0, 4321.0), "123500 ± 4300");
}

TEST(WithSigma, SharesAnExponentWhenVerySmall) {
  EXPECT_EQ(WithSigma(1.23456e-9, 1.2e-12), "(1.2346 ± 0.0012)e-9");
}

TEST(WithSigma, ShowsTheValueAloneWithoutASigma) {
  EXPECT_EQ(WithSigma(1.0, 0.0), "1");
  EXPECT_EQ(WithSigma(1.0, kNan), "1");
  EXPECT_EQ(WithSigma(kNan, 1.0), "n/a");
  EXPECT_EQ(WithSigma(2.0, kInfinity), "2 ± ∞");
}

TEST(Fixed, HasNoNegativeZero) {
  EXPECT_EQ(Fixed(-0.0001, 2), "0.00");
  EXPECT_EQ(Fixed(-0.01, 2), "-0.01");
}

TEST(Significant, NamesWhatIsNotANumber) {
  EXPECT_EQ(Significant(kNan, 3), "n/a");
  EXPECT_EQ(Significant(-kInfinity, 3), "-∞");
}

TEST(DisplayUnit, UsesTheSignsOfTheSi) {
  EXPECT_EQ(DisplayUnit("m/s^2"), "m/s²");
  EXPECT_EQ(DisplayUnit("uT"), "µT");
  EXPECT_EQ(DisplayUnit("m/s^2/degC^2"), "m/s²/°C²");
  EXPECT_EQ(DisplayUnit("counts"), "counts");
}

}  // namespace format_test
}  // namespace truetriad
