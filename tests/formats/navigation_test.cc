// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "formats/sample_units.h"
#include "truetriad/formats/export.h"
#include "truetriad/model/calibration.h"

// Kalibr, OpenVINS, Basalt, imu_calib, RealSense, Fusion and JSON: their equations, and readers of
// their files that share nothing with the exporter.

namespace truetriad {
namespace navigation_test {

using formats_test::RandomUnitCalibration;
using formats_test::TestEquation;
using formats_test::UnitKind;
using formats_test::WorstDisagreement;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kDouble = 1e-12;
constexpr double kFloat32 = 2e-6;

std::string Text(const Calibration& unit,
                 const std::string& format,
                 const ExportOptions& options = {}) {
  const Result<Export> result = ExportCalibration(unit, format, options);
  EXPECT_TRUE(result) << result.error().message;
  return result ? result->files[0].text : "";
}

Eigen::Matrix3d Rows(const YAML::Node& node) {
  Eigen::Matrix3d matrix;
  EXPECT_EQ(node.size(), 3U);
  for (int row = 0; row < 3; ++row) {
    EXPECT_EQ(node[row].size(), 3U);
    for (int col = 0; col < 3; ++col) matrix(row, col) = node[row][col].as<double>();
  }
  return matrix;
}

std::vector<double> Flat(const YAML::Node& node) { return node.as<std::vector<double>>(); }

Eigen::Vector3d Three(const YAML::Node& node) {
  const std::vector<double> numbers = Flat(node);
  EXPECT_EQ(numbers.size(), 3U);
  return {numbers[0], numbers[1], numbers[2]};
}

/// Kalibr's and OpenVINS' biases are states: those of the unit.
Eigen::Vector3d Bias(const Calibration& unit, Triad triad) {
  return unit.sensors[triad]->model.bias;
}

bool IsLower(const Eigen::Matrix3d& matrix) { return matrix.isLowerTriangular(0.0); }

bool IsRotation(const Eigen::Matrix3d& matrix) {
  return (matrix * matrix.transpose()).isIdentity(1e-14) && matrix.determinant() > 0.0;
}

TEST(KalibrResult, AppliesTheCalibrationExactly) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Calibration unit = RandomUnitCalibration({.g_sensitivity = true}, seed);
    const YAML::Node imu = YAML::Load(Text(unit, "kalibr-result"))["imu0"];
    EXPECT_EQ(imu["model"].as<std::string>(), "scale-misalignment");
    const Eigen::Matrix3d M_a = Rows(imu["accelerometers"]["M"]);
    const Eigen::Matrix3d M_g = Rows(imu["gyroscopes"]["M"]);
    const Eigen::Matrix3d A = Rows(imu["gyroscopes"]["A"]);
    const Eigen::Matrix3d C = Rows(imu["gyroscopes"]["C_gyro_i"]);
    EXPECT_TRUE(IsLower(M_a) && IsLower(M_g)) << M_a << '\n' << M_g;
    EXPECT_GT(M_g.diagonal().minCoeff(), 0.0);
    EXPECT_TRUE(IsRotation(C)) << C;
    // y_a = M_a f + b_a,  y_g = M_g C w + A C f + b_g, solved for f and w.
    EXPECT_LT(WorstDisagreement(unit,
                                Triad::kAccelerometer,
                                [&](const auto& y, const auto&, double) -> Eigen::Vector3d {
                                  return M_a.lu().solve(y - Bias(unit, Triad::kAccelerometer));
                                }),
              kDouble);
    EXPECT_LT(WorstDisagreement(unit,
                                Triad::kGyroscope,
                                [&](const auto& y, const auto& f, double) -> Eigen::Vector3d {
                                  return (M_g * C).lu().solve(y - A * C * f -
                                                              Bias(unit, Triad::kGyroscope));
                                }),
              kDouble);
  }
}

TEST(KalibrResult, StatesTheBiasesInAComment) {
  Calibration unit = RandomUnitCalibration({}, 1);
  unit.sensors[Triad::kGyroscope]->model.bias = {0.25, -0.5, 1.0};
  EXPECT_THAT(Text(unit, "kalibr-result"),
              HasSubstr("\n# bias gyroscope rad/s: [0.25, -0.5, 1]\n"));
}

