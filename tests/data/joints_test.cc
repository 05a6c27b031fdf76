// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/collector.h"
#include "data/memory_source.h"
#include "support/finding_matchers.h"
#include "truetriad/data/pose_collection.h"

namespace truetriad {
namespace joints_test {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using ::testing::Contains;
using ::testing::Each;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr std::int64_t kSpacingNs = 10'000'000;

struct Row {
  Vector3d force_mps2, rate_radps, field_ut;
};
using Rows = std::vector<Row>;

// A unit at 100 Hz that is turned by hand, with noise.
class Unit9 {
 public:
  void Rest(double duration_s) {
    for (int i = 0; i < std::lround(100.0 * duration_s); ++i) Add(Vector3d::Zero());
  }
  void Turn(const Vector3d& axis, double angle_rad, double duration_s) {
    const int steps = static_cast<int>(std::lround(100.0 * duration_s));
    for (int i = 0; i < steps; ++i) {
      const double share = std::numbers::pi * (i + 0.5) / steps;
      const Vector3d rate =
          0.5 * std::numbers::pi * angle_rad / duration_s * std::sin(share) * axis.normalized();
      Add(rate);
      attitude_ = attitude_ * Quaterniond(Eigen::AngleAxisd(0.01 * rate.norm(), axis.normalized()));
    }
  }
  const Rows& rows() const { return rows_; }

 private:
  void Add(const Vector3d& rate) {
    const Quaterniond to_body = attitude_.conjugate();
    rows_.push_back(
        {to_body * Vector3d(0.0, 0.0, 9.8) + 0.02 * Normal(),
         rate + 0.002 * Normal(),
         to_body * Vector3d(20.0, 0.0, -43.0) + Vector3d(5.0, -3.0, 8.0) + 0.3 * Normal()});
  }
  Vector3d Normal() {
    std::normal_distribution<double> normal;
    const double x = normal(random_), y = normal(random_), z = normal(random_);
    return {x, y, z};
  }

