// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "accuracy/shared_recordings.h"
#include "init/frame_alignment.h"
#include "truetriad/base/triad.h"
#include "truetriad/io/recording.h"

namespace truetriad {
namespace joint_test {

/// The calibrated readings of both triads at one pose, in one frame.
struct Pair {
  Eigen::Vector3d force;
  Eigen::Vector3d field;
};

double MeanOf(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// Standard deviation of the angle between field and gravity over the pairs.
double AngleSpreadDeg(const std::vector<Pair>& pairs) {
  std::vector<double> angles;
  for (const Pair& pair : pairs) {
    angles.push_back(std::atan2(pair.force.cross(pair.field).norm(), pair.force.dot(pair.field)) *
                     kDegPerRad);
  }
  const double mean = MeanOf(angles);
  std::vector<double> squares;
  for (const double angle : angles) squares.push_back((angle - mean) * (angle - mean));
  return std::sqrt(MeanOf(squares));
}

/// Mean square angle, in deg², of the instrument's pointing axis against its mean direction within
/// each roll group (poses 8..15 and 16..23, 0-based), in the world that gravity and field define.
/// The axis is the body direction that stays put best, the same for both groups.
double RollGroupMeanSquareDeg2(const std::vector<Pair>& pairs) {
  constexpr std::size_t kGroups[] = {8, 16};
  constexpr std::size_t kGroupSize = 8;
  std::vector<Eigen::Matrix3d> world_from_body;
  for (const Pair& pair : pairs) {
    world_from_body.push_back(
        TriadAttitude(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX(), pair.force, pair.field)
            .toRotationMatrix());
  }
  // The axis p with the largest sum over groups of |sum of R p|².
  Eigen::Matrix3d constancy = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Matrix3d> sums;
  for (const std::size_t first : kGroups) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (std::size_t k = first; k < first + kGroupSize; ++k) sum += world_from_body.at(k);
    constancy += sum.transpose() * sum;
    sums.push_back(sum);
  }
  const Eigen::Vector3d axis =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(constancy).eigenvectors().col(2);
  std::vector<double> squares;
  for (std::size_t group = 0; group < std::size(kGroups); ++group) {
    const Eigen::Vector3d mean = (sums[group] * axis).normalized();
    for (std::size_t k = kGroups[group]; k < kGroups[group] + kGroupSize; ++k) {
      const Eigen::Vector3d pointing = world_from_body[k] * axis;
      const double angle = std::atan2(pointing.cross(mean).norm(), pointing.dot(mean));
      squares.push_back(angle * angle * kDegPerRad * kDegPerRad);
    }
  }
  return MeanOf(squares);
}

std::vector<Pair> PairsOf(const PoseSet& poses, const Calibration& calibration) {
  std::vector<Pair> pairs;
  for (const StaticPose& pose : poses.poses) {
    const auto truth = [&](Triad triad) {
      return calibration.sensors[triad]->model.TruthFromRaw(pose.triads[triad]->mean_raw);
    };
    pairs.push_back({truth(Triad::kAccelerometer), truth(Triad::kMagnetometer)});
  }
  return pairs;
}

class JointRecordings : public SharedRecordings {};

class SapUnits : public SharedRecordings {
 protected:
  void SetUp() override {
    SharedRecordings::SetUp();
    if (IsSkipped()) return;
    if (!MakeTables()) GTEST_SKIP() << "no python3 to convert the JSON files with";
  }

  Outcomes RunUnit(const std::string& unit, const std::string& set = "") {
    Outcomes run = Run(unit.substr(0, 4), Table(unit), set);
    EXPECT_EQ(run.exit_code, 0) << unit << run.text;
    return run;
  }

  PoseSet PosesOf(const std::string& unit) const {
    Result<PoseTable> table = ReadPoseTable(Table(unit));
    EXPECT_TRUE(table) << unit;
    return table->poses;
  }

  static YAML::Node Reference(const std::string& unit) {
    return YAML::LoadFile(ReferenceFile())[unit];
  }

