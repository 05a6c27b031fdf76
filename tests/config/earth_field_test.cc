// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/field_check.h"
#include "support/finding_matchers.h"
#include "truetriad/base/triad.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace earth_field_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr const char* kPlace =
    "latitude_deg: 47, longitude_deg: 8, height_m: 400, date: 2026-01-01";
constexpr const char* kSouthPlace =
    "latitude_deg: -33.1, longitude_deg: 151.2, height_m: 58, date: 2026-01-31";

class EarthFieldInExperiment : public ::testing::Test {
 protected:
  EarthFieldInExperiment() {
    std::filesystem::create_directories(folder_);
    ShareFrom(std::string(TRUETRIAD_SOURCE_DIR) + "/share/truetriad");
  }
  ~EarthFieldInExperiment() override {
    ::unsetenv("TRUETRIAD_SHARE");
    std::filesystem::remove_all(folder_);
  }

  static void ShareFrom(const std::string& folder) {
    ::setenv("TRUETRIAD_SHARE", folder.c_str(), 1);
  }

  Result<Experiment> Load(const std::string& text) const {
    const std::string path = (folder_ / "experiment.yaml").string();
    EXPECT_TRUE(WriteFileAtomically(path, text));
    return ReadExperiment(path);
  }

  /// With `position: { place }` and `rest`, the other keys of `reference`.
  Result<Experiment> LoadAt(const std::string& place, const std::string& rest = "") const {
    return Load(
        "experiment: 1\nsensors: { accelerometer: {}, magnetometer: {}, gyroscope: {} }\n"
        "reference: { position: { " +
        place + " }" + rest + " }\n");
  }

  Experiment LoadWell(const std::string& place, const std::string& rest = "") const {
    Result<Experiment> experiment = LoadAt(place, rest);
    EXPECT_TRUE(experiment) << experiment.error().message;
    return experiment ? *experiment : Experiment();
  }

  std::string ErrorAt(const std::string& place, const std::string& rest) const {
    const Result<Experiment> experiment = LoadAt(place, rest);
    EXPECT_FALSE(experiment);
    return experiment ? "" : experiment.error().message;
  }