TEST(KalibrResult, TurnsAnotherBodyFrameIntoItsOwn) {
  Calibration unit = RandomUnitCalibration({.g_sensitivity = true}, 2);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  unit.gauge = Gauge::kFixture;
  for (auto& sensor : unit.sensors) sensor->model.sensitivity *= turn;
  *unit.sensors[Triad::kGyroscope]->g_sensitivity *= turn;
  const Result<Export> result = ExportCalibration(unit, "kalibr-result");
  ASSERT_TRUE(result);
  EXPECT_THAT(result->notes, Contains(HasSubstr("rotated by 17.2 deg")));
  const YAML::Node imu = YAML::Load(result->files[0].text)["imu0"];
  const Eigen::Matrix3d M_a = Rows(imu["accelerometers"]["M"]);
  EXPECT_TRUE(IsLower(M_a));
  EXPECT_LT(WorstDisagreement(
                unit,
                Triad::kAccelerometer,
                [&](const auto& y, const auto&, double) -> Eigen::Vector3d {
                  return M_a.lu().solve(y - Bias(unit, Triad::kAccelerometer));
                },
                turn.transpose()),
            kDouble);
}

TEST(KalibrResult, RefusesAMirroredGyroscope) {
  Calibration unit = RandomUnitCalibration({}, 3);
  unit.sensors[Triad::kGyroscope]->model.sensitivity.row(2) *= -1.0;
  const Result<Export> result = ExportCalibration(unit, "kalibr-result");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(result.error().message, HasSubstr("the gyroscope is mirrored"));
}

AllanResult SomeAllan() {
  AllanResult allan;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    AllanTriad& item = allan.triads.emplace_back();
    item.triad = triad;
    item.unit = *ParseTriadUnit(triad, triad == Triad::kGyroscope ? "deg/s" : "m/s^2");
    item.rate_hz = 200.0;
    for (AllanAxis& axis : item.axes) {
      axis.white_density = Interval{0.03, 0.02, 0.04};
      axis.random_walk = Interval{0.001, 0.0009, 0.0011};
    }
  }
  return allan;
}

TEST(KalibrResult, TakesItsNoiseFromAnAllanDeviation) {
  const Calibration unit = RandomUnitCalibration({}, 4);
  const Result<Export> without = ExportCalibration(unit, "kalibr-result");
  ASSERT_TRUE(without);
  EXPECT_THAT(without->warnings, Contains(HasSubstr("--allan=FILE")));
  EXPECT_FALSE(YAML::Load(without->files[0].text)["imu0"]["accelerometer_noise_density"]);

  ExportOptions options;
  options.allan = SomeAllan();
  for (const char* const format : {"kalibr-result", "openvins"}) {
    const Result<Export> with = ExportCalibration(unit, format, options);
    ASSERT_TRUE(with);
    EXPECT_THAT(with->warnings, Not(Contains(HasSubstr("--allan"))));
    const std::string& text = with->files[0].text;
    const YAML::Node imu = YAML::Load(text.substr(text.find("imu0:")))["imu0"];
    EXPECT_DOUBLE_EQ(imu["accelerometer_noise_density"].as<double>(), 0.03);
    EXPECT_DOUBLE_EQ(imu["accelerometer_random_walk"].as<double>(), 0.001);
    EXPECT_DOUBLE_EQ(imu["gyroscope_noise_density"].as<double>(), 0.03 * std::numbers::pi / 180.0);
    EXPECT_DOUBLE_EQ(imu["gyroscope_random_walk"].as<double>(), 0.001 * std::numbers::pi / 180.0);
    EXPECT_EQ(imu["update_rate"].as<double>(), 200.0);
  }
}

