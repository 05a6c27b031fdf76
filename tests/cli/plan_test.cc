// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "io/pose_program_file.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace plan_test {

using ::testing::AllOf;
using ::testing::DoubleNear;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PlanVerb : public ::testing::Test {
 protected:
  // An accelerometer of known noise with this `plan:` block.
  std::string Experiment(const std::string& plan, const std::string& noise = "{ sigma: 0.003 }") {
    return folder_.Write("plan.yaml",
                         "experiment: 1\nreference: { gravity_mps2: 9.80665 }\n"
                         "sensors: { accelerometer: { noise: " +
                             noise + " } }\nplan: " + plan + "\n");
  }

  TemporaryFolder folder_;
};

TEST_F(PlanVerb, WritesAProgramWithPicturesAndPredictsItsSigmas) {
  const Finished run = RunTruetriad({"plan",
                                     "--config=" + Experiment("{ poses: 12, rotations: hand }"),
                                     "--output=" + folder_.Path("out")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("GOOD PLAN"),
                    HasSubstr("accelerometer bias x"),
                    HasSubstr("x up, z 45 deg above level"),
                    HasSubstr("state plan.rest_s"),
                    HasSubstr("Assumed noise"),
                    HasSubstr("as stated in the configuration"),
                    HasSubstr("would give the same")));
  const auto program = ReadPoseProgram(folder_.Path("out/program.yaml"));
  ASSERT_TRUE(program) << program.error().message;
  EXPECT_EQ(program->poses.size(), 12U);
  const std::string page = TemporaryFolder::Read(folder_.Path("out/program.html"));
  EXPECT_THAT(page, AllOf(HasSubstr("pose 12"), HasSubstr("<svg"), HasSubstr("</html>")));
}

TEST_F(PlanVerb, SaysHowLongToRestOnThePageToo) {
  const std::string plan = "{ poses: 12, rotations: hand, random: 0, rest_s: 7.5 }";
  const Finished run =
      RunTruetriad({"plan", "--config=" + Experiment(plan), "--output=" + folder_.Path("out")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::string rest = "rest for 7.5 s in each pose";
  EXPECT_THAT(run.out, HasSubstr(rest));
  EXPECT_THAT(TemporaryFolder::Read(folder_.Path("out/program.html")),
              AllOf(HasSubstr(rest), HasSubstr("Assumed noise"), HasSubstr("0.003")));
}

TEST_F(PlanVerb, JudgesTheProgramThatItWroteAsItWasPredicted) {
  const std::string config = Experiment("{ poses: 12, rotations: hand, random: 0 }");
  const Finished made =
      RunTruetriad({"plan", "--config=" + config, "--output=" + folder_.Path("out")});
  const Finished judged =
      RunTruetriad({"plan", "--config=" + config, "--program=" + folder_.Path("out/program.yaml")});
  EXPECT_EQ(judged.exit_code, 0) << judged.err;
  const std::string predicted = made.out.substr(made.out.find("Predicted"));
  EXPECT_THAT(predicted, HasSubstr(judged.out.substr(judged.out.find("Predicted"))));
}

TEST_F(PlanVerb, ExitsWithThreeWhenAProgramCannotSeeEverything) {
  PoseProgram level;
  for (int k = 0; k < 12; ++k) {
    const Eigen::Quaterniond x_up(Eigen::AngleAxisd(-1.5707963267948966, Eigen::Vector3d::UnitY()));
    level.poses.push_back(
        {x_up * Eigen::AngleAxisd(0.5 * k, Eigen::Vector3d::UnitZ()), {}, "z level"});
  }
  const std::string program = folder_.Write("level.yaml", PoseProgramToYaml(level));
  const Finished run =
      RunTruetriad({"plan", "--config=" + Experiment("{ poses: 12 }"), "--program=" + program});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("NOT ENOUGH"), HasSubstr("scale z"), HasSubstr("add poses")));
}

