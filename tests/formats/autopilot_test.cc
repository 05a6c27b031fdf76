// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/sample_units.h"
#include "truetriad/formats/export.h"

// The equations of PX4 and ArduPilot as their sources state them, in float32, with a reader of
// their files that shares nothing with the exporter.

namespace truetriad {
namespace autopilot_test {

using formats_test::RandomUnitCalibration;
using formats_test::TestEquation;
using formats_test::UnitKind;
using formats_test::WorstDisagreement;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Key;
using ::testing::Not;

// float32 rounds at 6e-8; the some ten operations of an equation, on numbers not much larger than
// the signal, stay far below.
constexpr double kFloat32 = 2e-6;

using Parameters = std::map<std::string, float>;

Parameters Px4File(const std::string& text) {
  Parameters parameters;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    int vehicle = 0, component = 0, type = 0;
    std::string name, value;
    fields >> vehicle >> component >> name >> value >> type;
    EXPECT_EQ(std::count(line.begin(), line.end(), '\t'), 4) << line;
    EXPECT_TRUE(type == 6 || type == 9) << line;
    parameters[name] = std::stof(value);
  }
  return parameters;
}

Parameters ArduPilotFile(const std::string& text) {
  Parameters parameters;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    const std::size_t comma = line.find(',');
    const std::string value = line.substr(comma + 1);
    EXPECT_EQ(value.find_first_not_of("-.0123456789"), std::string::npos) << line;
    parameters[line.substr(0, comma)] = std::stof(value);
  }
  return parameters;
}

Eigen::Vector3f Xyz(const Parameters& p, const std::string& before, const std::string& after = "") {
  return {p.at(before + "X" + after), p.at(before + "Y" + after), p.at(before + "Z" + after)};
}

Eigen::Matrix3f Symmetric(const Eigen::Vector3f& d, float xy, float xz, float yz) {
  Eigen::Matrix3f D;
  D << d.x(), xy, xz, xy, d.y(), yz, xz, yz, d.z();
  return D;
}

/// thermal_i of PX4's sensor, zero when it is not enabled.
Eigen::Vector3f Px4Thermal(const Parameters& p, const std::string& letter, double temperature) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  if (!p.contains("TC_" + letter + "_ENABLE")) return sum;
  EXPECT_EQ(p.at("TC_" + letter + "_ENABLE"), 1.0F);
  const std::string prefix = "TC_" + letter + "0_";
  const float low = p.at(prefix + "TMIN");
  const float high = p.at(prefix + "TMAX");
  const float d = std::clamp(static_cast<float>(temperature), low, high) - p.at(prefix + "TREF");
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < 4; ++k) {
      sum[axis] += p.at(prefix + "X" + std::to_string(k) + "_" + std::to_string(axis)) *
                   std::pow(d, static_cast<float>(k));
    }
  }
  return sum;
}

TestEquation Px4Equation(const Parameters& p, Triad triad) {
  return [&p, triad](const Eigen::Vector3d& raw,
                     const Eigen::Vector3d&,
                     double temperature) -> Eigen::Vector3d {
    if (triad == Triad::kMagnetometer) {
      const Eigen::Vector3f gauss = (raw / 100.0).cast<float>();
      const Eigen::Matrix3f D = Symmetric(Xyz(p, "CAL_MAG0_", "SCALE"),
                                          p.at("CAL_MAG0_XODIAG"),
                                          p.at("CAL_MAG0_YODIAG"),
                                          p.at("CAL_MAG0_ZODIAG"));
      return 100.0 * (D * (gauss - Px4Thermal(p, "M", temperature) - Xyz(p, "CAL_MAG0_", "OFF")))
                         .cast<double>();
    }
    if (triad == Triad::kGyroscope) {
      return (raw.cast<float>() - Px4Thermal(p, "G", temperature) - Xyz(p, "CAL_GYRO0_", "OFF"))
          .cast<double>();
    }
    return (raw.cast<float>() - Px4Thermal(p, "A", temperature) - Xyz(p, "CAL_ACC0_", "OFF"))
        .cwiseProduct(Xyz(p, "CAL_ACC0_", "SCALE"))
        .cast<double>();
  };
}

Eigen::Vector3f ArduPilotPolynomial(const Parameters& p, const std::string& sensor, float t) {
  const float d = std::clamp(t, p.at("INS_TCAL1_TMIN"), p.at("INS_TCAL1_TMAX")) - 35.0F;
  const std::string prefix = "INS_TCAL1_" + sensor;
  return (Xyz(p, prefix + "1_") * d + Xyz(p, prefix + "2_") * d * d +
          Xyz(p, prefix + "3_") * d * d * d) *
         1e-6F;
}