// Kalibr's ImuParameters wants six keys, numbers above zero to Python's YAML, which takes 2e-05 for
// a word: a number has a point before its exponent.
TEST(Kalibr, IsToldOfNoiseAlone) {
  ExportOptions options;
  options.allan = SomeAllan();
  for (AllanTriad& triad : options.allan->triads) {
    for (AllanAxis& axis : triad.axes) axis.random_walk = Interval{2e-05, 1e-05, 3e-05};
  }
  const Calibration unit = RandomUnitCalibration({}, 4);
  const Result<Export> result = ExportCalibration(unit, "kalibr", options);
  ASSERT_TRUE(result) << result.error().message;
  const std::string& text = result->files[0].text;
  const YAML::Node imu = YAML::Load(text);
  EXPECT_EQ(imu.size(), 6U);
  EXPECT_EQ(imu["rostopic"].as<std::string>(), "/imu0");
  EXPECT_EQ(imu["update_rate"].as<double>(), 200.0);
  EXPECT_DOUBLE_EQ(imu["accelerometer_noise_density"].as<double>(), 0.03);
  EXPECT_DOUBLE_EQ(imu["accelerometer_random_walk"].as<double>(), 2e-05);
  EXPECT_DOUBLE_EQ(imu["gyroscope_noise_density"].as<double>(), 0.03 * std::numbers::pi / 180.0);
  EXPECT_DOUBLE_EQ(imu["gyroscope_random_walk"].as<double>(), 2e-05 * std::numbers::pi / 180.0);
  EXPECT_THAT(text, HasSubstr("\naccelerometer_random_walk: 2.0e-05  # m/s^2/s/sqrt(Hz)\n"));
  // Kalibr takes the readings as they are, so all of the calibration is lost, and that is said.
  const auto as_it_is = [](const auto& y, const auto&, double) -> Eigen::Vector3d { return y; };
  const double lost = WorstDisagreement(unit, Triad::kAccelerometer, as_it_is);
  EXPECT_NEAR(result->loss[Triad::kAccelerometer]->share() / lost, 1.0, 0.1);
  EXPECT_THAT(result->notes,
              Contains(AllOf(HasSubstr("accelerometer: dropped: bias, gains and misalignment"),
                             HasSubstr("truetriad apply"))));
}

TEST(Kalibr, IsToldWhatTheLogAloneKnows) {
  ExportOptions options;
  EXPECT_FALSE(ExportNoise("kalibr", options));
  options.allan = SomeAllan();
  options.allan->serial = "SN7";
  for (const char* const format : {"kalibr", "openvins", "ros2"}) {
    const Result<Export> result = ExportNoise(format, options);
    ASSERT_TRUE(result) << result.error().message;
    const std::string& text = result->files[0].text;
    EXPECT_THAT(
        text,
        HasSubstr("# Noise at rest of SN7, for " + std::string(format) + "; not calibrated.\n"));
    EXPECT_THAT(text, Not(HasSubstr("Calibration of")));
  }
  const YAML::Node imu = YAML::Load(ExportNoise("kalibr", options)->files[0].text);
  EXPECT_DOUBLE_EQ(imu["gyroscope_noise_density"].as<double>(), 0.03 * std::numbers::pi / 180.0);
  const std::string chain = ExportNoise("openvins", options)->files[0].text;
  EXPECT_TRUE(Rows(YAML::Load(chain.substr(chain.find("imu0:")))["imu0"]["Ta"]).isIdentity(0.0));
}

Eigen::Matrix3d NineByRows(const YAML::Node& node) {
  const std::vector<double> numbers = Flat(node);
  EXPECT_EQ(numbers.size(), 9U);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers.data());
}

TEST(Ros2, AppliesTheCalibrationExactly) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Calibration unit = RandomUnitCalibration({.g_sensitivity = true}, seed);
    const YAML::Node node = YAML::Load(Text(unit, "ros2"))["/**"]["ros__parameters"];
    for (const Triad triad : kTriads) {
      const YAML::Node sensor = node[std::string(TriadName(triad))];
      const Eigen::Matrix3d C = NineByRows(sensor["correction"]);
      const Eigen::Vector3d b = Three(sensor["bias"]);
      const Eigen::Matrix3d G = sensor["g_sensitivity"] ? NineByRows(sensor["g_sensitivity"])
                                                        : Eigen::Matrix3d(Eigen::Matrix3d::Zero());
      EXPECT_EQ(G.isZero(0.0), triad != Triad::kGyroscope);
      // ROS has tesla.
      const double si = triad == Triad::kMagnetometer ? 1e-6 : 1.0;
      EXPECT_LT(WorstDisagreement(unit,
                                  triad,
                                  [&](const auto& y, const auto& f, double) -> Eigen::Vector3d {
                                    return C * (si * y - b - G * f) / si;
                                  }),
                kDouble)
          << TriadName(triad);
    }
  }
}