  /// The reference's calibrated readings: own-norm fits and a rotation of three parameters.
  static std::vector<Pair> ReferencePairs(const std::string& unit, const PoseSet& poses) {
    const ReferenceFit force = ReadReferenceFit(ReferenceFile(), {unit, "acc"});
    const ReferenceFit field = ReadReferenceFit(ReferenceFile(), {unit, "mag"});
    const YAML::Node rotation = Reference(unit)["mag_to_acc"]["rotation_vector_deg_mag_to_acc"];
    const Eigen::Vector3d vector =
        Eigen::Vector3d(
            rotation[0].as<double>(), rotation[1].as<double>(), rotation[2].as<double>()) /
        kDegPerRad;
    const Eigen::Matrix3d force_from_field =
        Eigen::AngleAxisd(vector.norm(), vector.normalized()).toRotationMatrix();
    // The reference fitted SAP6 after the device's axis maps "-y-x+z" and "+x+y-z".
    Eigen::Matrix3d force_map = Eigen::Matrix3d::Identity();
    Eigen::Matrix3d field_map = Eigen::Matrix3d::Identity();
    if (unit.starts_with("sap6")) {
      force_map << 0, -1, 0, -1, 0, 0, 0, 0, 1;
      field_map.diagonal() << 1, 1, -1;
    }
    std::vector<Pair> pairs;
    for (const StaticPose& pose : poses.poses) {
      const auto raw = [&](Triad triad) { return pose.triads[triad]->mean_raw; };
      pairs.push_back(
          {force.matrix * (force_map * raw(Triad::kAccelerometer) - force.bias),
           force_from_field * field.matrix * (field_map * raw(Triad::kMagnetometer) - field.bias)});
    }
    return pairs;
  }

  static const std::vector<std::string>& Units() {
    static const std::vector<std::string> units = {"sap5_ab",
                                                   "sap5_ai",
                                                   "sap5_bh",
                                                   "sap5_bi",
                                                   "sap5_ee",
                                                   "sap6_BB",
                                                   "sap6_CF",
                                                   "sap6_HC",
                                                   "sap6_HC_improved"};
    return units;
  }

