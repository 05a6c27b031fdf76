// SPDX-License-Identifier: Apache-2.0
#include "data/move_recorder.h"

#include <cmath>
#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/memory_source.h"
#include "support/finding_matchers.h"
#include "truetriad/data/pose_collection.h"

namespace truetriad {
namespace move_recorder_test {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t kStepNs = 10'000'000;

// Rests of rows 0-199, 300-499, 600-799 with turns between them, at 100 Hz; the accelerometer's
// rows are half a step later than the gyroscope's.
class RecordedMoves : public ::testing::Test {
 protected:
  static bool IsMove(std::int64_t row) { return row % 300 >= 200; }
  static Eigen::Vector3d Rate(std::int64_t row) {
    const double noise = 0.01 * std::sin(12.9898 * static_cast<double>(row * row));
    if (!IsMove(row)) return {noise, -noise, 2.0 * noise};
    return {noise, -noise, 100.0 * std::sin(0.031415 * static_cast<double>(row % 300 - 199))};
  }

  Result<PoseSet> Collect(const std::function<void(std::int64_t, MemoryStream*)>& add_gyroscope,
                          bool moves = true,
                          const std::vector<StatedTurn>& turns = {}) {
    MemoryStream gyroscope(Triad::kGyroscope), accelerometer(Triad::kAccelerometer);
    gyroscope.info.file = "gyroscope.csv";
    for (std::int64_t row = 0; row < 800; ++row) {
      add_gyroscope(row, &gyroscope);
      accelerometer.Add(row * kStepNs + kStepNs / 2,
                        Eigen::Vector3d(static_cast<double>(row) + 0.5, Rate(row).x(), 1.0));
    }
    MemorySource source({gyroscope, accelerometer}, 77);
    PoseSelection selection;
    selection.kind = PoseSelectionKind::kRanges;
    selection.ranges = {{0, 199, {}, {}}, {300, 499, {}, {}}, {600, 799, {}, {}}};
    selection.moves = moves;
    selection.turns = turns;
    return CollectPoses(source, selection);
  }
};

TEST_F(RecordedMoves, ReachFromTheLastReadingOfARestToTheFirstOfTheNext) {
  const auto set = Collect(
      [](std::int64_t row, MemoryStream* stream) { stream->Add(row * kStepNs, Rate(row)); });
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->moves.size(), 2U);
  for (const RecordedMove& move : set->moves) {
    EXPECT_FALSE(move.fault);
    const std::int64_t first = 200 + 300 * static_cast<std::int64_t>(move.from);
    // The accelerometer's rest ends half a step after its last row's gyroscope reading.
    EXPECT_EQ(move.time_ns.front(), (first - 1) * kStepNs);
    EXPECT_EQ(move.time_ns.back(), (first + 101) * kStepNs);
    ASSERT_EQ(move.accelerometer_raw.size(), move.time_ns.size());
    for (std::size_t i = 0; i < move.time_ns.size(); ++i) {
      const auto row = static_cast<double>(move.time_ns[i]) / static_cast<double>(kStepNs);
      EXPECT_NEAR(move.accelerometer_raw[i].x(), row, 1e-9);
      EXPECT_EQ(move.gyroscope_raw[i], Rate(static_cast<std::int64_t>(row)));
    }
  }
}

// A rate that is at its largest stays on one step of a coarse gyroscope; a rate that is cut off
// comes to its limit from further away.
TEST_F(RecordedMoves, CoarseStepsAreNoSaturation) {
  const auto coarse = Collect([](std::int64_t row, MemoryStream* stream) {
    stream->Add(row * kStepNs, 10.0 * (Rate(row) / 10.0).array().round().matrix());
  });
  ASSERT_TRUE(coarse) << coarse.error().message;
  for (const RecordedMove& move : coarse->moves) {
    EXPECT_FALSE(move.fault && move.fault->code == FindingCode::kTurnSaturated);
  }
  const auto cut_off = Collect([](std::int64_t row, MemoryStream* stream) {
    stream->Add(row * kStepNs, Rate(row).cwiseMin(60.0));
  });
  ASSERT_TRUE(cut_off) << cut_off.error().message;
  for (const RecordedMove& move : cut_off->moves) {
    ASSERT_TRUE(move.fault);
    EXPECT_EQ(move.fault->code, FindingCode::kTurnSaturated);
  }
}

// A turn's readings reach into the rests on both sides, which drop all but their last and first.
TEST_F(RecordedMoves, OfStatedTurnsHoldAllTheirRows) {
  StatedTurn by_rows;
  by_rows.at.rows = {190, 310};
  StatedTurn inside_a_rest;
  inside_a_rest.at.rows = {620, 640};
  StatedTurn by_pose;
  by_pose.at.pose = 2;
  const auto add = [](std::int64_t row, MemoryStream* stream) {
    stream->Add(row * kStepNs, Rate(row));
  };
  const auto set = Collect(add, true, {by_rows, inside_a_rest, by_pose});
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->turns.size(), 3U);
  // Rows are the accelerometer's, half a step later than the gyroscope's.
  EXPECT_EQ(set->turns[0].move.time_ns.front(), 191 * kStepNs);
  EXPECT_EQ(set->turns[0].move.time_ns.back(), 310 * kStepNs);
  EXPECT_EQ(set->turns[0].move.time_ns.size(), 120U);
  EXPECT_EQ(set->turns[1].move.time_ns.size(), 20U);
  EXPECT_EQ(set->turns[2].move.time_ns, set->moves[1].time_ns);
  for (const KnownTurn& turn : set->turns) EXPECT_FALSE(turn.move.fault);

