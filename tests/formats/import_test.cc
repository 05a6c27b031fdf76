// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/sample_units.h"
#include "io/temporary_folder.h"
#include "support/finding_matchers.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace import_test {

using formats_test::RandomUnitCalibration;
using formats_test::Signal;
using formats_test::UnitKind;
using formats_test::WorstDisagreement;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Exports and imports again.
Calibration RoundTrip(const Calibration& unit,
                      const std::string& format,
                      const std::string& file_name,
                      const ImportOptions& options = {}) {
  const TemporaryFolder folder;
  ExportOptions export_options;
  export_options.file_name = file_name;
  const Result<Export> exported = ExportCalibration(unit, format, export_options);
  EXPECT_TRUE(exported) << exported.error().message;
  std::vector<std::string> paths;
  for (const ExportedFile& file : exported->files) {
    paths.push_back(folder.Write(file_name + file.suffix, file.text));
  }
  const Result<Import> imported = ImportCalibration(format, paths, options);
  EXPECT_TRUE(imported) << imported.error().message;
  return imported ? imported->calibration : Calibration();
}

/// Gives the unit the uncertainties of a good calibration: 1e-4 of the signal and of the gain.
void StateUncertainty(Calibration* unit) {
  unit->covariance = {};
  std::vector<double> variances;
  for (const Triad triad : kTriads) {
    if (!unit->sensors[triad]) continue;
    const std::string name(TriadName(triad));
    for (const char axis : {'x', 'y', 'z'}) {
      unit->covariance.parameters.push_back(name + ".bias." + axis);
      variances.push_back(std::pow(1e-4 * Signal(triad), 2));
    }
    for (const char row : {'x', 'y', 'z'}) {
      for (const char col : {'x', 'y', 'z'}) {
        unit->covariance.parameters.push_back(name + ".sensitivity." + row + col);
        const bool fixed = triad == Triad::kAccelerometer && col > row;
        variances.push_back(fixed ? 0.0 : 1e-8);
      }
    }
  }
  unit->covariance.matrix = Eigen::Map<const Eigen::VectorXd>(
                                variances.data(), static_cast<Eigen::Index>(variances.size()))
                                .asDiagonal();
}

struct Holding {
  std::string format;
  std::string file_name;
  UnitKind kind;
  double precision;

  friend void PrintTo(const Holding& of, std::ostream* out) { *out << of.format; }
};

class RoundTrips : public ::testing::TestWithParam<Holding> {};

TEST_P(RoundTrips, CompareAsZeroWithinPrecision) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    Calibration unit = RandomUnitCalibration(GetParam().kind, seed);
    StateUncertainty(&unit);
    const Calibration back = RoundTrip(unit, GetParam().format, GetParam().file_name);
    for (const Triad triad : kTriads) {
      if (!back.sensors[triad]) continue;
      const TriadModel<double>& a = unit.sensors[triad]->model;
      const TriadModel<double>& b = back.sensors[triad]->model;
      EXPECT_LT((a.bias - b.bias).norm(), GetParam().precision * Signal(triad));
      EXPECT_EQ(unit.sensors[triad]->input_unit, back.sensors[triad]->input_unit);
    }
    const Result<Comparison> comparison = Compare(unit, back);
    ASSERT_TRUE(comparison) << comparison.error().message;
    EXPECT_LT(comparison->largest_in_sigmas, GetParam().precision / 1e-4 * 10.0);
    EXPECT_GT(comparison->dof, 0);
  }
}

TEST_P(RoundTrips, CorrectReadingsAsTheOriginal) {
  UnitKind kind = GetParam().kind;
  const Calibration unit = RandomUnitCalibration(kind, 3);
  const Calibration back = RoundTrip(unit, GetParam().format, GetParam().file_name);
  // The body frame may be another one; imu_tk's is.
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();
  if (back.gauge == Gauge::kAccelZ) {
    frame = GaugeRotation(Gauge::kAccelZ, unit.sensors[Triad::kAccelerometer]->model.sensitivity);
  }
  for (const Triad triad : kTriads) {
    if (!back.sensors[triad]) continue;
    const TriadCalibration& sensor = *back.sensors[triad];
    const auto equation = [&](const Eigen::Vector3d& raw, const Eigen::Vector3d& f, double t) {
      const TriadModel<double> model =
          sensor.thermal ? ModelAtTemperature(sensor.model, *sensor.thermal, t) : sensor.model;
      Eigen::Vector3d reading = raw;
      if (sensor.g_sensitivity) reading -= *sensor.g_sensitivity * f;
      return model.TruthFromRaw(reading);
    };
    EXPECT_LT(WorstDisagreement(unit, triad, equation, frame), GetParam().precision)
        << TriadName(triad);
  }
}

