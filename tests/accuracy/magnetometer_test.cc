// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "accuracy/shared_recordings.h"

namespace truetriad {
namespace {

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
                  655);
}

TEST_F(MagnetometerRecordings, AKnownFieldGivesAbsoluteGains) {
  const ReferenceFit fit = ReadReferenceFit(File("b-mag-lis2mdl-field-known/reference.json"),
                                            {"lis2outsidemovingwarmerday"});
  ExpectAgreement("mag-lis2mdl", Manifest("mag-lis2mdl"), fit, 3612);
}

TEST_F(MagnetometerRecordings, ASmallCapOfDirectionsIsRefusedWithTheReason) {
  const Outcomes run = Run("mag-poor-coverage", Manifest("mag-poor-coverage"));
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_EQ(run.calibration.outcome, Outcome::kNotObservable);
  EXPECT_FALSE(run.calibration.sensors[Triad::kMagnetometer].has_value());
  EXPECT_THAT(run.text, HasSubstr("cover too little of the sphere"));
}

}  // namespace
}  // namespace truetriad