 private:
  static std::string ReferenceFile() { return File("a-sap-acc-mag-24pose/reference.json"); }
};

TEST_F(SapUnits, KeepTheAngleBetweenFieldAndGravityBetterThanTheReference) {
  for (const std::string& unit : Units()) {
    const PoseSet poses = PosesOf(unit);
    const double spread = AngleSpreadDeg(PairsOf(poses, RunUnit(unit).calibration));
    const double stated = Reference(unit)["mag_to_acc"]["angle_std_after_deg"].as<double>();
    // Checks that the reference is read as it was meant, to the six digits of its readings.
    EXPECT_NEAR(AngleSpreadDeg(ReferencePairs(unit, poses)), stated, 1e-4) << unit;
    // If a fault is corrected, the raw readings are no longer those that fit best.
    const bool is_corrected =
        Find(RunUnit(unit).calibration.findings, FindingCode::kFault) != nullptr;
    EXPECT_TRUE(is_corrected || spread < stated) << unit << " " << spread;
  }
}

TEST_F(SapUnits, KeepThePointingAxisInRollGroupsBetterThanTheReferencePooledOverUnits) {
  std::vector<double> ours;
  std::vector<double> reference;
  for (const std::string& unit : Units()) {
    const PoseSet poses = PosesOf(unit);
    ours.push_back(RollGroupMeanSquareDeg2(PairsOf(poses, RunUnit(unit).calibration)));
    reference.push_back(RollGroupMeanSquareDeg2(ReferencePairs(unit, poses)));
    RecordProperty(unit, std::to_string(std::sqrt(ours.back())));
    RecordProperty(unit + "_reference", std::to_string(std::sqrt(reference.back())));
  }
  EXPECT_LT(std::sqrt(MeanOf(ours)), std::sqrt(MeanOf(reference)));
}

TEST_F(SapUnits, OfTheNewerMakeHaveTheDevicesOwnAxisMap) {
  // The device takes (-y, -x, z) of the accelerometer and (x, y, -z) of the magnetometer as one
  // frame. In the accelerometer's own axes, which are our body's, the magnetometer's axes are
  // then -y, -x and -z.
  Eigen::Matrix3d map;
  map << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  for (const std::string& unit : Units()) {
    if (!unit.starts_with("sap6")) continue;
    const Outcomes run = RunUnit(unit);
    const Eigen::Matrix3d S = run.calibration.sensors[Triad::kMagnetometer]->model.sensitivity;
    EXPECT_GT(S.determinant(), 0.0) << unit;
    // Gains are near one and cross-axis terms small against it, so rounding leaves the map.
    EXPECT_EQ(S.array().round().matrix(), map) << unit << "\n" << S;
  }
}

TEST_F(SapUnits, OfTheOlderMakeReportGravityToo) {
  // The instruments work in the north, where the field dips; right-handed axes then settle the
  // sign of the accelerometer.
  for (const std::string& unit : Units()) {
    if (!unit.starts_with("sap5")) continue;
    const auto determinant = [](const Outcomes& run) {
      return run.calibration.sensors[Triad::kMagnetometer]->model.sensitivity.determinant();
    };
    EXPECT_GT(determinant(RunUnit(unit)), 0.0) << unit;
    const Outcomes opposite = RunUnit(unit, "sensors.accelerometer.sign=specific_force");
    EXPECT_LT(determinant(opposite), 0.0) << unit;
    EXPECT_THAT(opposite.text, ::testing::HasSubstr("left-handed")) << unit;
  }
}

// Every fourth row, as the reference took them: neighbours say much the same.
TEST_F(JointRecordings, AMagnetometerTumbledWithoutRestsIsAlignedToItsAccelerometer) {
  const std::string log = "a-ck-160pose-and-accmag-tumble/acc_mag_log.csv";
  std::ifstream all(File(log));
  std::string rows;
  std::string line;
  for (int number = 0; std::getline(all, line); ++number) {
    if (number == 0 || number % 4 == 1) rows += line + '\n';
  }
  const std::string thinned = work().Path("thinned");
  std::filesystem::create_directories(std::filesystem::path(thinned + "/" + log).parent_path());
  work().Write("thinned/" + log, rows);
  const std::string manifest = Manifest("ck-tumble", thinned);
  const Outcomes run = Run("ck-tumble", manifest);
  ASSERT_EQ(run.exit_code, 0) << run.text;
  EXPECT_EQ(run.calibration.quality.poses, 3000);

  const std::string reference = File("a-ck-160pose-and-accmag-tumble/reference.json");
  const double field_ut = *run.calibration.reference.field_ut;
  const ReferenceFit fit = ReadReferenceFit(reference, {"acc_mag_log_mag"});
  // The fit weighs angles to the accelerometer, too, so its norm residual is not the smallest: 1 %.
  EXPECT_LT(*run.calibration.quality.residual_rms[Triad::kMagnetometer] / field_ut,
            1.01 * fit.rms_after / fit.target_norm);

  const Result<std::unique_ptr<SampleSource>> source = OpenRecording(manifest);
  ASSERT_TRUE(source);
  PoseSelection every_row;
  every_row.kind = PoseSelectionKind::kEveryRow;
  const Result<PoseSet> poses = CollectPoses(**source, every_row);
  ASSERT_TRUE(poses);
  // Rows in which motion adds little to gravity, as the reference chose them.
  std::vector<Pair> calm;
  for (const Pair& pair : PairsOf(*poses, run.calibration)) {
    if (std::abs(pair.force.norm() / 9.80665 - 1.0) < 0.02) calm.push_back(pair);
  }
  const YAML::Node stated = YAML::LoadFile(reference)["mag_to_acc"];
  EXPECT_LT(AngleSpreadDeg(calm), stated["angle_std_after_deg"].as<double>());
}

/// Squares of a tumbling unit's errors: biases of accelerometer, gyroscope and magnetometer, and
/// the magnetometer's matrix. Each parameter is within 4.5 σ of the truth.
Eigen::Array4d SquaredErrors(const Calibration& calibration, const std::string& truth_file) {
  const YAML::Node truth = YAML::LoadFile(truth_file);
  const auto bias = [&](const char* key) {
    const auto values = truth[key].as<std::vector<double>>();
    return Eigen::Vector3d(values[0], values[1], values[2]);
  };
  Eigen::Matrix3d D;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) D(i, j) = truth["D"][i][j].as<double>();
  }
  const auto model = [&](Triad triad) { return calibration.sensors[triad]->model; };
  const Eigen::Vector3d accelerometer = model(Triad::kAccelerometer).bias - bias("acc_bias");
  const Eigen::Vector3d gyroscope = model(Triad::kGyroscope).bias - bias("gyro_bias");
  const Eigen::Vector3d magnetometer = model(Triad::kMagnetometer).bias - bias("mag_bias");
  const Eigen::Matrix3d matrix = model(Triad::kMagnetometer).sensitivity - D;
  for (std::size_t i = 0; i < calibration.covariance.parameters.size(); ++i) {
    const std::string& name = calibration.covariance.parameters[i];
    const auto axis = [](char letter) { return std::string("xyz").find(letter); };
    double error = 0.0;
    if (name.starts_with("accelerometer.bias.")) error = accelerometer[axis(name.back())];
    if (name.starts_with("gyroscope.bias.")) error = gyroscope[axis(name.back())];
    if (name.starts_with("magnetometer.bias.")) error = magnetometer[axis(name.back())];
    if (name.starts_with("magnetometer.sensitivity.")) {
      error = matrix(axis(name[name.size() - 2]), axis(name.back()));
    }
    const auto at = static_cast<Eigen::Index>(i);
    EXPECT_LT(std::abs(error), 4.5 * std::sqrt(calibration.covariance.matrix(at, at)) + 1e-12)
        << truth_file << " " << name;
  }
  return {accelerometer.squaredNorm(),
          gyroscope.squaredNorm(),
          magnetometer.squaredNorm(),
          matrix.squaredNorm()};
}

