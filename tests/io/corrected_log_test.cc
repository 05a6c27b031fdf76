// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/recording_samples.h"
#include "io/temporary_folder.h"
#include "truetriad/io/recording.h"

namespace truetriad {
namespace corrected_log_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CorrectedLog : public ::testing::Test {
 protected:
  CorrectedLog() { calibration_.outcome = Outcome::kConverged; }

  TriadCalibration& Calibrate(Triad triad, const std::string& unit) {
    TriadCalibration& sensor = calibration_.sensors[triad].emplace();
    sensor.input_unit = unit;
    return sensor;
  }

  Result<CorrectedLogSummary> Write(const std::string& input) {
    const Result<std::unique_ptr<SampleSource>> source = OpenRecording(input);
    TRUETRIAD_RETURN_IF_ERROR(source);
    return WriteCorrectedLog(**source, calibration_, output_);
  }
  Result<CorrectedLogSummary> WriteCsv(const std::string& text) {
    return Write(folder_.Write("log.csv", text));
  }
  std::string Output() const { return TemporaryFolder::Read(output_); }

  TemporaryFolder folder_;
  Calibration calibration_;
  std::string output_ = folder_.Path("corrected.csv");
};

TEST_F(CorrectedLog, HoldsTruthInTrueUnits) {
  TriadCalibration& accelerometer = Calibrate(Triad::kAccelerometer, "counts");
  accelerometer.model.bias = {100.0, 200.0, 300.0};
  accelerometer.model.sensitivity = Eigen::Vector3d(2.0, 4.0, 8.0).asDiagonal();
  const auto summary = WriteCsv(
      "time[ns],accel_x[counts],accel_y[counts],accel_z[counts],temperature[degC],pose\n"
      "1700000000123456789,102,200,292,20.5,0\n"
      "1700000000200000000,100,202,300,,3\n");
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->rows, 2);
  EXPECT_NEAR(summary->mean_length[Triad::kAccelerometer], 0.5 * (std::sqrt(2.0) + 0.5), 1e-12);
  EXPECT_EQ(Output(),
            "time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],temperature[degC],pose\n"
            "1700000000.123456789,1,0,-1,20.5,0\n"
            "1700000000.2,0,0.5,0,20.5,3\n");
}

TEST_F(CorrectedLog, CanBeReadAgainAsARecording) {
  Calibrate(Triad::kMagnetometer, "uT");
  ASSERT_TRUE(WriteCsv("time[s],mag_x[uT],mag_y[uT],mag_z[uT]\n-0.5,0.1,1e-7,-48.123456789\n"));
  const Result<RecordingSamples> recording = ReadRecording(output_);
  ASSERT_TRUE(recording) << recording.error().message;
  const StreamSamples& stream = recording->streams[Triad::kMagnetometer];
  EXPECT_THAT(stream.time_ns, ElementsAre(-500'000'000));
  EXPECT_THAT(stream.x, ElementsAre(0.1));
  EXPECT_THAT(stream.y, ElementsAre(1e-7));
  EXPECT_THAT(stream.z, ElementsAre(-48.123456789));
}

TEST_F(CorrectedLog, ConvertsAnotherUnitOfTheSameQuantity) {
  Calibrate(Triad::kMagnetometer, "uT").model.bias = {1.0, 2.0, 3.0};
  ASSERT_TRUE(WriteCsv("mag_x[nT],mag_y[nT],mag_z[nT]\n2000,3000,4000\n"));
  EXPECT_EQ(Output(), "mag_x[uT],mag_y[uT],mag_z[uT]\n1,1,1\n");
  const auto counts = WriteCsv("mag_x[counts],mag_y[counts],mag_z[counts]\n2,3,4\n");
  EXPECT_THAT(counts.error().message,
              HasSubstr("are in counts, and its calibration takes uT, but the size of a count"));
}

TEST_F(CorrectedLog, ConvertsCountsOfKnownSize) {
  TriadCalibration& sensor = Calibrate(Triad::kMagnetometer, "counts");
  sensor.si_per_count = 0.5;
  sensor.model.sensitivity *= 2.0;
  sensor.model.bias = {2.0, 4.0, 6.0};
  ASSERT_TRUE(WriteCsv("mag_x[uT],mag_y[uT],mag_z[uT]\n2,3,4\n"));
  EXPECT_EQ(Output(), "mag_x[uT],mag_y[uT],mag_z[uT]\n1,1,1\n");
}

