// SPDX-License-Identifier: Apache-2.0
#include "truetriad/config/experiment.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "truetriad/io/calibration_file.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace experiment_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr const char* kMinimal = "experiment: 1\nsensors: { accelerometer: {} }\n";

const std::filesystem::path& ConfigFolder() {
  static const std::filesystem::path folder =
      std::filesystem::path(TRUETRIAD_SOURCE_DIR) / "configs";
  return folder;
}

/// A folder of its own for each test, to write experiments in.
class ExperimentConfig : public ::testing::Test {
 protected:
  ExperimentConfig() { std::filesystem::create_directories(folder_); }
  ~ExperimentConfig() override { std::filesystem::remove_all(folder_); }

  std::string Write(const std::string& text, const std::string& name = "experiment.yaml") const {
    const std::string path = (folder_ / name).string();
    EXPECT_TRUE(WriteFileAtomically(path, text));
    return path;
  }

  Result<Experiment> Load(const std::string& text,
                          const std::vector<std::string>& overrides = {}) const {
    return ReadExperiment(Write(text), overrides);
  }

  /// The experiment, or a default one and a failed test.
  Experiment LoadWell(const std::string& text,
                      const std::vector<std::string>& overrides = {}) const {
    Result<Experiment> experiment = Load(text, overrides);
    EXPECT_TRUE(experiment) << experiment.error().message;
    return experiment ? *experiment : Experiment();
  }