  StatedTurn after_the_last;
  after_the_last.at.pose = 3;
  const auto refused = Collect(add, true, {after_the_last});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("pose 3"));
}

TEST_F(RecordedMoves, AreKeptOnlyWhenAskedFor) {
  const auto set = Collect(
      [](std::int64_t row, MemoryStream* stream) { stream->Add(row * kStepNs, Rate(row)); }, false);
  ASSERT_TRUE(set);
  EXPECT_THAT(set->moves, IsEmpty());
}

TEST_F(RecordedMoves, SayWhyTheyCannotBeIntegrated) {
  const auto gap = Collect([](std::int64_t row, MemoryStream* stream) {
    if (row < 240 || row > 260) stream->Add(row * kStepNs, Rate(row));
  });
  ASSERT_TRUE(gap) << gap.error().message;
  ASSERT_TRUE(gap->moves[0].fault);
  EXPECT_THAT(*gap->moves[0].fault, HasCode(FindingCode::kTurnGap));
  EXPECT_NEAR(*gap->moves[0].fault->Value("gap"), 0.22, 0.005);
  EXPECT_FALSE(gap->moves[1].fault);

  const auto saturated = Collect([](std::int64_t row, MemoryStream* stream) {
    stream->Add(row * kStepNs, Rate(row).cwiseMin(95.0));
  });
  ASSERT_TRUE(saturated);
  ASSERT_TRUE(saturated->moves[0].fault);
  EXPECT_THAT(*saturated->moves[0].fault, HasCode(FindingCode::kTurnSaturated));
  EXPECT_EQ(saturated->moves[0].fault->axis, 2);
  EXPECT_EQ(saturated->moves[0].fault->Value("limit"), 95.0);

  // An axis that only turns one way, read in steps as coarse as its noise: its other extreme is its
  // reading at rest.
  const auto one_way = Collect([](std::int64_t row, MemoryStream* stream) {
    constexpr double kResolution = 0.01;
    stream->Add(row * kStepNs, kResolution * (Rate(row) / kResolution).array().round().matrix());
  });
  ASSERT_TRUE(one_way) << one_way.error().message;
  for (const RecordedMove& move : one_way->moves) EXPECT_FALSE(move.fault);
}

TEST_F(RecordedMoves, AreNoneWhereTheGyroscopeSaysNothing) {
  const auto set = Collect([](std::int64_t, MemoryStream*) {});
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_THAT(set->moves, IsEmpty());
}

// A lost reading and a time stamp that comes twice are what logs have.
TEST_F(RecordedMoves, BridgeALostReadingAndADuplicateTime) {
  const auto set = Collect([](std::int64_t row, MemoryStream* stream) {
    if (row != 250) stream->Add((row == 551 ? 550 : row) * kStepNs, Rate(row));
  });
  ASSERT_TRUE(set) << set.error().message;
  for (const RecordedMove& move : set->moves) EXPECT_FALSE(move.fault);
}