TEST_P(RoundTrips, LoadBackAsACalibrationFile) {
  const Calibration back =
      RoundTrip(RandomUnitCalibration(GetParam().kind, 4), GetParam().format, GetParam().file_name);
  const std::string text = CalibrationToYaml(back);
  const Result<Calibration> reread = CalibrationFromYaml(text, "import.yaml");
  ASSERT_TRUE(reread) << reread.error().message;
  EXPECT_EQ(CalibrationToYaml(*reread), text);
}

constexpr UnitKind kAutopilot = {.misaligned = false, .symmetric_mag = true, .gyro_matrix = false};

INSTANTIATE_TEST_SUITE_P(
    Of,
    RoundTrips,
    ::testing::Values(Holding{"px4", "unit.params", kAutopilot, 2e-6},
                      Holding{"ardupilot", "unit.param", kAutopilot, 2e-6},
                      Holding{"kalibr-result", "imu.yaml", {.g_sensitivity = true}, 1e-12},
                      Holding{"imu-tk", "unit", {}, 1e-12},
                      Holding{"imu_tk", "unit", {}, 1e-12},
                      Holding{"matlab", "unit.m", {.g_sensitivity = true}, 1e-12}),
    [](const auto& test) {
      std::string name = test.param.format;
      std::replace(name.begin(), name.end(), '-', 'H');
      return name;
    });

#ifdef TRUETRIAD_HAVE_MATIO
INSTANTIATE_TEST_SUITE_P(OfMat,
                         RoundTrips,
                         ::testing::Values(Holding{"matlab", "unit.mat", {}, 1e-12}));
#endif

TEST(Import, KeepsTheTemperatureTermsOfAutopilots) {
  for (const char* const format : {"px4", "ardupilot"}) {
    Calibration unit = RandomUnitCalibration(
        {.misaligned = false, .symmetric_mag = true, .gyro_matrix = false, .bias_order = 3}, 5);
    const bool holds_mag = std::string(format) == "px4";
    if (!holds_mag) unit.sensors[Triad::kMagnetometer]->thermal.reset();
    const Calibration back = RoundTrip(unit, format, "unit");
    for (const Triad triad : kTriads) {
      if (triad == Triad::kMagnetometer && !holds_mag) continue;
      const TriadCalibration& sensor = *back.sensors[triad];
      ASSERT_TRUE(sensor.thermal) << format;
      EXPECT_EQ(sensor.thermal->reference_degc, 25.0);
      EXPECT_EQ(sensor.thermal->range_degc, Eigen::Vector2d(-20.0, 70.0));
      const auto equation = [&](const Eigen::Vector3d& raw, const Eigen::Vector3d&, double t) {
        return ModelAtTemperature(sensor.model, *sensor.thermal, t).TruthFromRaw(raw);
      };
      EXPECT_LT(WorstDisagreement(unit, triad, equation), 2e-6) << format;
    }
  }
}

TEST(Import, TurnsACompassIntoTheAxesOfTheBoard) {
  const TemporaryFolder folder;
  const std::string path =
      folder.Write("vehicle.param", "AHRS_ORIENTATION,2\nCOMPASS_OFS_X,-10\nCOMPASS_DIA_X,0.5\n");
  const Result<Import> result = ImportCalibration("ardupilot", {path});
  ASSERT_TRUE(result) << result.error().message;
  const Calibration& unit = result->calibration;
  EXPECT_EQ(unit.tags.firmware, "ardupilot");
  EXPECT_EQ(unit.tags.magnetometer_turn_deg, Eigen::Vector3d(0.0, 0.0, 90.0));
  // x of the vehicle is -y of the board.
  const TriadModel<double>& mag = unit.sensors[Triad::kMagnetometer]->model;
  EXPECT_NEAR(mag.bias.y(), -1.0, 1e-6);
  EXPECT_NEAR(mag.sensitivity(1, 1), 2.0, 1e-6);
}