Eigen::Vector3f ArduPilotThermal(const Parameters& p, const std::string& sensor, double t) {
  const auto enabled = p.find("INS_TCAL1_ENABLE");
  if (enabled == p.end() || enabled->second == 0.0F) return Eigen::Vector3f::Zero();
  EXPECT_EQ(enabled->second, 1.0F);
  return ArduPilotPolynomial(p, sensor, static_cast<float>(t)) -
         ArduPilotPolynomial(p, sensor, p.at("INS_" + sensor + "1_CALTEMP"));
}

TestEquation ArduPilotEquation(const Parameters& p, Triad triad) {
  return [&p, triad](const Eigen::Vector3d& raw,
                     const Eigen::Vector3d&,
                     double temperature) -> Eigen::Vector3d {
    if (triad == Triad::kMagnetometer) {
      const Eigen::Vector3f milligauss = (10.0 * raw).cast<float>();
      EXPECT_EQ(p.at("COMPASS_SCALE"), 1.0F);
      const Eigen::Matrix3f D = Symmetric(Xyz(p, "COMPASS_DIA_"),
                                          p.at("COMPASS_ODI_X"),
                                          p.at("COMPASS_ODI_Y"),
                                          p.at("COMPASS_ODI_Z"));
      return 0.1 * (D * (milligauss + Xyz(p, "COMPASS_OFS_"))).cast<double>();
    }
    if (triad == Triad::kGyroscope) {
      return (raw.cast<float>() - ArduPilotThermal(p, "GYR", temperature) - Xyz(p, "INS_GYROFFS_"))
          .cast<double>();
    }
    return (raw.cast<float>() - ArduPilotThermal(p, "ACC", temperature) - Xyz(p, "INS_ACCOFFS_"))
        .cwiseProduct(Xyz(p, "INS_ACCSCAL_"))
        .cast<double>();
  };
}

struct Autopilot {
  std::string name;
  Parameters (*read)(const std::string&);
  TestEquation (*equation)(const Parameters&, Triad);
  bool mag_over_temperature = false;

  friend void PrintTo(const Autopilot& autopilot, std::ostream* out) { *out << autopilot.name; }
};

class Autopilots : public ::testing::TestWithParam<Autopilot> {
 protected:
  static Export Exported(const Calibration& calibration, const ExportOptions& options = {}) {
    const Result<Export> result = ExportCalibration(calibration, GetParam().name, options);
    EXPECT_TRUE(result) << result.error().message;
    return *result;
  }
  static Parameters Read(const Export& result) { return GetParam().read(result.files[0].text); }
};

TEST_P(Autopilots, HoldExactlyWhatTheirEquationCanExpress) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    Calibration unit =
        RandomUnitCalibration({.misaligned = false, .gyro_matrix = false, .bias_order = 3}, seed);
    if (!GetParam().mag_over_temperature) unit.sensors[Triad::kMagnetometer]->thermal.reset();
    const Export result = Exported(unit);
    const Parameters parameters = Read(result);
    for (const Triad triad : kTriads) {
      EXPECT_LT(WorstDisagreement(unit, triad, GetParam().equation(parameters, triad)), kFloat32)
          << TriadName(triad);
      EXPECT_LT(result.loss[triad]->share(), kFloat32) << TriadName(triad);
    }
  }
}

TEST_P(Autopilots, HoldASymmetricMagnetometerMatrixExactly) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Calibration unit = RandomUnitCalibration({.symmetric_mag = true}, seed);
    const Parameters parameters = Read(Exported(unit));
    EXPECT_LT(
        WorstDisagreement(
            unit, Triad::kMagnetometer, GetParam().equation(parameters, Triad::kMagnetometer)),
        kFloat32)
        << seed;
  }
}

TEST_P(Autopilots, TakeCountsOfKnownSizeInTheirOwnUnit) {
  const Calibration counts = RandomUnitCalibration(
      {.misaligned = false, .symmetric_mag = true, .gyro_matrix = false, .counts = true}, 3);
  const Parameters parameters = Read(Exported(counts));
  for (const Triad triad : kTriads) {
    const double si_per_count = *counts.sensors[triad]->si_per_count;
    const TestEquation in_si = GetParam().equation(parameters, triad);
    const auto in_counts = [&](const Eigen::Vector3d& raw, const Eigen::Vector3d& f, double t) {
      return in_si(si_per_count * raw, f, t);
    };
    EXPECT_LT(WorstDisagreement(counts, triad, in_counts), kFloat32) << TriadName(triad);
  }
}