TEST(Ros2, StatesTheVarianceOfNoiseAndOfTheCalibration) {
  Calibration unit = RandomUnitCalibration({}, 2);
  const Result<Export> unknown = ExportCalibration(unit, "ros2");
  ASSERT_TRUE(unknown);
  EXPECT_THAT(unknown->warnings, Contains(HasSubstr("--allan=FILE")));
  EXPECT_THAT(
      unknown->files[0].text,
      HasSubstr("magnetic_field_covariance: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]"));

  constexpr double kBiasVariance = 4e-6;  // (m/s^2)^2, of x alone
  unit.covariance.parameters = {"accelerometer.bias.x"};
  unit.covariance.matrix = Eigen::MatrixXd::Constant(1, 1, kBiasVariance);
  ExportOptions options;
  options.allan = SomeAllan();
  // Densities are enough: a random walk was not seen.
  for (AllanTriad& triad : options.allan->triads) triad.axes[1].random_walk.reset();
  const Result<Export> known = ExportCalibration(unit, "ros2", options);
  ASSERT_TRUE(known);
  const YAML::Node node = YAML::Load(known->files[0].text)["/**"]["ros__parameters"];
  const auto expect = [&](Triad triad, const char* name, double density, double bias_variance) {
    const Eigen::Matrix3d C = unit.sensors[triad]->model.sensitivity.inverse();
    const Eigen::Matrix3d noise = density * density * 200.0 * C * C.transpose();
    const Eigen::Matrix3d bias = bias_variance * C.col(0) * C.col(0).transpose();
    const Eigen::Vector3d variances = noise.diagonal() + bias.diagonal();
    const Eigen::Matrix3d found = NineByRows(node[name]);
    EXPECT_LT((found - Eigen::Matrix3d(variances.asDiagonal())).norm(), 1e-12 * found.norm())
        << name << '\n'
        << found;
  };
  expect(Triad::kAccelerometer, "linear_acceleration_covariance", 0.03, kBiasVariance);
  expect(Triad::kGyroscope, "angular_velocity_covariance", 0.03 * std::numbers::pi / 180.0, 0.0);
  EXPECT_TRUE(NineByRows(node["magnetic_field_covariance"]).isZero(0.0));

  // In tesla.
  AllanTriad mag = options.allan->triads[0];
  mag.triad = Triad::kMagnetometer;
  mag.unit = *ParseTriadUnit(Triad::kMagnetometer, "uT");
  options.allan->triads.push_back(mag);
  const YAML::Node with_mag = YAML::Load(Text(unit, "ros2", options))["/**"]["ros__parameters"];
  const Eigen::Matrix3d C = unit.sensors[Triad::kMagnetometer]->model.sensitivity.inverse();
  EXPECT_NEAR(NineByRows(with_mag["magnetic_field_covariance"])(2, 2) /
                  (0.03e-6 * 0.03e-6 * 200.0 * C.row(2).squaredNorm()),
              1.0,
              1e-12);
}

TEST(KalibrResult, HasTheDensityWhereNoRandomWalkWasSeen) {
  ExportOptions options;
  options.allan = SomeAllan();
  for (AllanTriad& triad : options.allan->triads) triad.axes[2].random_walk.reset();
  const Result<Export> result =
      ExportCalibration(RandomUnitCalibration({}, 4), "kalibr-result", options);
  ASSERT_TRUE(result);
  EXPECT_THAT(result->warnings, Contains(HasSubstr("lacks the random walk")));
  const YAML::Node imu = YAML::Load(result->files[0].text)["imu0"];
  EXPECT_DOUBLE_EQ(imu["accelerometer_noise_density"].as<double>(), 0.03);
  EXPECT_FALSE(imu["accelerometer_random_walk"]);
  EXPECT_EQ(imu["update_rate"].as<double>(), 200.0);
}