// A day of motion between two rests, then a day of rest, at 100 Hz, judged every 27 minutes as
// static detection does: 3e7 readings pass by.
TEST(MoveRecorder, HoldsNoMoreThanATurnMayTakeHoweverLongNothingRestsOrOneRestLasts) {
  constexpr std::int64_t kDay = 8'640'000;
  constexpr std::int64_t kJudged = 163'840;
  constexpr std::int64_t kBlock = 4096;
  MoveRecorder recorder(Triad::kAccelerometer, {});
  StaticPose first;
  first.start_ns = 0;
  first.end_ns = 500 * kStepNs;
  StaticPose second;
  second.start_ns = kDay * kStepNs;
  second.end_ns = 2 * kDay * kStepNs;
  std::vector<std::int64_t> times;
  std::vector<std::int64_t> rows(kBlock);
  std::vector<double> x(kBlock), y(kBlock), z(kBlock);
  std::int64_t judged = 0;
  for (std::int64_t row = 0; row < 2 * kDay; row += kBlock) {
    times.clear();
    for (std::int64_t i = row; i < row + kBlock; ++i) times.push_back(i * kStepNs);
    for (const Triad triad : {Triad::kGyroscope, Triad::kAccelerometer}) {
      recorder.Add({triad, times, x, y, z, {}, {}, rows});
    }
    if (row - judged < kJudged) continue;
    if (judged == 0) recorder.DropRest(first);
    judged = row;
    recorder.DropLongMove(judged * kStepNs);
  }
  recorder.DropRest(second);
  // What has not been judged, a block more, and the longest turn.
  EXPECT_LT(recorder.peak_readings(),
            kJudged + 2 * kBlock + static_cast<std::int64_t>(100 * MoveRecorder::kLongestMoveS));
  PoseSet set;
  set.poses = {first, second};
  set.streams.emplace_back().triad = Triad::kGyroscope;
  const std::vector<RecordedMove> moves = recorder.Moves(set);
  ASSERT_EQ(moves.size(), 1U);
  ASSERT_TRUE(moves[0].fault);
  EXPECT_THAT(*moves[0].fault, HasCode(FindingCode::kTurnTooLong));
  EXPECT_THAT(moves[0].gyroscope_raw, IsEmpty());
}

// The same readings as without, although rests and a long move were dropped on the way.
TEST_F(RecordedMoves, OfOrdinaryLengthStayWholeBesideALongOne) {
  const std::int64_t kLong = 100 * static_cast<std::int64_t>(MoveRecorder::kLongestMoveS) + 50'000;
  MemoryStream gyroscope(Triad::kGyroscope), accelerometer(Triad::kAccelerometer);
  for (std::int64_t row = 0; row < kLong + 800; ++row) {
    const std::int64_t shown = row < 300 ? row : std::max<std::int64_t>(300, row - kLong);
    gyroscope.Add(row * kStepNs, row < 300 || row >= kLong + 300 ? Rate(shown) : Rate(250));
    accelerometer.Add(row * kStepNs, {static_cast<double>(row), Rate(shown).x(), 1.0});
  }
  MemorySource source({gyroscope, accelerometer}, 77);
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kRanges;
  selection.ranges = {
      {0, 199, {}, {}}, {kLong + 300, kLong + 499, {}, {}}, {kLong + 600, kLong + 799, {}, {}}};
  selection.moves = true;
  const auto set = CollectPoses(source, selection);
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->moves.size(), 2U);
  ASSERT_TRUE(set->moves[0].fault);
  EXPECT_THAT(*set->moves[0].fault, HasCode(FindingCode::kTurnTooLong));
  const Finding* left_out = Find(set->findings, FindingCode::kTurnTooLong);
  ASSERT_NE(left_out, nullptr);
  EXPECT_EQ(left_out->pose, 1);
  EXPECT_FALSE(set->moves[1].fault);
  // Both ends of the turn are readings at rest: rows 499 to 600.
  ASSERT_EQ(set->moves[1].time_ns.size(), 102U);
  EXPECT_EQ(set->moves[1].time_ns.front(), (kLong + 499) * kStepNs);
}

// Of one reason in one line.
TEST_F(RecordedMoves, ThatAreLeftOutForOneReasonAreNamedTogether) {
  const auto stuck = Collect([](std::int64_t row, MemoryStream* stream) {
    const bool repeats = (row > 210 && row < 290) || (row > 510 && row < 590);
    stream->Add(row * kStepNs, Rate(repeats ? 210 : row));
  });
  ASSERT_TRUE(stuck) << stuck.error().message;
  int lines = 0;
  for (const Finding& finding : stuck->findings) {
    if (!finding.Value("turns")) continue;
    ++lines;
    EXPECT_EQ(finding.Value("turns"), 2.0);
    EXPECT_EQ(finding.sensor, Triad::kGyroscope);
    EXPECT_THAT(finding, Says(HasSubstr("starting at poses 1, 2")));
  }
  EXPECT_EQ(lines, 1);
}

}  // namespace move_recorder_test
}  // namespace truetriad