TEST_F(PlanVerb, ExitsWithThreeWhenWantedSigmasAreOutOfReach) {
  const Finished run = RunTruetriad(
      {"plan",
       "--config=" + Experiment("{ wanted: { accelerometer.bias: 1.0e-5 }, max_poses: 15 }")});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.out, AllOf(HasSubstr("NOT AS GOOD AS WANTED"), HasSubstr("FAIL")));
}

TEST_F(PlanVerb, RefusesWhatItCannotPlanFor) {
  const Finished no_noise =
      RunTruetriad({"plan", "--config=" + Experiment("{ poses: 12 }", "{ excess: none }")});
  EXPECT_EQ(no_noise.exit_code, 2);
  EXPECT_THAT(no_noise.err, HasSubstr("noise is unknown"));

  const Finished no_gain =
      RunTruetriad({"plan",
                    "--config=" + Experiment("{ poses: 12, nominal: { accelerometer: { "
                                             "unit: counts } } }")});
  EXPECT_EQ(no_gain.exit_code, 2);
  EXPECT_THAT(no_gain.err, HasSubstr("sensitivity: 400"));

  const Finished no_plan = RunTruetriad(
      {"plan", "--config=" + folder_.Write("experiment.yaml", kAccelerometerExperiment)});
  EXPECT_EQ(no_plan.exit_code, 1);
  EXPECT_THAT(no_plan.err, HasSubstr("plan:"));

  const Finished no_count = RunTruetriad({"plan", "--config=" + Experiment("{ rotations: hand }")});
  EXPECT_EQ(no_count.exit_code, 1);
  EXPECT_THAT(no_count.err, HasSubstr("number of poses"));
}

// Planned with the noise that the simulator draws: means of 400 samples of 0.03 m/s^2 and 0.4 uT.
constexpr char kLoopExperiment[] = R"(experiment: 1
reference: { gravity_mps2: 9.80665, field: { strength_ut: 48, dip_deg: unknown } }
sensors:
  accelerometer: { noise: { sigma: 0.0015, excess: none } }
  magnetometer: { noise: { sigma: 0.02, excess: none } }
plan: { poses: 12, rotations: { spread: 300 }, nominal: { dip_deg: 60 }, random: 0 }
)";
constexpr char kLoopScenario[] = R"(scenario: 1
seed: 11
world: { field: { strength_ut: 48, dip_deg: 60 } }
sensors:
  accelerometer:
    bias_mps2: [0.3, -0.1, 0.2]
    sensitivity: [[1.03, 0, 0], [0.01, 0.97, 0], [-0.01, 0.01, 1.02]]
    noise: { sample_sigma_mps2: 0.03 }
    sampling: { rate_hz: 100 }
  magnetometer:
    bias_ut: [12, -31, 8]
    sensitivity: [[1.06, 0.01, -0.01], [-0.01, 0.95, 0.01], [0.01, -0.01, 1.02]]
    noise: { sample_sigma_ut: 0.4 }
    sampling: { rate_hz: 100 }
motion: [{ poses: { attitudes: { file: out/program.yaml }, rest_s: 4, rest_spread: 0 } }]
)";

// The sigma of a table row "accelerometer bias x   0.00149   m/s^2", in the unit of the row.
double PrintedSigma(const std::string& text, const std::string& row) {
  const std::size_t at = text.find("  " + row + "  ");
  EXPECT_NE(at, std::string::npos) << row;
  return at == std::string::npos ? 0.0 : std::stod(text.substr(at + row.size() + 4));
}