TEST_P(Autopilots, StateTheLossThatTheirEquationReallyHas) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Calibration unit =
        RandomUnitCalibration({.bias_order = 5, .matrix_order = 2, .g_sensitivity = true}, seed);
    const Export result = Exported(unit);
    const Parameters parameters = Read(result);
    for (const Triad triad : kTriads) {
      const double found = WorstDisagreement(unit, triad, GetParam().equation(parameters, triad));
      const double stated = result.loss[triad]->share();
      // Another sphere, and for the rate another radius, about which the offsets' share changes.
      EXPECT_GT(found, 1e-3) << TriadName(triad);
      if (triad == Triad::kGyroscope) continue;
      EXPECT_NEAR(found, stated, 0.05 * stated) << TriadName(triad);
    }
    EXPECT_THAT(
        result.notes,
        AllOf(
            Contains("accelerometer: thermal terms of the bias reduced from order 5 to 3"),
            Contains(
                "accelerometer: dropped: thermal terms of the matrix; used the values at 25 degC"),
            Contains("gyroscope: dropped: g-sensitivity"),
            Contains("gyroscope: dropped: gains and misalignment; offsets only"),
            Contains(HasSubstr("magnetometer: dropped: a rotation by"))));
    EXPECT_THAT(result.files[0].text, HasSubstr("# gyroscope: dropped: g-sensitivity."));
  }
}

TEST_P(Autopilots, LowerTheOrderOfABiasWithLittleLoss) {
  // A fifth-order bias whose last terms are a thousandth of the signal: through Chebyshev points
  // the cubic is off by no more than they are at the ends of the range.
  Calibration unit =
      RandomUnitCalibration({.misaligned = false, .gyro_matrix = false, .bias_order = 5}, 4);
  ThermalTerms& thermal = *unit.sensors[Triad::kAccelerometer]->thermal;
  thermal.bias[3] = Eigen::Vector3d::Constant(1e-3 * 9.80665 / std::pow(45.0, 4));
  thermal.bias[4].setZero();
  const Parameters parameters = Read(Exported(unit));
  const double worst = WorstDisagreement(
      unit, Triad::kAccelerometer, GetParam().equation(parameters, Triad::kAccelerometer));
  EXPECT_GT(worst, 1e-5);
  // u^4 on [-1, 1] is within 1/8 of its best cubic, per axis.
  EXPECT_LT(worst, 1.1 * std::sqrt(3.0) * 1e-3 / 8.0);
}

TEST_P(Autopilots, TakeConstantsAtTheTemperatureAskedFor) {
  if (GetParam().mag_over_temperature) GTEST_SKIP() << "holds the bias at every temperature";
  const Calibration unit =
      RandomUnitCalibration({.misaligned = false, .symmetric_mag = true, .bias_order = 2}, 5);
  const Export result = Exported(unit, {.temperature_degc = 60.0});
  const Parameters parameters = Read(result);
  const TriadCalibration& mag = *unit.sensors[Triad::kMagnetometer];
  const TriadModel<double> at_60 = ModelAtTemperature(mag.model, *mag.thermal, 60.0);
  const Eigen::Vector3d truth(10.0, -30.0, 35.0);
  const Eigen::Vector3d found = GetParam().equation(parameters, Triad::kMagnetometer)(
      at_60.RawFromTruth(truth), Eigen::Vector3d::Zero(), 25.0);
  EXPECT_LT((found - truth).norm() / truth.norm(), kFloat32);
  EXPECT_THAT(
      result.notes,
      Contains("magnetometer: dropped: thermal terms of the bias; used the values at 60 degC"));
  const Result<Export> outside =
      ExportCalibration(unit, GetParam().name, {.temperature_degc = 80.0});
  ASSERT_FALSE(outside);
  EXPECT_EQ(outside.error().kind(), ErrorKind::kUsage);
  EXPECT_THAT(outside.error().message, HasSubstr("outside -20 to 70 degC"));
}

TEST_P(Autopilots, RefuseAMirroredMagnetometerAndNameTheSwap) {
  Calibration unit = RandomUnitCalibration({}, 6);
  Eigen::Matrix3d& sensitivity = unit.sensors[Triad::kMagnetometer]->model.sensitivity;
  sensitivity.row(2) *= -1.0;
  sensitivity.row(0).swap(sensitivity.row(1));
  sensitivity.row(0) *= -1.0;
  sensitivity.row(1) *= -1.0;
  sensitivity.row(1) *= -1.0;  // x reads -y, y reads x, z reads -z: mirrored
  const Result<Export> result = ExportCalibration(unit, GetParam().name);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(result.error().message,
              AllOf(HasSubstr("the magnetometer is mirrored"), HasSubstr("by (y, -x, -z)")));
}

TEST_P(Autopilots, RefuseCountsOfUnknownSize) {
  Calibration unit = RandomUnitCalibration({.counts = true}, 7);
  unit.sensors[Triad::kAccelerometer]->si_per_count.reset();
  const Result<Export> result = ExportCalibration(unit, GetParam().name);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(result.error().message, HasSubstr("si_per_count"));
}