TEST_F(CorrectedLog, MergesFilesByTime) {
  Calibrate(Triad::kAccelerometer, "m/s^2");
  Calibrate(Triad::kMagnetometer, "uT");
  folder_.Write("acc.csv", "t,x,y,z\n0,1,1,1\n1,2,2,2\n1,3,3,3\n4,4,4,4\n");
  folder_.Write("mag.csv", "t,x,y,z\n1,10,10,10\n2,20,20,20\n");
  const std::string keys = ", time: {column: t, unit: s}, x: x, y: y, z: z, unit: ";
  const auto summary =
      Write(folder_.Write("recording.yaml",
                          "recording: 1\nstreams:\n  accelerometer: {file: acc.csv" + keys +
                              "m/s^2}\n  magnetometer: {file: mag.csv" + keys + "uT}\n"));
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(Output(),
            "time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],mag_x[uT],mag_y[uT],mag_z[uT]\n"
            "0,1,1,1,,,\n"
            "1,2,2,2,10,10,10\n"
            "1,3,3,3,,,\n"
            "2,,,,20,20,20\n"
            "4,4,4,4,,,\n");
}

TEST_F(CorrectedLog, DoesNotWaitForASensorThatHasEnded) {
  Calibrate(Triad::kAccelerometer, "m/s^2");
  Calibrate(Triad::kMagnetometer, "uT");
  std::string text =
      "time[ms],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],mag_x[uT],mag_y[uT],mag_z[uT]\n"
      "0,1,1,1,2,2,2\n";
  constexpr int kRows = 300'000;  // More than may wait.
  for (int i = 1; i < kRows; ++i) text += std::to_string(i) + ",1,1,1,,,\n";
  const auto summary = WriteCsv(text);
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->rows, kRows);
}

TEST_F(CorrectedLog, EvaluatesThermalTermsInsideTheCalibratedRangeOnly) {
  ThermalTerms thermal;
  thermal.reference_degc = 20.0;
  thermal.range_degc = {0.0, 40.0};
  thermal.bias = {Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(0.0, 0.01, 0.0)};
  thermal.sensitivity = {0.05 * Eigen::Matrix3d::Identity()};
  Calibrate(Triad::kAccelerometer, "m/s^2").thermal = thermal;
  const std::string header =
      "time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],temperature[degC]\n";
  // At 40 degC tau = 20: the bias is (20, 4, 0) and the sensitivity 2; 50 degC counts as 40.
  const auto summary = WriteCsv(header + "0,1,1,1,\n1,1,1,1,20\n2,24,8,6,40\n3,24,8,6,50\n");
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(Output(),
            "time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],temperature[degC]\n"
            "0,,,,\n1,1,1,1,20\n2,2,2,3,40\n3,2,2,3,50\n");
  EXPECT_EQ(summary->clamped_temperature, 1);
  EXPECT_EQ(summary->not_corrected, 1);
  EXPECT_THAT(WriteCsv("accel_x[g],accel_y[g],accel_z[g]\n1,2,3\n").error().message,
              HasSubstr("has no temperature"));
}

// Temperature 20 for a long time, then 0.1 degC/s: after t seconds an element with a lag of 10 s is
// at 20 + 0.1 (t - 10 (1 - e^(-t/10))), and its rate, behind a lag of nothing else, at 0.1 (1 -
// e^(-t/10)).
TEST_F(CorrectedLog, FollowsTheTemperatureThroughALag) {
  ThermalTerms thermal;
  thermal.reference_degc = 20.0;
  thermal.range_degc = {0.0, 25.0};
  thermal.bias = {Eigen::Vector3d(1.0, 0.0, 0.0)};
  thermal.rate[RateTerm::kLinear] = Eigen::Vector3d(0.0, 100.0, 0.0);
  thermal.element_lag_s = Eigen::Vector3d::Constant(10.0);
  Calibrate(Triad::kAccelerometer, "m/s^2").thermal = thermal;
  std::string text = "time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],temperature[degC]\n";
  constexpr int kRows = 101;
  for (int t = 0; t < kRows; ++t) {
    text += std::to_string(t) + ",0,0,0," + std::to_string(20.0 + 0.1 * t) + "\n";
  }
  const auto summary = WriteCsv(text);
  ASSERT_TRUE(summary) << summary.error().message;
  std::istringstream lines(Output());
  std::string line;
  std::getline(lines, line);
  int clamped = 0;
  for (int t = 0; t < kRows; ++t) {
    double time = 0.0, x = 0.0, y = 0.0;
    ASSERT_TRUE(std::getline(lines, line));
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf", &time, &x, &y), 3);
    const double left = std::exp(-t / 10.0);
    const double tau = 0.1 * (t - 10.0 * (1.0 - left));
    clamped += tau > 5.0 ? 1 : 0;
    EXPECT_NEAR(x, -std::min(tau, 5.0), 1e-12);
    EXPECT_NEAR(y, -10.0 * (1.0 - left), 1e-10);
  }
  EXPECT_EQ(summary->clamped_temperature, clamped);
}

