// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>

#include <Eigen/Core>

namespace truetriad {

// The value of `device.firmware` for a log of ArduPilot up to 3.2. This firmware rotates inertial
// readings y into the vehicle's axes, scales them and then subtracts offsets: s o (R y) - b.
inline constexpr std::string_view kArduPilotOf2014 = "ardupilot-3.2";

// Whether the firmware of a log reads the parameters of `format`.
inline bool Reads(std::string_view firmware, std::string_view format) {
  return firmware == format || (firmware == kArduPilotOf2014 && format == "ardupilot");
}

// The name of an autopilot's parameter. In the pattern `@` is the instance, `#` the instance unless
// it is ArduPilot's first, `*` the axis' letter, `?` its number, `%` a power. ArduPilot:
// "INS_ACC2OFFS_X" is INS_ACC#OFFS_*, "INS_TCAL1_ACC2_Y" INS_TCAL@_ACC%_*; beyond the third IMU
// names begin with INS4_ (AP_InertialSensor.cpp, AP_InertialSensor_Params.cpp, AP_Compass.cpp).
// `instance` counts as the autopilot does, PX4 from 0 and ArduPilot from 1.
inline std::string Expanded(std::string_view pattern,
                            int instance,
                            std::size_t axis = 0,
                            std::size_t power = 0) {
  constexpr int kLastOfShortNames = 3;  // The group had no room for a fourth IMU.
  const std::string number = std::to_string(instance);
  const bool is_late = pattern.starts_with("INS_") && instance > kLastOfShortNames;
  const std::map<char, std::string> words = {{'@', is_late ? "" : number},
                                             {'#', is_late || instance == 1 ? "" : number},
                                             {'*', std::string(1, "XYZ"[axis])},
                                             {'?', std::to_string(axis)},
                                             {'%', std::to_string(power)}};
  std::string name;
  for (const char c : pattern) {
    const auto word = words.find(c);
    name += word == words.end() ? std::string(1, c) : word->second;
  }
  if (is_late) name.insert(3, number);
  return name;
}

// The matrix D s of an ArduPilot compass from DIA, ODI, SCALE. D symmetric. AP_Compass_Backend.cpp.
template <typename Scalar>
Eigen::Matrix<Scalar, 3, 3> CompassMatrixOf(Eigen::Vector3<Scalar> d,
                                            const Eigen::Vector3<Scalar>& o,
                                            Scalar scale) {
  constexpr Scalar kMostScale = 1.5;  // Firmware ignores a scale outside 1/1.5 to 1.5.
  if (d.isZero(0)) d.setOnes();       // A zero diagonal means that DIA is not used.
  Eigen::Matrix<Scalar, 3, 3> matrix;
  matrix << d[0], o[0], o[1], o[0], d[1], o[2], o[1], o[2], d[2];
  if (scale >= 1 / kMostScale && scale <= kMostScale) matrix *= scale;
  return matrix;
}

}  // namespace truetriad
