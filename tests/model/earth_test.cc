// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "truetriad/model/calibration.h"

namespace truetriad {
namespace earth_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Earth : public ::testing::Test {
 protected:
  Earth() { ShareFrom(std::string(TRUETRIAD_SOURCE_DIR) + "/share/truetriad"); }
  ~Earth() override { ::unsetenv("TRUETRIAD_SHARE"); }

  static void ShareFrom(const std::string& folder) {
    ::setenv("TRUETRIAD_SHARE", folder.c_str(), 1);
  }
};

// Published to 1e-8.
TEST_F(Earth, NormalGravityIsThatOfWgs84) {
  EXPECT_NEAR(NormalGravityMps2(45.0, 0.0), 9.80619777, 5e-9);
  EXPECT_NEAR(NormalGravityMps2(52.5, 1000.0), 9.80982840, 5e-9);
  // The defining constants: 9.7803253359 at the equator, 9.8321849378 at the pole.
  EXPECT_NEAR(NormalGravityMps2(0.0, 0.0), 9.7803253359, 5e-10);
  EXPECT_NEAR(NormalGravityMps2(-90.0, 0.0), 9.8321849378, 5e-10);
}

// An independent implementation's field, to its last digit: 0.1 nT of components, 0.001 deg.
TEST_F(Earth, FieldAgreesWithAnIndependentImplementation) {
  const Result<EarthField> field = WorldMagneticModel({47.0, 8.0, 400.0}, 2026.0);
  ASSERT_TRUE(field) << field.error().message;
  EXPECT_NEAR(field->strength_ut, 48.2104, 5e-5);
  EXPECT_NEAR(field->declination_deg, 3.408, 5e-4);
  EXPECT_NEAR(field->dip_deg, 63.113, 5e-4);
  const double rad = std::atan(1.0) / 45.0;
  const double horizontal_ut = field->strength_ut * std::cos(field->dip_deg * rad);
  EXPECT_NEAR(horizontal_ut * std::cos(field->declination_deg * rad), 21.7640, 1e-4);
  EXPECT_NEAR(horizontal_ut * std::sin(field->declination_deg * rad), 1.2962, 1e-4);
  EXPECT_NEAR(field->strength_ut * std::sin(field->dip_deg * rad), 42.9987, 1e-4);
}

// Values published with another program for 4 July 2028, to five digits: north 20139, east -4905,
// down 46532, horizontal 20727 nT.
TEST_F(Earth, FieldChangesOverTheYearsAsPublished) {
  const Result<double> year = DecimalYear("2028-07-04");
  ASSERT_TRUE(year);
  const Result<EarthField> field = WorldMagneticModel({42.283, -71.35, 1000.0}, *year);
  ASSERT_TRUE(field) << field.error().message;
  EXPECT_NEAR(field->strength_ut, 50.940, 1e-3);
  EXPECT_NEAR(field->dip_deg, 65.9899, 2e-4);
  EXPECT_NEAR(field->declination_deg, -13.6891, 5e-4);
}

TEST_F(Earth, DateIsAYearWithItsDays) {
  EXPECT_EQ(*DecimalYear("2026-01-01"), 2026.0);
  EXPECT_DOUBLE_EQ(*DecimalYear("2026-12-31"), 2026.0 + 364.0 / 365.0);
  EXPECT_DOUBLE_EQ(*DecimalYear("2028-12-31"), 2028.0 + 365.0 / 366.0);
  for (const char* wrong : {"",
                            "2026",
                            "2026-1-1",
                            "2026-02-29",
                            "2026-13-01",
                            "31-01-2026",
                            "2026-01-01T",
                            "2026/01/01",
                            "-026-01-01",
                            "2026-+1-01"}) {
    const Result<double> year = DecimalYear(wrong);
    ASSERT_FALSE(year) << wrong;
    EXPECT_THAT(year.error().message, HasSubstr("2026-01-31"));
  }
}

TEST_F(Earth, FieldOutsideOfItsYearsIsRefused) {
  for (const double year : {2024.99, 2030.01, std::numeric_limits<double>::quiet_NaN()}) {
    const Result<EarthField> field = WorldMagneticModel({47.0, 8.0, 400.0}, year);
    ASSERT_FALSE(field) << year;
    EXPECT_THAT(field.error().message, HasSubstr("2025.0 to 2030.0"));
  }
  EXPECT_TRUE(WorldMagneticModel({47.0, 8.0, 400.0}, 2025.0));
  EXPECT_TRUE(WorldMagneticModel({47.0, 8.0, 400.0}, 2030.0));
}

TEST_F(Earth, MissingDataFileSaysWhereItWasLookedFor) {
  ShareFrom("/nowhere");
  const Result<EarthField> field = WorldMagneticModel({47.0, 8.0, 400.0}, 2026.0);
  ASSERT_FALSE(field);
  EXPECT_EQ(field.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(
      field.error().message,
      AllOf(
          HasSubstr("magnetic/wmm2025.wmm"), HasSubstr("/nowhere"), HasSubstr("TRUETRIAD_SHARE")));
}

TEST_F(Earth, CutDataFileIsNamed) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(::testing::TempDir()) / "earth_cut";
  fs::remove_all(folder);
  fs::create_directories(folder);
  fs::copy(fs::path(TRUETRIAD_SOURCE_DIR) / "share/truetriad/magnetic", folder / "magnetic");
  for (const std::uintmax_t size : {2000, 6, 0}) {
    fs::resize_file(folder / "magnetic" / "wmm2025.wmm.cof", size);
    ShareFrom(folder.string());
    const Result<EarthField> field = WorldMagneticModel({47.0, 8.0, 400.0}, 2026.0);
    ASSERT_FALSE(field) << size;
    EXPECT_THAT(field.error().message, HasSubstr("cannot be read"));
  }
  fs::remove_all(folder);
}

}  // namespace earth_test
}  // namespace truetriad