TEST_F(CorrectedLog, RefusesRatesOfTemperatureThatNobodySaysHowToFind) {
  ThermalTerms thermal;
  thermal.range_degc = {0.0, 40.0};
  thermal.rate[RateTerm::kLinear] = Eigen::Vector3d::Ones();
  Calibrate(Triad::kAccelerometer, "m/s^2").thermal = thermal;
  EXPECT_THAT(WriteCsv("time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],temperature[degC]\n"
                       "0,1,1,1,20\n")
                  .error()
                  .message,
              HasSubstr("does not state how to compute it"));
}

TEST_F(CorrectedLog, TakesTheGSensitivityOutOfTheGyroscope) {
  Calibrate(Triad::kAccelerometer, "m/s^2").model.sensitivity *= 2.0;
  Calibrate(Triad::kGyroscope, "rad/s").g_sensitivity = 0.5 * Eigen::Matrix3d::Identity();
  ASSERT_TRUE(WriteCsv(
      "accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],gyro_x[rad/s],gyro_y[rad/s],gyro_z[rad/s]\n"
      ",,,1,1,1\n8,0,0,3,1,1\n,,,3,1,1\n"));
  EXPECT_EQ(
      Output(),
      "accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],gyro_x[rad/s],gyro_y[rad/s],gyro_z[rad/s]\n"
      ",,,,,\n4,0,0,1,1,1\n,,,1,1,1\n");
  EXPECT_THAT(WriteCsv("gyro_x[rad/s],gyro_y[rad/s],gyro_z[rad/s]\n1,1,1\n").error().message,
              HasSubstr("needs the accelerometer"));
}

TEST_F(CorrectedLog, TakesTheHigherTermsOut) {
  TriadCalibration& accelerometer = Calibrate(Triad::kAccelerometer, "m/s^2");
  accelerometer.model.sensitivity *= 2.0;
  accelerometer.model.axis_terms[AxisTerm::kQuadratic] << 0.25, 0.0, 0.25;
  accelerometer.model.axis_terms[AxisTerm::kAsymmetry] << 0.0, 0.5, 0.0;
  // The axes feel 4, -4 and 0; then z reads what no u gives, u + u^2 / 4 being -1 at least: there
  // is no truth behind such a row.
  ASSERT_TRUE(WriteCsv("accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]\n8,-2,0\n8,-2,-2\n"));
  EXPECT_EQ(Output(), "accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]\n2,-2,0\n,,\n");
}

TEST_F(CorrectedLog, LeavesOutTriadsWithoutCalibration) {
  Calibrate(Triad::kAccelerometer, "g");
  const auto summary =
      WriteCsv("accel_x[g],accel_y[g],accel_z[g],mag_x[uT],mag_y[uT],mag_z[uT]\n1,2,3,4,5,6\n");
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_THAT(summary->left_out, ElementsAre(Triad::kMagnetometer));
  EXPECT_EQ(Output(), "accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]\n1,2,3\n");
  EXPECT_THAT(WriteCsv("mag_x[uT],mag_y[uT],mag_z[uT]\n4,5,6\n").error().message,
              HasSubstr("contains magnetometer, but the calibration includes none"));
}

TEST_F(CorrectedLog, IsNotWrittenAtAllWhenAnythingFails) {
  Calibrate(Triad::kAccelerometer, "g");
  std::string rows;
  for (int i = 0; i < 10'000; ++i) rows += "1,2,3\n";
  EXPECT_FALSE(WriteCsv("accel_x[g],accel_y[g],accel_z[g]\n" + rows + "1,2,x\n"));
  EXPECT_EQ(folder_.FileCount(), 1U);  // The input alone.
  output_ = folder_.Path("no/such/folder.csv");
  EXPECT_THAT(WriteCsv("accel_x[g],accel_y[g],accel_z[g]\n1,2,3\n").error().message,
              HasSubstr("folder.csv: cannot be written: there is no folder"));
  output_ = folder_.Path("corrected.csv");
  calibration_.outcome = Outcome::kNotObservable;
  EXPECT_THAT(WriteCsv("accel_x[g],accel_y[g],accel_z[g]\n1,2,3\n").error().message,
              HasSubstr("not usable"));
}

}  // namespace corrected_log_test
}  // namespace truetriad