// The bounds are the errors of the repository's own solver, which starts near the truth.
TEST_F(JointRecordings, ATumbleOfAPublicSimulatorIsCalibratedBetterThanByItsOwnSolver) {
  Eigen::Array4d sum = Eigen::Array4d::Zero();
  for (const std::string unit : {"02", "05", "09"}) {
    std::string manifest = TemporaryFolder::Read(Manifest("public-tumble"));
    for (std::size_t at = 0; (at = manifest.find("unit02", at)) != std::string::npos;) {
      manifest.replace(at, 6, "unit" + unit);
      at += 6;
    }
    const Outcomes run = Run("public-tumble", work().Write("tumble" + unit + ".yaml", manifest));
    ASSERT_EQ(run.exit_code, 0) << run.text;
    for (const Finding& finding : run.calibration.findings) {
      EXPECT_NE(finding.code, FindingCode::kFault) << finding.text;
    }
    sum += SquaredErrors(run.calibration, File("s-tumble-public-simulator/truth" + unit + ".json"));
  }
  const Eigen::Array4d rms = (sum / 3.0).sqrt();
  EXPECT_LT(rms[0], 3.37e-3);
  EXPECT_LT(rms[1], 1.30e-4);
  EXPECT_LT(rms[2], 7.21e-4);
  EXPECT_LT(rms[3], 0.0155);
}

// The clocks are off by 6.25 ms without a shift.
TEST_F(JointRecordings, AGyroscopeWhoseStampsAreShiftedIsFoundLateAndNothingElseChanges) {
  for (const double shift_s : {-0.05, -0.00625, 0.00625, 0.05}) {
    const std::string late = work().Path("late.csv");
    const Finished made =
        RunShell("zcat '" + File("s-tumble-public-simulator/unit02.csv.gz") +
                 "' | awk -F, 'NR == 1 { print; next } { sub(/^[^,]*/, sprintf(\"%.6f\", $1 + " +
                 std::to_string(shift_s) + ")); print }' > '" + late + "'");
    ASSERT_EQ(made.exit_code, 0) << made.err;
    std::string manifest = TemporaryFolder::Read(Manifest("public-tumble"));
    const std::size_t at = manifest.find("file: ", manifest.find("  gyroscope:")) + 6;
    manifest.replace(at, manifest.find('\n', at) - at, late);
    const Outcomes run = Run("public-tumble", work().Write("late.yaml", manifest));
    ASSERT_EQ(run.exit_code, 0) << run.text;
    SquaredErrors(run.calibration, File("s-tumble-public-simulator/truth02.json"));
    const double later_s = 0.00625 - shift_s;  // of the magnetometer against the gyroscope
    bool is_found = false;
    for (const Finding& finding : run.calibration.findings) {
      EXPECT_NE(finding.code, FindingCode::kFault) << finding.text;
      if (finding.code != FindingCode::kClockCorrected) continue;
      if (finding.sensor != Triad::kMagnetometer) continue;
      is_found = true;
      for (const FindingValue& value : finding.values) {
        if (value.name != "offset") continue;
        EXPECT_NEAR(value.value, later_s, 3.0 * *value.sigma);
      }
    }
    EXPECT_EQ(is_found, std::abs(later_s) > 0.001) << shift_s;
  }
}

}  // namespace joint_test
}  // namespace truetriad