  std::string ErrorOf(const std::string& text,
                      const std::vector<std::string>& overrides = {}) const {
    const Result<Experiment> experiment = Load(text, overrides);
    return experiment ? "no error" : experiment.error().message;
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) /
      (std::string("experiment_") +
       ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

/// Everything that an experiment can say, nothing of it the default.
constexpr const char* kEverything = R"(experiment: 1
input: data/log.csv
device: { serial: "007", model: "a: b" }
reference:
  gravity_mps2: { value: 9.81, sigma: 1e-4 }
  position: { latitude_deg: -33.1, longitude_deg: 151.2, height_m: 58, date: 2026-01-31 }
  field: { strength_ut: { value: 57.1, sigma: 0.3 }, dip_deg: -64.3, hemisphere: south }
  temperature_degc: 20.5
  earth_rate: { latitude_deg: -30, declination_deg: 12.5 }
gauge: accel-z
sensors:
  accelerometer:
    model: diagonal
    sign: gravity
    noise: { sigma: [0.1, 0.2, 0.3], excess: { sigma: 0.01 }, source: datasheet }
    prior:
      bias: [1, 2, 3]
      bias_sigma: 0.5
      sensitivity: [[1, 0, 0], [0, 2, 0], [0, 0, 3]]
      sensitivity_sigma: [[0.1, .inf, .inf], [.inf, 0.1, .inf], [.inf, .inf, 0.1]]
    fixed: { bias: [0.1, 0.2, 0.3] }
  magnetometer:
    model: bias
    noise: { excess: none }
    fixed: { matrix: identity }
mounting: { accelerometer: -x+y+z, magnetometer: +y+x-z }
poses: { every: 100 }
time: regular
exclude: [{ from_s: 1.5, to_s: 2 }, { from_s: 30, to_s: 40 }]
exclude_poses: [3, 7]
attitudes: { six_face: { tilt_sigma_deg: 0.7, seat_sigma_deg: 0 } }
robust: { loss: none, scale: 2.5 }
clocks: as_stated
units: trust
initialise: { method: six-position, only: false, forces: forces.csv }
limits: { accelerometer.bias: 0.5, magnetometer.scale_error: 0.1, decision: { guard_band_k: 2 } }
cross_validation: { folds: 0 }
observable_sigma: 0.1
)";

TEST_F(ExperimentConfig, NeedsOnlyTheVersionAndTheSensors) {
  const Experiment experiment = LoadWell(kMinimal);
  const CalibrateOptions defaults;
  EXPECT_TRUE(experiment.options.triads[Triad::kAccelerometer].enabled);
  EXPECT_FALSE(experiment.options.triads[Triad::kMagnetometer].enabled);
  EXPECT_EQ(experiment.options.reference.gravity_mps2.value, kStandardGravityMps2);
  // Gravity that nobody stated is that of anywhere on the Earth.
  EXPECT_EQ(experiment.options.reference.gravity_mps2.sigma, 0.02);
  EXPECT_FALSE(experiment.options.reference.field_ut.known());
  EXPECT_EQ(experiment.options.gauge, defaults.gauge);
  EXPECT_EQ(experiment.options.robust.scale, defaults.robust.scale);
  EXPECT_EQ(experiment.options.observable_sigma, defaults.observable_sigma);
  EXPECT_FALSE(experiment.poses.given);
  EXPECT_THAT(experiment.inputs, IsEmpty());
}

TEST_F(ExperimentConfig, TakesSeveralRecordingsAsSessions) {
  const Experiment experiment = LoadWell(
      "experiment: 1\ninput: [a.csv, b/recording.yaml]\n"
      "sensors: { accelerometer: { bias: shared }, magnetometer: { bias: per_session }, "
      "gyroscope: {} }\n");
  EXPECT_THAT(experiment.inputs,
              ElementsAre((folder_ / "a.csv").string(), (folder_ / "b/recording.yaml").string()));
  EXPECT_FALSE(experiment.options.HasSessionBias(Triad::kAccelerometer));
  EXPECT_TRUE(experiment.options.HasSessionBias(Triad::kMagnetometer));
  EXPECT_TRUE(experiment.options.HasSessionBias(Triad::kGyroscope));
  const Experiment again = LoadWell(experiment.resolved_yaml);
  EXPECT_EQ(again.inputs, experiment.inputs);
  EXPECT_FALSE(again.options.HasSessionBias(Triad::kAccelerometer));
}

TEST_F(ExperimentConfig, SaysWhereSessionsAreWrong) {
  EXPECT_THAT(ErrorOf("experiment: 1\ninput: []\nsensors: { accelerometer: {} }\n"),
              HasSubstr("experiment.yaml:2: input: expected a recording, or a list"));
  EXPECT_THAT(ErrorOf("experiment: 1\ninput: [a.csv, { file: b }]\n"
                      "sensors: { accelerometer: {} }\n"),
              HasSubstr("experiment.yaml:2: input[1]"));
  EXPECT_THAT(ErrorOf("experiment: 1\nsensors:\n  gyroscope:\n    bias: each\n"),
              AllOf(HasSubstr("experiment.yaml:4: sensors.gyroscope.bias"),
                    HasSubstr("shared"),
                    HasSubstr("per_session")));
}

TEST_F(ExperimentConfig, ReadsEveryKey) {
  const Experiment experiment = LoadWell(kEverything);
  const CalibrateOptions& options = experiment.options;
  EXPECT_THAT(experiment.inputs, ElementsAre((folder_ / "data/log.csv").string()));
  EXPECT_EQ(experiment.forces_file, (folder_ / "forces.csv").string());
  EXPECT_EQ(experiment.serial, "007");
  EXPECT_EQ(experiment.model, "a: b");
  EXPECT_EQ(options.reference.gravity_mps2.value, 9.81);
  EXPECT_EQ(options.reference.gravity_mps2.sigma, 1e-4);
  EXPECT_EQ(experiment.position->date, "2026-01-31");
  ASSERT_TRUE(options.reference.earth_rate);
  EXPECT_DOUBLE_EQ(options.reference.earth_rate->latitude_rad, -30.0 * std::numbers::pi / 180.0);
  EXPECT_DOUBLE_EQ(options.reference.earth_rate->declination_rad, 12.5 * std::numbers::pi / 180.0);
  EXPECT_EQ(options.reference.field_ut.value, 57.1);
  EXPECT_EQ(options.reference.field_ut.sigma, 0.3);
  EXPECT_DOUBLE_EQ(*options.reference.dip_rad.value, -64.3 * std::numbers::pi / 180.0);
  EXPECT_FALSE(options.reference.northern_hemisphere);
  EXPECT_EQ(options.gauge, Gauge::kAccelZ);
  EXPECT_FALSE(options.check_units);
  EXPECT_FALSE(options.corrects_clocks);
  const TriadOptions& accelerometer = options.triads[Triad::kAccelerometer];
  EXPECT_EQ(accelerometer.model, MatrixModel::kDiagonal);
  EXPECT_EQ(accelerometer.sign, AccelerometerSign::kGravity);
  EXPECT_EQ(accelerometer.noise_sigma_raw, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(accelerometer.noise_source, NoiseSource::kDatasheet);
  EXPECT_EQ(accelerometer.excess, ExcessNoise::kGiven);
  EXPECT_EQ(accelerometer.excess_sigma, 0.01);
  EXPECT_EQ(accelerometer.prior->bias_sigma, Eigen::Vector3d::Constant(0.5));
  EXPECT_EQ(accelerometer.prior->sensitivity(1, 1), 2.0);
  EXPECT_TRUE(std::isinf(accelerometer.prior->sensitivity_sigma(0, 1)));
  EXPECT_EQ(accelerometer.fixed_bias, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_TRUE(experiment.fixed_identity[Triad::kMagnetometer]);
  EXPECT_EQ(options.triads[Triad::kMagnetometer].excess, ExcessNoise::kNone);
  EXPECT_EQ(accelerometer.mounting, AxisMapFromName("-x+y+z"));
  EXPECT_EQ(options.triads[Triad::kMagnetometer].mounting, AxisMapFromName("+y+x-z"));
  EXPECT_EQ(experiment.poses.kind, PoseSelectionKind::kEveryN);
  EXPECT_EQ(experiment.poses.every, 100);
  EXPECT_EQ(experiment.poses.time_stamps, TimeStamps::kRegular);
  ASSERT_THAT(experiment.poses.exclude, SizeIs(2));
  EXPECT_EQ(experiment.poses.exclude[0].from_s, 1.5);
  EXPECT_EQ(experiment.poses.exclude[0].to_s, 2.0);
  EXPECT_EQ(experiment.exclude_poses, (std::vector<int>{3, 7}));
  EXPECT_EQ(options.attitudes.kind, AttitudeKind::kSixFace);
  EXPECT_EQ(options.attitudes.tilt_sigma_deg, 0.7);
  EXPECT_FALSE(options.robust.enabled);
  EXPECT_EQ(options.initialise.method, InitialiseMethod::kSixPosition);
  EXPECT_FALSE(options.initialise.only);
  EXPECT_THAT(options.limits.limits, SizeIs(2));
  EXPECT_EQ(options.limits.guard_band_k, 2.0);
  EXPECT_EQ(options.cross_validation_folds, 0);
}

TEST_F(ExperimentConfig, MountsSensorsAlongTheBodyUnlessTold) {
  const std::string all = "experiment: 1\nsensors: { accelerometer: {}, magnetometer: {} }\n";
  const auto mounting = [this](const std::string& text, Triad triad) {
    return LoadWell(text).options.triads[triad].mounting;
  };
  EXPECT_EQ(mounting(all, Triad::kAccelerometer), Eigen::Matrix3d(Eigen::Matrix3d::Identity()));
  EXPECT_FALSE(mounting(all, Triad::kMagnetometer));
  EXPECT_FALSE(mounting(all + "mounting: { accelerometer: any }\n", Triad::kAccelerometer));
  // A matrix that is held says it, too.
  EXPECT_EQ(mounting("experiment: 1\nsensors: { accelerometer: { sign: gravity, fixed: { matrix: "
                     "[[0, 1, 0], [-1, 0, 0], [0, 0, -1]] } } }\n",
                     Triad::kAccelerometer),
            AxisMapFromName("-y+x+z"));
}

TEST_F(ExperimentConfig, RefusesAxesAndRangesThatAreNone) {
  for (const auto& [text, place] :
       {std::pair("mounting: { accelerometer: +x+x+z }\n", "experiment.yaml:3: mounting."),
        std::pair("mounting: { thermometer: +x+y+z }\n", "mounting.thermometer"),
        std::pair("exclude: [{ from_s: 3, to_s: 3 }]\n", "experiment.yaml:3: exclude[0]"),
        std::pair("exclude: [{ from_s: -1, to_s: 3 }]\n", "exclude[0].from_s"),
        std::pair("exclude: [{ from_s: 1 }]\n", "exclude[0].to_s"),
        std::pair("exclude_poses: [0]\n", "experiment.yaml:3: exclude_poses[0]"),
        std::pair("poses: { sweep: auto }\nexclude_poses: [1]\n", "exclude_poses")}) {
    EXPECT_THAT(ErrorOf(kMinimal + std::string(text)), HasSubstr(place)) << text;
  }
}

/// The text without the marks of defaults, which are gone once they are written out.
std::string WithoutMarks(std::string text) {
  const std::string mark = "  # default";
  for (std::size_t at = 0; (at = text.find(mark)) != std::string::npos;)
    text.erase(at, mark.size());
  return text;
}

TEST_F(ExperimentConfig, TakesANonlinearityAsADataSheetStatesIt) {
  const std::string text =
      "experiment: 1\nsensors:\n  magnetometer:\n"
      "    nonlinearity: { percent_of_full_scale: 0.2, full_scale_mgauss: 8000 }\n";
  const auto stated = [this](const std::string& yaml, const std::vector<std::string>& more = {}) {
    return LoadWell(yaml, more).options.triads[Triad::kMagnetometer].nonlinearity;
  };
  ASSERT_TRUE(stated(text));
  EXPECT_EQ(stated(text)->percent_of_full_scale, 0.2);
  EXPECT_DOUBLE_EQ(stated(text)->full_scale, 800.0);
  const Experiment experiment = LoadWell(text);
  EXPECT_EQ(stated(experiment.resolved_yaml)->full_scale, stated(text)->full_scale);
  EXPECT_EQ(LoadWell(experiment.resolved_yaml).resolved_yaml,
            WithoutMarks(experiment.resolved_yaml));
  EXPECT_FALSE(stated(text, {"sensors.magnetometer.nonlinearity=none"}));
}

TEST_F(ExperimentConfig, SaysWhereANonlinearityIsOfNoUseOrNoValue) {
  const auto error = [this](const std::string& value, const std::string& more = "") {
    return ErrorOf("experiment: 1\nsensors:\n  accelerometer:\n    nonlinearity: " + value + "\n" +
                   more);
  };
  const std::string good = "{ percent_of_full_scale: 0.5, full_scale_g: 2 }";
  const std::string place = "experiment.yaml:4: sensors.accelerometer.nonlinearity";
  EXPECT_EQ(error(good), "no error");
  EXPECT_EQ(error("none"), "no error");
  EXPECT_THAT(error("0.5"), AllOf(HasSubstr(place), HasSubstr("percent_of_full_scale")));
  EXPECT_THAT(error("{ percent_of_full_scale: 0.5 }"),
              AllOf(HasSubstr(place), HasSubstr("`full_scale_mps2` is missing")));
  EXPECT_THAT(error("{ full_scale_g: 2 }"), HasSubstr("`percent_of_full_scale` is missing"));
  EXPECT_THAT(error("{ percent_of_full_scale: 50, full_scale_g: 2 }"),
              HasSubstr(place + ".percent_of_full_scale"));
  EXPECT_THAT(error("{ percent_of_full_scale: 0.5, full_scale_g: -2 }"),
              HasSubstr(place + ".full_scale_g"));
  EXPECT_THAT(error("{ percent_of_full_scale: 0.5, full_scale_g: 2, full_scale_mps2: 20 }"),
              HasSubstr("states the same quantity"));
  EXPECT_THAT(error("{ percent_of_full_scale: 0.5, full_scale_ut: 2 }"),
              HasSubstr("full_scale_ut"));
  EXPECT_THAT(error(good, "    thermal: { bias_order: 1 }\nposes: { sweep: auto }\n"),
              AllOf(HasSubstr(place), HasSubstr("sweep")));
}

TEST_F(ExperimentConfig, ResolvesToAnExperimentWithTheSameOptions) {
  for (const std::string& text :
       {std::string(kMinimal),
        std::string(kEverything),
        std::string(kMinimal) + "reference: { position: { latitude_deg: 45, height_m: 0 } }\n",
        std::string(kMinimal) + "attitudes: { file: a.csv, sigma_deg: 0.1 }\nposes: every_row\n",
        std::string(kMinimal) + "poses: { column: 'a \"b\"' }\n",
        std::string("experiment: 1\nsensors: { magnetometer: { noise: { allan: a/b.yaml } } }\n"),
        std::string(kMinimal) + "poses: { file: poses.yaml }\n"}) {
    const Experiment first = LoadWell(text);
    const Experiment second = LoadWell(first.resolved_yaml);
    EXPECT_EQ(second.resolved_yaml, WithoutMarks(first.resolved_yaml));
    EXPECT_EQ(second.inputs, first.inputs);
    EXPECT_EQ(second.options.gauge, first.options.gauge);
    EXPECT_EQ(second.options.reference.gravity_mps2.value,
              first.options.reference.gravity_mps2.value);
    EXPECT_EQ(second.options.reference.gravity_mps2.sigma,
              first.options.reference.gravity_mps2.sigma);
    EXPECT_EQ(second.options.reference.dip_rad.value, first.options.reference.dip_rad.value);
    EXPECT_EQ(second.attitudes_file, first.attitudes_file);
    EXPECT_EQ(second.allan_files.items, first.allan_files.items);
    EXPECT_EQ(second.poses.given, first.poses.given);
    EXPECT_EQ(second.poses.column, first.poses.column);
    EXPECT_EQ(second.poses.file, first.poses.file);
  }
}

TEST_F(ExperimentConfig, TakesNoiseFromAnAllanFileOrASigmaTheLaterWordWins) {
  const std::string stated =
      "experiment: 1\nsensors: { accelerometer: { noise: { sigma: 0.1 } } }\n";
  const Experiment experiment = LoadWell(stated, {"sensors.accelerometer.noise={ allan: a.yaml }"});
  EXPECT_EQ(experiment.allan_files[Triad::kAccelerometer], (folder_ / "a.yaml").string());
  EXPECT_FALSE(experiment.options.triads[Triad::kAccelerometer].noise_sigma_raw);
  const Experiment again =
      LoadWell(experiment.resolved_yaml, {"sensors.accelerometer.noise={ sigma: 0.2 }"});
  EXPECT_EQ(again.allan_files[Triad::kAccelerometer], "");
  EXPECT_TRUE(again.options.triads[Triad::kAccelerometer].noise_sigma_raw);
  EXPECT_THAT(
      ErrorOf("experiment: 1\nsensors: { accelerometer: { noise: { sigma: 1, allan: a } } }\n"),
      AllOf(HasSubstr(":2:"), HasSubstr("sigma and allan exclude each other")));
}

TEST_F(ExperimentConfig, MarksDefaultsAndNothingElse) {
  const std::string resolved = LoadWell(
                                   "experiment: 1\nsensors: { magnetometer: {} }\n"
                                   "robust: { scale: 3.0 }\n")
                                   .resolved_yaml;
  EXPECT_THAT(resolved, HasSubstr("  loss: huber  # default\n  scale: 3\n"));
  EXPECT_THAT(resolved, HasSubstr("    model: full  # default\n"));
}

TEST_F(ExperimentConfig, LoadsBackFromACalibration) {
  Calibration calibration;
  calibration.config_yaml = LoadWell(kEverything).resolved_yaml;
  const Experiment experiment = LoadWell(CalibrationToYaml(calibration));
  EXPECT_EQ(experiment.resolved_yaml, WithoutMarks(calibration.config_yaml));
}

TEST_F(ExperimentConfig, TakesNormalGravityFromThePosition) {
  // Normal gravity of WGS84, to 8 decimals.
  for (const auto& [latitude_deg, height_m, expected_mps2] :
       {std::tuple("45", "0", 9.80619777), std::tuple("52.5", "1000", 9.80982840)}) {
    const Knowledge gravity =
        LoadWell(std::string(kMinimal) + "reference: { position: { latitude_deg: " + latitude_deg +
                 ", height_m: " + height_m + " } }\n")
            .options.reference.gravity_mps2;
    EXPECT_NEAR(*gravity.value, expected_mps2, 0.5e-8);
    EXPECT_EQ(gravity.sigma, 5e-4);
  }
}

TEST_F(ExperimentConfig, TakesTheLatitudeOfTheEarthRateFromThePosition) {
  const std::string position = "position: { latitude_deg: 45, height_m: 0 }";
  EXPECT_FALSE(LoadWell(std::string(kMinimal) + "reference: { " + position + " }\n")
                   .options.reference.earth_rate);
  for (const std::string stated : {"position", "{ declination_deg: 0 }", "{ latitude_deg: 45 }"}) {
    const auto rate = LoadWell(std::string(kMinimal) + "reference: { " + position +
                               ", earth_rate: " + stated + " }\n")
                          .options.reference.earth_rate;
    ASSERT_TRUE(rate) << stated;
    EXPECT_DOUBLE_EQ(rate->latitude_rad, std::numbers::pi / 4.0);
    EXPECT_EQ(rate->declination_rad, 0.0);
  }
  EXPECT_FALSE(LoadWell(std::string(kMinimal) + "reference: { earth_rate: none }\n")
                   .options.reference.earth_rate);
  EXPECT_THAT(ErrorOf(std::string(kMinimal) + "reference: { earth_rate: position }\n"),
              HasSubstr("latitude_deg"));
}

TEST_F(ExperimentConfig, PrefersMeasuredGravityToThePosition) {
  const std::string position = "position: { latitude_deg: 45, height_m: 0 }";
  const Knowledge measured =
      LoadWell(kMinimal + ("reference: { gravity_mps2: 9.8, " + position + " }\n"))
          .options.reference.gravity_mps2;
  EXPECT_EQ(measured.value, 9.8);
  EXPECT_EQ(measured.sigma, 0.0);
  const Knowledge stated_sigma =
      LoadWell(kMinimal + ("reference: { gravity_mps2: { sigma: 1e-5 }, " + position + " }\n"))
          .options.reference.gravity_mps2;
  EXPECT_NEAR(*stated_sigma.value, 9.80619777, 0.5e-8);
  EXPECT_EQ(stated_sigma.sigma, 1e-5);
}

TEST_F(ExperimentConfig, StatesTheResultInTheFixtureWhenAttitudesAreGiven) {
  const std::string attitudes = "attitudes: { six_face: {} }\n";
  EXPECT_EQ(LoadWell(kMinimal + attitudes).options.gauge, Gauge::kFixture);
  EXPECT_EQ(LoadWell(kMinimal + attitudes + "gauge: symmetric\n").options.gauge, Gauge::kSymmetric);
  EXPECT_THAT(ErrorOf(std::string(kMinimal) + "gauge: fixture\n"),
              HasSubstr("needs known attitudes"));
}

TEST_F(ExperimentConfig, RejectsUnknownKeyWithItsLine) {
  EXPECT_THAT(ErrorOf(std::string(kMinimal) + "gage: accel-x\n"),
              AllOf(HasSubstr("experiment.yaml:3: gage"), HasSubstr("gauge")));
  EXPECT_THAT(ErrorOf("experiment: 1\nsensors:\n  accelerometer:\n    nois: {}\n"),
              HasSubstr("experiment.yaml:4: sensors.accelerometer.nois"));
  EXPECT_THAT(ErrorOf(std::string(kMinimal) + "limits: { accelerometer.drift: 1 }\n"),
              AllOf(HasSubstr("limits.accelerometer.drift"), HasSubstr("misalignment_rad")));
}

TEST_F(ExperimentConfig, RefusesWhatContradictsItselfWithItsLine) {
  EXPECT_THAT(ErrorOf(std::string(kMinimal) + "limits: { gyroscope.bias: 1 }\n"),
              AllOf(HasSubstr("experiment.yaml:3: limit `gyroscope.bias`"),
                    HasSubstr("no gyroscope is calibrated")));
  EXPECT_THAT(ErrorOf(std::string(kMinimal) + "limits:\n  accelerometer.bias: 1\n"
                                              "  accelerometer.bias_per_degc.x: 0.01\n"),
              AllOf(HasSubstr("experiment.yaml:5: limit `accelerometer.bias_per_degc.x`"),
                    HasSubstr("no temperature terms"),
                    HasSubstr("bias_order")));
  EXPECT_THAT(ErrorOf(std::string(kMinimal) + "cross_validation: { folds: 0 }\n"
                                              "limits: { accelerometer.held_out_rms: 1 }\n"),
              HasSubstr("experiment.yaml:4: limit `accelerometer.held_out_rms`"));
  EXPECT_THAT(
      ErrorOf("experiment: 1\nsensors:\n  accelerometer: { noise: { sigma: 1e-300 } }\n"),
      AllOf(HasSubstr("experiment.yaml:3: accelerometer: every noise sigma"), HasSubstr("1e-30")));
  const std::string compass = "experiment: 1\nsensors: { magnetometer: {} }\n";
  for (const char* limit :
       {"magnetometer.bias", "magnetometer.scale_error", "reference.field_ut"}) {
    const std::string limits = std::string("limits: { ") + limit + ": { upper: 60 } }\n";
    EXPECT_THAT(ErrorOf(compass + limits), HasSubstr("the field strength is unknown")) << limit;
    LoadWell(compass + "reference: { field: { strength_ut: 50 } }\n" + limits);
  }
  LoadWell(
      "experiment: 1\nsensors: { magnetometer: { fixed: { matrix: identity } } }\n"
      "limits: { reference.field_ut: { upper: 60 }, magnetometer.bias: 9 }\n");
  LoadWell(
      "experiment: 1\nposes: { sweep: auto }\n"
      "sensors: { magnetometer: { thermal: { bias_order: 1 } } }\n"
      "limits: { magnetometer.bias_per_degc: 0.1 }\n");
  EXPECT_THAT(ErrorOf(std::string(kMinimal) + "limits: { reference.dip_deg: 60 }\n"),
              HasSubstr("no magnetometer is calibrated"));
  EXPECT_THAT(ErrorOf(std::string(kMinimal) +
                      "limits: { gyroscope.bias: { upper: 1, if_present: true } }\n"),
              HasSubstr("none of the limited quantities"));
  EXPECT_TRUE(
      LoadWell(std::string(kMinimal) + "initialise: { only: true }\n").options.initialise.only);
  EXPECT_THAT(ErrorOf(std::string(kMinimal) +
                      "initialise: { only: true }\nlimits: { accelerometer.bias: 1 }\n"),
              HasSubstr("start values have no σ, without which no limit can be judged"));
  EXPECT_THAT(ErrorOf("experiment: 1\nsensors:\n"
                      "  accelerometer: { fixed: { matrix: identity, bias: [0, 0, 0] } }\n"),
              AllOf(HasSubstr("experiment.yaml:3"), HasSubstr("nothing is left to estimate")));
  const std::string soak =
      "experiment: 1\nsensors: { accelerometer: { thermal: { bias_order: 1 } } }\n";
  LoadWell(soak + "limits: { accelerometer.bias_per_degc: 0.01 }\n");
  LoadWell(std::string(kMinimal) +
           "limits: { accelerometer.bias: 1, gyroscope.bias: { upper: 1, if_present: true } }\n");
}

TEST_F(ExperimentConfig, TakesLimitsOfTwoSidesAndOfSingleAxes) {
  const Experiment experiment =
      LoadWell(std::string(kMinimal) +
               "limits:\n"
               "  accelerometer.bias: 0.5\n"
               "  accelerometer: { bias: { x: { lower: -0.1, upper: 0.3 } } }\n"
               "  accelerometer.scale_error: { lower: -0.1 }\n");
  const auto& limits = experiment.options.limits.limits;
  EXPECT_THAT(limits, SizeIs(3));
  EXPECT_TRUE(limits.at("accelerometer.bias").IsAboutZero());
  EXPECT_EQ(limits.at("accelerometer.bias.x").lower, -0.1);
  EXPECT_EQ(limits.at("accelerometer.bias.x").upper, 0.3);
  EXPECT_TRUE(std::isinf(limits.at("accelerometer.scale_error").upper));
  EXPECT_THAT(
      ErrorOf(std::string(kMinimal) + "limits: { accelerometer.bias: { lower: 2, upper: 1 } }\n"),
      HasSubstr("lower <= target <= upper"));
}

TEST_F(ExperimentConfig, TakesTheLimitsOfEachShippedDataSheetBeforeItsOwn) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(
           std::filesystem::path(TRUETRIAD_SOURCE_DIR) / "configs/limits")) {
    const std::string text = std::string(kMinimal) + "limits: { preset: " + entry.path().string() +
                             ", accelerometer.bias: 0.1 }\n";
    const Experiment experiment = LoadWell(text);
    const auto& limits = experiment.options.limits.limits;
    EXPECT_EQ(limits.at("accelerometer.bias").upper, 0.1);
    EXPECT_FALSE(limits.at("accelerometer.bias").if_present);
    EXPECT_TRUE(limits.at("gyroscope.bias").if_present);
    EXPECT_GT(limits.at("gyroscope.bias").upper, 0.0);
    const Experiment again = LoadWell(experiment.resolved_yaml);
    EXPECT_EQ(again.options.limits.limits.size(), limits.size());
    EXPECT_TRUE(again.options.limits.limits.at("gyroscope.bias").if_present);
    ++count;
  }
  EXPECT_GE(count, 4);
  EXPECT_THAT(ErrorOf(std::string(kMinimal) + "limits: { preset: none.yaml }\n"),
              HasSubstr("none.yaml"));
}

TEST_F(ExperimentConfig, LimitsOfItsOwnTakeThePlaceOfAPresetsOfOtherComponents) {
  Write(
      "limits_preset: 1\n"
      "limits: { accelerometer.bias.x: 1, accelerometer.bias.z: 2, gyroscope.bias: 3,\n"
      "          gyroscope.scale_error: 4 }\n",
      "preset.yaml");
  const auto limits = [&](const std::string& own) {
    std::map<std::string, double> found;
    const Experiment experiment = LoadWell(
        "experiment: 1\nsensors: { accelerometer: {}, gyroscope: {} }\n"
        "limits: { preset: preset.yaml, " +
        own + " }\n");
    for (const auto& [name, limit] : experiment.options.limits.limits) found[name] = limit.upper;
    return found;
  };
  using Limits = std::map<std::string, double>;
  EXPECT_EQ(limits("accelerometer.bias: 9, gyroscope.bias.y: 8"),
            (Limits{{"accelerometer.bias", 9},
                    {"gyroscope.bias.x", 3},
                    {"gyroscope.bias.y", 8},
                    {"gyroscope.bias.z", 3},
                    {"gyroscope.scale_error", 4}}));
  EXPECT_EQ(limits("accelerometer: { bias: { x: 9 } }, gyroscope: { scale_error: { upper: 8 } }"),
            (Limits{{"accelerometer.bias.x", 9},
                    {"accelerometer.bias.z", 2},
                    {"gyroscope.bias", 3},
                    {"gyroscope.scale_error", 8}}));
}

TEST_F(ExperimentConfig, RejectsDuplicateKeyWithItsLine) {
  EXPECT_THAT(ErrorOf(std::string(kMinimal) + "gauge: accel-x\ngauge: accel-z\n"),
              HasSubstr("experiment.yaml:4: gauge"));
}

TEST_F(ExperimentConfig, RejectsWrongTypeAndRangeSayingWhatIsExpected) {
  const auto error = [this](const std::string& line) { return ErrorOf(kMinimal + line); };
  EXPECT_THAT(error("reference: { gravity_mps2: fast }\n"), HasSubstr("not a finite number"));
  EXPECT_THAT(error("reference: { gravity_mps2: 9810 }\n"),
              AllOf(HasSubstr("experiment.yaml:3"), HasSubstr("`9810`"), HasSubstr("9.7 to 9.9")));
  EXPECT_THAT(error("reference: { gravity_mps2: unknown }\n"), HasSubstr("`unknown`"));
  EXPECT_THAT(error("reference: { field: { strength_ut: 0 } }\n"), HasSubstr("a positive number"));
  EXPECT_THAT(error("reference: { field: { strength_ut: .inf } }\n"), Not(HasSubstr("no error")));
  EXPECT_THAT(error("reference: { field: { dip_deg: 91 } }\n"), HasSubstr("-90 to 90"));
  EXPECT_THAT(error("reference: { field: { dip_deg: { sigma: 1 } } }\n"),
              HasSubstr("reference.field.dip_deg: has a sigma but no value"));
  EXPECT_THAT(error("gauge: accel-y\n"), HasSubstr("accel-x, accel-z, symmetric, fixture"));
  EXPECT_THAT(error("poses: { every: 0 }\n"), HasSubstr("at least 1 row"));
  EXPECT_THAT(error("poses: { every: 10, column: pose }\n"), HasSubstr("one of detect"));
  EXPECT_THAT(error("attitudes: {}\n"), HasSubstr("one of six_face, file"));
  EXPECT_THAT(error("cross_validation: { folds: 1 }\n"), HasSubstr("at least 2"));
  EXPECT_THAT(error("observable_sigma: 1\n"), HasSubstr("between 0 and 1"));
  EXPECT_THAT(error("robust:\n"), HasSubstr(": robust: expected a map"));
  EXPECT_THAT(ErrorOf("experiment: 1\nsensors: { accelerometer: { noise: { sigma: [1, 2] } } }\n"),
              HasSubstr("three numbers"));
  EXPECT_THAT(ErrorOf("experiment: 1\nsensors: { magnetometer: { sign: gravity } }\n"),
              HasSubstr("sensors.magnetometer.sign"));
}

TEST_F(ExperimentConfig, ListsAllErrorsAtOnce) {
  EXPECT_THAT(ErrorOf(std::string(kMinimal) + "gauge: left\nrobust: { scale: -1 }\n"),
              AllOf(HasSubstr(":3: gauge"), HasSubstr(":4: robust.scale")));
}

TEST_F(ExperimentConfig, RejectsHalfAPrior) {
  EXPECT_THAT(
      ErrorOf("experiment: 1\nsensors: { accelerometer: { prior: { bias: [0, 0, 0] } } }\n"),
      HasSubstr("prior.bias: belongs together with bias_sigma"));
}

TEST_F(ExperimentConfig, AsksForSensorsAndVersion) {
  EXPECT_THAT(ErrorOf("experiment: 1\n"), HasSubstr("sensors: is missing; list what"));
  EXPECT_THAT(ErrorOf("sensors: { accelerometer: {} }\n"), HasSubstr("experiment: is missing"));
  EXPECT_THAT(ErrorOf("experiment: 2\nsensors: { accelerometer: {} }\n"),
              HasSubstr("reads version 1"));
}

TEST_F(ExperimentConfig, ReadsMotionWithoutRests) {
  const Result<Experiment> experiment = Load(
      "experiment: 1\nsensors: { accelerometer: {}, gyroscope: {} }\n"
      "poses: { motion: { spacing_s: 0.02 } }\n");
  ASSERT_TRUE(experiment) << experiment.error().message;
  EXPECT_EQ(experiment->poses.kind, PoseSelectionKind::kMotion);
  ASSERT_TRUE(experiment->options.motion);
  EXPECT_EQ(experiment->options.motion->spacing_s, 0.02);
  EXPECT_THAT(experiment->resolved_yaml, HasSubstr("spacing_s: 0.02"));
  EXPECT_THAT(ErrorOf("experiment: 1\nsensors: { accelerometer: {} }\n"
                      "poses: { motion: { spacing_s: -1 } }\n"),
              HasSubstr("out of range"));
}

TEST_F(ExperimentConfig, ReadsTheGyroscopeAndKeepsItsMoves) {
  const Result<Experiment> experiment = Load(
      "experiment: 1\nsensors: { accelerometer: { quadratic: true, cubic: auto }, gyroscope: { "
      "g_sensitivity: true, asymmetry: true } }\n");
  ASSERT_TRUE(experiment) << experiment.error().message;
  EXPECT_EQ(experiment->options.triads[Triad::kGyroscope].g_sensitivity, Wanted::kYes);
  EXPECT_TRUE(experiment->poses.moves);
  const Result<Experiment> again = Load(experiment->resolved_yaml);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->options.triads[Triad::kGyroscope].g_sensitivity, Wanted::kYes);
  EXPECT_EQ(again->options.triads[Triad::kGyroscope].axis_terms[AxisTerm::kAsymmetry],
            Wanted::kYes);
  EXPECT_EQ(again->options.triads[Triad::kAccelerometer].axis_terms[AxisTerm::kQuadratic],
            Wanted::kYes);
  EXPECT_EQ(again->options.triads[Triad::kAccelerometer].axis_terms[AxisTerm::kCubic],
            Wanted::kAuto);
  EXPECT_THAT(ErrorOf("experiment: 1\nsensors: { gyroscope: { cubic: true } }\n"),
              HasSubstr("cubic"));
  EXPECT_THAT(ErrorOf("experiment: 1\nsensors: { accelerometer: { g_sensitivity: true } }\n"),
              HasSubstr("g_sensitivity"));
}

