// SPDX-License-Identifier: Apache-2.0
#include "line/line_data.h"

#include <gtest/gtest.h>

namespace truetriad::line {
namespace line_data_test {

TEST(LineData, FindsParametersAndTagsByName) {
  const LineData data{.parameters = {"accelerometer.bias.x", "gyroscope.bias.z"}};
  EXPECT_EQ(PlaceOf(data, "gyroscope.bias.z"), 1);
  EXPECT_EQ(PlaceOf(data, "gyroscope.bias.x"), std::nullopt);
  const UnitRecord unit{.tags = {{"lot", "L17"}}};
  EXPECT_EQ(TagOf(unit, "lot"), "L17");
  EXPECT_EQ(TagOf(unit, "station"), "");
}

}  // namespace line_data_test
}  // namespace truetriad::line