TEST(OpenVins, AppliesTheCalibrationExactly) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Calibration unit = RandomUnitCalibration({.g_sensitivity = true}, seed);
    const std::string text = Text(unit, "openvins");
    EXPECT_THAT(text, ::testing::StartsWith("%YAML:1.0\n"));
    const YAML::Node imu = YAML::Load(text.substr(text.find("imu0:")))["imu0"];
    EXPECT_EQ(imu["model"].as<std::string>(), "kalibr");
    const Eigen::Matrix3d Ta = Rows(imu["Ta"]);
    const Eigen::Matrix3d Tw = Rows(imu["Tw"]);
    const Eigen::Matrix3d Tg = Rows(imu["Tg"]);
    const Eigen::Matrix3d R = Rows(imu["R_IMUtoGYRO"]);
    EXPECT_TRUE(Rows(imu["R_IMUtoACC"]).isIdentity(0.0));
    EXPECT_TRUE(IsLower(Ta) && IsLower(Tw) && IsRotation(R));
    EXPECT_LT(WorstDisagreement(unit,
                                Triad::kAccelerometer,
                                [&](const auto& y, const auto&, double) -> Eigen::Vector3d {
                                  return Ta.inverse() * (y - Bias(unit, Triad::kAccelerometer));
                                }),
              kDouble);
    EXPECT_LT(WorstDisagreement(unit,
                                Triad::kGyroscope,
                                [&](const auto& y, const auto& f, double) -> Eigen::Vector3d {
                                  return R.transpose() * Tw.inverse() *
                                         (y - Bias(unit, Triad::kGyroscope) - Tg * f);
                                }),
              kDouble)
        << seed;
  }
}

TEST(Basalt, AppliesTheCalibrationExactly) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Calibration unit = RandomUnitCalibration({}, seed);
    ExportOptions options;
    options.allan = SomeAllan();
    const YAML::Node value = YAML::Load(Text(unit, "basalt", options))["value0"];
    const std::vector<double> acc = Flat(value["calib_accel_bias"]);
    const std::vector<double> gyro = Flat(value["calib_gyro_bias"]);
    ASSERT_EQ(acc.size(), 9U);
    ASSERT_EQ(gyro.size(), 12U);
    EXPECT_EQ(value["imu_update_rate"].as<double>(), 200.0);
    EXPECT_EQ(Three(value["accel_noise_std"]), Eigen::Vector3d::Constant(0.03));
    EXPECT_EQ(Three(value["accel_bias_std"]), Eigen::Vector3d::Constant(0.001));
    // c_x c_y c_z E11 E21 E31 E22 E32 E33
    Eigen::Matrix3d E_a;
    E_a << acc[3], 0, 0, acc[4], acc[6], 0, acc[5], acc[7], acc[8];
    Eigen::Matrix3d E_g;
    E_g << gyro[3], gyro[6], gyro[9], gyro[4], gyro[7], gyro[10], gyro[5], gyro[8], gyro[11];
    EXPECT_LT(WorstDisagreement(unit,
                                Triad::kAccelerometer,
                                [&](const auto& y, const auto&, double) -> Eigen::Vector3d {
                                  return y + E_a * y - Eigen::Vector3d(acc[0], acc[1], acc[2]);
                                }),
              kDouble);
    EXPECT_LT(WorstDisagreement(unit,
                                Triad::kGyroscope,
                                [&](const auto& y, const auto&, double) -> Eigen::Vector3d {
                                  return y + E_g * y - Eigen::Vector3d(gyro[0], gyro[1], gyro[2]);
                                }),
              kDouble)
        << seed;
  }
}

TEST(ImuCalib, AppliesTheCalibrationExactly) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Calibration unit = RandomUnitCalibration({}, seed);
    const YAML::Node file = YAML::Load(Text(unit, "imu_calib"));
    const std::vector<double> SM = Flat(file["SM"]);
    ASSERT_EQ(SM.size(), 9U);
    Eigen::Matrix3d matrix;
    matrix << SM[0], SM[1], SM[2], SM[3], SM[4], SM[5], SM[6], SM[7], SM[8];
    const Eigen::Vector3d bias = Three(file["bias"]);
    EXPECT_LT(WorstDisagreement(unit,
                                Triad::kAccelerometer,
                                [&](const auto& y, const auto&, double) -> Eigen::Vector3d {
                                  return matrix * y - bias;
                                }),
              kDouble)
        << seed;
  }
}