TEST_P(Autopilots, RefuseMoreLossThanAllowed) {
  const Calibration unit = RandomUnitCalibration({}, 8);
  const Result<Export> result = ExportCalibration(unit, GetParam().name, {.max_loss = 1e-4});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(result.error().message, HasSubstr("more than --max-loss=0.0001"));
  EXPECT_TRUE(ExportCalibration(unit, GetParam().name, {.max_loss = 0.5}));
}

TEST_P(Autopilots, RefuseAnInstanceThatIsNotThere) {
  const Result<Export> result =
      ExportCalibration(RandomUnitCalibration({}, 9), GetParam().name, {.instance = 9});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind(), ErrorKind::kUsage);
}

TEST_P(Autopilots, WarnWhenMoreIsLostThanTheCalibrationIsUncertainBy) {
  Calibration unit = RandomUnitCalibration({}, 10);
  unit.covariance.parameters = {"accelerometer.bias.x"};
  unit.covariance.matrix = Eigen::MatrixXd::Constant(1, 1, 1e-6);  // 1 mm/s^2
  const Export fine = Exported(unit);
  EXPECT_GT(*fine.loss[Triad::kAccelerometer]->in_sigmas, 1.0);
  EXPECT_THAT(fine.warnings, Contains(HasSubstr("exceeds the calibration's uncertainty")));
  EXPECT_FALSE(fine.loss[Triad::kGyroscope]->in_sigmas);

  unit.covariance.matrix *= 1e8;
  const Export coarse = Exported(unit);
  EXPECT_LT(*coarse.loss[Triad::kAccelerometer]->in_sigmas, 1.0);
  EXPECT_THAT(coarse.warnings, Not(Contains(HasSubstr("calibration's uncertainty"))));
}

INSTANTIATE_TEST_SUITE_P(Of,
                         Autopilots,
                         ::testing::Values(Autopilot{"px4", Px4File, Px4Equation, true},
                                           Autopilot{
                                               "ardupilot", ArduPilotFile, ArduPilotEquation}),
                         [](const auto& test) { return test.param.name; });

TEST(Px4, WritesTheIdOnlyWhenItIsTold) {
  const Calibration unit = RandomUnitCalibration({.bias_order = 1}, 11);
  ExportOptions options;
  options.instance = 2;
  options.device_ids[Triad::kAccelerometer] = 1310988;
  const Result<Export> result = ExportCalibration(unit, "px4", options);
  ASSERT_TRUE(result);
  EXPECT_THAT(result->files[0].text,
              AllOf(HasSubstr("1\t1\tCAL_ACC2_ID\t1310988\t6\n"),
                    HasSubstr("1\t1\tTC_A2_ID\t1310988\t6\n"),
                    Not(HasSubstr("CAL_GYRO2_ID"))));
  EXPECT_THAT(result->warnings, Contains(HasSubstr("CAL_GYRO2_ID already matches the sensor")));
}

TEST(Px4, TakesTheIdOfTheCalibrationUnlessAnotherIsTold) {
  Calibration unit = RandomUnitCalibration({}, 11);
  unit.tags.device_ids[Triad::kGyroscope] = 2621707;
  EXPECT_THAT(ExportCalibration(unit, "px4")->files[0].text,
              HasSubstr("1\t1\tCAL_GYRO0_ID\t2621707\t6\n"));
  ExportOptions options;
  options.device_ids[Triad::kGyroscope] = 17;
  EXPECT_THAT(ExportCalibration(unit, "px4", options)->files[0].text,
              HasSubstr("1\t1\tCAL_GYRO0_ID\t17\t6\n"));
}

/// As from a log of PX4, of which each sensor's parameters are elsewhere.
Calibration InOtherSlots(const UnitKind& kind = {}) {
  Calibration unit = RandomUnitCalibration(kind, 11);
  unit.tags.firmware = "px4";
  unit.tags.device_ids = {{1310988, 2621707, 396825}};
  unit.tags.device_slots = {{2, 0, 1}};
  unit.tags.thermal_slots = {{1, Tags::kNoSlot, 0}};
  return unit;
}

TEST(Px4, WritesEachSensorWhereTheVehicleHasItsNumber) {
  const Calibration unit = InOtherSlots();
  const Result<Export> result = ExportCalibration(unit, "px4");
  ASSERT_TRUE(result) << result.error().message;
  const Parameters found = Px4File(result->files[0].text);
  EXPECT_EQ(found.at("CAL_ACC2_ID"), 1310988.0F);
  EXPECT_EQ(found.at("CAL_GYRO0_ID"), 2621707.0F);
  EXPECT_EQ(found.at("CAL_MAG1_ID"), 396825.0F);
  EXPECT_NEAR(
      found.at("CAL_MAG1_XOFF"), 0.01 * unit.sensors[Triad::kMagnetometer]->model.bias.x(), 1e-6);
  // Terms of its own are ended where they are; what is other sensors' stays.
  EXPECT_EQ(found.at("TC_A1_ID"), 0.0F);
  EXPECT_EQ(found.at("TC_M0_ID"), 0.0F);
  for (const char* const other : {"CAL_ACC0_XOFF", "CAL_MAG0_XOFF", "TC_A0_ID", "TC_G0_ID"}) {
    EXPECT_THAT(found, Not(Contains(Key(other))));
  }
  EXPECT_LT(result->loss[Triad::kMagnetometer]->share(), 0.1);
  EXPECT_THAT(result->warnings, Contains(HasSubstr("check CAL_MAG1_ROT")));
}