TEST_F(ExperimentConfig, ReadsKnownTurnsAndRatesAndResolvesToTheSame) {
  const Experiment experiment = LoadWell(
      "experiment: 1\nsensors: { gyroscope: {} }\n"
      "turns: { file: turns.yaml, sigma_deg: 2, held_out: [a, 'b \"c\"'] }\n"
      "rates: { file: rates.yaml, sigma_degps: 0.1, axis_sigma_deg: 0.3 }\n");
  // The axes of a gyroscope alone are those that are stated.
  EXPECT_EQ(experiment.options.gauge, Gauge::kFixture);
  for (const Experiment& read : {experiment, LoadWell(experiment.resolved_yaml)}) {
    const KnownMotionsConfig& motions = read.poses.known_motions;
    EXPECT_EQ(motions.turns_file, (folder_ / "turns.yaml").string());
    EXPECT_EQ(motions.turn_sigma_deg, 2.0);
    EXPECT_EQ(motions.turn_axis_sigma_deg, 1.0);
    EXPECT_EQ(motions.held_out_turns, (std::vector<std::string>{"a", "b \"c\""}));
    EXPECT_EQ(motions.rates_file, (folder_ / "rates.yaml").string());
    EXPECT_EQ(motions.rate_sigma_degps, 0.1);
    EXPECT_EQ(motions.rate_axis_sigma_deg, 0.3);
  }
  EXPECT_THAT(ErrorOf("experiment: 1\nsensors: { accelerometer: {} }\nrates: { file: a.yaml }\n"),
              HasSubstr("gyroscope, which is not enabled"));
  EXPECT_THAT(ErrorOf("experiment: 1\nsensors: { accelerometer: {}, gyroscope: {} }\n"
                      "poses: { motion: {} }\nturns: { file: a.yaml }\n"),
              HasSubstr("need rests"));
  EXPECT_THAT(ErrorOf("experiment: 1\nsensors: { gyroscope: {} }\nturns: { sigma_deg: 1 }\n"),
              HasSubstr("`file:` with the turns"));
}