TEST(ImuCalib, NeedsAnAccelerometer) {
  Calibration unit = RandomUnitCalibration({}, 1);
  unit.sensors[Triad::kAccelerometer].reset();
  const Result<Export> result = ExportCalibration(unit, "imu-calib");
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("no sensor that imu-calib supports"));
}

TEST(RealSense, AppliesTheTransposeOfWhatItStores) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Calibration unit = RandomUnitCalibration({}, seed);
    const YAML::Node imu = YAML::Load(Text(unit, "realsense"))["imus"][0];
    for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
      const YAML::Node sensor = imu[std::string(TriadName(triad))];
      const std::vector<double> n = Flat(sensor["scale_and_alignment"]);
      ASSERT_EQ(n.size(), 9U);
      Eigen::Matrix3f stored;
      for (std::size_t i = 0; i < 9; ++i) {
        stored(static_cast<int>(i) / 3, static_cast<int>(i) % 3) = static_cast<float>(n[i]);
      }
      const Eigen::Vector3f bias = Three(sensor["bias"]).cast<float>();
      EXPECT_LT(WorstDisagreement(unit,
                                  triad,
                                  [&](const auto& y, const auto&, double) -> Eigen::Vector3d {
                                    return (stored.transpose() * y.template cast<float>() - bias)
                                        .template cast<double>();
                                  }),
                kFloat32)
          << seed;
    }
  }
}

/// The numbers of `name = {…}`.
std::vector<float> Braced(const std::string& text, const std::string& name) {
  std::vector<float> numbers;
  const std::size_t at = text.find(name + " = {");
  EXPECT_NE(at, std::string::npos) << name;
  std::istringstream items(text.substr(at + name.size() + 4));
  for (std::string item; std::getline(items, item, ',');) {
    numbers.push_back(std::stof(item));
    if (item.find('}') != std::string::npos) break;
  }
  return numbers;
}

Eigen::Vector3f Vector(const std::string& text, const std::string& name) {
  const std::vector<float> n = Braced(text, name);
  EXPECT_EQ(n.size(), 3U) << name;
  return {n[0], n[1], n[2]};
}

Eigen::Matrix3f Matrix(const std::string& text, const std::string& name) {
  const std::vector<float> n = Braced(text, name);
  EXPECT_EQ(n.size(), 9U) << name;
  Eigen::Matrix3f matrix;
  matrix << n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8];
  return matrix;
}

/// Fusion's equations, fed `per_raw` of its units a raw unit, with results worth `true_unit` each.
TestEquation FusionEquation(const std::string& text,
                            Triad triad,
                            double per_raw,
                            double true_unit) {
  return [=](const Eigen::Vector3d& raw, const Eigen::Vector3d&, double) -> Eigen::Vector3d {
    const Eigen::Vector3f y = (per_raw * raw).cast<float>();
    if (triad == Triad::kMagnetometer) {
      return true_unit *
             (Matrix(text, "softIronMatrix") * (y - Vector(text, "hardIronOffset"))).cast<double>();
    }
    const std::string name(TriadName(triad));
    return true_unit *
           (Matrix(text, name + "Misalignment") *
            (y - Vector(text, name + "Offset")).cwiseProduct(Vector(text, name + "Sensitivity")))
               .cast<double>();
  };
}

TEST(Fusion, AppliesTheCalibrationInItsUnits) {
  constexpr double kDeg = std::numbers::pi / 180.0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Calibration unit = RandomUnitCalibration({}, seed);
    const std::string text = Text(unit, "fusion");
    EXPECT_LT(WorstDisagreement(unit,
                                Triad::kAccelerometer,
                                FusionEquation(text, Triad::kAccelerometer, 1 / 9.80665, 9.80665)),
              kFloat32);
    EXPECT_LT(WorstDisagreement(
                  unit, Triad::kGyroscope, FusionEquation(text, Triad::kGyroscope, 1 / kDeg, kDeg)),
              kFloat32);
    EXPECT_LT(WorstDisagreement(
                  unit, Triad::kMagnetometer, FusionEquation(text, Triad::kMagnetometer, 1.0, 1.0)),
              kFloat32);
  }
}