  std::mt19937 random_{7};
  Quaterniond attitude_ = Quaterniond::Identity();
  Rows rows_;
};

// Ten rests of 3 s, 1 s of turning by 60 to 170 deg between them.
Rows RestsAndTurns() {
  Unit9 unit;
  for (int i = 0; i < 10; ++i) {
    unit.Rest(3.0);
    unit.Turn(Vector3d(std::sin(i), std::cos(2.0 * i), std::sin(3.0 * i)), 1.0 + 0.2 * i, 1.0);
  }
  return unit.rows();
}

Rows Without(Rows rows, int begin, int end) {
  rows.erase(rows.begin() + begin, rows.begin() + end);
  return rows;
}

PoseSet Collect(const Rows& rows,
                PoseSelectionKind kind,
                double gyroscope_unit = 1.0,
                bool field = true) {
  MemoryStream accelerometer(Triad::kAccelerometer), gyroscope(Triad::kGyroscope),
      magnetometer(Triad::kMagnetometer);
  accelerometer.info.unit = {"m/s^2", 1.0, false};
  gyroscope.info.unit = {"rad/s", 1.0, false};
  magnetometer.info.unit = {"uT", 1.0, false};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::int64_t time_ns = kSpacingNs * static_cast<std::int64_t>(i);
    accelerometer.Add(time_ns, rows[i].force_mps2);
    gyroscope.Add(time_ns, rows[i].rate_radps / gyroscope_unit);
    magnetometer.Add(time_ns, rows[i].field_ut);
  }
  std::vector<MemoryStream> streams = {accelerometer, gyroscope};
  if (field) streams.push_back(magnetometer);
  MemorySource source(streams);
  PoseSelection selection;
  selection.kind = kind;
  selection.moves = true;
  Result<PoseSet> set = CollectPoses(source, selection);
  EXPECT_TRUE(set) << set.error().message;
  return set ? *std::move(set) : PoseSet();
}
PoseSet CollectRests(const Rows& rows, double gyroscope_unit = 1.0, bool field = true) {
  return Collect(rows, PoseSelectionKind::kDetect, gyroscope_unit, field);
}
PoseSet CollectMotion(const Rows& rows) { return Collect(rows, PoseSelectionKind::kMotion); }

std::vector<std::size_t> JoinedMoves(const PoseSet& set) {
  std::vector<std::size_t> joined;
  for (const RecordedMove& move : set.moves) {
    if (move.fault && move.fault->code == FindingCode::kJoinedRecording)
      joined.push_back(move.from);
  }
  return joined;
}

TEST(Joints, AreNotInARecordingOfOnePiece) {
  for (const bool field : {true, false}) {
    const PoseSet set = CollectRests(RestsAndTurns(), 1.0, field);
    EXPECT_THAT(set.poses, SizeIs(10));
    EXPECT_THAT(JoinedMoves(set), IsEmpty());
  }
  EXPECT_THAT(CollectMotion(RestsAndTurns()).joints, IsEmpty());
}

// Rows 400 k to 400 k + 299 are rest number k.
TEST(Joints, AreWhereATurnWasCutOut) {
  for (const bool field : {true, false}) {
    const PoseSet set = CollectRests(Without(RestsAndTurns(), 1050, 1250), 1.0, field);
    EXPECT_THAT(JoinedMoves(set), ::testing::ElementsAre(2));
    ASSERT_THAT(set.findings, Contains(HasCode(FindingCode::kJoinedRecording)));
    const Finding& joined = *Find(set.findings, FindingCode::kJoinedRecording);
    EXPECT_NEAR(*joined.Value("time"), 10.5, 1e-9);
    EXPECT_NEAR(*joined.Value("row"), 1050.0, 1.0);
  }
}

TEST(Joints, WithinATurnAreToldByGravityAndFieldTogether) {
  const PoseSet set = CollectRests(Without(RestsAndTurns(), 1550, 2750));
  EXPECT_THAT(JoinedMoves(set), ::testing::ElementsAre(3));
  ASSERT_THAT(set.findings, Contains(HasCode(FindingCode::kJoinedRecording)));
  EXPECT_NEAR(*Find(set.findings, FindingCode::kJoinedRecording)->Value("time"), 15.5, 1e-9);
}

// Vector sensors that a log repeats 25 times turn by up to 60 deg at once.
TEST(Joints, AreNotMadeByReadingsThatAreHeld) {
  Rows rows = RestsAndTurns();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].force_mps2 = rows[i - i % 25].force_mps2;
    rows[i].field_ut = rows[i - i % 25].field_ut;
  }
  EXPECT_THAT(JoinedMoves(CollectRests(rows)), IsEmpty());
}

TEST(Joints, AreNotMadeByAGyroscopeInAnotherUnit) {
  // rad/s labelled deg/s: each reading is 57 times too small, but gravity turns bit by bit.
  EXPECT_THAT(JoinedMoves(CollectRests(RestsAndTurns(), kDegPerRad)), IsEmpty());
  EXPECT_THAT(JoinedMoves(CollectRests(RestsAndTurns(), kDegPerRad, false)), IsEmpty());
}

TEST(Joints, OfAUnitThatNeverRestsAreFoundAtTheirRow) {
  const PoseSet set = CollectMotion(Without(RestsAndTurns(), 1550, 2750));
  ASSERT_THAT(set.joints, SizeIs(1));
  EXPECT_EQ(set.joints[0].time_ns, kSpacingNs * 1550);
  EXPECT_EQ(set.joints[0].row, 1550);
  EXPECT_THAT(set.findings, Contains(HasCode(FindingCode::kJoinedRecording)));
}

TEST(Joints, AreNeitherKnocksNorMagnets) {
  Rows knocked = RestsAndTurns(), disturbed = knocked;
  for (std::size_t i = 1540; i < 1560; ++i) knocked[i].force_mps2 += Vector3d(30.0, -20.0, 10.0);
  for (std::size_t i = 1540; i < disturbed.size(); ++i) {
    disturbed[i].field_ut += Vector3d(30.0, -60.0, 10.0);
  }
  EXPECT_THAT(CollectMotion(knocked).joints, IsEmpty());
  EXPECT_THAT(CollectMotion(disturbed).joints, IsEmpty());
  EXPECT_THAT(JoinedMoves(CollectRests(knocked)), IsEmpty());
  EXPECT_THAT(JoinedMoves(CollectRests(disturbed)), IsEmpty());
}

}  // namespace joints_test
}  // namespace truetriad