TEST(Px4, WritesWhereItIsToldAndKnowsOfAnotherSensorNothing) {
  const Calibration unit = InOtherSlots();
  const Parameters told = Px4File(ExportCalibration(unit, "px4", {.instance = 3})->files[0].text);
  EXPECT_EQ(told.at("CAL_ACC3_ID"), 1310988.0F);
  EXPECT_EQ(told.at("CAL_MAG3_ID"), 396825.0F);
  EXPECT_EQ(told.at("TC_A1_ID"), 0.0F);  // PX4 looks for them by the number alone.
  ExportOptions options;
  options.device_ids[Triad::kAccelerometer] = 17;
  const Parameters other = Px4File(ExportCalibration(unit, "px4", options)->files[0].text);
  EXPECT_EQ(other.at("CAL_ACC0_ID"), 17.0F);
  EXPECT_EQ(other.at("CAL_MAG1_ID"), 396825.0F);
  // Nor does another firmware count as this one does.
  EXPECT_THAT(ArduPilotFile(ExportCalibration(unit, "ardupilot")->files[0].text),
              Contains(Key("INS_ACCOFFS_X")));
}

TEST(Px4, RefusesASensorForWhichNoSlotIsFree) {
  Calibration unit = InOtherSlots();
  unit.tags.device_slots[Triad::kAccelerometer] = Tags::kNoSlot;
  const Result<Export> full = ExportCalibration(unit, "px4");
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(full.error().message,
              HasSubstr("CAL_ACC0_ID to CAL_ACC3_ID is free for the accelerometer"));
  EXPECT_TRUE(ExportCalibration(unit, "px4", {.instance = 1}));
  // A sensor with temperature terms needs a place for these, too.
  const Result<Export> terms = ExportCalibration(InOtherSlots({.bias_order = 1}), "px4");
  ASSERT_FALSE(terms);
  EXPECT_THAT(terms.error().message, HasSubstr("TC_G0_ID to TC_G3_ID"));
}

TEST(ArduPilot, WritesACompassWhereItsNumberIs) {
  Calibration first = RandomUnitCalibration({}, 1), second = RandomUnitCalibration({}, 2);
  first.tags.firmware = second.tags.firmware = "ardupilot";
  first.tags.device_ids = {{1, 2, 131874}};
  first.tags.device_slots = {{1, 1, 2}};
  second.tags.device_ids = {{3, 4, 97539}};
  second.tags.device_slots = {{2, 2, 1}};
  const Result<ExportsBeside> exports =
      ExportBeside({{&first, "out", 0}, {&second, "out/instance-1", 1}}, {"ardupilot"}, {});
  ASSERT_TRUE(exports) << exports.error().message;
  const Parameters all = ArduPilotFile(exports->files.at("out/ardupilot.param"));
  EXPECT_EQ(all.at("INS_ACC_ID"), 1.0F);
  EXPECT_EQ(all.at("INS_ACC2_ID"), 3.0F);
  EXPECT_EQ(all.at("COMPASS_DEV_ID2"), 131874.0F);
  EXPECT_NEAR(
      all.at("COMPASS_OFS2_X"), -10.0 * first.sensors[Triad::kMagnetometer]->model.bias.x(), 1e-3);
  EXPECT_EQ(all.at("COMPASS_DEV_ID"), 97539.0F);
  // Alone it goes where it went beside the other.
  const Export alone = *ExportCalibration(second, "ardupilot");
  EXPECT_THAT(ArduPilotFile(alone.files[0].text),
              AllOf(Contains(Key("INS_ACC2OFFS_X")), Contains(Key("COMPASS_OFS_X"))));
}

TEST(Px4, LeavesNoTemperatureTermsOfTheVehicleToASensorWithoutAny) {
  const Calibration unit = RandomUnitCalibration({}, 11);
  ExportOptions options;
  options.device_ids[Triad::kAccelerometer] = 1310988;
  const std::string text = ExportCalibration(unit, "px4", options)->files[0].text;
  for (const char* const sensor : {"A", "G", "M"}) {
    EXPECT_THAT(text, HasSubstr("\n1\t1\tTC_" + std::string(sensor) + "0_ID\t0\t6\n"));
  }
  EXPECT_THAT(text, Not(HasSubstr("_ENABLE")));
}