TEST(Import, KnowsTheAxesOfACompassThatWasExported) {
  for (const char* const format : {"px4", "ardupilot"}) {
    Calibration unit = RandomUnitCalibration(
        {.misaligned = false, .symmetric_mag = true, .gyro_matrix = false}, 5);
    unit.tags.firmware = format;
    unit.tags.magnetometer_turn_deg = Eigen::Vector3d(0.0, 0.0, 45.0);
    const Calibration back = RoundTrip(unit, format, "unit");
    EXPECT_EQ(back.tags.magnetometer_turn_deg, unit.tags.magnetometer_turn_deg);
    const auto equation = [&](const Eigen::Vector3d& raw, const Eigen::Vector3d&, double) {
      return back.sensors[Triad::kMagnetometer]->model.TruthFromRaw(raw);
    };
    EXPECT_LT(WorstDisagreement(unit, Triad::kMagnetometer, equation), 2e-6) << format;
  }
}

TEST(Import, SaysWhatItTakesForGranted) {
  const TemporaryFolder folder;
  const std::string path = folder.Write("vehicle.param",
                                        "COMPASS_OFS_X,-10\nCOMPASS_OFS_Z,-10\nCOMPASS_DIA_X,1\n"
                                        "COMPASS_DIA_Y,1\nCOMPASS_DIA_Z,1\n");
  const Result<Import> result = ImportCalibration("ardupilot", {path});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_THAT(result->notes,
              ElementsAre("magnetometer: the file has no COMPASS_OFS_Y; missing offsets are taken "
                          "as 0, missing scales as 1",
                          "magnetometer: the file does not say how it is mounted on the board "
                          "(AHRS_ORIENTATION); assumed not rotated"));
}

TEST(Import, TakesTheTemperatureTermsWithASensorsNumber) {
  const TemporaryFolder folder;
  std::string text = "1\t1\tCAL_ACC0_ID\t7\t6\n1\t1\tCAL_ACC0_XOFF\t0.1\t9\n";
  text += "1\t1\tTC_A_ENABLE\t1\t6\n1\t1\tTC_A1_X1_0\t0.5\t9\n1\t1\tTC_A0_ID\t9\t6\n";
  const auto has_terms = [&](const char* number) {
    const std::string path =
        folder.Write("vehicle.params", text + "1\t1\tTC_A1_ID\t" + number + "\t6\n");
    return ImportCalibration("px4", {path})->calibration.sensors[Triad::kAccelerometer]->thermal;
  };
  EXPECT_TRUE(has_terms("7"));
  EXPECT_FALSE(has_terms("8"));
}

TEST(Import, FindsASensorByItsNumberAndKnowsWhereItWas) {
  const TemporaryFolder folder;
  const std::string path = folder.Write("vehicle.params",
                                        "1\t1\tCAL_ACC0_ID\t7\t6\n"
                                        "1\t1\tCAL_ACC0_XOFF\t0.1\t9\n"
                                        "1\t1\tCAL_ACC2_ID\t9\t6\n"
                                        "1\t1\tCAL_ACC2_XOFF\t0.3\t9\n"
                                        "1\t1\tCAL_GYRO1_ID\t9\t6\n"
                                        "1\t1\tCAL_GYRO1_XOFF\t0.02\t9\n"
                                        "1\t1\tTC_A0_ID\t7\t6\n"
                                        "1\t1\tTC_G3_ID\t9\t6\n");
  ImportOptions options;
  options.device_ids = {{9, 9, 9}};
  const Result<Import> result = ImportCalibration("px4", {path}, options);
  ASSERT_TRUE(result) << result.error().message;
  const Calibration& unit = result->calibration;
  EXPECT_NEAR(unit.sensors[Triad::kAccelerometer]->model.bias.x(), 0.3, 1e-7);
  EXPECT_NEAR(unit.sensors[Triad::kGyroscope]->model.bias.x(), 0.02, 1e-7);
  EXPECT_EQ(unit.tags.device_slots[Triad::kAccelerometer], 2);
  EXPECT_EQ(unit.tags.thermal_slots[Triad::kAccelerometer], 1);  // The first that is nobody's.
  EXPECT_EQ(unit.tags.thermal_slots[Triad::kGyroscope], 3);
  EXPECT_THAT(result->notes, Contains("no magnetometer of the file has the device id 9"));
  // It goes back to where it came from.
  const Result<Export> back = ExportCalibration(unit, "px4");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_THAT(back->files[0].text,
              AllOf(HasSubstr("CAL_ACC2_XOFF\t0.3\t"), HasSubstr("TC_G3_ID\t0\t")));
  options.device_ids = {{5, 5, 5}};
  EXPECT_THAT(ImportCalibration("px4", {path}, options).error().message,
              HasSubstr("in the format px4 with that --id"));
}