TEST(Fusion, TakesCountsAndGivesGAndDegrees) {
  const Calibration unit = RandomUnitCalibration({.counts = true}, 4);
  EXPECT_LT(
      WorstDisagreement(unit,
                        Triad::kAccelerometer,
                        FusionEquation(Text(unit, "fusion"), Triad::kAccelerometer, 1.0, 9.80665)),
      kFloat32);
}

TEST(Fusion, TakesTheUnitsItIsTold) {
  const Calibration unit = RandomUnitCalibration({}, 5);
  ExportOptions options;
  options.units[Triad::kAccelerometer] = "m/s^2";
  EXPECT_LT(WorstDisagreement(
                unit,
                Triad::kAccelerometer,
                FusionEquation(Text(unit, "fusion", options), Triad::kAccelerometer, 1.0, 1.0)),
            kFloat32);
}

TEST(Json, HoldsEverything) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Calibration unit =
        RandomUnitCalibration({.bias_order = 5, .matrix_order = 2, .g_sensitivity = true}, seed);
    unit.sensors[Triad::kGyroscope]->thermal->rate[RateTerm::kLinear] =
        Eigen::Vector3d(1e-3, 2e-3, 3e-3);
    const Result<Export> result = ExportCalibration(unit, "json");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->notes.empty()) << result->notes[0];
    const YAML::Node sensors = YAML::Load(result->files[0].text)["sensors"];
    EXPECT_EQ(Three(sensors["gyroscope"]["thermal"]["rate_linear"]),
              Eigen::Vector3d(1e-3, 2e-3, 3e-3));
    for (const Triad triad : kTriads) {
      const YAML::Node sensor = sensors[std::string(TriadName(triad))];
      const YAML::Node thermal = sensor["thermal"];
      const auto equation =
          [&](const Eigen::Vector3d& raw, const Eigen::Vector3d& f, double t) -> Eigen::Vector3d {
        const double tau = t - thermal["reference_degc"].as<double>();
        Eigen::Vector3d b = Three(sensor["bias"]);
        Eigen::Matrix3d S = Rows(sensor["sensitivity"]);
        for (std::size_t k = 0; k < thermal["bias"].size(); ++k) {
          b += std::pow(tau, k + 1) * Three(thermal["bias"][k]);
        }
        for (std::size_t k = 0; k < thermal["sensitivity"].size(); ++k) {
          S += std::pow(tau, k + 1) * Rows(thermal["sensitivity"][k]);
        }
        if (sensor["g_sensitivity"]) b += Rows(sensor["g_sensitivity"]) * f;
        return S.lu().solve(raw - b);
      };
      if (seed > 2) continue;  // reading the text at every point takes its time
      EXPECT_LT(WorstDisagreement(unit, triad, equation), kDouble) << TriadName(triad);
    }
  }
}

TEST(Json, HoldsTheLagsOfASweepAndOthersSayThatTheyDropThem) {
  Calibration unit = RandomUnitCalibration({.bias_order = 3}, 1);
  ThermalTerms& thermal = *unit.sensors[Triad::kGyroscope]->thermal;
  thermal.rate[RateTerm::kCross] = Eigen::Vector3d(1e-3, 2e-3, 3e-3);
  thermal.element_lag_s = Eigen::Vector3d(60.0, 0.0, 10.0);
  thermal.rate_lag_s = Eigen::Vector3d(0.0, 100.0, 200.0);
  thermal.smoothing_s = 15.0;
  const Result<Export> json = ExportCalibration(unit, "json");
  ASSERT_TRUE(json) << json.error().message;
  const YAML::Node written = YAML::Load(json->files[0].text)["sensors"]["gyroscope"]["thermal"];
  EXPECT_EQ(Three(written["element_lag_s"]), *thermal.element_lag_s);
  EXPECT_EQ(Three(written["rate_lag_s"]), *thermal.rate_lag_s);
  EXPECT_EQ(written["smoothing_s"].as<double>(), 15.0);
  const Result<Export> header = ExportCalibration(unit, "c-header");
  ASSERT_TRUE(header) << header.error().message;
  std::string notes;
  for (const std::string& note : header->notes) notes += note + '\n';
  EXPECT_NE(notes.find("gyroscope: dropped: temperature lag"), std::string::npos) << notes;
}

}  // namespace navigation_test
}  // namespace truetriad