TEST_F(ExperimentConfig, ReadsAnUnknownFixtureRotationAndResolvesToTheSame) {
  const Experiment experiment =
      LoadWell(kMinimal + std::string("attitudes: { file: a.csv, fixture_rotation: unknown }\n"));
  EXPECT_TRUE(experiment.options.attitudes.unknown_fixture_rotation);
  EXPECT_TRUE(LoadWell(experiment.resolved_yaml).options.attitudes.unknown_fixture_rotation);
  EXPECT_FALSE(LoadWell(kMinimal + std::string("attitudes: { file: a.csv }\n"))
                   .options.attitudes.unknown_fixture_rotation);
}

TEST_F(ExperimentConfig, AModelThatIsChosenLeavesItsTermsOpenUnlessTheyAreStated) {
  const Experiment experiment = LoadWell(
      "experiment: 1\nsensors: { accelerometer: { model: auto }, gyroscope: { model: auto, "
      "g_sensitivity: false } }\n");
  const TriadOptions& accelerometer = experiment.options.triads[Triad::kAccelerometer];
  const TriadOptions& gyroscope = experiment.options.triads[Triad::kGyroscope];
  EXPECT_EQ(accelerometer.model, MatrixModel::kAuto);
  EXPECT_EQ(accelerometer.axis_terms[AxisTerm::kQuadratic], Wanted::kAuto);
  // Few chips have one: it is asked for by name.
  EXPECT_EQ(accelerometer.axis_terms[AxisTerm::kCubic], Wanted::kNo);
  EXPECT_EQ(gyroscope.g_sensitivity, Wanted::kNo);
  EXPECT_EQ(gyroscope.axis_terms[AxisTerm::kAsymmetry], Wanted::kAuto);
  const Experiment again = LoadWell(experiment.resolved_yaml);
  EXPECT_EQ(again.resolved_yaml.find("chosen"), std::string::npos);
  EXPECT_EQ(again.options.triads[Triad::kGyroscope].axis_terms[AxisTerm::kAsymmetry],
            Wanted::kAuto);
}