TEST(FirmwareAxes, CorrectACompassInTheAxesOfTheirFirmware) {
  // A quarter turn about z: x of the firmware is -y of the recording.
  Calibration unit = RandomUnitCalibration({.symmetric_mag = true}, 17);
  const TriadModel<double> model = unit.sensors[Triad::kMagnetometer]->model;
  unit.tags.magnetometer_turn_deg = Eigen::Vector3d(0.0, 0.0, 90.0);
  const auto written = [&](const char* format) {
    unit.tags.firmware = format;
    return *ExportCalibration(unit, format);
  };
  const Export px4 = written("px4"), ardupilot = written("ardupilot");
  const Parameters found = Px4File(px4.files[0].text),
                   other = ArduPilotFile(ardupilot.files[0].text);
  // From microtesla to gauss, and to milligauss.
  EXPECT_NEAR(found.at("CAL_MAG0_XOFF"), -0.01 * model.bias.y(), 1e-6);
  EXPECT_NEAR(found.at("CAL_MAG0_YOFF"), 0.01 * model.bias.x(), 1e-6);
  EXPECT_NEAR(other.at("COMPASS_OFS_X"), 10.0 * model.bias.y(), 1e-3);
  const Eigen::Matrix3d correction = model.Correction();
  EXPECT_NEAR(found.at("CAL_MAG0_XSCALE"), correction(1, 1), 1e-5);
  EXPECT_NEAR(found.at("CAL_MAG0_XODIAG"), -correction(0, 1), 1e-5);
  EXPECT_LT(px4.loss[Triad::kMagnetometer]->share(), kFloat32);
  EXPECT_THAT(ardupilot.warnings,
              Not(Contains(HasSubstr("where the recording's axes are the vehicle's"))));
  // Of another firmware's log nothing is known.
  const Result<Export> foreign = ExportCalibration(unit, "px4");
  EXPECT_NEAR(Px4File(foreign->files[0].text).at("CAL_MAG0_XOFF"), 0.01 * model.bias.x(), 1e-6);
}

TEST(FirmwareAxes, OfArduPilotUpTo32AreTheVehiclesAndScalesComeFirst) {
  Calibration unit =
      RandomUnitCalibration({.misaligned = false, .symmetric_mag = true, .gyro_matrix = false}, 18);
  unit.tags.firmware = "ardupilot-3.2";
  unit.tags.magnetometer_turn_deg = Eigen::Vector3d(0.0, 0.0, 90.0);
  const Result<Export> result = ExportCalibration(unit, "ardupilot");
  ASSERT_TRUE(result) << result.error().message;
  const Parameters found = ArduPilotFile(result->files[0].text);
  // x of the vehicle is -y of the board: corrected = s o (R y) - o.
  const TriadModel<double>& model = unit.sensors[Triad::kAccelerometer]->model;
  const double gain = model.Correction()(1, 1);
  EXPECT_NEAR(found.at("INS_ACCSCAL_X"), gain, 1e-6);
  EXPECT_NEAR(found.at("INS_ACCOFFS_X"), gain * -model.bias.y(), 1e-6);
  const TriadModel<double>& rate = unit.sensors[Triad::kGyroscope]->model;
  EXPECT_NEAR(found.at("INS_GYROFFS_Y"), rate.bias.x(), 1e-6);
  for (const Triad triad : kTriads) EXPECT_LT(result->loss[triad]->share(), kFloat32);
  // Its numbers are those of ArduPilot.
  EXPECT_THAT(result->warnings, Not(Contains(HasSubstr("the log is of"))));
}

TEST(Px4, WritesNoSensorTwiceUnderOneNumber) {
  Calibration first = InOtherSlots(), second = InOtherSlots(), third = InOtherSlots();
  second.tags.device_ids = {{1310989, 2621708, 396825}};
  second.tags.device_slots = {{1, 1, 1}};
  third.tags.device_ids = {{std::nullopt, 2621709, std::nullopt}};
  third.tags.device_slots = {{std::nullopt, 3, std::nullopt}};
  const Result<ExportsBeside> exports = ExportBeside(
      {{&first, "out", 0}, {&second, "out/instance-1", 1}, {&third, "out/instance-2", 2}},
      {"px4"},
      {});
  ASSERT_TRUE(exports) << exports.error().message;
  EXPECT_FALSE(exports->is_whole);
  EXPECT_TRUE(exports->files.empty());
  EXPECT_THAT(
      exports->warnings,
      ElementsAre(
          HasSubstr("instance 0: is not written: its magnetometer has the device id 396825, and so "
                    "has the same sensor of instance 1"),
          HasSubstr("instance 1: is not written: its magnetometer has the device id 396825"),
          HasSubstr("its accelerometer would use the same parameters as that of instance 0")));
}