TEST(Import, ReadsAPx4FileOfTheVehicle) {
  const TemporaryFolder folder;
  const std::string path = folder.Write("vehicle.params",
                                        "# Onboard parameters for Vehicle 1\n#\n"
                                        "1\t1\tBAT1_N_CELLS\t4\t6\n"
                                        "1\t1\tCAL_ACC0_ID\t2753036.000000\t6\n"
                                        "1\t1\tCAL_ACC0_XOFF\t0.100000001490116119\t9\n"
                                        "1\t1\tCAL_ACC0_XSCALE\t0.5\t9\n"
                                        "1\t1\tCAL_GYRO0_ID\t0\t6\n"
                                        "1\t1\tCAL_GYRO0_XOFF\t0\t9\n"
                                        "1\t1\tCAL_MAG0_YOFF\t0.05\t9\n");
  const Result<Import> result = ImportCalibration("px4", {path});
  ASSERT_TRUE(result) << result.error().message;
  const Calibration& unit = result->calibration;
  EXPECT_EQ(unit.tags.device_ids[Triad::kAccelerometer], 2753036);
  EXPECT_FALSE(unit.sensors[Triad::kGyroscope]);  // slots without a sensor have the id 0
  const TriadModel<double>& accel = unit.sensors[Triad::kAccelerometer]->model;
  EXPECT_EQ(accel.sensitivity, Eigen::Matrix3d(Eigen::Vector3d(2.0, 1.0, 1.0).asDiagonal()));
  EXPECT_NEAR(accel.bias.x(), 0.1, 1e-8);
  EXPECT_EQ(unit.sensors[Triad::kMagnetometer]->input_unit, "uT");
  EXPECT_NEAR(unit.sensors[Triad::kMagnetometer]->model.bias.y(), 5.0, 1e-6);
  EXPECT_EQ(unit.gauge, Gauge::kAccelX);
  EXPECT_TRUE(unit.IsUsable());
  ASSERT_EQ(unit.inputs.size(), 1U);
  EXPECT_EQ(unit.inputs[0].sha256.size(), 64U);
}

TEST(Import, StatesReadingsInTheUnitAskedFor) {
  const Calibration unit = RandomUnitCalibration(kAutopilot, 6);
  ImportOptions options;
  options.units[Triad::kMagnetometer] = "mG";
  options.units[Triad::kAccelerometer] = "g";
  const Calibration back = RoundTrip(unit, "px4", "unit.params", options);
  const TriadCalibration& mag = *back.sensors[Triad::kMagnetometer];
  EXPECT_EQ(mag.input_unit, "mG");
  EXPECT_EQ(mag.output_unit, "uT");
  const Eigen::Vector3d truth(20.0, -10.0, 40.0);
  const Eigen::Vector3d raw_mg =
      10.0 * unit.sensors[Triad::kMagnetometer]->model.RawFromTruth(truth);
  EXPECT_LT((mag.model.TruthFromRaw(raw_mg) - truth).norm() / truth.norm(), 2e-6);
}

std::string ErrorOf(const std::string& format,
                    const std::string& name,
                    const std::string& text,
                    ErrorKind kind = ErrorKind::kBadInput,
                    const ImportOptions& options = {}) {
  const TemporaryFolder folder;
  const Result<Import> result = ImportCalibration(format, {folder.Write(name, text)}, options);
  EXPECT_FALSE(result);
  if (result) return "no error";
  EXPECT_EQ(result.error().kind(), kind) << result.error().message;
  return result.error().message;
}

TEST(Import, SaysWhatIsWrongAndWhere) {
  EXPECT_THAT(ErrorOf("px4", "a.params", "# nothing\n1\t1\tCAL_ACC0_XOFF\tmuch\t9\n"),
              HasSubstr("a.params:2: CAL_ACC0_XOFF: `much` is not a number"));
  EXPECT_THAT(ErrorOf("px4", "a.params", "1\t1\tCAL_ACC0_XOFF\n"), HasSubstr("is not a parameter"));
  EXPECT_THAT(ErrorOf("px4", "a.params", "1\t1\tBAT_N\t4\t6\n"),
              HasSubstr("contains no sensor calibration in the format px4"));
  EXPECT_THAT(
      ErrorOf("px4", "a.params", "1\t1\tCAL_ACC0_XOFF\t1\t9\n1\t1\tCAL_ACC0_XSCALE\t0\t9\n"),
      HasSubstr("the matrix of the accelerometer is singular"));
  EXPECT_THAT(ErrorOf("ardupilot", "a.param", "INS_ACCOFFS_X,1\nINS_ACCOFFS_X,2\n"),
              HasSubstr("a.param:2: INS_ACCOFFS_X occurs twice"));
  EXPECT_THAT(
      ErrorOf("kalibr", "imu.yaml", "imu0:\n  model: calibrated\n"),
      AllOf(HasSubstr("imu.yaml:2: imu0.model"), HasSubstr("`calibrated` has no matrices")));
  EXPECT_THAT(ErrorOf("imu-tk", "x_acc.calib", "1 0 0\n0 1 0\n"), HasSubstr("contains 6 numbers"));
  EXPECT_THAT(ErrorOf("imu-tk", "x.calib", "1"), HasSubstr("does not show the sensor"));
  EXPECT_THAT(ErrorOf("matlab", "a.m", "accel.C = [1 2; 3 4];\n"),
              HasSubstr("`accel.C` is not a 3x3 matrix"));
  EXPECT_THAT(ErrorOf("basalt", "a.json", "{}", ErrorKind::kUsage),
              HasSubstr("`basalt` cannot be imported; expected one of px4, ardupilot, kalibr"));
}