  std::filesystem::path folder_ = std::filesystem::path(::testing::TempDir()) /
                                  (std::string("earth_field_") +
                                   ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(EarthFieldInExperiment, PositionGivesGravityButNoFieldByItself) {
  const ReferenceOptions reference = LoadWell(kPlace).options.reference;
  EXPECT_EQ(reference.gravity_mps2.value, NormalGravityMps2(47.0, 400.0));
  EXPECT_EQ(reference.gravity_mps2.sigma, kNormalGravitySigmaMps2);
  EXPECT_FALSE(reference.field_ut.known());
  EXPECT_FALSE(reference.dip_rad.known());
}

TEST_F(EarthFieldInExperiment, CleanSiteTakesStrengthAndDipWithTheirSigma) {
  const ReferenceOptions reference = LoadWell(kPlace, ", field: { site: clean }").options.reference;
  EXPECT_NEAR(*reference.field_ut.value, 48.2104, 1e-4);
  EXPECT_EQ(reference.field_ut.sigma, 0.138);
  EXPECT_NEAR(*reference.dip_rad.value, 63.113 * kRadPerDeg, 1e-5);
  EXPECT_DOUBLE_EQ(reference.dip_rad.sigma, 0.20 * kRadPerDeg);
}

TEST_F(EarthFieldInExperiment, WhatIsStatedWinsAlsoThatItIsUnknown) {
  const ReferenceOptions reference =
      LoadWell(kPlace, ", field: { site: clean, strength_ut: unknown, dip_deg: 60 }")
          .options.reference;
  EXPECT_FALSE(reference.field_ut.known());
  EXPECT_DOUBLE_EQ(*reference.dip_rad.value, 60.0 * kRadPerDeg);
  EXPECT_EQ(reference.dip_rad.sigma, 0.0);
}

TEST_F(EarthFieldInExperiment, HemisphereOfTheDipFollowsFromThePosition) {
  EXPECT_TRUE(LoadWell(kPlace).options.reference.northern_hemisphere);
  EXPECT_FALSE(LoadWell(kSouthPlace).options.reference.northern_hemisphere);
  EXPECT_TRUE(LoadWell(kSouthPlace, ", field: { hemisphere: north }")
                  .options.reference.northern_hemisphere);
}

TEST_F(EarthFieldInExperiment, LatitudeAloneGivesTheHemisphereFarFromTheEquator) {
  const auto reference = [this](const std::string& latitude) {
    return LoadWell("latitude_deg: " + latitude + ", height_m: 20").options.reference;
  };
  EXPECT_FALSE(reference("-33").northern_hemisphere);
  EXPECT_TRUE(reference("-33").is_hemisphere_stated);
  EXPECT_TRUE(reference("47").northern_hemisphere);
  EXPECT_TRUE(reference("47").is_hemisphere_stated);
  EXPECT_FALSE(reference("-12").is_hemisphere_stated);
}

TEST_F(EarthFieldInExperiment, PositionMayBeStatedKeyByKey) {
  const std::string path = (folder_ / "experiment.yaml").string();
  EXPECT_TRUE(WriteFileAtomically(path, "experiment: 1\nsensors: { accelerometer: {} }\n"));
  const auto experiment = ReadExperiment(
      path, {"reference.position.latitude_deg=-33", "reference.position.height_m=20"});
  ASSERT_TRUE(experiment) << experiment.error().message;
  EXPECT_EQ(experiment->position->latitude_deg, -33.0);
  EXPECT_EQ(experiment->position->height_m, 20.0);
  const auto half = ReadExperiment(path, {"reference.position.latitude_deg=-33"});
  ASSERT_FALSE(half);
  EXPECT_THAT(half.error().message, HasSubstr("reference.position.height_m"));
}

TEST_F(EarthFieldInExperiment, AnOverridesPlaceTakesThatOfWhatAFileStates) {
  const std::string path = (folder_ / "experiment.yaml").string();
  EXPECT_TRUE(WriteFileAtomically(
      path,
      "experiment: 1\nsensors: { accelerometer: {}, magnetometer: {} }\n"
      "reference: { gravity_mps2: 9.80665, field: { strength_ut: unknown, dip_deg: unknown } }\n"));
  const std::string place = std::string("reference.position={ ") + kPlace + " }";
  const auto reference = [&](const std::vector<std::string>& overrides) {
    const Result<Experiment> experiment = ReadExperiment(path, overrides);
    EXPECT_TRUE(experiment) << experiment.error().message;
    return experiment->options.reference;
  };
  EXPECT_EQ(reference({place}).gravity_mps2.value, NormalGravityMps2(47.0, 400.0));
  EXPECT_FALSE(reference({place}).field_ut.known());
  EXPECT_EQ(reference({"reference.gravity_mps2=9.81", place}).gravity_mps2.value, 9.81);
  EXPECT_NEAR(*reference({place, "reference.field.site=clean"}).field_ut.value, 48.2104, 1e-4);
}

TEST_F(EarthFieldInExperiment, EarthRateTakesLatitudeAndDeclination) {
  const auto rate = LoadWell(kPlace, ", earth_rate: position").options.reference.earth_rate;
  ASSERT_TRUE(rate);
  EXPECT_DOUBLE_EQ(rate->latitude_rad, 47.0 * kRadPerDeg);
  EXPECT_NEAR(rate->declination_rad, 3.408 * kRadPerDeg, 1e-5);
  const auto stated =
      LoadWell(kPlace, ", earth_rate: { declination_deg: 1 }").options.reference.earth_rate;
  EXPECT_DOUBLE_EQ(stated->declination_rad, kRadPerDeg);
  const auto without_date = LoadWell("latitude_deg: 47, height_m: 400", ", earth_rate: position")
                                .options.reference.earth_rate;
  EXPECT_EQ(without_date->declination_rad, 0.0);
}

TEST_F(EarthFieldInExperiment, ResolvesToTheSameOptionsWithoutTheModel) {
  const Experiment first = LoadWell(kPlace, ", field: { site: clean }, earth_rate: position");
  ShareFrom("/nowhere");
  const Result<Experiment> second = Load(first.resolved_yaml);
  ASSERT_TRUE(second) << second.error().message;
  const ReferenceOptions& a = first.options.reference;
  const ReferenceOptions& b = second->options.reference;
  EXPECT_EQ(a.field_ut.value, b.field_ut.value);
  EXPECT_EQ(a.field_ut.sigma, b.field_ut.sigma);
  EXPECT_EQ(a.dip_rad.value, b.dip_rad.value);
  EXPECT_EQ(a.northern_hemisphere, b.northern_hemisphere);
  EXPECT_EQ(a.earth_rate->declination_rad, b.earth_rate->declination_rad);
}

TEST_F(EarthFieldInExperiment, SaysWhatIsMissing) {
  EXPECT_THAT(ErrorAt("latitude_deg: 47, height_m: 400", ", field: { site: clean }"),
              HasSubstr("no longitude_deg and no date"));
  EXPECT_THAT(
      ErrorAt("latitude_deg: 47, height_m: 400, longitude_deg: 8", ", field: { site: clean }"),
      HasSubstr("has no date"));
  EXPECT_THAT(ErrorAt("latitude_deg: 47, longitude_deg: 8, height_m: 400, date: 31.1.2026", ""),
              AllOf(HasSubstr("experiment.yaml:3"), HasSubstr("2026-01-31")));
  const std::string old = "latitude_deg: 47, longitude_deg: 8, height_m: 400, date: 2019-05-01";
  EXPECT_THAT(ErrorAt(old, ", field: { site: clean }"), HasSubstr("2025.0 to 2030.0"));
  EXPECT_THAT(ErrorAt(old, ", earth_rate: position"),
              AllOf(HasSubstr("2025.0 to 2030.0"), HasSubstr("declination_deg")));
  EXPECT_THAT(ErrorAt(kPlace, ", field: { site: dirty }"), HasSubstr("unknown, clean"));
  const Result<Experiment> nowhere =
      Load("experiment: 1\nsensors: { magnetometer: {} }\nreference: { field: { site: clean } }\n");
  ASSERT_FALSE(nowhere);
  EXPECT_THAT(nowhere.error().message, HasSubstr("`reference.position` is missing"));
  ShareFrom("/nowhere");
  EXPECT_THAT(ErrorAt(kPlace, ", field: { site: clean }"), HasSubstr("TRUETRIAD_SHARE"));
}

Calibration WithField(double strength_ut, double dip_deg) {
  Calibration calibration;
  calibration.sensors[Triad::kMagnetometer].emplace().input_unit = "uT";
  calibration.reference.field_ut = strength_ut;
  calibration.reference.dip_rad = dip_deg * kRadPerDeg;
  return calibration;
}

TEST_F(EarthFieldInExperiment, ChecksTheFieldThatWasFound) {
  const Experiment experiment = LoadWell(kPlace);
  Calibration good = WithField(44.0, 58.0);
  CheckField(experiment, &good);
  EXPECT_THAT(good.findings, IsEmpty());

  Calibration strong = WithField(62.0, 63.0);
  CheckField(experiment, &strong);
  ASSERT_EQ(strong.findings.size(), 1U);
  EXPECT_EQ(strong.findings[0].code, FindingCode::kFieldUnlikely);
  EXPECT_NEAR(*strong.findings[0].Value("expected"), 48.2, 0.1);
  EXPECT_FALSE(strong.findings[0].Value("dip"));

  Calibration tilted = WithField(62.0, -63.0);
  CheckField(experiment, &tilted);
  ASSERT_EQ(tilted.findings.size(), 1U);
  EXPECT_NEAR(*tilted.findings[0].Value("dip"), -63.0, 0.1);
  EXPECT_NEAR(*tilted.findings[0].Value("expected_dip"), 63.1, 0.1);

  Calibration counts = WithField(500.0, 63.0);
  counts.sensors[Triad::kMagnetometer]->input_unit = "counts";
  counts.reference.field_nominal = true;
  CheckField(experiment, &counts);
  EXPECT_THAT(counts.findings, IsEmpty());
}

TEST_F(EarthFieldInExperiment, SaysWhenTheFieldCouldNotBeChecked) {
  const Experiment experiment =
      LoadWell("latitude_deg: 47, longitude_deg: 8, height_m: 400, date: 2019-05-01");
  Calibration calibration = WithField(48.0, 63.0);
  CheckField(experiment, &calibration);
  EXPECT_THAT(calibration.findings,
              ElementsAre(AllOf(HasCode(FindingCode::kFieldNotChecked),
                                Says(HasSubstr("2025.0 to 2030.0")))));
  Calibration unasked = WithField(80.0, 0.0);
  CheckField(LoadWell("latitude_deg: 47, height_m: 400"), &unasked);
  EXPECT_THAT(unasked.findings, IsEmpty());
}

}  // namespace earth_field_test
}  // namespace truetriad
