// SPDX-License-Identifier: Apache-2.0
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include "truetriad/model/calibration.h"

namespace truetriad {
namespace mounting_test {

TEST(AxisMaps, AreFortyEightHalfOfThemMirrored) {
  std::set<std::string> names;
  double determinants = 0.0;
  for (const Eigen::Matrix3d& map : AllAxisMaps()) {
    names.insert(AxisMapName(map));
    determinants += map.determinant();
    EXPECT_EQ(map * map.transpose(), Eigen::Matrix3d::Identity());
    EXPECT_EQ(AxisMapFromName(AxisMapName(map)), map);
    EXPECT_EQ(NearestAxisMap(Eigen::Vector3d(3.0, 1.0, 0.2).asDiagonal() * map), map);
  }
  EXPECT_EQ(names.size(), 48U);
  EXPECT_EQ(determinants, 0.0);
  EXPECT_EQ(AllAxisMaps().front(), Eigen::Matrix3d::Identity());
}

TEST(AxisMaps, AreNamedByTheBodyAxisOfEachSensingAxis) {
  Eigen::Matrix3d map;
  map << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  EXPECT_EQ(AxisMapName(map), "+y+x-z");
  for (const char* none : {"", "x+y+z", "+x+x+z", "+x+y", "+x+y+z ", "+X+Y+Z"}) {
    EXPECT_FALSE(AxisMapFromName(none)) << none;
  }
}

// Rz(yaw) Ry(pitch) Rx(roll) from sensor to body axes: by a yaw of 90 deg sensing x is along body
// y.
TEST(AxisMaps, HaveTheNamesOfMavlinksRotations) {
  const std::pair<const char*, const char*> same[] = {{"ROTATION_NONE", "+x+y+z"},
                                                      {"ROTATION_YAW_90", "+y-x+z"},
                                                      {"ROTATION_YAW_180", "-x-y+z"},
                                                      {"ROTATION_ROLL_180", "+x-y-z"},
                                                      {"ROTATION_ROLL_180_YAW_90", "+y+x-z"},
                                                      {"MAV_SENSOR_ROTATION_PITCH_270", "+z+y-x"},
                                                      {"ROTATION_ROLL_90_PITCH_180", "-x-z-y"}};
  for (const auto& [rotation, axes] : same) {
    ASSERT_TRUE(AxisMapFromName(rotation)) << rotation;
    EXPECT_EQ(AxisMapName(*AxisMapFromName(rotation)), axes) << rotation;
  }
  for (const char* none : {"ROTATION_",
                           "ROTATION_YAW_45",
                           "ROTATION_YAW",
                           "ROTATION_YAW_90_ROLL_90",
                           "ROTATION_CUSTOM",
                           "ROTATION_YAW_900",
                           "ROTATION_YAW_90_"}) {
    EXPECT_FALSE(AxisMapFromName(none)) << none;
  }
}

}  // namespace mounting_test
}  // namespace truetriad
