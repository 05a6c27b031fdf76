// SPDX-License-Identifier: Apache-2.0
#include "line/line_data.h"

#include <cmath>

#include <gtest/gtest.h>

namespace truetriad::line {
namespace line_data_test {

TEST(LineData, FindsTagsByName) {
  const UnitRecord unit{.tags = {{"lot", "L17"}}};
  EXPECT_EQ(TagOf(unit, "lot"), "L17");
  EXPECT_EQ(TagOf(unit, "station"), "");
}

TEST(Moment, IsReadAsIso8601AndWrittenInUtc) {
  for (const char* same : {"2026-11-24T06:00:00Z",
                           "2026-11-24T06:00",
                           "2026-11-24 06:00:00.0",
                           "2026-11-24T07:00:00+01:00",
                           "2026-11-23T23:30:00-0630"}) {
    EXPECT_EQ(SecondsOf(same), 1795500000.0) << same;
  }
  EXPECT_EQ(MomentOf(1795500000), "2026-11-24T06:00:00Z");
  EXPECT_EQ(SecondsOf("2026-11-24"), 1795500000.0 - 6 * 3600.0);
  EXPECT_EQ(SecondsOf("2026-11-24T06:00:00.25Z"), 1795500000.25);
  for (const char* other : {"",
                            "yesterday",
                            "2026-02-30",
                            "2026-13-01",
                            "24.11.2026",
                            "2026-11-24T",
                            "2026-11-24T06:00:00 CET",
                            "1900-01-01",
                            "2026-11-24T25:00",
                            "06:00"}) {
    EXPECT_TRUE(std::isnan(SecondsOf(other))) << other;
  }
}

}  // namespace line_data_test
}  // namespace truetriad::line
