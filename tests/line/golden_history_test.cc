// SPDX-License-Identifier: Apache-2.0
#include "line/golden_history.h"

#include <cmath>

#include <gtest/gtest.h>

namespace truetriad::line {
namespace golden_history_test {

StationCheck CheckOf(const std::string& station, const std::string& created, double largest) {
  return {.station = station,
          .serial = "G1",
          .created = created,
          .agrees = std::abs(largest) < 3.5,
          .p = 0.3,
          .largest = largest,
          .parameter = "accelerometer.bias.x"};
}

TEST(GoldenHistory, SaysOfEachStationWhetherItMayBeTrusted) {
  const std::vector<GoldenHistory> histories =
      FindGoldenHistories({CheckOf("C", "2026-11-22T10:00:00Z", 4.0),
                           CheckOf("B", "2026-11-23T09:00:00Z", 1.0),
                           CheckOf("D", "2026-11-25T09:00:00Z", 1.0),
                           CheckOf("C", "2026-11-24T12:00:00Z", 0.4),
                           CheckOf("B", "2026-11-24T11:00:00Z", 1.0),
                           CheckOf("A", "2026-11-24T11:00:00Z", 5.0)},
                          "2026-11-24T18:00:00Z",
                          6.5);
  ASSERT_EQ(histories.size(), 4u);
  EXPECT_EQ(histories[0].state, GoldenState::kDisagrees);
  EXPECT_EQ(histories[1].state, GoldenState::kOverdue);
  EXPECT_DOUBLE_EQ(histories[1].age_h, 7.0);
  // Once it disagreed; the last check counts.
  EXPECT_EQ(histories[2].state, GoldenState::kGood);
  EXPECT_EQ(histories[2].disagreed, 1);
  EXPECT_EQ(histories[2].checks.front().largest, 4.0);
  // Of a time to come.
  EXPECT_EQ(histories[3].state, GoldenState::kOverdue);
}

TEST(GoldenHistory, TrustsNoCheckThatHasNoDate) {
  const auto histories =
      FindGoldenHistories({CheckOf("A", "yesterday", 0.1)}, "2026-11-08T07:00:00Z", 24.0);
  EXPECT_EQ(histories.front().state, GoldenState::kOverdue);
}

}  // namespace golden_history_test
}  // namespace truetriad::line
