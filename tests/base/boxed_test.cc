// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <utility>

#include <gtest/gtest.h>

#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

TEST(Boxed, IsAsAnOptional) {
  Boxed<int> empty;
  EXPECT_FALSE(empty.has_value());
  EXPECT_FALSE(empty);
  Boxed<int> seven = 7;
  ASSERT_TRUE(seven);
  EXPECT_EQ(*seven, 7);
  seven = std::nullopt;
  EXPECT_FALSE(seven);
  EXPECT_EQ(empty.emplace(), 0);
  empty.reset();
  EXPECT_FALSE(empty);
}

TEST(Boxed, CopiesAreDeep) {
  Boxed<int> first = 1;
  Boxed<int> second = first;
  *second = 2;
  EXPECT_EQ(*first, 1);
  first = second;
  *second = 3;
  EXPECT_EQ(*first, 2);
  const Boxed<int>& itself = first;
  first = itself;
  EXPECT_EQ(*first, 2);
  const Boxed<int> moved = std::move(second);
  EXPECT_EQ(*moved, 3);
}

}  // namespace
}  // namespace truetriad