TEST_F(ExperimentConfig, ResolvesWhatWasChosenAndSaysSo) {
  const Experiment experiment =
      LoadWell("experiment: 1\nsensors: { accelerometer: { model: auto, quadratic: false } }\n");
  CalibrateOptions chosen = experiment.options;
  chosen.triads[Triad::kAccelerometer].model = MatrixModel::kDiagonal;
  const std::string text = ResolvedWithChoice(experiment, chosen);
  EXPECT_THAT(text, HasSubstr("    model: diagonal  # chosen by auto\n    quadratic: false\n"));
  EXPECT_EQ(LoadWell(text).options.triads[Triad::kAccelerometer].model, MatrixModel::kDiagonal);
}

TEST_F(ExperimentConfig, ResolvesTemperatureTermsAsTheyWereChosen) {
  const Experiment experiment = LoadWell(
      "experiment: 1\nsensors: { accelerometer: { thermal: { bias_order: auto, rate: auto } } }\n");
  CalibrateOptions chosen = experiment.options;
  ThermalOptions& thermal = chosen.triads[Triad::kAccelerometer].thermal;
  thermal = ThermalOptions();
  thermal.bias_order = 2;
  thermal.rate[RateTerm::kLinear] = true;
  const std::string text = ResolvedWithChoice(experiment, chosen);
  EXPECT_THAT(text,
              AllOf(HasSubstr("bias_order: 2  # chosen by auto"),
                    HasSubstr("rate: [linear]  # chosen by auto")));
  EXPECT_FALSE(LoadWell(text).options.HasChoice());
}

