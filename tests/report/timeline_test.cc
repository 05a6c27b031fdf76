// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "report/charts.h"
#include "report/sample_calibration.h"
#include "report/svg.h"

namespace truetriad {
namespace timeline_test {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// Ten rests of 4 s, a second apart, in 1000 slices; one slice has a reading of 80.
PoseSet Recording() {
  PoseSet set;
  set.duration_s = 50.0;
  for (int i = 0; i < 10; ++i) {
    StaticPose pose;
    pose.number = i + 1;
    pose.start_ns = 5'000'000'000LL * i;
    pose.end_ns = pose.start_ns + 4'000'000'000;
    pose.temperature_degc = 20.0 + i;
    set.poses.push_back(pose);
  }
  StreamSummary stream;
  stream.unit = {"m/s^2", 1.0, false};
  stream.rate_hz = 100.0;
  set.streams.push_back(stream);
  ReadingTrace& trace = set.traces[Triad::kAccelerometer];
  trace.slice_ns = 50'000'000;
  for (int i = 0; i < 1000; ++i) {
    trace.slices.push_back(
        {Eigen::Vector3f(-1.0F, 0.0F, 9.0F), Eigen::Vector3f(1.0F, 0.0F, 10.0F)});
  }
  trace.slices[777].highest_raw[1] = 80.0F;
  return set;
}

std::size_t CountOf(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

TEST(Timeline, ShowsEveryRestAndTheOneReadingThatIsFarOff) {
  const std::string svg =
      TimelineDrawing(Recording(), {{4, Triad::kAccelerometer, "far off"}}, true).svg;
  // Of readings and of temperature.
  EXPECT_EQ(CountOf(svg, "data-pose=\"4\""), 2U);
  EXPECT_THAT(svg, HasSubstr("pose 4: 15.0 to 19.0 s, 23.0 °C; accelerometer rejected: far off"));
  EXPECT_EQ(CountOf(svg, "class=\"rejected\""), 2U);  // The two strokes of a cross.
  EXPECT_EQ(CountOf(svg, "class=\"trace "), 3U);
  // y lies level but for the one reading, which goes up over most of the panel and comes back.
  const std::size_t begin = svg.find("class=\"trace y\"");
  const std::string path = svg.substr(begin, svg.find("/>", begin) - begin);
  EXPECT_THAT(path, HasSubstr("v-1"));
  EXPECT_LT(path.size(), 120U);
}

TEST(Timeline, ScalesByAllButAReadingThatIsAbsurdAndSaysItsValue) {
  PoseSet set = Recording();
  set.traces[Triad::kAccelerometer].slices[500].highest_raw[0] = 1e9F;
  const std::string svg = TimelineDrawing(set, {}, false).svg;
  EXPECT_THAT(svg, HasSubstr(">1e+09</text>"));
  EXPECT_THAT(svg, HasSubstr(">80</text>"));  // Beyond all but the absurd one.
  EXPECT_EQ(CountOf(svg, "small far"), 2U);
  EXPECT_EQ(CountOf(TimelineDrawing(Recording(), {}, false).svg, "small far"), 0U);
}

// Means of one temperature throughout differ by their last bits.
TEST(Timeline, EndsWhereMarksAreNearerThanNumbers) {
  PoseSet set = Recording();
  for (StaticPose& pose : set.poses) pose.temperature_degc = 25.3;
  set.poses[3].temperature_degc = std::nextafter(25.3, 26.0);
  const std::string svg = TimelineDrawing(set, {}, false).svg;
  EXPECT_LT(svg.size(), 3 * TimelineDrawing(Recording(), {}, false).svg.size());
}

TEST(Timeline, BeginsWithTheRecordingWhatOfItIsLeftOut) {
  PoseSet set = Recording();
  set.excluded.push_back({-22'000'000'000, -1});
  EXPECT_THAT(TimelineDrawing(set, {}, true).svg, HasSubstr("pose 1: 22.0 to 26.0 s"));
}

TEST(Timeline, HasNothingThatLeadsToRowsWhereThereAreNone) {
  EXPECT_THAT(TimelineDrawing(Recording(), {}, false).svg, Not(HasSubstr("data-pose")));
}

TEST(Timeline, BreaksWhereReadingsAreMissing) {
  PoseSet set = Recording();
  for (std::size_t i = 300; i < 400; ++i) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    set.traces[Triad::kAccelerometer].slices[i] = {Eigen::Vector3f::Constant(kInfinity),
                                                   Eigen::Vector3f::Constant(-kInfinity)};
  }
  EXPECT_EQ(CountOf(TimelineDrawing(set, {}, false).svg, "class=\"trace x\""), 2U);
}

TEST(Timeline, IsNotThereWithoutTimesOrOfSeveralRecordings) {
  PoseSet set = Recording();
  set.sessions.resize(2);
  EXPECT_THAT(TimelineDrawing(set, {}, true).svg, IsEmpty());
  set = Recording();
  set.has_time = false;
  EXPECT_THAT(TimelineDrawing(set, {}, true).svg, IsEmpty());
}

TEST(Timeline, OfAnUnusableCalibrationIsInItsPage) {
  const PoseSet set = Recording();
  EXPECT_THAT(CalibrationHtml({}, {}, {.poses = &set, .noise = {}}),
              HasSubstr("The recording over time"));
  EXPECT_THAT(CalibrationHtml({}, {}, {.poses = &set, .noise = {}}),
              Not(HasSubstr("data-pose=\"")));
  EXPECT_THAT(CalibrationHtml({}), Not(HasSubstr("The recording over time")));
}

TEST(Zigzag, IsALineInHalfUnits) {
  Svg svg(10, 10, "");
  svg.Zigzag({{1, 5, 5}, {2, 5, 5}, {3, 5, 5}, {4, 8, 2}, {5, 2, 2}, {6, 9, 9}}, "trace");
  EXPECT_THAT(svg.Finish(), HasSubstr("d=\"M2 10h4l2 6v-12h2l2 14\""));
}

}  // namespace timeline_test
}  // namespace truetriad