TEST(Import, AsksForTheUnitThatTheFileDoesNotState) {
  const std::string identity = "1 0 0\n0 1 0\n0 0 1\n\n1 0 0\n0 1 0\n0 0 1\n\n0\n0\n0\n";
  EXPECT_THAT(ErrorOf("imu-tk", "x_acc.calib", identity, ErrorKind::kUsage),
              HasSubstr("--units=g,deg/s,uT"));
  const TemporaryFolder folder;
  ImportOptions options;
  options.units[Triad::kAccelerometer] = "counts";
  const Result<Import> result =
      ImportCalibration("imu-tk", {folder.Write("x_acc.calib", identity)}, options);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->calibration.sensors[Triad::kAccelerometer]->input_unit, "counts");
}

TEST(Import, SaysThatAKalibrFileHoldsNoBias) {
  const TemporaryFolder folder;
  const std::string unit = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]";
  const std::string path = folder.Write(
      "imu.yaml",
      "imu0:\n  model: scale-misalignment\n  rostopic: /imu0\n  accelerometers: {M: " + unit +
          "}\n  gyroscopes: {M: " + unit + ", A: " + unit + ", C_gyro_i: " + unit + "}\n");
  const Result<Import> result = ImportCalibration("kalibr", {path});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_THAT(result->notes, Contains("accelerometer: the file contains no bias; assumed zero"));
  EXPECT_THAT(result->calibration.findings, Contains(Says(HasSubstr("contains no bias"))));
}

TEST(Import, TakesReadingsAsTheyAreWhereKalibrIsToldOfNoiseAlone) {
  const TemporaryFolder folder;
  const std::string path = folder.Write("imu.yaml",
                                        "rostopic: /imu0\nupdate_rate: 200.0\n"
                                        "accelerometer_noise_density: 0.01\n");
  for (const char* const format : {"kalibr", "kalibr-result"}) {
    const Result<Import> result = ImportCalibration(format, {path});
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_THAT(result->notes, Contains(HasSubstr("holds only noise")));
    for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
      const TriadModel<double>& model = result->calibration.sensors[triad]->model;
      EXPECT_TRUE(model.bias.isZero(0.0) && model.sensitivity.isIdentity(0.0));
    }
  }
}

TEST(Import, TakesWhatMagcalReturned) {
  const TemporaryFolder folder;
  const std::string path =
      folder.Write("mag.m", "A = [1.1 0.1 0; 0 1 0.2; 0 0 0.9];\nb = [1 2 3];\nexpmfs = 47.5;\n");
  ImportOptions options;
  options.units[Triad::kMagnetometer] = "uT";
  const Result<Import> result = ImportCalibration("matlab", {path}, options);
  ASSERT_TRUE(result) << result.error().message;
  const TriadCalibration& mag = *result->calibration.sensors[Triad::kMagnetometer];
  Eigen::Matrix3d A;
  A << 1.1, 0.1, 0, 0, 1, 0.2, 0, 0, 0.9;
  const Eigen::RowVector3d row(30.0, -20.0, 10.0);
  const Eigen::Vector3d expected = ((row - Eigen::RowVector3d(1, 2, 3)) * A).transpose();
  EXPECT_LT((mag.model.TruthFromRaw(row.transpose()) - expected).norm(), 1e-13);
  EXPECT_EQ(result->calibration.reference.field_ut, 47.5);
  EXPECT_EQ(result->calibration.gauge_sensor, Triad::kMagnetometer);
}

}  // namespace import_test
}  // namespace truetriad