TEST(Px4, SaysThatALogDoesNotTellWhereASensorIs) {
  Calibration unit = InOtherSlots();
  unit.tags.device_slots = unit.tags.thermal_slots = {};
  EXPECT_THAT(ExportCalibration(unit, "px4")->warnings,
              AllOf(Contains(HasSubstr("accelerometer: the log does not state which parameters the "
                                       "vehicle uses for this sensor; check that CAL_ACC0_ID")),
                    Contains(HasSubstr("check CAL_MAG0_ROT"))));
}

TEST(ArduPilot, WarnsOfACompassWithWhichItDoesNotArm) {
  Calibration unit = RandomUnitCalibration({}, 1);
  Eigen::Vector3d& bias = unit.sensors[Triad::kMagnetometer]->model.bias;
  bias = Eigen::Vector3d(100.0, -100.0, 110.0);  // 179 uT long
  EXPECT_THAT(ExportCalibration(unit, "ardupilot")->warnings,
              Not(Contains(HasSubstr("COMPASS_OFFS_MAX"))));
  bias *= 1.02;
  EXPECT_THAT(ExportCalibration(unit, "ardupilot")->warnings,
              Contains(HasSubstr("longer than COMPASS_OFFS_MAX (1800 mG unless changed)")));
}

TEST(Px4, HoldsAllInstancesInOneFile) {
  const Calibration first = RandomUnitCalibration({.bias_order = 1}, 1);
  const Calibration third = RandomUnitCalibration({.bias_order = 1}, 3);
  Calibration refused;
  refused.outcome = Outcome::kNotObservable;
  const Result<ExportsBeside> exports = ExportBeside(
      {{&first, "out", 0}, {&refused, "out/instance-1", 1}, {&third, "out/instance-2", 2}},
      {"px4", "c-header"},
      {});
  ASSERT_TRUE(exports) << exports.error().message;
  EXPECT_THAT(
      exports->files,
      ElementsAre(
          Key("out/calibration.h"), Key("out/instance-2/calibration.h"), Key("out/px4.params")));
  const std::string& text = exports->files.at("out/px4.params");
  const Parameters all = Px4File(text);
  EXPECT_EQ(all.at("CAL_ACC0_XOFF"),
            Px4File(ExportCalibration(first, "px4")->files[0].text).at("CAL_ACC0_XOFF"));
  EXPECT_TRUE(all.contains("CAL_ACC2_XOFF"));
  EXPECT_FALSE(all.contains("CAL_ACC1_XOFF"));
  // What is one of all sensors is stated once.
  EXPECT_EQ(text.find("TC_A_ENABLE"), text.rfind("TC_A_ENABLE"));
  EXPECT_THAT(exports->warnings,
              Contains(HasSubstr(
                  "px4.params: instance 1: is not written: this calibration is not usable")));
}

TEST(Px4, KeepsIdleTermsOfOtherSensorsOutOfUse) {
  Calibration unit = InOtherSlots({.bias_order = 1});
  unit.tags.thermal_slots = {{1, 1, 1}};
  unit.tags.idle_thermal_slots[Triad::kAccelerometer] = {0, 2};
  const Result<Export> alone = ExportCalibration(unit, "px4");
  ASSERT_TRUE(alone) << alone.error().message;
  const Parameters found = Px4File(alone->files[0].text);
  EXPECT_EQ(found.at("TC_A1_ID"), 1310988.0F);
  EXPECT_EQ(found.at("TC_A_ENABLE"), 1.0F);
  EXPECT_EQ(found.at("TC_A0_ID"), 0.0F);
  EXPECT_EQ(found.at("TC_A2_ID"), 0.0F);
  EXPECT_THAT(found, Not(Contains(Key("TC_G0_ID"))));
  EXPECT_THAT(alone->warnings, Contains(HasSubstr("the file sets TC_A0_ID and TC_A2_ID to 0")));
  // Those of a sensor that is exported beside it are its own.
  Calibration other = unit;
  other.tags.device_ids = {{1310996, 2621715, 396833}};
  other.tags.device_slots = {{0, 1, 0}};
  other.tags.thermal_slots = {{2, 2, 2}};
  const Result<ExportsBeside> both =
      ExportBeside({{&unit, "out", 0}, {&other, "out/instance-1", 1}}, {"px4"}, {});
  ASSERT_TRUE(both) << both.error().message;
  const Parameters all = Px4File(both->files.at("out/px4.params"));
  EXPECT_EQ(all.at("TC_A0_ID"), 0.0F);
  EXPECT_EQ(all.at("TC_A1_ID"), 1310988.0F);
  EXPECT_EQ(all.at("TC_A2_ID"), 1310996.0F);
  // Where that is not written, they are idle as well.
  unit.tags.idle_thermal_slots = {};
  other.tags.idle_thermal_slots[Triad::kAccelerometer] = {2};
  other.outcome = Outcome::kNotCalled;
  const Result<ExportsBeside> one =
      ExportBeside({{&unit, "out", 0}, {&other, "out/instance-1", 1}}, {"px4"}, {});
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_EQ(Px4File(one->files.at("out/px4.params")).at("TC_A2_ID"), 0.0F);
}