TEST_F(ExperimentConfig, ReadsTemperatureTermsAndResolvesToTheSame) {
  const Result<Experiment> experiment = Load(
      "experiment: 1\nsensors:\n  accelerometer:\n"
      "    thermal: { bias_order: 3, matrix_order: 1, matrix: diagonal, rate: [linear, cross] }\n");
  ASSERT_TRUE(experiment) << experiment.error().message;
  const ThermalOptions& thermal = experiment->options.triads[Triad::kAccelerometer].thermal;
  EXPECT_EQ(thermal.bias_order, 3);
  EXPECT_EQ(thermal.matrix_order, 1);
  EXPECT_EQ(thermal.matrix, ThermalMatrix::kDiagonal);
  EXPECT_TRUE(thermal.rate[RateTerm::kLinear] && !thermal.rate[RateTerm::kQuadratic] &&
              thermal.rate[RateTerm::kCross]);
  EXPECT_THAT(experiment->resolved_yaml, HasSubstr("rate: [linear, cross]\n"));
  const Result<Experiment> again = Load(experiment->resolved_yaml);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->resolved_yaml.find("# default"), std::string::npos);
  EXPECT_TRUE(again->options.triads[Triad::kAccelerometer].thermal.rate[RateTerm::kCross]);
}

TEST_F(ExperimentConfig, RejectsTemperatureTermsThatDoNotExistWithTheirLines) {
  EXPECT_THAT(
      ErrorOf("experiment: 1\nsensors:\n  accelerometer:\n    thermal:\n      bias_order: 8\n"
              "      matrix_order: -1\n      matrix: upper\n      rate: [cubic]\n      order: 3\n"),
      AllOf(HasSubstr(":5: sensors.accelerometer.thermal.bias_order: `8` is out of range; expected "
                      "an order "
                      "of 0 (none) to 7, or auto"),
            HasSubstr(
                ":6: sensors.accelerometer.thermal.matrix_order: `-1` is out of range; expected "
                "an order of 0 (none) to 3, or auto"),
            HasSubstr(":7: sensors.accelerometer.thermal.matrix"),
            HasSubstr("`cubic` is unknown; expected one of linear, quadratic, cross"),
            HasSubstr("thermal.order")));
}