// What a calibration states over what its plan promised, for each parameter.
std::vector<double> StatedOverPlanned(const std::string& plan, const Calibration& calibration) {
  const NamedCovariance& covariance = calibration.covariance;
  std::vector<double> ratios;
  for (std::size_t p = 0; p < covariance.parameters.size(); ++p) {
    const auto at = static_cast<Eigen::Index>(p);
    const double sigma = std::sqrt(covariance.matrix(at, at));
    if (sigma == 0.0) continue;  // fixed by the gauge
    const std::string& name = covariance.parameters[p];
    if (name == "reference.dip_rad") {
      ratios.push_back(1e3 * sigma / PrintedSigma(plan, "reference dip"));
      continue;
    }
    const std::string sensor = name.substr(0, name.find('.'));
    const std::string axes = name.substr(name.rfind('.') + 1);
    const int row = axes[0] - 'x';
    const double relative =
        sigma / calibration.sensors[*TriadFromName(sensor)]->model.sensitivity(row, row);
    if (axes.size() == 1) {
      ratios.push_back(relative / PrintedSigma(plan, sensor + " bias " + axes));
    } else if (axes[0] == axes[1]) {
      ratios.push_back(1e2 * relative / PrintedSigma(plan, sensor + " scale " + axes[0]));
    } else {
      ratios.push_back(1e3 * relative / PrintedSigma(plan, sensor + " misalignment " + axes));
    }
  }
  return ratios;
}

TEST_F(PlanVerb, ForetellsTheSigmasThatTheCalibrationOfItsProgramStates) {
  const std::string config = "--config=" + folder_.Write("loop.yaml", kLoopExperiment);
  const Finished plan = RunTruetriad({"plan", config, "--output=" + folder_.Path("out")});
  ASSERT_EQ(plan.exit_code, 0) << plan.err;
  const Finished simulated =
      RunTruetriad({"simulate",
                    "--config=" + folder_.Write("scenario.yaml", kLoopScenario),
                    "--output=" + folder_.Path("unit")});
  ASSERT_EQ(simulated.exit_code, 0) << simulated.err;

  struct Case {
    const char* set;
    double tolerance;
  };
  // Stated noise is raw and was planned for gains of 1: they are off by up to 6 %, axes by 1 %.
  // Noise from the rests: the variance from 12 * 390 samples gives sigma to 1 %, the axes change it
  // by another 1 or 2 %, and detection may keep a window of 0.1 s of the 4 s for itself at either
  // end, another 2.5 %.
  for (const auto& [set, tolerance] :
       {Case{"gauge=accel-x", 0.08} /* as planned */,
        Case{"sensors.accelerometer.noise.sigma=auto,sensors.magnetometer.noise.sigma=auto",
             0.05}}) {
    const Finished calibrated = RunTruetriad({"calibrate",
                                              config,
                                              "--input=" + folder_.Path("unit/recording.yaml"),
                                              "--output=" + folder_.Path("result"),
                                              std::string("--set=") + set});
    EXPECT_EQ(calibrated.exit_code, 0) << calibrated.out << calibrated.err;
    const auto calibration = ReadCalibration(folder_.Path("result/calibration.yaml"));
    ASSERT_TRUE(calibration) << calibration.error().message;
    const std::vector<double> ratios = StatedOverPlanned(plan.out, *calibration);
    EXPECT_EQ(ratios.size(), 22U);
    EXPECT_THAT(ratios, Each(DoubleNear(1.0, tolerance))) << set;
  }
}

TEST_F(PlanVerb, JudgesASinglePoseWithoutALabel) {
  const std::string program =
      folder_.Write("one.yaml", "program: 1\nposes: [{ attitude: [1, 0, 0, 0] }]\n");
  const Finished run =
      RunTruetriad({"plan", "--config=" + Experiment("{ poses: 12 }"), "--program=" + program});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("1 pose does not make every enabled parameter observable"),
                    HasSubstr("z up, x to the north   –"),
                    HasSubstr("z up, x to the north")));
}

// The same file plans, and then calibrates.
TEST_F(PlanVerb, CompletesARecordingThatTheSameFileCalibrates) {
  const std::string config = "--config=configs/plans/complete-recording.yaml";
  const Finished plan = RunTruetriad({"plan", config});
  EXPECT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.out, AllOf(HasSubstr("in addition to the"), HasSubstr("before")));
  const Finished calibrated =
      RunTruetriad({"calibrate", config, "--output=" + folder_.Path("out")});
  EXPECT_EQ(calibrated.exit_code, 0) << calibrated.err;
}

}  // namespace plan_test
}  // namespace truetriad