TEST(Px4, WritesTheMagnetometerOverTemperatureInGauss) {
  Calibration unit = RandomUnitCalibration({.symmetric_mag = true, .bias_order = 1}, 15);
  unit.sensors[Triad::kMagnetometer]->thermal->bias[0] = Eigen::Vector3d(1.0, -0.5, 0.25);  // uT
  ExportOptions options;
  options.instance = 1;
  options.device_ids[Triad::kMagnetometer] = 396825;
  const Result<Export> result = ExportCalibration(unit, "px4", options);
  ASSERT_TRUE(result);
  for (const char* const line : {"TC_M1_ID\t396825\t6",
                                 "TC_M1_TMIN\t-20\t9",
                                 "TC_M1_TMAX\t70\t9",
                                 "TC_M1_TREF\t25\t9",
                                 "TC_M1_X0_0\t0\t9",
                                 "TC_M1_X1_0\t0.01\t9",
                                 "TC_M1_X1_1\t-0.005\t9",
                                 "TC_M1_X1_2\t0.0025\t9",
                                 "TC_M1_X3_2\t0\t9",
                                 "TC_M_ENABLE\t1\t6"}) {
    EXPECT_THAT(result->files[0].text, HasSubstr(std::string("\n1\t1\t") + line + "\n"));
  }
  EXPECT_THAT(result->warnings, Contains(HasSubstr("without TC_M_ENABLE")));
}

TEST(Px4, WarnsOfOffsetsThatItIgnores) {
  Calibration unit = RandomUnitCalibration({}, 12);
  unit.sensors[Triad::kGyroscope]->model.bias.setConstant(1e-3);
  const Result<Export> result = ExportCalibration(unit, "px4");
  ASSERT_TRUE(result);
  EXPECT_THAT(result->warnings, Contains(HasSubstr("gyroscope: some versions of PX4 ignore")));
}

TEST(ArduPilot, NamesTheParametersOfEveryImu) {
  Calibration unit = RandomUnitCalibration({.bias_order = 1}, 13);
  const auto text = [&unit](int instance) {
    const Result<Export> result = ExportCalibration(unit, "ardupilot", {.instance = instance});
    EXPECT_TRUE(result);
    return result->files[0].text;
  };
  EXPECT_THAT(text(2),
              AllOf(HasSubstr("\nINS_ACC2OFFS_X,"),
                    HasSubstr("\nINS_ACC2SCAL_Z,"),
                    HasSubstr("\nINS_GYR2OFFS_Y,"),
                    HasSubstr("\nINS_ACC2_CALTEMP,25\n"),
                    HasSubstr("\nINS_TCAL2_ACC1_X,"),
                    HasSubstr("\nCOMPASS_OFS2_X,"),
                    HasSubstr("\nCOMPASS_SCALE2,1\n")));
  unit.sensors[Triad::kMagnetometer].reset();
  EXPECT_THAT(text(4),
              AllOf(HasSubstr("\nINS4_ACCOFFS_X,"),
                    HasSubstr("\nINS4_ACCSCAL_X,"),
                    HasSubstr("\nINS4_GYROFFS_X,"),
                    HasSubstr("\nINS4_GYR_CALTEMP,25\n"),
                    HasSubstr("\nINS4_TCAL_GYR3_Z,"),
                    HasSubstr("\nINS4_TCAL_ENABLE,1\n")));
}

TEST(ArduPilot, SaysWhereTheVehiclesOwnTemperatureTermsAreZero) {
  Calibration unit = RandomUnitCalibration({}, 14);
  EXPECT_THAT(ExportCalibration(unit, "ardupilot")->files[0].text,
              HasSubstr("\nINS_TCAL1_ENABLE,0\n"));
  unit.reference.recorded_degc = Eigen::Vector3d(30.0, 31.5, 33.0);
  EXPECT_THAT(ExportCalibration(unit, "ardupilot")->files[0].text,
              AllOf(HasSubstr("\nINS_ACC1_CALTEMP,31.5\n"),
                    HasSubstr("\nINS_GYR1_CALTEMP,31.5\n"),
                    Not(HasSubstr("INS_TCAL1_"))));
}

TEST(ArduPilot, RefusesAReferenceTemperatureOutsideOfTheCalibratedOnes) {
  Calibration unit = RandomUnitCalibration({.bias_order = 1}, 14);
  unit.sensors[Triad::kGyroscope]->thermal->range_degc = {30.0, 60.0};
  const Result<Export> result = ExportCalibration(unit, "ardupilot");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(result.error().message, HasSubstr("within the calibrated range (30 to 60 degC"));
}

}  // namespace autopilot_test
}  // namespace truetriad
