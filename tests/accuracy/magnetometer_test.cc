// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "accuracy/shared_recordings.h"
#include "truetriad/calibrate/evaluate.h"

namespace truetriad {
namespace magnetometer_test {

using ::testing::HasSubstr;

class MagnetometerRecordings : public SharedRecordings {
 protected:
  // Converged, within 3 √2 σ of the reference, and with no larger share of the field unexplained
  // than the parameters cost: the reference minimises the plain RMS.
  void ExpectAgreement(const std::string& experiment,
                       const std::string& input,
                       const ReferenceFit& fit,
                       int poses) {
    const Outcomes run = Run(experiment, input);
    ASSERT_EQ(run.exit_code, 0) << run.text;
    const Calibration& calibration = run.calibration;
    EXPECT_EQ(calibration.quality.poses, poses);
    const double field_ut = *calibration.reference.field_ut;
    EXPECT_TRUE(Agrees(calibration, Triad::kMagnetometer, fit, field_ut));
    EXPECT_LE(*calibration.quality.residual_rms[Triad::kMagnetometer] / field_ut,
              (1.0 + 9.0 / poses) * fit.rms_after / fit.target_norm);
  }
};

TEST_F(MagnetometerRecordings, NoisyIntegerCountsAgreeWithTheReference) {
  ExpectAgreement("mag-347",
                  Manifest("mag-347"),
                  ReadReferenceFit(File("b-mag-347-points/reference.json"), {"mag_out"}),
                  347);
}

TEST_F(MagnetometerRecordings, StronglyEllipticSetsAgreeWithTheReference) {
  if (!MakeTables()) GTEST_SKIP() << "no python3 to convert the JSON files with";
  const std::string reference = File("b-mag-krepa-json/reference.json");
  ExpectAgreement("mag-krepa-1",
                  Table("krepa_mag_1"),
                  ReadReferenceFit(reference, {"mag_test_data_1.json:mag"}),
                  540);
  ExpectAgreement("mag-krepa-2",
                  Table("krepa_mag_2"),
                  ReadReferenceFit(reference, {"mag_test_data_2.json:mag"}),
                  655 - 2);  // two rows repeat others
}

TEST_F(MagnetometerRecordings, AKnownFieldGivesAbsoluteGains) {
  const ReferenceFit fit = ReadReferenceFit(File("b-mag-lis2mdl-field-known/reference.json"),
                                            {"lis2outsidemovingwarmerday"});
  ExpectAgreement("mag-lis2mdl", Manifest("mag-lis2mdl"), fit, 3612);
}

// χ² over its degrees of freedom of the difference of two calibrations, which are of one unit.
double DifferenceOf(const Outcomes& a, const Outcomes& b) {
  EXPECT_EQ(a.exit_code, 0) << a.text;
  EXPECT_EQ(b.exit_code, 0) << b.text;
  const Result<Comparison> comparison = Compare(a.calibration, b.calibration);
  EXPECT_TRUE(comparison);
  return comparison ? comparison->chi2 / comparison->dof : 1e9;
}

// The two parts of a table whose rows `is_second` chooses.
std::array<std::string, 2> PartsOf(const TemporaryFolder& work,
                                   const std::string& table,
                                   const std::function<bool(std::size_t, std::size_t)>& is_second) {
  std::ifstream file(table);
  std::string header;
  std::getline(file, header);
  std::vector<std::string> rows;
  for (std::string row; std::getline(file, row);) rows.push_back(row);
  std::array<std::string, 2> text = {header + "\n", header + "\n"};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    text[is_second(i, rows.size()) ? 1 : 0] += rows[i] + "\n";
  }
  return {work.Write("first.csv", text[0]), work.Write("second.csv", text[1])};
}

// χ² over its degrees of freedom: 1 on average, up to 2 if the readings lie on no exact ellipsoid;
// it was 3 to 1600 with σ of white noise alone.
constexpr double kMostDifference = 2.0;

TEST_F(MagnetometerRecordings, PartsOfATumbleAgree) {
  if (!MakeTables()) GTEST_SKIP() << "no python3 to convert the JSON files with";
  for (const auto& [experiment, table] :
       {std::pair("mag-krepa-1", "krepa_mag_1"), std::pair("mag-krepa-2", "krepa_mag_2")}) {
    const auto halves = PartsOf(
        work(), Table(table), [](std::size_t i, std::size_t count) { return 2 * i >= count; });
    EXPECT_LE(DifferenceOf(Run(experiment, halves[0]), Run(experiment, halves[1])),
              kMostDifference);
    const auto turns = PartsOf(work(), Table(table), [](std::size_t i, std::size_t count) {
      return (16 * i / count) % 2 == 1;
    });
    EXPECT_LE(DifferenceOf(Run(experiment, turns[0]), Run(experiment, turns[1])), kMostDifference);
  }
  const std::string lis2mdl = Manifest("mag-lis2mdl");
  EXPECT_LE(DifferenceOf(Run("mag-lis2mdl", lis2mdl, "exclude=[{from_s: 63.3, to_s: 200}]"),
                         Run("mag-lis2mdl", lis2mdl, "exclude=[{from_s: 0, to_s: 63.3}]")),
            kMostDifference);
}

TEST_F(MagnetometerRecordings, ASmallCapOfDirectionsIsRefusedWithTheReason) {
  const Outcomes run = Run("mag-poor-coverage", Manifest("mag-poor-coverage"));
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_EQ(run.calibration.outcome, Outcome::kNotObservable);
  EXPECT_FALSE(run.calibration.sensors[Triad::kMagnetometer].has_value());
  const Finding* const why = Find(run.calibration.findings, FindingCode::kTooFewDirections);
  ASSERT_NE(why, nullptr);
  EXPECT_THAT(why->text, HasSubstr("cover too little of the sphere"));
}

}  // namespace magnetometer_test
}  // namespace truetriad