TEST_F(ExperimentConfig, AppliesOverridesBeforeChecking) {
  const Experiment experiment =
      LoadWell("experiment: 1\nsensors: { accelerometer: { model: auto } }\ngauge: left\n",
               {"gauge=accel-z", "sensors.accelerometer.model=full"});
  EXPECT_EQ(experiment.options.gauge, Gauge::kAccelZ);
  EXPECT_EQ(experiment.options.triads[Triad::kAccelerometer].model, MatrixModel::kFull);
}

TEST_F(ExperimentConfig, AppliesOverridesOfNestedKeys) {
  const Experiment experiment = LoadWell(kEverything,
                                         {"reference.gravity_mps2.sigma=2e-4",
                                          "reference.field.dip_deg=unknown",
                                          "sensors.accelerometer.noise.sigma=[4, 5, 6]",
                                          "limits.accelerometer.bias=0.25",
                                          "limits.decision=simple",
                                          "robust=huber",
                                          "device.serial=B=2"});
  EXPECT_EQ(experiment.options.reference.gravity_mps2.value, 9.81);
  EXPECT_EQ(experiment.options.reference.gravity_mps2.sigma, 2e-4);
  EXPECT_FALSE(experiment.options.reference.dip_rad.known());
  EXPECT_EQ(experiment.options.triads[Triad::kAccelerometer].noise_sigma_raw,
            Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(experiment.options.limits.limits.at("accelerometer.bias").upper, 0.25);
  EXPECT_EQ(experiment.options.limits.guard_band_k, 0.0);
  EXPECT_TRUE(experiment.options.robust.enabled);
  EXPECT_EQ(experiment.serial, "B=2");
}

TEST_F(ExperimentConfig, TakesSensorsAsAWholeForThoseAlone) {
  const std::string text =
      "experiment: 1\nsensors: { accelerometer: {}, magnetometer: { model: diagonal } }\n"
      "limits: { accelerometer.bias: 1, magnetometer.bias: 2 }\n"
      "reference: { field: { strength_ut: 50 } }\n";
  const CalibrateOptions options = LoadWell(text, {"sensors={ magnetometer: {} }"}).options;
  EXPECT_FALSE(options.triads[Triad::kAccelerometer].enabled);
  EXPECT_EQ(options.triads[Triad::kMagnetometer].model, MatrixModel::kDiagonal);
  EXPECT_THAT(options.limits.limits, SizeIs(1));
  EXPECT_TRUE(
      LoadWell(text, {"sensors.magnetometer={}"}).options.triads[Triad::kAccelerometer].enabled);
  EXPECT_THAT(ErrorOf(text, {"sensors={}"}), HasSubstr("sensors: is missing; list what"));
}

TEST_F(ExperimentConfig, NamesTheOverrideInsteadOfALine) {
  EXPECT_THAT(
      ErrorOf(kMinimal, {"robust.scal=2"}),
      AllOf(HasSubstr("--set=robust.scal=2: robust.scal"), Not(HasSubstr("experiment.yaml"))));
  EXPECT_THAT(ErrorOf(kMinimal, {"gauge=left"}), HasSubstr("--set=gauge=left: gauge"));
  EXPECT_THAT(ErrorOf(kMinimal, {"sensors.gyroscope.model=left"}), HasSubstr("--set=sensors.gyr"));
  EXPECT_THAT(ErrorOf(kMinimal, {"gauge"}), HasSubstr("key.sub=value"));
  EXPECT_THAT(ErrorOf(kMinimal, {"gauge=[1"}), HasSubstr("--set=gauge=[1"));
}

TEST_F(ExperimentConfig, LaysTheExperimentOverItsPreset) {
  Write("sensor_preset: 1\naccelerometer: { model: diagonal, noise: { sigma: 0.5 } }\n",
        "preset.yaml");
  const TriadOptions options =
      LoadWell(
          "experiment: 1\n"
          "sensors: { accelerometer: { model: symmetric, preset: preset.yaml } }\n")
          .options.triads[Triad::kAccelerometer];
  EXPECT_EQ(options.model, MatrixModel::kSymmetric);
  EXPECT_EQ(options.noise_sigma_raw, Eigen::Vector3d::Constant(0.5));
}

TEST_F(ExperimentConfig, ReadsPresetsAsStrictly) {
  const std::string path =
      Write("sensor_preset: 1\naccelerometer:\n  model: lopsided\n  sgn: gravity\n", "preset.yaml");
  const std::string head = "experiment: 1\nsensors: ";
  EXPECT_THAT(ErrorOf(head + "{ accelerometer: { preset: preset.yaml } }\n"),
              AllOf(HasSubstr("preset.yaml:3: accelerometer.model"),
                    HasSubstr("preset.yaml:4: accelerometer.sgn")));
  EXPECT_THAT(ErrorOf(head + "{ magnetometer: { preset: preset.yaml } }\n"),
              HasSubstr("magnetometer: is missing"));
  EXPECT_THAT(ErrorOf(head + "{ magnetometer: { preset: none.yaml } }\n"), HasSubstr("none.yaml"));
}

TEST_F(ExperimentConfig, LeavesTemperatureTermsOfPosesOpen) {
  const Experiment experiment = LoadWell(
      "experiment: 1\nsensors: { accelerometer: { thermal: { bias_order: auto, matrix_order: auto, "
      "matrix: auto, rate: auto } } }\n");
  const ThermalOptions& thermal = experiment.options.triads[Triad::kAccelerometer].thermal;
  EXPECT_TRUE(thermal.bias_order_auto && thermal.matrix_order_auto && thermal.matrix_auto);
  EXPECT_TRUE(thermal.rate_auto);
  EXPECT_EQ(thermal.bias_order, ThermalOptions::kMaxBiasOrder);
  EXPECT_EQ(thermal.matrix_order, ThermalOptions::kMaxMatrixOrder);
  EXPECT_TRUE(experiment.options.HasChoice());
  EXPECT_THAT(experiment.resolved_yaml,
              AllOf(HasSubstr("bias_order: auto"),
                    HasSubstr("matrix_order: auto"),
                    HasSubstr("matrix: auto"),
                    HasSubstr("rate: auto")));
}

TEST_F(ExperimentConfig, ReadsTemperatureSweeps) {
  const std::string sensors =
      "experiment: 1\nsensors: { gyroscope: { thermal: { bias_order: auto, rate: auto, lag: 2 } } "
      "}\n";
  const Experiment experiment = LoadWell(sensors + "poses: { sweep: { window_s: 10 } }\n");
  EXPECT_EQ(experiment.poses.kind, PoseSelectionKind::kSweep);
  EXPECT_EQ(experiment.poses.sweep.window_s, 10.0);
  ASSERT_TRUE(experiment.options.sweep);
  EXPECT_EQ(experiment.options.cross_validation_folds, 14);
  const ThermalOptions& thermal = experiment.options.triads[Triad::kGyroscope].thermal;
  EXPECT_TRUE(thermal.bias_order_auto && thermal.rate_auto && !thermal.lags_auto);
  EXPECT_EQ(thermal.lags, 2);
  // What it resolves to says the same.
  EXPECT_THAT(experiment.resolved_yaml,
              AllOf(HasSubstr("bias_order: auto"),
                    HasSubstr("rate: auto"),
                    HasSubstr("lag: 2"),
                    HasSubstr("window_s: 10"),
                    HasSubstr("folds: 14")));
  EXPECT_EQ(LoadWell(experiment.resolved_yaml).resolved_yaml.find("detect"), std::string::npos);
  EXPECT_THAT(experiment.resolved_yaml, HasSubstr("temperature_degc"));
  // The reference temperature is that of the static calibration.
  const std::string with_static = sensors + "poses: { sweep: auto }\nstatic: a.yaml\n";
  EXPECT_THAT(LoadWell(with_static).resolved_yaml,
              AllOf(HasSubstr("static: \"a.yaml\""), Not(HasSubstr("temperature_degc"))));
  EXPECT_THAT(LoadWell(with_static + "reference: { temperature_degc: 20 }\n").resolved_yaml,
              HasSubstr("temperature_degc: 20"));
  EXPECT_THAT(ErrorOf(sensors), HasSubstr("knots, lags and a regression need a sweep"));
  EXPECT_THAT(ErrorOf(sensors + "poses: { sweep: { window_s: 10, window_samples: 5 } }\n"),
              HasSubstr("exclude each other"));
  EXPECT_THAT(ErrorOf(sensors + "poses: { sweep: hourly }\n"), HasSubstr("expected `auto`"));
  EXPECT_THAT(ErrorOf(sensors + "poses: { sweep: auto }\nattitudes: { six_face: {} }\n"),
              HasSubstr("apply to poses"));
  EXPECT_THAT(ErrorOf("experiment: 1\nsensors: { accelerometer: {} }\nstatic: a.yaml\n"),
              HasSubstr("static: applies only to"));
}

TEST(ShippedConfigs, Load) {
  int count = 0;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(ConfigFolder() / "experiments")) {
    if (entry.is_directory()) continue;
    const Result<Experiment> experiment = ReadExperiment(entry.path().string());
    EXPECT_TRUE(experiment) << experiment.error().message;
    ++count;
  }
  EXPECT_GE(count, 20);
  const Result<Experiment> unit = ReadExperiment((ConfigFolder() / "templates/unit.yaml").string());
  EXPECT_TRUE(unit) << unit.error().message;
}

TEST_F(ExperimentConfig, LoadsEveryShippedPresetForEachSensorThatItDescribes) {
  for (const auto& [file, sensor] : {std::pair("mpu-9250-like.yaml", "accelerometer"),
                                     std::pair("mpu-9250-like.yaml", "magnetometer"),
                                     std::pair("mti-like-counts.yaml", "accelerometer")}) {
    const Experiment experiment =
        LoadWell("experiment: 1\nsensors: { " + std::string(sensor) + ": { preset: \"" +
                 (ConfigFolder() / "sensors" / file).string() + "\" } }\n");
    EXPECT_TRUE(experiment.options.triads[*TriadFromName(sensor)].noise_sigma_raw);
  }
}

}  // namespace experiment_test
}  // namespace truetriad
